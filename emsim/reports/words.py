"""The reference of a card word: a machine card from its spec, a SPICE element from its class."""

from __future__ import annotations

from ..cards import CARDS
from ..cards.motors import MODELS
from ..elements import LETTERS as ELEMENTS

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from ..cards.base import Card, Param
    from ..elements import Element

# machine cards by their word, motors by the type of their .model as well
KNOWN: dict[str, type[Card]] = {**CARDS, **{kind.upper(): card for kind, card in MODELS.items()}}
LETTERS: dict[str, type[Element]] = {letter.upper(): kind for letter, kind in ELEMENTS.items()}
# elements by what they are called: capacitor, voltage source
NAMES: dict[str, type[Element]] = {kind.what.lower(): kind for kind in LETTERS.values()}
NAMES |= {
    "coil": LETTERS["L"],
    "transistor": LETTERS["Q"],
    "switch": LETTERS["S"],
    "transformer": LETTERS["K"],
}

# what a card's laws are about
BRINGS = {
    "T": "kinetic energy", "V": "potential energy", "W": "co-energy", "P": "heat", "i": "electrical side", "q": "constraint",
    "k": "at ticks", "Q": "kept", "f": "goes through",
}  # fmt: skip


def is_word(what: str) -> bool:
    """MOTOR, r, a letter with a card."""
    return what.upper() in KNOWN or what.upper() in LETTERS or what.lower() in NAMES


def lines(what: str) -> Iterator[str]:
    """The reference, line by line."""
    word = what.upper()
    yield from _card(word) if word in KNOWN else _element(LETTERS.get(word) or NAMES[what.lower()])


def facts(what: str) -> dict[str, object]:
    """The same as plain data."""
    word = what.upper()
    if word not in KNOWN:
        kind = LETTERS.get(word) or NAMES[what.lower()]
        return {"word": word, "meaning": kind.what, "form": kind.form, "laws": {"": kind.law}}
    spec = KNOWN[word].spec
    params = {
        key: {
            "unit": p.unit, "default": p.default if isinstance(p.default, (int, float, str, bool)) else None,
            "required": p.required, "meaning": p.meaning, "least": p.least, "above": p.above, "words": list(p.words),
        }
        for key, p in spec.params.items()
    }  # fmt: skip
    return {"word": word, "meaning": spec.meaning, "form": spec.form, "laws": spec.laws, "parameters": params}


def _card(word: str) -> Iterator[str]:
    card = KNOWN[word]
    spec = card.spec
    yield f"{spec.word}: {spec.meaning}"
    yield ""
    yield f"  {spec.form}"
    marks = " or ".join(f"{m}=" for m in spec.mark if m != "kind")
    if marks:
        yield f"  A line that begins with {spec.word} is this card where it has {marks}; otherwise it is SPICE."
    if spec.params:
        yield ""
        yield from table([(key, p.unit or "-", default(p), meaning(p)) for key, p in spec.params.items()])
    if word == "MOTOR":
        yield ""
        yield "  other machines, by the type of their .model (emsim help pmsm, ..):"
        yield from table(
            [(kind, machine.spec.meaning) for kind, machine in MODELS.items() if machine is not card]
        )
    if spec.laws:
        yield ""
        for kind, law in spec.laws.items():
            yield f"  {BRINGS[kind]:<17} {law}"


def meaning(p: Param) -> str:
    """What a parameter is, with its limits."""
    said = limits(p)
    return p.meaning + (f" ({', '.join(said)})" if said else "")


def limits(p: Param) -> list[str]:
    """What its value may be."""
    said = []
    if p.least is not None:
        said.append(f"at least {p.least:g}")
    if p.above is not None:
        said.append(f"greater than {p.above:g}")
    if p.words:
        said.append(" or ".join(p.words))
    return said


def default(p: Param) -> str:
    """What stands for a parameter that is left out."""
    if p.required:
        return "required"
    if isinstance(p.default, bool):
        return "yes" if p.default else "no"
    if isinstance(p.default, (int, float)):
        return f"{p.default:g}"
    return "-" if p.default is None or isinstance(p.default, tuple) else str(p.default)


def _element(kind: type[Element]) -> Iterator[str]:
    yield f"{kind.letter.upper()}: {kind.what}"
    yield ""
    yield f"  {kind.form}"
    yield f"  {kind.law}"
    known = [
        (key, p.unit or "-", _value(p.default), p.meaning) for key, p in kind.instance.items() if p.meaning
    ]
    if known:
        yield ""
        yield from table(known)
    rows = [(names[0], unit or "-", _value(value), said) for names, unit, value, said in kind.model_table()]
    if rows:
        yield ""
        yield f"  .model name {kind.model_types[0]}(..)"
        yield from table(rows)


def _value(default: float | None) -> str:
    """A default; NaN of the engine's tables and None: there is none."""
    return "-" if default is None or default != default else f"{default:g}"


def table(rows: Sequence[tuple[str, ...]]) -> Iterator[str]:
    """Columns of equal width."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        yield ("  " + "  ".join(f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True))).rstrip()

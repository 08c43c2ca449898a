"""The reference of a card word: a machine card from its spec, a SPICE element from the table of elements."""

from __future__ import annotations

from ..cards import CARDS
from ..elements import KINDS, MODEL_PARAMETERS, PARAMETERS
from ..mistakes import FORMS

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator

    from ..cards.base import Param

LAWS = {
    "R": "i = v/R", "C": "i = d/dt (C v), energy C v^2/2", "L": "v = d/dt (L i), energy L i^2/2",
    "K": "M = k sqrt(L1 L2), flux linkage L1 i1 + M i2", "V": "v = e(t)", "I": "i = i(t), from n+ through the source to n-",
    "E": "v = gain v(nc+, nc-)", "F": "i = gain i(Vsource)", "G": "i = gain v(nc+, nc-)", "H": "v = gain i(Vsource)",
    "B": "v or i = an expression of voltages, currents, time and the machine",
    "D": "i = is (exp(v/(n vt)) - 1), with breakdown, series resistance and charge from the .model",
    "S": "v = ron i above vt + vh, v = roff i below vt - vh, held in between", "W": "as S, by the current of Vsource: it, ih",
    "X": "the cards of .subckt, with its nodes, bodies and joints in place of the terminals",
}  # fmt: skip
MODEL_TYPES = {"R": "r", "C": "c", "L": "l", "S": "sw", "W": "csw"}
MEANINGS = {
    "m": "so many in parallel", "temp": "its temperature [C]", "dtemp": "degrees above that of the circuit", "tc": "tc1, tc2",
    "tc1": "1/K, change with temperature", "tc2": "1/K^2", "tce": "percent per K, exponential", "scale": "factor on the value",
    "ic": "value at the start of a run with uic", "area": "factor on the currents and charges of the model",
    "on": "on at the start", "off": "off at the start", "l": "length [m], with a model", "w": "width [m], with a model",
    "k": "coupling coefficient", "vt": "threshold [V]", "vh": "half of the hysteresis [V]", "it": "threshold [A]",
    "ih": "half of the hysteresis [A]", "ron": "resistance when on [Ohm]", "roff": "resistance when off [Ohm]",
    "von": "fully on above [V]", "voff": "off below [V]", "ion": "on above [A]", "ioff": "off below [A]",
    "r": "resistance [Ohm]", "rsh": "sheet resistance [Ohm]", "c": "capacitance [F]", "cj": "per area [F/m^2]",
    "cjsw": "per edge [F/m]", "tnom": "temperature of the parameters [C]", "defw": "width where none is given [m]",
    "narrow": "etched off the width [m]", "short": "etched off the length [m]", "ind": "inductance [H]",
}  # fmt: skip

# what a card's laws are about
BRINGS = {
    "T": "kinetic energy", "V": "potential energy", "W": "co-energy", "P": "heat", "i": "electrical side", "q": "constraint",
}  # fmt: skip


def is_word(what: str) -> bool:
    """MOTOR, r, a letter with a card."""
    return what.upper() in CARDS or what.upper() in LAWS


def lines(what: str) -> Iterator[str]:
    """The reference, line by line."""
    word = what.upper()
    yield from _card(word) if word in CARDS else _element(word)


def facts(what: str) -> dict[str, object]:
    """The same as plain data."""
    word = what.upper()
    if word not in CARDS:
        what = "subcircuit" if word == "X" else KINDS[word].what
        return {"word": word, "meaning": what, "form": FORMS[word.lower()], "laws": {"": LAWS[word]}}
    spec = CARDS[word].spec
    params = {
        key: {
            "unit": p.unit, "default": p.default if isinstance(p.default, (int, float, str, bool)) else None,
            "required": p.required, "meaning": p.meaning, "least": p.least, "above": p.above, "words": list(p.words),
        }
        for key, p in spec.params.items()
    }  # fmt: skip
    return {"word": word, "meaning": spec.meaning, "form": spec.form, "laws": spec.laws, "parameters": params}


def _card(word: str) -> Iterator[str]:
    card = CARDS[word]
    spec = card.spec
    yield f"{spec.word}: {spec.meaning}"
    if not card.supported:
        yield "  read, but without effect yet"
    yield ""
    yield f"  {spec.form}"
    marks = " or ".join(f"{m}=" for m in spec.mark if m != "kind")
    if marks:
        yield f"  A line that begins with {spec.word} is this card where it has {marks}; otherwise it is SPICE."
    if spec.params:
        yield ""
        yield from _table([(key, p.unit or "-", default(p), meaning(p)) for key, p in spec.params.items()])
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


def _element(word: str) -> Iterator[str]:
    what = "subcircuit" if word == "X" else KINDS[word].what
    yield f"{word}: {what}"
    yield ""
    yield f"  {FORMS[word.lower()]}"
    yield f"  {LAWS[word]}"
    known = [key for key in PARAMETERS.get(word, "").split() if key in MEANINGS]
    if known:
        yield ""
        yield from _table([(key, MEANINGS[key]) for key in known])
    if word == "D":
        from .._engine import diode_parameters

        yield ""
        yield "  .model name d(..)"
        yield from _table(
            [
                (names[0], unit or "-", "-" if value != value else f"{value:g}", said)
                for names, unit, value, said in diode_parameters()
            ]
        )
    elif word in MODEL_PARAMETERS:
        yield ""
        yield f"  .model name {MODEL_TYPES[word]}(..)"
        yield from _table([(key, MEANINGS[key]) for key in MODEL_PARAMETERS[word].split() if key in MEANINGS])


def _table(rows: list[tuple[str, ...]]) -> Iterator[str]:
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    for row in rows:
        yield ("  " + "  ".join(f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True))).rstrip()

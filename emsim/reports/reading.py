"""How one line of a deck was read: its tree, its card, the values in SI units, and what it contributes to the equations."""

from __future__ import annotations

import re

from ..build import cannot_read, read
from ..cards import CARDS
from ..deck import Analysis, Dot, MachineCard, Model, Param, Print, Subckt
from ..elements import Element
from ..expr import Node, Num
from ..marks import start_of
from ..source import Line, Reading, load, trees
from ..syntax import first_word
from . import notation
from .explained import ENERGIES, signed, term

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from typing import Any

    from ..assemble import Assembly
    from ..diagnostics import Span
    from ..elaborate.flat import FlatDeck
    from ..source import SourceFile
    from .equations import Explained, Part

# cards that read their lines themselves
OWN = {"fmu": "a file, and lists in parentheses"}
FLAT = 64  # characters of a tree that stand on one line


class Place:
    """A line: the logical line that it belongs to, its tree (rule, children), or what it is where it is no card."""

    __slots__ = ("file", "first", "last", "number", "said", "tree")

    def __init__(self, file: SourceFile, number: int) -> None:
        self.file, self.number = file, number
        self.first = self.last = number
        self.tree: tuple[str, list[Any]] | None = None
        self.said = ""

    def text(self) -> Iterator[str]:
        for k in range(self.first, self.last + 1):
            yield f"  {k:>4} | {self.file.text_line(k)}".rstrip()

    def holds(self, span: Span | None) -> bool:
        return span is not None and span.file.text == self.file.text and self.first <= span.line <= self.last


def place(path: str, number: int) -> Place:
    """Finds a line of a deck. ValueError where the deck is shorter, or is no text; OutsideError without the file."""
    try:
        file = load(path)
    except OSError as error:
        raise cannot_read(path, error) from None
    found, count = Place(file, number), len(file.starts) - file.text.endswith("\n")
    if not 1 <= number <= count:
        raise ValueError(f"{file.name} has {count} lines, there is no line {number}")
    reading = Reading(file, has_title=True)
    if number == reading.title_line:
        found.said = "the title"
        return found
    for rule, content, between, last, _, where in reading.cards:
        if where >= 0:
            if where >> 40 == number:
                found.tree = (rule, [content, *between, last])
                return found
            continue
        line: Line = reading.line(between)
        end = line.number + line.text.rstrip().count("\n")
        if line.number <= number <= end:
            found.first, found.last = line.number, end
            found.tree = (rule, content) if rule is not None else trees().line(line.text, start_of(line))
            unread = OWN.get(first_word(line.text), "not accepted by the grammar")
            found.said = "" if found.tree is not None else unread
            return found
    text = file.text_line(number).strip()
    within = any(line.number == number for line in reading.control) or reading.control_span is not None
    found.said = (
        "empty"
        if not text
        else "a comment"
        if text[0] in "*;$#"
        else "in .control, which is skipped"
        if within
        else "no card"
    )
    return found


def tree_lines(tree: tuple[str, list[Any]], margin: str = "    ") -> Iterator[str]:
    """The syntax tree, what is short on one line."""
    rule, children = tree[0], _said(tree[1])
    flat = _flat(tree)
    if len(flat) <= FLAT:
        yield margin + flat
        return
    first = next((k for k, c in enumerate(children) if isinstance(c, tuple)), len(children))
    yield f"{margin}{rule}  {' '.join(map(_flat, children[:first]))}".rstrip()
    for child in children[first:]:
        if isinstance(child, tuple):
            yield from tree_lines(child, margin + "  ")
        else:
            yield f"{margin}  {_flat(child)}"


def _flat(tree: Any) -> str:
    if not isinstance(tree, tuple):
        return str(tree).removesuffix("(")
    return f"{tree[0]}({' '.join(map(_flat, _said(tree[1])))})"


def _said(children: list[Any]) -> list[Any]:
    """Without brackets and commas: the tree says what they say."""
    return [c for c in children if isinstance(c, tuple) or str(c) not in ("(", ")", "{", "}", ",", "'", '"')]


# ---- cards ----------------------------------------------------------------------------------------


def cards_on(where: Place, flat: FlatDeck) -> list[Any]:
    """Everything that the line became: flat elements and machine cards (one a use of a subcircuit), or the dot card."""
    found: list[Any] = [e for e in flat.elements if where.holds(e.span)]
    found += [c for c in flat.machine if where.holds(c.span)]
    if not found and where.file.path is not None:
        found = [c for c in read(where.file.path).body if where.holds(getattr(c, "span", None))]
    return found


def names_of(cards: Iterable[Any]) -> set[str]:
    return {c.name for c in cards if isinstance(c, (Element, MachineCard))}


def described(card: Any, assembly: Assembly) -> Iterator[str]:
    """What a card says, in SI units."""
    if isinstance(card, Element):
        yield from _element(card, assembly)
    elif isinstance(card, MachineCard):
        yield from _machine(card, assembly)
    else:
        yield from _dot(card, assembly.flat)


def _element(e: Element, assembly: Assembly) -> Iterator[str]:
    yield f"{e.what} {e.name}"
    if e.nodes:
        named = zip(e.terminals, e.nodes, strict=False)
        yield "  between  " + ", ".join(f"{label} = {node}" for label, node in named)
    if isinstance(e.value, Node):
        yield f"  value    {{{e.value}}}"
    elif e.wave is not None:
        shown = " ".join(f"{float(a):g}" for a in e.wave.args)
        yield f"  value    {e.wave.kind.upper()}({shown}) {e.unit}".rstrip()
    else:
        value = e.quantity(assembly.ctx)
        if value is not None:
            yield f"  value    {_written(e.value_span)}{value:.12g} {e.unit}".rstrip()
    for key, given in e.params.items():
        yield f"  {key:<8} {_value(given)}"
    if e.extra.get("inductors"):
        yield f"  coils    {', '.join(e.extra['inductors'])}"
    if "element" in e.behind and e.extra.get("controls"):
        yield f"  reads    the current of {', '.join(e.extra['controls'])}"
    if e.model is not None:
        params = " ".join(f"{key}={_value(value)}" for key, value in e.model.params.items())
        yield f"  model    {e.model.name}: {e.model.type} {params}".rstrip()


def _written(span: Span | None) -> str:
    text = span.text if span is not None else ""
    return f"{text} = " if text and not text.replace(".", "", 1).isdigit() else ""


def _value(value: Any) -> str:
    if isinstance(value, Num):
        value = value.value
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return f"{value:.12g}"
    if isinstance(value, (tuple, list)):
        return "(" + ", ".join(map(_value, value)) + ")"
    return f"{{{value}}}" if isinstance(value, Node) else str(value)


def _machine(raw: MachineCard, assembly: Assembly) -> Iterator[str]:
    m, spec = assembly.machine, CARDS[raw.kind].spec
    yield f"{spec.word} {raw.name}: {spec.meaning}"
    card = next(
        (c for c in (*m.active, *m.couplings.values()) if c.name == raw.name and c.spec is spec), None
    )
    if card is None:
        for key, value in raw.params.items():
            yield f"  {key:<8} {_value(value)}"
        return
    for label, kind, ref in card.terminals:
        at = "" if ref.point is None else "(" + ", ".join(map(_value, ref.point)) + ")"
        yield f"  {label:<8} {kind} {ref.name}{at}"
    rows = []
    for key, param in spec.params.items():
        setting: Any = getattr(card, key, None)
        setting = (
            raw.wave if setting is None and param.kind == "value" and key in ("value", "tau") else setting
        )
        if setting is None or (not card.given(key) and setting is not raw.wave and setting == param.default):
            continue
        span = raw.param_spans.get(key)
        written = (
            span.text.strip()
            if span is not None and card.given(key)
            else "default"
            if not card.given(key)
            else ""
        )
        shown = "yes" if setting is True else "no" if setting is False else _value(setting)
        rows.append((key, written, f"{shown} {param.unit}".strip(), param.meaning))
    for label, value, unit, meaning in _derived(card):
        rows.append((label, "follows", f"{_value(value)} {unit}", meaning))
    widths = [max((len(r[k]) for r in rows), default=0) for k in range(3)]
    for row in rows:
        yield f"  {row[0]:<{max(8, widths[0])}} {row[1]:<{widths[1]}}  {row[2]:<{widths[2]}}  {row[3]}".rstrip()


def _derived(card: Any) -> Iterator[tuple[str, Any, str, str]]:
    if hasattr(card, "derived"):
        yield from card.derived()
    if card.spec.word == "BODY":
        if not card.given("com"):
            yield "com", tuple(card.centre), "m", "the centre of mass in body axes"
        if not card.given("j"):
            yield "j", card.inertia[:3], "kg m^2", "Jxx, Jyy, Jzz about the centre of mass"


def _dot(card: Any, flat: FlatDeck) -> Iterator[str]:
    if isinstance(card, Param):
        value = flat.params.get(card.name)
        written = _value(card.value)
        yield f".param {card.name} = {written}" + (
            f" = {value:.12g}" if value is not None and f"{value:.12g}" != written else ""
        )
    elif isinstance(card, Analysis):
        words = ("tstep", "tstop", "tstart", "tmax") if card.kind == "tran" else ()
        given = [f"{w} = {_value(a)} s" for w, a in zip(words, card.args, strict=False)]
        yield f".{card.kind} {', '.join([*given, *sorted(card.flags)])}".rstrip()
    elif isinstance(card, Print):
        yield f".print {card.kind}: {', '.join(text for text, _ in card.items)}"
    elif isinstance(card, Model):
        yield f".model {card.name}, type {card.type}"
        for key, value in card.params.items():
            yield f"  {key:<8} {_value(value)}"
    elif isinstance(card, Subckt):
        yield f".subckt {card.name}, terminals {', '.join(card.ports)}"
        for key, value in card.params.items():
            yield f"  {key:<8} {_value(value)} unless the X card says otherwise"
    elif isinstance(card, Dot) and card.kind == "gravity":
        yield ".gravity (" + ", ".join(f"{g:g}" for g in flat.gravity or ()) + ") m/s^2"
    elif isinstance(card, Dot):
        yield f".{card.kind} {_value(card.items)}"
    else:
        yield type(card).__name__.lower() + f" {getattr(card, 'name', '')}".rstrip()


# ---- contributions --------------------------------------------------------------------------------


def _sum(x: Explained, parts: list[Part]) -> str:
    text = ""
    for part in parts:
        sign, node = signed(term(x, part))
        text += (" - " if sign < 0 else " + ") + notation.text(node, x.names)
    return "0" if not text else text[3:] if text[1] == "+" else "-" + text[3:]


def contributions(x: Explained, names: set[str]) -> Iterator[str]:
    """What the cards of these names bring to the equations."""
    unknowns = [
        f"{name} [{unit or '-'}]"
        for name, unit, _ in x.unknowns
        if name.rstrip(")").partition("(")[2] in names
    ]
    rows = [("unknowns", ", ".join(unknowns))] if unknowns else []
    for letter, title, unit in ENERGIES:
        for e in x.energies:
            if e.kind == letter and e.owner in names:
                rows.append((title, f"{notation.text(x.layout.tree(e.poly), x.names)}  [{unit}]"))
    for row in x.rows:
        if row.owners <= names:
            rows.append((row.title, f"{_sum(x, row.left)} = {_sum(x, row.right)}"))
            continue
        for side in (row.left, row.right):
            mine = [p for p in side if p.owner in names]
            shared = [p for p in side if p.owner not in names and names & set(p.owner.split(", "))]
            rows += [(row.title, f"a share of {_sum(x, [p])}") for p in shared]
            if mine:
                # behind the equals sign, or one of a sum that is zero
                before, behind = (
                    ("", " + .. = 0")
                    if side is row.left and not row.right
                    else ("", " + .. = ..")
                    if side is row.left
                    else (".. = ", " + ..")
                )
                rows.append((row.title, f"{before}{_sum(x, mine)}{behind}"))
    rows += [("folded away", line) for line in x.folded if names & set(re.split(r"[\s,:()]+", line))]
    width = max((len(title) for title, _ in rows), default=0)
    for title, formula in rows:
        yield f"  {title:<{width}}  {formula}"
    for name, atom in x.named:
        if any(name in formula for _, formula in rows):
            yield f"  {'':<{width}}  with {name} = {notation.text(x.layout.written(atom), x.names)}"

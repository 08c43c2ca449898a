"""A deck for the engine of a page: its equations as bytes, with what a reader may move there: .param, R, C, L, V, I lines and
numbers of machine cards, where the machine starts, and hands on bodies and switches (assemble/hands.py).

What cannot be left open is left out: values that decide over the structure of the equations (a length of a closed loop, a ratio
that folds a joint away), those that a card takes as plain numbers, and those that keep a hidden constraint from being
differentiated (engine/src/packed/impeding.rs).
"""

from __future__ import annotations

from base64 import b64encode
from os.path import exists, join
from zlib import compress

from ..analyses.tran import Tran
from ..assemble import hands
from ..diagnostics import DeckError
from ..elements.switches import Switch
from ..expr import OUTSIDE, to_text
from ..opened import OpenNumber, hand_on
from ..outputs.html import ENGINE_FILE, WEB
from ..pipeline import flatten, load
from . import ports
from .model import pack, prepare, read

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from typing import Any

    from ..assemble import Context, Output
    from ..assemble.drawing import Drawing
    from ..assemble.mechanism import Mechanism
    from ..deck import Measure
    from ..elements import Element
    from ..expr import Node
    from ..result import Result
    from ..source import Source
    from ..table import Table

LETTERS = "rclvi"


class Drawn(Tran):
    """The transient with all that a page shows of it: its columns, what moves the machine, what flows in the circuit."""

    drawing: Drawing | None = None

    def columns(self, ctx: Context) -> list[Output]:
        found = super().columns(ctx)
        switches = [e for e in ctx.elements.values() if isinstance(e, Switch) and e.model is not None]
        self.closed = {e.name: e.closed(ctx) for e in switches}
        if ctx.machine is not None:
            from ..assemble.drawing import draw

            # before the equations are compiled: what is packed is known by then
            self.drawing = draw(ctx.machine)
        return found


class Computing:
    """`packed`: the model as bytes; `inputs`: (name, unit, start, what it is); `places`: of coordinates (name, unit, start, what
    it is, unknown, speed or -1), the places by which a body of the scene is moved as `grips`; `hands`: the inputs behind those;
    `columns`: names of its outputs; `scene` and `circuit`: what the drawings are made of, whose channels stand behind the
    columns; `impeding`: inputs with which it would not be what the deck gives with numbers in their place."""

    def __init__(self, deck: _Opened) -> None:
        assembly, tran = deck.assembly, deck.tran
        outputs = [(o.expr, o.name) for o in assembly.outputs[tran] if o.expr is not None]
        self.columns = [name for _, name in outputs]
        drawing, flows = tran.drawing, assembly.flows
        self.scene = None if drawing is None else drawing.data()
        self.circuit = None if flows is None else flows.data()
        for part in (drawing, flows):
            outputs += (
                [(c.expr, c.name) for c in part.channels if c.expr is not None] if part is not None else []
            )
        # name -> the input by which a hand turns it, the output that is more than a half where it is closed
        self.switches: dict[str, tuple[int, int]] = {}
        self.inputs = [(p.name, p.unit, p.start, p.says) for p in deck.ports]
        taken = [(p.name, p.start, "tunable") for p in deck.ports]
        held = [name for name in deck.hands if OUTSIDE + name in assembly.ctx.inputs]
        self.hands = {name: len(taken) + k for k, name in enumerate(held)}
        for name, closed in tran.closed.items():
            if hand_on(name) in self.hands:
                self.switches[name] = (self.hands[hand_on(name)], 1 + len(outputs))
                outputs.append((closed, f"closed({name})"))
        self.measures = deck.measures
        self.accounts: dict[str, Any] | None = None
        if (book := assembly.accounts) is not None:
            entries = [[(e.name, e.word, e.kind) for e in part] for part in (book.powers, book.energies)]
            self.accounts = {"entries": entries, "devices": assembly.system.device_names, "open": book.open}
        self.mass = 1.0
        self.places: list[tuple[str, str, float, str, int, int]] = []
        self.grips: dict[int, list[int]] = {}
        if assembly.machine is not None and drawing is not None:
            self._movable(assembly.machine, drawing.names)
        taken += [(name, 0.0, "tunable") for name in held]
        made = pack(assembly, tran, taken, outputs, "")
        self.packed, self.impeding = made.data, made.impeding

    def _movable(self, machine: Mechanism, names: Sequence[str]) -> None:
        self.mass = hands.mass(machine)
        places, grips = hands.movable(machine)
        says = "of the machine at the start"
        self.places = [
            (
                c.q_name,
                c.unit,
                machine.found.x[c.row],
                f"{c.q_name} {says}",
                c.row,
                -1 if groups else c.speed_row,
            )
            for groups in [bool(machine.groups)]
            for c in places
        ]
        self.grips = {names.index(body): own for body, own in grips.items() if own}

    def data(self) -> dict[str, Any]:
        """As the page's scripts take it (outputs/web/engine.js)."""
        model = b64encode(compress(self.packed, 9)).decode("ascii")
        # the page has its surfaces already
        scene = self.scene and {key: value for key, value in self.scene.items() if key != "meshes"}
        names = "inputs places grips hands switches mass measures accounts columns circuit"
        return {"model": model, "scene": scene, **{name: getattr(self, name) for name in names.split()}}


def there() -> bool:
    """Is the engine of pages in this installation? emsim/engine/page.sh makes it."""
    return exists(join(WEB, ENGINE_FILE))


def engine(
    source: Source, result: Result, defines: Mapping[str, Any], options: Mapping[str, Any]
) -> dict[str, Any] | None:
    """What `outputs.html.write` takes as `engine`; None where the page is a recording."""
    return opened(source, result, defines, options) if there() else None


def opened(
    source: Source, result: Result, defines: Mapping[str, Any], options: Mapping[str, Any]
) -> dict[str, Any] | None:
    """The same, wherever the engine of the page comes from."""
    found = computing(source, result.main, defines, options) if len(result.plots) == 1 else None
    if found is None:
        return None
    values = {m.name: m for m in result.measured}
    for card in found.measures:
        m = values.get(card["name"])
        card["unit"], card["was"] = ("", None) if m is None else (m.unit, None if m.trouble else m.value)
    return found.data()


class _Opened:
    """A deck of which these names are open, with hands and accounts of energy where asked for. Raises DeckError."""

    def __init__(
        self,
        source: Source,
        names: Sequence[str],
        defines: Mapping[str, Any],
        options: Mapping[str, Any],
        held: bool,
        energy: bool,
    ) -> None:
        flat, params = read(load(source, defines), options, {"tune": ports.given([" ".join(names)], False)})
        flat.fmu = {"tune": flat.fmu["tune"]}
        flat.is_drawn = True
        self.measures = [_measure(card) for card in flat.measures if card.analysis in ("", "tran")]
        self.hands = hands.wanted(flat) if held else []
        self.assembly, self.tran, self.ports = prepare(flat, dict(options), params, Drawn, self.hands, energy)
        unread = {p.name for p in self.ports} - {
            name.removeprefix("input ") for name in self.assembly.ctx.inputs
        }
        drawn = [] if self.tran.drawing is None else list(_open(self.tran.drawing.data()))
        assert flat.inputs is not None
        given_up = {name.removeprefix("input ") for name in flat.inputs.lost.union(*(n.names for n in drawn))}
        self.lost = given_up | unread


def computing(
    source: Source, table: Table, defines: Mapping[str, Any], options: Mapping[str, Any]
) -> Computing | None:
    """For the page of `table`, a transient of the same deck; None where the deck cannot be opened."""
    if table.kind != "tran" or table.steps or not table.axis:
        return None

    def tried(names: Sequence[str], held: bool = False, whole: bool = False) -> _Opened | None:
        try:
            return _Opened(source, names, defines, options, held, whole and table.energy is not None)
        except DeckError:
            return None

    def possible(before: Sequence[str], more: Sequence[str]) -> list[str]:
        """Those of `more` that can be open too."""
        every = not more or tried([*before, *more])
        return list(more) if every else [name for name in more if tried([*before, name])]

    params = possible([], _parameters(source, defines, options))
    names = [*params, *possible(params, _lines(source, params, defines, options))]
    held = True
    while (deck := tried(names, held, True)) is not None:
        found = None if deck.ports and deck.lost else Computing(deck)
        if found is not None and not found.impeding:
            return found
        kept = [name for name in names if name not in (deck.lost if found is None else dict(found.impeding))]
        if len(kept) == len(names) and not held:
            return None
        # where nothing of it can be given up, hands are in the way
        names, held = kept, held and len(kept) < len(names)
    return None


def _parameters(source: Source, defines: Mapping[str, Any], options: Mapping[str, Any]) -> list[str]:
    flat = flatten(load(source, defines), options)
    taken = {*(e.name for e in flat.elements), *(c.name for c in flat.machine)}
    return [name for name in flat.params if name not in taken]


def _lines(
    source: Source, params: Sequence[str], defines: Mapping[str, Any], options: Mapping[str, Any]
) -> list[str]:
    """Elements with one number, and numbers of machine cards, that do not hang on open parameters already."""
    flat, _ = read(load(source, defines), options, {"tune": ports.given([" ".join(params)], False)})
    top = [e for e in flat.elements if e.letter in LETTERS and "." not in e.name]
    plain = [e.name for e in top if _is_one_number(e)]
    return [
        *plain,
        *(f"{c.name}({k})" for c in flat.machine for k, v in c.params.items() if isinstance(v, float)),
    ]


def _is_one_number(e: Element) -> bool:
    value = e.extra.get("dc") if e.letter in "vi" else e.value
    return isinstance(value, (int, float)) and e.wave is None and not e.params and e.model is None


def _measure(card: Measure) -> dict[str, Any]:
    """As outputs/web/meas.js takes it."""

    def text(node: Node | None) -> str | None:
        return None if node is None else to_text(node).replace(OUTSIDE, "outside.")

    clauses = [
        {
            "word": c.word, "body": text(c.body), "level": text(c.level),
            "values": {k: text(v) for k, v in c.values.items()},
        }
        for c in card.clauses
    ]  # fmt: skip
    return {"name": card.name, "clauses": clauses}


def _open(data: Any) -> Iterator[OpenNumber]:
    """Open numbers that a drawing would show as they were."""
    if isinstance(data, OpenNumber):
        yield data
    elif isinstance(data, dict):
        for value in data.values():
            yield from _open(value)
    elif isinstance(data, (list, tuple)):
        for value in data:
            yield from _open(value)

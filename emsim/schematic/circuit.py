"""What is to be drawn of a deck: parts with their symbols and nets, and what each net is.

One level of the deck is one drawing: its own elements, the machine's cards that have nodes, and a box for every use of a
subcircuit, with all its terminals. What controls a source or a switch is written beside it, as in textbooks, and not wired;
couplings that no core shows and bulks that are not drawn are told below the drawing (`captions`). A net is

    ground    node 0: a symbol at every pin
    rail      held by a constant source against ground and used by several: a bar with its name at every pin
    wired     anything else
"""

from __future__ import annotations

from ..expr import Call, Name, Node
from . import coils, symbols
from .boxes import ABOVE, BELOW, amplifier, gives, sides
from .labels import Labels
from .patterns import ladders
from .reads import GROUND, amplifies, reads, terminals
from .words import broken, listed, quantity

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator
    from typing import Any

    from ..deck import MachineCard
    from ..elaborate.flat import FlatDeck
    from ..elements import Element
    from .symbols import Symbol

SUPPLY_NAMES = tuple("vcc vdd vss vee vbat vbb vp vn vs vpp vplus vminus v+ v-".split())


class Part:
    """`nets` by pin of the symbol; `role` orders and turns it: source, series (two pins), transistor, box, amplifier, port."""

    __slots__ = ("card", "kind", "label", "name", "nets", "reads", "role", "sources", "symbol")

    def __init__(
        self,
        name: str,
        kind: str,
        nets: list[str],
        symbol: Callable[[str], Symbol],
        label: list[str],
        role: str = "series",
    ) -> None:
        self.name, self.kind, self.nets, self.symbol, self.label, self.role = (
            name,
            kind,
            nets,
            symbol,
            label,
            role,
        )
        self.sources: list[tuple[str, int]] = [
            (name, k) for k in range(len(nets))
        ]  # by pin: whose terminal it is
        self.card = ""  # machine card word
        self.reads: list[str] = []  # nets that control it

    def __repr__(self) -> str:
        return f"<{self.kind} {self.name} {self.nets}>"


class Circuit:
    """Parts and nets of one level; `inside` is "" or the name of a subcircuit's use. `cores`: coupled coils are one part."""

    def __init__(self, flat: FlatDeck, inside: str = "", cores: bool = True) -> None:
        self.flat, self.inside = flat, inside
        self.parts: list[Part] = []
        self.captions: list[str] = []
        self.uses = [use for use in flat.uses if _within(use[0], inside)]
        self.ports = next((nodes for name, _, nodes in flat.uses if name == inside), {})
        self.read: set[str] = set()  # nets that labels speak of
        couplings = [e for e in flat.elements if cores and e.letter == "k" and _within(e.name, inside)]
        own = [e for e in flat.elements if _within(e.name, inside) and e.letter != "k"]
        windings = {name for k in couplings if k.model_name for name in k.extra["inductors"]}
        self.labels = Labels(self.port, self.shown, windings)
        wound = self._cores(couplings, own)
        bulks = self._bulks(own)
        for e in own:
            if e.name not in wound:
                self._element(e, bulks)
        for card in flat.machine:
            if _within(card.name, inside):
                self._machine(card)
        hidden = self._hidden()
        for name, of, nodes in self.uses:
            self._use(name, of, nodes, *hidden[name])
        fixed = {*GROUND, *(net for port, net in self.ports.items() if port.lower() in (*ABOVE, *BELOW))}
        used = {net for part in self.parts for net in part.nets}
        for port, net in self.ports.items():
            # a supply's bar bears its name, if anything is on it
            if net not in fixed or (net not in used and net not in GROUND):
                side = "out" if gives(port) else "in"
                self._part(f"{inside}:{port}", side, [net], symbols.port, [port], "port")
        self.pins: dict[str, list[tuple[int, int]]] = {}
        for k, part in enumerate(self.parts):
            for j, net in enumerate(part.nets):
                self.pins.setdefault(net, []).append((k, j))
        self._follow()
        self.ladders = ladders(self)
        self.rails = self._rails()
        self.read &= set(self.pins)
        self.named = (self.read | self._asked()) & set(self.pins)
        self.named -= {net for part in self.parts if part.role == "port" for net in part.nets}

    def flag(self, net: str) -> None:
        """A net gets a part that bears its name."""
        self.pins[net].append((len(self.parts), 0))
        self.named.discard(net)
        self._part(f"{net}:name", "flag", [net], symbols.port, [self.port(net)], "port")

    # ---- parts ----

    def shown(self, name: str) -> str:
        """A name without the prefix of the level."""
        start = self.inside + "."
        return name[len(start) :] if self.inside and name.startswith(start) else name

    def port(self, net: str) -> str:
        """What a net is called here: inside a subcircuit its terminals have the names of its definition."""
        own = (port for port, node in self.ports.items() if node == net and net not in GROUND)
        return next(own, self.shown(net))

    def _title(self, e: Element) -> str:
        """Its name as the deck writes it."""
        name, written = self.shown(e.name), e.span.text
        return written if written.lower() == name else name[:1].upper() + name[1:]

    def _part(
        self, name: str, kind: str, nets: list[str], symbol: Any, label: list[str], role: str = "series"
    ) -> Part:
        nets = ["0" if net in GROUND else net for net in nets]
        part = Part(name, kind, nets, symbol, [line for line in label if line], role)
        self.parts.append(part)
        return part

    def _element(self, e: Element, bulks: dict[str, str]) -> None:
        letter, s, nodes = e.letter, symbols, terminals(e)
        label = [*broken(self._title(e)), *self.labels.value(e)]
        read = reads(e)
        self.read |= set(read.nets)
        found: Part | None = None
        if letter in TWO and len(nodes) == 2:
            kind, symbol = TWO[letter]
            found = self._part(e.name, kind, nodes, symbol, label)
        elif letter in ("v", "i"):
            sort = WAVES.get(e.wave.kind.lower(), "pulse") if e.wave is not None else ""
            kind, make = ("voltage", s.voltage) if letter == "v" else ("current", s.current)
            self._part(e.name, kind, nodes, lambda look: make(look, sort), label, "source")
        elif amplifies(e) is not None:
            made = self._part(
                e.name, "amplifier", nodes, lambda look: s.amplifier(look, False), label, "amplifier"
            )
            none = len(e.nodes)  # no terminal has that number, and no current flows there
            made.sources = [(e.name, none), (e.name, none), (e.name, 0)]
        elif letter in ("e", "h", "g", "f", "b"):
            is_voltage = letter in ("e", "h") or (letter == "b" and e.extra.get("output") == "v")
            gives = "v" if is_voltage else "i"
            found = self._part(
                e.name, "dependent", nodes, lambda look: s.diamond(look, gives), label, "source"
            )
            found.reads = [*read.nets, *read.names]
        elif letter == "d" and len(nodes) == 2:
            breaks = float((e.model.params if e.model is not None else {}).get("bv", 1e9) or 1e9) < 200
            kind = "zener" if breaks else ""
            self._part(e.name, "diode", nodes, lambda look: s.diode(look, kind), label)
        elif letter in "qmjz" and len(nodes) <= 4 - (letter in "jz"):
            self._transistor(e, nodes, label, e.name in bulks)
        elif letter in ("t", "o", "y") and len(nodes) == 4:
            make_line = lambda look: s.box(["", ""], ["", ""], 5)  # noqa: E731
            self._part(e.name, "line", nodes, make_line, label, "box")
        else:
            half = (len(nodes) + 1) // 2
            left, right = [str(k + 1) for k in range(half)], [str(k + 1) for k in range(half, len(nodes))]
            label += [*broken(e.model_name or ""), *self.labels.beside(e)]
            self._part(e.name, "device", nodes, lambda look: s.box(left, right, 5), label, "box")

    def _transistor(self, e: Element, nodes: list[str], label: list[str], told: bool) -> None:
        """`told`: where its bulk is stands below the drawing."""
        type_ = e.model.type if e.model is not None else ""
        if e.letter == "q":
            pnp = type_ in ("pnp", "lpnp")
            substrate = len(nodes) > 3 and nodes[3] not in GROUND  # ground is where it is if nobody says
            kind, nets = "pnp" if pnp else "npn", nodes[: 3 + substrate]
            make = lambda look: symbols.transistor(look, pnp, substrate)  # noqa: E731
        elif e.letter == "m":
            p = _is_p(e)
            bulk = "source" if len(nodes) < 4 or nodes[3] == nodes[2] else "" if told else "pin"
            threshold = float(e.model.params.get("vto", 0.0) or 0.0) if e.model is not None else 0.0
            depletion = threshold > 0 if p else threshold < 0
            kind, nets = "pmos" if p else "nmos", nodes[: 3 + (bulk == "pin")]
            make = lambda look: symbols.mosfet(look, p, bulk, depletion)  # noqa: E731
        else:
            p = type_ in ("pjf", "pmf")
            kind, nets = "pjf" if p else "njf", nodes
            make = lambda look: symbols.jfet(look, p)  # noqa: E731
        self._part(e.name, kind, nets, make, label, "transistor")

    def _bulks(self, own: list[Element]) -> dict[str, str]:
        """Bulks that are told and not drawn, by element: those on ground, and those that share a net with another one, as on a
        chip; one on its source's net is part of the symbol."""
        loose = [e for e in own if e.letter == "m" and len(e.nodes) == 4 and e.nodes[3] != e.nodes[2]]
        on = [e.nodes[3] for e in loose]
        found = {e.name: e.nodes[3] for e in loose if on.count(e.nodes[3]) > 1 or e.nodes[3] in GROUND}
        for p, kind in ((False, "n-channel"), (True, "p-channel")):
            alike = [e for e in loose if _is_p(e) == p and e.name in found]
            nets = list(dict.fromkeys(found[e.name] for e in alike))
            for net in nets:
                these = [self._title(e) for e in alike if found[e.name] == net]
                of = kind if len(nets) == 1 else ", ".join(these)
                self.captions.append(f"bulks of {of}: {'0' if net in GROUND else self.port(net)}")
                self.read |= {net} - set(GROUND)
        return found

    def _cores(self, couplings: list[Element], own: list[Element]) -> set[str]:
        """Coils on one core are one part; couplings that no core shows are told below the drawing."""
        titles = {e.name: self._title(e) for e in own}
        named = {e.name: e for e in own if e.letter == "l"}
        drawn: set[str] = set()
        wound: set[str] = set()
        for lines, these in coils.cores(couplings, named):
            label = [
                *listed([titles[e.name] for e in these]),
                *listed([" ".join(self.labels.value(e)) for e in these]),
                *coils.factors(lines, [e.name for e in these], titles),
            ]
            for e in these:
                self.read |= set(reads(e).nets)
            half = len(these) // 2
            if len(these) == 2:
                over = [e.nodes[0] in GROUND for e in these]
            else:
                over = [*coils.turned(these[:half], GROUND), *coils.turned(these[half:], GROUND)]
            nets = [net for e in these for net in e.nodes[:2]]
            make = lambda look, over=over, half=half: symbols.transformer(look, over, half)  # noqa: E731
            part = self._part(lines[0].name, "transformer", nets, make, label, "box")
            part.sources = [(e.name, k) for e in these for k in (0, 1)]
            drawn |= {line.name for line in lines}
            wound |= {e.name for e in these}
        self.captions += [
            coils.written(k, {name: titles.get(name, self.shown(name)) for name in k.extra["inductors"]})
            for k in couplings
            if k.name not in drawn
        ]
        return wound

    def _machine(self, card: MachineCard) -> None:
        from ..cards import CARDS

        cls = CARDS.get(card.kind)
        if cls is None:
            return
        cls = cls.variant(card, self.flat.models)
        kinds = next((form for form in cls.forms(card) if len(form) == len(card.args)), [])
        nodes = [ref.name for ref, (_, kind) in zip(card.args, kinds, strict=False) if kind == "node"]
        if not nodes:
            return
        title = self.shown(card.name)
        joint = next(
            (ref.name for ref, (_, kind) in zip(card.args, kinds, strict=False) if kind == "joint"), ""
        )
        label = [*broken(title), *broken(joint and f"on {self.shown(joint)}")]
        if card.kind == "MOTOR" and len(nodes) == 2:
            part = self._part(card.name, "motor", nodes, symbols.motor, label)
        elif card.kind == "POT":
            part = self._part(
                card.name,
                "pot",
                nodes,
                symbols.pot,
                [*label[:1], quantity(card.params.get("r"), "Ohm"), *label[1:]],
                "box",
            )
        elif card.kind == "TRANSDUCER" and len(nodes) == 2:
            form = next((key for key in ("c", "l", "k", "w") if card.params.get(key) is not None), "w")
            part = self._part(
                card.name, "transducer", nodes, lambda look: symbols.transducer(look, form), label
            )
        else:
            names = [label.rstrip("_") for label, kind in kinds if kind == "node"]
            make = lambda look: symbols.machine(names, "M" if card.kind == "MOTOR" else "W")  # noqa: E731
            part = self._part(
                card.name, "motor" if card.kind == "MOTOR" else "transducer", nodes, make, label, "box"
            )
        part.card = card.kind

    def _hidden(self) -> dict[str, tuple[list[str], list[str]]]:
        """By use: nets beside its terminals that something inside is on or reads, as .global ones; what it reads of others."""
        found: dict[str, tuple[dict[str, None], dict[str, None]]] = {use[0]: ({}, {}) for use in self.uses}
        start = self.inside + "." if self.inside else ""
        ports = {name: {*nodes.values(), *GROUND} for name, _, nodes in self.uses}
        for e in self.flat.elements:
            if not e.name.startswith(start):
                continue
            name = start + e.name[len(start) :].split(".", 1)[0]
            if name == e.name or name not in found:
                continue
            read, prefix = reads(e), name + "."
            for net in (*terminals(e), *read.nets):
                if not net.startswith(prefix) and net not in ports[name]:
                    found[name][0][net] = None
            for other in read.names:
                if not other.startswith(prefix) and other not in ports[name]:
                    found[name][1][other] = None
        return {name: (list(nets), list(others)) for name, (nets, others) in found.items()}

    def _use(self, name: str, of: str, nodes: dict[str, str], hidden: list[str], others: list[str]) -> None:
        """A box, or the triangle of an operational amplifier."""
        ports = dict(nodes)
        for net in hidden:
            ports[beyond(self.port(net), nodes)] = net
        label = [*broken(self.shown(name)), *broken(of)]
        if others:
            label += broken("reads " + ", ".join(map(self.shown, others)))
        if not ports:
            self._part(name, "use", [], lambda look: symbols.box([], [], 5), label, "box")
            return
        if (found := amplifier(ports, of)) is not None:
            roles, supplies = found
            nets = [ports[p] for p in roles]
            make = lambda look: symbols.amplifier(look, supplies)  # noqa: E731
            self._part(name, "amplifier", nets, make, label, "amplifier")
            return
        left, right, above, below = sides(ports)
        nets = [ports[p] for p in (*left, *right, *above, *below)]
        make = lambda look: symbols.box(left, right, 5, tuple(above), tuple(below))  # noqa: E731
        self._part(name, "use", nets, make, label, "box")

    # ---- nets ----

    def _rails(self) -> dict[str, bool]:
        """Nets that are drawn as rails: True for one above ground, False for one below."""
        found: dict[str, bool] = {}
        bits = {self.parts[k].name for ladder in self.ladders for k in ladder.drivers.values()}
        active = any(p.role in ("transistor", "amplifier") for p in self.parts)
        for part in self.parts:
            grounded = "0" in part.nets[:2]
            if part.kind != "voltage" or not grounded or part.name in bits:
                continue
            net, sign = (part.nets[0], 1) if part.nets[1] == "0" else (part.nets[1], -1)
            e = next(e for e in self.flat.elements if e.name == part.name)
            users = len(self.pins[net]) - 1
            if e.wave is not None and e.wave.kind.lower() == "pwl" and net.rsplit(".", 1)[-1] in SUPPLY_NAMES:
                found[net] = True
            if e.wave is not None or not isinstance(e.extra.get("dc"), (int, float)):
                continue
            level = sign * float(e.extra["dc"])
            is_supply = net.rsplit(".", 1)[-1] in SUPPLY_NAMES
            others = [(self.parts[k], j) for k, j in self.pins[net] if self.parts[k] is not part]
            controls = all(p.role == "transistor" and j == 1 for p, j in others)
            if not controls and (
                users >= 3 or (active and users >= 1 and level) or (users >= 2 and is_supply)
            ):
                found[net] = level >= 0
        for port, net in self.ports.items():
            # inside a subcircuit the terminals of its supplies
            if port.lower() in ABOVE:
                found[net] = True
            elif port.lower() in BELOW:
                found[net] = False
        return found

    def _follow(self) -> None:
        """Of what controls a part its nets: of a current those of the element that it flows in."""
        of = {name: part.nets for part in self.parts for name in {part.name, *(s for s, _ in part.sources)}}
        for part in self.parts:
            nets = [
                net for what in part.reads for net in (of.get(what, ()) if what not in self.pins else (what,))
            ]
            part.reads = [net for net in dict.fromkeys(nets) if net != "0"]

    def _asked(self) -> set[str]:
        """Nets that outputs of the deck and cards of its machine speak of."""
        flat = self.flat
        asked: list[Any] = [ast for p in flat.prints for _, ast in p.items]
        asked += [p.ast for p in (*flat.saves, *flat.probes)]
        asked += [v for card in flat.machine for v in card.params.values()]
        return {net for ast in asked for net in _voltages(ast)}


TWO = {
    "r": ("resistor", symbols.resistor),
    "c": ("capacitor", symbols.capacitor),
    "l": ("inductor", symbols.inductor),
    "s": ("switch", symbols.switch),
    "w": ("switch", symbols.switch),
}
# what a source's ring shows of its waveform
WAVES = {"sin": "sin", "pwl": "pwl"}


def beyond(name: str, ports: Collection[str]) -> str:
    """What a box calls a net of its surroundings that is no terminal of it."""
    return beyond(name + "'", ports) if name in ports else name


def _within(name: str, inside: str) -> bool:
    """Does a name stand on this level, not deeper?"""
    if not inside:
        return "." not in name
    return name.startswith(inside + ".") and "." not in name[len(inside) + 1 :]


def _is_p(e: Element) -> bool:
    """Of a MOSFET: is it a p-channel one?"""
    return e.model is not None and (e.model.type.startswith("p") or "pchan" in e.model.params)


def _voltages(node: Any) -> Iterator[str]:
    """Nets whose voltages an expression, or several, read."""
    if isinstance(node, (list, tuple)):
        for item in node:
            yield from _voltages(item)
    elif isinstance(node, Call):
        if node.fn in ("v", "db", "vdb", "vm", "vp"):
            yield from (a.id for a in node.args if isinstance(a, Name))
        yield from _voltages(node.args)
    elif isinstance(node, Node):
        yield from _voltages([getattr(node, part, None) for part in ("a", "b", "c")])

"""What is to be drawn of a deck: parts with their symbols and nets, and what each net is.

One level of the deck is one drawing: its own elements, the machine's cards that have nodes, and a box for every use of a
subcircuit. What controls a source or a switch is written beside it, as in textbooks, and not wired. A net is

    ground    node 0: a symbol at every pin
    rail      held by a constant source against ground and used by several: a bar with its name at every pin
    wired     anything else
"""

from __future__ import annotations

from ..expr import Call, Node
from . import symbols
from .words import quantity, short, tidy, waveform, wrapped

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    from ..deck import FlatDeck, MachineCard
    from ..elements import Element
    from .symbols import Symbol

GROUND = ("0", "gnd")
PASSIVE = ("resistor", "capacitor", "inductor", "diode", "switch")
SUPPLY_NAMES = (
    "vcc",
    "vdd",
    "vss",
    "vee",
    "vbat",
    "vbb",
    "vp",
    "vn",
    "vs",
    "vpp",
    "vplus",
    "vminus",
    "v+",
    "v-",
)
# names of terminals of operational amplifiers
PLUS = ("inp", "in+", "p", "ip", "vip", "plus", "np", "nip", "noninv", "inpos", "+")
MINUS = ("inm", "inn", "in-", "n", "im", "vin", "minus", "nn", "inv", "inneg", "-")
OUT = ("out", "o", "vout", "y")
ABOVE, BELOW = ("vcc", "vdd", "v+", "vp", "vs+", "vpos"), ("vee", "vss", "v-", "vn", "vs-", "vneg")


class Part:
    """`nets` by pin of the symbol; `role` orders and turns it: source, series (two pins), transistor, box, amplifier, port."""

    __slots__ = ("card", "kind", "label", "name", "nets", "role", "sources", "symbol")

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

    def __repr__(self) -> str:
        return f"<{self.kind} {self.name} {self.nets}>"


class Circuit:
    """Parts and nets of one level; `inside` is "" or the name of a subcircuit's use."""

    def __init__(self, flat: FlatDeck, inside: str = "") -> None:
        self.flat, self.inside = flat, inside
        self.parts: list[Part] = []
        self.uses = [use for use in flat.uses if _within(use[0], inside)]
        self.ports = next((nodes for name, _, nodes in flat.uses if name == inside), {})
        self.read: set[str] = set()  # nets that labels speak of
        couplings = [e for e in flat.elements if e.letter == "k" and _within(e.name, inside)]
        own = [e for e in flat.elements if _within(e.name, inside) and e.letter != "k"]
        # names of coils on cores: their values are turns
        self.windings = {name for k in couplings if k.model_name for name in k.extra["inductors"]}
        wound = self._transformers(couplings, own)
        for e in own:
            if e.name not in wound:
                self._element(e)
        for card in flat.machine:
            if _within(card.name, inside):
                self._machine(card)
        for name, of, nodes in self.uses:
            self._use(name, of, nodes)
        fixed = {*GROUND, *(net for port, net in self.ports.items() if port.lower() in (*ABOVE, *BELOW))}
        touched = {net for part in self.parts for net in part.nets}
        for port, net in self.ports.items():
            if net not in fixed and net in touched:
                side = "out" if port.lower() in OUT or port.lower().startswith(("out", "q")) else "in"
                self._part(f"{inside}:{port}", side, [net], symbols.port, [port], "port")
        self.pins: dict[str, list[tuple[int, int]]] = {}
        for k, part in enumerate(self.parts):
            for j, net in enumerate(part.nets):
                self.pins.setdefault(net, []).append((k, j))
        self.rails = self._rails()
        self.named = self._named()

    # ---- parts ----

    def shown(self, name: str) -> str:
        """A name without the prefix of the level."""
        start = self.inside + "."
        return name[len(start) :] if self.inside and name.startswith(start) else name

    def port(self, net: str) -> str:
        """What a net is called here: inside a subcircuit its terminals have the names of its definition."""
        return next((port for port, node in self.ports.items() if node == net), self.shown(net))

    def _title(self, e: Element) -> str:
        """Its name as the deck writes it."""
        name, written = self.shown(e.name), e.span.text
        return written if written.lower() == name else name[:1].upper() + name[1:]

    def _part(
        self, name: str, kind: str, nets: list[str], symbol: Any, label: list[str], role: str = "series"
    ) -> Part:
        nets = ["0" if net in GROUND else net for net in nets]
        part = Part(
            name, kind, nets, symbol, [line for text in label if text for line in wrapped(text)], role
        )
        self.parts.append(part)
        return part

    def _element(self, e: Element) -> None:
        letter, s, nodes, title = e.letter, symbols, e.nodes, self._title(e)
        value = self._value(e)
        if letter == "r":
            self._part(e.name, "resistor", nodes[:2], s.resistor, [title, value])
        elif letter == "c":
            self._part(e.name, "capacitor", nodes[:2], s.capacitor, [title, value])
        elif letter == "l":
            self._part(e.name, "inductor", nodes[:2], s.inductor, [title, value])
        elif letter in ("v", "i"):
            sort = "" if e.wave is None else "sin" if e.wave.kind.lower() == "sin" else "pulse"
            make = s.voltage if letter == "v" else s.current
            self._part(
                e.name,
                "voltage" if letter == "v" else "current",
                nodes[:2],
                lambda look: make(look, sort),
                [title, value],
                "source",
            )
        elif letter in ("e", "h", "g", "f", "b"):
            gives = "v" if letter in ("e", "h") or (letter == "b" and e.extra.get("output") == "v") else "i"
            self._part(
                e.name, "dependent", nodes[:2], lambda look: s.diamond(look, gives), [title, value], "source"
            )
        elif letter == "d":
            kind = (
                "zener" if e.model is not None and float(e.model.params.get("bv", 1e9) or 1e9) < 200 else ""
            )
            self._part(e.name, "diode", nodes[:2], lambda look: s.diode(look, kind), [title])
        elif letter in ("s", "w"):
            self._part(e.name, "switch", nodes[:2], s.switch, [title, value])
        elif letter == "q":
            pnp = e.model is not None and e.model.type in ("pnp", "lpnp")
            substrate = len(nodes) > 3 and nodes[3] not in GROUND
            nets = nodes[:4] if substrate else nodes[:3]
            self._part(
                e.name,
                "pnp" if pnp else "npn",
                nets,
                lambda look: s.transistor(look, pnp, substrate),
                [title],
                "transistor",
            )
        elif letter == "m":
            self._mosfet(e, title)
        elif letter in ("j", "z"):
            p = e.model is not None and e.model.type in ("pjf", "pmf")
            self._part(
                e.name, "pjf" if p else "njf", nodes[:3], lambda look: s.jfet(look, p), [title], "transistor"
            )
        elif letter in ("t", "o", "y") and len(nodes) >= 4:
            make_line = lambda look: s.box(["", ""], ["", ""], 5)  # noqa: E731
            self._part(e.name, "line", nodes[:4], make_line, [title, value], "box")
        else:
            half = (len(nodes) + 1) // 2
            left, right = [str(k + 1) for k in range(half)], [str(k + 1) for k in range(half, len(nodes))]
            of = e.model_name or ""
            self._part(e.name, "device", nodes, lambda look: s.box(left, right, 5), [title, of], "box")

    def _mosfet(self, e: Element, title: str) -> None:
        kind = e.model.type if e.model is not None else "nmos"
        p = kind.startswith("p") or (e.model is not None and "pchan" in e.model.params)
        nodes = ["0" if n in GROUND else n for n in e.nodes]
        # a bulk on its source, or where all bulks are, is not drawn
        bulks = [x.nodes[3] for x in self.flat.elements if x.letter == "m" and len(x.nodes) > 3]
        bulk = len(nodes) > 3 and nodes[3] != nodes[2] and bulks.count(e.nodes[3]) < 2 and nodes[3] != "0"
        threshold = float(e.model.params.get("vto", 0.0) or 0.0) if e.model is not None else 0.0
        depletion = threshold > 0 if p else threshold < 0
        nets = nodes[:4] if bulk else nodes[:3]
        self._part(
            e.name,
            "pmos" if p else "nmos",
            nets,
            lambda look: symbols.mosfet(look, p, bulk, depletion),
            [title],
            "transistor",
        )

    def _transformers(self, couplings: list[Element], own: list[Element]) -> set[str]:
        """Pairs of inductors that one K couples: drawn as one part; other K are written beside their inductors."""
        named = {e.name: e for e in own}
        count: dict[str, int] = {}
        for k in couplings:
            for name in k.extra.get("inductors", ()):
                count[name] = count.get(name, 0) + 1
        found: set[str] = set()
        for k in couplings:
            pair = [named[name] for name in k.extra.get("inductors", ()) if name in named]
            if len(pair) == 2 and all(count[e.name] == 1 for e in pair):
                names = " : ".join(self._title(e) for e in pair)
                values = " : ".join(self._value(e) for e in pair).replace(" turns :", " :")
                label = [names, values, f"k = {k.value:.4g}" if isinstance(k.value, float) else ""]
                over = (pair[0].nodes[0] in GROUND, pair[1].nodes[0] in GROUND)
                nets = [*pair[0].nodes, *pair[1].nodes]
                make = lambda look, over=over: symbols.transformer(look, over)  # noqa: E731
                part = self._part(k.name, "transformer", nets, make, label, "box")
                part.sources = [(e.name, k) for e in pair for k in (0, 1)]
                found |= {e.name for e in pair}
        return found

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
        label = [title, joint and f"on {self.shown(joint)}"]
        if card.kind == "MOTOR" and len(nodes) == 2:
            part = self._part(card.name, "motor", nodes, symbols.motor, label)
        elif card.kind == "POT":
            part = self._part(
                card.name,
                "pot",
                nodes,
                symbols.pot,
                [title, quantity(card.params.get("r"), "Ohm"), label[1]],
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

    def _use(self, name: str, of: str, nodes: dict[str, str]) -> None:
        """A box, or the triangle of an operational amplifier."""
        prefix = name + "."
        touched = {
            "0" if n in GROUND else n
            for e in self.flat.elements
            if e.name.startswith(prefix)
            for n in e.nodes
        }
        touched |= {r.name for c in self.flat.machine if c.name.startswith(prefix) for r in c.args}
        ports = {port: net for port, net in nodes.items() if ("0" if net in GROUND else net) in touched}
        title = self.shown(name)
        if not ports:
            return
        if (found := _amplifier(of, ports)) is not None:
            nets, supplies = found
            self._part(
                name,
                "amplifier",
                nets,
                lambda look: symbols.amplifier(look, supplies),
                [title, of],
                "amplifier",
            )
            return
        left: list[str] = []
        right: list[str] = []
        above: list[str] = []
        below: list[str] = []
        for port in ports:
            low = port.lower()
            side = (
                above
                if low in ABOVE
                else below
                if low in BELOW
                else right
                if low in OUT or low.startswith(("out", "q"))
                else left
            )
            side.append(port)
        if not right and len(left) > 1:
            half = (len(left) + 1) // 2
            left, right = left[:half], left[half:]
        names = round(0.72 * (max(map(len, left), default=0) + max(map(len, right), default=0))) + 2
        width = max(5, names, 4 * len(above), 4 * len(below))
        nets = [ports[p] for p in (*left, *right, *above, *below)]
        self._part(
            name,
            "use",
            nets,
            lambda look: symbols.box(left, right, width, tuple(above), tuple(below)),
            [title, of],
            "box",
        )

    # ---- words ----

    def _value(self, e: Element) -> str:
        letter, x = e.letter, e.extra
        if letter in ("r", "c", "l"):
            if isinstance(e.value, Node):
                return self._speak(e.value)
            if e.name in self.windings and isinstance(e.value, float):
                return f"{e.value:g} turns"
            unit = {"r": "Ohm", "c": "F", "l": "H"}[letter]
            return quantity(e.value, unit) or (e.model_name or "")
        if letter in ("v", "i"):
            unit = "V" if letter == "v" else "A"
            if e.wave is not None:
                return waveform(e.wave, unit)
            dc = x.get("dc")
            if dc is None and x.get("ac"):
                return f"AC {quantity(x['ac'][0], unit)}"
            return quantity(dc or 0.0, unit)
        if letter in ("s", "w"):
            if letter == "w":
                return f"by i({', '.join(x.get('controls', ()))})"
            return "by " + self._between(*e.nodes[2:4])
        if letter in ("e", "g", "f", "h", "b"):
            if isinstance(e.value, Node):
                return self._speak(e.value)
            if x.get("form") == "poly":
                return "POLY of " + ", ".join(
                    self._between(*c) if isinstance(c, tuple) else f"i({c})" for c in x.get("controls", ())
                )
            controls = x.get("controls")
            what = f"i({self.shown(controls[0])})" if controls else self._between(*e.nodes[2:4])
            gain = short(e.value)
            return what if gain == "1" else f"{gain} {what}"
        if letter == "t":
            return " ".join(f"{key}={short(v)}" for key, v in e.params.items() if key in ("z0", "td"))[:24]
        return ""

    def _between(self, a: str, b: str) -> str:
        self.read |= {n for n in (a, b) if n not in GROUND}
        if a in GROUND:
            return f"-v({self.port(b)})"
        return f"v({self.port(a)})" if b in GROUND else f"v({self.port(a)},{self.port(b)})"

    def _speak(self, value: Node) -> str:
        """An expression as far as it fits; the nodes it reads are named in the drawing."""
        for call in _calls(value):
            if call.fn == "v":
                self.read |= {n for a in call.args if (n := getattr(a, "id", "")) and n not in GROUND}
        text = tidy(repr(value))
        if self.inside:
            text = text.replace(self.inside + ".", "")
        return text

    # ---- nets ----

    def _rails(self) -> dict[str, bool]:
        """Nets that are drawn as rails: True for one above ground, False for one below."""
        found: dict[str, bool] = {}
        active = any(p.role in ("transistor", "amplifier") for p in self.parts)
        for part in self.parts:
            if part.kind != "voltage" or (part.nets[1] != "0" and part.nets[0] != "0"):
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

    def _named(self) -> set[str]:
        """Nets whose names are written: those that labels or outputs of the deck speak of."""
        asked = {n for p in (*self.flat.prints,) for _, ast in p.items for n in _voltages(ast)}
        asked |= {n for p in (*self.flat.saves, *self.flat.probes) for n in _voltages(p.ast)}
        return (asked | self.read) & set(self.pins)


def _within(name: str, inside: str) -> bool:
    """Does a name stand on this level, not deeper?"""
    if not inside:
        return "." not in name
    return name.startswith(inside + ".") and "." not in name[len(inside) + 1 :]


def _amplifier(of: str, ports: dict[str, str]) -> tuple[list[str], bool] | None:
    """Nets of +, -, out (, supplies) where a subcircuit's terminals have such names."""
    low = {port.lower(): net for port, net in ports.items()}
    roles: list[str] = []
    for names in (PLUS, MINUS, OUT):
        port = next((p for p in names if p in low), None)
        if port is None:
            return None
        roles.append(low.pop(port))
    above, below = next((p for p in ABOVE if p in low), None), next((p for p in BELOW if p in low), None)
    if not low:
        return roles, False
    if len(low) == 2 and above and below:
        return [*roles, low[above], low[below]], True
    return None


def _calls(node: Any) -> list[Call]:
    found: list[Call] = []
    stack = [node]
    while stack:
        item = stack.pop()
        if isinstance(item, (list, tuple)):
            stack.extend(item)
        elif isinstance(item, Call):
            found.append(item)
            stack.extend(item.args)
        elif isinstance(item, Node):
            stack.extend(getattr(item, part, None) for part in ("a", "b", "c"))
    return found


def _voltages(ast: Any) -> list[str]:
    return [
        getattr(a, "id", "")
        for call in _calls(ast)
        if call.fn in ("v", "db", "vdb", "vm", "vp")
        for a in call.args
    ]

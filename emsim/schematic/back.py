"""A drawing read back: what somebody sees who has the lines, dots and words alone, compared with the deck.

Wires that meet are one net; where four lines meet they cross, unless a dot stands there. Ground symbols, supplies' bars and rings
say by their word which net they are, names beside a wire belong to the wire that is nearest. What a symbol's pins are tells the
dictionary of symbols; the terminals of a box bear their names. The nets that the drawing was made from are not looked at.
"""

from __future__ import annotations

import re
from collections import defaultdict
from itertools import combinations, pairwise, product

from ..sheets.nets import Ties
from .boxes import amplifier
from .coils import written
from .reads import GROUND, reads, terminals
from .symbols import UNIT

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Hashable, Iterator
    from typing import Any

    from ..elaborate.flat import FlatDeck
    from .circuit import Circuit
    from .symbols import Symbol

    Point = tuple[float, float]
    Pins = dict[str, str]  # net by terminal

NEARER = 0.15  # grid units that a name is nearer to its own wire than to others
TURNS = [(quarter, mirrored) for mirrored in (False, True) for quarter in range(4)]


class Unreadable(Exception):
    """What cannot be read."""


class Seen:
    """What is seen of a picture's data: `pins` (what ties them) and `words` by part; `names` of what is tied; `captions`."""

    def __init__(self, data: dict[str, Any], symbols: list[Symbol]) -> None:
        self.data, self.symbols, self.ties = data, symbols, Ties()
        at = next((p["pins"][0] for p in data["parts"] if p["pins"]), (0.0, 0.0))
        self.zero = (at[0], at[1])
        self.arms: dict[Point, list[tuple[Point, Hashable]]] = defaultdict(list)
        self.ends: list[list[Point]] = []  # places of pins, by part
        self.words: list[list[str]] = []
        self.captions = [words for *_, words, net in data["names"] if not net]
        self.loose: list[tuple[Point, str]] = []  # marks: where, and the net's name
        self.edges: dict[tuple[Point, Point], None] = {}
        for wire in data["wires"]:
            self._wire([self.grid(p) for p in wire["points"]])
        for k, (part, symbol) in enumerate(zip(data["parts"], symbols, strict=True)):
            self._part(k, part, symbol)
        self._meet()
        self.names: dict[Hashable, set[str]] = defaultdict(set)
        self._name()

    def grid(self, p: Any) -> Point:
        """A place in grid units; files hold tenths of pixels."""
        return _snapped((p[0] - self.zero[0]) / UNIT), _snapped((p[1] - self.zero[1]) / UNIT)

    def net(self, part: int, pin: int) -> Hashable:
        return self.ties.root(("pin", part, pin))

    # ---- lines ----

    def _wire(self, points: list[Point]) -> None:
        for a, b in pairwise(points):
            for p, q in _pieces(a, b):
                edge = (min(p, q), max(p, q))
                if edge not in self.edges:
                    self.edges[edge] = None
                    self.arms[p].append((_direction(p, q), edge))
                    self.arms[q].append((_direction(q, p), edge))

    def _part(self, k: int, part: dict[str, Any], symbol: Symbol) -> None:
        """Takes a part's strokes and words apart: its symbol, marks at its pins, its label."""
        pins = [self.grid(p) for p in part["pins"]]
        lines = [
            (s[0], tuple(self.grid(p) for p in s[1])) for s in part["strokes"] if s[0] in ("line", "fill")
        ]
        rounds = [(s[0], self.grid(s[1:3]), s[3] / UNIT) for s in part["strokes"] if s[0] in ("ring", "dot")]
        texts = [(self.grid(t[:2]), t[3]) for t in part["texts"]]
        turn = next((t for t in TURNS if _stands(symbol, t, pins, lines, rounds, texts)), None)
        if not pins:  # a box of its own
            lines, rounds = [], []
        elif turn is None:
            raise Unreadable(f"{part['name']}: its lines are no symbol with its pins")
        if turn is not None and pins:
            for kind, what in _turned(symbol, turn, pins[0]):
                there: list[Any] = lines if kind == "line" else rounds if kind == "round" else texts
                there.remove(next(one for one in there if _same(one, what)))
        for j, (p, (_, out)) in enumerate(zip(pins, symbol.pins, strict=True)):
            dx, dy = _turn(out, turn or (0, False))
            self.arms[p].append(((-dx, -dy), ("pin", k, j)))
        self.ends.append(pins)
        self.words.append(self._marks(k, part["name"], lines, rounds, texts))

    def _marks(self, k: int, name: str, lines: list[Any], rounds: list[Any], texts: list[Any]) -> list[str]:
        """Grounds, bars and rings at pins, and the lines to them; what is left of the words is the label."""
        segments = [points for _, points in lines]
        bars = [s for s in segments if len(s) == 2 and s[0][1] == s[1][1] and abs(s[1][0] - s[0][0]) == 2]
        for bar in bars:
            x, y = (bar[0][0] + bar[1][0]) / 2, bar[0][1]
            stem = next(
                (s for s in segments if len(s) == 2 and s[1] == (x, y) and s[0][0] == x and s is not bar),
                None,
            )
            if stem is None:
                continue
            over = stem[1][1] - stem[0][1]
            shorter = [((x - h, y + over * d), (x + h, y + over * d)) for h, d in ((0.6, 0.4), (0.2, 0.8))]
            rest = [next((s for s in segments if _same(s, line)), None) for line in shorter]
            if None not in rest:
                words = "0"
                for r in rest:
                    segments.remove(r)
            else:
                text = next((t for t in texts if t[0][0] == x and 0 < (t[0][1] - y) * over < 1.5), None)
                if text is None:
                    continue
                texts.remove(text)
                words = text[1]
            segments.remove(bar)
            segments.remove(stem)
            self._lead(k, stem)
            self.loose.append((stem[0], words))
        for ring in [r for r in rounds if r[0] == "ring" and abs(r[2] - 0.25) < 0.01]:
            (x, y) = ring[1]
            stem = next((s for s in segments if len(s) == 2 and _far(s[1], (x, y)) < 0.3), None)
            text = min(texts, key=lambda t: _far(t[0], (x, y)), default=None)
            if stem is None or text is None or _far(text[0], (x, y)) > 1.1:
                continue
            texts.remove(text)
            rounds.remove(ring)
            segments.remove(stem)
            self._lead(k, stem)
            self.loose.append((stem[0], text[1]))
        for s in segments:
            if len(s) != 2:
                raise Unreadable(f"{name}: a line that belongs to nothing")
            self._lead(k, s)
        if rounds:
            raise Unreadable(f"{name}: a ring that belongs to nothing")
        return [words for _, words in texts]

    def _lead(self, k: int, line: Any) -> None:
        """A line from a pin to a mark."""
        a, b = line
        key = ("lead", k, a, b)
        for p, q in ((a, b), (b, a)):
            self.arms[p].append((_direction(p, q), key))
        for p, q in self.edges:
            if any(_on(point, a, b) for point in (p, q)) and a not in (p, q):
                self.ties.tie(key, (p, q))

    def _meet(self) -> None:
        """Ties what comes together at a point."""
        dots = {self.grid(d) for d in self.data["dots"]}
        for p, arms in self.arms.items():
            by: dict[Point, Hashable] = {}
            for direction, key in arms:
                if direction in by:  # lines on one another
                    self.ties.tie(by[direction], key)
                by[direction] = key
            if p in dots or len(by) != 4:
                for (_, a), (_, b) in pairwise(by.items()):
                    self.ties.tie(a, b)
            else:
                for (dx, dy), key in by.items():
                    self.ties.tie(key, by[(-dx, -dy)])

    # ---- words ----

    def _name(self) -> None:
        """Everything of one name is one net."""
        said: list[tuple[Hashable, str]] = []
        for at, words in self.loose:
            said += [(key, words) for _, key in self.arms[at][:1]]
        for k, part in enumerate(self.data["parts"]):
            if part["kind"] in ("in", "out", "flag"):
                said.append((("pin", k, 0), "".join(self.words[k])))
        said += [(self._nearest(name), name[3]) for name in self.data["names"] if name[4]]
        first: dict[str, Hashable] = {}
        for key, words in said:
            self.ties.tie(first.setdefault(words, key), key)
        for key, words in said:
            self.names[self.ties.root(key)].add(words)

    def _nearest(self, name: Any) -> Hashable:
        """The wire, or the pin, that a name stands beside."""
        from .picture import writing

        (x, y), anchor, words = self.grid(name[:2]), name[2], name[3]
        frame = writing(x, y, anchor, words)
        far: dict[Hashable, float] = {}
        places: list[tuple[Any, Hashable]] = [*((edge, edge) for edge in self.edges)]
        places += [((p, p), ("pin", k, j)) for k, pins in enumerate(self.ends) for j, p in enumerate(pins)]
        for (a, b), key in places:
            root, away = self.ties.root(key), gap(frame, a, b)
            far[root] = min(away, far.get(root, away))
        order = sorted(far, key=far.__getitem__)
        if not order or far[order[0]] > 1 or (len(order) > 1 and far[order[1]] - far[order[0]] < NEARER):
            raise Unreadable(f"the name `{words}` stands beside no wire, or beside two")
        return order[0]


# ---- the deck ----


def differences(data: dict[str, Any], circuit: Circuit) -> list[str]:
    """In what a drawing does not read as the deck; nothing where it does."""
    try:
        seen = Seen(data, [part.symbol(data["look"]) for part in circuit.parts])
        return [
            *_overlaps(data),
            *_terminals(seen, circuit),
            *_control(seen, circuit),
            *_couplings(seen, circuit),
        ]
    except Unreadable as wrong:
        return [str(wrong)]


def _terminals(seen: Seen, circuit: Circuit) -> Iterator[str]:
    """Every terminal of everything once, on its net."""
    wanted = _wanted(circuit)
    net_of: dict[Hashable, str] = {}
    root_of: dict[str, Hashable] = {}
    drawn = _drawn(seen, wanted)
    for title in sorted(set(wanted) ^ set(drawn)):
        yield f"{title} is {'not drawn' if title in wanted else 'drawn, and the deck has none'}"
    for title in set(wanted) & set(drawn):
        pins, there = wanted[title], drawn[title]
        for terminal in sorted(set(pins) ^ set(there)):
            yield f"{title}: terminal {terminal} is {'missing' if terminal in pins else 'too many'}"
        for terminal in set(pins) & set(there):
            net, root = pins[terminal], seen.ties.root(there[terminal])
            if net_of.setdefault(root, net) != net:
                yield f"{title}: terminal {terminal} is on {net_of[root]} in place of {net}"
            if root_of.setdefault(net, root) != root:
                yield f"{title}: terminal {terminal} is not tied to the rest of {net}"
    for root, names in seen.names.items():
        held = net_of.get(root)
        own = {
            port
            for port, node in circuit.ports.items()
            if node == held or (held is None and node not in root_of)
        }
        own |= {circuit.port(held)} if held is not None else set()
        for words in sorted(names - own):
            yield f"{words} is written at {held}"
    for port, net in circuit.ports.items():
        if net in root_of and net not in GROUND and circuit.port(net) not in seen.names.get(root_of[net], ()):
            yield f"terminal {port} bears no name"
    for net in sorted(circuit.read - set(GROUND)):
        if net in root_of and not seen.names.get(root_of[net]):
            yield f"{circuit.port(net)} is read and bears no name"


def _wanted(circuit: Circuit) -> dict[str, Pins]:
    """Net by terminal of all that the deck has on the level, by what it is called there."""
    from ..cards import CARDS
    from .circuit import _within as within
    from .circuit import beyond

    flat, inside = circuit.flat, circuit.inside
    ground = lambda net: "0" if net in GROUND else net  # noqa: E731
    found: dict[str, Pins] = {}
    for e in flat.elements:
        if not within(e.name, inside) or e.letter == "k":
            continue
        pins = {str(k): ground(net) for k, net in enumerate(terminals(e))}
        if e.letter == "q" and pins.get("3") == "0":
            del pins["3"]  # where it is if nobody says
        found[circuit.shown(e.name)] = pins
    for card in flat.machine:
        cls = CARDS.get(card.kind)
        if not within(card.name, inside) or cls is None:
            continue
        forms = cls.variant(card, flat.models).forms(card)
        kinds = next((form for form in forms if len(form) == len(card.args)), [])
        nodes = [ref.name for ref, (_, kind) in zip(card.args, kinds, strict=False) if kind == "node"]
        if nodes:
            found[circuit.shown(card.name)] = {str(k): ground(net) for k, net in enumerate(nodes)}
    hidden = circuit._hidden()
    for name, of, nodes_of in circuit.uses:
        pins = {port: ground(net) for port, net in nodes_of.items()}
        pins |= {beyond(circuit.port(net), nodes_of): net for net in hidden[name][0]}
        roles = amplifier(pins, of)
        found[circuit.shown(name)] = {str(k): pins[p] for k, p in enumerate(roles[0])} if roles else pins
    return found


def _drawn(seen: Seen, wanted: dict[str, Pins]) -> dict[str, dict[str, Hashable]]:
    """What ties each terminal of what is drawn, by the title in its label. A bulk without a pin is where it is told, else on its
    source."""
    found: dict[str, dict[str, Hashable]] = {}
    for k, (part, words) in enumerate(zip(seen.data["parts"], seen.words, strict=True)):
        if part["kind"] in ("in", "out", "flag"):
            continue
        label = "".join(words).replace(" ", "").lower()
        count = len(part["pins"])
        titles = dict.fromkeys(name for name, _ in part["sources"]) or {part["name"]: None}
        shown = [name[len(seen.data["inside"]) + 1 :] if seen.data["inside"] else name for name in titles]
        if not label.startswith(":".join(shown)):
            raise Unreadable(f"{part['name']} does not bear its name")
        if part["kind"] == "use":
            found[shown[0]] = {port: ("pin", k, j) for port, j in _ports(seen, k).items()}
            continue
        each = count // max(1, len(shown))
        for n, title in enumerate(shown):
            found[title] = {str(j): ("pin", k, n * each + j) for j in range(each)}
    bulks: dict[str, Hashable] = {}
    for caption in seen.captions:
        if told := re.fullmatch(r"bulks of (.+): (\S+)", caption):
            root = next((root for root, names in seen.names.items() if told[2] in names), ("told", told[2]))
            bulks |= dict.fromkeys(told[1].lower().split(", "), root)
    for k, part in enumerate(seen.data["parts"]):
        title = part["name"][len(seen.data["inside"]) + 1 :] if seen.data["inside"] else part["name"]
        if part["kind"] in ("nmos", "pmos") and len(part["pins"]) == 3 and "3" in wanted.get(title, ()):
            kind = "n-channel" if part["kind"] == "nmos" else "p-channel"
            # a line from the bulk's arrow to the source's lead
            is_tied = any(
                s[0] == "line" and s[1][0] == (3, 0) and len(s[1]) == 2 for s in seen.symbols[k].strokes
            )
            found[title]["3"] = (
                found[title]["2"] if is_tied else bulks.get(title, bulks.get(kind, ("untold", title)))
            )
    return found


def _ports(seen: Seen, k: int) -> dict[str, int]:
    """Of a box the pin by the name that stands inside beside it."""
    part = seen.data["parts"][k]
    inside = [(seen.grid(t[:2]), t[2], t[3]) for t in part["texts"]]
    found: dict[str, int] = {}
    for j, p in enumerate(seen.ends[k]):
        x0, y0, x1, y1 = (*seen.grid(part["box"][:2]), *seen.grid(part["box"][2:]))
        here = [t for t in inside if x0 < t[0][0] < x1 and y0 < t[0][1] < y1]
        if not here:
            raise Unreadable(f"{part['name']}: a terminal without a name")
        nearest = min(here, key=lambda t: _far(t[0], p))
        if nearest[2] in found:
            raise Unreadable(f"{part['name']}: two terminals `{nearest[2]}`")
        found[nearest[2]] = j
    return found


def _control(seen: Seen, circuit: Circuit) -> Iterator[str]:
    """Everything that an element reads stands in its label."""
    labels: dict[str, str] = {}
    for part, words in zip(seen.data["parts"], seen.words, strict=True):
        for name in {part["name"], *(source for source, _ in part["sources"])}:
            labels[name] = "".join(words).replace(" ", "").lower()
    for e in circuit.flat.elements:
        if e.name not in labels or e.letter == "k":
            continue
        read, said = reads(e), labels[e.name]
        there = {word for group in re.findall(r"v\(([^()]*)\)", said) for word in group.split(",")}
        for net in read.nets:
            if circuit.port(net) not in there:
                yield f"{e.name} reads v({circuit.port(net)}), and its label does not say so"
        for name in read.names:
            if circuit.shown(name) not in said:
                yield f"{e.name} reads {circuit.shown(name)}, and its label does not say so"


def _couplings(seen: Seen, circuit: Circuit) -> Iterator[str]:
    """Every K stands at its core, or below the drawing."""
    from .circuit import _within as within

    cores = [
        ({name for name, _ in part["sources"]}, "".join(words).replace(" ", ""))
        for part, words in zip(seen.data["parts"], seen.words, strict=True)
        if part["kind"] == "transformer"
    ]
    for k in circuit.flat.elements:
        if k.letter != "k" or not within(k.name, circuit.inside):
            continue
        coils = set(k.extra["inductors"])
        said = f"core{k.model_name}" if k.model_name else written(k, {}).split(")")[1].replace(" ", "")
        shown = {name: circuit.shown(name) for name in coils}
        alone = written(k, shown).lower()
        told = any(coils <= names and said in words for names, words in cores)
        if not told and not any(caption.lower() == alone for caption in seen.captions):
            yield f"{circuit.shown(k.name)} is not drawn"


def _overlaps(data: dict[str, Any]) -> Iterator[str]:
    """Symbols that lie on one another, or under a wire."""
    for p, q in combinations(data["parts"], 2):
        if _over(p["box"], q["box"], 0.5):
            yield f"{p['name']} lies on {q['name']}"
    for wire, part in product(data["wires"], data["parts"]):
        for a, b in pairwise(wire["points"]):
            line = (min(a[0], b[0]) - 1, min(a[1], b[1]) - 1, max(a[0], b[0]) + 1, max(a[1], b[1]) + 1)
            if _over(line, part["box"], 1.5):
                yield f"a wire runs through {part['name']}"


# ---- the deck as a list ----


def listing(flat: FlatDeck, inside: str, look: str, said: str) -> dict[str, Any]:
    """In place of a drawing that cannot be trusted: a sentence, and every element with its nets, as a picture of words alone."""
    from .circuit import _within as within

    lines = [said, ""]
    for e in flat.elements:
        if within(e.name, inside):
            lines.append(f"{e.name}:  {'  '.join(terminals(e) or e.extra.get('inductors', ()))}")
    for name, of, nodes in flat.uses:
        if within(name, inside):
            lines.append(f"{name} ({of}):  {'  '.join(f'{port} = {net}' for port, net in nodes.items())}")
    for card in flat.machine:
        if within(card.name, inside):
            lines.append(f"{card.kind} {card.name}:  {'  '.join(map(repr, card.args))}")
    names = [[16, 24 + 16 * k, "start", words, ""] for k, words in enumerate(lines)]
    width = 32 + round(6.6 * max(map(len, lines)))
    return {
        "width": width, "height": 32 + 16 * len(lines), "look": look, "inside": inside, "note": "", "parts": [],
        "wires": [], "dots": [], "names": names, "nets": [],
    }  # fmt: skip


# ---- geometry ----


def _turn(p: Any, turn: tuple[int, bool]) -> Point:
    from .layout import turned

    return turned(p, turn)


def _turned(symbol: Symbol, turn: tuple[int, bool], first: Point) -> list[tuple[str, Any]]:
    """A symbol's lines, rounds and words as it stands with its first pin at `first`."""
    zero = _turn(symbol.pins[0][0], turn)

    def at(p: Any) -> Point:
        x, y = _turn(p, turn)
        return x + first[0] - zero[0], y + first[1] - zero[1]

    found: list[tuple[str, Any]] = []
    for kind, *rest in symbol.strokes:
        if kind in ("line", "fill"):
            found.append(("line", (kind, tuple(at(p) for p in rest[0]))))
        elif kind == "text":
            found.append(("text", (at(rest[0]), rest[1])))
        else:
            found.append(("round", (kind, at(rest[0]), rest[1])))
    return found


def _stands(
    symbol: Symbol, turn: tuple[int, bool], pins: list[Point], lines: Any, rounds: Any, texts: Any
) -> bool:
    """Does the symbol stand so turned where the pins are?"""
    if len(pins) != len(symbol.pins):
        return False
    if pins:
        zero = _turn(symbol.pins[0][0], turn)
        for p, (at, _) in zip(pins, symbol.pins, strict=True):
            x, y = _turn(at, turn)
            if _far((x - zero[0], y - zero[1]), (p[0] - pins[0][0], p[1] - pins[0][1])) > 0.05:
                return False
    of = {"line": lines, "round": rounds, "text": texts}
    own = _turned(symbol, turn, pins[0]) if pins else []
    return all(any(_same(one, what) for one in of[kind]) for kind, what in own)


def _same(a: Any, b: Any) -> bool:
    """Equal words, and places that are one but for rounding."""
    if isinstance(a, tuple) and isinstance(b, tuple):
        return len(a) == len(b) and all(map(_same, a, b))
    if isinstance(a, str) or isinstance(b, str):
        return bool(a == b)
    return bool(abs(a - b) < 0.04)


def _snapped(v: float) -> float:
    return round(v) if abs(v - round(v)) < 0.015 else round(v, 2)


def _pieces(a: Point, b: Point) -> Iterator[tuple[Point, Point]]:
    """A line cut at every point of the grid."""
    n = round(max(abs(b[0] - a[0]), abs(b[1] - a[1])))
    if n and a[0] != b[0] and a[1] != b[1]:
        raise Unreadable("a wire that slants")
    points = (
        [(round(a[0] + (b[0] - a[0]) * k / n), round(a[1] + (b[1] - a[1]) * k / n)) for k in range(n + 1)]
        if n
        else []
    )
    yield from pairwise(points)


def _direction(a: Point, b: Point) -> Point:
    return ((b[0] > a[0]) - (b[0] < a[0]), (b[1] > a[1]) - (b[1] < a[1]))


def _on(p: Point, a: Point, b: Point) -> bool:
    return min(a[0], b[0]) <= p[0] <= max(a[0], b[0]) and min(a[1], b[1]) <= p[1] <= max(a[1], b[1])


def _far(a: Point, b: Point) -> float:
    return abs(a[0] - b[0]) + abs(a[1] - b[1])


def gap(frame: tuple[float, float, float, float], a: Point, b: Point) -> float:
    """From a frame to a level or upright line."""
    dx = max(frame[0] - max(a[0], b[0]), min(a[0], b[0]) - frame[2], 0.0)
    dy = max(frame[1] - max(a[1], b[1]), min(a[1], b[1]) - frame[3], 0.0)
    return float((dx * dx + dy * dy) ** 0.5)


def _over(a: Any, b: Any, gap: float) -> bool:
    return bool(a[0] < b[2] - gap and b[0] < a[2] - gap and a[1] < b[3] - gap and b[1] < a[3] - gap)

"""Qucs-S' schematics (.sch), by its sources (qucs/schematic_file.cpp, qucs/components/component.cpp).

A component is one line: kind, name, 1 where it is active, its place, that of its words, mirrored, turned, and its properties,
each with whether it is shown. Wires are lines with the name of their net. Components whose names begin with a dot are analyses;
equations that numbers follow from become parameters, those that read results are told and left out. A `Sub` is another schematic,
whose `Port`s are its terminals and whose symbol says where they stand.
"""

from __future__ import annotations

import os
import re
from math import ceil, log10

from ..diagnostics import Span
from ..source import SourceFile, load
from ..units import spice_number
from . import outlines
from .nets import Rule, connect
from .qucs_parts import EMPTY, PARTS, Part, cards, value
from .sheet import SCALES, Label, Pin, Sheet, Symbol, Wire, word

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from ..diagnostics import Sink
    from .sheet import Card, Point, Word

DIALECT = None
RULE = Rule(tees=False, pins=False, labels=True, number=lambda k: f"_net{k - 1}")
PIECE = re.compile(r'"((?:[^"\\]|\\.)*)"|(\S+)')


class Drawn:
    """A line of the components."""

    letters = 34  # of a value in a drawing

    def __init__(self, words: list[Word], at: int) -> None:
        self.kind, self.name, self.line = str(words[0]), words[1], at
        self.active = int(words[2])
        self.at = (int(words[3]), int(words[4]))
        self.texts = (int(words[5]), int(words[6]))
        self.mirrored, self.turns = words[7] == "1", int(words[8])
        self.given, self.shown = words[9::2], words[10::2]


def read(file: SourceFile, sink: Sink) -> Sheet:
    """The sheet of a drawing, with those of the schematics below it."""
    return Reader(sink).sheet(file, "")


def turned(p: Point, d: Drawn) -> Point:
    """A place in a component's own coordinates in the drawing: top and bottom changed if mirrored, then turned left."""
    x, y = p
    y = -y if d.mirrored else y
    for _ in range(d.turns % 4):
        x, y = y, -x
    return d.at[0] + x, d.at[1] + y


class Reader:
    def __init__(self, sink: Sink) -> None:
        self.sink = sink
        self.below: dict[str, Sheet] = {}
        self.depth = 0

    def sheet(self, file: SourceFile, name: str) -> Sheet:
        own = Sheet(file, SCALES["qucs"], name)
        own.below = self.below
        own.parameters = _parameters(file)
        drawn = self._lines(own)
        made: list[tuple[Drawn, Symbol, Part]] = []
        for d in drawn:
            if d.kind == "GND" and d.active:
                own.labels.append(Label(d.at, "0", d.name, 0, "ground"))
                own.labels[-1].turns = d.turns + (2 if d.mirrored else 0)
            elif d.kind == "Port":
                number = d.given[0] if d.given else word("1")
                own.labels.append(Label(d.at, str(d.name), d.name, 1, "port", f"port {number}", str(d.name)))
            elif (found := self._place(own, d)) is not None:
                made.append(found)
        connect(own, RULE)
        for d, symbol, part in made:
            self._become(own, d, symbol, part)
        self._dots(own, drawn)
        if not name:
            own.cards[:0] = [[".param", f"{k}={v}"] for k, v in own.parameters.items() if v]
        ports = {int(d.given[0]): d for d in drawn if d.kind == "Port" and d.given and d.given[0].isdigit()}
        nets = {label.at: label.net for label in own.labels}
        own.ports = [nets[ports[k].at] for k in sorted(ports)] if name else []
        return own

    # ---- lines ----

    def _lines(self, own: Sheet) -> list[Drawn]:
        drawn: list[Drawn] = []
        section = ""
        for number, text in enumerate(own.file.text.split("\n"), 1):
            line = text.strip()
            if re.fullmatch(r"</?[A-Z][a-z]+>", line):
                section = "" if line[1] == "/" else line[1:-1]
                continue
            words = [
                word(
                    m[1] if m[1] is not None else m[2],
                    number,
                    (m.start(1) if m[1] is not None else m.start(2)) + 1,
                )
                for m in _pieces(text)
            ]
            if not words or not section:
                continue
            try:
                if section == "Components":
                    drawn.append(Drawn(words, number))
                elif section == "Wires":
                    self._wire(own, words)
                elif section == "Paintings" and words[0] == "Text":
                    x, y, body = int(words[1]), int(words[2]), words[6]
                    own.texts += [
                        (x, y + 14 * k + 7, "start", said) for k, said in enumerate(body.split("\\n"))
                    ]
                elif section == "Paintings" and words[0] in ("Line", "Rectangle", "Ellipse"):
                    own.lines.append(_painting(words))
            except (ValueError, IndexError):
                whole = Span(own.file, number, 1, len(text) + 1)
                self.sink.error("E155", f"this line of the schematic is none of its {section.lower()}", whole)
        return drawn

    def _wire(self, own: Sheet, words: list[Word]) -> None:
        a, b = (int(words[0]), int(words[1])), (int(words[2]), int(words[3]))
        if a != b:
            own.wires.append(Wire(a, b))
        if len(words) > 4 and words[4]:
            name = words[4]
            ground = name.lower() in ("gnd", "0")
            own.labels.append(Label(a, "0" if ground else _net(name), name, 0 if ground else 2, "name"))
            if len(words) > 6:
                own.labels[-1].seat = (int(words[5]), int(words[6]) + 8)

    # ---- components ----

    def _place(self, own: Sheet, d: Drawn) -> tuple[Drawn, Symbol, Part] | None:
        """A component that becomes cards, with its pins; None, with a message where it should have been one."""
        if d.kind == "Sub":
            places = self._ports_of(own, d)
        elif d.kind in PARTS:
            places = [(int(x), int(y)) for x, y in (at.split(",") for at in PARTS[d.kind][0].split())]
        elif d.kind.startswith(".") or d.kind in WORDS or not d.active:
            return None
        else:
            said = f"`{d.kind}` ({d.name}) has no card here"
            self.sink.error(
                "E156", said, _span(own.file, d.name), "draw it of parts that SPICE has, or as a subcircuit"
            )
            return None
        if places is None:
            return None
        pins = [Pin(*turned(at, d), str(k + 1), d.name) for k, at in enumerate(places)]
        symbol = Symbol("", pins, [])
        own.symbols.append(symbol)
        if d.active == 2 and len(pins) == 2:
            own.wires.append(Wire((pins[0].x, pins[0].y), (pins[1].x, pins[1].y)))
        return d, symbol, Part(d.kind, d.name, d.given, pins)

    def _become(self, own: Sheet, d: Drawn, symbol: Symbol, part: Part) -> None:
        """What a component is as cards, and its words."""
        if d.active != 1:
            return
        if d.kind == "Sub":
            file = os.path.splitext(os.path.basename(d.given[0]))[0]
            of = _net(file)
            sheet = self.below[of.lower()]
            values = [
                f"{n}={value(v)}"
                for n, v in zip(sheet.parameters, d.given[1:], strict=False)
                if sheet.parameters[n]
            ]
            made: list[Card] | None = [[part.named("X"), *symbol.pins, of, *values]]
            symbol.strokes = _box(symbol.pins)
        else:
            made = cards(part)
            symbol.strokes = _box(symbol.pins) if d.kind in ("Tr", "MUT", "potentiometer") else None
        symbol.cards = made or []
        if symbol.cards:
            symbol.name = str(symbol.cards[0][0]).lower()
        x, y = d.at[0] + d.texts[0], d.at[1] + d.texts[1] + 6
        symbol.texts = [(x, y, "start", str(d.name))]
        shown = [str(v) for v, flag in zip(d.given, d.shown, strict=False) if flag == "1" and v]
        for k, said in enumerate(shown[:4], 1):
            symbol.texts.append(
                (
                    x,
                    y + 13 * k,
                    "start",
                    said if len(said) <= Drawn.letters else said[: Drawn.letters - 2] + "..",
                )
            )

    def _ports_of(self, own: Sheet, d: Drawn) -> list[Point] | None:
        """Where the terminals of a schematic's symbol stand, by their numbers; reads it, once."""
        given = d.given[0] if d.given else word("")
        span = _span(own.file, given if given else d.name)
        path = os.path.join(os.path.dirname(own.file.path or ""), given)
        of = _net(os.path.splitext(os.path.basename(given))[0])
        try:
            file = load(path, span)
        except (OSError, ValueError) as error:
            said = f"cannot read {given}: {getattr(error, 'strerror', None) or error}"
            self.sink.error("E501", said, span, "put it beside the schematic")
            return None
        if of.lower() not in self.below and self.depth >= Sheet.most_below:
            said = f"{self.depth} schematics within schematics are the most"
            self.sink.error("E155", said, span, "one of them may be within itself")
            return None
        if of.lower() not in self.below:
            self.below[of.lower()] = Sheet(file, SCALES["qucs"], of)  # for one that is within itself
            self.depth += 1
            self.below[of.lower()] = self.sheet(file, of)
            self.depth -= 1
        found = re.findall(r"<\.PortSym\s+(-?\d+)\s+(-?\d+)\s+(\d+)", file.text)
        places = {int(k): (int(x), int(y)) for x, y, k in found}
        if len(places) != len(self.below[of.lower()].ports):
            said = f"{given} has {len(self.below[of.lower()].ports)} ports, and its symbol {len(places)}"
            self.sink.error("E156", said, span, "edit its symbol in Qucs-S")
            return None
        return [places[k] for k in sorted(places)]

    # ---- analyses, equations, directives ----

    def _dots(self, own: Sheet, drawn: list[Drawn]) -> None:
        known = {str(symbol.cards[0][0]).lower() for symbol in own.symbols if symbol.cards}
        swept = {str(d.given[0]).lower() for d in drawn if d.kind == ".SW" and d.active and d.given}
        params: set[str] = set()
        for d in drawn:
            if not d.active or (not d.kind.startswith(".") and d.kind not in WORDS):
                continue
            own.texts += self._shown(d)
            if d.kind in ("Eqn", "NutmegEq", "SpicePar", "SpGlobPar", "SpiceCSPar"):
                own.cards += self._equations(own, d, params)
            elif d.kind in WORDS:
                own.cards += WORDS[d.kind](d.given)
            elif d.kind == ".DC":
                own.cards += [] if str(d.name).lower() in swept else [[".op"]]
            elif d.kind in ANALYSES:
                try:
                    own.cards.append([word(ANALYSES[d.kind](d.given), d.line, 3)])
                except (ValueError, IndexError):
                    said = f"{d.kind} {d.name} needs lin or log, and numbers for its ends and its points"
                    self.sink.error("E155", said, Span(own.file, d.line, 3, 4 + len(d.kind)))
            elif d.kind != ".SW":
                said = f"`{d.kind}` ({d.name}) is left out: no card says it"
                self.sink.warning("W155", said, _span(own.file, d.name), "its results are not computed")
        sweeps = [d for d in drawn if d.kind == ".SW" and d.active and len(d.given) > 5]
        dc = [
            d for d in sweeps if any(one.kind == ".DC" and str(one.name) == str(d.given[0]) for one in drawn)
        ]
        done: set[str] = set()
        for d in sweeps:
            outer = next((o for o in sweeps if str(o.given[0]) == str(d.name)), None)
            said = self._sweep(own, d, d in dc, known)
            if said.startswith(".dc") and outer is not None:
                second = self._sweep(own, outer, True, known)
                done.add(str(outer.name))
                said += second.removeprefix(".dc") if second.startswith(".dc") else ""
            if str(d.name) in done or said.split()[1:3] in [
                str(c[0]).split()[1:3] for c in own.cards if str(c[0])[:5] == ".step"
            ]:
                continue
            own.cards.append([word(said, d.line, 3)])

    def _shown(self, d: Drawn) -> list[tuple[float, float, str, str]]:
        x, y = d.at
        said = [str(v) for v, flag in zip(d.given, d.shown, strict=False) if flag == "1" and v]
        return [
            (x, y + 14 * k, "start", text[: Drawn.letters])
            for k, text in enumerate([f"{d.kind} {d.name}", *said])
        ]

    def _equations(self, own: Sheet, d: Drawn, params: set[str]) -> list[Card]:
        """Parameters; what reads results of a simulation is told."""
        found: list[Card] = []
        for given in d.given:
            name, eq, law = given.partition("=")
            if not eq or not name.strip().isidentifier() or (name in SETTINGS.get(d.kind, ())):
                continue
            text = law.strip()
            if d.kind == "NutmegEq" or (d.kind == "Eqn" and _reads_results(text, params)):
                said = f"the equation {name.strip()} reads results and is left out"
                self.sink.warning(
                    "W155", said, _span(own.file, given), "say it with .meas or .print of the deck"
                )
                continue
            params.add(name.strip().lower())
            found.append([".param", word(f"{name.strip()}={value(word(text))}", given.line, given.col)])
        return found

    def _sweep(self, own: Sheet, d: Drawn, is_dc: bool, known: set[str]) -> str:
        """A .step, or a .dc of a source where the sweep is one of a .DC."""
        kind, name = str(d.given[1]), str(d.given[2])
        target = next((n for n in (name.lower(), "v" + name.lower(), "i" + name.lower()) if n in known), "")
        if kind in ("list", "const"):
            values = d.given[5] if len(d.given) > 5 and "[" in d.given[5] else d.given[3]
            said = "list " + " ".join(str(value(word(v))) for v in values.strip("[] ").split(";"))
        else:
            numbers = [spice_number(value(w)) for w in d.given[3:6]]
            a, b, n = (0.0 if v is None else v for v in numbers)
            if None in numbers or not 1 <= n <= 10_000 or (kind != "lin" and not a * b > 0.0):
                ends = "two numbers" if kind == "lin" else "two numbers of one sign, none of them 0"
                said = f"the sweep {d.name} needs {ends}, and 1 to 10000 points"
                self.sink.error("E155", said, Span(own.file, d.line, 3, 4 + len(d.kind)))
                return ".step temp list 27"
            if kind == "lin":
                said = f"{a:.12g} {b:.12g} {(b - a) / max(1.0, n - 1):.12g}"
            else:
                said = "list " + " ".join(
                    f"{a * (b / a) ** (k / max(1.0, n - 1)):.9g}" for k in range(int(n))
                )
        if is_dc and target[:1] in ("v", "i") and kind == "lin":
            return f".dc {target} {said}"
        return f".step {target or 'param ' + name} {said}"


# ---- pieces ----


def _pieces(text: str) -> Any:
    """Words and quoted pieces of a line in angle brackets."""
    line = text.rstrip()
    start = line.find("<") + 1
    end = len(line) - (line[-1:] == ">")
    return PIECE.finditer(line, start, end) if start else ()


def _span(file: SourceFile, place: Word) -> Span:
    return Span(file, max(1, place.line), place.col, place.col + max(1, len(place)))


def _net(name: str) -> str:
    return "".join("_" if c in " ()=,;{}\t" else c for c in name)


def _box(pins: list[Pin]) -> list[list[Any]]:
    """A box within the terminals."""
    xs, ys = [p.x for p in pins], [p.y for p in pins]
    a, b = (min(xs) + 10, min(ys) - 10), (max(xs) - 10, max(ys) + 10)
    lines: list[list[Any]] = [outlines.box(a, b)]
    for p in pins:
        x = min(max(p.x, a[0]), b[0])
        lines.append(["line", [(p.x, p.y), (x, p.y)]])
    return lines


def _painting(words: list[Word]) -> list[Any]:
    x, y, w, h = (int(n) for n in words[1:5])
    if words[0] == "Line":
        return ["line", [(x, y), (x + w, y + h)]]
    return (outlines.box if words[0] == "Rectangle" else outlines.ellipse)((x, y), (x + w, y + h))


def _parameters(file: SourceFile) -> dict[str, str]:
    """A subcircuit's parameters, from the line of its symbol; "" for what is no number."""
    found = re.search(r"<\.ID\s+-?\d+\s+-?\d+\s+\S+((?:\s+\"[^\"]*\")*)\s*>", file.text)
    given = [p.split("=") for p in re.findall(r'"([^"]*)"', found[1]) if p.count("=") > 1] if found else []
    return {p[1]: str(value(word(p[2]))) if spice_number(p[2]) is not None else "" for p in given}


def _reads_results(law: str, params: set[str]) -> bool:
    """Does an equation read what a simulation gives?"""
    if re.search(
        r"\.[vViI]t?\b|\b(dB|phase|S\[|real|imag|stos|Time2Freq|PlotVs|vt|arg|cph|mag|max|min|avg|rms)\b|\[",
        law,
    ):
        return True
    names = {w.lower() for w in re.findall(r"[A-Za-z_]\w*(?!\w*\()", law)}
    return any(n in names for n in ("frequency", "time", "acfrequency", "hbfrequency"))


def _tran(given: list[Word]) -> str:
    start, stop, points = (float(spice_number(value(w)) or 0.0) for w in given[1:4])
    if given[0] != "lin" or not stop > start:
        raise ValueError
    step = (stop - start) / max(1.0, points - 1)
    most = value(given[19]) if len(given) > 19 else "0"
    uic = " uic" if len(given) > 18 and given[18] == "no" else ""
    said = f".tran {step:.9g} {value(given[2])} {value(given[1])}"
    return f"{said} {most}{uic}" if most not in ("0", "") else said + uic


def _ac(given: list[Word]) -> str:
    kind, a, b, n = given[:4]
    if kind not in ("lin", "log") or None in [spice_number(value(w)) for w in (a, b, n)]:
        raise ValueError
    if kind != "log":
        return f".ac lin {n} {value(a)} {value(b)}"
    first, last = (spice_number(value(w)) or 1.0 for w in (a, b))
    decades = max(1, ceil(log10(last / first)))
    return f".ac dec {ceil(((spice_number(value(n)) or 2) - 1) / decades)} {value(a)} {value(b)}"


def _noise(given: list[Word]) -> str:
    return f".noise {given[4]} {given[5]} {_ac(given[:4]).removeprefix('.ac ')}"


def _each(before: str) -> Any:
    """A card for each property."""
    return lambda given: [[before, w] if before else [w] for w in given if w.strip()]


def _script(given: list[Word]) -> list[Card]:
    """Lines of a text, as cards."""
    return [[word(line.strip(), w.line, w.col)] for w in given[:1] for line in w.split("\\n") if line.strip()]


def _files(given: list[Word]) -> list[Card]:
    return [[".include", word(f'"{w}"', w.line, w.col)] for w in given if w.strip()]


ANALYSES = {
    ".TR": _tran,
    ".AC": _ac,
    ".NOISE": _noise,
    ".SP": lambda given: ".sp" + _ac(given).removeprefix(".ac"),
}
# of components with equations: what is no equation
SETTINGS = {"Eqn": ("Export",), "NutmegEq": ("Simulation",)}
# components that are no parts: what their properties are as cards
WORDS: dict[str, Any] = {
    "Eqn": None, "SpicePar": None, "SpGlobPar": None, "SpiceCSPar": None, "NutmegEq": None,
    "SpiceModel": lambda given: [[w] for w in given[:5] if w.strip() and not EMPTY.match(w)], "SpiceInclude": _files,
    "SpiceLib": lambda given: [[".lib", given[0], given[1]]], "SpiceIC": _each(".ic"), "SpiceNodeset": _each(".nodeset"),
    "SpiceOptions": lambda given: [[".options", w] for w in given[1:] if w.strip()], "SpiceFunc": _each(".func"),
    "INCLSCR": _script, "K_SPICE": None, "VHDL": None, "SUBST": lambda given: [],
}  # fmt: skip
WORDS["K_SPICE"] = lambda given: [["K" + given[0] + given[1], *given[:3]]]

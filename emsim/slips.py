"""Slips that are told by their kind, each with what mends it: a unit apart from its number, a decimal comma, a rated voltage
beside a value, a file of another program. Lines that were meant as another card: mistakes.py.
"""

from __future__ import annotations

import re

from .diagnostics import Diagnostic, Fix, Span

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .deck import Instance
    from .diagnostics import Sink
    from .source import Line, SourceFile

# ---- files of other programs ---------------------------------------------------------------------

READS = "emsim reads SPICE netlists"
FILES = (
    (
        r"EESchema Schematic", "a schematic of KiCad's before its version 6",
        "open it in KiCad 6 to 9 and save it: a .kicad_sch is read as it is",
    ),
    (
        r"v \{xschem\b", "a schematic of xschem's",
        "its netlist runs: xschem -n -s -q FILE.sch, or Netlist in xschem, writes FILE.spice",
    ),
    (
        r"v \d{8} \d+\s", "a schematic of gschem's (gEDA, Lepton)",
        "its netlist runs: gnetlist -g spice-sdb -o FILE.cir FILE.sch, or lepton-netlist in its place",
    ),
    (
        r"\s*(<\?xml[^>]*>\s*)?(<!--.*?-->\s*)*(<!DOCTYPE eagle\b|<eagle\b)", "a drawing of Eagle's",
        "export a SPICE netlist, or open it in KiCad 6 to 9 and save it: a .kicad_sch is read as it is",
    ),
    (
        r"\s*(<\?xml[^>]*>\s*)?(<!--.*?-->\s*)*<mujoco\b", "a model of MuJoCo's (MJCF)",
        "emsim import model.xml -o model.cir writes it as a deck, which then runs",
    ),
    (
        r"\s*(<\?xml[^>]*>\s*)?(<!--.*?-->\s*)*<robot\b", "a robot description (URDF)",
        "emsim import robot.urdf -o robot.cir writes it as a deck, which then runs",
    ),
    (
        r"(\s*//[^\n]*\n)*\s*(within\b[^;]*;\s*)?(partial\s+)?(model|package|class|block)\s+(\w+)\b(?=.*^\s*end\s+\5\s*;)",
        "a model in Modelica",
        f"{READS}: a body is `BODY arm m=0.2 shape=rod(0.3)`, a revolute joint `JOINT hinge 0 arm pin`, a resistor `R1 a b 1k`",
    ),
)  # fmt: skip
HEAD = 100_000  # characters that are looked at


def foreign(file: SourceFile) -> Diagnostic | None:
    """E100 of a file that another program made, by how it begins."""
    if not re.match(
        r"\s*[(<]|\s*//|EESchema|Version|v [{\d]|\s*(?:within|partial|model|package|class|block)\s", file.text
    ):
        return None
    for pattern, what, hint in FILES:
        if re.match(pattern, file.text[:HEAD], re.S | re.M):
            return Diagnostic("error", "E100", f"{file.name} is {what} and no netlist", None, hint)
    return None


# ---- numbers -------------------------------------------------------------------------------------

_UNIT = re.compile(
    r"(meg|mil|[tgkmun\u00b5\u03bcpf])?(ohms?|farads?|henr(?:y|ies)|volts?|amps?|sec|hz|[fhvas\u03a9\u2126])?",
    re.I,
)
_RATED = re.compile(r"([-+]?\d[\d.]*\w*)/(\d[\d.]*k?[vaw]\w*)", re.I)


def is_unit(word: str) -> bool:
    return bool(word) and _UNIT.fullmatch(word) is not None


def unit_apart(line: Line, start: int, end: int) -> Diagnostic | None:
    """A unit that stands a blank behind its number: 1 kOhm."""
    text, unit = line.text, line.text[start:end]
    before = text[:start].rstrip(" \t")
    number = before[len(before.rstrip("0123456789.")) :]
    if not is_unit(unit) or not line.single or not number.strip(".") or len(before) == start:
        return None
    joined = number + unit
    if unit[:1] == "M" and unit[1:].lower() in ("", "ohm", "ohms", "\u03a9", "\u2126"):
        joined = f"{number}Meg"  # SPICE's M is milli
    span = line.span_at(len(before) - len(number), end)
    said = f"a unit stands right behind its number: `{number} {unit}` is two words"
    return Diagnostic("error", "E110", said, span, fixes=[Fix(span, joined)])


def decimal_comma(line: Line, start: int) -> Diagnostic | None:
    """A word from `start` on that a decimal comma parts from what stands before it: 4,7k."""
    text = line.text
    found = re.match(r"\d[\d.]*\w*", text[start:])
    if found is None or text[start - 1 : start] != "," or not line.single:
        return None
    begin = start - 1
    while begin and (text[begin - 1].isdigit() or text[begin - 1] in "+-"):
        begin -= 1
    if begin == start - 1:
        return None
    span = line.span_at(begin, start + found.end())
    said = f"`{span.text}` is no number: a decimal point is a dot, and a comma parts values"
    return Diagnostic("error", "E110", said, span, fixes=[Fix(span, span.text.replace(",", "."))])


def rated(line: Line, leaf: Any) -> Diagnostic | None:
    """10uF/25V: a value and what the part stands."""
    found = _RATED.fullmatch(leaf)
    if found is None:
        return None
    said = f"`{leaf}` is a value and a rating: what a part stands is no value"
    return Diagnostic("error", "E110", said, line.span(leaf), fixes=[Fix(line.span(leaf), found[1])])


def judge_commas(line: Line, place: tuple[int, int], sink: Sink) -> None:
    """W113 of commas within digits, in a list whose other values stand apart by blanks: SIN(0 1,5 1k)."""
    start, text = place[0], line.text[slice(*place)]
    if "," not in text or not line.single or not re.search(r"[\w.]\s+[-+.\d]", text):
        return
    for m in re.finditer(r"(?<![^\s(])[-+]?\d+,\d+\w*(?![^\s)])", text):
        span = line.span_at(start + m.start(), start + m.end())
        said = f"`{m[0]}` is two values here: a decimal point is a dot"
        one, two = m[0].replace(",", "."), m[0].replace(",", " ")
        fixes = [Fix(span, one), Fix(span, two, f"write `{two}` for two")]
        sink.warning("W113", said, span, fixes=fixes)


# ---- parts whose model is not there --------------------------------------------------------------

# names that makers give to operational amplifiers and comparators
AMPLIFIER = re.compile(
    r"(?:lm|tl|ne|op|opa|ad|lt|ltc|mcp|ua|ca|max|tlv|tlc|ths|lmv|lmh|rc|njm|mc)\d{2,5}[a-z]*"
)


def ideal_amplifier(card: Instance) -> tuple[str, list[Fix]]:
    """What to say of an amplifier whose model is not there; where it has three terminals in+, in-, out, an E source for it."""
    span, of = card.span, card.of.span
    if not AMPLIFIER.fullmatch(card.of.name):
        return "", []
    said = f": the maker of {of.text} offers one"
    if len(card.refs) != 3 or card.params or span.line != of.line:
        return said, []
    plus, minus, out = (ref.name for ref in card.refs)
    text = f"E{span.text[1:]} {out} 0 {plus} {minus} 1e5"
    fix = Fix(Span(span.file, span.line, span.col, of.end), text, f"an ideal one is `{text}`")
    return f"{said}; {fix.label}", [fix]

"""Waveforms of independent sources, with every default resolved as ngspice resolves it (vsrcload.c, tag 39).

The engine gets complete argument lists:

    pulse  v1 v2 td tr tf pw per np       np 0: without end
    sin    vo va f td theta phase         phases in degrees
    exp    v1 v2 td1 tau1 td2 tau2
    sffm   vo va fc mdi fs phc phs
    am     va vo mf fc td ph              ngspice takes ph from the seventh place and ignores the sixth
    pwl    t0 v0 t1 v1 ...
    pwlr   td r t0 v0 t1 v1 ...           r < 0: not repeated
    dc     v

TRNOISE and TRRANDOM are pwl too: noises.py. They are added to the DC value.

Times in s, frequencies in Hz, values in V or A. "0" for a time of PULSE or EXP means "not given".
"""

from __future__ import annotations

from itertools import pairwise
from math import ceil, isfinite

from ..diagnostics import Fix, Span
from ..traced import number

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..deck import Waveform
    from ..diagnostics import Sink
    from ..elements import Element

Resolved = tuple[str, list[float], float | None]

RANDOM_KINDS = ("trnoise", "trrandom")  # noises.py
# kind -> least number of arguments
LEAST = {"pulse": 2, "sin": 1, "exp": 2, "pwl": 2, "sffm": 1, "am": 1, "dc": 1, "trnoise": 1, "trrandom": 2}


def of_source(e: Element, times: tuple[float, ...], sink: Sink, runs: bool = True) -> Resolved:
    """(kind, arguments, dc) of a V or I element; dc is None when no DC value is written. `runs`: a transient reads it."""
    dc = e.extra.get("dc")
    if e.wave is None:
        value = dc if dc is not None else e.value
        return "dc", [number(value) if isinstance(value, (int, float)) else 0.0], None
    if e.wave.kind in RANDOM_KINDS:
        plain = 0.0 if dc is None else number(dc)
        if not runs:
            return "dc", [plain], None
        kind, args = resolve(e.wave, times, sink)
        return kind, [a + plain if k % 2 else a for k, a in enumerate(args)] if kind == "pwl" else args, None
    kind, args = resolve(e.wave, times, sink)
    return kind, args, None if dc is None else number(dc)


def resolve(wave: Waveform, times: tuple[float, ...], sink: Sink) -> tuple[str, list[float]]:
    """Kind and complete arguments. `times` are (tstep, tstop) of the transient analysis [s]; with a period behind them the
    waveform is continued into the past, E440 where it does not repeat."""
    kind, given = wave.kind.lower(), [number(a) for a in wave.args]
    rule = RULES.get(kind)
    if rule is None:
        sink.error(
            "E292", f"waveform {kind.upper()} is not supported", wave.span,
            hint="there are PULSE SIN EXP PWL SFFM AM TRNOISE TRRANDOM",
        )  # fmt: skip
        return "dc", [0.0]
    if not all(map(isfinite, given)):
        sink.error("E292", f"{kind.upper()} has an argument that is no finite number", wave.span)
        return "dc", [0.0]
    if len(given) < LEAST[kind]:
        sink.error(
            "E292",
            f"{kind.upper()} needs {LEAST[kind]} argument{'s' if LEAST[kind] > 1 else ''} at least",
            wave.span,
        )
        return "dc", [0.0]
    try:
        args = rule(Arguments(given), wave, *times[:2])
    except ValueError as trouble:
        sink.error("E292", f"{kind.upper()}: {trouble}", wave.span)
        return "dc", [0.0]
    if kind == "pulse":
        _judge_width(wave, given, args, times[1], sink)
    if kind in RANDOM_KINDS:
        if len(times) == 3:
            said = f"{kind.upper()} does not repeat at all"
            sink.error("E440", said, wave.span, "a steady state has no noise of its own")
        return "pwl", args
    kind = "pwlr" if len(args) > len(given) and kind == "pwl" else kind
    if len(times) == 3:
        args, said = continued(kind, args, times[2])
        if said:
            hint = "give a period in which every source repeats"
            sink.error("E440", f"{wave.kind.upper()} {said}", wave.span, hint)
    return kind, args


def _judge_width(wave: Waveform, given: list[float], args: list[float], stop: float, sink: Sink) -> None:
    """W292: a pulse that is wider than its period, in a run that sees the next one begin."""
    delay, width, period = args[2], args[5], args[6]
    if len(given) < 7 or not 0.0 < given[6] < given[5] or stop <= delay + period or args[7] == 1.0:
        return
    import re

    said = f"the pulse is {width:g} s wide and comes again every {period:g} s: its end is never reached"
    span, fixes = wave.span, []
    words = (
        list(re.finditer(r"[^\s,()]+", span.text))[1:] if span is not None and "{" not in span.text else []
    )
    if span is not None and len(words) >= 7:
        first, last = words[5], words[6]
        place = Span(span.file, span.line, span.col + first.start(), span.col + last.end())
        turned = span.text[last.start() : last.end()] + span.text[first.end() : last.start()] + first[0]
        fixes = [Fix(place, turned)]
    hint = "form: PULSE(v1 v2 td tr tf width period)" + (
        f"; write `{fixes[0].text}` for the two" if fixes else ""
    )
    sink.warning("W292", said, span, hint, fixes=fixes)


def continued(kind: str, args: list[float], period: float) -> tuple[list[float], str]:
    """A waveform as if it had been running for ever, and what is wrong where it does not repeat with the period."""

    def fits(frequency: float) -> bool:
        turns = abs(frequency * period)
        return abs(turns - round(turns)) <= 1e-6 * max(turns, 1.0)

    def early(at: int, start: float = 0.0) -> list[float]:
        late = args[at] + start
        return [
            *args[:at],
            args[at] - ceil(late / period - 1e-9) * period if late > 0 else args[at],
            *args[at + 1 :],
        ]

    every = f"does not repeat every {period:g} s"
    if kind == "pulse" and args[0] != args[1]:
        if args[7]:
            return args, f"ends after {args[7]:g} pulses"
        return early(2), "" if fits(1.0 / args[6]) else f"{every}: its period is {args[6]:g} s"
    if kind == "sin" and args[1]:
        if args[4]:
            return args, "dies out"
        return early(3), "" if fits(args[2]) else f"{every}: its frequency is {args[2]:g} Hz"
    if (kind == "exp" and args[0] != args[1]) or (kind == "pwl" and len(set(args[1::2])) > 1):
        return (
            args,
            f"does not repeat at all{'' if kind == 'exp' else ': r=0 behind its points repeats them'}",
        )
    if kind == "pwlr":
        every_ = args[-2] - args[1]
        if args[1] < 0:
            return args, "does not repeat at all: r=0 behind its points repeats them"
        return early(0, args[-2]), "" if every_ > 0 and fits(
            1.0 / every_
        ) else f"{every}: its period is {every_:g} s"
    if kind in ("sffm", "am"):
        own = (args[2], args[4]) if kind == "sffm" else (args[2], args[3])
        wrong = next((f for f in own if not fits(f)), None)
        return early(
            4
        ) if kind == "am" else args, "" if wrong is None else f"{every}: {wrong:g} Hz does not fit"
    return args, ""


class Arguments:
    """Arguments by place, with the two kinds of default."""

    __slots__ = ("given",)

    def __init__(self, given: list[float]) -> None:
        self.given = given

    def get(self, k: int, default: float = 0.0) -> float:
        return self.given[k] if k < len(self.given) else default

    def nonzero(self, k: int, default: float) -> float:
        """A zero counts as not given."""
        return self.get(k) or default


def pulse(a: Arguments, wave: Waveform, tstep: float, tstop: float) -> list[float]:
    for k, what in ((3, "rise time"), (4, "fall time"), (5, "width"), (6, "period")):
        if a.get(k) < 0.0:
            raise ValueError(f"its {what} must not be negative, it is {a.get(k):g}")
    return [
        a.get(0), a.get(1, a.get(0)), a.get(2),
        a.nonzero(3, tstep), a.nonzero(4, tstep), a.nonzero(5, tstop), a.nonzero(6, tstop), a.get(7),
    ]  # fmt: skip


def sine(a: Arguments, wave: Waveform, tstep: float, tstop: float) -> list[float]:
    if a.get(6) and a.get(3) + a.get(6) / a.nonzero(2, 1.0 / tstop) < tstop:  # others end behind the run
        raise ValueError(
            f"the number of cycles, {a.get(6):g}, is LTspice's; write a B source that is 0 behind them"
        )
    return [a.get(0), a.get(1), a.nonzero(2, 1.0 / tstop), a.get(3), a.get(4), a.get(5)]


def exponential(a: Arguments, wave: Waveform, tstep: float, tstop: float) -> list[float]:
    for k, what in ((3, "rise"), (5, "fall")):
        if a.get(k) < 0.0:
            raise ValueError(f"its {what} time constant must not be negative, it is {a.get(k):g}")
    td1 = a.nonzero(2, tstep)
    return [a.get(0), a.get(1), td1, a.nonzero(3, tstep), a.nonzero(4, td1 + tstep), a.nonzero(5, tstep)]


def piecewise(a: Arguments, wave: Waveform, tstep: float, tstop: float) -> list[float]:
    values = a.given
    if len(values) % 2:
        raise ValueError("times and values come in pairs")
    times = values[::2]
    for before, after in pairwise(times):
        if after < before:
            raise ValueError(f"time {after:g} comes after {before:g}")
    repeat = wave.params.get("r")
    r = -1.0 if repeat is None else float(repeat)
    if r >= 0.0 and r not in times[:-1]:
        raise ValueError(f"r={r:g} is none of its times before the last")
    td = float(wave.params.get("td", 0.0))
    return [td, r, *values] if td or r >= 0.0 else values


def frequency_modulated(a: Arguments, wave: Waveform, tstep: float, tstop: float) -> list[float]:
    return [
        a.get(0), a.get(1), a.nonzero(2, 1.0 / tstop), a.get(3), a.nonzero(4, 1.0 / tstop),
        a.get(5), a.get(6),
    ]  # fmt: skip


def amplitude_modulated(a: Arguments, wave: Waveform, tstep: float, tstop: float) -> list[float]:
    return [a.get(0), a.get(1), a.nonzero(2, 1.0 / tstop), a.get(3), a.get(4), a.get(6)]


def constant(a: Arguments, wave: Waveform, tstep: float, tstop: float) -> list[float]:
    return [a.get(0)]


def random(a: Arguments, wave: Waveform, tstep: float, tstop: float) -> list[float]:
    from . import noises

    return noises.points(wave.kind, a.given, tstop, wave.seed)


RULES = {
    "pulse": pulse, "sin": sine, "exp": exponential, "pwl": piecewise, "sffm": frequency_modulated,
    "am": amplitude_modulated, "dc": constant, "trnoise": random, "trrandom": random,
}  # fmt: skip

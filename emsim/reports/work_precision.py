"""Work-precision data: what an accuracy costs, tool by tool.

A `Point` is one run: error reached, CPU seconds, evaluations. A `Series` is one tool (a method, ngspice, another
engine) over its ladder of settings. Two tools are compared at equal error, never at equal tolerance:

  front     points that no other point of the tool beats in both error and time
  at(e)     time on that front at error e, by straight lines in log(error), log(time)               (1)

A tool that is more accurate than e at its cheapest point costs what that point costs. Beyond the most accurate
point nothing is extrapolated: the tool does not reach e.
"""

from __future__ import annotations

from itertools import pairwise
from math import exp, inf, isfinite, log

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from typing import Any

SMALLEST = 1e-17  # errors below this are drawn and interpolated as this
GROUPS = ("emsim", "absolute", "scipy", "ngspice", "engine")


class Point:
    """One run.

    setting      what was asked for, as text: "1e-6", "reltol 1e-4, tmax 1u"
    tolerance    the same as a number, None where it is not one
    error        max over signals and common times of |difference|/range; None when the run did not get through
    seconds      CPU of the solve; of a run that stopped, what it had used
    evaluations  of the equations; None where the tool does not tell
    steps        accepted; None where the tool does not tell
    reason       why there is no error, "" for a run that got through
    """

    __slots__ = ("error", "evaluations", "reason", "seconds", "setting", "steps", "tolerance")

    def __init__(
        self, setting: str, tolerance: float | None, error: float | None, seconds: float,
        evaluations: int | None = None, steps: int | None = None, reason: str = "",
    ) -> None:  # fmt: skip
        self.setting, self.tolerance, self.error = setting, tolerance, error
        self.seconds, self.evaluations, self.steps, self.reason = seconds, evaluations, steps, reason

    @property
    def good(self) -> bool:
        return self.error is not None and isfinite(self.error)

    def as_dict(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in self.__slots__}


class Series:
    """One tool: its name, its group (one of GROUPS) and its points, loosest setting first."""

    __slots__ = ("group", "name", "note", "points")

    def __init__(self, name: str, group: str, points: Iterable[Point] = (), note: str = "") -> None:
        self.name, self.group, self.points, self.note = name, group, list(points), note

    @property
    def label(self) -> str:
        """As tables and legends call it: scipy's RK45 is not the engine's rk45."""
        return f"scipy {self.name}" if self.group == "scipy" else self.name

    @property
    def good(self) -> list[Point]:
        return [p for p in self.points if p.good]

    @property
    def failures(self) -> list[Point]:
        return [p for p in self.points if not p.good]

    def at(self, error: float, floor: float = 0.0) -> float | None:
        """CPU seconds at an error, (1). `floor`: errors below it are not resolved and count as it."""
        return time_at(front((max(p.error or 0.0, floor), p.seconds) for p in self.good), error)

    def as_dict(self) -> dict[str, Any]:
        points = [p.as_dict() for p in self.points]
        return {"name": self.name, "group": self.group, "note": self.note, "points": points}


def front(pairs: Iterable[tuple[float, float]]) -> list[tuple[float, float]]:
    """(error, seconds) that nothing beats in both, by falling error and rising time."""
    out: list[tuple[float, float]] = []
    best = inf
    for error, seconds in sorted(((max(e, SMALLEST), s) for e, s in pairs), key=lambda p: (p[1], p[0])):
        if error < best:
            best = error
            out.append((error, seconds))
    return out


def time_at(line: Sequence[tuple[float, float]], error: float) -> float | None:
    """(1) on a front; None when it does not reach the error."""
    if not line or line[-1][0] > error:
        return None
    if line[0][0] <= error:
        return line[0][1]
    for (e0, s0), (e1, s1) in pairwise(line):
        if e1 <= error:
            share = log(error / e0) / log(e1 / e0)
            return exp(log(s0) + share * log(s1 / s0)) if s0 > 0 and s1 > 0 else s0 + share * (s1 - s0)
    return None


def near(point: Point, worth: Sequence[tuple[float, float]], slack: float = 0.0, within: float = 1.5) -> bool:
    """Is the point on that front, or so near that a better figure for its time may put it there?"""
    least = time_at(worth, point.error or 0.0)
    return least is None or point.seconds < within * least + slack


def best(series: Iterable[Series], error: float, floor: float = 0.0) -> tuple[Series, float] | None:
    """The cheapest of several tools at an error, and its CPU seconds."""
    found = [(s, time) for s in series if (time := s.at(error, floor)) is not None]
    return min(found, key=lambda pair: pair[1]) if found else None


class Chart:
    """Everything measured on one deck.

    name, title   of the deck; signals: the columns compared; times: number of common times
    reference     how the reference was computed; `confirmed`: how near a second method came to it, in the units of error;
                  `distance`: the same, or of its own next run where the second method is the coarser one by far
    series        the tools; notes: what was left out and why
    """

    __slots__ = (
        "confirmed", "distance", "group", "name", "notes", "reference", "series", "signals", "times", "title",
    )  # fmt: skip

    def __init__(self, name: str, title: str, signals: Sequence[str], times: int) -> None:
        self.name, self.title, self.signals, self.times = name, title, list(signals), times
        self.reference, self.distance, self.confirmed = "", 0.0, 0.0
        self.series: list[Series] = []
        self.notes: list[str] = []
        self.group = ""

    @property
    def own(self) -> list[Series]:
        return [s for s in self.series if s.group == "emsim"]

    def find(self, name: str) -> Series | None:
        return next((s for s in self.series if s.name == name), None)

    @property
    def smallest(self) -> float:
        """The smallest error charted."""
        return min((p.error for s in self.series for p in s.good if p.error is not None), default=inf)

    @property
    def unresolved(self) -> int:
        """Points whose error is below what the reference is known to."""
        return sum(p.error is not None and p.error < self.distance for s in self.series for p in s.good)

    def as_dict(self) -> dict[str, Any]:
        plain = ("name", "title", "group", "signals", "times", "reference", "distance", "confirmed", "notes")
        return {**{k: getattr(self, k) for k in plain}, "series": [s.as_dict() for s in self.series]}

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Chart:
        """The inverse of as_dict, for figures drawn again from a file."""
        chart = cls(data["name"], data["title"], data["signals"], data["times"])
        chart.reference, chart.distance, chart.confirmed = (
            data["reference"],
            data["distance"],
            data["confirmed"],
        )
        chart.notes, chart.group = data["notes"], data["group"]
        for s in data["series"]:
            points = [Point(**point) for point in s["points"]]
            chart.series.append(Series(s["name"], s["group"], points, s["note"]))
        return chart


def short(seconds: float) -> str:
    """0.034 ms, 1.2 ms, 340 ms, 12 s."""
    if seconds >= 9.995:
        return f"{seconds:.3g} s"
    return f"{1e3 * seconds:.2g} ms" if seconds < 0.0995 else f"{1e3 * seconds:.0f} ms"


def exponent(tolerance: float) -> str:
    """0.001 as 1e-3, 2.5e-10 as it is."""
    mantissa, _, power = f"{tolerance:.2e}".partition("e")
    return f"{mantissa.rstrip('0').rstrip('.')}e{int(power)}"

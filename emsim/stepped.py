"""The runs of a deck with `.step` as one result: tables one below the other, with the stepped quantities as columns.

A table over an axis keeps it, and its `steps` hold still in each course; of one without (.op, .tf) the first stepped quantity
is the axis. Columns are joined when somebody asks for them; the single tables stay as `courses`.
"""

from __future__ import annotations

from itertools import pairwise

from .analyses import Axis
from .result import Result
from .table import Table

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    from .diagnostics import Diagnostic
    from .elaborate.steps import Step


class Stacked:
    """A column store: those of several tables one below the other, behind columns of their own that each has one value of."""

    corners = b""

    def __init__(
        self,
        tables: Sequence[Table],
        places: Sequence[Sequence[int]],
        own: Sequence[Sequence[float]],
        at: int,
    ) -> None:
        self._tables, self._places, self._own, self._at = tables, places, own, at
        self.rows = sum(map(len, tables))
        self.columns = len(places[0]) + len(own)
        # commands may have put real numbers in place of complex ones in one of them
        first = [
            any(t.is_complex(own[k]) for t, own in zip(tables, places, strict=True))
            for k in range(len(places[0]))
        ]
        self.complex = [*first[:at], *(False for _ in own), *first[at:]]
        self.steady: list[bool] = []

    def column(self, i: int, /) -> bytes:
        from array import array

        k = i - self._at
        if 0 <= k < len(self._own):
            return b"".join(
                (array("d", [v]) * len(t)).tobytes() for v, t in zip(self._own[k], self._tables, strict=True)
            )
        where = i if k < 0 else i - len(self._own)
        return b"".join(
            _as_complex(t.waves.column(own[where]))
            if self.complex[i] and not t.is_complex(own[where])
            else t.waves.column(own[where])
            for t, own in zip(self._tables, self._places, strict=True)
        )


def _as_complex(real: bytes) -> bytes:
    from array import array

    pairs = array("d", bytes(2 * len(real)))
    pairs[::2] = array("d", real)
    return pairs.tobytes()


def join(results: Sequence[Result], steps: Sequence[Step], points: Sequence[Sequence[float]]) -> Result:
    """One result of those of all steps; `points`: the values of the steps in each."""
    first = results[0]
    plots = []
    for k in range(len(first.plots)):
        own = [(r.plots[k], p) for r, p in zip(results, points, strict=True) if k < len(r.plots)]
        plots.append(joined([t for t, _ in own], steps, [p for _, p in own]))
    found = []
    for k, r in enumerate(results):
        for one in r.measured:
            one.step = k
            found.append(one)
    spectra = []
    for k, r in enumerate(results):
        for spectrum in r.spectra:
            spectrum.step = k
            spectra.append(spectrum)
    told = [dict(zip((s.column for s in steps), p, strict=True)) for p in points]
    diagnostics = _told_once(results, told)
    return Result(
        first.title, plots, diagnostics, first.prints, first.deck, found, steps=told, spectra=spectra
    )


def _told_once(results: Sequence[Result], steps: Sequence[dict[str, float]]) -> list[Diagnostic]:
    """What is said in several steps stands once; of measurements that are not found with the step, and in how many."""
    from .diagnostics import Diagnostic

    found: dict[tuple[Any, ...], Diagnostic] = {}
    missing: dict[tuple[Any, ...], int] = {}
    for r, step in zip(results, steps, strict=True):
        for d in r.diagnostics:
            if d.code != "E430":
                found.setdefault((d.code, d.message, d.span), d)
                continue
            key = (d.code, d.span)
            if key not in found:
                said = f"at {', '.join(f'{n} = {v:g}' for n, v in step.items())}: {d.message}"
                found[key] = Diagnostic(d.severity, d.code, said, d.span, d.hint, d.labels, d.fixes)
            missing[key] = missing.get(key, 0) + 1
    for key, count in missing.items():
        if count > 1:
            found[key].message += f" (and in {count - 1} further step{'s' * (count > 2)})"
    return list(found.values())


def joined(tables: list[Table], steps: Sequence[Step], points: Sequence[Sequence[float]]) -> Table:
    """One table of those of all steps; `points`: the values of the steps in each."""
    like = tables[0]
    # what an .if leaves out in some of the runs is a column of none
    names = [name for name in like.names if all(t.has_column(name) for t in tables)]
    places = [[t.index(name) for name in names] for t in tables]
    units = [like.units[like.index(name)] for name in names]
    columns, at = [s.column for s in steps], 1 if like.axis else 0
    store = Stacked(tables, places, list(zip(*points, strict=True)), at)
    own = [s.unit for s in steps]
    axis = like.axis or Axis(columns[0], own[0], _by_ratios(steps[0].values))
    inner = columns if like.axis else columns[1:]
    stats = dict(tables[-1].stats)
    for key in stats:
        values = [t.stats.get(key) for t in tables]
        if all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in values):
            stats[key] = sum(v for v in values if isinstance(v, (int, float)))
    status = next((t.status for t in tables if t.status != "ok"), "ok")
    return Table(
        like.kind, [*names[:at], *columns, *names[at:]], [*units[:at], *own, *units[at:]], store, title=like.title, axis=axis,
        steps=[*inner, *like.steps], grid=like.grid, stats=stats, status=status, plotname=like.plotname,
        courses=tables if like.axis else (),
    )  # fmt: skip


def _by_ratios(values: Sequence[float]) -> bool:
    """Do the values lie by equal ratios?"""
    if len(values) < 3 or min(values) <= 0:
        return False
    ratios = [b / a for a, b in pairwise(values)]
    return max(ratios) - min(ratios) < 1e-6 * abs(ratios[0]) and abs(ratios[0] - 1) > 1e-6


def stopped(
    trouble: Sequence[Diagnostic], steps: Sequence[Step], points: Sequence[Sequence[float]]
) -> list[Diagnostic]:
    """What ended a run, with the step in which it did."""
    from .diagnostics import Diagnostic

    where = ", ".join(f"{s.column} = {v:g}" for s, v in zip(steps, points[-1], strict=True))
    said = [Diagnostic(d.severity, d.code, d.message, d.span, d.hint, d.labels, d.fixes) for d in trouble]
    for d in said:
        if d.severity == "error":
            d.message = f"at {where}: {d.message}"
    return said

"""Analyses: one dot card each, one file each. A file offers

    read(analysis, sink) -> settings       the card's arguments, checked; errors go to the sink
    run(assembly, settings, ...) -> Run    one computation

`plan` reads the deck's analyses in order; `ANALYSES` is the one list of what there is.
"""

from __future__ import annotations

from math import isfinite

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    from .._engine import Waveforms
    from ..assemble import Assembly
    from ..deck import Analysis, FlatDeck
    from ..diagnostics import Diagnostic

ANALYSES = ("op", "tran")


class Part:
    """`columns` of the engine's columns, from `first` on: without the time where there is no axis, without the
    channels of a drawing where there is one."""

    __slots__ = ("columns", "first", "rows", "waves")

    def __init__(self, waves: Waveforms, first: int, columns: int) -> None:
        self.waves, self.rows, self.first, self.columns = waves, waves.rows, first, columns

    @property
    def corners(self) -> bytes:
        return self.waves.corners

    @property
    def steady(self) -> list[bool]:
        return self.waves.steady[self.first : self.first + self.columns]

    def column(self, i: int, /) -> bytes:
        return self.waves.column(self.first + i)

    def write_raw(self, path: str, head: Any, ascii: bool = False) -> None:
        self.waves.write_raw(path, head, ascii, self.first)

    def finish_stream(self) -> tuple[int, str | None] | None:
        return self.waves.finish_stream()


class Run:
    """What one analysis computed.

    kind, names, units   of all columns; with `axis` the first is the independent one
    waves                the engine's column store
    grid                 (tstep, tstop, tstart) of a transient [s]
    store                the same without the engine's time column where there is no axis
    uic                  it started from initial values, without an operating point
    channels             columns beyond the named ones, which move a drawing
    trouble              diagnostics of a run that did not reach its end
    """

    __slots__ = ("axis", "channels", "grid", "kind", "names", "store", "trouble", "uic", "units", "waves")

    def __init__(
        self, kind: str, names: list[str], units: list[str], waves: Waveforms, axis: bool,
        grid: tuple[float, float, float] | None = None, trouble: list[Diagnostic] | None = None,
        uic: bool = False,
    ) -> None:  # fmt: skip
        self.kind, self.names, self.units, self.waves = kind, names, units, waves
        self.axis, self.grid, self.trouble = axis, grid, trouble or []
        self.uic = uic
        first = 0 if axis else 1
        whole = len(names) == waves.columns
        self.store = waves if whole else Part(waves, first, len(names))
        self.channels = Part(waves, first + len(names), waves.columns - len(names) - first)

    def gaps(self) -> list[tuple[str, float, float]]:
        """(name, value, time) of columns without a finite value at the first or last point: no such value is a result. The
        engine looks at the unknowns alone, and an expression of finite ones may have none."""
        waves, found = self.waves, []
        for k, name in enumerate(self.names[1:] if self.axis else self.names):
            for row in {0, waves.rows - 1} if waves.rows else ():
                value = waves.value(row, 1 + k)
                if not isfinite(value):
                    found.append((name, value, waves.value(row, 0)))
                    break
        return found


def plan(flat: FlatDeck, tmax: float | None = None) -> list[tuple[Analysis, Any]]:
    """(card, settings) of every analysis that can run, in deck order; one note for each kind that cannot."""
    planned: list[tuple[Analysis, Any]] = []
    missing: dict[str, Any] = {}
    for analysis in flat.analyses:
        if analysis.kind == "tran":
            from .tran import read

            settings: Any = read(analysis, flat.sink, tmax)
            if settings is None:
                continue
        elif analysis.kind == "op":
            settings = "static" in analysis.flags or "static" in analysis.args
        else:
            missing.setdefault(analysis.kind, analysis.span)
            continue
        planned.append((analysis, settings))
    for kind, span in missing.items():
        flat.sink.note("N282", f".{kind} is not supported yet and is left out", span)
    return planned


def runner(kind: str) -> Callable[..., Run]:
    """The `run` of an analysis kind."""
    if kind == "tran":
        from .tran import run
    else:
        from .op import run  # type: ignore[assignment]
    return run


def columns(assembly: Assembly, kind: str) -> tuple[list[str], list[str], list[Any]]:
    """Names, units and expressions of the dependent columns."""
    outputs = assembly.outputs[kind]
    return [o.name for o in outputs], [o.unit for o in outputs], [o.expr for o in outputs]

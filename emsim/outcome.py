"""What a deck's run gave: its tables, its diagnostics, what was measured. Data alone; result.py shows and saves it."""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from typing import Any

    import numpy as np
    import pandas as pd
    import xarray as xr

    from .diagnostics import Diagnostic
    from .measures import Measured
    from .measures.fourier import Spectrum
    from .table import Table


class Outcome:
    """

    plots        all tables in the order in which they ran; `table("op")` finds one by its kind
    diagnostics  warnings and notes, in deck order, and what ended a run before its time
    prints       what .print asked for: (kind, column names)
    deck         the text that was run, "" for a result that was read from a file
    measured     what .meas found, in order: name, value, unit, at, from, to ... (`measures` has the values by name)
    spectra      harmonics that .four asked for, one a signal
    steps        values of what .step and .temp change, by name, one dict a run; empty without. `Table.courses()` are the runs
    output       what a .control section printed, where nobody listened; files: what it wrote; code: that of its `quit`
    Everything a Table offers is offered here too, of the main table: the last transient, else the last.
    """

    def __init__(
        self,
        title: str,
        plots: Sequence[Table],
        diagnostics: Sequence[Diagnostic] = (),
        prints: Sequence[tuple[str, list[str]]] = (),
        deck: str = "",
        measured: Sequence[Measured] = (),
        output: str = "",
        files: Sequence[str] = (),
        code: int | None = None,
        steps: Sequence[dict[str, float]] = (),
        spectra: Sequence[Spectrum] = (),
    ) -> None:
        self.output, self.files, self.code = output, list(files), code
        self.title, self.plots, self.deck = title, list(plots), deck
        self.diagnostics, self.prints, self.measured = list(diagnostics), list(prints), list(measured)
        self.steps, self.spectra = list(steps), list(spectra)

    @property
    def measures(self) -> dict[str, Any]:
        """name -> value of what .meas found, nan where it found nothing; a list, one a step, where the run has steps."""
        found: dict[str, list[float]] = {}
        for one in self.measured:
            found.setdefault(one.name, []).append(one.value)
        return {name: values if len(values) > 1 else values[0] for name, values in found.items()}

    @property
    def main(self) -> Table:
        """The last table over time, or else the last one over anything, or else the last. ValueError when nothing ran."""
        if not self.plots:
            raise ValueError("no analysis ran, so there are no columns")
        last = self.plots[::-1]
        over_time = (p for p in last if p.axis is not None and p.axis.name == "time")
        return next(over_time, None) or next((p for p in last if p.axis is not None), self.plots[-1])

    def table(self, kind: str) -> Table:
        """The last table of a kind ("op", "tran"); KeyError if that analysis did not run."""
        for table in reversed(self.plots):
            if table.kind == kind:
                return table
        raise KeyError(f"no {kind!r} ran; there is {', '.join(p.kind for p in self.plots) or 'nothing'}")

    @property
    def op(self) -> Table:
        """The last operating point; KeyError where there is none. So of the others."""
        return self.table("op")

    @property
    def dc(self) -> Table:
        return self.table("dc")

    @property
    def tran(self) -> Table:
        return self.table("tran")

    @property
    def ac(self) -> Table:
        return self.table("ac")

    @property
    def noise(self) -> Table:
        return self.table("noise")

    @property
    def tf(self) -> Table:
        return self.table("tf")

    @property
    def status(self) -> str:
        """ "ok", or the first trouble among the tables: "failed", "interrupted"."""
        return next((p.status for p in self.plots if p.status != "ok"), "ok")

    def __getitem__(self, name: str) -> np.ndarray:
        return self.main[name]

    def __contains__(self, name: object) -> bool:
        return bool(self.plots) and name in self.main

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __len__(self) -> int:
        return len(self.main)

    @property
    def names(self) -> list[str]:
        return self.main.names

    @property
    def signals(self) -> list[str]:
        return self.main.signals

    @property
    def units(self) -> dict[str, str]:
        """name -> unit of the main table."""
        return dict(zip(self.main.names, self.main.units, strict=True))

    @property
    def time(self) -> np.ndarray:
        return self.main.time

    @property
    def energy(self) -> Any:
        """The energy ledger of the main table, or None where none was kept."""
        return self.main.energy

    @property
    def analysis(self) -> str:
        return self.main.kind

    @property
    def stats(self) -> dict[str, Any]:
        return self.main.stats

    def unit(self, name: str) -> str:
        return self.main.unit(name)

    def at(self, name: str, t: float | Sequence[float] | np.ndarray) -> Any:
        return self.main.at(name, t)

    def fft(
        self, *signals: str, window: str = "hann", points: int | None = None, start: float | None = None,
        stop: float | None = None,
    ) -> Table:  # fmt: skip
        """Spectra of signals of the main table, see Table.fft."""
        return self.main.fft(*signals, window=window, points=points, start=start, stop=stop)

    def to_pandas(self) -> pd.DataFrame:
        return self.main.to_pandas()

    def to_xarray(self) -> xr.Dataset:
        return self.main.to_xarray()

    def __repr__(self) -> str:
        tables = map(repr, self.plots) if self.plots else ["(nothing ran)"]
        return "\n".join([self.title, *tables, *map(repr, self.measured)])

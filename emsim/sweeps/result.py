"""The labelled result of a sweep: measures and signals over what varied; statistics, yield, files."""

from __future__ import annotations

import math

from .samples import Scheme

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from typing import Any

    import numpy as np
    import pandas as pd
    import xarray as xr

    from ..draws import Draws
    from .axes import Axis
    from .runs import Outcome, Point, Task

OPERATORS = ("<=", ">=", "<", ">")


class Goal:
    """What a measure is to be: `vmax<1.2`, `gain>=10`. Raises ValueError with a sentence."""

    def __init__(self, text: str) -> None:
        from ..units import spice_number

        self.text = "".join(text.split()).lower()
        self.operator = next((op for op in OPERATORS if op in self.text), "")
        self.measure, _, given = self.text.partition(self.operator) if self.operator else ("", "", "")
        bound = spice_number(given)
        if not self.measure or bound is None:
            raise ValueError(f"{text}: a goal is measure<number, as in vmax<1.2")
        self.bound = float(bound)

    def met(self, value: float) -> bool:
        if "<" in self.operator:
            return value < self.bound or (value == self.bound and self.operator == "<=")
        return value > self.bound or (value == self.bound and self.operator == ">=")


class Swept:
    """Of every run, by its number: `values` of what varied, its measures, its signals, or why it failed.

    axes      what varied, the last one fastest; then the runs of the scheme at each point
    labels    the deck's random values, in words; random: their names
    points    all runs, done or not
    failed    number -> reason
    """

    def __init__(
        self, task: Task, axes: list[Axis], scheme: Scheme, draws: Draws, points: list[Point]
    ) -> None:
        from .drawn import names

        self.task, self.axes, self.scheme, self.points, self.size = task, axes, scheme, points, len(points)
        self.labels = draws.labels()
        self.random = names(draws, ("run", "seed", "which", "error", *(axis.name for axis in axes)))
        self.outcomes: dict[int, Outcome] = {}
        self.resumed, self.title = 0, ""

    def __len__(self) -> int:
        return self.size

    @property
    def complete(self) -> bool:
        return len(self.outcomes) == self.size

    @property
    def failed(self) -> dict[int, str]:
        return {k: o.error for k, o in sorted(self.outcomes.items()) if o.error}

    @property
    def warnings(self) -> dict[str, list[int]]:
        """What runs said, and the numbers of those that did, by code and the first one's words."""
        found: dict[str, tuple[str, list[int]]] = {}
        for k, outcome in sorted(self.outcomes.items()):
            for said in outcome.warnings:
                found.setdefault(said.partition(":")[0], (said, []))[1].append(k)
        return dict(found.values())

    @property
    def names(self) -> list[str]:
        """Of the measures, in the order of the deck."""
        return list(dict.fromkeys(name for _, o in sorted(self.outcomes.items()) for name in o.measures))

    def values(self, number: int) -> dict[str, float]:
        """What varied, in a run."""
        number //= max(self.per_point, 1)
        found: dict[str, float] = {}
        for axis in reversed(self.axes):
            number, k = divmod(number, len(axis.values))
            found[axis.name] = axis.values[k]
        return {axis.name: found[axis.name] for axis in self.axes}

    def which(self, number: int) -> str:
        """The name of a run in its scheme: `r1+ r2-` of a corner."""
        places = self.points[number].places
        return "" if places is None else self.scheme.tag(places, self.random)

    def drawn(self, name: str) -> np.ndarray:
        """A random value in the shape of the sweep; nan where a run did not draw it."""
        if name not in self.random:
            raise KeyError(f"no random value {name!r}; there is {', '.join(self.random) or 'none'}")
        k = self.random.index(name)
        return self._shaped({n: o.drawn[k] for n, o in self.outcomes.items() if k < len(o.drawn)})

    def _shaped(self, values: dict[int, float]) -> np.ndarray:
        """Numbers of runs in the shape of the sweep, nan where there is none."""
        import numpy as np

        flat = np.full(self.size, np.nan)
        flat[list(values)] = list(values.values())
        return flat.reshape(self.shape)

    @property
    def per_point(self) -> int:
        """Runs at each point of the grid."""
        return self.size // math.prod(len(axis.values) for axis in self.axes)

    @property
    def shape(self) -> tuple[int, ...]:
        per_point = self.per_point
        return (
            *(len(axis.values) for axis in self.axes),
            *((per_point,) if per_point > 1 or not self.axes else ()),
        )

    def measure(self, name: str) -> np.ndarray:
        """A measure in the shape of the sweep; nan where a run failed or found none."""
        if name not in self.names:
            raise KeyError(f"no measure {name!r}; there is {', '.join(self.names) or 'none'}")
        return self._shaped({k: o.measures.get(name, math.nan) for k, o in self.outcomes.items()})

    def signal(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """(its axis, the signal over sweep and axis): runs of different length end in nan."""
        import numpy as np

        axis = max((self._axis(o, name)[1] for o in self.outcomes.values()), key=len)
        found = np.full((self.size, len(axis)), np.nan)
        for k, outcome in self.outcomes.items():
            values = outcome.signals.get(name.lower(), [])
            found[k, : len(values)] = values
        return np.array(axis), found.reshape(*self.shape, -1)

    def over(self, name: str) -> str:
        """What the axis of a signal is; "" of a point."""
        return next((self._axis(o, name)[0] for o in self.good()), "")

    def _axis(self, outcome: Outcome, name: str) -> tuple[str, Sequence[float]]:
        from .runs import analysis_of

        kind = analysis_of(name)[0]
        over, axis = outcome.axes.get(kind, ("", [])) if kind else (outcome.over, outcome.axis)
        return over, axis

    # ---- statistics ----

    def good(self) -> list[Outcome]:
        return [o for _, o in sorted(self.outcomes.items()) if not o.error]

    def statistics(self, name: str) -> dict[str, float]:
        """Of a measure over all runs that have it: runs, mean, deviation (of the sample), least, greatest."""
        found = [v for o in self.good() if math.isfinite(v := o.measures.get(name, math.nan))]
        if not found:
            return {"runs": 0}
        mean = math.fsum(found) / len(found)
        spread = math.fsum((v - mean) ** 2 for v in found) / (len(found) - 1) if len(found) > 1 else 0.0
        return {
            "runs": len(found),
            "mean": mean,
            "deviation": math.sqrt(spread),
            "least": min(found),
            "greatest": max(found),
        }

    def yielded(self, goals: Sequence[Goal]) -> tuple[int, int, float, float]:
        """(runs that meet all goals, runs, 95 % bounds of the share): failed runs meet none. The bounds are Wilson's (1927)."""
        for goal in goals:
            if goal.measure not in self.names:
                raise ValueError(
                    f"goal {goal.text}: no measure {goal.measure}; there is {', '.join(self.names) or 'none'}"
                )
        n = len(self.outcomes)
        met = sum(all(g.met(o.measures.get(g.measure, math.nan)) for g in goals) for o in self.good())
        if not n:
            return 0, 0, 0.0, 1.0
        z, share = 1.959964, met / n
        middle, width = share + z * z / (2 * n), z * math.sqrt(share * (1 - share) / n + z * z / (4 * n * n))
        return (
            met,
            n,
            max(0.0, (middle - width) / (1 + z * z / n)),
            min(1.0, (middle + width) / (1 + z * z / n)),
        )

    def influences(self, name: str) -> list[tuple[str, float, float]]:
        """Of a sweep one at a time: (random value, change of the measure at its least, at its greatest), the largest first."""
        if self.scheme.name != "sensitivity" or self.axes:
            raise ValueError(
                "influences are those of a sweep with the scheme sensitivity, without other axes"
            )
        values = [float(v) for v in self.measure(name)]
        low, high = values[1::2], values[2::2]
        found = [
            (label, a - values[0], b - values[0]) for label, a, b in zip(self.labels, low, high, strict=True)
        ]
        return sorted(found, key=lambda row: -max(abs(row[1]), abs(row[2])))

    def worst(self, name: str) -> tuple[float, float]:
        """Of a sweep one at a time: the measure with every random value at that end at which it makes the measure less, and
        at which it makes it greater. Two runs more; where each moves it one way only, these are its bounds. nan where the run
        fails or finds none."""
        from .runs import Runner

        self.influences(name)  # raises where the sweep is another one
        runner = Runner(self.task)
        least, greatest = (runner.run(p).measures.get(name, math.nan) for p in self.extremes(name))
        return least, greatest

    def shares(self, name: str) -> tuple[list[tuple[str, float, float]], str]:
        """(random value, share of the measure's variance by itself, with others), the largest first, and in what sense; none
        where the runs do not tell."""
        try:
            if self.scheme.name == "indices":
                return self.indices(name), "by itself, and with others"
            found, explained = self.contributions(name)
        except ValueError:
            return [], ""
        return [(value, share, share) for value, share in found], f"{100 * explained:.3g} % goes along lines"

    def contributions(self, name: str) -> tuple[list[tuple[str, float]], float]:
        """Of a random sweep without other axes: (random value, share of the measure's variance that goes with it along a line),
        the largest first, and the share that all lines explain together. Squares of standardised regression coefficients
        (Saltelli and others, Global Sensitivity Analysis, 2008, 1.2.5). Raises ValueError for other sweeps and too few runs."""
        import numpy as np

        if self.axes or not self.scheme.is_random:
            raise ValueError("contributions are those of a random sweep without other axes")
        x = np.array([self.drawn(key).ravel() for key in self.random])
        y = self.measure(name).ravel()
        known = np.isfinite(y) & np.isfinite(x).all(axis=0)
        x, y = x[:, known], y[known]
        if y.size < len(self.random) + 2:
            raise ValueError(f"{y.size} runs are too few to tell {len(self.random)} random values apart")
        x, y = x - x.mean(axis=1, keepdims=True), y - y.mean()
        slopes = np.linalg.lstsq(x.T, y, rcond=None)[0]
        variance = float(y @ y)
        if not variance:
            raise ValueError(f"{name} is the same in every run")
        shares = slopes**2 * (x**2).sum(axis=1) / variance
        explained = 1.0 - float(((y - slopes @ x) ** 2).sum()) / variance
        found = zip(self.random, shares.tolist(), strict=True)
        return sorted(found, key=lambda row: -row[1]), explained

    def indices(self, name: str) -> list[tuple[str, float, float]]:
        """Of a sweep with the scheme indices: (random value, its share of the variance by itself, its share with all that it acts
        together with), the largest first: Sobol's indices of first order and in total, by scipy. Raises ValueError for other
        sweeps, and where a run has no such measure."""
        import numpy as np
        from scipy.stats import sobol_indices

        if self.scheme.name != "indices" or self.axes:
            raise ValueError("indices are those of a sweep with the scheme indices, without other axes")
        values = self.measure(name).reshape(len(self.random) + 2, 1, -1)
        if not np.isfinite(values).all():
            raise ValueError(f"{name} was not found in every run: the samples are balanced by all of them")
        if not np.ptp(values):
            raise ValueError(f"{name} is the same in every run")
        parts: Any = {"f_A": values[0], "f_B": values[1], "f_AB": values[2:]}
        found = sobol_indices(func=parts, n=values.shape[-1])
        first, total = found.first_order.ravel().tolist(), found.total_order.ravel().tolist()
        return sorted(zip(self.random, first, total, strict=True), key=lambda row: -row[2])

    def extremes(self, name: str) -> tuple[Point, Point]:
        """The runs with the least and the greatest measure; of a sweep one at a time those of `worst`. ValueError where there are
        none."""
        from .runs import Point

        if self.scheme.name == "sensitivity" and not self.axes:
            values = self.measure(name).ravel()
            least = tuple(float(a > b) for a, b in zip(values[1::2], values[2::2], strict=True))
            return Point(0, (), least), Point(0, (), tuple(1.0 - p for p in least))
        found = {k: v for k, o in self.outcomes.items() if math.isfinite(v := o.measures.get(name, math.nan))}
        if not found:
            raise ValueError(f"{name} was found in no run; there is {', '.join(self.names) or 'none'}")
        return self.points[min(found, key=found.__getitem__)], self.points[max(found, key=found.__getitem__)]

    def repeat(self, point: Point) -> str:
        """A deck that repeats a run: numbers in place of what it drew, its other values as .step cards of one value. Raises
        DeckError where the text cannot say them."""
        from ..diagnostics import deck_error
        from .drawn import repeated
        from .runs import Runner

        runner = Runner(self.task)
        if words := [key for key in self.task.fixed if key not in runner.fixed]:
            deck_error("E348", f"`{words[0]}` was given as words, which no card of the deck's text can say")
        varied = dict(zip(self.task.names, point.values, strict=True))
        flat = runner.flat(point, runner.drawing(point))
        options = {**self.task.options, "seed": flat.draws.seed}
        return repeated(runner.deck, flat.draws, {**runner.fixed, **varied}, options)

    # ---- tables and files ----

    def rows(self) -> Iterator[dict[str, Any]]:
        """Of every run that is done: its number, what varied, the seed and its name where its scheme has them, what it drew (as
        `drawn:r1` where a measure has the name), its measures, its error."""
        names = self.names
        random = {f"drawn:{n}" if n in names else n: k for k, n in enumerate(self.random)}
        seeded = {"seed": self.scheme.seed} if self.scheme.is_random else {}
        named = any(self.which(k) for k in self.outcomes)
        for k, o in sorted(self.outcomes.items()):
            drawn = {n: o.drawn[at] if at < len(o.drawn) else math.nan for n, at in random.items()}
            which = {"which": self.which(k)} if named else {}
            found = {n: o.measures.get(n, math.nan) for n in names}
            yield {"run": k, **self.values(k), **seeded, **which, **drawn, **found, "error": o.error}

    def to_pandas(self) -> pd.DataFrame:
        """A row a run: what varied, what was drawn, measures, error."""
        import pandas as pd

        return pd.DataFrame(self.rows()).set_index("run")

    def to_xarray(self) -> xr.Dataset:
        """Measures over what varied (and `run` where the scheme has several at a point), signals over these and their axis."""
        import numpy as np
        import xarray as xr

        from .runs import analysis_of

        dims = [axis.name for axis in self.axes]
        if len(self.shape) > len(dims):
            dims.append("run")
        data: dict[str, Any] = {f"drawn:{name}": (dims, self.drawn(name)) for name in self.random}
        data.update({name: (dims, self.measure(name)) for name in self.names})
        coords: dict[str, Any] = {axis.name: list(axis.values) for axis in self.axes}
        if self.task.signals and self.outcomes:
            kept = next((list(o.signals) for o in self.good()), [])
            for name in kept:
                (places, values), over = self.signal(name), self.over(name)
                if not over:  # of a point there is one value a run
                    data[name] = (dims, values[..., 0])
                    continue
                if over in coords and not np.array_equal(coords[over], places):  # of another analysis
                    over = f"{analysis_of(name)[0]}:{over}"
                coords[over] = places
                data[name] = ([*dims, over], values)
        error = np.full(self.size, "", dtype=object)
        for k, said in self.failed.items():
            error[k] = said
        data["error"] = (dims, error.reshape(self.shape).astype(str))
        return xr.Dataset(
            data, coords, {"scheme": self.scheme.label(), "random_values": "; ".join(self.labels)}
        )

    def save(self, path: str) -> None:
        """Writes .csv or .parquet (a row a run), .nc or .zarr (measures and signals). ValueError for another ending, OSError."""
        if path.endswith(".csv"):
            self._csv(path)
        elif path.endswith(".parquet"):
            self.to_pandas().to_parquet(path)
        elif path.endswith(".nc"):
            self.to_xarray().to_netcdf(path, engine="h5netcdf")
        elif path.endswith(".zarr"):
            self.to_xarray().to_zarr(path, mode="w")
        else:
            raise ValueError(f"{path}: a sweep is written as .csv, .parquet, .nc or .zarr")

    def _csv(self, path: str) -> None:
        import csv

        from ..outputs.beside import replacing

        with replacing(path) as written, open(written, "w", newline="", encoding="utf-8") as file:
            table = csv.writer(file, lineterminator="\n")
            for k, row in enumerate(self.rows()):
                if not k:
                    table.writerow(row)
                table.writerow(v if isinstance(v, str) else repr(v) for v in row.values())

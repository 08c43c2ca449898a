"""A sweep: its plan, its runs, its result."""

from __future__ import annotations

import os

from ..pipeline import path_or_text
from .axes import Axis, parse
from .pool import keep, outcomes
from .result import Swept
from .runs import Point, Runner, Task
from .samples import SCHEMES, Nominal, Scheme, grid

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence
    from typing import Any

    from ..source import Source

    Progress = Callable[[int, int], object]

MOST_RUNS = 10_000_000


def sweep(
    source: Source,
    vary: Mapping[str, Iterable[float] | float | str] | Sequence[str] = (),
    scheme: str = "nominal",
    runs: int = 1,
    seed: int = 1,
    signals: str | Sequence[str] = (),
    options: Mapping[str, Any] | None = None,
    jobs: int | None = 1,
    cluster: str | None = None,
    journal: str | None = None,
    fresh: bool = False,
    progress: Progress | None = None,
) -> Swept:
    """Runs a deck many times.

    source    a path, the text itself, or a PySpice Circuit
    vary      name -> values, or texts as `-D` takes them ("r=1k..10k:20"): parameters of the deck (.param), or elements
              R, C, L, V, I. Several make a grid
    scheme    what the deck's random values do at each point of the grid: nominal, mc, lhs, sobol, corners, sensitivity, indices
    runs      of mc, lhs, sobol, indices; seed: theirs
    signals   columns and expressions to keep, on the print grid, "ac:vdb(b)" of an analysis by name; measures are kept anyhow
    jobs      processes; None: as many as there are cores. Scripts need `if __name__ == "__main__":` then
    cluster   address of a Dask scheduler, in place of jobs
    journal   a file that keeps what has been computed: the same sweep goes on from there
    progress  called with (runs done, all runs); a true return value ends the sweep, whose result then is incomplete
    Raises DeckError for a deck or a sweep that is wrong, OutsideError; a run that fails is listed in the result.
    """
    axes, fixed = _axes(vary)
    chosen = _scheme(scheme, runs, seed)
    kept = (signals,) if isinstance(signals, str) else tuple(signals)
    names = tuple(axis.name for axis in axes)
    given = {key.lower(): value for key, value in (options or {}).items()}
    task = Task(path_or_text(source), fixed, names, kept, given, seed)
    first = Runner(task)
    draws = first.draws()
    first.check(names)
    points = plan(axes, chosen, len(draws.drawn))
    result = Swept(task, axes, chosen, draws, points)
    result.title = first.deck.title
    found = result.outcomes
    book = None
    if journal is not None:
        from .journal import Journal

        book = Journal(journal, fingerprint(first, axes, chosen), fresh)
        found.update((k, outcome) for k, outcome in book.done.items() if k < len(points))
        result.resumed = len(found)
    keep(task, first)
    left = [point for point in points if point.number not in found]
    cores = jobs or os.cpu_count() or 1
    try:
        for batch in outcomes(task, left, cores, cluster) if left else ():
            found.update((outcome.number, outcome) for outcome in batch)
            if book is not None:
                book.add(batch)
            if progress is not None and progress(len(found), len(points)):
                break
    finally:
        if book is not None:
            book.close(remove=len(found) == len(points))
    return result


def plan(axes: list[Axis], scheme: Scheme, draws: int) -> list[Point]:
    """All runs: the scheme's at each point of the grid. Raises DeckError."""
    from ..diagnostics import deck_error

    size = scheme.count(draws) if draws <= 40 or scheme.name != "corners" else MOST_RUNS + 1
    for axis in axes:
        size *= len(axis.values)
    if scheme.name != "nominal" and not draws:
        deck_error(
            "E347", f"--{scheme.name} has nothing to vary: the deck has no random value",
            hint="agauss(nominal,deviation,3), unif(nominal,share), mc(nominal,share) in place of a number",
        )  # fmt: skip
    try:
        if size > MOST_RUNS:
            raise ValueError(f"{size} runs are more than {MOST_RUNS}")
        places: Sequence[tuple[float, ...] | None] = (
            [None] if scheme.name == "nominal" else scheme.places(draws)
        )
    except ValueError as error:
        deck_error("E348", str(error))
    runs = ((values, place) for values in grid(axes) for place in places)
    return [Point(number, values, place) for number, (values, place) in enumerate(runs)]


def fingerprint(runner: Runner, axes: list[Axis], scheme: Scheme) -> str:
    """Equal where the same runs are asked for: deck with all that it includes, values, scheme, options."""
    from hashlib import sha256

    task = runner.task
    texts = [source.text for source in runner.read({}).sources]
    told = (
        texts,
        task.fixed,
        axes,
        task.signals,
        sorted(task.options.items()),
        scheme.name,
        scheme.runs,
        scheme.seed,
    )
    return sha256(repr(told).encode()).hexdigest()


def _axes(
    vary: Mapping[str, Iterable[float] | float | str] | Sequence[str],
) -> tuple[list[Axis], dict[str, str]]:
    """What has several values, and what has one."""
    from ..diagnostics import deck_error

    axes: list[Axis] = []
    fixed: dict[str, str] = {}
    try:
        if hasattr(vary, "items"):
            for name, values in vary.items():
                if isinstance(values, str):
                    vary_one(f"{name}={values}", axes, fixed)
                elif isinstance(values, (int, float)):
                    fixed[name.lower()] = repr(float(values))
                else:
                    axes.append(Axis(name.lower(), tuple(float(v) for v in values)))
        else:
            for text in (vary,) if isinstance(vary, str) else vary:
                vary_one(text, axes, fixed)
    except ValueError as error:
        deck_error("E348", str(error))
    names = [*(axis.name for axis in axes), *fixed]
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        deck_error("E348", f"`{twice}` is given twice")
    if empty := next((axis.name for axis in axes if not axis.values), None):
        deck_error("E348", f"`{empty}` has no values")
    return axes, fixed


def vary_one(text: str, axes: list[Axis], fixed: dict[str, str]) -> None:
    found = parse(text)
    if isinstance(found, Axis):
        axes.append(found)
    else:
        fixed[found[0]] = found[1]


def _scheme(name: str, runs: int, seed: int) -> Scheme:
    from ..diagnostics import deck_error

    if name not in SCHEMES:
        deck_error("E348", f"there is no scheme `{name}`", hint=", ".join(SCHEMES))
    if runs < 1:
        deck_error("E348", f"{runs} runs: at least one")
    return Nominal() if name == "nominal" else SCHEMES[name](runs, seed)

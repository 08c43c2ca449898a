"""Runs of a search in several processes, each of which reads the deck once; and the search all over the bounds."""

from __future__ import annotations

import math
from contextlib import contextmanager

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from typing import Any

    import numpy as np

    from .quantities import Quantity

_made: dict[str, Any] = {}


def _begin(make: Callable[[Any], Callable[[Any], float]], task: Any) -> None:
    from ..sweeps.pool import belong

    belong()
    _made["function"] = make(task)


def _call(x: Any) -> float:
    return float(_made["function"](x))


@contextmanager
def mapping(
    make: Callable[[Any], Callable[[Any], float]], task: Any, jobs: int
) -> Iterator[Callable[[Any, Iterable[Any]], Iterable[float]]]:
    """A `map` whose function is what `make(task)` gives, made in each of `jobs` processes."""
    if jobs == 1:
        function = make(task)
        yield lambda _, xs: [function(x) for x in xs]
        return
    from concurrent.futures import ProcessPoolExecutor

    from ..sweeps.pool import MEMORY, context, told_lost

    made = ProcessPoolExecutor(jobs, mp_context=context(), initializer=_begin, initargs=(make, task))
    with made as pool, told_lost("of this machine", MEMORY):
        yield lambda _, xs: list(pool.map(_call, list(xs)))


def everywhere(
    asked: list[Quantity],
    make: Callable[[Any], Callable[[Any], float]],
    task: Any,
    seed: int,
    jobs: int,
    heard: Callable[[float], bool],
) -> tuple[np.ndarray, int]:
    """The place within the bounds at which the cost that `make(task)` gives is least, by differential evolution (Storn and Price
    1997), and how many runs that took: the same whatever the number of processes. `heard` gets the least cost so far; a true
    value ends the search. Raises ValueError where there are no bounds."""
    import numpy as np
    import scipy.optimize as optimize

    if lacking := next(
        (q.name for q in asked if not math.isfinite(q.low) or not math.isfinite(q.high)), None
    ):
        raise ValueError(f"a search everywhere needs bounds: {lacking}=low..high")
    low, high = np.array([q.inner(q.low) for q in asked]), np.array([q.inner(q.high) for q in asked])
    evolve: Any = optimize.differential_evolution

    def told(intermediate_result: Any) -> bool:
        return heard(float(intermediate_result.fun))

    with mapping(make, task, jobs) as workers:
        found = evolve(
            _never, list(zip(low, high, strict=True)), rng=np.random.default_rng(seed), workers=workers, updating="deferred",
            polish=False, init="sobol", x0=np.clip([q.inner(q.first) for q in asked], low, high), tol=0.01, maxiter=60,
            popsize=10, callback=told,
        )  # fmt: skip
    return np.asarray(found.x), int(found.nfev)


def _never(x: Any) -> float:
    raise AssertionError("the workers have the function")

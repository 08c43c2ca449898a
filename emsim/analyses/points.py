"""What a run asks of memory: rows that are known before it are counted first, and lists of points made when they are read."""

from __future__ import annotations

import os

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from typing import Any

    from ..assemble import Assembly
    from .base import Analysis

POINT = 200  # bytes of a point of Python's while it is computed: its number, the pair or list that the engine reads, its answer


class Points:
    """`count` numbers, of which the k-th is law(k, *given)."""

    __slots__ = ("count", "given", "law")

    def __init__(self, count: int, law: Callable[..., float], *given: Any) -> None:
        self.count, self.law, self.given = count, law, given

    def __len__(self) -> int:
        return self.count

    def __getitem__(self, k: int) -> float:
        return self.law(range(self.count)[k], *self.given)

    def __iter__(self) -> Iterator[float]:
        return (self.law(k, *self.given) for k in range(self.count))


def evenly(k: int, start: float, length: float, parts: int) -> float:
    return start + k * length / parts


def memory() -> float:
    """Bytes that this process may have: the machine's memory, or the limit of the process or of its group."""

    def machine() -> float:
        return float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))

    def process() -> float:
        from resource import RLIM_INFINITY, RLIMIT_AS, getrlimit

        limit = getrlimit(RLIMIT_AS)[0]
        return float("inf") if limit == RLIM_INFINITY else float(limit)

    def group() -> float:
        with open("/sys/fs/cgroup/memory.max", encoding="ascii") as file:
            return float(file.read())

    found = [float("inf")]
    for limit in (machine, process, group):
        try:
            found.append(limit())
        except (AttributeError, ImportError, ValueError, OSError):  # not told here
            continue
    return min(found)


def check_memory(assembly: Assembly, analysis: Analysis) -> None:
    """Raises OutsideError (E509) where rows that are known before the run are more than the memory."""
    (rows, beside, hint), columns = analysis.rows(), 1 + len(assembly.outputs[analysis])
    asked = rows * (8.0 * columns * (1 + analysis.complex) + beside)
    if asked < (there := memory()):
        return
    from ..diagnostics import Diagnostic, OutsideError

    said = f"{rows:.2g} rows of {columns} columns take {1e-9 * asked:,.1f} GB, there are {1e-9 * there:,.1f} GB of memory"
    found = Diagnostic("error", "E509", said, analysis.card.span, hint)
    raise OutsideError([*assembly.flat.sink.diagnostics, found])

"""`.tran tstep tstop [tstart [tmax]] [uic]`: the time course from the operating point or from initial values.

tstep is the print grid and the default of waveform times. The largest internal step is tmax or, as in
ngspice, the smaller of tstep and (tstop - tstart)/50, for methods that have no dense output of their own;
for the others (tstop - tstart)/10 and, where the equations are not linear, an eighth of a source's period.
Before tstart, a hundred-thousandth of the run where that is longer.
"""

from __future__ import annotations

import os

from . import Run, columns

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import Any

    from ..assemble import Assembly, Output
    from ..deck import Analysis
    from ..diagnostics import Sink


SMALL = 64e6  # bytes that are never too many


class Transient:
    """Arguments of the card [s]; `tmax` is None when it is not given."""

    __slots__ = ("tmax", "tstart", "tstep", "tstop", "uic")

    def __init__(self, tstep: float, tstop: float, tstart: float, tmax: float | None, uic: bool) -> None:
        self.tstep, self.tstop, self.tstart, self.tmax, self.uic = tstep, tstop, tstart, tmax, uic


def read(analysis: Analysis, sink: Sink, tmax: float | None = None) -> Transient | None:
    """Checks the card by ngspice's rules. None after an error. `tmax` from outside wins."""

    def wrong(message: str) -> None:
        sink.error("E305", message, analysis.span, hint=".tran tstep tstop [tstart [tmax]] [uic]")

    words = [a for a in analysis.args if isinstance(a, str)]
    uic = "uic" in analysis.flags or "uic" in words
    strange = [w for w in words if w != "uic"]
    args = [float(a) for a in analysis.args if not isinstance(a, str)]
    if strange:
        wrong(f".tran does not know `{strange[0]}`")
        return None
    if len(args) < 2:
        wrong(f".tran needs tstep and tstop, there {'is one number' if args else 'is no number'}")
        return None
    if len(args) > 4:
        wrong(f".tran takes four numbers at most, there are {len(args)}")
        return None
    if any(a != a or a in (float("inf"), float("-inf")) for a in args):
        wrong(".tran has an argument that is no finite number")
        return None
    tstep, tstop = args[:2]
    tstart = args[2] if len(args) > 2 else 0.0
    largest = args[3] if len(args) > 3 and args[3] > 0 else None
    if tstop <= 0:
        wrong(f"tstop is {tstop:g} s, it must be positive")
    elif tstep <= 0:
        wrong(
            f"tstep is {tstep:g} s, it must be positive: .tran {tstop / 1000:g} {tstop:g} makes 1000 points"
        )
    elif not 0 <= tstart < tstop:
        wrong(f"tstart is {tstart:g} s, it must lie between 0 and tstop = {tstop:g} s")
    elif len(args) > 3 and args[3] < 0:
        wrong(f"tmax is {args[3]:g} s, it must be positive")
    elif tmax is not None and not tmax > 0:
        wrong(f"the largest step is {tmax:g} s, it must be positive")
    else:
        return Transient(tstep, tstop, tstart, largest if tmax is None else tmax, uic)
    return None


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


def check_memory(assembly: Assembly, analysis: Analysis, t: Transient) -> None:
    """Raises OutsideError (E509) where the rows of the print grid alone are more than the memory."""
    rows, columns = (t.tstop - t.tstart) / t.tstep, 1 + len(assembly.outputs["tran"])
    if 8.0 * rows * columns < SMALL or 8.0 * rows * columns < (there := memory()):
        return
    from ..diagnostics import Diagnostic, OutsideError

    said = (
        f"{rows:.2g} rows of {columns} columns are {8e-9 * rows * columns:,.1f} GB, "
        f"there are {1e-9 * there:,.1f} GB of memory"
    )
    hint = f"a larger step, .tran {t.tstop / 1e4:.1g} {t.tstop:g}: steps between rows are as short as they need be"
    raise OutsideError(
        [*assembly.flat.sink.diagnostics, Diagnostic("error", "E509", said, analysis.span, hint)]
    )


def run(
    assembly: Assembly, analysis: Analysis, t: Transient, progress: Callable[..., object] | None = None,
    channels: Sequence[Output] = (), traced: bool = False, stream: tuple[str, bool, Any] | None = None,
) -> Run:  # fmt: skip
    """Every accepted point from tstart on; the first column is the time, `channels` are recorded last. Energy
    accounts are kept where the assembly has them, `traced` over time. `stream`: see outputs/raw.py."""
    check_memory(assembly, analysis, t)
    names, units, exprs = columns(assembly, "tran")

    def tick(now: float, step: float, steps: int, events: int) -> bool:
        return bool(progress and progress(now, t.tstop, step, steps, events))

    watch = tick if progress else None
    exprs = [*exprs, *(c.expr for c in channels)]
    book = assembly.accounts
    kept = None if book is None else ([e.expr for e in book.powers], [e.expr for e in book.energies], traced)
    waves = assembly.system.tran(
        t.tstep, t.tstop, t.tstart, t.tmax, t.uic, exprs, assembly.options, watch, kept, True, stream
    )
    trouble = []
    if waves.status == "failed":
        from .failure import explain

        trouble = explain(assembly, analysis, waves, names)
    return Run(
        "tran", ["time", *names], ["s", *units], waves, True, (t.tstep, t.tstop, t.tstart), trouble, t.uic
    )

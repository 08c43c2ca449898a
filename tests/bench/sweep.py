"""What a run of a sweep costs: `python tests/bench/sweep.py [--ngspice]`.

For each deck: CPU milliseconds of a run by itself (read, assembled, compiled, run, measured), of a run from kept equations
(emsim/sweeps/kept.py), and of that what the engine takes to make them again and what the run itself takes (the least of several
batches); then a whole sweep in one process and in two, and ngspice's own loop over the same values: seconds on the wall, and of
CPU time, which others on the machine disturb less.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import emsim
from emsim.interop.ngspice import find
from emsim.sweeps.runs import Point, Runner, Task

NETLISTS = Path(__file__).parents[2] / "netlists"
RC = "rc\n.param r=1k\nV1 a 0 PULSE(0 1 0 1n 1n 1 2)\nR1 a b {r}\nC1 b 0 1u\n.tran 50u 5m\n.meas tran top MAX v(b)\n.end\n"
OP741 = re.sub(
    r"(?m)^\.tran .*$|^\.save .*$",
    "",
    (NETLISTS / "electrical" / "opamp_741.cir").read_text().replace("PULSE(-4 4 10u 0.1u 0.1u 40u 100u)", "0.1"),
).replace(".end\n", ".op\n.meas op out FIND v(out)\n.end\n")  # fmt: skip
DECKS = {
    "RC": (RC, "r", 1e3, 1000),
    "pendulum servo": (str(NETLISTS / "coupled" / "pendulum_servo.cir"), "vp", 5.0, 1000),
    "741, .op": (OP741, "rl", 2e3, 1000),
}
BATCHES = 5


def least(run: object, value: float, runs: int) -> float:
    """CPU milliseconds of a run."""
    found = []
    for batch in range(BATCHES):
        start = time.process_time()
        for k in range(runs):
            run(Point(k, (value * (1.0 + 1e-4 * (k + runs * batch)),), None))  # type: ignore[operator]
        found.append((time.process_time() - start) / runs)
    return 1e3 * min(found)


def costs(source: str, name: str, value: float) -> tuple[float, float, float, float]:
    """By itself, kept, made again, run."""
    runner = Runner(Task(source, {}, (name,), (), {}, 1))
    for k in range(2):
        runner.run(Point(k, (value * (1.0 + k / 10),), None))
    kept = runner.kept
    assert kept is not None and kept.run(Point(0, (value,), None)) is not None
    values = kept.trace.again([value])
    made = least(lambda _: kept._system(values), value, 50)
    from emsim import pipeline

    solved = least(lambda _: pipeline.solve(kept.assembly, kept.planned), value, 50)
    return least(runner.alone, value, 50), least(kept.run, value, 50), made, solved


def cpu() -> float:
    """Seconds of this process and of those that it has waited for."""
    return sum(os.times()[:4])


def seconds(source: str, name: str, value: float, runs: int, jobs: int) -> tuple[float, float]:
    """On the wall, of CPU time."""
    start, used = time.perf_counter(), cpu()
    swept = emsim.sweep(source, {name: [value * (1.0 + 1e-4 * k) for k in range(runs)]}, jobs=jobs)
    assert swept.complete and not swept.failed, next(iter(swept.failed.values()), "")
    return time.perf_counter() - start, cpu() - used


def ngspice(value: float, runs: int) -> tuple[float, float]:
    """Seconds of ngspice's loop over the RC."""
    loop = RC.replace("{r}", "1k").replace(".param r=1k\n", "").replace(".meas tran top MAX v(b)\n", "")
    control = (
        f".control\nlet k = 0\nwhile k < {runs}\n  alter r1 = {value!r}*(1+1e-4*k)\n  tran 50u 5m\n"
        "  meas tran top MAX v(b)\n  destroy all\n  let k = k + 1\nend\nquit\n.endc\n.end\n"
    )
    with TemporaryDirectory() as folder:
        deck = Path(folder) / "loop.cir"
        deck.write_text(loop.replace(".end\n", control))
        start, used = time.perf_counter(), cpu()
        subprocess.run(
            [find(), "-b", str(deck)], cwd=folder, check=True, capture_output=True, stdin=subprocess.DEVNULL
        )
        return time.perf_counter() - start, cpu() - used


def main() -> None:
    head = ("by itself", "kept", "made", "run")
    print(f"{'deck, CPU ms a run':<22}" + "".join(f"{word:>12}" for word in head))
    for name, (source, of, value, _) in DECKS.items():
        print(f"{name:<22}" + "".join(f"{ms:>12.3f}" for ms in costs(source, of, value)))
    words = ("runs", "one process", "CPU", "two", "CPU")
    print(f"\n{'deck, seconds':<22}" + "".join(f"{word:>12}" for word in words))
    for name, (source, of, value, runs) in DECKS.items():
        found = [s for jobs in (1, 2) for s in seconds(source, of, value, runs, jobs)]
        print(f"{name:<22}{runs:>12}" + "".join(f"{s:>12.2f}" for s in found))
    if "--ngspice" in sys.argv[1:]:
        print(f"{'RC, ngspice':<22}{1000:>12}" + "".join(f"{s:>12.2f}" for s in ngspice(1e3, 1000)))


if __name__ == "__main__":
    main()

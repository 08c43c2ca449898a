"""What a run of a sweep costs: `python tests/bench/sweep.py [--ngspice]`; `--decks`: are runs from kept equations single runs to
the last bit, on every deck of netlists/ whose runs are short?

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
from emsim import pipeline
from emsim.diagnostics import DiagnosticError
from emsim.elaborate.steps import has_plain_value
from emsim.interop.ngspice import find
from emsim.sweeps.kept import _same
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
LONG = 4.0  # s: decks that run longer are left out


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


def plain(e: object) -> float | None:
    """The value of an element's line, where it is one number."""
    value = e.extra.get("dc") if "dc" in e.extra else e.value  # type: ignore[attr-defined]
    return (
        value if e.letter in "rlcvi" and has_plain_value(e) and isinstance(value, float) and value else None
    )  # type: ignore


def decks() -> int:
    """Three elements of each deck are swept at once; how many runs differ."""
    seen = kept = wrong = 0
    for path in sorted(NETLISTS.glob("**/*.cir")):
        try:
            flat = pipeline.read(str(path))
            known = {e.name: v for e in flat.elements if (v := plain(e)) is not None}
            if flat.steps or flat.commands or not known:
                continue
            names = tuple({list(known)[k]: None for k in (0, len(known) // 2, -1)})
            runner = Runner(Task(str(path), {}, names, (), {}, 1))
            points = [Point(k, tuple(known[n] * (1.0 + 0.02 * k) for n in names), None) for k in range(4)]
            start = time.perf_counter()
            runner.run(points[0])
            if time.perf_counter() - start > LONG:
                continue
            found = [runner.run(point) for point in points[1:]]
        except DiagnosticError:
            continue
        seen, kept = seen + 1, kept + (runner.kept is not None)
        for point, outcome in zip(points[1:], found, strict=True):
            own = runner.alone(point)
            # (E414 says how long a run would take, by the clock)
            if outcome.error[:4] != own.error[:4] or not (outcome.error or _same(outcome, own)):
                wrong += 1
                print(f"{path}: run {point} differs from a single run")
    print(f"{seen} decks, {kept} of them from kept equations, {wrong} runs that differ")
    return wrong


def main() -> None:
    if "--decks" in sys.argv[1:]:
        sys.exit(bool(decks()))
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

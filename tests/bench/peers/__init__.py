"""Other engines on the same machines: MuJoCo, Exudyn, Drake, each built by its own API from the deck's parameters.

One file each. A file runs as a program of its own (heavy imports, and nothing of one engine can disturb another's times):
it reads one JSON object from stdin, {"machine", "times", "limit", "rounds"}, and prints one JSON object a line:

    {"tool", "setting", "seconds", "evaluations", "values": {column of the deck: [one value a time]}}   or, with "reason"
    in place of "values", a run that did not get through

`seconds` is thread CPU time of the integration alone, least of `rounds` (in the engine's favour); building the model is
not counted. Values are the engine's own at exactly the common times, which its steps hit.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

from emsim.reports.work_precision import Point, Series

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from typing import Any

    import numpy as np

    from emsim.reports.ladder import Judge, Problem

# name in a suite entry -> (module that must be there, as it calls itself)
PROGRAMS = {"mujoco": ("mujoco", "MuJoCo"), "exudyn": ("exudyn", "Exudyn"), "drake": ("pydrake", "Drake")}
LIMIT, ROUNDS = 2.0, 3
PATIENCE = 120.0  # wall seconds for one program with all its settings


def measure(
    problem: Problem, judge: Judge, machine: str, programs: Sequence[str], limit: float = LIMIT, rounds: int = ROUNDS,
    said: Callable[[str], object] = lambda text: None, turn: Callable[[], object] = lambda: None,
) -> tuple[list[Series], list[str]]:  # fmt: skip
    """(series, notes) of every program on a machine, named as its deck; a program that is not installed is a note. `turn` is
    called before each and after the last."""
    series: dict[str, Series] = {}
    notes: list[str] = []
    for program in programs:
        module, name = PROGRAMS[program]
        if find_spec(module) is None:
            notes.append(f"no {name}: pip install 'emsim[peers]'")
            continue
        turn()
        said(name)
        asked = {"machine": machine, "times": problem.grid.tolist(), "limit": limit, "rounds": rounds}
        try:
            for found in _answers(program, asked):
                tool = found["tool"]
                one = series.setdefault(tool, Series(tool, "engine"))
                one.points.append(_point(problem, judge, found))
        except (subprocess.SubprocessError, ValueError, KeyError) as error:
            notes.append(f"{name} did not get through: {_words(error)}")
    turn()
    return list(series.values()), notes


def _answers(program: str, asked: dict[str, Any]) -> Iterator[dict[str, Any]]:
    # engines leave log files where they run
    paths = [str(Path(__file__).resolve().parents[1]), os.environ.get("PYTHONPATH", "")]
    with TemporaryDirectory() as folder:
        done = subprocess.run(
            [sys.executable, "-m", f"{__name__}.{program}"], cwd=folder,
            env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, paths))},
            input=json.dumps(asked), capture_output=True, text=True, timeout=PATIENCE, check=True,
        )  # fmt: skip
    for line in done.stdout.splitlines():
        # engines print what they like; answers are JSON objects
        if line.startswith('{"tool"'):
            yield json.loads(line)


def _words(error: Exception) -> str:
    if isinstance(error, subprocess.CalledProcessError):
        lines = [line for line in (error.stderr or "").splitlines() if line.strip()]
        return lines[-1][:200] if lines else f"exit code {error.returncode}"
    return str(error)[:200]


def _point(problem: Problem, judge: Judge, found: dict[str, Any]) -> Point:
    import numpy as np

    seconds, evaluations, setting = found["seconds"], found.get("evaluations"), found["setting"]
    if "values" not in found:
        return Point(setting, None, None, seconds, evaluations, reason=found["reason"])
    nothing = np.full(len(problem.grid), np.nan)
    values: np.ndarray = np.array(
        [found["values"].get(name, nothing) for name in problem.signals], dtype=float
    )
    error = judge.error(values)
    if not error < 1e3:
        return Point(setting, None, None, seconds, evaluations, reason="exploded")
    return Point(setting, None, error, seconds, evaluations)


def answer(
    tool: str, setting: str, seconds: float, values: Mapping[str, Sequence[float]] | None = None, reason: str = "",
    evaluations: int | None = None,
) -> None:  # fmt: skip
    """Prints one answer; the engines' side of the contract."""
    said: dict[str, Any] = {"tool": tool, "setting": setting, "seconds": seconds, "evaluations": evaluations}
    if values is None or any(v != v for column in values.values() for v in column):
        said["reason"] = reason or "not a number"
    else:
        said["values"] = {name: [float(v) for v in column] for name, column in values.items()}
    print(json.dumps(said), flush=True)


def question() -> tuple[str, list[float], float, int]:
    """(machine, times, limit, rounds) from stdin."""
    asked = json.load(sys.stdin)
    return asked["machine"], asked["times"], asked["limit"], asked["rounds"]

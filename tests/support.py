"""Helpers of the tests: where the decks are, decks with other options, values at given times.

Nothing here knows how emsim computes; a deck is text, options are changed in the text.
"""

from __future__ import annotations

import csv
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import emsim

ROOT = Path(__file__).resolve().parent.parent
NETLISTS = ROOT / "netlists"
REFS = Path(__file__).resolve().parent / "physics" / "refs"

needs_ngspice = pytest.mark.skipif(shutil.which("ngspice") is None, reason="needs the ngspice program")


def daily(values: Iterable[Any], every: int) -> list[Any]:
    """Of seeds or names of one kind, each `every`th; the others run once a week (-m further)."""
    return [v if k % every == 0 else pytest.param(v, marks=pytest.mark.further) for k, v in enumerate(values)]


def deck(name: str) -> str:
    """Text of netlists/NAME.cir."""
    return (NETLISTS / f"{name}.cir").read_text()


def with_options(
    text: str, options: str = "", params: dict[str, str] | None = None, tran: str | None = None
) -> str:
    """The deck with `.options` added (later ones win over the deck's own), parameters replaced, another .tran."""
    for key, value in (params or {}).items():
        text, n = re.subn(rf"(?im)^(\.param\b.*?\b{key}\s*=\s*)(\{{[^}}]*\}}|\S+)", rf"\g<1>{value}", text)
        assert n == 1, f"parameter {key} found {n} times"
    if tran is not None:
        text, n = re.subn(r"(?im)^\.tran\b.*$", f".tran {tran}", text)
        assert n == 1, f"{n} .tran cards"
    for pair in options.split():
        key = pair.split("=")[0]
        text = re.sub(rf"(?im)^(\.options?\b.*?)\s\b{key}\s*=\s*\S+", r"\1", text)
    if options:
        text, n = re.subn(r"(?im)^\.end\s*$", f".options {options}\n.end", text)
        assert n == 1, f"{n} .end cards"
    return text


def run(
    text: str, options: str = "", params: dict[str, str] | None = None, tran: str | None = None
) -> emsim.Result:
    return emsim.run(with_options(text, options, params, tran))


def values_at(result: emsim.Result, name: str, times: np.ndarray) -> np.ndarray:
    """A column at `times`: the recorded value where that time was recorded (methods with dense output record the
    print grid), else the result's own interpolation between points (trap and gear record their steps only)."""
    t, column = np.asarray(result.time), np.asarray(result[name])
    rows = nearest_rows(t, times)
    step = times[1] - times[0] if len(times) > 1 else t[-1]
    close = np.abs(t[rows] - times) <= 1e-9 * step
    return np.where(
        close, column[rows], [float(result.at(name, float(x))) for x in np.clip(times, t[0], t[-1])]
    )


def rows_at(result: emsim.Result, times: np.ndarray) -> np.ndarray:
    """Row numbers of the recorded points at `times`; they must be recorded points, not interpolated ones."""
    t = np.asarray(result.time)
    rows = nearest_rows(t, times)
    off = np.abs(t[rows] - times)
    assert off.max() <= 1e-6 * (times[1] - times[0] if len(times) > 1 else t[-1]), (
        f"no recorded point at t = {times[off.argmax()]!r}; nearest is {off.max():.3g} s away"
    )
    return rows


def nearest_rows(t: np.ndarray, times: np.ndarray) -> np.ndarray:
    rows = np.clip(np.searchsorted(t, times), 1, len(t) - 1)
    return np.where(np.abs(t[rows - 1] - times) < np.abs(t[rows] - times), rows - 1, rows)


def reference(name: str) -> dict[str, np.ndarray]:
    """Columns of tests/physics/refs/NAME.csv (comment lines start with #)."""
    with open(REFS / f"{name}.csv", newline="") as f:
        rows = list(csv.reader(line for line in f if not line.startswith("#")))
    data = np.array(rows[1:], dtype=float)
    return {key: data[:, k] for k, key in enumerate(rows[0])}


def copied_tree(to: Path) -> Path:
    """The project's sources in `to`, with the compiled engine of the emsim that is tested: for tests that edit them."""
    leave = shutil.ignore_patterns("__pycache__", "docs", "grammar", "_engine*", "target")
    shutil.copytree(ROOT / "emsim", to / "emsim", ignore=leave)
    shutil.copytree(ROOT / "grammar", to / "grammar")
    shutil.copy(ROOT / "pyproject.toml", to)  # by this the grammar is found where it is edited
    for engine in Path(emsim.__file__).parent.glob("_engine.*"):
        shutil.copy(engine, to / "emsim")
    return to


@contextmanager
def compiled_parts() -> Iterator[Path]:
    """The folder of what tests compile in the dev profile, held by one at a time: crates that the engine uses are made once."""
    import fcntl

    shared = ROOT / "target" / "house"
    shared.mkdir(parents=True, exist_ok=True)
    with open(shared / "lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield shared


def build_engine(tree: Path) -> None:
    """Compiles a copied tree's engine and puts it where the tree's emsim imports it."""
    build = "cargo build -q --manifest-path emsim/engine/Cargo.toml --features extension-module"
    with compiled_parts() as shared:
        env = {**os.environ, "CARGO_TARGET_DIR": str(shared), "PYO3_PYTHON": sys.executable}
        done = subprocess.run(build.split(), cwd=tree, env=env, capture_output=True, text=True, timeout=1200)
        assert done.returncode == 0, done.stderr
        for old in (tree / "emsim").glob("_engine.*"):
            old.unlink()
        built = next((shared / "debug").glob("*_engine.[sd][oy]*"))
        shutil.copy(built, tree / "emsim" / "_engine.abi3.so")

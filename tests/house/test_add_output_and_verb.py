"""An output format is one file in outputs/ and its line, a verb one file in cli/ and its line: both added to a copy."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from support import copied_tree

GNUPLOT = '''"""Columns for gnuplot: a comment with the names, then one line a point."""

from __future__ import annotations

from ..outcome import Outcome
from .beside import replacing


def write(path: str, result: Outcome) -> None:
    """Writes the main table. OSError as open() and write() raise it."""
    table = result.main
    with replacing(path) as beside, open(beside, "w", encoding="utf-8") as file:
        file.write("# " + " ".join(table.names) + "\\n")
        for point in zip(*(table.floats(k) for k in range(len(table.names))), strict=True):
            file.write(" ".join(map(repr, point)) + "\\n")
'''
LAST = '''"""`emsim last deck.cir v(out)`: the value of a signal at the end of a run."""

from __future__ import annotations


def main(args: list[str]) -> int:
    from ..pipeline import run

    deck, signal = args
    print(f"{float(run(deck)[signal][-1]):.6g}")
    return 0
'''
DECK = "charged\nV1 in 0 1\nR1 in out 1k\nC1 out 0 1u\n.tran 10u 1m uic\n.end\n"


def with_line(path: Path, before: str, line: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert text.count(before) == 1
    path.write_text(text.replace(before, before + line), encoding="utf-8")


def test_they_work(tmp_path):
    package = copied_tree(tmp_path) / "emsim"
    (package / "outputs" / "gnuplot.py").write_text(GNUPLOT, encoding="utf-8")
    with_line(package / "outputs" / "__init__.py", "FORMATS = {\n", '    ".dat": "gnuplot",\n')
    (package / "cli" / "last.py").write_text(LAST, encoding="utf-8")
    with_line(
        package / "cli" / "__init__.py", "VERBS = {\n", '    "last": "the value of a signal at the end",\n'
    )
    (tmp_path / "rc.cir").write_text(DECK, encoding="utf-8")

    def emsim_says(*args: str) -> str:
        env = {**os.environ, "PYTHONPATH": str(tmp_path), "XDG_CACHE_HOME": str(tmp_path / "cache")}
        done = subprocess.run(
            [sys.executable, "-m", "emsim", *args], cwd=tmp_path, env=env, capture_output=True, text=True, timeout=100
        )  # fmt: skip
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    # 1 - exp(-1)
    assert abs(float(emsim_says("last", "rc.cir", "v(out)")) - 0.632121) < 2e-4
    assert "the value of a signal at the end" in emsim_says("help")
    emsim_says("rc.cir", "-q", "-o", "rc.raw")
    (tmp_path / "save.py").write_text("import emsim; emsim.run('rc.cir').save('rc.dat')")
    env = {**os.environ, "PYTHONPATH": str(tmp_path)}
    subprocess.run([sys.executable, "save.py"], cwd=tmp_path, env=env, check=True, timeout=100)
    first, *points = (tmp_path / "rc.dat").read_text().splitlines()
    assert first.startswith("# time") and "v(out)" in first
    assert len(points) > 90 and float(points[-1].split()[first.split().index("v(out)") - 1]) > 0.63

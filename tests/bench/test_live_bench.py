"""The bench of the live page runs; no time is judged here."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import emsim

PROGRAMS = ("chromium", "chromium-browser", "google-chrome", "chrome")


@pytest.mark.skipif(not any(map(shutil.which, PROGRAMS)), reason="no Chromium on this machine")
def test_it_measures_files_and_sliders():
    pytest.importorskip("playwright")
    here = Path(__file__).resolve()
    deck = here.parents[2] / "netlists/lessons/14_cart_pole.cir"
    done = subprocess.run(
        [sys.executable, here.with_name("live.py"), deck, "2"],
        capture_output=True,
        text=True,
        timeout=300,
        env={**os.environ, "PYTHONPATH": str(Path(emsim.__file__).parents[1])},
    )
    assert done.returncode == 0, done.stderr
    rows = {line[:33].strip(): [float(v) for v in line[33:].split()] for line in done.stdout.splitlines()[1:]}
    assert set(rows) == {"a deck is saved", "a slider is moved"}
    for run, at_hand, painted in rows.values():
        assert 0 < run < at_hand < painted

"""Every plain deck of netlists/electrical against ngspice, by the program's own `emsim compare`.

A deck passes when each signal is within 0.5 % of its range of ngspice's tight run. Over all decks emsim must be
the nearer one on most signals.
"""

from __future__ import annotations

import json
import subprocess
import sys
from functools import cache
from typing import Any

import pytest
from support import NETLISTS, needs_ngspice

pytestmark = [needs_ngspice, pytest.mark.ngspice]

HERE_ALONE = {"transformer_inrush"}  # ngspice has no core on K lines: tests/physics/test_hysteresis.py
DECKS = sorted(
    p.stem for p in (NETLISTS / "electrical").glob("*.cir")
    if not p.stem.startswith("ref_") and p.stem not in HERE_ALONE
)  # fmt: skip


@cache
def compared(name: str) -> tuple[int, dict[str, Any], str]:
    done = subprocess.run(
        [sys.executable, "-m", "emsim", "compare", "--json", str(NETLISTS / "electrical" / f"{name}.cir")],
        capture_output=True, text=True, timeout=120, stdin=subprocess.DEVNULL,
    )  # fmt: skip
    document = json.loads(done.stdout) if done.stdout.startswith("{") else {}
    return done.returncode, document, done.stdout[-3000:] + done.stderr[-3000:]


def test_there_are_at_least_28_decks():
    assert len(DECKS) >= 28


@pytest.mark.slow
@pytest.mark.parametrize("name", DECKS)
def test_deck_passes(name):
    code, _, said = compared(name)
    assert code == 0, said


@pytest.mark.slow
def test_emsim_is_nearer_on_most_signals():
    nearer = total = 0
    for name in DECKS:
        for row in signals(compared(name)[1]):
            if row["nearer"] in ("emsim", "ngspice"):
                total += 1
                nearer += row["nearer"] == "emsim"
    assert total >= 100, f"only {total} signals compared"
    assert nearer > total / 2, f"emsim is nearer on {nearer} of {total}"


def signals(document: dict[str, Any]) -> list[dict[str, Any]]:
    return document.get("signals", [])

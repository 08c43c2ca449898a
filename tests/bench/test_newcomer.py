"""The newcomer's path from the first edit on: the messages alone lead to a deck that runs. No time is judged here."""

from __future__ import annotations

import os
import sys

import newcomer
import pytest


def program(folder):
    emsim = folder / "emsim"
    # the steps clear the path of modules, as a fresh environment has none
    where = os.environ.get("PYTHONPATH", "")
    emsim.write_text(f'#!/bin/sh\nexport PYTHONPATH="{where}"\nexec "{sys.executable}" -m emsim "$@"\n')
    emsim.chmod(0o755)
    return emsim


def test_messages_alone_mend_the_deck(tmp_path):
    steps = newcomer.Steps(tmp_path)
    newcomer.edit(steps, program(tmp_path), tmp_path)
    assert len(steps.steps) == 4 and steps.table().count("\n") == 5
    told = (newcomer.ROOT / "README.md").read_text(encoding="utf-8")
    assert all(f"| {what} | " in told for what, _ in steps.steps)
    assert "hinge 0 arm pin" in (tmp_path / "arm.cir").read_text()


def test_a_message_without_help_is_not_enough(tmp_path):
    (tmp_path / "said.txt").write_text("error[E999]: no\n  --> arm.cir:1:1\n   |\n 1 | x\n   | ^\n")
    (tmp_path / "arm.cir").write_text("x\n")
    with pytest.raises(SystemExit, match="does not say"):
        newcomer.mend(tmp_path / "arm.cir")


def test_a_step_that_fails_is_told(tmp_path):
    with pytest.raises(SystemExit, match="exit code 3 in place of 0"):
        newcomer.Steps(tmp_path).do("x", sys.executable, "-c", "raise SystemExit(3)")

"""The script that counts a method's work runs; no time is judged here."""

from __future__ import annotations

import methods


def test_measure():
    (_, counts), (_, why) = methods.measure("bench/two_loop_rlc", ["gear", "gear maxsteps=10"], 1e-3)
    assert counts["steps"] > 50 and 0 < counts["error"] < 0.5 and "error" in why


def test_own_method_and_tolerances_are_taken_out():
    text = methods.plain("x\n.options method=gear reltol=1e-9 gmin=1e-10 maxord=3\n.end\n")
    assert text == "x\n.options gmin=1e-10\n.end\n"

"""Modules that read no voltage, and such that carry nothing: the engine panicked ("chunk size must be non-zero")."""

from __future__ import annotations

import pytest

import emsim

SOURCE = """`include "disciplines.vams"
module isrc(p, n); inout p, n; electrical p, n;
  parameter real dc = 1m;
  analog I(p, n) <+ dc;
endmodule
"""
LEAK = """`include "disciplines.vams"
module leak(p, n); inout p, n; electrical p, n;
  parameter real g = 0;
  analog if (g > 0) I(p, n) <+ g * V(p, n);
endmodule
"""
TORQUE = """`include "disciplines.vams"
module drive(s); inout s; rotational s;
  parameter real m = 2;
  analog Tau(s) <+ m;
endmodule
"""


@pytest.mark.parametrize("count", [1, 4, 5, 9])
def test_constant_sources_add_up(count, scratch):
    """Ohm's law: each gives 1 mA into 1 kohm."""
    (scratch / "isrc.va").write_text(SOURCE)
    lines = "\n".join(f"N{k} 0 a s" for k in range(count))
    deck = f't\n.hdl "isrc.va"\n{lines}\n.model s isrc\nR1 a 0 1k\n.op\n.ac lin 1 1 1\n.end\n'
    assert emsim.run(deck).table("op")["v(a)"][0] == pytest.approx(count, rel=1e-6)


@pytest.mark.parametrize("method", ["auto", "trap", "gear", "radau", "esdirk", "trbdf2"])
def test_a_module_that_carries_nothing_changes_nothing(method, scratch):
    (scratch / "leak.va").write_text(LEAK)
    deck = "t\n{}.options method={}\nV1 a 0 SIN(0 1 1k)\nR1 a b 1k\nC1 b 0 1u\n{}.tran 10u 1m\n.end\n"
    without = emsim.run(deck.format("", method, ""))
    found = emsim.run(deck.format('.hdl "leak.va"\n', method, "N1 b 0 mm\n.model mm leak\n"))
    for t in (0.2e-3, 0.5e-3, 1e-3):
        assert found.at("v(b)", t) == pytest.approx(without.at("v(b)", t), abs=2e-3)


def test_a_constant_torque(scratch):
    """omega = m t / j."""
    (scratch / "drive.va").write_text(TORQUE)
    deck = 't\n.hdl "drive.va"\nBODY rotor m=1 j=4\nJOINT shaft 0 rotor pin\nN1 shaft d\n.model d drive\n.tran 10m 1\n.end\n'
    assert abs(emsim.run(deck).at("omega(shaft)", 1.0)) == pytest.approx(0.5, rel=1e-6)

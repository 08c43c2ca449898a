"""idt in modules that run: states of their own, from the initial values that they name."""

from __future__ import annotations

from math import cos, pi, sin
from pathlib import Path

import pytest
from module_decks import run

import emsim

STORE = """module store(p, n); inout p, n; electrical p, n;
electrical x;
parameter real start = 0.5;
analog begin
    V(x) <+ idt(V(p, n), start);
    I(p, n) <+ V(x);
end
endmodule
"""
# v'' = -w^2 v, of two integrals
SWING = """module swing(p); inout p; electrical p;
electrical v;
parameter real w = 6283.185307179586;
analog begin
    V(p) <+ idt(-w * V(v), 1.0);
    V(v) <+ idt(w * V(p), 0.0);
end
endmodule
"""
# linear drift: r = ron x + roff (1 - x), x' = k i
MEMRISTOR = """module memristor(p, n); inout p, n; electrical p, n;
electrical x;
parameter real ron = 100, roff = 16k, k = 1e4, x0 = 0.3;
analog begin
    V(x) <+ idt(k * I(p, n), x0);
    V(p, n) <+ (ron * V(x) + roff * (1.0 - V(x))) * I(p, n);
end
endmodule
"""


@pytest.mark.parametrize("method", ["auto", "radau", "gear", "trap", "esdirk", "trbdf2"])
def test_an_integral_starts_where_the_module_says(method: str, tmp_path: Path) -> None:
    found = run(
        tmp_path,
        STORE,
        f"V1 p 0 2\nN1 p 0 m\n.model m store\n.options method={method}\n.tran 10u 10m\n.save i(v1)",
    )
    for t in (0.0, 3e-3, 10e-3):
        assert found.at("i(v1)", t) == pytest.approx(-(0.5 + 2 * t), rel=1e-9)


def test_an_operating_point_holds_it_and_small_signals_move_it(tmp_path: Path) -> None:
    deck = "V1 p 0 2 ac 1\nN1 p 0 m\n.model m store start=0.25\n"
    assert run(tmp_path, STORE, f"{deck}.op\n.print op i(v1)")["i(v1)"][-1] == pytest.approx(-0.25, rel=1e-12)
    found = run(tmp_path, STORE, f"{deck}.ac dec 1 1 100\n.print ac i(v1)")
    for f, i in zip((1.0, 10.0, 100.0), found["i(v1)"], strict=True):
        assert complex(i) == pytest.approx(-1 / (2j * pi * f), rel=1e-12)


@pytest.mark.parametrize("uic", ["", " uic"])
def test_two_integrals_swing(uic: str, tmp_path: Path) -> None:
    deck = f"N1 p m\nR1 p 0 1k\n.model m swing\n.options reltol=1e-8\n.tran 10u 3m{uic}\n.save v(p)"
    found = run(tmp_path, SWING, deck)
    for t in (0.0, 0.4e-3, 1.1e-3, 2.9e-3):
        assert found.at("v(p)", t) == pytest.approx(cos(2 * pi * 1e3 * t), abs=1e-6)


def test_a_memristor_keeps_what_has_flowed(tmp_path: Path) -> None:
    """From v = r(x) x'/k:  v0/w (1 - cos w t) = (roff (x - x0) - (roff - ron) (x^2 - x0^2)/2)/k."""
    ron, roff, k, x0, w, v0 = 100.0, 16e3, 1e4, 0.3, 2 * pi * 50.0, 1.0
    deck = f"V1 p 0 sin(0 {v0} 50)\nN1 p 0 m\n.model m memristor\n.options reltol=1e-8\n.tran 0.1m 40m\n.save i(v1)"
    found = run(tmp_path, MEMRISTOR, deck)
    a = (roff - ron) / 2
    for t in (3e-3, 9e-3, 16e-3, 33e-3):
        flux = k * v0 / w * (1 - cos(w * t))
        x = (roff - (roff**2 - 4 * a * (flux + roff * x0 - a * x0**2)) ** 0.5) / (2 * a)
        assert found.at("i(v1)", t) == pytest.approx(-v0 * sin(w * t) / (ron * x + roff * (1 - x)), rel=1e-6)


def test_an_initial_value_that_hangs_on_voltages_is_refused(tmp_path: Path) -> None:
    with pytest.raises(emsim.DeckError, match="initial value of idt"):
        run(tmp_path, STORE.replace("start)", "V(p))"), "V1 p 0 2\nN1 p 0 m\n.model m store\n.op")

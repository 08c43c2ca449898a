"""$abstime, analysis() and ac_stim: modules that are sources, and that know what is asked of them."""

from __future__ import annotations

from cmath import exp as cexp
from math import cos, exp, pi, sin
from pathlib import Path

import pytest
from module_decks import HEAD, run

import emsim

SINE = """module sine(p, n); inout p, n; electrical p, n;
parameter real f = 1k, a = 2;
(* desc="what it gives", units="V" *) real v;
analog begin
    v = a * sin(6.283185307179586 * f * $abstime);
    V(p, n) <+ v;
end
endmodule
"""
# a charge that time pumps: i = d/dt (c(t) v)
PUMP = """module pump(p, n); inout p, n; electrical p, n;
analog I(p, n) <+ ddt((1n + 0.5n * sin(6283.185307179586 * $abstime)) * V(p, n));
endmodule
"""
KINDS = """module kinds(p); inout p; electrical p;
analog V(p) <+ (analysis("static") ? 1 : 0) + (analysis("dc") ? 2 : 0) + (analysis("tran") ? 4 : 0) + (analysis("ac") ? 8 : 0)
    + (analysis("noise") ? 16 : 0) + (analysis("ic") ? 32 : 0);
endmodule
"""
SMALL = """module small(p, n); inout p, n; electrical p, n;
parameter real size = 3, phase = 0.5;
analog begin
    I(p, n) <+ V(p, n) / 1k * (analysis("ac") ? 2 : 1);
    I(p, n) <+ ac_stim("ac", size, phase);
end
endmodule
"""
HISS = """module hiss(p, n); inout p, n; electrical p, n;
analog begin
    I(p, n) <+ V(p, n) / 1k;
    if (analysis("noise")) I(p, n) <+ white_noise(1e-20, "own");
end
endmodule
"""
METHODS = ["auto", "radau", "gear", "trap", "esdirk", "trbdf2", "dop853"]


@pytest.mark.parametrize("method", METHODS)
def test_a_source_of_time_drives_a_capacitor(method: str, tmp_path: Path) -> None:
    """v' = (a sin wt - v)/(rc) from 0: the stationary part, and a transient that falls as exp(-t/rc); rows between steps too."""
    deck = f"N1 in 0 m\nR1 in out 1k\nC1 out 0 1u\n.model m sine\n.options method={method} reltol=1e-6\n"
    found = run(tmp_path, SINE, f"{deck}.tran 10u 5m\n.save v(in) v(out) @n1[v]")
    w, rc, a = 2 * pi * 1e3, 1e-3, 2.0
    size = a / (1 + (w * rc) ** 2)
    for k in range(0, 500, 7):
        t = k * 1e-5
        assert found.at("v(in)", t) == pytest.approx(a * sin(w * t), abs=2e-4)
        assert found.at("@n1[v]", t) == pytest.approx(a * sin(w * t), abs=2e-4)
        v = size * (sin(w * t) - w * rc * cos(w * t) + w * rc * exp(-t / rc))
        assert found.at("v(out)", t) == pytest.approx(v, abs=2e-5)


@pytest.mark.parametrize("method", ["auto", "radau", "trap"])
def test_a_charge_that_time_pumps_is_kept(method: str, tmp_path: Path) -> None:
    """r d/dt (c(t) v) + v = e: q' = (e - q/c(t))/r, integrated by Simpson's rule of its integrating factor."""
    deck = f"V1 in 0 1\nR1 in out 1meg\nN1 out 0 m\n.model m pump\n.options method={method} reltol=1e-7\n"
    found = run(tmp_path, PUMP, f"{deck}.tran 10u 3m\n.save v(out)")
    n, t1 = 20_000, 3e-3
    c = [1e-9 + 0.5e-9 * sin(2 * pi * 1e3 * k * t1 / n) for k in range(n + 1)]
    q, h = 1e-9, t1 / n
    for k in range(0, n, 2):  # the classical rule of Runge and Kutta over two of these
        slope = [lambda q, c=c[k + j]: (1 - q / c) / 1e6 for j in range(3)]
        k1 = slope[0](q)
        k2 = slope[1](q + h * k1)
        k3 = slope[1](q + h * k2)
        k4 = slope[2](q + 2 * h * k3)
        q += 2 * h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    assert found.at("v(out)", t1) == pytest.approx(q / c[-1], abs=3e-6)


def test_every_analysis_is_known_by_its_name(tmp_path: Path) -> None:
    """The table of the LRM (4.6.1): of each analysis its own name, and what is there at its operating point."""
    deck = "N1 p 0 m\nR1 p 0 1\n.model m kinds\n".replace("p 0 m", "p m")
    assert run(tmp_path, KINDS, f"{deck}.op\n.save v(p)")["v(p)"][-1] == 3
    swept = run(tmp_path, KINDS, f"V1 a 0 0\nRa a 0 1\n{deck}.dc V1 0 1 1\n.save v(p)")
    assert list(swept["v(p)"]) == [3, 3]
    # the operating point of the transient is 1 + 4 + 32; behind it 4
    capacitor = deck.replace("R1 p 0 1", "R1 p out 1k\nC1 out 0 1u")
    found = run(tmp_path, KINDS, f"{capacitor}.tran 10u 1m\n.save v(out) v(p)")
    for t in (0.0, 0.3e-3, 1e-3):
        assert found.at("v(out)", t) == pytest.approx(4 + 33 * exp(-t / 1e-3), rel=2e-3)
    assert found.at("v(p)", 0.5e-3) == pytest.approx(4, rel=1e-12)


def test_a_stimulus_of_its_own_and_small_signals_of_their_own(tmp_path: Path) -> None:
    deck = "N1 p 0 m\nR1 p 0 1k\n.model m small\n.ac lin 1 1k 1k\n.save v(p)"
    assert run(tmp_path, SMALL, deck)["v(p)"][0] == pytest.approx(-3 * cexp(0.5j) / 3e-3, rel=1e-12)


def test_noise_that_is_there_in_noise_alone(tmp_path: Path) -> None:
    deck = (
        "V1 a 0 0 ac 1\nR1 a p 1k\nN1 p 0 m\n.model m hiss\n.noise v(p) V1 lin 1 1k 1k\n.save onoise_spectrum"
    )
    found = run(tmp_path, HISS, deck)
    thermal = 4 * 1.380649e-23 * 300.15 / 1e3
    assert found["onoise_spectrum"][0] ** 2 == pytest.approx((thermal + 1e-20) * 500.0**2, rel=1e-6)


def test_a_run_of_the_command_line(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    from emsim.cli import main

    (tmp_path / "m.va").write_text(HEAD + SINE)
    (tmp_path / "deck.cir").write_text(
        "title\n.hdl m.va\nN1 in 0 m\nR1 in 0 1k\n.model m sine f=250\n.tran 10u 1m\n.meas tran top find v(in) at=1m\n.end\n"
    )
    assert main([str(tmp_path / "deck.cir"), "-q"]) == 0
    assert "2.000000e+00" in capfd.readouterr().out


LATE = """module late(a, b, c); inout a, b, c; electrical a, b, c;
parameter real td = 0.2m;
analog begin
    V(b) <+ absdelay(V(a), td);
    V(c) <+ idtmod(1k, 0.25, 1.0, -0.5);
end
endmodule
"""
LATE_DECK = "V1 a 0 sin(0 1 1k) ac 1\nN1 a b c m\nR1 b 0 1k\nR2 c 0 1k\n.model m late\n"


@pytest.mark.parametrize("method", ["auto", "radau", "trap"])
def test_what_is_late_and_what_turns(method: str, tmp_path: Path) -> None:
    """absdelay is the sine before; idtmod a saw of period 1 ms that jumps from 0.5 to -0.5 at 0.25 ms."""
    found = run(
        tmp_path, LATE, f"{LATE_DECK}.options method={method} reltol=1e-6\n.tran 5u 3m\n.save v(b) v(c)"
    )
    assert found.at("v(c)", 0.0) == pytest.approx(0.25, abs=1e-9)
    for k in range(1, 30):
        t = k * 1e-4 + 1.3e-5
        was = sin(2 * pi * 1e3 * (t - 0.2e-3)) if t > 0.2e-3 else 0.0
        assert found.at("v(b)", t) == pytest.approx(was, abs=3e-4)
        assert found.at("v(c)", t) == pytest.approx((0.25 + 1e3 * t + 0.5) % 1.0 - 0.5, abs=1e-6)


def test_what_is_late_turns_the_phase_of_small_signals(tmp_path: Path) -> None:
    found = run(tmp_path, LATE, f"{LATE_DECK}.ac lin 3 1k 3k\n.save v(b)")
    for f, v in zip((1e3, 2e3, 3e3), found["v(b)"], strict=True):
        assert complex(v) == pytest.approx(cexp(-2j * pi * f * 0.2e-3), rel=1e-12)


def test_parameters_of_macros_have_defaults(tmp_path: Path) -> None:
    module = (
        "`define LOAD(a, b = gnd, g = pow(2, 3)) I(a, b) <+ g * V(a, b)\n"
        "module load(p); inout p; electrical p, gnd; ground gnd;\n"
        "analog begin `LOAD(p); `LOAD(p, , 2.0); `LOAD(p, gnd, 1.0); end\nendmodule\n"
    )
    found = run(tmp_path, module, "V1 p 0 1\nN1 p m\n.model m load\n.op\n.save i(v1)")
    assert found["i(v1)"][-1] == pytest.approx(-11, rel=1e-12)


@pytest.mark.parametrize(
    ("statement", "said"),
    [
        ("V(b) <+ slew(V(a), 0);", "slew with slopes of 0"),
        ("V(b) <+ absdelay(V(a), V(c));", "a delay hangs on voltages"),
        ("V(b) <+ absdelay(V(a), -1n);", "a delay of"),
        ("V(b) <+ idtmod(V(a), 0, -1);", "modulus"),
    ],
)
def test_what_is_not_there_is_refused_by_name(statement: str, said: str, tmp_path: Path) -> None:
    module = LATE.replace("analog begin", f"real x; analog begin {statement}").replace(
        "V(b) <+ absdelay(V(a), td);\n", ""
    )
    with pytest.raises(emsim.DeckError, match=said):
        run(tmp_path, module, f"{LATE_DECK}.op")

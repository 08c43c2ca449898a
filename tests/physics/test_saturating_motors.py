"""Motors whose iron saturates, and whose kt= and r= are expressions: scipy, closed forms, balances of energy, messages."""

from __future__ import annotations

from math import cos, pi, sin, sqrt

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from support import deck, with_options

import emsim
from emsim import pipeline

P, RS, LD, LQ, PSI, ISAT, J, B = 3, 0.2, 2e-3, 5e-3, 80e-3, 6.0, 1e-3, 1e-3


def run(text: str, options: str = "reltol=1e-9", analysis: str = ".tran 1m 50m") -> emsim.Result:
    return pipeline.run(
        f"saturates\n{text}\n.options {options}\n{analysis}\n.end\n", energy="tran" in analysis
    )


@pytest.mark.parametrize("formulation", ["joint", "absolute"])
def test_a_saturating_pmsm_runs_as_scipy_has_it(formulation):
    """Fluxes of the rotor's axes as states; currents from them by Newton's method. Voltages turn by themselves."""
    text = with_options(
        deck("coupled/saturating_pmsm"), f"reltol=1e-10 formulation={formulation}", tran="1m 50m uic"
    )
    r = pipeline.run(text, energy=True)
    ratio = LQ / LD

    def currents(fd: float, fq: float) -> tuple[float, float]:
        """id = s fd/ld, iq = s fq/lq with s^2 = 1 + (id^2 + ratio iq^2)/isat^2: s in closed form."""
        share = ((fd / LD) ** 2 + ratio * (fq / LQ) ** 2) / ISAT**2
        s = 1 / sqrt(1 - share)
        return s * fd / LD, s * fq / LQ

    def slopes(t: float, y: np.ndarray) -> list[float]:
        fd, fq, th, w = y  # without that of the magnets
        d, q = currents(fd, fq)
        at = 2 * pi * 20 * t - P * th
        vd, vq = 12 * cos(at), 12 * sin(at)
        torque = 1.5 * P * ((fd + PSI) * q - fq * d)
        return [vd - RS * d + P * w * fq, vq - RS * q - P * w * (fd + PSI), w, (torque - B * w - 0.5) / J]

    found = solve_ivp(slopes, (0, 0.05), [0, 0, 0, 0], "DOP853", rtol=1e-12, atol=1e-13, dense_output=True)
    assert max(abs(r["iq(m1)"])) > 1.5 * ISAT  # well into saturation
    for t in (5e-3, 20e-3, 35e-3, 50e-3):
        fd, fq, th, w = found.sol(t)
        d, q = currents(fd, fq)
        assert r.at("id(m1)", t) == pytest.approx(d, rel=1e-6, abs=1e-6)
        assert r.at("iq(m1)", t) == pytest.approx(q, rel=1e-6, abs=1e-6)
        assert r.at("omega(shaft)", t) == pytest.approx(w, rel=1e-6)
        assert r.at("angle(shaft)", t) == pytest.approx(th, rel=1e-6)
    assert r.energy.share < 1e-9


def test_little_current_saturates_nothing():
    text = "BODY r m=1 j=1m\nJOINT h 0 r pin ic=(0,30)\nMOTOR m1 a b c h model=m\n.model m {} {}\nVa a 0 1\nVb b 0 -1\nVc c 0 0\n"
    for kind, words in (
        ("pmsm", "p=2 rs=9 ld=1m psi=9m"),
        ("induction", "p=2 rs=9 rr=3 lm=60m lss=3m lsr=4m"),
    ):
        plain, wide = (
            run(text.format(kind, f"{words} {more}"), "reltol=1e-10", ".tran 1m 20m")
            for more in ("", "isat=1e6")
        )
        for t in (5e-3, 12e-3, 20e-3):
            assert plain.at("omega(h)", t) == pytest.approx(wide.at("omega(h)", t), rel=1e-9)


def test_an_induction_machine_draws_the_magnetising_current_of_its_curve():
    """At synchronous speed without rotor current psi = lss i + lm i/(1 + (i/isat)^2)^(1/2), v^2 = (rs i)^2 + (w psi)^2."""
    w, lm, lss, isat, i = 2 * pi * 50, 60e-3, 3e-3, 4.0, 9.0
    volts = float(np.hypot(0.5 * i, w * (lss * i + lm * i / sqrt(1 + (i / isat) ** 2))))
    r = run(
        f"BODY r m=1 j=1m\nJOINT h 0 r pin\nDRIVE d h qd={{{w}/2}}\nMOTOR m1 a b c h model=m\n"
        f".model m induction p=2 rs=0.5 rr=0.4 lm={lm} lss={lss} lsr=4m isat={isat}\n"
        f"Va a 0 SIN(0 {volts} 50 0 0 90)\nVb b 0 SIN(0 {volts} 50 0 0 -30)\nVc c 0 SIN(0 {volts} 50 0 0 -150)\n"
        ".save i(m1,1) i(m1,2)",
        "reltol=1e-8",
        ".tran 1m 4 3.9",
    )
    a, b = np.asarray(r["i(m1,1)"]), np.asarray(r["i(m1,2)"])
    np.testing.assert_allclose(np.hypot(a, (a + 2 * b) / sqrt(3)), i, rtol=1e-6)


def test_a_stepper_holds_less_than_in_proportion():
    """Current in b alone, the rotor where a holds it: torque km i/(1 + (i/isat)^2)^(1/2)."""
    r = run(
        "BODY r m=1 j=1m\nJOINT h 0 r pin\nMOTOR m1 a 0 b 0 h model=m\n.model m stepper nr=50 km=0.3 l=2m r=1 isat=1\nI1 0 b 4\n"
        "R1 a 0 1\n.print op torque(m1)",
        analysis=".op",
    )
    assert r["torque(m1)"][0] == pytest.approx(0.3 * 4.0 / sqrt(17.0), rel=1e-9)


@pytest.mark.parametrize("formulation", ["joint", "absolute"])
def test_kt_by_the_motors_own_current_is_torque_and_voltage(formulation):
    """kt = k/(1 + (i/i0)^2): steady speed and current in closed form, and nothing from nowhere on the way."""
    text = "BODY r m=1 j=10u\nJOINT h 0 r pin\nMOTOR m1 a 0 h kt={{20m/(1+(i(m1)/5)^2)}} r={} l=1m j=2u\n"
    text += "V1 a 0 12\nTORQUE t h tau={{-40m*tanh(omega(h))}}"
    r = run(text.format("{1+0.1*i(m1)^2}"), f"reltol=1e-9 formulation={formulation}", ".tran 50m 20")
    assert r.energy.share < 1e-9
    i, w = r["i(m1)"][-1], r["omega(h)"][-1]
    kt = 20e-3 / (1 + (i / 5) ** 2)
    assert kt * i == pytest.approx(40e-3, rel=1e-6)
    assert kt * w + (1 + 0.1 * i * i) * i == pytest.approx(12.0, rel=1e-6)


def test_friction_follows_a_temperature():
    r = run("BODY b m=1\nJOINT h 0 b slide ic=(0,2)\nFRICTION f h fc={4*(1-10m*(temp(pad)-300.15))}\n"
            "HEAT l pad of=f\nHEAT c pad c=0.2", analysis=".tran 10m 2")  # fmt: skip
    assert r["temp(pad)"][-1] - 300.15 == pytest.approx(2.0 / 0.2, rel=1e-7)


MESSAGES = [
    ("MOTOR m n 0 h kt={1+time} ke=2", "E231", "ke="),
    ("MOTOR m n 0 h kt={torque(m)} r=1", "E255", "torque(m)"),
    ("MOTOR m n 0 h vnom=9 n0=1 i0=1 istall=5 kt={1+time}", "E231", "express"),
    ("MOTOR m n 0 0 h model=k\n.model k bldc p=2 ke=1 l=1 isat=3", "E231", "isat="),
    ("MOTOR m n 0 n 0 h model=k\n.model k stepper nr=50 km=1 l=1m isat=3 tcm=-1m", "E231", "isat= and tcm="),
]  # fmt: skip


@pytest.mark.parametrize(("text", "code", "words"), MESSAGES)
def test_what_such_a_motor_cannot_be_is_told(text, code, words):
    with pytest.raises(emsim.DeckError) as told:
        run(f"V9 n 0 1\nBODY b m=1 j=1\nJOINT h 0 b pin\n{text}")
    assert any(d.code == code and words in d.message for d in told.value.diagnostics), told.value


def test_a_resistance_by_an_expression_makes_its_noise():
    """4 k T r, as that of a number."""
    text = "BODY b m=1 j=1\nJOINT h 0 b pin\nDRIVE d h q=0\nV1 n 0 0 ac 1\nR1 n a 5\nMOTOR m a 0 h kt=1 l=1m r={}"
    one, other = (run(text.format(r), analysis=".noise v(a) V1 lin 3 10 1k") for r in ("7", "{7+0*i(m)}"))
    np.testing.assert_allclose(one["onoise_spectrum"], other["onoise_spectrum"], rtol=1e-9)


def test_a_resistance_below_0_is_told():
    r = run(
        "BODY b m=1 j=1\nJOINT h 0 b pin\nV1 n 0 1\nMOTOR m n 0 h kt=1 l=1 r={1-100*time}",
        analysis=".tran 1m 20m",
    )
    assert any("is below 0" in d.message for d in r.diagnostics)

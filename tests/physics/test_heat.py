"""HEAT, and machines that their own losses warm: closed forms, a system integrated by scipy, balances of energy, messages."""

from __future__ import annotations

from math import atan, log, sqrt

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from support import deck, with_options

import emsim
from emsim import pipeline

SIGMA = 5.670374419e-8  # [W/(m^2 K^4)]


def run(text: str, options: str = "reltol=1e-8", analysis: str = ".tran 0.1 10") -> emsim.Result:
    return pipeline.run(f"heat\n{text}\n.options {options}\n{analysis}\n.end\n", energy="tran" in analysis)


def test_a_body_that_is_heated_nears_its_last_temperature():
    r = run(
        "HEAT cap case c=10 ic=20degC\nHEAT way case 0 r=2\nHEAT src case p=5",
        "temp=27 reltol=1e-8",
        ".tran 1 100",
    )
    t = np.asarray(r["time"])
    wanted = 310.15 + (293.15 - 310.15) * np.exp(-t / 20.0)
    np.testing.assert_allclose(r["temp(case)"], wanted, rtol=1e-8)
    assert r.energy.share < 1e-9
    point = run("HEAT cap case c=10\nHEAT way case 0 h=5 area=0.1\nHEAT src case p=5", "temp=27", ".op")
    assert point["temp(case)"][0] == pytest.approx(310.15, rel=1e-12)


def test_a_wave_of_temperature_gets_into_a_wall_as_the_diffusion_has_it():
    """A ladder of resistances and capacities, driven by a temperature at its end: the impedance of an RC ladder."""
    n = 5
    wall = "\n".join(f"HEAT r{k} n{k} n{k + 1} r=2\nHEAT c{k} n{k + 1} c=3" for k in range(n))
    r = run(f"V1 v 0 0 ac 1\nHEAT hot n0 t={{300.15+v(v)}}\n{wall}", "reltol=1e-8", ".ac dec 5 1m 1")
    for k, f in enumerate(np.asarray(r["frequency"]).real):
        matrix = np.zeros((n, n), complex)
        for j in range(n):
            matrix[j, j] = 0.5 + (0.5 if j < n - 1 else 0.0) + 2j * np.pi * f * 3.0
            for other in (j - 1, j + 1):
                if 0 <= other < n:
                    matrix[j, other] = -0.5
        wanted = np.linalg.solve(matrix, [0.5, *[0.0] * (n - 1)])[-1]
        assert abs(r[f"temp(n{n})"][k] - wanted) < 1e-12


def test_a_body_that_radiates_cools_by_the_fourth_power():
    """t(T) in closed form: k = eps sigma A/c, s the surroundings, 4 k s^3 t the change of ln((T+s)/(T-s)) + 2 atan(T/s)."""
    r = run("HEAT cap ball c=100 ic=700\nHEAT glow ball 0 eps=0.8 area=0.1", "reltol=1e-9", ".tran 1 60")
    s, k = 300.15, 0.8 * 0.1 * SIGMA / 100.0

    def clock(temperature: float) -> float:
        return (log((temperature + s) / (temperature - s)) + 2.0 * atan(temperature / s)) / (4.0 * k * s**3)

    for t, temperature in zip(r["time"], r["temp(ball)"], strict=True):
        assert clock(temperature) - clock(700.0) == pytest.approx(t, abs=1e-6)


def test_a_resistor_warms_and_its_resistance_follows():
    """The fixed point: v^2/(R0 (1 + a dT)) r = dT is a quadratic."""
    text = "V1 a 0 10\nR1 a 0 R={100*(1+4m*(temp(film)-300.15))}\n"
    text += "HEAT loss film of=r1\nHEAT way film 0 r=150\nHEAT cap film c=0.1"
    a, rise = 4e-3, 150.0 * 100.0 / 100.0
    wanted = (-1.0 + sqrt(1.0 + 4.0 * a * rise)) / (2.0 * a)
    r = run(text, analysis=".op")
    assert r["temp(film)"][0] - 300.15 == pytest.approx(wanted, rel=1e-9)
    r = run(text)
    assert r.energy.share < 1e-9 and r.energy.supplied > 1.0
    assert next(x.dissipated for x in r.energy.lines if x.name == "way") == pytest.approx(r.energy.dissipated)


def test_what_friction_takes_from_a_body_warms_another():
    """m v^2/2 is c dT, whatever the law of friction, and energy() never changes."""
    text = (
        "BODY b m=2\nJOINT s 0 b slide ic=(0,3) damp=0.5\nFRICTION f s fc=4\nHEAT hf pad of=f\nHEAT hs pad of=s\n"
        "HEAT cf pad c=3\n.save temp(pad) energy() loss()"
    )
    for formulation in ("joint", "absolute"):
        r = run(text, f"reltol=1e-9 formulation={formulation}", ".tran 10m 2")
        assert r["temp(pad)"][-1] - 300.15 == pytest.approx(9.0 / 3.0, rel=1e-8)
        np.testing.assert_allclose(r["energy()"], 9.0, rtol=1e-8)
        assert np.all(np.asarray(r["loss()"]) == 0.0)


def test_a_motor_that_stalls_is_as_warm_as_its_resistance_then_has_it():
    text = (
        "BODY r m=1 j=1m\nJOINT h 0 r pin\nMOTOR m a 0 h kt=20m r=2 l=1m heat=coil tc1=4m tref=25degC\n"
        "HEAT way coil 0 r=3\nHEAT cap coil c=2\nV1 a 0 6"
    )
    r = run(text, "temp=27", ".op")
    a, start = 4e-3, 1.0 + 4e-3 * 2.0  # 2 K above tref
    rise = (-start + sqrt(start * start + 4.0 * a * 3.0 * 36.0 / 2.0)) / (2.0 * a)
    assert r["temp(coil)"][0] - 300.15 == pytest.approx(rise, rel=1e-9)
    assert r["i(m)"][0] == pytest.approx(6.0 / (2.0 * (start + a * rise)), rel=1e-9)


@pytest.mark.parametrize("formulation", ["joint", "absolute"])
def test_the_motor_of_the_example_is_as_warm_as_scipy_has_it(formulation):
    text = with_options(deck("coupled/motor_heat"), f"reltol=1e-9 formulation={formulation}", tran="5 100")
    r = pipeline.run(text, energy=True)
    kt, ohm, coil, inertia, b, s = 20e-3, 1.2, 1e-3, 22e-6, 2e-6, 293.15

    def slopes(t: float, y: np.ndarray) -> list[float]:
        i, w, hot, case = y
        k, res = kt * (1 - 2e-3 * (case - 300.15)), ohm * (1 + 3.93e-3 * (hot - 300.15))
        between = (hot - case) / 1.5
        out = 12 * 15e-3 * (case - s) + 0.8 * SIGMA * 15e-3 * (case**4 - s**4)
        load = 30e-3 * np.tanh(w / 5)
        loss = res * i * i + b * w * w
        return [
            (12 - res * i - k * w) / coil,
            (k * i - b * w - load) / inertia,
            (loss - between) / 5,
            (between - out) / 40,
        ]

    # a run begins where the circuit is at rest with the rotor held
    first = 12 / (ohm * (1 + 3.93e-3 * (s - 300.15)))
    found = solve_ivp(slopes, (0, 100), [first, 0, s, s], "Radau", rtol=1e-10, atol=1e-10, dense_output=True)
    want = found.sol(np.asarray(r["time"]))
    for name, row in (("i(m1)", 0), ("omega(shaft)", 1), ("temp(coil)", 2), ("temp(case)", 3)):
        np.testing.assert_allclose(r[name], want[row], rtol=2e-6, atol=2e-6, err_msg=name)
    assert r.energy.share < 1e-9


@pytest.mark.parametrize(
    ("kind", "nodes", "parameters"),
    [
        ("pmsm", "a b c", "p=3 rs=0.2 ld=1m lq=3m psi=80m j=1m b=1m"),
        ("bldc", "a b c", "p=2 r=0.5 l=0.4m ke=30m j=1m"),
        ("stepper", "a 0 b 0", "nr=50 km=0.2 r=0.6 l=2m td=20m j=1m"),
    ],
)
def test_warm_magnets_give_torque_and_voltage_alike(kind, nodes, parameters):
    """Nothing comes from nowhere while they get warmer, and at a held temperature the machine is one with weaker magnets."""
    sources = "Va a 0 SIN(0 5 50)\nVb b 0 SIN(1 5 50 0 0 -120)\nVc c 0 SIN(0 5 50 0 0 -240)\nRc c 0 1k\n"
    rotor = "BODY r m=1 j=1m\nJOINT h 0 r pin ic=(0.4,5)\n"
    warm = f"MOTOR m1 {nodes} h model=m heat=coil tc1=4m tcm=-2m\nHEAT cap coil c=0.02\n.model m {kind} {parameters}"
    r = run(sources + rotor + warm, "reltol=1e-9", ".tran 1m 50m uic")
    assert r.energy.share < 1e-8 and r["temp(coil)"][-1] > 301.0
    held = f"MOTOR m1 {nodes} h model=m heat=coil tc1=4m tcm=-2m\nHEAT hot coil t=400.15\n.model m {kind} {parameters}"
    factors = {"rs": 1.4, "r": 1.4, "psi": 0.8, "ke": 0.8, "km": 0.8}
    words = (word.split("=") for word in parameters.split())
    weak = " ".join(f"{key}={{{value}*{factors.get(key, 1.0)}}}" for key, value in words)
    cold = f"MOTOR m1 {nodes} h model=m\n.model m {kind} {weak}"
    one, other = (run(sources + rotor + text, "reltol=1e-9", ".tran 1m 50m uic") for text in (held, cold))
    np.testing.assert_allclose(
        one["omega(h)"], other["omega(h)"], atol=1e-6 * np.max(np.abs(one["omega(h)"]))
    )


MESSAGES = [
    ("HEAT a x r=1", "E233", "two nodes"), ("HEAT a x 0 r=1 c=2", "E252", "exactly one"),
    ("HEAT a x 0 h=3", "E230", "needs area="), ("HEAT a x c=1 area=2", "E231", "does not take area="),
    ("HEAT a 0 c=1", "E257", "surroundings"), ("HEAT a x c=1 ic=300\nHEAT b x c=2 ic=300", "E257", "another card"),
    ("HEAT a x y r=1", "E262", "no way leads"), ("HEAT a a 0 r=1\nR1 a 0 1", "E260", "electrical"),
    ("HEAT a x of=q9\nHEAT b x 0 r=1", "E250", "nothing"), ("HEAT a x of=c1\nC1 n 0 1\nHEAT b x 0 r=1", "E261", "one power"),
    ("R1 n 0 1\nHEAT a x of=r1\nHEAT c x of=r1\nHEAT b x 0 r=1", "E261", "already"),
    ("HEAT a x 0 r=1\nB1 n 0 V={temp(z)}", "E250", "no node of the heat domain"),
    ("HEAT a x c=25degC\nHEAT b x 0 r=1", "E256", "degc does not fit"),
    ("BODY b m=1\nJOINT h 0 b pin\nMOTOR m n 0 h kt=1 r=1 tc1=4m", "E230", "by temperature"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "code", "words"), MESSAGES)
def test_what_is_wrong_is_told_by_name(text, code, words):
    with pytest.raises(emsim.DeckError) as told:
        run(f"V9 n 0 1\n{text}")
    found = [d for d in told.value.diagnostics if d.code == code]
    assert found and words in found[0].message and found[0].span is not None

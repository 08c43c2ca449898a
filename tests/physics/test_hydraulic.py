"""HYDRAULIC: tanks, pipes, orifices, valves, pumps and cylinders: closed forms, scipy, balances of energy, messages."""

from __future__ import annotations

from math import pi, sqrt

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from support import deck, with_options

import emsim
from emsim import pipeline

G = 9.81


def run(text: str, options: str = "reltol=1e-9", analysis: str = ".tran 5m 1") -> emsim.Result:
    return pipeline.run(
        f"hydraulic\n{text}\n.options {options}\n{analysis}\n.end\n", energy="tran" in analysis
    )


def test_a_tank_empties_as_torricelli_has_it():
    """sqrt(h) falls evenly: d/dt sqrt(h) = -cd a sqrt(2 g)/(2 A)."""
    r = run(
        ".gravity 9.81\nHYDRAULIC t bottom tank=0.5 rho=870 level=2\nHYDRAULIC o bottom 0 area=1m cd=0.62 rho=870 plam=0.1\n"
        ".print tran length(t) flow(o)",
        analysis=".tran 1 400",
    )
    root = sqrt(2.0) - 0.62e-3 * sqrt(2 * G) / (2 * 0.5) * np.asarray(r["time"])
    assert root[-1] > 0.3
    np.testing.assert_allclose(r["length(t)"], root**2, rtol=1e-7)
    np.testing.assert_allclose(r["flow(o)"], 0.62e-3 * np.sqrt(2 * G) * root, rtol=1e-7)
    assert r.energy.share < 1e-9


def test_a_pipe_fills_a_volume_with_poiseuilles_time_constant():
    r = run(
        "HYDRAULIC src a p=10bar\nHYDRAULIC way a b len=2 d=2m mu=30m\nHYDRAULIC room b vol=1m bulk=1g",
        analysis=".tran 5m 1",
    )
    tau = 128 * 30e-3 * 2 / (pi * 2e-3**4) * 1e-3 / 1e9
    np.testing.assert_allclose(r["pressure(b)"], 1e6 * (1 - np.exp(-np.asarray(r["time"]) / tau)), atol=1.0)
    assert r.energy.share < 1e-9


def test_a_small_drop_across_an_orifice_is_laminar():
    """Below plam the flow is the drop by a resistance, far above it the root of it, in between smooth and odd."""
    for drop in (-3e5, -1.0, 0.0, 1.0, 1e3, 3e5):
        r = run(
            f"HYDRAULIC s a p={drop}\nHYDRAULIC o a 0 area=1u cd=0.7 rho=900 plam=1k\n.print op flow(o)",
            analysis=".op",
        )
        wanted = 0.7e-6 * sqrt(2 / 900) * drop / (drop**2 + 1e6) ** 0.25
        assert r["flow(o)"][0] == pytest.approx(wanted, rel=1e-12, abs=1e-30)


@pytest.mark.parametrize("formulation", ["joint", "absolute"])
def test_a_mass_on_a_column_of_oil_swings(formulation):
    """A chamber of volume V on a piston A is a spring of about K A^2/V, at the pressure that carries the mass."""
    area, height, bulk, mass = 1e-3, 0.2, 1.4e9, 300.0
    weight = mass * G / area
    # V' (p + p^2/(2 bulk)) = m g
    p = bulk * (sqrt(1 + 2 * weight / bulk) - 1)
    text = f".gravity 9.81\nBODY m m={mass}\nJOINT h 0 m slide axis=(0,1)\n"
    text += f"HYDRAULIC c a h vol={{1m*({height}+pos(h))}} bulk=1.4g ic={p!r}"
    # what stays is V (1 + p/bulk): d(force)/dq along it
    slope = area * (1 + p / bulk) * -(bulk + p) / height
    found = run(
        text + "\n.print ac pos(h)\nFORCE f m dir=(0,1) {v(f)}\nV1 f 0 0 ac 1",
        f"formulation={formulation} reltol=1e-9",
        ".ac lin 3 20 22",
    )
    for f, x in zip(np.asarray(found["frequency"]).real, found["pos(h)"], strict=True):
        assert x == pytest.approx(1.0 / (-slope - mass * (2 * pi * f) ** 2), rel=1e-6)
    r = run(
        text.replace("slide axis=(0,1)", "slide axis=(0,1) ic=(0,1u)"),
        f"formulation={formulation} reltol=1e-10",
        ".tran 1m 0.1",
    )
    w = sqrt(-slope / mass)
    np.testing.assert_allclose(r["pos(h)"], 1e-6 / w * np.sin(w * np.asarray(r["time"])), atol=2e-12)
    assert r.energy.share < 1e-9


def test_a_press_multiplies_force_by_the_ratio_of_its_pistons():
    text = (
        "BODY a m=1\nBODY b m=1\nJOINT ja 0 a slide axis=(0,1)\nJOINT jb 0 b slide axis=(0,1)\nFORCE f a dir=(0,1) 10\n"
        "SPRING s jb k=1k\nDAMPER da ja c=100\nDAMPER db jb c=100\n"
        "HYDRAULIC ca n ja vol={10m-1m*pos(ja)} bulk=1g\nHYDRAULIC cb n jb vol={10m+7m*pos(jb)} bulk=1g\n"
        ".print tran force(cb) force(ca)"
    )
    r = run(text, analysis=".tran 0.1 200")
    assert r["force(ca)"][-1] == pytest.approx(-10.0, rel=1e-6)
    assert r["force(cb)"][-1] == pytest.approx(70.0, rel=1e-6)
    assert r["pos(jb)"][-1] == pytest.approx(70.0 / 1e3, rel=1e-6)
    assert r["pos(ja)"][-1] == pytest.approx(7 * 70.0 / 1e3 + 20e-3 * 10e3 / 1e9 / 1e-3, rel=1e-5)
    assert r.energy.share < 1e-9


def test_a_pump_gives_its_displacement_and_takes_torque_by_pressure():
    r = run(
        "BODY b m=1 j=1\nJOINT h 0 b pin\nDRIVE d h qd=50\nHYDRAULIC pump 0 a h disp=2u\nHYDRAULIC load a 0 r=1e10\n"
        ".print tran flow(load) torque(pump)",
        analysis=".tran 0.1 1",
    )
    np.testing.assert_allclose(r["pressure(a)"], 1e10 * 100e-6, rtol=1e-12)
    np.testing.assert_allclose(r["torque(pump)"], -2e-6 * 1e6, rtol=1e-12)
    assert r.energy.dissipated == pytest.approx(1e6 * 100e-6, rel=1e-9) and r.energy.share < 1e-9


def test_a_relief_valve_holds_its_pressure_and_a_check_valve_its_way():
    for flow, wanted in ((1e-5, 100e5 + 1e9 * 1e-5), (-1e-5, -1e11 * 1e-5)):
        r = run(
            f"HYDRAULIC s a q={flow}\nHYDRAULIC v a 0 r=1e9 crack=100bar\nHYDRAULIC other 0 a r=1e11 crack=0",
            analysis=".op",
        )
        assert r["pressure(a)"][0] == pytest.approx(wanted, rel=1e-9)


def test_a_piston_between_two_check_valves_pumps():
    """Every stroke gives its volume, less what compression keeps; all energy is accounted for."""
    r = run(
        "BODY p m=1\nJOINT h 0 p slide axis=(1,0)\nDRIVE d h q={10m*sin(2*pi*5*time)}\n"
        "HYDRAULIC cyl c h vol={20u+1m*pos(h)} bulk=1g\nHYDRAULIC in 0 c area=50u rho=900 crack=0\n"
        "HYDRAULIC out c line area=50u rho=900 crack=0\n"
        "HYDRAULIC tank line p=20bar\n.print tran flow(out) flow(tank)",
        "reltol=1e-7",
        ".tran 1m 1",
    )
    assert r.energy.share < 1e-6
    t, flow = np.asarray(r["time"]), np.asarray(r["flow(out)"])
    given = np.sum((flow[1:] + flow[:-1]) / 2 * np.diff(t))
    assert given == pytest.approx(5 * 20e-6, rel=0.03)
    assert np.min(flow) > -1e-12


def test_liquid_in_a_pipe_hammers():
    """rho l/A and V/K swing at 1/sqrt(L C)."""
    r = run(
        "HYDRAULIC w a 0 inertia=2e6\nHYDRAULIC room a vol=1m bulk=1g ic=1meg",
        "reltol=1e-10",
        ".tran 1m 0.05",
    )
    w = 1 / sqrt(2e6 * 1e-3 / 1e9)
    np.testing.assert_allclose(r["pressure(a)"], 1e6 * np.cos(w * np.asarray(r["time"])), atol=1.0)
    assert r.energy.share < 1e-9


@pytest.mark.parametrize("formulation", ["joint", "absolute"])
def test_the_press_of_the_example_moves_as_scipy_has_it(formulation):
    r = pipeline.run(
        with_options(deck("coupled/hydraulic_press"), f"reltol=1e-9 formulation={formulation}", tran="5m 3"),
        energy=True,
    )
    disp, bulk = 1e-6 / (2 * pi), 1.4e9
    pipe = 128 * 40e-3 / (pi * 6e-3**4)

    def slopes(t: float, y: np.ndarray) -> list[float]:
        i, w, x, u, line, ram = y
        volts = 24.0 * min(max((t - 10e-3) / 10e-3, 0.0), 1.0)
        flow, relief, room = (line - ram) / pipe, max(line - 60e5, 0.0) / 5e10, 50e-6 + 1e-3 * x
        force = 1e-3 * (ram + ram * ram / (2 * bulk))
        return [
            (volts - 0.25 * i - 0.1 * w) / 1e-3,
            (0.1 * i - 1e-3 * w - disp * line) / 2e-3,
            u,
            (force - 200 * G - 2e6 * x - 5e3 * u) / 200,
            (disp * w - line / 1e13 - flow - relief) * bulk / 200e-6,
            (flow - 1e-3 * u * (1 + ram / bulk)) * bulk / room,
        ]

    y = np.array([0, 0, 0, 0, 0, 1.962e6], float)
    for a, b in ((0, 10e-3), (10e-3, 20e-3), (20e-3, 3)):
        found = solve_ivp(slopes, (a, b), y, "Radau", rtol=1e-11, atol=1e-13, dense_output=True)
        y = found.y[:, -1]
    for t in (0.1, 1.0, 3.0):
        _, w, x, _, line, ram = found.sol(t)
        for name, wanted in (
            ("omega(shaft)", w),
            ("pos(lift)", x),
            ("pressure(line)", line),
            ("pressure(ram_a)", ram),
        ):
            assert r.at(name, t) == pytest.approx(wanted, rel=2e-6), name
    assert r.energy.share < 1e-8


MESSAGES = [
    ("HYDRAULIC c a r=1", "E233", "1 terminal"), ("HYDRAULIC c a 0 r=1 q=1", "E252", "exactly one"),
    ("HYDRAULIC c a 0 len=1", "E230", "d="), ("HYDRAULIC c a 0 r=1 rho=3", "E231", "rho="),
    ("HYDRAULIC c a vol=1", "E230", "bulk="), ("HYDRAULIC c a h vol={1+time} bulk=1g", "E252", "nothing supplies"),
    ("HYDRAULIC c a h vol={1+pos(h)}", "E262", "pressure(a)"), ("HYDRAULIC c a tank=1 rho=3", "E230", ".gravity"),
    ("HYDRAULIC c 0 vol=1 bulk=1", "E257", "surroundings"), ("HYDRAULIC c a vol=0 bulk=1g", "E238", "greater"),
    ("HYDRAULIC c a 0 h vol={1+pos(h)} bulk=1g", "E233", "one node"), ("HYDRAULIC c a 0 r=5bar", "E256", "bar does not fit"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "code", "words"), MESSAGES)
def test_what_is_wrong_with_a_hydraulic_circuit_is_told(text, code, words):
    with pytest.raises(emsim.DeckError) as told:
        run(f"BODY b m=1\nJOINT h 0 b slide axis=(1,0)\n{text}")
    found = [d for d in told.value.diagnostics if d.code == code]
    assert found and words in found[0].message and found[0].span is not None, told.value


def test_a_pressure_below_vacuum_is_told():
    r = run(
        "BODY b m=1\nJOINT h 0 b slide axis=(1,0)\nFORCE f b dir=(1,0) 500\nHYDRAULIC c a h vol={1m+1m*pos(h)} bulk=1g",
        analysis=".tran 1m 10m",
    )
    assert any("below vacuum" in d.message for d in r.diagnostics)


def test_nodes_of_every_domain_go_through_subcircuits():
    r = run(
        ".subckt coil m1 m2 p n nn=100\nMAGNETIC w m1 m2 p n turns={nn}\nR1 p n 5\n"
        "HEAT loss inner of=r1\nHEAT way inner 0 r=2\n.ends\n"
        ".subckt room port\nHYDRAULIC w port 0 r=1e9\n.ends\n"
        "X1 top 0 a 0 coil nn=200\nMAGNETIC c top 0 r=1meg\nI1 0 a 2\nR2 a 0 5\nX2 line room\nHYDRAULIC s line q=1m\n"
        ".print op flux(c) i(x1.w) temp(x1.inner) pressure(line) flow(x2.w)",
        analysis=".op",
    )
    assert r["flux(c)"][0] == pytest.approx(200 * 2 / 1e6, rel=1e-9) and r["i(x1.w)"][0] == pytest.approx(2.0)
    assert r["pressure(line)"][0] == pytest.approx(1e6, rel=1e-12) and r["flow(x2.w)"][0] == pytest.approx(
        1e-3
    )
    assert r["temp(x1.inner)"][0] == pytest.approx(300.15, rel=1e-12)

"""BEAM: modes, large bending at rest, buckling, motion, damping; against closed forms and published figures."""

from __future__ import annotations

from math import cos, cosh, pi, sin, sinh, sqrt, tan

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipeinc, ellipkinc

import emsim
from emsim import pipeline

BOTH = pytest.mark.parametrize("formulation", ["joint", "absolute"])
UNIT = "ei=1 ea=1e6 rhoa=1"  # of length 1: frequencies are (beta l)^2


def ask(cards: str, formulation: str = "joint", options: str = "reltol=1e-6") -> emsim.Result:
    text = f"beam\n{cards}\n.options {options} formulation={formulation} method=radau\n.end\n"
    return pipeline.run(text, energy=True)


def modes(cards: str, formulation: str = "joint", card: str = ".modes") -> np.ndarray:
    """rad/s, from the lowest."""
    return np.sort(2 * pi * np.asarray(ask(f"{cards}\n{card}", formulation).table("modes")["frequency"]))


def order(errors: list[float], finest: int = 2) -> float:
    """Of convergence, where n doubles from each error to the next."""
    return float(np.log2(errors[-finest] / errors[-1])) / (finest - 1)


# modes ---------------------------------------------------------------------------------------------------

CLAMPED = f"BEAM rod l=1 n=@ {UNIT}\nJOINT clamp 0 rod.a weld"
ENDS = {  # joints, roots of the characteristic equation (Blevins, Formulas for natural frequency and mode shape, table 8-1)
    "cantilever": ("JOINT clamp 0 rod.a weld", [1.87510407, 4.69409113, 7.85475744]),
    "pinned": ("JOINT pa 0 rod.a pin\nJOINT pb 0(1,0) rod.b pinslot axis=(1,0)", [pi, 2 * pi, 3 * pi]),
    "clamped": ("JOINT pa 0 rod.a weld\nJOINT pb 0(1,0) rod.b weld", [4.73004074, 7.85320462, 10.9956078]),
}


@BOTH
@pytest.mark.parametrize("ends", ENDS)
def test_bending_modes(ends, formulation):
    joints, roots = ENDS[ends]
    found = modes(f"BEAM rod l=1 n=8 {UNIT}\n{joints}", formulation)[:3]
    assert (abs(found / np.square(roots) - 1) < [1e-4, 1e-3, 3e-3]).all()


def test_modes_converge_with_the_fourth_order():
    errors = [abs(modes(CLAMPED.replace("@", str(n)))[1] - 4.69409113**2) for n in (2, 4, 8)]
    assert order(errors) > 3.8
    assert errors[-1] < 2e-3


@BOTH
@pytest.mark.parametrize("mass", [0.2, 1.0])
def test_a_mass_at_the_tip_of_a_cantilever(mass, formulation):
    """1 + cos b cosh b + mu b (cos b sinh b - sin b cosh b) = 0, mu the tip's mass over the beam's."""

    def zero(b: float) -> float:
        return 1 + cos(b) * cosh(b) + mass * b * (cos(b) * sinh(b) - sin(b) * cosh(b))

    cards = CLAMPED.replace("@", "8") + f"\nBODY tip m={mass}\nJOINT on rod.b tip weld"
    roots = [brentq(zero, 0.5, 1.87), brentq(zero, 3.2, 4.69)]
    np.testing.assert_allclose(modes(cards, formulation)[:2], np.square(roots), rtol=2e-4)


def test_modes_along_a_rod():
    """Clamped and free: (2k - 1) pi/2 sqrt(EA/rho A)/L."""
    found = modes("BEAM rod l=2 n=8 ei=1e4 ea=9 rhoa=1\nJOINT clamp 0 rod.a weld")
    np.testing.assert_allclose(found[:2], [1.5 * pi / 2, 4.5 * pi / 2], rtol=2e-2)


@BOTH
def test_damping_of_a_mode_is_half_its_frequency_times_d(formulation):
    r = ask("BEAM rod l=1 n=6 ei=1 ea=1e5 rhoa=1 d=1m\nJOINT clamp 0 rod.a weld\n.modes", formulation).table(
        "modes"
    )
    w, z = 2 * pi * np.asarray(r["frequency"]), np.asarray(r["damping"])
    bending = [k for k in np.argsort(w) if w[k] > 0][:4]
    assert len(bending) == 4
    for k in bending:
        undamped = w[k] / sqrt(1 - z[k] ** 2)
        assert z[k] == pytest.approx(0.5e-3 * undamped, rel=1e-6)


# at rest -------------------------------------------------------------------------------------------------


def elastica(load: float) -> tuple[float, float, float]:
    """x, y and slope of the end of a cantilever under P L^2/EI across it (Bisshopp and Drucker, Q. Appl. Math. 3, 272, 1945)."""

    def at(slope: float) -> tuple[float, float]:
        m = (1 + sin(slope)) / 2
        return m, np.arcsin(1 / sqrt(2 * m))

    def length(slope: float) -> float:
        m, start = at(slope)
        return ellipkinc(pi / 2, m) - ellipkinc(start, m) - sqrt(load)

    slope = brentq(length, 1e-9, pi / 2 - 1e-12)
    m, start = at(slope)
    y = 1 - 2 / sqrt(load) * (ellipeinc(pi / 2, m) - ellipeinc(start, m))
    return sqrt(2 * sin(slope) / load), y, slope


def bent(n: int, load: float, formulation: str = "joint", options: str = "reltol=1e-6") -> np.ndarray:
    cards = f"{CLAMPED.replace('@', str(n))}\nFORCE f rod.b dir=(0,1) {load}\n.op static\n.save x(rod.b) y(rod.b) angle(rod.b)"
    r = ask(cards, formulation, options)
    return np.array([float(r[name][-1]) for name in ("x(rod.b)", "y(rod.b)", "angle(rod.b)")])


def test_the_printed_figures_of_bisshopp_and_drucker():
    """Their table: P L^2/EI = 1, 10: deflection 0.30172, 0.81061 (Mattiasson, Int. J. Num. Meth. Eng. 17, 145, 1981)."""
    assert elastica(1.0)[1] == pytest.approx(0.30172, abs=1e-5)
    assert elastica(10.0)[1] == pytest.approx(0.81061, abs=1e-5)


@BOTH
@pytest.mark.parametrize("load", [1.0, 4.0, 10.0])
def test_a_cantilever_under_a_load_at_its_end(load, formulation):
    np.testing.assert_allclose(bent(10, load, formulation), elastica(load), rtol=2e-5)


def test_large_bending_converges_with_the_third_order_or_better():
    errors = [abs(bent(n, 10.0) - elastica(10.0)).max() for n in (2, 4, 8)]
    assert order(errors, 3) > 3.0


@pytest.mark.parametrize("reltol", [1e-3, 1e-6, 1e-9])
def test_a_rest_does_not_hang_on_the_tolerance(reltol):
    np.testing.assert_allclose(bent(6, 4.0, options=f"reltol={reltol}"), elastica(4.0), rtol=1e-4)


@BOTH
def test_a_moment_rolls_it_up_into_a_circle(formulation):
    """M = 2 pi EI/L; every element is an arc. Energy M^2 L/(2 EI)."""
    r = ask(
        f"{CLAMPED.replace('@', '8')}\nTORQUE m rod.b tau={{2*pi}}\n.op static\n"
        ".save x(rod.b) y(rod.b) angle(rod.b) torque(rod,3) force(rod,3) pe() mz(clamp)",
        formulation,
    )
    at = {name: float(r[name][-1]) for name in r.names}
    assert abs(at["x(rod.b)"]) + abs(at["y(rod.b)"]) < 1e-9
    assert at["angle(rod.b)"] == pytest.approx(2 * pi, rel=1e-9)
    assert at["torque(rod,3)"] == pytest.approx(2 * pi, rel=1e-9)
    assert abs(at["force(rod,3)"]) < 1e-5
    assert at["pe()"] == pytest.approx(2 * pi**2, rel=1e-9)
    assert abs(at["mz(clamp)"]) == pytest.approx(2 * pi, rel=1e-9)


def test_its_own_weight():
    """Level: w L^4/8 EI at the end, where that is small. Hanging: w L^2/2 EA, and its pull is what hangs below."""
    level = ask(
        "BEAM rod l=2 n=4 ei=100 ea=1e6 rhoa=0.05\nJOINT c 0 rod.a weld\n.gravity 10\n.op static\n.save y(rod.b) fy(c)"
    )
    assert float(level["y(rod.b)"][-1]) == pytest.approx(-0.5 * 2**4 / 800, rel=1e-3)
    assert abs(float(level["fy(c)"][-1])) == pytest.approx(1.0, rel=1e-6)
    hung = ask(
        "BEAM rod l=2 n=4 ei=1 ea=1e3 rhoa=0.05\nJOINT c 0 rod.a weld zero=-90deg\n.gravity 10\n"
        ".op static\n.save y(rod.b) force(rod,1)"
    )
    assert float(hung["y(rod.b)"][-1]) == pytest.approx(-2 - 0.5 * 2**2 / 2e3, rel=1e-6)
    assert float(hung["force(rod,1)"][-1]) == pytest.approx(0.5 * 1.75, rel=1e-4)


def test_the_frequency_goes_to_zero_at_eulers_load():
    """Pinned: w^2 = (pi/L)^2 ((pi/L)^2 EI - P)/rho A, less what the load shortens it."""
    joints = ENDS["pinned"][0]
    for share in (-1.0, 0.5, 0.9, 0.99):
        cards = f"BEAM rod l=1 n=8 {UNIT}\n{joints}\nFORCE f rod.b dir=(-1,0) {share * pi**2}"
        found = modes(cards, card=".modes static")[0]
        assert found == pytest.approx(pi**2 * sqrt(1 - share), rel=3e-3)


def test_above_eulers_load_a_mode_grows():
    """By sqrt(P/P_E - 1) pi^2 a second; and started a little aside it rests where the elastica has it: Timoshenko and Gere,
    Theory of elastic stability, 2.7: clamped and free, P/P_E = 1.063: 40 degrees at the end, y = 0.422 l, x = 0.881 l."""
    cards = f"BEAM rod l=1 n=8 {UNIT}\n{ENDS['pinned'][0]}\nFORCE f rod.b dir=(-1,0) {1.25 * pi**2}\n.modes static"
    assert ask(cards).table("modes")["rate"].min() == pytest.approx(-0.5 * pi**2, rel=2e-3)
    p = 4 * float(ellipkinc(pi / 2, sin(pi / 9) ** 2)) ** 2 / pi**2
    assert p == pytest.approx(1.063, abs=1e-3)
    held = f"{CLAMPED.replace('@', '8')} zero=50u\nFORCE f rod.b dir=(-1,0) {p * pi**2 / 4}\n.op static\n.save x(rod.b) y(rod.b)"
    r = ask(held)
    assert float(r["y(rod.b)"][-1]) == pytest.approx(0.422, abs=2e-3)
    assert float(r["x(rod.b)"][-1]) == pytest.approx(0.881, abs=1e-3)


# in motion -----------------------------------------------------------------------------------------------

STRIP = "BEAM strip l=1 n=@ e=5meg rho=1100 section=rect(20m,5m)\nJOINT hook 0 strip.a pin\n.gravity 9.81\n"


@BOTH
@pytest.mark.parametrize("reltol", [1e-3, 1e-6, 1e-9])
def test_a_falling_strip_keeps_its_energy(reltol, formulation):
    r = ask(
        STRIP.replace("@", "4") + ".tran 20m 0.5\n.save x(strip.b) y(strip.b)",
        formulation,
        f"reltol={reltol}",
    )
    fine = ask(
        STRIP.replace("@", "4") + ".tran 20m 0.5\n.save x(strip.b) y(strip.b)", "joint", "reltol=1e-10"
    )
    for name in ("x(strip.b)", "y(strip.b)"):
        assert float(r[name][-1]) == pytest.approx(float(fine[name][-1]), abs=10 * reltol)
    assert abs(r.energy.share) < max(reltol, 1e-9)


def test_a_falling_strip_converges_with_its_elements():
    def end(n: int) -> np.ndarray:
        r = ask(STRIP.replace("@", str(n)) + ".tran 50m 0.4\n.save x(strip.b) y(strip.b)")
        return np.array([r["x(strip.b)"][-1], r["y(strip.b)"][-1]])

    finest = end(16)
    errors = [float(abs(end(n) - finest).max()) for n in (2, 4, 8)]
    assert order(errors, 3) > 1.9
    assert errors[-1] < 3e-3


ROBOT = """.param w=2*pi/15
BEAM arm l=10 n=@ ei=14k ea=28meg rhoa=1.2
JOINT hub 0 arm.a pin
DRIVE spin hub qd={time<15 ? 0.4*(time-sin(w*time)/w) : 6}
.tran 50m 18
.save x(arm.b) y(arm.b) angle(hub)"""


def test_the_flexible_robot_arm_of_simo_and_vu_quoc():
    """J. Appl. Mech. 53, 855 (1986), spin-up: the end lags by about 0.57 m near t = 6.7 s; turning evenly at 6 rad/s it is
    longer by tan(k L)/k - L, k^2 = rho A w^2/EA (their 5.14e-4 m)."""
    w2 = 1.2 * 36.0 / 28e6
    exact = tan(sqrt(w2) * 10.0) / sqrt(w2) - 10.0
    assert exact == pytest.approx(5.14e-4, abs=5e-7)
    for n in (2, 4):
        r = ask(ROBOT.replace("@", str(n)), "absolute", "reltol=1e-5")
        x, y, a, t = (np.asarray(r[name]) for name in ("x(arm.b)", "y(arm.b)", "angle(hub)", "time"))
        lag = -x * np.sin(a) + y * np.cos(a)
        assert lag.min() == pytest.approx(-0.57, abs=5e-3)
        assert t[np.argmin(lag)] == pytest.approx(6.7, abs=0.1)
        assert abs(lag[t > 15].mean()) < 1e-3
        stretch = (x * np.cos(a) + y * np.sin(a))[t > 15].mean() - 10.0
        assert stretch == pytest.approx(exact, rel=2e-3)


@BOTH
def test_a_free_beam_keeps_momentum_and_energy(formulation):
    """Two equal ends thrown apart: the middle goes straight on, and what turns keeps its turn."""
    r = ask(
        "BEAM rod l=1 n=4 ei=1 ea=1e3 rhoa=1 x=1 y=2 angle=30deg vx=1 vy=-0.5 omega=2\n.tran 10m 1\n"
        ".save x(rod.n2) y(rod.n2) angle(rod.n2) ke() pe()",
        formulation,
    )
    t = np.asarray(r["time"])
    c, s = 0.5 * cos(pi / 6), 0.5 * sin(pi / 6)
    np.testing.assert_allclose(r["x(rod.n2)"], 1 + c + (1 - 2 * s) * t, atol=1e-5)
    np.testing.assert_allclose(r["y(rod.n2)"], 2 + s + (-0.5 + 2 * c) * t, atol=1e-5)
    assert float(r["angle(rod.n2)"][-1]) == pytest.approx(pi / 6 + 2, abs=2e-3)  # its stretch slows it
    np.testing.assert_allclose(np.asarray(r["ke()"]) + r["pe()"], r["ke()"][0], rtol=1e-8)
    assert float(r["ke()"][0]) == pytest.approx(
        0.5 * ((1 - 2 * s) ** 2 + (-0.5 + 2 * c) ** 2) + 0.5 * 4 / 12, rel=1e-9
    )


@BOTH
def test_heat_of_its_damping(formulation):
    """Let go from a bend, all of its energy becomes heat."""
    r = ask(
        f"BEAM rod l=1 n=3 {UNIT} d=0.5\nJOINT clamp 0 rod.a weld\nFORCE f rod.b dir=(0,1) PULSE(0 1 0 1u 1u 5 100)\n"
        ".tran 50m 12\n.save y(rod.b) energy()",
        formulation,
    )
    assert abs(float(r["y(rod.b)"][-1])) < 1e-3
    assert r.energy.dissipated == pytest.approx(r.energy.supplied, rel=1e-3)
    assert abs(r.energy.share) < 1e-6


CRANK = """BODY crank shape=rod(0.15) m=0.5
JOINT main 0 crank pin
DRIVE speed main qd={speed}
BEAM rod l=0.3 n=4 {stiff}
JOINT big crank(0.15,0) rod.a pin
BODY slider m=0.2 j=1m
JOINT small rod.b slider pin
JOINT guide 0(0.45,0) slider slide axis=(1,0)
.tran {{0.02/{speed}}} {{6.3/{speed}}}
.save pos(guide) angle(main) y(rod.n2) x(rod.n2) x(rod.a) y(rod.a) x(rod.b) y(rod.b)"""


@BOTH
def test_a_slider_crank_with_a_stiff_rod_is_the_rigid_one(formulation):
    r = ask(CRANK.format(speed=5, stiff="ei=100 ea=1e6 rhoa=0.01 d=1m"), formulation, "reltol=1e-5")
    a = np.asarray(r["angle(main)"])
    rigid = 0.15 * np.cos(a) + np.sqrt(0.09 - (0.15 * np.sin(a)) ** 2) - 0.45
    np.testing.assert_allclose(r["pos(guide)"], rigid, atol=2e-5)
    assert abs(r.energy.share) < 1e-5


def test_a_slider_crank_with_a_rod_that_bends():
    """The rod bends as a pinned beam under its own inertia across it, w^2 r rho A sin(phi) x/L at x from the slider:
    5/768 L^4/EI of the load at either end half-way, while its first mode is far faster."""
    speed, rhoa, ei = 30.0, 0.4, 40.0
    r = ask(CRANK.format(speed=int(speed), stiff=f"ei={ei} ea=1e6 rhoa={rhoa} d=0.3m"), options="reltol=1e-5")
    a = np.asarray(r["angle(main)"])
    ends = [np.asarray(r[f"{axis}(rod.{end})"]) for end in "ab" for axis in "xy"]
    dx, dy = ends[2] - ends[0], ends[3] - ends[1]
    mx, my = np.asarray(r["x(rod.n2)"]) - ends[0], np.asarray(r["y(rod.n2)"]) - ends[1]
    across = (dx * my - dy * mx) / np.hypot(dx, dy)
    # accelerations of both ends across the rod; between them they are linear but for the rod's own turning, which is along it
    lean = np.arctan2(dy, dx)
    acc_a = speed**2 * 0.15 * np.sin(a - lean)  # minus the crank pin's acceleration, across
    slider = np.gradient(np.gradient(np.asarray(r["pos(guide)"]), r["time"]), r["time"])
    acc_b = slider * np.sin(lean)
    load = rhoa * (acc_a + acc_b)  # the sum of both ends' loads acts half-way as 5/768 of each
    expected = 5 / 768 * load * 0.3**4 / ei
    late = np.asarray(r["time"]) > 0.05
    assert abs(across[late] - expected[late]).max() < 0.1 * abs(expected[late]).max()
    assert abs(r.energy.share) < 1e-6


# what it is made of, noise, mistakes ---------------------------------------------------------------------


@pytest.mark.parametrize(
    ("section", "area", "second"),
    [
        ("rect(20m,3m)", 60e-6, 20e-3 * 27e-9 / 12),
        ("round(4m)", pi * 4e-6, pi * 256e-12 / 64),
        ("tube(10m,1m)", pi * (100e-6 - 64e-6) / 4, pi * (1e-8 - 4.096e-9) / 64),
    ],
)
def test_sections(section, area, second):
    by_section = modes(f"BEAM r l=0.5 n=2 e=210g rho=7850 section={section}\nJOINT c 0 r.a weld")
    given = f"ei={210e9 * second} ea={210e9 * area} rhoa={7850 * area}"
    np.testing.assert_allclose(by_section, modes(f"BEAM r l=0.5 n=2 {given}\nJOINT c 0 r.a weld"), rtol=1e-12)


def test_giga_of_a_modulus_is_no_gram():
    r = ask("BEAM r l=0.5 n=2 e=210g rho=7850 section=round(4m)\nJOINT c 0 r.a weld\n.modes")
    assert not [d for d in r.diagnostics if d.code == "W112"]


def test_a_cantilever_trembles_with_kt():
    """Of the end, across: k <y^2> = k_B T, k = 3 EI/L^3 (the sum over all modes: L^3/(3 EI))."""
    r = ask(
        "BEAM lever l=100u n=2 e=170e9 rho=2330 section=rect(20u,1u) d=100n noisy=yes\nJOINT c 0 lever.a weld\n"
        "V1 a 0 0\nR1 a 0 1 noisy=0\nFORCE f lever.b dir=(1,0) {v(a)}\n.noise y(lever.b) v1 dec 200 1k 1e9"
    )
    total = float(r.table("integrated noise")["onoise_total"][0])
    k = 3 * 170e9 * 20e-6 * 1e-18 / 12 / 1e-12
    assert total**2 * k == pytest.approx(1.380649e-23 * 300.15, rel=0.02)


HELD = "JOINT c 0 rod.a weld\n.op\n"
WRONG = {
    "BEAM rod l=1 ei=1 ea=1": "E230",
    "BEAM rod l=1 ei=1 ea=1 rhoa=1 e=1": "E230",
    "BEAM rod ei=1 ea=1 rhoa=1": "E230",
    f"BEAM rod l=1 n=0 {UNIT}": "E238",
    f"BEAM rod l=1 n=2.5 {UNIT}": "E238",
    f"BEAM rod l=1 n=201 {UNIT}": "E238",
    f"BEAM rod l=-1 {UNIT}": "E238",
    "BEAM rod l=1 e=1 rho=1 section=rect(1)": "E232",
    "BEAM rod l=1 e=1 rho=1 section=tube(1,0.5)": "E232",
    "BEAM rod l=1 e=1 rho=1 section=star(1,2)": "E232",
    f"BEAM rod l=1 {UNIT}\nBODY rod.n3 m=1": "E135",
    f"BEAM rod l=1 {UNIT}\nBODY b m=1 j=(1,1,1) z=1\nSPRING s b 0 k=1": "E230",
}


@pytest.mark.parametrize("cards", WRONG)
def test_what_is_wrong_is_said_once(cards):
    with pytest.raises(emsim.DeckError) as error:
        emsim.compile(f"beam\n{cards}\n{HELD}.end\n")
    assert [d.code for d in error.value.diagnostics if d.severity == "error"] == [WRONG[cards]]


def test_in_a_subcircuit_its_nodes_bear_its_name():
    deck = (
        f".subckt blade root\nBEAM rod l=1 n=4 {UNIT}\nJOINT c root rod.a weld\n.ends\n"
        "BODY hub m=1 j=1\nJOINT h 0 hub pin\nX1 hub blade\nFORCE f x1.rod.b dir=(0,1) 1\n.tran 10m 0.1\n.save y(x1.rod.b)"
    )
    assert float(ask(deck)["y(x1.rod.b)"][-1]) > 1e-3

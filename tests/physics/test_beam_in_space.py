"""BEAM in space: bending about two axes, twist, both at once; against closed forms, published figures, an own integration."""

from __future__ import annotations

from math import pi, sin, sqrt
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import root

import emsim
from emsim import pipeline

BOTH = pytest.mark.parametrize("formulation", ["joint", "absolute"])
UNIT = "ei=1 eiy=4 gj=0.5 ea=1e6 rhoa=1"  # of length 1
CLAMPED = f"BEAM rod l=1 n=@ {UNIT}\nJOINT clamp 0 rod.a weld\n"


def ask(cards: str, formulation: str = "joint", options: str = "reltol=1e-6") -> emsim.Result:
    text = f"beam\n{cards}\n.options {options} formulation={formulation} method=radau\n.end\n"
    return pipeline.run(text, energy=True)


def last(r: emsim.Result, *names: str) -> np.ndarray:
    return np.array([float(r[name][-1]) for name in names])


def modes(cards: str, formulation: str = "joint", card: str = ".modes") -> np.ndarray:
    """rad/s, from the lowest."""
    r = ask(f"{cards}\n{card}\n.save x(rod.b)", formulation)
    return np.sort(2 * pi * np.asarray(r.table("modes")["frequency"]))


# modes ---------------------------------------------------------------------------------------------------


@BOTH
def test_it_bends_about_both_axes_and_twists(formulation):
    """1.875^2, 4.694^2 about z, twice that about y; torsion (k - 1/2) pi sqrt(GJ/rho Ip), rho Ip = rhoa (EIz + EIy)/EA."""
    found = modes(CLAMPED.replace("@", "4").replace("ea=1e6", "ea=1e3"), formulation)
    bending = np.square([1.87510407, 4.69409113])
    twist = pi / 2 * sqrt(0.5 / (5 / 1e3))
    exact = sorted([*bending, *2 * bending, twist])
    of_twist = exact.index(twist)
    assert found[of_twist] == pytest.approx(twist, rel=7e-3)  # of second order
    np.testing.assert_allclose(np.delete(found[:5], of_twist), np.delete(exact, of_twist), rtol=1.5e-3)


def test_its_torsion_converges_with_the_second_order():
    exact, errors = 0.5 * pi * sqrt(0.5 / 5e-4), []
    for n in (1, 2, 4):
        found = modes(CLAMPED.replace("@", str(n)).replace("ea=1e6", "ea=1e4"))
        errors.append(float(abs(found / exact - 1).min()))
    assert errors[0] / errors[2] > 12.0
    assert errors[2] < 7e-3


@pytest.mark.parametrize(
    ("section", "constant"),
    [
        ("round(4m)", pi * 4e-3**4 / 32),
        ("tube(10m,1m)", pi * (1e-8 - 4.096e-9) / 32),
        ("rect(10m,10m)", 0.1406 * 1e-8),  # Timoshenko and Goodier, Theory of elasticity, table in art. 109
        ("rect(20m,10m)", 0.229 * 2e-8),
        ("rect(10m,40m)", 0.281 * 4e-8),
    ],
)
def test_a_moment_twists_a_section(section, constant):
    r = ask(
        f"BEAM r l=0.5 n=2 e=200g g=80g rho=7850 section={section}\nJOINT c 0 r.a weld\nTORQUE t r.b axis=(1,0,0) tau=2\n"
        ".op static\n.save z(r.b(0,1,0)) y(r.b(0,1,0)) mx(r,1) my(r,1)"
    )
    angle = float(np.arctan2(r["z(r.b(0,1,0))"][-1], r["y(r.b(0,1,0))"][-1]))
    assert angle == pytest.approx(2 * 0.5 / (80e9 * constant), rel=2e-3)
    np.testing.assert_allclose(last(r, "mx(r,1)", "my(r,1)"), [2.0, 0.0], atol=1e-8)


def test_damping_of_a_twisting_mode_is_half_its_frequency_times_d():
    r = ask(CLAMPED.replace("@", "2").replace("ea=1e6", "ea=100 d=1m") + ".modes\n.save x(rod.b)").table(
        "modes"
    )
    w, z = 2 * pi * np.asarray(r["frequency"]), np.asarray(r["damping"])
    swings = w > 0
    np.testing.assert_allclose(z[swings], 0.5e-3 * w[swings] / np.sqrt(1 - z[swings] ** 2), rtol=1e-6)


# at rest -------------------------------------------------------------------------------------------------


@BOTH
def test_it_bends_out_of_the_plane_as_in_it(formulation):
    """Bisshopp and Drucker: P L^2/EI = 10: 0.81061 across, 0.44500 along (Mattiasson, Int. J. Num. Meth. Eng. 17, 145, 1981)."""
    r = ask(
        CLAMPED.replace("@", "8")
        + "FORCE f rod.b dir=(0,0,1) 40\n.op static\n.save x(rod.b) y(rod.b) z(rod.b)",
        formulation,
    )
    np.testing.assert_allclose(
        last(r, "x(rod.b)", "y(rod.b)", "z(rod.b)"), [0.44500, 0.0, 0.81061], atol=4e-5
    )


def kirchhoff(
    force: np.ndarray, moment: np.ndarray, stiff: np.ndarray, ea: float
) -> tuple[np.ndarray, np.ndarray]:
    """End and axes there of a clamped rod of length 1: r' = R e1 (1 + n1/EA), R' = R [kappa]x, kappa = K^-1 R^T m, m' = f x r',
    by shooting for the moment at the clamp, under loads that grow."""

    def turned(q: np.ndarray) -> np.ndarray:
        w, x, y, z = q / np.linalg.norm(q)
        return np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )

    def end(start: np.ndarray, f: np.ndarray) -> np.ndarray:
        def slope(_: float, u: np.ndarray) -> np.ndarray:
            q, m = u[3:7], u[7:]
            r = turned(q)
            k = (r.T @ m) / stiff
            along = r[:, 0] * (1 + (r[:, 0] @ f) / ea)
            rate = 0.5 * np.array([-q[1:] @ k, *(q[0] * k + np.cross(q[1:], k))])
            return np.concatenate([along, rate, np.cross(f, along)])

        first = np.concatenate([[0, 0, 0, 1, 0, 0, 0], start])
        return solve_ivp(slope, (0, 1), first, "DOP853", rtol=1e-11, atol=1e-12).y[:, -1]

    start = np.zeros(3)
    for share in np.linspace(0.1, 1.0, 10):
        start = root(lambda s, a=share: end(s, a * force)[7:] - a * moment, start, tol=1e-11).x
    found = end(start, force)
    return found[:3], turned(found[3:7])


FORCES, TORQUES = np.array([1.0, 3.0, 2.0]), np.array([0.8, -0.6, 0.5])


def test_bent_and_twisted_by_forces_and_moments_it_converges_to_kirchhoffs_rod():
    place, axes = kirchhoff(FORCES, TORQUES, np.array([0.5, 4.0, 1.0]), 1e3)
    parts = [f"{axis}(rod.b{local})" for local in ("", "(0,1,0)") for axis in "xyz"]
    errors = []
    for n in (2, 4, 8):
        cards = CLAMPED.replace("@", str(n)).replace("ea=1e6", "ea=1e3")
        cards += "FORCE f rod.b fx=1 fy=3 fz=2\n"
        cards += "".join(f"TORQUE t{k} rod.b axis={axis} tau={tau}\n" for k, (axis, tau) in enumerate(
            zip(("(1,0,0)", "(0,1,0)", "(0,0,1)"), TORQUES, strict=True)))  # fmt: skip
        found = last(ask(cards + f".op static\n.save {' '.join(parts)}"), *parts)
        errors.append(float(abs(found - np.concatenate([place, place + axes[:, 1]])).max()))
    assert errors[2] < 1e-3
    assert errors[0] / errors[2] > 12.0


ARC = "BEAM bend l={l!r} arc=45deg n={n} ei={ei!r} ea=1e7 rhoa=1 gj={gj!r}\nJOINT j 0 bend.a weld\n"
ARC += "FORCE f bend.b dir=(0,0,1) {p}\n"


@BOTH
def test_the_bend_of_bathe_and_bolourchi(formulation):
    """Int. J. Num. Meth. Eng. 14, 961 (1979): an eighth of a circle of radius 100, section 1 by 1, E = 1e7, nu = 0, 600 across:
    the end is at 47.2, 15.9, 53.4; at 47.23, 15.79, 53.37 of Simo and Vu-Quoc (Comp. Meth. Appl. Mech. Eng. 58, 79, 1986)."""
    cards = ARC.format(l=25 * pi, n=8, ei=1e7 / 12, gj=5e6 / 6, p=600)
    r = ask(f"{cards}.op static\n.save x(bend.b) y(bend.b) z(bend.b)", formulation)
    np.testing.assert_allclose(last(r, "x(bend.b)", "y(bend.b)", "z(bend.b)"), [47.2, 15.75, 53.4], atol=0.12)


def test_a_small_load_across_an_arc():
    """Castigliano: P R^3 (int sin^2/EI + int (1 - cos)^2/GJ) over 45 degrees; the arc starts where it should."""
    ei, gj, p = 1e7 / 12, 4e5, 1e-3
    s2, c2 = pi / 8 - 0.25, 3 * pi / 8 - 2 * sin(pi / 4) + 0.25
    r = ask(
        f"{ARC.format(l=25 * pi, n=16, ei=ei, gj=gj, p=p)}.op static\n.save x(bend.b) y(bend.b) z(bend.b)"
    )
    assert float(r["z(bend.b)"][-1]) == pytest.approx(p * 1e6 * (s2 / ei + c2 / gj), rel=1e-3)
    half = sqrt(0.5)
    np.testing.assert_allclose(last(r, "x(bend.b)", "y(bend.b)"), [100 * half, 100 * (1 - half)], rtol=1e-9)


@pytest.mark.parametrize("space", ["", " gj=1"])
def test_a_moment_makes_an_arc_straight(space):
    r = ask(
        f"BEAM rod l=1 arc=1.2 n=8 ei=1 ea=1e6 rhoa=1{space}\nJOINT c 0 rod.a weld\nTORQUE t rod.b tau=-1.2\n.op static\n"
        ".save x(rod.b) y(rod.b) torque(rod,2) pe()"
    )
    np.testing.assert_allclose(last(r, *r.names[-4:]), [1.0, 0.0, -1.2, 0.72], atol=1e-6)


def test_a_deep_strip_topples_sideways_at_prandtls_load():
    """Clamped, a load across its end: P = 4.013 sqrt(EIy GJ)/L^2 (Timoshenko and Gere, Theory of elastic stability, 6.3)."""
    critical = 4.013 * sqrt(0.01 * 0.02)
    lowest = {}
    for share in (0.0, 0.9, 1.1):
        cards = "BEAM rod l=1 n=6 ei=100 eiy=0.01 gj=0.02 ea=1e6 rhoa=1\nJOINT c 0 rod.a weld\n"
        cards += f"FORCE f rod.b dir=(0,1,0) {share * critical}\n.modes static\n.save z(rod.b)"
        table = ask(cards).table("modes")
        lowest[share] = (float(np.asarray(table["frequency"]).min()), float(np.asarray(table["rate"]).min()))
    assert lowest[0.0][0] == pytest.approx(1.87510407**2 * 0.1 / (2 * pi), rel=1e-4)
    assert 0.0 < lowest[0.9][0] < 0.6 * lowest[0.0][0]
    assert lowest[0.9][1] > -1e-3
    assert lowest[1.1][1] < -0.05


# in motion -----------------------------------------------------------------------------------------------


def test_turning_makes_a_blade_stiffer():
    """Flapping of a beam that turns about its clamp at eta sqrt(EI/rhoa)/L^2: 3.5160, 4.1373 (eta = 2), 6.4495 (eta = 5): Wright,
    Smith, Thresher and Wang, J. Appl. Mech. 49, 197 (1982)."""
    for eta, exact in ((0.0, 3.5160), (2.0, 4.1373), (5.0, 6.4495)):
        cards = (
            "BEAM rod l=1 n=4 ei=1 gj=1 ea=1e4 rhoa=1 d=1m\nBODY hub m=1 j=(1,1,1)\nJOINT spin 0 hub pin\n"
        )
        cards += f"JOINT root hub rod.a weld\nDRIVE turn spin qd={eta}\n"
        cards += "FORCE f rod.b dir=(0,0,1) PULSE(0 0.01 0 10m 10m 0.4 100)\n.tran 2m 10\n.save z(rod.b)"
        r = ask(cards, options="reltol=1e-5")
        t, z = np.asarray(r["time"]), np.asarray(r["z(rod.b)"])
        late = np.flatnonzero((t[1:] > 2.0) & (np.sign(z[1:]) != np.sign(z[:-1])))
        at = t[late] - z[late] * (t[late + 1] - t[late]) / (z[late + 1] - z[late])
        assert pi * (len(at) - 1) / (at[-1] - at[0]) == pytest.approx(exact, rel=2e-3)


TUMBLING = (
    "BEAM rod l=1 n=3 ei=1 eiy=2 gj=0.5 ea=1e3 rhoa=1 x=1 y=2 z=3 rot=(0.3,0.2,0.5) vx=1 vy=-0.5 vz=0.2 omega=(1,2,3)\n"
    ".tran 10m 1\n.save x(rod.a) y(rod.a) z(rod.a) x(rod.b) y(rod.b) z(rod.b) ke() pe()"
)


@pytest.mark.parametrize("reltol", [1e-3, 1e-6])
def test_thrown_into_space_it_keeps_its_energy(reltol):
    """In both coordinates the same; at the start its energy is that of a rigid rod."""
    joint, absolute = (ask(TUMBLING, f, f"reltol={reltol}") for f in ("joint", "absolute"))
    assert float(joint["ke()"][0]) == pytest.approx(float(absolute["ke()"][0]), rel=1e-12)
    for r in (joint, absolute):
        total = np.asarray(r["ke()"]) + r["pe()"]
        np.testing.assert_allclose(total, total[0], rtol=max(10 * reltol, 1e-6))
        assert abs(r.energy.share) < 10 * reltol
    ends = [f"{axis}(rod.{end})" for end in "ab" for axis in "xyz"]
    np.testing.assert_allclose(last(joint, *ends), last(absolute, *ends), atol=30 * reltol)


HUNG = (
    "BEAM strip l=1 n={n} e=5meg g=2meg rho=1100 section=rect(20m,5m)\nJOINT hook 0 strip.a pin\n.gravity 9.81\n"
    "FORCE push strip.b dir=(0,0,1) PULSE(0 0.1 0 1m 1m 0.1 100)\n.tran 20m 0.4\n.save x(strip.b) y(strip.b) z(strip.b)"
)


def test_a_falling_strip_that_is_pushed_aside():
    """Both coordinates, energy with what the push supplies, and elements."""
    names = [f"{axis}(strip.b)" for axis in "xyz"]
    joint, absolute = (ask(HUNG.format(n=4), f) for f in ("joint", "absolute"))
    np.testing.assert_allclose(last(joint, *names), last(absolute, *names), atol=1e-5)
    assert abs(joint.energy.share) < 1e-6
    assert joint.energy.supplied > 1e-4
    finest = last(ask(HUNG.format(n=12), "absolute"), *names)
    errors = [float(abs(last(ask(HUNG.format(n=n)), *names) - finest).max()) for n in (2, 4, 8)]
    assert errors[0] > 3 * errors[1] > 9 * errors[2]


def test_the_deck_of_a_fishing_rod_in_both_coordinates():
    deck = (
        (Path(__file__).parents[2] / "netlists/mechanical/fishing_rod.cir")
        .read_text()
        .replace(".tran 10m 2", ".tran 10m 1")
    )
    deck = deck.replace(".save all", ".save")
    found = [
        pipeline.run(deck + f".options reltol=1e-6 formulation={f}\n", energy=True)
        for f in ("joint", "absolute")
    ]
    names = [f"{axis}(rod.b)" for axis in "xyz"]
    np.testing.assert_allclose(last(found[0], *names), last(found[1], *names), atol=1e-4)
    for r in found:
        assert abs(r.energy.share) < 1e-6


def test_in_the_plane_it_moves_as_the_beam_of_the_plane():
    flat = (
        HUNG.replace(" g=2meg", "").format(n=4).replace("dir=(0,0,1)", "dir=(1,0)").replace(" z(strip.b)", "")
    )
    deep = HUNG.format(n=4).replace("dir=(0,0,1)", "dir=(1,0)")
    names = ("x(strip.b)", "y(strip.b)")
    np.testing.assert_allclose(last(ask(flat), *names), last(ask(deep), *names), atol=1e-4)


# mistakes ------------------------------------------------------------------------------------------------

WRONG = {
    "BEAM rod l=1 ei=1 ea=1 rhoa=1 g=1": "E230",  # with e= rho= section=
    "BEAM rod l=1 e=1 rho=1 section=round(1) gj=1": "E230",
    "BEAM rod l=1 ei=1 ea=1 rhoa=1 eiy=1": "E230",  # how stiff it is in twisting
    f"BEAM rod l=1 {UNIT} gj=-1": "E238",
    f"BEAM rod l=1 n=2 arc=3 {UNIT}": "E238",
}


@pytest.mark.parametrize("cards", WRONG)
def test_what_is_wrong_in_space_is_said_once(cards):
    cards = cards.replace("gj=0.5 ea=1e6 rhoa=1 gj=-1", "gj=-1 ea=1e6 rhoa=1")
    with pytest.raises(emsim.DeckError) as error:
        emsim.compile(f"beam\n{cards}\nJOINT c 0 rod.a weld\n.op\n.end\n")
    assert [d.code for d in error.value.diagnostics if d.severity == "error"] == [WRONG.get(cards, "E238")]


@pytest.mark.parametrize(("start", "numbers"), [("z=0", "1,2,0"), ("vz=1", "1,2,0,0,0,0")])
def test_a_joint_that_is_free_in_both_coordinates(start, numbers):
    """In the plane and in space it has its own kind, and starts where it is said."""
    deck = f"BODY a m=1 j=(1,1,1) {start}\nBODY b m=1 j=(1,1,1)\nJOINT f a b free ic=({numbers})\n.tran 0.1 1\n.save x(b) y(b)"
    for formulation in ("joint", "absolute"):
        np.testing.assert_allclose(last(ask(deck, formulation), "x(b)", "y(b)"), [1.0, 2.0], atol=1e-9)

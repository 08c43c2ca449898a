"""Free bodies leave the plane where something pushes them out of it, and tumble as Euler says; a screw's closed form."""

from __future__ import annotations

from math import cos, pi

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from support import ROOT

import emsim

TIGHT = ".tran 10m @\n.options reltol=1e-10\n.end\n"
BODY = "free\nBODY b m=2 j=(1,2,3) "


def test_a_force_out_of_the_plane_is_not_ignored() -> None:
    """It read z = 0 after a second, exit code 0."""
    found = emsim.run(BODY + "\nFORCE f b dir=(0,0,1) 1\n" + TIGHT.replace("@", "1"))
    assert found.at("z(b)", 1.0) == pytest.approx(0.25, rel=1e-9)


def test_an_offset_force_makes_it_tumble() -> None:
    found = emsim.run(BODY + "\nFORCE f b(0.1,0) dir=(0,0,1) 1\n" + TIGHT.replace("@", "1m"))
    assert found.at("wy(b)", 1e-3) == pytest.approx(-0.1 / 2 * 1e-3, rel=1e-6)


def test_a_torque_about_x_turns_it() -> None:
    found = emsim.run(BODY + "\nTORQUE t b tau=2 axis=(1,0,0)\n" + TIGHT.replace("@", "1"))
    assert found.at("wx(b)", 1.0) == pytest.approx(2.0, rel=1e-9)


def test_a_spring_along_z_pulls() -> None:
    found = emsim.run(BODY + "z=1\nSPRING s 0 b k=8 l0=0.5\n" + TIGHT.replace("@", "1"))
    assert found.at("z(b)", 1.0) == pytest.approx(0.5 + 0.5 * cos(2.0), rel=1e-7)


def test_a_spring_between_points_off_the_plane_is_not_flat() -> None:
    found = emsim.run(BODY + "\nSPRING s 0(0,0,1) b k=8 l0=0.5\n" + TIGHT.replace("@", "1"))
    assert found.at("z(b)", 1.0) == pytest.approx(0.5 - 0.5 * cos(2.0), rel=1e-7)


def test_gravity_along_z_and_a_start_in_space() -> None:
    text = (
        BODY
        + "z=1 vz=2 vx=3 rot=(0.3,0.2,0.1) omega=(0.2,1,0.1)\n.gravity 0 0 -9.81\n"
        + TIGHT.replace("@", "2")
    )
    found = emsim.run(text)
    assert found.at("z(b)", 2.0) == pytest.approx(1 + 4 - 0.5 * 9.81 * 4, rel=1e-10)
    assert found.at("x(b)", 2.0) == pytest.approx(6.0, rel=1e-10)


def test_a_symmetric_body_precesses_as_the_closed_form_says() -> None:
    """J1 = J2 = 1, J3 = 3, free of torque: wx, wy turn with W = (J3 - J1)/J1 w3."""
    found = emsim.run("top\nBODY b m=1 j=(1,1,3) omega=(0.3,0,2)\n" + TIGHT.replace("@", "10"))
    t, rate = np.asarray(found.time), 2.0 * 2.0
    assert np.abs(np.asarray(found["wx(b)"]) - 0.3 * np.cos(rate * t)).max() < 1e-9
    assert np.abs(np.asarray(found["wy(b)"]) - 0.3 * np.sin(rate * t)).max() < 1e-9


def test_the_middle_axis_is_unstable_and_momentum_is_kept() -> None:
    """Euler's equations by another integrator; momentum in the world to the tolerance."""
    found = emsim.run("racket\nBODY b m=1 j=(1,2,3) omega=(0.01,2,0.01)\n" + TIGHT.replace("@", "10"))

    def euler(t, w):
        return [(2 - 3) * w[1] * w[2] / 1, (3 - 1) * w[2] * w[0] / 2, (1 - 2) * w[0] * w[1] / 3]

    want = solve_ivp(euler, (0, 10), [0.01, 2, 0.01], rtol=1e-12, atol=1e-13, method="DOP853").y[:, -1]
    got = [found.at(f"w{k}(b)", 10.0) for k in "xyz"]
    assert got == pytest.approx(list(want), abs=2e-8)
    e = np.array([np.asarray(found[f"e{k}(b)"]) for k in range(4)])
    assert np.abs((e * e).sum(0) - 1.0).max() < 1e-9


def test_a_free_joint_in_space_is_the_same_as_a_free_body() -> None:
    ends = ".gravity 0 0 -9.81\n.tran 10m 1\n.options reltol=1e-9\n.save z(b) y(b.com)\n.end\n"
    free = emsim.run("a\nBODY b m=2 j=(1,2,3) com=(0.1,0,0) z=1 vx=0.3 omega=(0.2,1,0.1)\n" + ends)
    joint = emsim.run(
        "a\nBODY b m=2 j=(1,2,3) com=(0.1,0,0)\nJOINT f 0 b free ic=(0,0,1,0,0,0,0.3,0,0,0.2,1,0.1)\n" + ends
    )
    for name in ("z(b)", "y(b.com)"):
        assert free.at(name, 1.0) == pytest.approx(joint.at(name, 1.0), abs=1e-9)


def test_a_free_body_about_a_point_that_is_not_its_centre_keeps_its_energy() -> None:
    text = (
        "a\nBODY b m=2 j=(1,2,3) com=(0.1,0.2,0.3) omega=(0.2,1,0.1)\n.gravity 0 -9.81 0\n"
        + TIGHT.replace("@", "3")
    )
    found = emsim.run(text)
    assert found.energy.balanced and found.energy.share < 1e-9


def test_a_planar_free_body_stays_one() -> None:
    found = emsim.run("p\nBODY b m=1 j=1 vx=1 omega=2\n.gravity 9.81\n.tran 1m 1\n.end\n")
    assert "angle(b)" in found.names and "z(b)" not in found.names


def test_an_inertia_about_z_alone_is_not_enough_in_space() -> None:
    with pytest.raises(emsim.DeckError) as error:
        emsim.run("p\nBODY b m=1 j=1\nFORCE f b dir=(0,0,1) 1\n.tran 1m 1\n.end\n")
    assert error.value.diagnostics[0].code == "E248"


def test_a_free_joint_in_space_wants_six_numbers() -> None:
    with pytest.raises(emsim.DeckError) as error:
        emsim.run(
            "p\nBODY b m=1 j=(1,1,1)\nJOINT f 0 b free ic=(0,0,0)\n.gravity 0 0 -9.81\n.tran 1m 1\n.end\n"
        )
    assert error.value.diagnostics[0].code == "E232"


# screws

NUT = "screw\nBODY nut m=2 j=(0.001,0.001,0.001)\n"
SCREW = NUT + "JOINT s 0 nut screw axis=(0,0,1) lead=20m\nFRICTION f s fc=@\n.gravity 0 0 -9.81\n"


def test_a_nut_falls_on_its_screw_against_friction() -> None:
    """refs screw_drop: (m k^2 + J) q'' = -m g k + fc, k = lead/2 pi."""
    k = 0.02 / (2 * pi)
    found = emsim.run(
        SCREW.replace("@", "10m") + ".tran 10m 2\n.options reltol=1e-9\n.save angle(s) z(nut)\n.end\n"
    )
    turned = -0.5 * (2 * 9.81 * k - 0.01) / (2 * k * k + 0.001) * 4.0
    assert found.at("angle(s)", 2.0) == pytest.approx(turned, rel=1e-9)
    assert found.at("z(nut)", 2.0) == pytest.approx(k * turned, rel=1e-9)
    assert found.at("angle(s)", 0.01) == pytest.approx(-0.00257053015195, rel=1e-6)


def test_a_screw_holds_from_m_g_lead_by_2_pi_on() -> None:
    for fc, holds in (("62.453m", True), ("62.452m", False)):
        found = emsim.run(SCREW.replace("@", fc) + ".tran 10m 2\n.end\n")
        assert (found.at("omega(s)", 2.0) == 0.0) is holds


def test_a_screw_without_a_lead_is_told() -> None:
    with pytest.raises(emsim.DeckError) as error:
        emsim.run("s\nBODY nut m=2\nJOINT s 0 nut screw\n.tran 1m 1\n.end\n")
    assert "lead=" in error.value.diagnostics[0].message


def test_the_page_of_joints_knows_the_screw() -> None:
    from emsim.cards.joints import KINDS

    assert "screw" in KINDS and (ROOT / "emsim/cards/joints/screw.py").exists()

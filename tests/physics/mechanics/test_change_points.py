"""Linkages at their change points, where links lie in one line and a loop could go on in two ways."""

from __future__ import annotations

import numpy as np
import pytest

import emsim
from emsim.assemble import start

LINKS = """toggle of two equal links, its end block pushed by a prescribed motion, starts stretched
BODY a shape=rod(0.1) m=0.1
BODY b shape=rod(0.1) m=0.1
BODY blk m=0.1 j=1u
"""
PINS = "JOINT p 0 a pin\nJOINT k a(0.1,0) b pin\nJOINT e b(0.1,0) blk pin\n"
SLIDE = "JOINT s 0 blk slide axis=(1,0)\n"
PUSHED = "DRIVE d s q={0.2-0.01*(1-cos(3*time))}\n"
TOGGLE = {"slide cut": LINKS + PINS + SLIDE + PUSHED, "slide first": LINKS + SLIDE + PINS + PUSHED}


def run(deck: str, tran: str, options: str = "", save: str = ""):
    r = emsim.run(f"{deck}.options reltol=1e-3 {options}\n.tran {tran}\n.save all {save}\n.end")
    return r, {name: np.asarray(r[name]) for name in r.main.names}


@pytest.mark.parametrize("method", ["method=auto", "method=dop853", "method=rk45"])
@pytest.mark.parametrize("order", TOGGLE)
def test_a_driven_toggle_that_starts_stretched_is_closed_at_every_row(order, method):
    """The row of its drive vanishes at the start alone. 0.2 cos(angle) = pos, so at the start omega = +-sqrt(0.45)."""
    r, at = run(TOGGLE[order], "10m 1", method, "x(blk) y(blk) x(b(0.1,0)) y(b(0.1,0)) x(a(0.1,0)) x(b)")
    wanted = 0.2 - 0.01 * (1 - np.cos(3 * at["time"]))
    assert at["pos(s)"] == pytest.approx(wanted, abs=1e-6)
    assert at["pos(s)"][-1] == pytest.approx(0.1801, abs=1e-5)
    assert at["x(b(0.1,0))"] == pytest.approx(at["x(blk)"], abs=1e-6)
    assert at["y(b(0.1,0))"] == pytest.approx(0.0, abs=1e-6)
    assert at["x(a(0.1,0))"] == pytest.approx(at["x(b)"], abs=1e-6)
    assert np.cos(at["angle(p)"]) == pytest.approx(wanted / 0.2, abs=5e-6)
    assert abs(at["omega(p)"][0]) == pytest.approx(np.sqrt(0.45), rel=1e-6)
    (told,) = [d for d in r.diagnostics if d.code == "W233"]
    assert "angle(p) = 0" in told.message and "omega(p) = " in told.message  # the pose, and the way it goes


def test_a_row_left_out_that_opens_later_is_told(monkeypatch):
    monkeypatch.setattr(start, "LATER", ())  # every row that is dependent at the start is left out
    r, _ = run(TOGGLE["slide first"], "10m 1", "method=dop853")
    (told,) = [d for d in r.diagnostics if d.code == "W413"]
    assert "closed by e has come open" in told.message


COUPLING = """coupling rod of a locomotive, one side only
BODY w1 shape=disc(0.5) m=10
BODY w2 shape=disc(0.5) m=10
BODY rod shape=rod(2) m=3
JOINT a1 0 w1 pin ic=0.4
JOINT a2 0(2,0) w2 pin guess=0.4
JOINT k w1(0.3,0) rod pin guess=-0.4
JOINT e rod(2,0) w2(0.3,0) pin
DRIVE d a1 qd={5}
"""


@pytest.mark.parametrize(
    "options", ["", "method=dop853", "method=rk45", "method=radau", "method=gear", "method=trbdf2"]
)
def test_a_driven_coupling_rod_keeps_its_branch_through_the_dead_centres(options):
    _, at = run(COUPLING, "5m 3", options, "torque(d)")
    assert at["angle(a2)"] == pytest.approx(at["angle(a1)"], abs=1e-4)
    assert at["torque(d)"] == pytest.approx(0.0, abs=1e-2)  # of 360 J at 5 rad/s


CRANK = """in-line slider-crank from its dead centre
BODY crank m=0.1 shape=rod(0.04)
BODY rod m=0.1 shape=rod(0.04)
BODY pis m=0.2 j=1e-5
JOINT a 0 crank pin
JOINT b crank(0.04,0) rod pin
JOINT c rod(0.04,0) pis pin
JOINT s 0 pis slide axis=(1,0)
DRIVE d a q={10*time}
"""


@pytest.mark.parametrize("options", ["", "method=dop853", "method=rk45", "method=radau", "method=trbdf2"])
def test_a_driven_slider_crank_of_equal_links_goes_through_its_centre(options):
    """x = 2 r cos q. Its one closure row in metres vanishes when the piston is at the shaft: there is no other to compare."""
    _, at = run(CRANK, "5m 1", options, "x(pis)")
    assert at["x(pis)"] == pytest.approx(0.08 * np.cos(10 * at["time"]), abs=1e-5)


@pytest.mark.parametrize(
    "drive", ["q={2.2+1.6*time}", "q={2.1+15.6*time}", "q={2.1-17.5*time}", "q={1.1+3.6*sin(19*time)}"]
)
@pytest.mark.parametrize("cut", ["e", "k", "a2"])
def test_auto_stays_with_what_keeps_the_branch_of_a_driven_parallelogram(drive, cut):
    """Its implicit methods have a singular matrix at the dead centres; handed over there, they left the branch."""
    deck = COUPLING.replace("ic=0.4", "").replace("guess=0.4", f"guess={drive[3:6]}").replace("qd={5}", drive)
    deck = deck.replace("guess=-0.4", f"guess=-{drive[3:6]}")
    deck = (
        "\n".join(
            f"{line} cut=yes" if line.startswith(f"JOINT {cut} ") else line for line in deck.splitlines()
        )
        + "\n"
    )
    _, at = run(deck, "5m 3", "", "angle(a1) angle(a2)")
    apart = at["angle(a2)"] - at["angle(a1)"]
    assert apart - apart[0] == pytest.approx(0.0, abs=1e-2)
    assert np.cos(apart[0]) == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("method", ["radau", "radau5", "esdirk", "trbdf2", "gear", "trap", "gauss4"])
@pytest.mark.parametrize("order", TOGGLE)
def test_an_implicit_method_that_cannot_start_there_names_pose_and_loop(order, method):
    with pytest.raises(emsim.ConvergenceError) as error:
        run(TOGGLE[order], "10m 1", f"method={method}")
    assert "starts at a change point (" in str(error.value) and "the loop of joints" in str(error.value)


def driven(cut: str, drive: str) -> str:
    deck = COUPLING.replace("ic=0.4", "").replace("guess=0.4", f"guess={drive[3:6]}").replace("qd={5}", drive)
    deck = deck.replace("guess=-0.4", f"guess=-{drive[3:6]}")
    lines = [f"{line} cut=yes" if line.startswith(f"JOINT {cut} ") else line for line in deck.splitlines()]
    return "\n".join(lines) + "\n"


# each method at each cut, each drive and both tolerances; every pair of a cut and a drive
CUTS = ("e", "k", "a2")
DRIVES = (("q={2.2+1.6*time}", "5m 3"), ("q={2.1+15.6*time}", "5m 1"), ("q={1.1+3.6*sin(19*time)}", "5m 1"))
GOES_THROUGH = [
    (method, CUTS[k], *DRIVES[(k + m + loose) % 3], "1e-3" if loose else "1e-5")
    for m, method in enumerate(["radau", "radau5", "esdirk", "trbdf2", "gear", "trap"])
    for k in range(3)
    for loose in range(2)
]


@pytest.mark.parametrize(("method", "cut", "drive", "tran", "reltol"), GOES_THROUGH)
def test_an_implicit_method_keeps_the_branch_of_a_driven_parallelogram(method, cut, drive, tran, reltol):
    """They went over to the other branch at a dead centre, some by turns of 1e8 rad, with a warning and exit code 0."""
    _, at = run(driven(cut, drive), tran, f"method={method} reltol={reltol}")
    apart = at["angle(a2)"] - at["angle(a1)"]
    assert apart == pytest.approx(apart[0], abs=5e-3)


@pytest.mark.parametrize("drive", ["q={2.2+1.6*time}", "q={2.1+15.6*time}"])
@pytest.mark.parametrize("cut", ["e", "k"])
def test_gauss_whose_forces_ring_behind_a_dead_centre_stops_by_name(cut, drive):
    """The torque of the drive came to 1e12 N m, with a warning and exit code 0."""
    with pytest.raises(emsim.ConvergenceError) as error:
        run(driven(cut, drive), "5m 3", "method=gauss4")
    said = str(error.value)
    assert "gauss" in said or ("the loop of joints" in said and "angle(" in said)


def test_a_loop_that_is_pushed_farther_than_its_links_reach_names_pose_and_loop():
    with pytest.raises(emsim.ConvergenceError) as error:
        run(TOGGLE["slide cut"].replace("0.2-0.01*(1-cos(3*time))", "0.2-0.3*(1-cos(3*time))"), "10m 2", "")
    said = str(error.value)
    assert "the loop of joints" in said and "change point" in said and "angle(" in said


@pytest.mark.parametrize("method", ["auto", "dop853", "rk45", "radau", "esdirk", "trbdf2", "gear", "trap"])
@pytest.mark.parametrize("cut", ["e", "k", "a2"])
def test_forces_of_a_row_at_the_dead_centre_are_limits(cut, method):
    """At 0.12 s, a row of the print grid, all links lie in one line: 1e14 N or 0 N stood there, 2e7 N m for none. The rod
    goes round with the wheels, and the pin at its end has half of what holds it: 3 kg 0.3 m (17.5 rad/s)^2 / 2."""
    deck = driven(cut, "q={2.1-17.5*time}")
    _, at = run(deck, "5m 0.3", f"method={method}", "torque(d) fx(e) fy(e)")
    k = int(np.abs(at["time"] - 0.12).argmin())
    force = np.hypot(at["fx(e)"], at["fy(e)"])
    assert force[k - 1 : k + 2] == pytest.approx(3 * 0.3 * 17.5**2 / 2, rel=5e-3)
    assert at["torque(d)"] == pytest.approx(0.0, abs=3.0)  # of 689 J of motion

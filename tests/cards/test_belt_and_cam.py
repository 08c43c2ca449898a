"""BELT and CAM: closed forms, energy, lift-off, messages."""

from __future__ import annotations

from math import sqrt

import numpy as np
import pytest

import emsim

PULLEYS = "belt\nBODY a m=1 j=1m\nBODY b m=1 j=4m\nJOINT p 0 a pin ic=(0,@)\nJOINT q 0(0.3,0) b pin\n"


def test_a_pretensioned_belt_is_a_spring_of_both_strands() -> None:
    """Two inertias on a spring 2 k of the belt's way: w^2 = 2 k (r1^2/J1 + r2^2/J2)."""
    text = (
        PULLEYS.replace("@", "0.1")
        + "BELT x p q r1=20m r2=40m k=10k f0=20\n.tran 0.1m 0.2\n.options reltol=1e-9\n.end\n"
    )
    found = emsim.run(text)
    w = sqrt(2e4 * (0.02**2 / 1e-3 + 0.04**2 / 4e-3))
    # the stretch s = r1 q1 - r2 q2 swings as sin, from s' = r1 0.1
    t = np.asarray(found.time)
    s = 0.02 * np.asarray(found["angle(p)"]) - 0.04 * np.asarray(found["angle(q)"])
    assert np.abs(s - 0.002 / w * np.sin(w * t)).max() < 1e-8 * 0.002 / w + 1e-12


def test_a_strand_goes_slack_and_never_pushes() -> None:
    text = (
        PULLEYS.replace("@", "50")
        + "BELT x p q r1=20m r2=40m k=10k c=3 f0=20\n.tran 1m 1\n.save force(x,1) force(x,2)\n.options reltol=1e-7\n.end\n"
    )
    found = emsim.run(text)
    tensions = [np.asarray(found[f"force(x,{k})"]) for k in (1, 2)]
    assert all(f.min() > -1e-7 * f.max() for f in tensions)  # events are located to the tolerance
    assert np.count_nonzero(tensions[1] == 0.0) > 10
    assert found.energy.balanced and found.energy.share < 1e-8


@pytest.mark.parametrize(("cross", "ratio"), [("", 0.5), ("cross=yes", -0.5)])
def test_pulleys_end_at_the_speeds_that_their_radii_say(cross: str, ratio: float) -> None:
    """Damped, both run on with r1 w1 = +-r2 w2, and what the belt takes over is an impulse: J1 dw1/r1 = -+J2 dw2/r2."""
    text = (
        PULLEYS.replace("@", "50")
        + f"BELT x p q r1=20m r2=40m k=10k c=30 f0=20 {cross}\n.tran 1m 3\n.options reltol=1e-8\n.end\n"
    )
    found = emsim.run(text)
    one, two = found.at("omega(p)", 3.0), found.at("omega(q)", 3.0)
    assert two == pytest.approx(ratio * one, rel=1e-6)
    assert 1e-3 * (50 - one) / 0.02 == pytest.approx(4e-3 * two / 0.04 * (1 if ratio > 0 else -1), rel=1e-6)


VALVE = (
    "cam\nBODY wheel m=1 j=1m\nBODY valve m=0.1\nJOINT shaft 0 wheel pin\nJOINT guide 0 valve slide axis=(0,1)\n"
    "DRIVE d shaft q={@*time}\nCAM c guide shaft lift={3m*(1-cos(angle(shaft)))} %\nSPRING s guide k=500 q0=-10m\n"
)


def test_a_grooved_cam_carries_its_follower_exactly() -> None:
    """Force on the follower: m f'' w^2 + k (f + 10 mm)."""
    found = emsim.run(
        VALVE.replace("@", "50").replace("%", "")
        + ".tran 1m 0.3\n.save pos(guide) force(c)\n.options reltol=1e-8\n.end\n"
    )
    t = np.asarray(found.time)
    lift = 3e-3 * (1 - np.cos(50 * t))
    assert np.abs(np.asarray(found["pos(guide)"]) - lift).max() < 1e-12
    force = 0.1 * 3e-3 * 2500 * np.cos(50 * t) + 500 * (lift + 10e-3)
    assert np.abs(np.asarray(found["force(c)"]) - force).max() < 1e-6 * force.max()


@pytest.mark.parametrize(("touch", "abs_", "depth"), [("e=0", 5e-3, 1e-9), ("k=10meg c=1k", 0.03, 1e-5)])
def test_a_follower_leaves_its_cam_where_its_force_falls_to_nothing(
    touch: str, abs_: float, depth: float
) -> None:
    """m f'' w^2 + k (f + s0) = 0: w = 200 rad/s, cos(a) = -(k 13 mm)/(m 3 mm w^2 - k 3 mm)."""
    text = (
        VALVE.replace("@", "200").replace("%", touch)
        + ".tran 10u 20m\n.save force(c) pos(guide) mode(c)\n.options reltol=1e-7\n.end\n"
    )
    found = emsim.run(text)
    mode, t = np.asarray(found["mode(c)"]), np.asarray(found.time)
    left = t[np.flatnonzero((mode[:-1] == 1) & (mode[1:] == 0))[0] + 1]
    inertia = 0.1 * 3e-3 * 200**2
    assert 200 * left == pytest.approx(np.arccos(-500 * 13e-3 / (inertia - 500 * 3e-3)), abs=abs_)
    # in flight it is a mass on the spring alone
    assert np.all(np.asarray(found["pos(guide)"]) > 3e-3 * (1 - np.cos(200 * t)) - depth)


def test_a_cam_takes_no_energy_from_what_turns_it() -> None:
    text = (
        VALVE.replace("DRIVE d shaft q={@*time}\n", "")
        .replace("shaft 0 wheel pin", "shaft 0 wheel pin ic=(0,40)")
        .replace("%", "")
    )
    ledger = emsim.run(text + ".tran 1m 1\n.options reltol=1e-9\n.end\n").energy
    assert ledger.balanced and ledger.share < 1e-10


def test_a_profile_may_be_a_table() -> None:
    text = (
        "table\nBODY w m=1 j=1m\nBODY f m=0.1\nJOINT shaft 0 w pin\nJOINT guide 0 f slide axis=(0,1)\n"
        "DRIVE d shaft q={2*time}\nCAM c guide shaft lift={table(angle(shaft), 0,0, 1,2m, 3,2m, 4,0)} k=1meg\n"
        "SPRING s guide k=500 q0=-10m\nDAMPER z guide c=30\n.tran 1m 1.2\n.end\n"
    )
    found = emsim.run(text)
    assert found.at("pos(guide)", 1.0) == pytest.approx(2e-3, abs=2e-5)


SCENE = "BODY a m=1 j=1\nBODY b m=1 j=1\nJOINT p 0 a pin\nJOINT q 0(1,0) b pin\nJOINT s 0(2,0) c slide\nBODY c m=1\n"
WRONG = {
    "BELT x p p r1=1 r2=1 k=1": "E237",
    "BELT x p s r1=1 r2=1 k=1": "E241",
    "BELT x p q r1=1 r2=1": "E230",
    "BELT x p q r1=0 r2=1 k=1": "E238",
    "CAM x s p lift=3m": "E252",
    "CAM x s p lift={2m*time}": "E252",
    "CAM x s p lift={2m*angle(q)}": "E252",
    "CAM x s p lift={2m*sin(angle(p))*v(n)}": "E252",
    "CAM x s s lift={pos(s)}": "E237",
    "CAM x s p lift={sin(angle(p))} e=2": "E238",
    "CAM x s p lift={sin(angle(p))} c=2": "E240",
    "CLUTCH x p q": "E140",
}  # fmt: skip


@pytest.mark.parametrize("line", WRONG)
def test_wrong_belts_and_cams_are_told_at_their_line(line: str) -> None:
    with pytest.raises(emsim.DeckError) as error:
        emsim.compile(f"w\n{SCENE}{line}\nV1 n 0 1\n.tran 1m 10m\n.end\n")
    errors = [d for d in error.value.diagnostics if d.severity == "error"]
    assert errors[0].code == WRONG[line]
    assert errors[0].span is not None and errors[0].span.line == 8

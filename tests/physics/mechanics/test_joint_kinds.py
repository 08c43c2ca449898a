"""Kinds of joints against closed forms: ball (quaternion, body rates), universal, cylinder; in the tree and cut."""

from __future__ import annotations

import math

import numpy as np
import pytest
from machines import only_error
from scipy.special import ellipj

import emsim


def run(cards: str, tran: str, options: str = "reltol=1e-9", save: str = ""):
    deck = f"joints\n{cards}\n.options {options}\n.tran {tran}\n.save all energy() {save}\n.end"
    r = emsim.run(deck)
    return {name: np.asarray(r[name]) for name in r.main.names}


METHODS = ("dop853", "radau", "gauss4")


# ball -----------------------------------------------------------------------------------------------

M, LENGTH, ACROSS, ALONG = 1.0, 0.05, 2e-3, 1e-3  # of the top: inertias about its centre of mass
TILT, RATE = 0.5, 4.0


def top(order: str = "0 top") -> str:
    """A heavy symmetrical top in steady precession: (C w3 - A W cos t) W = m g l."""
    a = ACROSS + M * LENGTH**2
    w3 = (M * 9.81 * LENGTH / RATE + a * RATE * math.cos(TILT)) / ALONG
    speeds = (-RATE * math.sin(TILT), 0.0, w3)
    sign = 1.0
    if (
        order == "top 0"
    ):  # A and B exchanged: the inverse rotation, the opposite rates in the axes of the ground
        sign = -1.0
        c, s = math.cos(TILT), math.sin(TILT)
        speeds = (-(c * speeds[0] + s * speeds[2]), 0.0, -(-s * speeds[0] + c * speeds[2]))
    start = ",".join(f"{v!r}" for v in (0.0, sign * TILT, 0.0, *speeds))
    body = f"BODY top m={M} j=({ACROSS},{ACROSS},{ALONG}) com=(0,0,{LENGTH})"
    return f"{body}\nJOINT b {order} ball ic=({start})\n.gravity 0 0 -9.81"


@pytest.mark.parametrize("order", ["0 top", "top 0"])
@pytest.mark.parametrize("method", METHODS)
def test_heavy_top_precesses_steadily(method, order):
    r = run(top(order), "1m 3", f"reltol=1e-9 method={method}", "x(top.com) y(top.com) z(top.com)")
    turn = RATE * r["time"]
    radius = LENGTH * math.sin(TILT)
    assert r["x(top.com)"] == pytest.approx(radius * np.cos(turn), abs=1e-6 * LENGTH)
    assert r["y(top.com)"] == pytest.approx(radius * np.sin(turn), abs=1e-6 * LENGTH)
    assert r["z(top.com)"] == pytest.approx(LENGTH * math.cos(TILT), abs=1e-6 * LENGTH)


def attitude(r):
    """Rotation matrices of body b from the points (1,0,0), (0,1,0), (0,0,1) on it."""
    points = [[r[f"{axis}(b({p}))"] for p in ("1,0,0", "0,1,0", "0,0,1")] for axis in "xyz"]
    return np.moveaxis(np.array(points), 2, 0)


POINTS = " ".join(f"{axis}(b({p}))" for axis in "xyz" for p in ("1,0,0", "0,1,0", "0,0,1"))
INERTIA = np.array([1e-3, 2e-3, 3e-3])


def free(start: tuple[float, float, float]) -> str:
    return f"BODY b m=1 j=(1m,2m,3m)\nJOINT o 0 b ball ic=(0.3,-0.2,0.4,{start[0]},{start[1]},{start[2]})"


@pytest.mark.parametrize("method", METHODS)
def test_free_body_turns_by_elliptic_functions_and_keeps_its_momentum(method):
    """Euler's equations with w2 = 0 at the start and L^2 > 2 E I2: w1 = a cn, w2 = -b sn, w3 = c dn of p t."""
    w1, w3 = 3.0, 6.0
    r = run(free((w1, 0.0, w3)), "1m 3", f"reltol=1e-10 method={method}", POINTS)
    i1, i2, i3 = INERTIA
    square, twice = (i1 * w1) ** 2 + (i3 * w3) ** 2, i1 * w1**2 + i3 * w3**2
    assert square > twice * i2
    p = math.sqrt((i3 - i2) * (square - i1 * twice) / (i1 * i2 * i3))
    k2 = (i2 - i1) * (i3 * twice - square) / ((i3 - i2) * (square - i1 * twice))
    sn, cn, dn, _ = ellipj(p * r["time"], k2)
    b = math.sqrt((i3 * twice - square) / (i2 * (i3 - i2)))
    assert r["wx(o)"] == pytest.approx(w1 * cn, abs=1e-6 * w3)
    assert r["wy(o)"] == pytest.approx(b * sn, abs=1e-6 * w3)  # dw2/dt = (I3 - I1) w3 w1 / I2 > 0
    assert r["wz(o)"] == pytest.approx(w3 * dn, abs=1e-6 * w3)
    w = np.array([r[f"w{c}(o)"] for c in "xyz"]).T
    momentum = np.einsum("tij,tj->ti", attitude(r), INERTIA * w)
    assert momentum == pytest.approx(
        np.broadcast_to(momentum[0], momentum.shape), abs=1e-8 * np.linalg.norm(momentum[0])
    )
    assert r["energy()"] == pytest.approx(r["energy()"][0], rel=1e-8)


def test_the_length_of_the_quaternion_turns_nothing():
    """What a coarse explicit run leaves of e.e - 1 is no deformation: the body's axes stay orthonormal to rounding."""
    r = run(free((2.0, 3.0, 6.0)), "10m 50", "reltol=1e-3 method=rk45", POINTS)
    norm = sum(r[f"e{k}(o)"] ** 2 for k in range(4))
    assert abs(norm - 1.0).max() > 1e-6
    a = attitude(r)
    assert np.einsum("tki,tkj->tij", a, a) == pytest.approx(np.broadcast_to(np.eye(3), a.shape), abs=1e-12)


CRANK = """BODY crank m=1 j=(1m,1m,1m) com=(0.05,0,0)
BODY rod m=0.5 j=(0.1m,1m,1m) com=(0.15,0,0)
BODY blk m=1 j=1m
JOINT a 0 crank pin axis=(1,0,0) ic=(0.3,5)
JOINT b crank(0,0.1,0) rod {first}
JOINT s 0(0.2,0,0.05) blk slide axis=(1,0,0) guess=0.1
JOINT c rod(0.3,0,0) blk {second}
.gravity 0 0 -9.81"""
ENDS = "x(blk) x(rod(0.3,0,0)) y(rod(0.3,0,0)) z(rod(0.3,0,0)) fx(b) fx(c)"


def test_a_ball_is_the_same_in_the_tree_and_cut_by_every_method():
    runs = [
        run(CRANK.format(first=first, second=second), "5m 1", f"reltol=1e-9 method={method} {more}", ENDS)
        for first, second in (("ball", "ball"), ("ball cut=yes", "ball"))
        for method, more in (("dop853", ""), ("radau", ""), ("radau", "formulation=absolute"))
    ]
    for r in runs:
        assert r["x(rod(0.3,0,0))"] == pytest.approx(r["x(blk)"], abs=1e-9)  # closed at every row
        assert r["z(rod(0.3,0,0))"] == pytest.approx(0.05, abs=1e-9)
        assert r["energy()"] == pytest.approx(r["energy()"][0], abs=1e-7)
        for name, size in (("x(blk)", 0.1), ("angle(a)", 1.0), ("fx(b)", 20.0), ("fx(c)", 20.0)):
            assert r[name][-1] == pytest.approx(runs[0][name][-1], abs=1e-6 * size), name


def test_a_ball_is_three_pins_away_from_their_singular_pose():
    bar = "BODY bar m=0.3 j=(1m,3m,3m) com=(0.1,0.02,0)\n.gravity 0 -9.81 1"
    pins = (
        "BODY p m=0 j=(0,0,0)\nBODY q m=0 j=(0,0,0)\nJOINT x 0 p pin axis=(1,0,0) ic=(0,1)\n"
        "JOINT y p q pin axis=(0,1,0) ic=(0,0.5)\nJOINT z q bar pin ic=(0,-1)"
    )
    tip = "x(bar(0.2,0,0.1)) y(bar(0.2,0,0.1)) z(bar(0.2,0,0.1))"
    ball = run(f"{bar}\nJOINT b 0 bar ball ic=(0,0,0,1,0.5,-1)", "1m 0.4", save=tip)
    three = run(f"{bar}\n{pins}", "1m 0.4", save=tip)
    for name in tip.split(" "):
        assert ball[name][-1] == pytest.approx(three[name][-1], abs=1e-8)


def test_a_damped_ball_loses_its_rates_alone():
    """damp= on each rate, a round body: w = w0 exp(-d t/J) in the tree, and where the joint is cut beside three slides."""
    body = "BODY b m=1 j=(2m,2m,2m)\n"
    cart = "BODY c m=1 j=(1m,1m,1m)\nJOINT s 0 c slide\n"
    for cards in (
        "JOINT o 0 b ball ic=(0,0,0,1,2,3) damp=4m",
        cart + "JOINT o c b ball ic=(0,0,0,1,2,3) damp=4m",
    ):
        r = run(body + cards, "1m 1")
        for axis, start in zip("xyz", (1.0, 2.0, 3.0), strict=True):
            assert r[f"w{axis}(o)"] == pytest.approx(start * np.exp(-2.0 * r["time"]), abs=1e-7)


def test_reading_a_ball_by_angle_says_what_it_has():
    with pytest.raises(emsim.DeckError, match=r"E249.*is a ball") as caught:
        run("BODY b m=1 j=(1m,1m,1m)\nJOINT o 0 b ball", "1m 1", save="angle(o)")
    assert "wx wy wz" in str(caught.value)


def test_what_a_kind_does_not_take_is_refused():
    assert only_error("BODY b m=1 j=1m\nJOINT o 0 b pin l=3").code == "E240"
    assert only_error("BODY b m=1 j=(1m,1m,1m)\nJOINT o 0 b ball zero=1").code == "E240"
    assert only_error("BODY b m=1 j=(1m,1m,1m)\nJOINT o 0 b ball ic=(1,0)").code == "E232"
    assert only_error("BODY b m=1 j=(1m,1m,1m)\nJOINT o 0 b universal axis2=(1,1,0)").code == "E232"


# universal ------------------------------------------------------------------------------------------

BEND = math.radians(30.0)


@pytest.mark.parametrize("cut", ["u", "out"])
def test_universal_joint_drives_a_bent_shaft_unevenly(cut):
    """tan(out) = tan(in)/cos(bend) where the first axis starts normal to the bend; many turns, wherever the loop is cut."""
    c, s = math.cos(BEND), math.sin(BEND)
    u, out = ("cut=yes", "") if cut == "u" else ("", "cut=yes")
    cards = (
        "BODY s1 m=1 j=(1m,1m,1m)\nBODY s2 m=1 j=(1m,1m,1m)\nJOINT in 0 s1 pin axis=(1,0,0) ic=0\n"
        f"JOINT u s1 s2 universal axis=(0,0,1) axis2=({-s},{c},0) {u}\nJOINT out 0 s2 pin axis=({c},{s},0) {out}\n"
        "DRIVE d in qd={6}"
    )
    r = run(cards, "5m 4", save="angle1(u) angle2(u)")
    t = r["time"]
    # the input's cross axis turns from z by 6 t about x; the output's by `out` about its own axis
    right = np.unwrap(np.arctan2(np.sin(6 * t) * c, np.cos(6 * t)))
    left = np.unwrap(np.arctan2(np.sin(6 * t), np.cos(6 * t) * c))
    nearer = min((right, left), key=lambda a: abs(a - r["angle(out)"]).max())
    assert r["angle(out)"] == pytest.approx(nearer, abs=1e-7)
    assert r["angle(out)"][-1] > 20.0
    assert abs(r["angle2(u)"]).max() == pytest.approx(BEND, abs=1e-4)


# cylinder -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("cut", ["", "cut=yes"])
def test_cylinder_turns_and_slides_on_its_own(cut):
    """Under gravity along the axis it falls freely and keeps turning; cut, beside a tree of a slide and a pin on it."""
    cards = "BODY b m=2 j=(1m,1m,3m)\n"
    if cut:
        cards += "BODY c m=0 j=(0,0,0)\nJOINT s 0 c slide axis=(0,0,1) ic=(0.1,0.5)\n"
        cards += "JOINT p c b pin ic=(0.2,30)\nJOINT j 0 b cylinder"
    else:
        cards += "JOINT j 0 b cylinder ic=(0.1,0.2,0.5,30)"
    r = run(cards + "\n.gravity 0 0 -9.81", "1m 1", save="pos(j) angle(j) vel(j)")
    t = r["time"]
    assert r["pos(j)"] == pytest.approx(0.1 + 0.5 * t - 0.5 * 9.81 * t**2, abs=1e-8)
    assert r["angle(j)"] == pytest.approx(0.2 + 30.0 * t, abs=1e-7)
    assert r["vel(j)"] == pytest.approx(0.5 - 9.81 * t, abs=1e-8)

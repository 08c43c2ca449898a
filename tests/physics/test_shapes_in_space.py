"""CONTACT between shapes in space: boxes, hulls, balls, capsules, cylinders on planes and one another; closed forms, the energy,
nothing in each other, any order of cards."""

from __future__ import annotations

import random
from itertools import product
from math import atan, cos, pi, sin, sqrt

import numpy as np
import pytest
from test_shapes import TOLERANCES, G, never_rises

import emsim
from emsim.cards.hulls import Hull
from emsim.diagnostics import DeckError

BRICK = "box(0.2,0.1,0.16)"
CORNERS = [(0.1 * x, 0.05 * y, 0.08 * z) for x, y, z in product((-1, 1), repeat=3)]
HULL = "hull(" + ",".join(f"{c!r}" for p in CORNERS for c in p) + ")"
FLOOR = f".gravity {G}\nSHAPE floor 0 plane(0,1,0)\n"


def run(cards: str, until: float, save: str, reltol: float = 1e-6):
    return emsim.run(
        f"t\n{cards}\n.options reltol={reltol:g}\n.tran 5m {until}\n.save energy() {save}\n.end\n"
    )


def tilted(a: float) -> str:
    """A floor, seen in its own axes: down is along +x."""
    return f".gravity {G * sin(a)!r} {-G * cos(a)!r} 0\nSHAPE floor 0 plane(0,1,0)\n"


@pytest.mark.parametrize("shape", [BRICK, HULL])
@pytest.mark.parametrize(("reltol", "error"), TOLERANCES)
def test_a_box_on_an_incline_rests_or_slides(shape, reltol, error):
    """It rests where mu > tan(a), and else slides with a = g (sin a - mu cos a); the floor bears m g cos a."""
    a = 0.3
    for mu in (0.5, 0.2):
        deck = tilted(a) + f"BODY b m=2 shape={shape} y=0.05\nCONTACT c b floor e=0 mu={mu}"
        r = run(deck, 1.0, "x(b) y(b) z(b) force(c) mode(c)", reltol)
        way = 0.0 if mu > 0.3 else G * (sin(a) - mu * cos(a)) / 2
        assert r["x(b)"][-1] == pytest.approx(way, abs=error) and abs(r["z(b)"][-1]) < 1e-9
        assert np.ptp(r["y(b)"]) < 1e-9
        assert np.asarray(r["force(c)"])[1:] == pytest.approx(2 * G * cos(a), rel=error)
        assert never_rises(r, reltol)


@pytest.mark.parametrize("across", [0.0, pi / 2])
def test_a_box_tips_where_its_weight_leaves_its_base(across):
    """A brick of the length w down the slope and the height h stands while tan(a) < w/h."""
    w, h = (0.06, 0.2) if not across else (0.04, 0.2)
    for more, stands in ((-1e-3, True), (1e-3, False)):
        a = atan(w / h) + more
        deck = (
            tilted(a)
            + f"BODY b m=1 shape=box(0.06,0.2,0.04) y=0.1 rot=(0,{across!r},0)\nCONTACT c b floor e=0 mu=2"
        )
        r = run(deck, 0.5, "y(b) x(b)")
        assert (abs(r["x(b)"][-1]) < 1e-9) == stands


@pytest.mark.parametrize(("reltol", "error"), TOLERANCES)
def test_a_box_falls_on_an_edge(reltol, error):
    """e=1 on an edge along z: each of its two corners takes half of (1 + e) v/(1/m + x^2/J), x the arm of the edge."""
    angle = 0.3
    deck = FLOOR + f"BODY b m=2 shape={BRICK} y=0.5 rot=(0,0,{angle})\nCONTACT c b floor e=1"
    r = run(deck, 0.35, "y(b) vy(b) wz(b) wx(b) hits(c)", reltol)
    x, y = -0.1 * cos(angle) + 0.05 * sin(angle), -0.1 * sin(angle) - 0.05 * cos(angle)
    v, j = sqrt(2 * G * (0.5 + y)), 2 * (0.2**2 + 0.1**2) / 12
    p = 2 * v / (1 / 2 + x * x / j)
    k = int(np.flatnonzero(np.asarray(r["hits(c)"]) == 2)[0])
    assert r["wz(b)"][k] == pytest.approx(x * p / j, rel=error) and abs(r["wx(b)"][k]) < 1e-9
    assert r["vy(b)"][k] == pytest.approx(p / 2 - v, rel=10 * error) and never_rises(r, reltol)


def test_a_block_rocks_and_loses_what_housner_says():
    """A block of half-diagonal R rocks about its edges, J0 = 4/3 m R^2; over flat its rate falls by 1 - 3/2 sin(alpha)^2."""
    w, h, lean = 0.06, 0.2, 0.1
    alpha, big = atan(w / h), sqrt(w * w + h * h) / 2
    x, y = -big * sin(alpha - lean), big * cos(alpha - lean)
    deck = (
        FLOOR
        + f"BODY b m=1 shape=box({w},{h},0.05) x={x!r} y={y!r} rot=(0,0,{-lean})\nCONTACT c b floor e=0 mu=2"
    )
    r = run(deck, 0.4, "wz(b) e0(b) e3(b)", 1e-8)
    rate = np.asarray(r["wz(b)"])
    k = int(np.argmin(np.diff(rate)))
    before = sqrt(2 * G / (4 / 3 * big) * (cos(alpha - lean) - cos(alpha)))
    assert rate[k] == pytest.approx(before, rel=1e-6)
    assert rate[k + 1] == pytest.approx(before * (1 - 1.5 * sin(alpha) ** 2), rel=1e-6)


@pytest.mark.parametrize(
    ("shape", "mass", "inertia", "r"),
    [
        ("capsule(0.3,0.05)", 1.0, None, 0.05),
        ("cylinder(0.05,0.3)", 2.0, 0.5, 0.05),
        ("ball(0.05)", 0.5, 0.4, 0.05),
        ("disc(0.05)", 0.5, 0.5, 0.05),
    ],
)
def test_what_is_round_rolls_down(shape, mass, inertia, r):
    """a = g sin(p)/(1 + J/(m r^2)): of a capsule J is that of a cylinder and of two half balls."""
    p = 0.2
    if inertia is None:
        straight = 0.3 / (0.3 + 4 / 3 * r)
        inertia = straight * 0.5 + (1 - straight) * 0.4
    turned = f"rot=(0,{-pi / 2!r},0)" if shape[:3] == "cap" else ""
    deck = tilted(p) + f"BODY b m={mass} shape={shape} y={r} z=-0.15 {turned}\nCONTACT c b floor e=0 mu=0.6"
    result = run(deck, 1.0, "x(b) mode(c)", 1e-7)
    way = G * sin(p) / (1 + inertia) / 2
    assert result["x(b)"][-1] - result["x(b)"][0] == pytest.approx(way, rel=1e-6)
    assert never_rises(result)


def test_a_ball_leaves_the_edge_of_a_box_as_it_does_in_the_plane():
    """Without friction it goes over the edge on a circle and leaves at cos a = (2 + w0^2 r/g)/3, with sqrt(g r) cos(a)^1.5."""
    r, w0 = 0.1, 1.0
    deck = (
        f".gravity {G}\nSHAPE table 0 box(0.4,0.2,0.4) at=(-0.2,-0.1,0)\n"
        f"BODY b m=1 shape=ball({r}) x=-0.05 y={r} vx={w0 * r}\nCONTACT c all e=0"
    )
    result = run(deck, 1.2, "vx(b) force(c)", 1e-8)
    cosine = (2 + w0 * w0 * r / G) / 3
    assert result["force(c)"][-1] == 0 and result["vx(b)"][-1] == pytest.approx(
        sqrt(G * r) * cosine**1.5, rel=1e-6
    )


@pytest.mark.parametrize("e", [1.0, 0.5])
@pytest.mark.parametrize(
    ("fixed", "falls", "at"),
    [
        ("capsule(0.4,0.05) at=(-0.2,0,0)", "capsule(0.4,0.05)", 0.1),
        ("box(0.4,0.1,0.1) at=(0,0,0) rot=(0.7853981633974483,0,0)", "box(0.1,0.1,0.4)", 0.1 * sqrt(2)),
        ("box(0.4,0.1,0.1) at=(0,0,0) rot=(0.7853981633974483,0,0)", "capsule(0.4,0.05)", 0.05 + 0.05 * sqrt(2)),
    ],
)  # fmt: skip
def test_crossed_edges_meet(fixed, falls, at, e):
    """Two edges, an edge and a round rod, two round rods, at right angles in their middles: it falls, v = g t, and is thrown back
    with e v."""
    high = 0.2
    where = "rot=(0,-1.5707963267948966,0) z=-0.2"
    if falls[:3] == "box":
        where = f"rot=(0,0,{pi / 4!r})"
    deck = f".gravity {G}\nSHAPE f 0 {fixed}\nBODY b m=1 shape={falls} y={at + high!r} {where}\nCONTACT c all e={e}"
    r = run(deck, 0.3, "vy(b) hits(c) y(b)", 1e-8)
    k = int(np.flatnonzero(np.asarray(r["hits(c)"]) >= 1)[0])
    v = sqrt(2 * G * high)
    assert r.time[k] == pytest.approx(v / G, rel=1e-7)
    assert r["vy(b)"][k] == pytest.approx(e * v, rel=1e-6)
    assert never_rises(r)


def test_crossed_planks_rest_on_each_other():
    """No corner of either is over the other's face: four crossings of edges carry it."""
    deck = (
        FLOOR
        + "BODY a m=1 shape=box(0.6,0.1,0.1) y=0.05\nBODY b m=1 shape=box(0.1,0.1,0.6) y=0.2 x=0.03 z=0.02\n"
        "CONTACT c a b e=0 mu=0.5\nCONTACT f a floor e=0 mu=0.5"
    )
    r = run(deck, 0.5, "y(a) y(b) force(c) force(f)")
    assert r["y(b)"][-1] == pytest.approx(0.15, abs=1e-8)
    assert [r["force(c)"][-1], r["force(f)"][-1]] == pytest.approx([G, 2 * G], rel=1e-6) and never_rises(r)


@pytest.mark.parametrize("law", ["e=0", "e=0.5"])
@pytest.mark.parametrize("rot", ["(1.2,0.5,0.4)", "(1.5,0,0)", "(0.3,0.2,0)"])
def test_a_can_falls_flat(law, rot):
    """On a smooth floor it comes to rest on its flat end, and what it lost is what it fell."""
    deck = FLOOR + f"BODY b m=2 shape=cylinder(0.1,0.05) y=0.2 rot={rot}\nCONTACT c b floor {law}"
    r = run(deck, 1.2, "y(b) force(c)")
    assert r["y(b)"][-1] == pytest.approx(0.025, abs=1e-6) and never_rises(r)
    assert r["force(c)"][-1] == pytest.approx(2 * G, rel=1e-5)


def scene(seed: int) -> list[str]:
    rng = random.Random(seed)
    cards = []
    for k in range(2):
        shape = rng.choice((BRICK, "ball(0.08)", "capsule(0.15,0.05)", "ellipsoid(0.1,0.07,0.05)"))
        turn = ",".join(f"{rng.uniform(-1, 1)!r}" for _ in range(3))
        spin = ",".join(f"{rng.uniform(-6, 6)!r}" for _ in range(3))
        cards.append(
            f"BODY b{k} m={rng.uniform(0.5, 2)!r} shape={shape} x={0.6 * k} y=0.3 vx={rng.uniform(-1, 1)!r} "
            f"vz={rng.uniform(-1, 1)!r} rot=({turn}) omega=({spin})"
        )
    return cards


@pytest.mark.parametrize("seed", range(4))
def test_what_is_thrown_on_a_floor(seed):
    """Its energy never rises, it stays above the floor, and another order of cards gives the same."""
    bodies = scene(seed)
    ends = []
    for order in (bodies, bodies[::-1]):
        touches = [f"CONTACT c{k} b{k} floor e=0.3 mu=0.3" for k in range(2)]
        r = run(FLOOR + "\n".join([*order, *touches]), 0.6, "y(b0) y(b1) x(b0) x(b1) gap(c0) gap(c1)", 1e-7)
        assert never_rises(r) and min(np.min(r["gap(c0)"]), np.min(r["gap(c1)"])) > -1e-6
        ends.append([r[name][-1] for name in ("x(b0)", "y(b0)", "x(b1)", "y(b1)")])
    assert ends[0] == pytest.approx(ends[1], abs=1e-5)


def test_a_hull_weighs_what_its_solid_weighs():
    """Of a box's corners and points inside of it: volume, middle, inertia."""
    rng = random.Random(3)
    inside = [[rng.uniform(-1, 1) * s for s in (0.09, 0.04, 0.07)] for _ in range(20)]
    found = Hull([*inside[:10], *CORNERS, *inside[10:]])
    assert sorted(found.corners) == sorted(CORNERS) and found.volume == pytest.approx(0.2 * 0.1 * 0.16)
    w, h, d = 0.2, 0.1, 0.16
    assert found.inertia[:3] == pytest.approx(
        [(h * h + d * d) / 12, (w * w + d * d) / 12, (w * w + h * h) / 12]
    )
    assert max(map(abs, (*found.centre, *found.inertia[3:]))) < 1e-15


def test_the_hull_of_a_file_is_touched(tmp_path):
    """A brick of triangles in millimetres, beside its deck."""
    found = Hull([[1000 * c for c in p] for p in CORNERS])
    facets = [
        "facet normal 0 0 0\nouter loop\n"
        + "".join("vertex {:.9g} {:.9g} {:.9g}\n".format(*found.corners[k]) for k in face)
        + "endloop\nendfacet\n"
        for face in found.faces
    ]
    (tmp_path / "brick.stl").write_text("solid brick\n" + "".join(facets) + "endsolid brick\n")
    deck = tmp_path / "deck.cir"
    deck.write_text(
        f"t\n{FLOOR}BODY b m=2 shape=stl(brick.stl,1m) y=0.1\nCONTACT c b floor e=0 mu=0.3\n.tran 10m 0.5\n"
        ".save y(b) force(c)\n.end\n"
    )
    r = emsim.run(deck)
    assert r["y(b)"][-1] == pytest.approx(
        0.05, abs=1e-6
    )  # points are kept in steps of the file's extent over 65534
    assert r["force(c)"][-1] == pytest.approx(2 * G, rel=1e-9)


@pytest.mark.parametrize(
    ("cards", "said"),
    [
        ("BODY b m=1 shape=box(0.1,0.1) y=1\nCONTACT c b floor e=0", "has no depth along z"),
        ("BODY b m=1 shape=hull(0,0,0,1,0,0,0,1,0,1,1,0)\nCONTACT c b floor e=0", "lie in one plane"),
        ("BODY b m=1 shape=ball(0)\nCONTACT c b floor e=0", "greater than zero"),
        ("SHAPE q 0 plane(0,0,0)\nBODY b m=1 shape=ball(1)\nCONTACT c b q e=0", "three components of its normal"),
        (
            "BODY b m=1 shape=ellipsoid(1,2,3) y=9\nBODY d m=1 shape=cylinder(1,1) y=4\nCONTACT c b d e=0",
            "touches planes, balls, capsules, boxes and hulls",
        ),
        (
            f"BODY b m=1 shape={BRICK} y=9\nBODY d m=1 shape={BRICK} y=4\nCONTACT c b d k=1k",
            "have no elastic law k=",
        ),
        (
            "BODY a m=1 shape=box(0.6,0.1,0.1) y=1\nBODY b m=1 shape=box(0.1,0.6,0.1) y=1\nCONTACT c a b e=0",
            "in each other at the start",
        ),
        ("BODY b m=1 shape=ball(1) y=0.5\nCONTACT c b floor e=0", "in each other at the start"),
    ],
)  # fmt: skip
def test_what_is_not_known_is_an_error(cards, said):
    with pytest.raises(DeckError, match=said):
        run(FLOOR + cards, 0.1, "")


GEM = "hull(-0.08,-0.05,-0.06,0.08,-0.05,-0.06,0,-0.05,0.09,0,0.1,0)"


@pytest.mark.parametrize("beside", ["", "capsule(0.25,0.04)"])
@pytest.mark.parametrize("reltol", [1e-4, 1e-5, 1e-6])
def test_an_edge_that_stops_sliding_and_turning_at_once_sticks(beside, reltol):
    """Dry friction ends the slip of both ends of an edge at one time; then four directions hold three motions. Corners that stop
    one by one would let each other go again, and the share of what is redundant would be one of rounding."""
    other = f"BODY rod m=0.5 shape={beside} y=0.3 x=0.5 rot=(0.1,0.4,0.6)\nCONTACT t rod floor e=0.2 mu=0.4\n"
    r = emsim.run(
        "t\n.gravity 9.81\nSHAPE floor 0 plane(0,1,0)\n"
        f"BODY gem m=0.4 shape={GEM} y=0.3 z=0.5 omega=(3,1,2)\nCONTACT c gem floor e=0.2 mu=0.4\n"
        f"{other if beside else ''}.options reltol={reltol}\n.tran 5m 0.8\n.save y(gem) energy()\n.end\n"
    )
    assert not r.diagnostics and r.stats["events"] < 70
    assert r["y(gem)"][-1] == pytest.approx(0.05, abs=1e-9)
    assert np.all(np.diff(r["energy()"]) < 10 * reltol)


def test_legs_that_lie_on_their_stops_carry_a_table():
    """Four feet and four stops hold what seven would: as few carry as can do it without pulling, whichever are left out."""
    cards = ["BODY top m=2 shape=box(0.4,0.1,0.4) y=0.26"]
    for k, (x, z) in enumerate(((1, 1), (-1, 1), (-1, -1), (1, -1))):
        end = -1.0 if x > 0 else 1.0 - pi  # it folds outwards up to there
        cards += [
            f"BODY leg{k} m=0.1 shape=capsule(0.2,0.03)",
            f"JOINT hip{k} top({0.15 * x},-0.05,{0.15 * z}) leg{k} pin axis=(0,0,1) ic={end!r}",
            f"STOP end{k} hip{k} {'max' if x > 0 else 'min'}={end!r} e=0",
            f"SHAPE foot{k} leg{k} ball(0.04) at=(0.2,0,0)",
            f"CONTACT c{k} foot{k} floor e=0 mu=0.8",
        ]
    shown = " ".join(f"force(c{k}) torque(end{k})" for k in range(4))
    r = run(FLOOR + "\n".join(cards), 0.5, f"y(top) {shown}", 1e-6)
    assert not r.diagnostics and r.stats["events"] < 60 and never_rises(r)
    forces = [r[f"force(c{k})"][-1] for k in range(4)]
    assert sum(forces) == pytest.approx(2.4 * G, rel=1e-6) and min(forces) >= 0
    assert r["y(top)"][-1] == pytest.approx(0.09 + 0.2 * sin(1.0), abs=1e-7)

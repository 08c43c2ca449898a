"""CONTACT between shapes: boxes, polygons, discs; closed forms, the energy, nothing in each other, any order of cards."""

from __future__ import annotations

import random
from math import cos, hypot, pi, sin, sqrt

import numpy as np
import pytest
from outlines import apart, apart_disc, box, placed

import emsim

G = 9.81
TOLERANCES = ((1e-3, 2e-3), (1e-6, 2e-6), (1e-9, 1e-8))
FLOOR = "SHAPE floor 0 box(4,0.2) at=(0,-0.1)\n"


def run(cards: str, until: float, save: str, reltol: float = 1e-6):
    text = f"t\n.gravity {G}\n{cards}\n.options reltol={reltol:g}\n.tran 5m {until}\n.save energy() {save}\n.end\n"
    return emsim.run(text)


def never_rises(r, reltol: float = 1e-6) -> bool:
    """But by what the integration leaves: rows inside long steps are known to the relative tolerance, values behind an event to
    1e-7 of the energy. What impacts and friction took is known to 1e-5, or a tenth of the tolerance."""
    energy = np.asarray(r["energy()"])
    size = np.abs(energy).max()
    return (
        np.diff(energy).max() < (reltol + 1e-7) * size
        and abs(r.energy.residual) < (1e-5 + 0.1 * reltol) * size
    )


@pytest.mark.parametrize(("reltol", "error"), TOLERANCES)
def test_a_box_falls_off_the_end_of_a_finite_floor(reltol, error):
    """Without friction it slides at v until its middle is over the end, and tips there; before, nothing but the floor's force."""
    r = run(
        FLOOR + "BODY b m=2 shape=box(0.2,0.1) x=1.5 y=0.05 vx=1\nCONTACT c b floor e=0",
        0.9,
        "x(b) y(b) force(c)",
        reltol,
    )
    t, x, force = (np.asarray(r[name]) for name in ("time", "x(b)", "force(c)"))
    on = t < 0.499
    assert np.allclose(x[on], 1.5 + t[on], atol=error) and np.allclose(force[on], 2 * G, rtol=error)
    # at the end one place of two corners is left, under the middle: it starts to tip with the weight on it
    assert r.at("y(b)", 0.499) == pytest.approx(0.05, abs=error) and r.at("y(b)", 0.8) < 0.05 - 0.02
    assert r.at("force(c)", 0.85) == pytest.approx(0.0, abs=1e-6) and never_rises(r, reltol)


@pytest.mark.parametrize(("reltol", "error"), TOLERANCES)
def test_a_box_slides_down_a_ramp_with_an_end_and_flies(reltol, error):
    """a = g (sin p - mu cos p) on the ramp; what is thrown from its end falls by g."""
    p, mu = 0.5, 0.2
    ramp = f"SHAPE ramp 0 box(2,0.2) at=({-cos(p) - 0.1 * sin(p)},{sin(p) - 0.1 * cos(p)}) angle={-p}\n"
    s = 0.5  # from the end, up the ramp
    at = f"x={-s * cos(p) + 0.01 * sin(p)} y={s * sin(p) + 0.01 * cos(p)} angle={-p}"
    r = run(
        ramp + f"BODY b m=1 shape=box(0.02,0.02) {at}\nCONTACT c all e=0 mu={mu}", 1.0, "x(b) y(b)", reltol
    )
    a = G * (sin(p) - mu * cos(p))
    t = 0.4
    way = hypot(r.at("x(b)", t) - r.at("x(b)", 0.0), r.at("y(b)", t) - r.at("y(b)", 0.0))
    assert way == pytest.approx(0.5 * a * t * t, rel=10 * error)
    y = [r.at("y(b)", t) for t in (0.8, 0.9, 1.0)]
    assert (y[0] - 2 * y[1] + y[2]) / 0.01 == pytest.approx(-G, rel=10 * error + 1e-6)
    assert never_rises(r, reltol)


@pytest.mark.parametrize(("reltol", "error"), TOLERANCES)
def test_a_ball_rolls_off_an_edge(reltol, error):
    """Without friction its centre goes over the table's corner on a circle, w^2 = w0^2 + 2 g (1 - cos a)/r, and leaves where
    w^2 r = g cos a, cos a = (2 + w0^2 r/g)/3; from there on its speed along the floor is sqrt(g r) cos(a)^1.5."""
    radius, w0 = 0.1, 1.0
    cards = FLOOR + f"BODY b m=1 shape=disc({radius}) x=1.95 y={radius} vx={w0 * radius}\nCONTACT c all e=0"
    r = run(cards, 1.2, "x(b) y(b) vx(b) force(c)", reltol)
    cosine = (2.0 + w0 * w0 * radius / G) / 3.0
    assert r["vx(b)"][-1] == pytest.approx(sqrt(G * radius) * cosine**1.5, rel=10 * error)
    touches = np.asarray(r["force(c)"]) > 0.0
    x, y = np.asarray(r["x(b)"])[touches], np.asarray(r["y(b)"])[touches]
    assert np.allclose(np.hypot(np.maximum(x - 2.0, 0.0), y), radius, atol=error) and never_rises(r, reltol)


@pytest.mark.parametrize(("reltol", "error"), ((1e-4, 1e-4), (1e-6, 1e-6), (1e-8, 1e-8)))
@pytest.mark.parametrize("mu", (0.0, 0.1))
def test_a_disc_goes_round_the_corners_of_a_box_that_turns(mu, reltol, error):
    """Its height by the edge or the corner below it, its slip by the speeds of both where they touch: each change of place is
    one event, and no end of the touch."""
    half, r, rate, slips = 0.1, 0.05, 0.3, "slip(c)" if mu else ""
    box = f"BODY box m=1 shape=box({2 * half},{2 * half})\nJOINT turn 0 box pin\nDRIVE spin turn q={{{rate}*time}}\n"
    disc = f"BODY disc m=1 shape=disc({r})\nJOINT up 0 disc slide axis=(0,1) ic={half + r}\n"
    found = run(
        f"{box}{disc}CONTACT c disc box e=0 mu={mu}", 12.0, f"pos(up) vel(up) force(c) {slips}", reltol
    )
    turned = np.remainder(rate * np.asarray(found.time) + pi / 4, pi / 2) - pi / 4  # of the nearest edge
    at_edge = (half + r) * np.abs(np.tan(turned)) <= half
    lies = np.sqrt(2) * half * np.sin(turned - np.copysign(pi / 4, turned))  # the corner, below 0 to the left
    tilt = np.where(
        at_edge, -turned, np.arcsin(np.clip(lies / r, -1.0, 1.0))
    )  # of the normal against the vertical
    stands = np.sqrt(2) * half * np.cos(turned - np.copysign(pi / 4, turned)) + r * np.cos(tilt)
    height = np.where(at_edge, (half + r) / np.cos(turned), stands)
    assert np.allclose(found["pos(up)"], height, rtol=0.0, atol=error)
    if mu:
        n = np.array([np.sin(tilt), np.cos(tilt)])
        place = np.array([np.zeros_like(height), height]) - r * n
        slip = -n[0] * np.asarray(found["vel(up)"]) + rate * (place[1] * n[1] + place[0] * n[0])
        assert np.allclose(found["slip(c)"], slip, rtol=0.0, atol=error)
    assert np.all(np.asarray(found["force(c)"]) > 0.0)
    assert found.stats["events"] == 4 and not found.diagnostics


def test_sensitivities_go_round_a_corner():
    """Height by the speed of turning: on the edge (h + r)/cos(w t), on the corner, d = sqrt(2) h, at b = pi/4 - w t
    d cos(b) + sqrt(r^2 - d^2 sin(b)^2)."""
    half, r, rate, d = 0.1, 0.05, 0.3, sqrt(2) * 0.1
    found = emsim.run(
        f"t\n.gravity {G}\n.param w={rate}\nBODY box m=1 shape=box(0.2,0.2)\nJOINT turn 0 box pin\nDRIVE s turn q={{w*time}}\n"
        f"BODY disc m=1 shape=disc({r})\nJOINT up 0 disc slide axis=(0,1) ic=0.15\nCONTACT c disc box e=0\n"
        ".options reltol=1e-8\n.tran 0.1 3\n.sens pos(up) tran by w\n.end\n"
    )
    b = pi / 4 - rate * 2.5
    by_b = -d * sin(b) - d * d * sin(b) * cos(b) / sqrt(r * r - (d * sin(b)) ** 2)
    assert found.at("sens(pos(up),w)", 2.5) == pytest.approx(-2.5 * by_b, abs=1e-7)
    edge = (half + r) * sin(rate) / cos(rate) ** 2
    assert found.at("sens(pos(up),w)", 1.0) == pytest.approx(edge, abs=1e-7)


@pytest.mark.parametrize(("reltol", "error"), TOLERANCES)
def test_a_stack_carries_its_weight(reltol, error):
    """Boxes of one width, corners exactly on corners: n - k weights on the k-th."""
    boxes = "".join(f"BODY b{k} m={k + 1} shape=box(0.2,0.1) y={0.05 + 0.1 * k}\n" for k in range(4))
    touches = "CONTACT c0 b0 floor e=0 mu=0.4\n" + "".join(
        f"CONTACT c{k} b{k} b{k - 1} e=0 mu=0.4\n" for k in (1, 2, 3)
    )
    r = run(FLOOR + boxes + touches, 1.0, " ".join(f"force(c{k}) y(b{k})" for k in range(4)), reltol)
    for k in range(4):
        assert r[f"force(c{k})"][-1] == pytest.approx(G * sum(range(k + 1, 5)), rel=1e-6)
        assert np.ptp(r[f"y(b{k})"]) < error and never_rises(r, reltol)


def test_a_corner_hits_as_a_free_body_does():
    """e=1, no friction: impulse (1 + e) v/(1/m + x^2/J) at the corner, x its arm along the floor."""
    angle, m, w, h = 0.3, 2.0, 0.4, 0.2
    cards = FLOOR + f"BODY b m={m} shape=box({w},{h}) y=1 angle={angle}\nCONTACT c all e=1"
    r = run(cards, 0.6, "vy(b) omega(b) vx(b) hits(c)", 1e-9)
    corner = np.array([w / 2 * -cos(angle) + h / 2 * sin(angle), w / 2 * -sin(angle) - h / 2 * cos(angle)])
    v = sqrt(2 * G * (1 + corner[1]))
    j = m * (w * w + h * h) / 12
    p = 2 * v / (1 / m + corner[0] ** 2 / j)
    k = int(np.flatnonzero(np.asarray(r["hits(c)"]) == 1)[0])
    assert r["vy(b)"][k] == pytest.approx(p / m - v, rel=1e-6)
    assert r["omega(b)"][k] == pytest.approx(corner[0] * p / j, rel=1e-6) and r["vx(b)"][k] == pytest.approx(
        0.0, abs=1e-9
    )


def test_a_fast_box_does_not_pass_a_thin_wall():
    for speed in (1.0, 30.0, 1000.0):
        cards = (
            "SHAPE wall 0 box(0.002,2)\nBODY b m=1 shape=box(0.1,0.1) x=-1 angle=0.2 y=0.03 "
            + f"vx={speed}\nCONTACT c all e=0.5"
        )
        r = emsim.run(
            f"t\n{cards}\n.tran {0.05 / speed} {3 / speed}\n.save x(b) y(b) angle(b) hits(c)\n.end\n"
        )
        body = placed(box(0.1, 0.1), *(np.asarray(r[f"{q}(b)"]) for q in ("x", "y", "angle")))
        wall = placed(box(0.002, 2), *np.zeros((3, len(r.time))))
        assert r["hits(c)"][-1] >= 1 and r["x(b)"][-1] < 0.0 and apart(wall, body).min() > -1e-6


def scene(seed: int) -> tuple[list[str], dict[str, tuple[list, float]]]:
    """2 or 3 boxes, polygons and discs thrown into a tub: cards of the bodies; their corners or radius."""
    rng = random.Random(seed)
    cards, shapes = [], {}
    for k in range(rng.randint(2, 3)):
        size, name = rng.uniform(0.05, 0.12), f"b{k}"
        kind = rng.choice(("box", "polygon", "disc"))
        if kind == "box":
            w, h = size, size * rng.uniform(0.5, 2.0)
            shape, corners, r = f"box({w!r},{h!r})", box(w, h), 0.0
        elif kind == "disc":
            shape, corners, r = f"disc({size / 2!r})", [(0.0, 0.0)], size / 2
        else:
            n = rng.randint(3, 5)
            turns = [2 * pi * (j + rng.uniform(-0.2, 0.2)) / n for j in range(n)]
            corners, r = [(0.7 * size * cos(a), 0.7 * size * sin(a)) for a in turns], 0.0
            shape = "polygon(" + ",".join(f"{c!r}" for p in corners for c in p) + ")"
        speed = f"vx={rng.uniform(-2, 2)} vy={rng.uniform(-2, 1)} omega={rng.uniform(-8, 8)}"
        start = f"x={rng.uniform(-0.1, 0.1)} y={0.15 + 0.25 * k} angle={rng.uniform(0, 6)} {speed}"
        cards.append(f"BODY {name} m={rng.uniform(0.2, 3)} shape={shape} {start}")
        shapes[name] = (corners, r)
    return cards, shapes


TUB = {"bottom": (0.8, 0.1, 0.0, -0.05), "left": (0.1, 1.0, -0.4, 0.45), "right": (0.1, 1.0, 0.4, 0.45)}


@pytest.mark.parametrize("seed", range(12))
def test_nothing_passes_through_and_no_impact_raises_the_energy(seed):
    cards, shapes = scene(seed)
    rng = random.Random(seed)
    tub = [f"SHAPE {n} 0 box({w},{h}) at=({x},{y})" for n, (w, h, x, y) in TUB.items()]
    touch = f"CONTACT c all e={rng.choice((0.0, 0.3, 0.7))} mu={rng.choice((0.0, 0.3, 0.8))}"
    save = " ".join(f"{q}({b})" for b in shapes for q in ("x", "y", "angle"))
    r = run("\n".join([*tub, *cards, touch]), 1.0, save + " hits(c)")
    assert r["hits(c)"][-1] > 2 and never_rises(r)
    bodies = {n: [np.asarray(r[f"{q}({n})"]) for q in ("x", "y", "angle")] for n in shapes}
    still = np.zeros((3, len(r.time)))
    solid = {n: (placed(box(*at), *still), 0.0) for n, at in TUB.items()}
    solid |= {n: (placed(corners, *bodies[n]), shapes[n][1]) for n, (corners, _) in shapes.items()}
    for j, (one, rim) in enumerate(solid.values()):
        for other, reach in [*solid.values()][max(j + 1, len(TUB)) :]:
            if rim and reach:
                gap = np.hypot(*(one - other)[:, 0].T) - rim - reach
            elif rim or reach:
                gap = apart_disc(*((other, one[:, 0], rim) if rim else (one, other[:, 0], reach)))
            else:
                gap = apart(one, other)
            assert gap.min() > -1e-6


def test_another_order_of_cards_gives_the_same():
    cards, shapes = scene(3)
    save = " ".join(f"{q}({b})" for b in shapes for q in ("x", "y", "angle"))
    runs = [
        run("\n".join([FLOOR, *order, "CONTACT c all e=0.4 mu=0.3"]), 0.6, save, 1e-9)
        for order in (cards, cards[::-1])
    ]
    for name in save.split():
        assert runs[0].at(name, 0.6) == pytest.approx(runs[1].at(name, 0.6), abs=1e-6)


def test_an_elastic_ball_gives_back_its_share():
    r = run(
        FLOOR + "BODY b m=1 shape=disc(0.1) y=0.6\nCONTACT c b floor k=1e6 e=0.5", 0.5, "vy(b) hits(c)", 1e-7
    )
    assert r["hits(c)"][-1] == 1 and r["vy(b)"].max() == pytest.approx(0.5 * sqrt(2 * G * 0.5), rel=0.01)


@pytest.mark.parametrize(
    ("cards", "code", "words"),
    [
        ("BODY a m=1 shape=box(1,1) y=1\nCONTACT c a floor k=100", "E240", "no elastic law"),
        ("BODY a m=1 shape=rod(1) y=1\nCONTACT c a floor e=0", "E240", "no thickness"),
        ("BODY a m=1 shape=polygon(0,0,1,0,0.2,0.2,0,1) y=1\nCONTACT c all e=0", "E232", "not convex"),
        ("BODY a m=1 shape=box(1,1) y=1 omega=(1,0,0)\nCONTACT c all e=0", "E240", "has no depth along z"),
        ("BODY a m=1 shape=box(1,1) y=1\nCONTACT c a flor e=0", "E235", "no body or shape"),
        ("BODY a m=1 j=1\nCONTACT c a floor e=0", "E235", "has no shape"),
        ("BODY a m=1 shape=box(1,1) y=0.2\nCONTACT c all e=0", "E258", "in each other"),
    ],
)
def test_what_is_not_known_is_told(cards, code, words):
    with pytest.raises(emsim.DeckError) as error:
        run(FLOOR + cards, 0.1, "y(a)")
    first = error.value.diagnostics[0]
    assert first.code == code and words in first.message and first.span is not None and first.hint


def test_a_polygon_weighs_what_its_area_does():
    """A right triangle: centre at a third of its sides, Jzz = m (a^2 + b^2)/18."""
    r = emsim.run(
        "t\nBODY p m=2 shape=polygon(0,0,0,0.2,0.3,0) omega=1\n.tran 1m 1m\n.save ke() vy(p)\n.end\n"
    )
    swing = 0.5 * 2 * ((0.1**2 + (0.2 / 3) ** 2) + (0.3**2 + 0.2**2) / 18)
    assert r["ke()"][0] == pytest.approx(swing, rel=1e-9)


def test_corners_that_meet_point_to_point_are_not_passed_in_silence():
    """Two wedges on one floor: no corner of one comes within the edges of the other, and nothing stops them."""
    deck = (
        "two wedges\n.gravity 9.81\nSHAPE floor 0 box(2,0.2) at=(0,-0.1)\n"
        "BODY one m=1 shape=polygon(0,0,-0.02,0.1,-0.1,0.02) x=-0.01 vx=1\n"
        "BODY two m=1 shape=polygon(0,0,0.1,0.02,0.02,0.1) x=0.01 vx=-1\nCONTACT touch all e=0\n.tran 1m 0.03\n"
    )
    with pytest.raises(emsim.ConvergenceError) as found:
        emsim.run(deck)
    assert found.value.diagnostics[0].code == "E415"
    led = emsim.Session(deck, outputs="x(one)")
    with pytest.raises(emsim.ConvergenceError) as found:
        led.run(0.03)
    assert found.value.diagnostics[0].code == "E415"


@pytest.mark.parametrize("lean", [0.0, 0.3])
@pytest.mark.parametrize("wide", [1e-2, 1e-3, 1e-4])
def test_a_plate_stands_on_a_narrow_edge(wide, lean):
    """Both its corners carry, however near they are to each other, while its weight is between them."""
    r = run(
        f"SHAPE f 0 box(2,0.2) at=(0,-0.1)\nBODY b m=1 shape=box({wide},1) com=({lean * wide / 2},0) j=0.083 y=0.5\n"
        "CONTACT c b f e=0",
        1, "angle(b) force(c) mode(c)",
    )  # fmt: skip
    assert abs(r["angle(b)"]).max() < 1e-9 and r["mode(c)"][-1] == 2
    assert r["force(c)"][-1] == pytest.approx(G, rel=1e-9)

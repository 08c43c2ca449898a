"""`.op static` of machines with friction, stops and freewheels: E411 before, now the rest that friction first holds."""

from __future__ import annotations

import numpy as np
import pytest

import emsim

G = 9.81
SLOPE = 0.5  # rad
DOWN = f"axis=({np.cos(SLOPE)},{-np.sin(SLOPE)})"
WEIGHT = 2.0 * 9.81 * np.sin(SLOPE)  # down the slope
BLOCK = f".gravity 9.81\nBODY b m=2 j=1\nJOINT s 0 b slide {DOWN}"
PENDULUM = ".gravity 9.81\nBODY b shape=rod(1) m=1\nJOINT s 0 b pin"


def rest(deck: str, *names: str):
    r = emsim.run(f"at rest\n{deck}\n.op static\n.save all {' '.join(names)}\n.end")
    return {name: float(r[name][0]) for name in r.main.names}, [d.code for d in r.diagnostics], r


@pytest.mark.parametrize("fc", [1.0, 5.0, 8.0, WEIGHT * 0.999])
@pytest.mark.parametrize("ic", [0.0, 0.3])
def test_a_block_on_an_incline_slides_until_its_friction_holds_it(ic, fc):
    """k x = W - fc from above, W + fc from below; nothing moves where that lies behind the start."""
    at, codes, _ = rest(f"{BLOCK} ic={ic}\nSPRING k s k=100\nFRICTION f s fc={fc}", "force(f)", "mode(f)")
    needed = 100 * ic - WEIGHT
    held = abs(needed) <= fc
    where = ic if held else (WEIGHT + np.sign(needed) * fc) / 100
    assert at["pos(s)"] == pytest.approx(where, abs=1e-9)
    assert at["force(f)"] == pytest.approx(100 * where - WEIGHT, abs=1e-6)
    assert at["mode(f)"] == 0.0 and "N240" in codes


@pytest.mark.parametrize("fc", [10.0, 100.0])
def test_a_block_that_friction_holds_stays_where_it_is_drawn(fc):
    at, codes, _ = rest(f"{BLOCK} ic=0.123\nFRICTION f s fc={fc}", "force(f)")
    assert at["pos(s)"] == pytest.approx(0.123, abs=1e-9)
    assert at["force(f)"] == pytest.approx(-WEIGHT, rel=1e-9)
    assert "W241" not in codes


def test_what_has_let_go_slides_at_less_than_what_held_it():
    at, *_ = rest(f"{BLOCK}\nSPRING k s k=100\nFRICTION f s fc=4 fs={WEIGHT + 0.1}")
    assert at["pos(s)"] == pytest.approx(0.0, abs=1e-9)
    at, *_ = rest(f"{BLOCK}\nSPRING k s k=100\nFRICTION f s fc=4 fs={WEIGHT - 0.1}")
    assert at["pos(s)"] == pytest.approx((WEIGHT - 4) / 100, abs=1e-9)


@pytest.mark.parametrize("mu", [0.9 * np.tan(SLOPE), 1.1 * np.tan(SLOPE)])
def test_friction_by_the_load_holds_a_block_up_to_its_angle(mu):
    """mu >= tan(angle); else it lies against its stop, with what friction leaves of its weight."""
    load = 2.0 * 9.81 * np.cos(SLOPE)
    at, *_ = rest(f"{BLOCK}\nSTOP st s max=1\nFRICTION f s mu={mu}", "force(f)", "force(st)")
    if mu > np.tan(SLOPE):
        assert at["pos(s)"] == pytest.approx(0.0, abs=1e-8)
        assert at["force(f)"] == pytest.approx(-WEIGHT, rel=1e-8)
    else:
        assert at["pos(s)"] == pytest.approx(1.0, abs=1e-9)
        assert at["force(f)"] == pytest.approx(-mu * load, rel=1e-8)
        assert at["force(st)"] == pytest.approx(mu * load - WEIGHT, rel=1e-8)


@pytest.mark.parametrize("degrees", [90, 80, 67, 65, 30, 0, -60, -90, 120])
def test_a_pendulum_with_a_rubbing_pin_rests_within_its_band(degrees):
    """It stays where |m g l/2 cos q| <= fc, and falls to where that is so else; upright it stands, held by its friction."""
    fc, turn = 2.0, 9.81 / 2
    at, codes, _ = rest(f"{PENDULUM} ic={degrees}deg\nFRICTION f s fc={fc}", "torque(f)")
    q = np.radians(degrees)
    edge = np.arccos(fc / turn)
    where = q if abs(turn * np.cos(q)) <= fc else -edge if abs(q) < np.pi / 2 else edge + np.pi
    assert at["angle(s)"] == pytest.approx(where, abs=1e-7)
    assert at["torque(f)"] == pytest.approx(turn * np.cos(where), abs=1e-6)
    assert "W241" not in codes


def test_an_upright_pendulum_without_friction_is_still_called_unstable():
    _, codes, _ = rest(f"{PENDULUM} ic=90deg")
    assert "W241" in codes


@pytest.mark.parametrize("order", [("f", "g"), ("g", "f")])
def test_brakes_on_one_shaft_share_their_load_whatever_the_order(order):
    """Equally, up to what each can hold."""
    turn = 9.81 / 2
    brakes = "\n".join(f"FRICTION {name} s fc={4.0 if name == 'f' else 3.0}" for name in order)
    at, *_ = rest(f"{PENDULUM}\n{brakes}", "torque(f)", "torque(g)")
    assert [at["torque(f)"], at["torque(g)"]] == pytest.approx([turn / 2] * 2, rel=1e-6)
    brakes = "\n".join(f"FRICTION {name} s fc={1.0 if name == 'f' else 5.0}" for name in order)
    at, *_ = rest(f"{PENDULUM}\n{brakes}", "torque(f)", "torque(g)")
    assert [at["torque(f)"], at["torque(g)"]] == pytest.approx([1.0, turn - 1.0], rel=1e-6)


def test_a_brake_that_is_pressed_by_an_expression_holds_a_load():
    at, *_ = rest(f"{PENDULUM}\nV1 a 0 3\nR1 a 0 1\nFRICTION f s fc={{2*v(a)}}", "torque(f)")
    assert at["torque(f)"] == pytest.approx(9.81 / 2, rel=1e-9)
    at, *_ = rest(f"{PENDULUM}\nV1 a 0 0.5\nR1 a 0 1\nFRICTION f s fc={{2*v(a)}}", "torque(f)")
    assert at["torque(f)"] == pytest.approx(1.0, rel=1e-6)
    assert at["angle(s)"] == pytest.approx(-np.arccos(2.0 / 9.81), abs=1e-7)


MOTOR = "V1 a 0 6\nMOTOR m a 0 s kt=0.05 r=2 l=1m j=1e-5\nBODY b shape=disc(0.1) m=1\nJOINT s 0 b pin"


def test_a_motor_stalls_where_friction_holds_its_torque():
    """i = V/R, k i = 0.15 N m."""
    at, codes, r = rest(f"{MOTOR}\nFRICTION f s fc=0.2", "torque(f)", "i(m)")
    assert at["i(m)"] == pytest.approx(3.0, rel=1e-9) and at["torque(f)"] == pytest.approx(-0.15, rel=1e-9)
    (said,) = [d.message for d in r.diagnostics if d.code == "N240"]
    assert "FRICTION f with 0.15 of 0.2 N m" in said and "W241" not in codes


def test_a_motor_that_friction_does_not_hold_has_no_rest():
    with pytest.raises(emsim.ConvergenceError, match="E410"):
        rest(f"{MOTOR}\nFRICTION f s fc=0.1")


def test_the_piston_of_a_slider_crank_rubs_at_rest():
    """Virtual work: fc |dx/dq| = |dV/dq| where it stops, V by the heights of the links' middles."""
    r, rod, g = 0.1, 0.3, 9.81
    crank = (
        f".gravity {g}\nBODY crank m=0.1 shape=rod({r})\nBODY rod m=0.1 shape=rod({rod})\nBODY pis m=0.2 j=1e-5\n"
        f"JOINT a 0 crank pin ic=1\nJOINT b crank({r},0) rod pin\nJOINT c rod({rod},0) pis pin\n"
        "JOINT s 0 pis slide axis=(1,0)\n"
    )
    at, *_ = rest(f"{crank}FRICTION f s fc=0.3", "force(f)")
    q = at["angle(a)"]

    def slope(q):  # dV/dq over dx/dq: middles at r/2 sin q, rod's at half the crank pin's height
        climbs = g * (0.1 * r / 2 + 0.1 * r / 2) * np.cos(q)
        goes = -r * np.sin(q) - r * r * np.sin(q) * np.cos(q) / np.sqrt(rod**2 - (r * np.sin(q)) ** 2)
        return climbs / goes

    assert abs(slope(q)) == pytest.approx(0.3, rel=1e-6)
    assert at["force(f)"] == pytest.approx(0.3, rel=1e-6)
    at, *_ = rest(f"{crank}FRICTION f s fc=3", "force(f)")
    assert at["angle(a)"] == pytest.approx(1.0, abs=1e-7)
    assert abs(at["force(f)"]) == pytest.approx(abs(slope(1.0)), rel=1e-6)


def test_a_body_comes_to_rest_on_its_stop():
    """E410 before: it fell through."""
    at, codes, _ = rest(
        ".gravity 9.81\nBODY b m=2 j=1\nJOINT s 0 b slide axis=(0,1) ic=0.3\nSTOP st s min=0.1 max=1",
        "force(st)",
    )
    assert at["pos(s)"] == pytest.approx(0.1, abs=1e-12) and at["force(st)"] == pytest.approx(
        19.62, rel=1e-12
    )
    assert "W241" not in codes


def test_a_freewheel_holds_a_pendulum_one_way():
    at, *_ = rest(f"{PENDULUM} ic=0.3\nFREEWHEEL w s dir=1", "torque(w)")
    assert at["angle(s)"] == pytest.approx(0.3, abs=1e-9)
    assert at["torque(w)"] == pytest.approx(9.81 / 2 * np.cos(0.3), rel=1e-9)
    at, *_ = rest(f"{PENDULUM} ic=0.3\nFREEWHEEL w s dir=-1", "torque(w)")
    assert at["angle(s)"] == pytest.approx(-np.pi / 2, abs=1e-6)


@pytest.mark.parametrize("fc", [0.5, 2.0])
def test_where_statics_says_that_it_rests_it_does(fc):
    """A transient that starts there moves nowhere, with the same friction."""
    deck = f"{PENDULUM} ic={{q}}\nFRICTION f s fc={fc}"
    at, *_ = rest(deck.format(q=0.4), "torque(f)")
    inside = at["angle(s)"] - 1e-3
    r = emsim.run(f"from there\n{deck.format(q=inside)}\n.tran 10m 5\n.save all torque(f)\n.end")
    assert np.asarray(r["angle(s)"]) == pytest.approx(inside, abs=1e-12)


@pytest.mark.parametrize(
    ("cards", "expected"),
    [
        # let fall; drawn where it lies; it tips down on both its corners; in a ring; between two planes
        ("BODY b m=1 j=1 y=0.5\nCONTACT c b 0 line=(0,1) r=0.1", {"x(b)": 0, "y(b)": 0.1, "force(c)": G}),
        ("BODY b m=1 j=1 y=0.1\nCONTACT c b 0 line=(0,1) r=0.1 mu=0.3", {"x(b)": 0, "y(b)": 0.1, "force(c)": G}),
        (
            "BODY b m=1 j=1 y=0.2\nCONTACT c b(-0.1,-0.1) 0 line=(0,1) mu=0.3\nCONTACT d b(0.1,-0.1) 0 line=(0,1) mu=0.3",
            {"y(b)": 0.1, "angle(b)": 0, "force(c)": G / 2, "force(d)": G / 2},
        ),
        (
            "BODY b m=1 j=1 y=0.5 angle=0.1\nCONTACT c b(-0.1,-0.1) 0 line=(0,1)\nCONTACT d b(0.1,-0.1) 0 line=(0,1)",
            {"y(b)": 0.1, "angle(b)": 0, "force(c)": G / 2, "force(d)": G / 2},
        ),
        ("BODY b m=1 j=1 y=-0.3 x=0.2\nCONTACT c b 0 rq=-0.6 r=0.1", {"x(b)": 0, "y(b)": -0.5, "force(c)": G}),
        (
            "BODY b m=1 j=1 y=1 x=0.2\nCONTACT c b 0 line=(1,1) r=0.1\nCONTACT d b 0 line=(-1,1) r=0.1",
            {"x(b)": 0, "y(b)": 0.1 * 2**0.5, "force(c)": G / 2**0.5, "force(d)": G / 2**0.5},
        ),
    ],
)  # fmt: skip
def test_what_lies_on_contacts_rests(cards, expected):
    r = emsim.run(f"t\n.gravity {G}\n{cards}\n.op static\n.print op {' '.join(expected)}\n.end\n")
    for column, value in expected.items():
        assert r[column][-1] == pytest.approx(value, rel=1e-6, abs=1e-9), column
    assert "W241" not in {d.code for d in r.diagnostics}


@pytest.mark.parametrize("law", ["", "k=1meg"])
@pytest.mark.parametrize("mu", [1.2, 0.8, 0.5])
def test_friction_in_two_directions_holds_within_a_circle(law, mu):
    """Pulled with (6, 8) N by two springs: held up to mu N = 10 N, else it slides straight to where mu N holds it."""
    sinks = -G / 1e6 if law else 0.0
    r = emsim.run(f"""a block on a table
.gravity {G}
BODY a m=1u j=(1,1,1)
BODY d m=1u j=(1,1,1)
BODY b m=1 j=(1,1,1)
JOINT p 0 a slide axis=(1,0,0) ic=-0.3
JOINT q a d slide axis=(0,0,1) ic=-0.4
JOINT u d b slide axis=(0,1,0) ic={sinks}
CONTACT c b 0 line=(0,1,0) mu={mu} {law}
SPRING k p k=20
SPRING l q k=20
.op static
.print op pos(p) pos(q) friction(c) force(c)
.end
""")
    held = min(10.0, mu * G)
    assert r["force(c)"][-1] == pytest.approx(G, rel=1e-5)
    assert r["friction(c)"][-1] == pytest.approx(held, rel=1e-5)
    assert [r["pos(p)"][-1], r["pos(q)"][-1]] == pytest.approx([-0.03 * held, -0.04 * held], rel=1e-5)


def test_what_turns_without_end_has_no_rest():
    with pytest.raises(emsim.ConvergenceError, match="no equilibrium"):
        emsim.run(
            f"t\n.gravity {G}\nBODY b m=1 j=1 y=0.1\nCONTACT c b 0 line=(0,1) r=0.1\nTORQUE t b tau=1\n.op static\n.end\n"
        )

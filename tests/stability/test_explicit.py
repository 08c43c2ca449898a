"""Explicit methods where they differ from the implicit ones: what they refuse, closed loops, change points."""

from __future__ import annotations

import numpy as np
import pytest
from support import deck, run

import emsim

METHODS = ("rk45", "dop853")

# (x, y) of the pin that closes the four-bar's loop, on both of its bodies
PIN = ("x(coupler.e)", "x(rocker.e)", "y(coupler.e)", "y(rocker.e)")
FOUR_BAR = (
    deck("mechanical/ref_four_bar")
    .replace(".print tran", ".print tran " + " ".join(PIN))
    .replace("JOINT a ", "POINT coupler.e 0.24 0\nPOINT rocker.e 0.2 0\nJOINT a ")
)


def gaps(options: str) -> tuple[np.ndarray, np.ndarray]:
    """Distance of the pin's two points: at the ends of steps, and on the print grid between them."""
    result = run(FOUR_BAR, options, tran="0.05 20")
    ax, bx, ay, by = (np.asarray(result[name]) for name in PIN)
    gap = np.hypot(ax - bx, ay - by)
    inside = np.abs(result.time / 0.05 - np.round(result.time / 0.05)) < 1e-6
    return gap[~inside], gap[inside]


@pytest.mark.parametrize("method", METHODS)
def test_projection_keeps_the_loop_closed(method):
    """Closed to rounding after every step, between steps to the tolerance; left alone it drifts by 1e9 times more."""
    ends, between = gaps(f"method={method} reltol=1e-6")
    assert ends.max() <= 1e-12 and between.max() <= 1e-7
    ends, _ = gaps(f"method={method} reltol=1e-6 projection=0")
    assert ends[-1] >= 1e-7


@pytest.mark.parametrize("method", METHODS)
def test_projection_holds_what_moves_nothing_else(method):
    """The piston's own angle stands in one closure row and nowhere else: its three joints still sum to nothing."""
    text = deck("bench/slider_crank").replace(".print tran", ".print tran angle(big) angle(small)")
    result = run(text, f"method={method} reltol=1e-6")
    turned = sum(np.asarray(result[f"angle({joint})"]) for joint in ("shaft", "big", "small"))
    assert np.abs(turned).max() <= 1e-12 and np.ptp(np.asarray(result["angle(small)"])) > 0.5


@pytest.mark.parametrize("method", METHODS)
def test_change_points_are_passed_on_the_true_branch(method):
    """Two windows of equal links lie on one line ten times: the closure loses rank there, yet the error falls with the
    tolerance and no step creeps. Binary128: 31.75059718698610182 rad at 10 s, in the other sense."""
    found = []
    for reltol in (1e-5, 1e-7, 1e-9):
        result = run(deck("mechanical/ref_n_four_bar"), f"method={method} reltol={reltol:g}")
        found.append(abs(np.asarray(result["angle(p0)"])[-1] + 31.75059718698610182))
        assert len(result.time) < 2500
    assert found[0] <= 1e-3 and found[1] <= 0.1 * found[0] and found[2] <= 0.1 * found[1], found


def test_bricard_turns_with_a_redundant_constraint():
    """Six hinges, one freedom, one dependent closure row; IFToMM benchmark A04, the angle after 1 s to 22 digits."""
    result = run(deck("mechanical/bricard"), "method=dop853 reltol=1e-9", tran="10m 1")
    assert abs(np.asarray(result["angle(p0)"])[-1] - 1.035028459518062) <= 1e-8


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    "text, why",
    [
        (
            "capacitor across an expression\nB1 a 0 V={5*sin(6283*time)}\nC1 a 0 1u\n.tran 50u 250u 0 1u\n.end\n",
            "loop",
        ),
        ("inductors in series\nB1 0 a I={sin(6.28*time)}\nL1 a 0 1\n.tran 0.1 1\n.end\n", "inductors"),
        (
            "a point mass at the end of a loop\n.gravity 9.81\nBODY crank shape=rod(50m) m=0.1\n"
            "BODY conrod shape=rod(200m) m=0.2\nBODY piston m=0.3\nJOINT shaft 0 crank pin ic=(0.5,10)\n"
            "JOINT big crank(50m,0) conrod pin\nJOINT small conrod(200m,0) piston pin\n"
            "JOINT bore 0 piston slide axis=(1,0)\n.tran 0.1 1\n.end\n",
            "without mass or inertia",
        ),
    ],
    ids=["capacitor-source-loop", "inductor-source-cutset", "freedom-without-inertia"],
)
def test_what_is_no_ode_is_refused_in_words(method, text, why):
    with pytest.raises(emsim.ConvergenceError) as caught:
        run(text, f"method={method}")
    message = str(caught.value)
    assert "E413" in message and why in message and "radau" in message, message


@pytest.mark.parametrize("reltol, limit", [(1e-2, 0.05), (1e-3, 2e-3)])
def test_rows_inside_long_steps_stay_on_the_true_branch(reltol, limit):
    """Rows are closed as well, where that is safe: at a change point it may lead to where one window has folded the other way."""
    text = deck("mechanical/ref_n_four_bar").replace(".print tran", ".print tran angle(p1) angle(p2)")
    result = run(text, f"method=dop853 reltol={reltol:g}")
    upright = np.asarray(result["angle(p0)"])
    assert len(upright) > 2 * result.stats["steps"] and np.ptp(upright) > 20
    for other in ("angle(p1)", "angle(p2)"):
        assert np.abs(np.asarray(result[other]) - upright).max() <= limit


def test_rows_between_steps_are_closed():
    """dop853 has stages of its own for its dense output, and with them the factors to close its rows with."""
    _, between = gaps("method=dop853 reltol=1e-5")
    assert between.max() <= 1e-8


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    "name, shown, force",
    [
        ("mechanical/ref_four_bar", "angle(a) angle(coupler) omega(a) omega(d)", "fx(close)"),
        ("mechanical/bricard", "angle(p0) omega(p0) angle(p4) omega(p4)", "alpha(p2)"),
        ("coupled/ref_slider_crank", "angle(shaft) omega(shaft) i(m1) v(a)", "i(v1) fx(bore)"),
    ],
)
def test_rows_without_forces_are_those_with_them(name, shown, force, method):
    """Where no row shows a force or an acceleration none is computed for it; what else the row shows is the same."""
    text, columns = deck(name), shown.split()
    start = text.index(".print tran")
    rest = text[text.index("\n", start) :]
    plain, full = (
        run(f"{text[:start]}.print tran {read}{rest}", f"method={method} reltol=1e-5")
        for read in (shown, f"{shown} {force}")
    )
    assert np.array_equal(plain.time, full.time) and len(plain.time) > plain.stats["steps"] + 10
    for column in columns:
        a, b = np.asarray(plain[column]), np.asarray(full[column])
        assert np.ptp(a) > 0.0 or column == "v(a)"
        assert np.abs(a - b).max() <= 1e-11 * np.abs(b).max(), column


DRIVEN_LOOP = """five-bar: one crank is driven, the other is free
.gravity 9.81
BODY a shape=rod(0.2) m=1
BODY b shape=rod(0.4) m=1
BODY c shape=rod(0.4) m=1
BODY e shape=rod(0.2) m=1
JOINT ja 0 a pin
JOINT jb a(0.2,0) b pin guess=80deg
JOINT je 0(0.5,0) e pin ic=2.5
JOINT jc e(0.2,0) c pin guess=-80deg
JOINT jd b(0.4,0) c(0.4,0) pin
DRIVE d ja q={0.6+0.3*sin(4*time)}
.print tran angle(je) angle(jb) omega(je) torque(d)
.tran 10m 0.4
.end
"""
DRIVEN_ROD = """a driven arm, a rod, and what slides and turns
.gravity 9.81
BODY a m=1 j=0.1
BODY b m=1 j=0.1 com=(0.3,0.1)
JOINT ja 0 a pin
JOINT js 0(0.2,0.1) b pinslot axis=(1,0)
JOINT jc a(0.5,0) b(0.4,0.2) rod
DRIVE d ja q={0.1*(1-cos(3*time))}
.print tran angle(b) vel(js) fx(jc) torque(d)
.tran 10m 0.3
.end
"""


@pytest.mark.parametrize("method", ["dop853", "rk45", "auto", "radau"])
@pytest.mark.parametrize("text", [DRIVEN_LOOP, DRIVEN_ROD])
def test_rows_of_a_loop_that_is_driven(text, method):
    """Rows inside a step close their loops at their own time: dop853 had the driven angle of another, off by 0.04 rad."""
    found, exact = run(text, f"method={method} reltol=1e-7"), run(text, "method=radau reltol=1e-11")
    end = exact.time[-1]
    for name in text.partition(".print tran ")[2].partition("\n")[0].split():
        scale = np.ptp(exact[name])
        apart = max(abs(found.at(name, t) - exact.at(name, t)) for t in np.arange(0.01, end - 1e-9, 0.01))
        assert apart < 3e-6 * scale, (name, apart, scale)


@pytest.mark.parametrize("method", METHODS)
def test_an_edge_too_short_for_a_step_of_its_own_is_a_jump(method):
    """Edges of 1 ps at t = 2 s lie nearer to each other than corners that are stepped onto, and a step over one began with the
    slope before it: off by 0.03 of a volt. Here i dt is known: up for half of every second, and down by exp(-t)."""
    r = run(
        "RC\nI1 0 a PULSE(0 1 0.5 1p 1p 0.5 1)\nC1 a 0 1\nR1 a 0 1\n.tran 0.02 5\n.end\n", f"method={method}"
    )
    at, v, exact = 0.0, 0.0, np.zeros(len(r.time))
    for k in range(10):  # half a second each, from 0 on
        inside = (r.time >= at) & (r.time <= at + 0.5)
        target = k % 2
        exact[inside] = target + (v - target) * np.exp(-(r.time[inside] - at))
        at, v = at + 0.5, target + (v - target) * np.exp(-0.5)
    assert np.abs(r["v(a)"] - exact).max() < 1e-4


@pytest.mark.parametrize(
    "name, reltol, refused",
    [("trammel", 1e-2, 0), ("trammel", 1e-4, 1), ("bricard", 1e-2, 0), ("bricard", 1e-4, 0)],
)
def test_the_first_step_is_as_long_as_slopes_let_it_be(name, reltol, refused):
    """Not a hundredth of the print grid's spacing, from where it takes three steps more to grow: 11 and 12 steps. (A fifth of
    the trammel's run is too long a step at its end.)"""
    result = run(deck(f"mechanical/{name}"), f"method=dop853 reltol={reltol!r}")
    assert result.stats["steps"] + refused <= 10 and result.stats["rejected"] == refused

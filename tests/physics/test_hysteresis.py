"""Magnetic cores: loops, remanence and losses against closed forms, quadrature and an integrator of scipy's."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq
from support import deck, run

import emsim
from emsim.elements.cores import Material

MU0 = 4e-7 * math.pi
MS, A, K, C, N, AREA, PATH = 1.6e6, 1000.0, 400.0, 0.1, 100.0, 5e-4, 0.1
VOLUME = AREA * PATH
LAWS = ("play", "ja")
SHAPES = ("langevin", "froehlich")

DECK = """a core
{source}
L1 2 0 100
K1 L1 1 steel {b0}
.model steel core(law={law} shape={shape} ms=1.6e6 a=1000 k={k} c=0.1 cells={cells} area=5 path=10 {more})
{analysis}
.save i(l1) v(2) @k1[b] @k1[h] @k1[m] {saved}
.options reltol={tol} {options}
.end
"""


def core(
    source="I1 0 2 0",
    law="play",
    shape="langevin",
    cells=4,
    more="",
    analysis=".op",
    tol=1e-9,
    options="",
    **words,
):
    """The table of a run; a result where energy=True."""
    energy = words.pop("energy", False)
    text = DECK.format(
        source=source, law=law, shape=shape, cells=cells, more=more, analysis=analysis, tol=tol, options=options,
        k=words.get("k", K), b0=words.get("b0", ""), saved=words.get("saved", ""),
    )  # fmt: skip
    return emsim.run(text, energy=energy)


def column(table, name):
    return np.ravel(np.array(table[name], dtype=float))


def man(h, shape):
    x = h / A
    if shape == "froehlich":
        return MS * x / (1.0 + abs(x))
    return MS * (x / 3 - x**3 / 45 if abs(x) < 1e-3 else 1.0 / math.tanh(x) - 1.0 / x)


def slope(h, shape):
    x = h / A
    if shape == "froehlich":
        return MS / A / (1.0 + abs(x)) ** 2
    return (
        MS / A * (1 / 3 - x**2 / 15 if abs(x) < 1e-3 else 1.0 / x**2 - math.sinh(min(abs(x), 300.0)) ** -2.0)
    )


def pinning(cells=4):
    """Means of equally likely parts of an exponential distribution, by quadrature."""
    ends = [-math.log(1 - j / cells) for j in range(cells)] + [np.inf]
    return [K * cells * quad(lambda t: t * math.exp(-t), p, q)[0] for p, q in pairwise(ends)]


def pwl(values, length=1.0):
    return "I1 0 2 PWL(" + " ".join(f"{k * length!r} {v!r}" for k, v in enumerate(values)) + ")"


def test_pinning_fields_are_means_of_an_exponential_distribution():
    cells = Material({"law": "play", "k": K, "c": C, "cells": 4.0}).pinning()
    assert [kappa for kappa, _ in cells] == pytest.approx(pinning(), rel=1e-9)
    assert sum(share for _, share in cells) == pytest.approx(1.0 - C)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("alpha", [0.0, 3e-4])
def test_every_row_is_what_play_operators_make_of_the_field(shape, alpha):
    """A voltage with two frequencies: minor loops inside major ones."""
    voltage = "B1 1 0 V={10*sin(314*time)+9*sin(1100*time)}\nR1 1 2 1"
    t = core(voltage, shape=shape, more=f"alpha={alpha}", analysis=".tran 20u 60m")
    fields, cells = [0.0] * 4, pinning()
    for h, b in zip(column(t, "@k1[h]"), column(t, "@k1[b]"), strict=True):
        he = h + alpha * (b / MU0 - h)
        fields = [min(max(x, he - kappa), he + kappa) for x, kappa in zip(fields, cells, strict=True)]
        m = C * man(he, shape) + (1 - C) / 4 * sum(man(x, shape) for x in fields)
        assert b == pytest.approx(MU0 * (h + m), abs=1e-9)


def by_scipy(shape, alpha, until):
    """Jiles and Atherton under a voltage, by DOP853 from event to event: B and H at the end."""
    omega, amplitude, r = 2 * math.pi * 50, 10.0, 1.0

    def h_of(he, mi):
        return he - alpha * (C * man(he, shape) + (1 - C) * mi)

    def rates(t, y, goes):
        he, mi = y
        e = (amplitude * math.sin(omega * t) - r * h_of(he, mi) * PATH / N) / N
        g = abs(man(he, shape) - mi) / K if goes else 0.0
        fast = e / (AREA * MU0) / (1 + (1 - alpha) * (C * slope(he, shape) + (1 - C) * g))
        return [fast, g * fast]

    def induced(t, y):
        return amplitude * math.sin(omega * t) - r * h_of(*y) * PATH / N

    def behind(t, y):
        return man(y[0], shape) - y[1]

    t, y = 0.0, [0.0, 0.0]
    rises, above = True, True
    while t < until:
        goes = rises == above

        def turns(t, y):
            return induced(t, y)

        def meets(t, y):
            return behind(t, y)

        turns.terminal = meets.terminal = True
        turns.direction, meets.direction = (-1.0 if rises else 1.0), (1.0 if not above else -1.0)
        events = [turns] if goes else [turns, meets]
        s = solve_ivp(
            lambda t, y, goes=goes: rates(t, y, goes), (t, until), y, method="DOP853", rtol=1e-12, atol=1e-7, events=events,
        )  # fmt: skip
        t, y = s.t[-1], s.y[:, -1].tolist()
        if s.status == 1:
            if len(s.t_events[0]):
                rises = not rises
            else:
                above = not above
            if t == 0.0:
                t = 1e-12
    he, mi = y
    h = h_of(he, mi)
    return MU0 * (he + (1 - alpha) * (C * man(he, shape) + (1 - C) * mi)), h


@pytest.mark.parametrize(("shape", "alpha"), [("langevin", 1e-3), ("froehlich", 3e-4)])
def test_jiles_and_atherton_beside_an_integrator_of_scipys(shape, alpha):
    """At three tolerances, the error falling with the tolerance."""
    source = "V1 1 0 SIN(0 10 50)\nR1 1 2 1"
    b, h = by_scipy(shape, alpha, 47e-3)
    errors = []
    for tol in (1e-4, 1e-6, 1e-8):
        t = core(source, "ja", shape, more=f"alpha={alpha}", analysis=".tran 1m 47m", tol=tol)
        errors.append(max(abs(column(t, "@k1[b]")[-1] - b), 1e-3 * abs(column(t, "@k1[h]")[-1] - h)))
    assert errors[0] < 1e-4 and errors[1] < 1e-6 and errors[2] < 1e-8, errors
    assert errors[2] < errors[1] < errors[0], errors


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("scale", [1e-9, 1e6])
def test_loops_do_not_depend_on_the_rate(law, scale):
    turns = [0.0, 2.0, -1.0, 1.5, 0.3]
    found = [core(pwl(turns, s), law, analysis=f".tran {s / 50} {4 * s}") for s in (1.0, scale)]
    ends = [column(t, "@k1[b]")[-1] for t in found]
    assert ends[0] == pytest.approx(ends[1], abs=1e-9)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("method", ["trap", "gear", "radau", "trbdf2", "esdirk", "rk45", "dop853"])
def test_every_method_finds_the_same_loop(law, method):
    source = "V1 1 0 SIN(0 10 50)\nR1 1 2 1"
    t = core(source, law, analysis=".tran 1m 47m", tol=1e-6, options=f"method={method}")
    exact = core(source, law, analysis=".tran 1m 47m", tol=1e-10)
    assert column(t, "@k1[b]")[-1] == pytest.approx(column(exact, "@k1[b]")[-1], abs=5e-5)


@pytest.mark.parametrize("shape", SHAPES)
def test_remanence_and_coercivity_of_play_cells_in_closed_form(shape):
    """From 5000 A/m down: h = H + kappa of every cell once H has fallen by 2 kappa."""
    t = core(pwl([0.0, 5.0, -5.0]), shape=shape, analysis=".tran 1m 2")
    h, b = column(t, "@k1[h]"), column(t, "@k1[b]")
    down = column(t, "time") > 1.0

    def falling(field):
        return MU0 * (
            field + C * man(field, shape) + (1 - C) / 4 * sum(man(field + k, shape) for k in pinning())
        )

    def at(field):
        k = np.argmin(np.where(down, abs(h - field), np.inf))
        return h[k], b[k]

    for field in (0.0, -200.0, -700.0):
        near, found = at(field)
        assert abs(near - field) < 60.0
        assert found == pytest.approx(falling(near), abs=1e-9)
    coercive = brentq(falling, -2000.0, 0.0, xtol=1e-10)
    assert core(pwl([0.0, 5.0, coercive * PATH / N]), shape=shape, analysis=".tran 10m 2")["@k1[b]"][
        -1
    ] == pytest.approx(0.0, abs=1e-8)


@pytest.mark.parametrize("shape", SHAPES)
def test_the_largest_loop_of_jiles_and_atherton_is_that_of_many_play_cells(shape):
    """int e^-t Man(H - k t) dt; the last of n equally likely parts is as wide as ever, so the order is 1 in n."""

    def rising(field):
        lagged = quad(lambda t: math.exp(-t) * man(field - K * t, shape), 0.0, 50.0, limit=200, epsabs=1e-4)[
            0
        ]
        return MU0 * (field + C * man(field, shape) + (1 - C) * lagged)

    turns = pwl([0.0, 20.0, -20.0, 0.5])
    ja = core(turns, "ja", shape, analysis=".tran 10m 3")["@k1[b]"][-1]
    assert ja == pytest.approx(rising(500.0), abs=1e-6)
    errors = [
        abs(core(turns, "play", shape, n, analysis=".tran 10m 3")["@k1[b]"][-1] - ja) for n in (4, 16, 64)
    ]
    assert errors[0] > 2.5 * errors[1] > 7.5 * errors[2], errors


@pytest.mark.parametrize("law", LAWS)
def test_a_minor_loop_lies_within_the_major_one(law):
    turns = [0.0, 4.0, -4.0, 4.0, -0.5, 1.0, -0.5, 1.0]
    t = core(pwl(turns), law, analysis=".tran 2m 7")
    time, h, b = (column(t, name) for name in ("time", "@k1[h]", "@k1[b]"))
    up, down = (time >= 2.0) & (time <= 3.0), (time >= 1.0) & (time <= 2.0)
    order = np.argsort(h[down])
    for k in np.flatnonzero(time >= 3.0):
        upper, lower = np.interp(h[k], h[down][order], b[down][order]), np.interp(h[k], h[up], b[up])
        assert lower - 1e-4 <= b[k] <= upper + 1e-4


def test_play_cells_come_back_to_where_a_minor_loop_began():
    """Return-point memory, and the minor loop is wiped out: on goes the larger one."""
    turns = [0.0, 4.0, -1.0, 0.8, -1.0, 2.0]
    loop = core(pwl(turns), analysis=".tran 10m 5")
    straight = core(pwl([0.0, 4.0, -1.0, 2.0]), analysis=".tran 10m 3")
    time, b = column(loop, "time"), column(loop, "@k1[b]")
    first, again = (b[np.argmin(abs(time - t))] for t in (2.0, 4.0))
    assert first == pytest.approx(again, abs=1e-10)
    assert b[-1] == pytest.approx(column(straight, "@k1[b]")[-1], abs=1e-10)


def loss_by_hand(law, shape, top):
    """Of one cycle between -top and top [A/m], alpha 0, in the steady state [J]."""
    if law == "play":
        lost = [2 * k * (man(top - k, shape) - man(k - top, shape)) for k in pinning() if k < top]
        return MU0 * VOLUME * (1 - C) / 4 * sum(lost)

    def leg(start):
        return solve_ivp(
            lambda h, m: [max(man(h, shape) - m[0], 0.0) / K], (-top, top), [start], method="DOP853", rtol=1e-11, atol=1e-4,
            max_step=40.0, dense_output=True,
        )  # fmt: skip

    # the tip, where the rising leg ends as high as the falling one begins
    tip = brentq(lambda m: leg(-m).y[0, -1] - m, 0.0, MS, xtol=1e-4)
    whole = solve_ivp(
        lambda h, y: [g := max(man(h, shape) - y[0], 0.0) / K, h * g],
        (-top, top), [-tip, 0.0], method="DOP853", rtol=1e-12, atol=[1e-4, 1e-2], max_step=20.0,
    )  # fmt: skip
    # twice int H dM of the rising leg
    return MU0 * VOLUME * (1 - C) * 2 * whole.y[1, -1]


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("shape", SHAPES)
def test_the_loss_of_a_cycle_is_the_area_of_its_loop(law, shape):
    """In the ledger, to 1e-8; and no energy is left over."""
    found = []
    for cycles in (4, 5):
        r = core(
            "I1 0 2 SIN(0 3 50)",
            law,
            shape,
            analysis=f".tran 1m {cycles * 20 + 5}m 0 20u",
            tol=1e-10,
            energy=True,
        )
        found.append(r.energy)
        assert abs(r.energy.share) < 5e-7  # of what the source gave, by quadrature over its kinks
    heat = [next(x.dissipated for x in e.lines if x.name == "k1") for e in found]
    stored = [next(x.stored for x in e.lines if x.name == "k1") for e in found]
    area = loss_by_hand(law, shape, 3.0 * N / PATH)
    assert heat[1] - heat[0] == pytest.approx(area, rel=1e-8)
    assert stored[1] == pytest.approx(stored[0], rel=1e-8)


@pytest.mark.parametrize("law", LAWS)
def test_heat_is_never_negative(law):
    voltage = "B1 1 0 V={10*sin(314*time)+9*sin(1100*time)}\nR1 1 2 1"
    t = core(voltage, law, analysis=".tran 20u 60m", tol=1e-6, saved="@k1[loss]")
    lost = column(t, "@k1[loss]")
    assert lost.min() > -1e-6 * lost.max()


@pytest.mark.parametrize("shape", SHAPES)
def test_without_pinning_a_core_is_its_anhysteretic_curve(shape):
    t = core("I1 0 2 SIN(0 3 50)", "ja", shape, more="alpha=2e-4", k=0, analysis=".tran 1m 30m")
    for h, b in zip(column(t, "@k1[h]"), column(t, "@k1[b]"), strict=True):
        m = b / MU0 - h
        assert m == pytest.approx(man(h + 2e-4 * m, shape), abs=1e-5 * MS)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("step", [0.5, 0.05])
def test_a_sweep_follows_the_loop_whatever_its_steps(law, step):
    """.op is the end of the first magnetisation, .dc goes on from point to point."""
    slow = [
        core(pwl(turns), law, analysis=f".tran 10m {len(turns) - 1}")["@k1[b]"][-1]
        for turns in ([0.0, 2.0], [0.0, 2.0, -1.0])
    ]
    assert column(core("I1 0 2 2", law), "@k1[b]")[-1] == pytest.approx(slow[0], abs=1e-8)
    sweep = column(core(law=law, analysis=f".dc I1 2 -1 {-step}"), "@k1[b]")
    assert sweep[0] == pytest.approx(slow[0], abs=1e-8)
    assert sweep[-1] == pytest.approx(slow[1], abs=1e-7)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("shape", SHAPES)
def test_small_signals_see_the_reversible_permeability(law, shape):
    alpha = 3e-4
    t = core("I1 0 2 2 AC 1", law, shape, more=f"alpha={alpha}", analysis=".ac lin 1 1k 1k")
    point = core("I1 0 2 2", law, shape, more=f"alpha={alpha}")
    h, m = column(point, "@k1[h]")[-1], column(point, "@k1[m]")[-1]
    rise = C * slope(h + alpha * m, shape)
    inductance = MU0 * N**2 * AREA / PATH * (1 + rise / (1 - alpha * rise))
    v = np.ravel(t["v(2)"])[0]
    assert v.imag == pytest.approx(2 * math.pi * 1e3 * inductance, rel=1e-6)
    assert abs(v.real) < 1e-9


@pytest.mark.parametrize("law", LAWS)
def test_a_transformer_rushes_in_as_its_remanence_says(law):
    """Switched on at a zero of its voltage, without resistance: B = B0 + V/(N A w) (1 - cos w t), whatever the core does."""
    b0, peak = 0.2, 8.0
    t = core(f"V1 2 0 SIN(0 {peak} 50)", law, b0=f"b0={b0}", analysis=".tran 1m 10m", tol=1e-8)
    swing = 2 * peak / (N * AREA * 2 * math.pi * 50)
    assert column(t, "@k1[b]")[0] == pytest.approx(b0, abs=1e-9)
    assert column(t, "@k1[b]")[-1] == pytest.approx(b0 + swing, abs=1e-8)
    without = core(f"V1 2 0 SIN(0 {peak} 50)", law, analysis=".tran 1m 10m")
    assert abs(column(t, "i(l1)")[-1]) > 1.2 * abs(column(without, "i(l1)")[-1])


def test_windings_share_flux_and_magnetomotive_force():
    text = """two windings
V1 1 0 SIN(0 10 50)
R1 1 2 1
L1 2 0 100
L2 3 0 25
R2 3 0 10
K1 L1 L2 1 steel
.model steel core(law=play ms=1.6e6 a=1000 k=400 c=0.1 area=5 path=10 gap=0.05)
.tran 100u 40m
.save i(l1) i(l2) v(2) v(3) @k1[b] @k1[h]
.options reltol=1e-8
.end
"""
    t = emsim.run(text)
    v2, v3, i1, i2, b, h = (column(t, n) for n in ("v(2)", "v(3)", "i(l1)", "i(l2)", "@k1[b]", "@k1[h]"))
    assert np.abs(v2 - 4 * v3).max() < 1e-9
    assert np.abs(h * PATH + b * 5e-4 / MU0 - 100 * i1 - 25 * i2).max() < 1e-6 * np.abs(100 * i1).max()


def test_a_core_at_rest_stays_as_it_is():
    """The current dies away: no chatter of a sign, and the remanence is left for ever."""
    t = core("I1 0 2 PULSE(0 3 0 1m 1m 1m)", analysis=".tran 10m 1000", tol=1e-4)
    assert column(t, "@k1[b]")[-1] == pytest.approx(
        MU0 * (1 - C) / 4 * sum(man(k, "langevin") for k in pinning()), abs=1e-9
    )
    assert t.stats["steps"] < 500


def test_the_core_that_is_offered_for_ltspices_has_its_largest_loop():
    """B = Bs (H +- Hc)/(|H +- Hc| + Hc (Bs/Br - 1)) + mu0 H."""
    hc, bs, br = 16.0, 0.44, 0.10
    with pytest.raises(emsim.DeckError) as said:
        emsim.run(
            f"LTspice's\nI1 0 1 1\nL1 1 0 Hc={hc} Bs={bs} Br={br} A=0.0000251 Lm=0.0198 Lg=0 N=100\n.op\n.end\n"
        )
    hint = str(said.value).partition("help: ")[2]
    model = hint[hint.index(".model") : hint.index("):") + 1]
    t = emsim.run(
        f"offered\nI1 0 1 PWL(0 0 1 0.05 2 -0.05)\nL1 1 0 100\nK1 L1 1 core1\n{model}\n.tran 10m 2\n"
        ".save @k1[b] @k1[h]\n.options reltol=1e-9\n.end\n"
    )
    for time, h, b in zip(column(t, "time"), column(t, "@k1[h]"), column(t, "@k1[b]"), strict=True):
        if time > 1.2:
            assert b == pytest.approx(bs * (h + hc) / (abs(h + hc) + hc * (bs / br - 1)) + MU0 * h, abs=1e-6)


@pytest.mark.parametrize("law", LAWS)
def test_the_ledger_closes_under_a_voltage(law):
    source = "V1 1 0 SIN(0 10 50)\nR1 1 2 1"
    share = [
        abs(core(source, law, analysis=".tran 1m 60m", tol=tol, energy=True).energy.share)
        for tol in (1e-4, 1e-8)
    ]
    assert share[0] < 1e-6 and share[1] < 1e-9, share


def test_the_deck_of_a_transformer_that_is_switched_on():
    """Flux along the first half wave by DOP853, the field by bisection of the play cells' curve."""
    t = run(deck("electrical/transformer_inrush"), "reltol=1e-8")
    numbers = {"ms": 1.6e6, "a": 20.0, "k": 40.0, "c": 0.1, "area": 25.0, "path": 40.0}
    material = Material({"law": "play", "shape": "langevin", **numbers})
    start = material.at_rest(0.6)
    assert start is not None
    cells = list(zip(material.pinning(), start[1], strict=True))

    def excess(h, b):
        m = 0.1 * material.man(h) + sum(w * material.man(min(max(x, h - k), h + k)) for (k, w), x in cells)
        return MU0 * (h + m) - b

    def both(time, flux):
        """(V per turn, current of the primary): 50 turns feed 100 Ohm."""
        force = 0.4 * brentq(excess, -1e7, 1e7, args=(flux / 25e-4,), xtol=1e-9, rtol=1e-14)
        e = (325.0 * math.sin(100 * math.pi * time) - 2.0 * force / 500) / (500 + 2.0 * 25.0 / 500)
        return e, (force + 25.0 * e) / 500

    s = solve_ivp(
        lambda time, y: [both(time, y[0])[0]], (0.0, 7e-3), [0.6 * 25e-4], method="DOP853", rtol=1e-10, atol=1e-13,
        dense_output=True, max_step=2e-4,
    )  # fmt: skip
    for time in (2e-3, 5e-3, 7e-3):
        current = both(time, s.sol(time)[0])[1]
        assert t.at("i(l1)", time) == pytest.approx(current, rel=1e-5)


WRONG = """a core that cannot be
V1 1 0 SIN(0 1 50)
R1 1 2 1
L1 2 0 100
K1 L1 1 steel
.model steel core(ms=1.6e6 a=1000 k=400)
.tran 1m 20m
.end
"""


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("L1 2 0 100", "L1 2 0 100 m=2", "m= of `l1` has no meaning"),
        ("L1 2 0 100", "L1 2 0 100 ic=1", "b0= of `k1`"),
        ("L1 2 0 100", "L1 2 0 -100", "number of its turns"),
        ("L1 2 0 100", "L1 2 0 {time}", "is an expression"),
        ("L1 2 0 100", "L1 2 0 steel", "windings of a core stand in a K line"),
        ("K1 L1 1 steel", "K1 L1 1 steel\nK2 L1 1 steel", "wound on the cores of `k1` and of `k2`"),
        (
            "K1 L1 1 steel",
            "K1 L1 1 steel\nL2 3 0 1m\nR3 3 0 1\nK2 L1 L2 0.9",
            "a winding of 100 turns on a core",
        ),
        ("K1 L1 1 steel", "K1 L1 1 steel 2", "size of a core"),
        ("K1 L1 1 steel", "K1 L1 1 steel b0=9", "at most 0.388 T"),
        ("K1 L1 1 steel", "K1 L1 steel", "needs two inductors and a coupling"),
        ("ms=1.6e6", "ms=-1", "ms must be above 0"),
        ("k=400", "c=2", "from 0 to 1"),
        ("k=400", "alpha=1", "magnetises itself"),
        ("k=400", "law=preisach", "none of ja, play"),
    ],
)
def test_a_core_that_cannot_be_is_told(old, new, words):
    assert old in WRONG
    with pytest.raises(emsim.DeckError) as said:
        emsim.run(WRONG.replace(old, new))
    assert words in str(said.value)

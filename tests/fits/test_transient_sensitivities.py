"""`.sens .. tran`: derivatives along a transient, beside closed forms and beside differences of runs at tight tolerances."""

from __future__ import annotations

import numpy as np
import pytest

import emsim
from emsim import pipeline
from emsim.diagnostics import Span
from emsim.elaborate.quantity import value, with_values

METHODS = ("auto", "trap", "gear", "radau", "trbdf2", "esdirk", "gauss", "rk45", "dop853")

CHARGING = """charging
.param r=1k
V1 a 0 1
R1 a b {r}
C1 b 0 1u IC=0
.tran 50u 5m uic
.sens v(b) i(v1) tran by r c1 v1
.end
"""

PENDULUM = """pendulum
.param l=1 b=0.05
.gravity 9.81
BODY  bob   m=1 com=({l},0) j=0
JOINT hinge 0 bob pin zero=-90deg ic=90deg damp={b}
.tran 0.05 3
.print tran angle(hinge) omega(hinge)
.sens angle(hinge) omega(hinge) tran by l b bob(m)
.end
"""

MOTOR = """motor
.param r=1 l=0.5m k=0.05 j=1e-5 b=1e-5 tc=2m
V1    a 0 12
BODY  rotor m=1 j={j}
JOINT shaft 0 rotor pin damp={b}
MOTOR m1 a 0 shaft kt={k} r={r} l={l} tc={tc}
.tran 1m 0.05 UIC
.print tran omega(shaft) i(m1)
.sens omega(shaft) i(m1) tran by r l k j b tc m1(l)
.end
"""

FOUR_BAR = """four bar
.param reach=0.24
.gravity 9.81
BODY  crank   shape=rod(0.10) m=0.10
BODY  coupler shape=rod({reach}) m=0.24
BODY  rocker  shape=rod(0.20) m=0.20
JOINT a     0             crank   pin ic=(0,10)
JOINT b     crank(0.10,0) coupler pin guess=56deg
JOINT d     0(0.22,0)     rocker  pin guess=86deg
JOINT close coupler({reach},0) rocker(0.20,0) pin
.tran 0.02 1
.print tran angle(a) fx(close)
.sens angle(a) fx(close) tran by reach rocker(m)
.end
"""

RECTIFIER = """rectifier
V1 a 0 SIN(0 5 500)
R1 a b 10
D1 b c dm
C1 c 0 10u
R2 c 0 1k
.model dm d is=1e-12 n=1.2 cjo=1n
.tran 20u 4m
.print tran v(c) i(v1)
.sens v(c) i(v1) tran by r1 c1 dm(is) dm(n)
.end
"""

OSCILLATOR = """relaxation oscillator
.param r=10k c=100n vt=2
V1 a 0 5
R1 a b {r}
C1 b 0 {c} IC=0
S1 b 0 b 0 sx
.model sx SW(vt={vt} vh=1 ron=100 roff=100meg)
.tran 10u 3m uic
.print tran v(b)
.sens v(b) tran by r c vt sx(vh)
.end
"""

COMPARATOR = """comparator
.param r=1k th=0.4
V1 a 0 1
R1 a b {r}
C1 b 0 1u IC=0
B1 c 0 V={v(b) > th ? 2 : 0.5}
R2 c d 2k
C2 d 0 0.5u IC=0
.tran 10u 5m uic
.print tran v(d)
.sens v(d) tran by r th
.end
"""

BOUNCE = """a ball on an elastic floor
.gravity 9.81
BODY ball m=1
JOINT j 0 ball slide axis=(0,1) ic=1
STOP s j min=0 k=1e5 c=10
.tran 1m 1
.print tran pos(j) vel(j)
.sens pos(j) vel(j) tran by s(k) ball(m)
.end
"""


def sensitivities(deck: str, method: str = "auto", reltol: float = 1e-8):
    return emsim.run(deck, method=method, reltol=reltol).table("sens")


@pytest.mark.parametrize("method", METHODS)
def test_charging_has_its_closed_form_under_every_method(method):
    table = sensitivities(CHARGING, method, 1e-7)
    t, r, c = table["time"], 1e3, 1e-6
    decay = np.exp(-t / (r * c))
    exact = {
        "sens(v(b),r)": -t / (r * r * c) * decay,
        "sens(v(b),c1)": -t / (r * c * c) * decay,
        "sens(v(b),v1)": 1.0 - decay,
        "sens(i(v1),r)": decay * (1.0 / r**2 - t / (r**3 * c)),
        "sens(i(v1),v1)": -decay / r,
    }
    loose = 20.0 if method in ("trap", "gear", "trbdf2") else 1.0
    for name, form in exact.items():
        assert np.abs(table[name] - form).max() < loose * 1e-6 * np.abs(form).max(), name


def test_errors_shrink_with_the_tolerance():
    def error(reltol: float) -> float:
        table = sensitivities(CHARGING, "radau", reltol)
        t = table["time"]
        return float(np.abs(table["sens(v(b),r)"] + t * 1e-0 * np.exp(-t / 1e-3)).max())

    assert error(1e-10) < 0.01 * error(1e-6)


def test_a_resonance_has_its_closed_form():
    table = sensitivities(
        "lc\nL1 a 0 1m IC=1\nC1 a 0 1u IC=0\n.tran 2u 300u uic\n.sens i(l1) tran by l1 c1\n.end\n",
        reltol=1e-10,
    )
    t, w = table["time"], 1.0 / np.sqrt(1e-3 * 1e-6)
    # i = cos(w t), w = (L C)^-1/2
    assert np.abs(table["sens(i(l1),l1)"] - t * np.sin(w * t) * w / (2 * 1e-3)).max() < 1e-6 * 3e-4 * w / 2e-3
    assert np.abs(table["sens(i(l1),c1)"] - t * np.sin(w * t) * w / (2 * 1e-6)).max() < 1e-6 * 3e-4 * w / 2e-6


def other(deck: str, name: str, moved: float):
    """The transient alone, with another value of a quantity."""
    read = pipeline.load(deck)
    here = value(pipeline.flatten(read), name)
    flat = with_values(read, {name: here * (1.0 + moved)}, Span(read.file, 1, 1, 2))
    flat.analyses = [card for card in flat.analyses if card.kind == "tran"]
    assembly, planned = pipeline.prepare(flat, {"reltol": 1e-11})
    return here, pipeline.deliver(assembly, pipeline.solve(assembly, planned)).main


@pytest.mark.parametrize(
    ("deck", "moved", "bound"),
    [
        (PENDULUM, 1e-4, 2e-3),
        (MOTOR, 1e-3, 3e-3),
        (FOUR_BAR, 1e-4, 2e-3),
        (RECTIFIER, 1e-3, 2e-3),
        (OSCILLATOR, 1e-5, 2e-3),
        (COMPARATOR, 1e-4, 1e-4),
        (BOUNCE, 1e-4, 3e-3),
    ],
    ids=["pendulum", "motor", "four bar", "rectifier", "oscillator", "comparator", "bounce"],
)
def test_differences_of_runs_are_the_same(deck, moved, bound):
    table = sensitivities(deck, reltol=1e-10)
    grid = np.linspace(table["time"][0], table["time"][-1], 61)[1:-1]
    for name in [name for name in table.names if name.startswith("sens(")]:
        output, _, quantity = name.removeprefix("sens(").removesuffix(")").rpartition(",")
        here, up = other(deck, quantity, moved)
        _, down = other(deck, quantity, -moved)
        difference = (up.at(output, grid) - down.at(output, grid)) / (2.0 * moved * here)
        # at times at which the curves jump or turn they are not to be compared: all but a few are
        off = np.abs(table.at(name, grid) - difference)
        scale = np.abs(difference).max()
        assert np.sort(off)[-4] < bound * scale, name


def test_without_by_the_parameters_of_the_deck_count():
    names = emsim.run(MOTOR.replace(" by r l k j b tc m1(l)", "")).table("sens").names
    assert [n for n in names if n.startswith("sens(i(m1)")] == [
        f"sens(i(m1),{p})" for p in ("r", "l", "k", "j", "b", "tc")
    ]


@pytest.mark.parametrize(
    ("lines", "code", "said"),
    [
        (
            "V1 a 0 PULSE(0 1 {td} 1u 1u 1 2)\nR1 a b 1k\nC1 b 0 1u\n"
            "V2 d 0 PULSE(0 1 1m 1u 1u 1 2)\nR2 d b 1k\n.sens v(b) tran by td",
            "E423",
            "`td` parts corners",
        ),
        (
            "V1 a 0 1\nR1 a b 1k\nT1 b 0 c 0 z0=50 td=1n\nR2 c 0 50\n.sens v(c) tran by r1",
            "E364",
            "what was a time ago",
        ),
        ("V1 a 0 1\nR1 a b 1k\nC1 b 0 1u\n.sens v(b) tran by q7", "E346", "`q7`"),
        ("V1 a 0 1\nR1 a b 1k\nC1 b 0 1u\n.sens tran by r1", "E305", "takes signals"),
        (
            "V1 a 0 1\nR1 a b 1k\nC1 b 0 1u\n.options method=multirate\n.sens v(b) tran by r1",
            "E364",
            "multirate",
        ),
    ],
)
def test_what_has_no_derivative_is_refused_by_name(lines, code, said):
    with pytest.raises((emsim.DeckError, emsim.ConvergenceError)) as refused:
        emsim.run(f"refused\n.param td=1m\n{lines}\n.tran 50u 5m\n.end\n")
    assert any(d.code == code and said in d.message for d in refused.value.diagnostics)


def test_behind_an_impact_a_ball_has_its_closed_form():
    deck = (
        BOUNCE.replace("k=1e5 c=10", "e={e}")
        .replace("ic=1", "ic={h}")
        .replace("by s(k) ball(m)", "by h e ball(m)")
    )
    table = sensitivities(deck.replace(".gravity", ".param h=1 e=0.5\n.gravity"))
    g, e, t = 9.81, 0.5, 0.6
    first = np.sqrt(2.0 / g)
    flight, speed = t - first, np.sqrt(2.0 * g)
    by_h = e * (0.5 * speed * flight - speed * 0.5 * first) + g * flight * 0.5 * first
    assert table.at("sens(pos(j),h)", t) == pytest.approx(by_h, rel=1e-6)
    assert table.at("sens(pos(j),e)", t) == pytest.approx(speed * flight, rel=1e-6)
    assert abs(table.at("sens(vel(j),ball(m))", t)) < 1e-6


def test_a_source_whose_corner_moves_has_its_closed_form():
    deck = "late\n.param td=1m\nV1 a 0 PULSE(0 1 {td} 1n 1n 1 2)\nR1 a b 1k\nC1 b 0 1u\n.tran 50u 5m\n.sens v(b) tran by td\n"
    table = sensitivities(deck + ".end\n")
    for t in (0.5e-3, 2e-3, 4e-3):
        exact = -1e3 * np.exp(-(t - 1e-3) / 1e-3) if t > 1e-3 else 0.0
        assert table.at("sens(v(b),td)", t) == pytest.approx(exact, rel=1e-5, abs=1e-3)


def test_an_altered_deck_is_refused():
    deck = emsim.Deck(CHARGING)
    deck.alter("c1", 2e-6)
    with pytest.raises(emsim.ConvergenceError, match="altered"):
        deck.run()


def test_outputs_that_hang_on_the_parameter_itself_have_that_too():
    table = sensitivities(
        "divider\n.param r=1k\nV1 a 0 2\nR1 a b {r}\nR2 b 0 1k\n.tran 1m 2m\n.sens i(r1) tran by r\n.end\n"
    )
    assert table["sens(i(r1),r)"] == pytest.approx(-2.0 / 2000.0**2)


def test_what_slides_the_other_way_is_in_the_mode_that_it_was_in():
    """Two links with friction: each reverses while the other one moves it on, without a stop."""
    deck = """two links with friction
.param c=20m
.gravity 9.81
BODY a shape=rod(0.3) m=0.2
BODY b shape=rod(0.2) m=0.1
JOINT j1 0 a pin zero=-90deg ic=80deg
JOINT j2 a(0.3,0) b pin ic=40deg
FRICTION f1 j1 fc={c}
FRICTION f2 j2 fc={c}
.tran 5m 1
.print tran angle(j1) angle(j2)
.sens angle(j1) angle(j2) tran by c b(m)
.end
"""
    table = sensitivities(deck, reltol=1e-9)
    grid = np.linspace(0.02, 0.98, 49)
    for quantity in ("c", "b(m)"):
        here, up = other(deck, quantity, 1e-4)
        _, down = other(deck, quantity, -1e-4)
        for output in ("angle(j1)", "angle(j2)"):
            difference = (up.at(output, grid) - down.at(output, grid)) / (2e-4 * here)
            off = np.abs(table.at(f"sens({output},{quantity})", grid) - difference)
            assert off.max() < 2e-3 * np.abs(difference).max(), (quantity, output)

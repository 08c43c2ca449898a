"""`emsim.Deck.gradient` along transients with events: beside closed forms, and beside differences of runs at tight tolerances."""

from __future__ import annotations

import numpy as np
import pytest

import emsim

BALL = """a ball that bounces
.param h=1 e=0.8 g=9.81
.gravity {g}
BODY ball m=1
JOINT j 0 ball slide axis=(0,1) ic={h}
STOP s j min=0 e={e}
.tran 1m 1.3
.meas tran second when pos(j)=0 fall=2
.meas tran top max pos(j) from=0.6 to=1.2
.meas tran low avg pos(j) from=0 to=1.2
.meas tran speed find vel(j) at=1.25
.end
"""

BUCK = """a converter whose edge moves
.param d=0.4 t=10u l=47u c=22u vin=12
V1 in 0 {vin}
Vg g 0 PULSE(0 5 0 100n 100n {d*t-100n} {t})
S1 in sw g 0 sw
D1 0 sw dm
L1 sw out {l} IC=0
C1 out 0 {c} IC=0
R1 out 0 5
.model sw SW(vt=2.5 vh=0 ron=50m roff=1meg)
.model dm d is=1e-9 n=1
.tran 1u 60u uic
.meas tran vout avg v(out) from=22u to=58u
.meas tran ipk max i(l1)
.meas tran gate avg v(g) from=22u to=58u
.end
"""

RELAY = """a thermostat
.param r=10k c=1u on=2.2 off=1.4
V1 a 0 5
S1 a b 0 b sx
.model sx SW(vt={-(on+off)/2} vh={(on-off)/2} ron={r} roff=1g)
Cb b 0 {c} IC=0
Rb b 0 20k
.tran 100u 60m uic
.meas tran period trig v(b) val=1.8 rise=2 targ v(b) val=1.8 rise=3
.meas tran mean avg v(b) from=20m to=60m
.end
"""

BRAKE = """a disc that a brake stops
.param fc=2 j0=0.01 w0=50
BODY disc m=1 j={j0}
JOINT s 0 disc pin ic=(0,{w0})
FRICTION f s fc={fc}
.tran 1m 0.4
.meas tran turned find angle(s) at=0.4
.meas tran slow when omega(s)=1
.end
"""

STOP = """a mass on a spring against a stop
.param k=40 e=0.5 m=1 x0=0.1
BODY b m={m}
JOINT s 0 b slide ic=({x0},0)
SPRING sp s k={k}
DAMPER d s c=0.5
STOP st s min=-0.05 max=1 e={e}
.tran 1m 2
.meas tran x find pos(s) at=1.9
.meas tran peak max pos(s) from=0.5
.meas tran pushed rms vel(s)
.end
"""

RECTIFIER = """a rectifier
.param vp=5 r=10 c=10u
V1 a 0 SIN(0 {vp} 500)
R1 a b {r}
D1 b c dm
C1 c 0 {c} IC=0
R2 c 0 1k
.model dm d is=1e-12 n=1.2
.tran 20u 8m uic
.meas tran top max v(c)
.meas tran ripple pp v(c) from=4m to=8m
.meas tran drop param='top-ripple/2'
.end
"""

OSCILLATOR = """a comparator that swings between its rails
.param r=10k c=100n a=10k b=10k
Rf out m {r}
C1 m 0 {c} IC=0
Ra out p {a}
Rb p 0 {b}
S1 vp out p m sx ON
S2 out vn p m sy ON
.model sx SW(vt=0 vh=0 ron=1 roff=1meg)
.model sy SW(vt=0 vh=0 ron=1meg roff=1)
Vp vp 0 5
Vn vn 0 -5
Cp p 0 1p IC=2
.tran 10u 8m uic
.meas tran period trig v(m) val=0 rise=2 targ v(m) val=0 rise=3
.meas tran top max v(m) from=2m to=4m
.end
"""

MOTOR = """a motor against its end stop
.param r=2 k=20m e=0.3 v=3
V1 a 0 {v}
BODY arm m=0.2 j=1m
JOINT s 0 arm pin damp=1m
MOTOR m1 a 0 s kt={k} r={r} l=1m j=2u
STOP st s min=-1 max=0.5 e={e}
.tran 1m 0.28
.meas tran hit when omega(s)=0 fall=1
.meas tran ipk max i(m1)
.meas tran charge integ i(m1)
.meas tran x find angle(s) at=0.25
.end
"""

PENDULUM = """a pendulum that hits a wall
.param l=0.5 e=0.6 w=0.1
.gravity 9.81
BODY bob m=1 com=({l},0) j=0
JOINT hinge 0 bob pin zero=-90deg ic=60deg damp=0.02
STOP wall hinge min={w} max=3 e={e}
.tran 5m 1.6
.meas tran back max angle(hinge) from=0.5
.meas tran t2 when angle(hinge)=0.3 fall=2
.meas tran x find angle(hinge) at=1.5
.end
"""

THYRISTOR = """a dimmer whose firing moves
.param vp=10 alpha=3m rl=10
V1 a 0 SIN(0 {vp} 50)
Vg g 0 PULSE(0 1 {alpha} 1u 1u 1m 10m)
B1 q 0 V={v(g) > 0.5 ? 1 : (i(l1) > 1m ? 1 : 0)}
S1 a b q 0 sx
.model sx SW(vt=0.5 vh=0 ron=0.1 roff=1meg)
L1 b c 5m IC=0
R1 c 0 {rl}
.tran 20u 25m uic
.meas tran mean rms v(c) from=0 to=20m
.meas tran pk max i(l1)
.meas tran x find i(l1) at=25m
.end
"""


def differences(deck: str, name: str, names: list[str]) -> np.ndarray:
    """Derivatives of measures by central differences of runs, extrapolated (Richardson) to fourth order."""
    here = emsim.Deck(deck).parameters()[name]

    def run(by: float) -> np.ndarray:
        result = emsim.run(deck, {name: repr(here + by)}, reltol=1e-10)
        return np.array([result.measures[measure] for measure in names])

    def central(by: float) -> np.ndarray:
        return (run(by) - run(-by)) / (2.0 * by)

    far = 2e-3 * abs(here)
    return (4.0 * central(0.5 * far) - central(far)) / 3.0


DECKS = {
    "ball": BALL, "buck": BUCK, "relay": RELAY, "brake": BRAKE, "stop": STOP, "rectifier": RECTIFIER, "oscillator": OSCILLATOR,
    "motor": MOTOR, "pendulum": PENDULUM, "thyristor": THYRISTOR,
}  # fmt: skip


@pytest.mark.parametrize("deck", DECKS.values(), ids=DECKS)
def test_ten_decks_with_events_have_the_derivatives_of_their_runs(deck):
    """To 1e-6 of the derivative; where a measure hardly hangs on a quantity, to 1e-6 of the measure over the quantity."""
    g = emsim.Deck(deck, options={"reltol": 1e-10}).gradient()
    assert not g.remarks
    for k, name in enumerate(g.by):
        here = abs(emsim.Deck(deck).parameters()[name])
        off = np.abs(g.matrix[:, k] - differences(deck, name, g.names))
        assert (off <= 1e-6 * np.maximum(np.abs(g.matrix[:, k]), np.abs(g.values) / here)).all(), (name, off)


def test_a_ball_has_its_closed_form_behind_an_impact():
    g = emsim.Deck(BALL).gradient()
    h, e, gravity = 1.0, 0.8, 9.81
    fall = np.sqrt(2.0 * h / gravity)
    assert np.allclose(g["second"], fall * (1.0 + 2.0 * e), rtol=1e-8)
    assert np.allclose(
        g.matrix[0], [0.5 * g["second"] / h, 2.0 * fall, -0.5 * g["second"] / gravity], rtol=1e-7
    )
    assert np.allclose(g.matrix[1], [e * e, 2.0 * e * h, 0.0], rtol=1e-7, atol=1e-8)


def test_the_period_of_a_tank_has_its_closed_form():
    deck = """a tank
.param l=1m c=1u
L1 a 0 {l}
C1 a 0 {c} IC=1
.tran 2u 1m uic
.meas tran period trig v(a) val=0 rise=1 targ v(a) val=0 rise=2
.end
"""
    g = emsim.Deck(deck, options={"reltol": 1e-9}).gradient()
    period = 2.0 * np.pi * np.sqrt(1e-3 * 1e-6)
    assert g["period"] == pytest.approx(period, rel=1e-8)
    assert np.allclose(g.matrix[0], [0.5 * period / 1e-3, 0.5 * period / 1e-6], rtol=1e-7)


def test_areas_and_crossings_follow_a_jump():
    """Of a pulse that rises at td and is w wide, between two and three volts over a fixed window."""
    deck = """a pulse
.param td=1m w=1m low=2 high=3
V1 a 0 PULSE({low} {high} {td} 1n 1n {w} 10m)
R1 a 0 1k
.tran 10u 4m
.meas tran mean avg v(a)
.meas tran power integ par('v(a)*v(a)')
.meas tran edge when v(a)=2.5 rise=1
.meas tran back when v(a)=2.5 fall=1
.meas tran top max v(a)
.meas tran inside find v(a) at=1.5m
.end
"""
    g = emsim.Deck(deck).gradient()
    exact = [
        [0.0, 1.0 / 4e-3, 0.75, 0.25],
        [0.0, 5.0, 4.0 * 3e-3, 6.0 * 1e-3],
        [1.0, 0.0, None, None],
        [1.0, 1.0, None, None],
        [0.0, 0.0, 0.0, 1.0],
        [0.0, 0.0, 0.0, 1.0],
    ]
    for row, wanted in zip(g.matrix, exact, strict=True):
        for found, value in zip(row, wanted, strict=True):
            assert value is None or found == pytest.approx(value, rel=1e-5, abs=1e-7)


def test_signals_at_times_and_what_a_measure_reads_itself():
    deck = """charging
.param r=1k part=0.5
V1 a 0 1
R1 a b {r}
C1 b 0 1u IC=0
.tran 20u 5m uic
.meas tran reach when v(b)={part}
.meas tran later param='reach+part*1m'
.end
"""
    d = emsim.Deck(deck, options={"reltol": 1e-8})
    g = d.gradient("v(b)", by="r", at=[1e-3, 2e-3])
    assert g.names == ["v(b)@0.001", "v(b)@0.002"]
    t = np.array([1e-3, 2e-3])
    assert np.allclose(g.matrix[:, 0], -t / 1e3**2 / 1e-6 * np.exp(-t / 1e-3), rtol=1e-6)
    g = d.gradient("later")
    assert g["later", "r"] == pytest.approx(np.log(2.0) * 1e-6, rel=1e-6)
    assert g["later", "part"] == pytest.approx(1e-3 / 0.5 + 1e-3, rel=1e-6)


TWO_PEAKS = """two peaks of one height
.param a=1 b=1
V1 x 0 PWL(0 0 1m {a} 2m 0 3m {b} 4m 0)
R1 x 0 1k
.tran 20u 4m
.meas tran top max v(x)
.end
"""
CROWD = """two switches at one time
.param a=1 b=1
V1 x 0 PWL(0 0 4m 4)
V2 y 0 PWL(0 0 4m 4)
C1 p 0 1u IC=0
R1 x p 1k
C2 q 0 1u IC=0
R2 y q 1k
B1 o 0 V={v(p) > 0.5*a ? 1 : 0}
B2 u 0 V={v(q) > 0.5*b ? v(o) : 0}
R3 o z 1k
R4 u z 1k
C3 z 0 1u IC=0
.tran 20u 4m uic
.meas tran end find v(z) at=4m
.end
"""


def test_where_another_peak_takes_its_place_there_is_no_derivative():
    with pytest.raises(emsim.DeckError) as error:
        emsim.Deck(TWO_PEAKS).gradient()
    (said,) = error.value.diagnostics
    assert said.code == "E443" and "`top` has no derivative by `a`" in said.message
    assert emsim.Deck(TWO_PEAKS, {"b": 0.9}).gradient(by="a")["top", "a"] == pytest.approx(1.0, rel=1e-6)


def test_conditions_that_turn_together_are_told():
    with pytest.raises(emsim.ConvergenceError) as error:
        emsim.Deck(CROWD).gradient(by="a")
    assert error.value.diagnostics[0].code == "E423"
    assert np.isfinite(emsim.Deck(CROWD, {"b": 1.1}).gradient(by="a").matrix).all()


def test_goals_are_met_with_derivatives_through_impacts():
    """The restitution with which a ball rises to half of where it fell from: sqrt(1/2)."""
    found = emsim.optimise(BALL, "e=0.5..0.95", "top=0.5")
    assert found.by_runs is None and found.values["e"] == pytest.approx(np.sqrt(0.5), rel=1e-6)


def test_why_derivatives_were_differences_of_runs_is_told():
    deck = CROWD.replace(".meas tran end", ".meas tran half when v(z)=0.3\n.meas tran end")
    assert "together" in (emsim.optimise(deck, "a=0.9..1.1:1", "half=3m").by_runs or "")

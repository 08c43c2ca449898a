"""`emsim.Deck.gradient` along transients with events: beside closed forms, and beside differences of runs at tight tolerances."""

from __future__ import annotations

import numpy as np

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
.meas tran vout avg v(out) from=20u to=60u
.meas tran ipk max i(l1)
.meas tran gate avg v(g) from=20u to=60u
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

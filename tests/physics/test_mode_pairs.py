"""Two and three set-valued laws in one machine through all pairs of their modes: at every row each law's equations hold."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

import emsim

TOL = 1e-6  # of speeds and gaps of the order of 1, and of efforts


def columns(deck, *names):
    t = emsim.run(deck)
    return {name: np.array(t[name], dtype=float) for name in ("time", *names)}


def friction(c, name, word, fc, fs=None):
    """-1, 0, 1 at every row; while it slides effort = -fc sgn(slip), while it sticks |effort| <= fs and no slip."""
    mode, slip, effort = (c[f"{w}({name})"] for w in ("mode", "slip", word))
    fs = fc if fs is None else fs
    stuck, slides = mode == 0.0, np.abs(mode) == 1.0
    assert np.all(stuck | slides)
    assert np.all(np.abs(slip[stuck]) < TOL)
    assert np.all(np.abs(effort[stuck]) < fs * (1 + TOL) + TOL)
    assert np.all((mode * slip)[slides] > -TOL)
    assert np.abs((effort + mode * fc)[slides]).max(initial=0.0) < TOL * fc
    return mode


def stop(c, name):
    """0 open, 1 closed; nothing reaches through it, it never pulls, and it presses where it is closed alone."""
    gap, force = c[f"gap({name})"], c[f"force({name})"]
    closed = gap < TOL
    assert gap.min() > -TOL
    assert np.abs(force[~closed]).max(initial=0.0) == 0.0
    return closed.astype(float)


def visited(*modes):
    return set(zip(*(m.tolist() for m in modes), strict=True))


@pytest.mark.parametrize("method", ["radau", "esdirk"])
def test_a_stop_beside_a_friction_clutch(method):
    """A sledge runs between a stop and nothing, another one rubs on it: 3 modes times 2."""
    c = columns(
        f"""a stop and a sliding pair
BODY a m=1
BODY b m=0.5
JOINT sa 0 a slide ic=(0.2,0)
JOINT sb a b slide
FRICTION f sb fc=1 fs=1.3
STOP s sa min=0 e=0.4
SPRING k sa k=2 q0=-0.1
DAMPER d sa c=0.3
SPRING kb sb k=1
FORCE fa a.com dir=(1,0) {{2.5*sin(1.1*time)+1.5*sin(2.3*time)}}
FORCE fb b.com dir=(1,0) {{1.6*sin(3.1*time)+1.2*sin(0.7*time)}}
.tran 5m 60
.save mode(f) slip(f) force(f) gap(s) force(s)
.options reltol=1e-7 method={method}
.end
""",
        "mode(f)", "slip(f)", "force(f)", "gap(s)", "force(s)",
    )  # fmt: skip
    pairs = visited(friction(c, "f", "force", 1.0, 1.3), stop(c, "s"))
    assert pairs == set(product((-1.0, 0.0, 1.0), (0.0, 1.0)))


def test_a_clutch_a_brake_and_a_freewheel():
    """Two rotors and a third behind a freewheel: 3 modes times 3 times 2."""
    c = columns(
        """clutch, brake and freewheel
BODY a m=1 j=1
BODY b m=1 j=0.5
BODY o m=1 j=0.4
JOINT ja 0 a pin
JOINT jb 0 b pin
JOINT jo 0 o pin
JOINT ab a b pin cut=yes
JOINT bo b o pin cut=yes
FRICTION clutch ab fc=1
FRICTION brake jb fc=0.8
FREEWHEEL fw bo dir=1
DAMPER d1 ja c=0.2
DAMPER d2 jo c=0.1
TORQUE t1 ja tau={2.4*sin(1.3*time)+1.1*sin(3.7*time)}
TORQUE t2 jb tau={1.5*sin(2.1*time+1)}
TORQUE t3 jo tau={1.2*sin(1.9*time)+0.8*sin(0.6*time)}
.tran 5m 200
.save mode(clutch) slip(clutch) torque(clutch) mode(brake) slip(brake) torque(brake) omega(bo) torque(fw) mode(fw)
.options reltol=1e-7
.end
""",
        "mode(clutch)", "slip(clutch)", "torque(clutch)", "mode(brake)", "slip(brake)", "torque(brake)", "omega(bo)",
        "torque(fw)", "mode(fw)",
    )  # fmt: skip
    clutch, brake = friction(c, "clutch", "torque", 1.0), friction(c, "brake", "torque", 0.8)
    slip, torque, mode = c["omega(bo)"], c["torque(fw)"], c["mode(fw)"]
    assert slip.min() > -TOL
    assert torque.min() > -TOL
    assert np.abs(slip * torque).max() < TOL
    found = visited(clutch, brake, mode)
    assert {(a, b) for a, b, _ in found} == set(product((-1.0, 0.0, 1.0), repeat=2))
    assert {(a, w) for a, _, w in found} == set(product((-1.0, 0.0, 1.0), (0.0, 1.0)))
    assert {(b, w) for _, b, w in found} == set(product((-1.0, 0.0, 1.0), (0.0, 1.0)))


def test_backlash_beside_friction():
    """A pinion with play on a wheel that rubs: open, on either flank; stuck, sliding either way."""
    c = columns(
        """backlash and friction
BODY a m=1 j=0.2
BODY b m=1 j=0.5
JOINT ja 0 a pin
JOINT jb 0 b pin
GEAR g ja jb ratio=1 backlash=0.2 e=0.2
FRICTION f jb fc=0.7 fs=0.9
DAMPER d ja c=0.1
TORQUE t ja tau={1.9*sin(1.3*time)+1.2*sin(3.1*time)}
TORQUE tb jb tau={0.7*sin(2.7*time)}
.tran 5m 60
.save mode(f) slip(f) torque(f) gap(g) torque(g) angle(ja) angle(jb)
.options reltol=1e-7
.end
""",
        "mode(f)", "slip(f)", "torque(f)", "gap(g)", "torque(g)", "angle(ja)", "angle(jb)",
    )  # fmt: skip
    play = c["angle(ja)"] - c["angle(jb)"]
    assert np.abs(play).max() < 0.1 + TOL
    flank = np.where(play > 0.1 - TOL, 1.0, np.where(play < -0.1 + TOL, -1.0, 0.0))
    assert np.abs(c["torque(g)"][flank == 0.0]).max() == 0.0
    mode = friction(c, "f", "torque", 0.7, 0.9)
    assert visited(mode, flank) == set(product((-1.0, 0.0, 1.0), repeat=2))


def test_a_relay_that_works_a_brake():
    """The armature falls on its stop, closes a circuit, and that lifts a brake that was stuck."""
    c = columns(
        """a relay lifts a brake
V1 c 0 PULSE(0 9 0.1 1m 1m 0.5 1.3)
R1 c d 4
BODY arm m=50m
JOINT gap 0 arm slide ic=(1m,0)
TRANSDUCER m d 0 gap L={2u/(0.2m+pos(gap))}
SPRING back gap k=400 q0=1.4m
DAMPER da gap c=0.6
STOP low gap min=0.1m e=0.3
STOP high gap max=1m e=0.3
Bg g 0 V={pos(gap) < 0.15m ? 5 : 0}
Rg g 0 1k
Vm p 0 6
S1 p q g 0 sw
.model sw SW(vt=2.5 vh=0 ron=0.1 roff=1meg)
Rb q 0 20
BODY rotor m=1 j=1m
JOINT shaft 0 rotor pin
FRICTION brake shaft fc={v(q) > 3 ? 0.04 : 0.5}
TORQUE load shaft tau={0.05*sin(4*time)+0.03*sin(17*time)}
.tran 1m 4
.save mode(brake) slip(brake) torque(brake) gap(low) force(low) gap(high) force(high) v(q)
.options reltol=1e-6
.end
""",
        "mode(brake)", "slip(brake)", "torque(brake)", "gap(low)", "force(low)", "gap(high)", "force(high)", "v(q)",
    )  # fmt: skip
    lifted = c["v(q)"] > 3.0
    modes = c["mode(brake)"]
    for on, fc in ((lifted, 0.04), (~lifted, 0.5)):
        friction({name: column[on] for name, column in c.items()}, "brake", "torque", fc)
    for name in ("low", "high"):
        gap, force = c[f"gap({name})"], c[f"force({name})"]
        assert gap.min() > -1e-8
        assert (force * np.sign(force[np.argmax(np.abs(force))])).min() > -TOL * np.abs(force).max()
        assert np.abs(force[gap > 1e-7]).max(initial=0.0) == 0.0
    seen = set(zip((c["gap(low)"] < 1e-7).tolist(), np.abs(modes).tolist(), strict=True))
    assert seen >= {(True, 0.0), (True, 1.0), (False, 0.0), (False, 1.0)}
    assert np.all(modes[~lifted & (c["time"] < 0.1)] == 0.0)

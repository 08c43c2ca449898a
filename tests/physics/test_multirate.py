"""Circuit and machine each at its own pace: as near to the truth as one pace for both, and refused where it cannot be."""

from __future__ import annotations

import numpy as np
import pytest
from support import deck, with_options

import emsim
from emsim import pipeline
from emsim.table import Table

BRIDGE = """Vbat vb 0 24
Vg g 0 PULSE(0 5 {0.45/fsw-tr/2} {tr} {tr} {0.7/fsw-tr} {1/fsw})
S1 vb a g 0 high
S4 b 0 g 0 high
S2 a 0 0 g low
S3 vb b 0 g low
.model high SW(vt=2.5 ron=20m roff=1g)
.model low SW(vt=-2.5 ron=20m roff=1g)
MOTOR m1 a b p1 kt=0.1 r=1 l=1m j=0.2m
"""
SIGNALS = ("i(m1)", "omega(p1)", "angle(p1)")


def chain(links: int, converter: str, fsw: float, stop: float) -> str:
    """A chain of uniform rods one metre long, driven at its first joint."""
    length = 1.0 / links
    cards = ["chain", ".gravity 9.81", f".param fsw={fsw} tr={0.01 / fsw}"]
    before = "0"
    for k in range(1, links + 1):
        cards += [
            f"BODY b{k} shape=rod({length}) m={0.2 / links}",
            f"JOINT p{k} {before} b{k} pin damp=2m",
        ]
        before = f"b{k}({length},0)"
    shown = f".print tran i(m1) omega(p1) angle(p1) y({before})"
    return "\n".join([*cards, converter, f".tran {stop / 50} {stop} UIC", shown, ".end", ""])


def run(text: str, method: str, reltol: float) -> Table:
    return pipeline.run(text, method=method, reltol=reltol).plots[0]


def times(stop: float) -> np.ndarray:
    """The print grid, so that nothing is interpolated; the gate's delay keeps it off the edges."""
    return np.arange(1, 50) * stop / 50


def error(found: Table, truth: Table, at: np.ndarray, signals: tuple[str, ...] = SIGNALS) -> float:
    """Largest difference over the largest value, of the worst signal."""
    return max(
        float(np.abs(found.at(n, at) - truth.at(n, at)).max() / np.abs(truth[n]).max()) for n in signals
    )


def test_errors_follow_the_tolerance_as_those_of_a_single_rate_do() -> None:
    text = chain(3, BRIDGE, 2e3, 0.05)
    at = times(0.05)
    truth = run(text, "radau", 1e-9)
    errors = [error(run(text, "multirate", reltol), truth, at) for reltol in (1e-3, 1e-5, 1e-7)]
    for reltol, found in zip((1e-3, 1e-5, 1e-7), errors, strict=True):
        assert found < 10 * reltol
    assert errors[1] < 0.2 * errors[0]
    assert errors[2] < 0.2 * errors[1]


def test_every_row_is_of_one_time_for_both() -> None:
    """Rows come as from a single rate: print grid and the circuit's steps, in order; forces fit the currents."""
    found = run(chain(2, BRIDGE, 20e3, 0.02), "multirate", 1e-5)
    assert (np.diff(found.time) > 0).all()
    assert found.time[0] == 0.0
    assert found.time[-1] == 0.02
    asked = np.arange(51) * 0.02 / 50
    nearest = np.abs(found.time[:, None] - asked).min(axis=0)
    assert nearest.max() < 1e-12


def test_speed_carries_the_ripple_that_the_machine_was_not_given() -> None:
    """Seen at every step of the circuit, the rotor's acceleration is that of the current at that time, not of its mean:
    J dw = (kt i - d w) dt."""
    text = (
        "rotor\n.param fsw=5k tr=2u\nBODY rotor m=1 j=1e-5\nJOINT p1 0 rotor pin damp=1e-5\n"
        + BRIDGE.replace(" j=0.2m", "")
        + ".tran 10u 50m UIC\n.print tran i(m1) omega(p1)\n.end\n"
    )
    found = run(text, "multirate", 1e-6)
    t, i, w = found.time, found["i(m1)"], found["omega(p1)"]
    late = t > 0.04
    t, i, w = t[late], i[late], w[late]
    # trapezoids between rows: the current is nearly straight there
    impulse = np.cumsum((0.1 * 0.5 * (i[1:] + i[:-1]) - 1e-5 * 0.5 * (w[1:] + w[:-1])) * np.diff(t)) / 1e-5
    ripple = w[1:] - w[0]
    assert np.ptp(ripple) > 0.1
    assert np.abs(ripple - impulse).max() < 2e-3 * np.ptp(ripple) + 1e-6 * np.abs(w).max()


@pytest.mark.parametrize(("reltol", "share"), [(1e-3, 1e-5), (1e-6, 1e-7)])
def test_energy_is_accounted_for(reltol: float, share: float) -> None:
    ledger = run(chain(3, BRIDGE, 20e3, 0.02), "multirate", reltol).energy
    assert ledger is not None
    assert ledger.supplied > 0.1
    assert ledger.share < share


def test_edges_that_only_the_circuit_and_edges_that_the_machine_brings_about() -> None:
    """A hysteresis controller turns by the current, a limit switch by the angle; both turn when a single rate says so."""
    text = """limit
BODY arm shape=rod(0.2) m=0.1
JOINT p1 0 arm pin damp=1m
MOTOR m1 a 0 p1 kt=0.1 r=1 l=5m j=0.2m
Vbat vb 0 24
S1 vb a n 0 chopper
Rf a 0 0.5
Bn n 0 V={i(m1)}
.model chopper SW(vt=-3 vh=0.2 ron=20m roff=1k)
Bs n2 0 V={angle(p1)}
S2 vb led n2 0 end
Rled led 0 1k
.model end SW(vt=0.4 vh=0.05 ron=1 roff=1g)
.tran 1m 0.2 UIC
.print tran i(m1) omega(p1) angle(p1) v(led)
.end
"""
    # the switch closes below -3 of n - 0 = -i: turn it round
    text = text.replace("V={i(m1)}", "V={-i(m1)}")
    truth, found = run(text, "radau", 1e-8), run(text, "multirate", 1e-6)
    at = np.arange(1, 200) * 1e-3
    assert error(found, truth, at, ("omega(p1)", "angle(p1)")) < 1e-5
    crossings = [np.flatnonzero(np.diff(np.sign(x["v(led)"] - 1.0))) for x in (truth, found)]
    assert len(crossings[0]) == len(crossings[1]) >= 1
    for k, j in zip(*crossings, strict=True):
        assert found.time[j] == pytest.approx(truth.time[k], rel=1e-5)


REFUSED = {
    "it takes a circuit and a machine": "rc\nV1 a 0 1\nR1 a b 1k\nC1 b 0 1n\n.tran 1u 1m\n.end\n",
    "is not linear in": (
        "magnet\nBODY plate m=50m\nJOINT gap 0 plate slide axis=(1,0)\nSPRING back gap k=2k\n"
        "TRANSDUCER mag c 0 gap L={1m/(3m-pos(gap))}\nRc s c 8\nVs s 0 12\n.tran 50u 20m\n.end\n"
    ),
    "a condition switches the equations of": (
        "brake\nBODY arm shape=rod(0.2) m=0.1\nJOINT p1 0 arm pin\nTORQUE brake p1 tau={angle(p1)>0.5 ? -1 : 0}\n"
        "MOTOR m1 a 0 p1 kt=0.1 r=1 l=5m\nV1 a 0 12\n.tran 1m 0.2\n.end\n"
    ),
}


@pytest.mark.parametrize("why", REFUSED)
def test_refused_where_circuit_and_machine_cannot_be_taken_apart(why: str) -> None:
    with pytest.raises(emsim.ConvergenceError, match=why):
        run(REFUSED[why], "multirate", 1e-4)


def test_the_sample_deck_agrees_with_one_pace_for_both() -> None:
    """chain50_converter: fifty links, 100 kHz; a hundred periods of it."""
    text = with_options(deck("coupled/chain50_converter"), tran="20u 1m UIC")
    found, truth = (run(text, method, 1e-5) for method in ("multirate", "radau"))
    at = found.time[[int(np.abs(found.time - t).argmin()) for t in np.arange(1, 50) * 20e-6 + 5e-6]]
    tip = tuple(n for n in truth.names if n.startswith("x(b50"))
    assert error(found, truth, at, ("i(m1)", "omega(p1)", "angle(p1)", *tip)) < 1e-4


@pytest.mark.parametrize(("links", "fsw", "pays"), [(12, 100e3, True), (2, 100e3, False), (12, 500.0, False)])
def test_check_says_where_two_paces_may_pay(links: int, fsw: float, pays: bool) -> None:
    assert emsim.check(chain(links, BRIDGE, fsw, 0.02))["two_paces"] is pays


@pytest.mark.parametrize("at", ["0.45/fsw", "0.45/fsw-1e-19", "0.15/fsw", "0.45/fsw-1e-16"])
def test_a_corner_of_the_machine_beside_an_edge_of_the_circuit(at: str) -> None:
    """A load that comes with an edge, to rounding: the run said that there is no unique solution over 1e-19 s."""
    load = "TORQUE load p2 tau=PULSE(0 0.1 {%s} 1n 1n {3/fsw} {10/fsw})\n.end" % at  # noqa: UP031
    text = chain(2, BRIDGE, 20e3, 0.02).replace(".end", load)
    truth, found = run(text, "radau", 1e-7), run(text, "multirate", 1e-5)
    assert error(found, truth, times(0.02)) < 1e-5


def test_accelerations_and_reactions_follow_the_ripple() -> None:
    """A motor on 10 kHz, 12 V: what it turns is accelerated by kt i, ripple included. Rows showed the machine's answer to the
    mean of the current over a macro step, off by 3 % of the range in the median, at 1e-6."""
    text = """ripple
.gravity 9.81
BODY arm shape=rod(0.30) m=0.20
JOINT hinge 0 arm pin zero=-90deg damp=2m
MOTOR m1 drive 0 hinge kt=20m r=2 l=1m j=2u gear=30
V1 drive 0 PULSE(0 12 0 1u 1u 30u 100u)
.save alpha(hinge) fx(hinge) fy(hinge) i(m1)
.tran 13u 10m
.end
"""
    truth, found = run(text, "radau", 1e-7), run(text, "multirate", 1e-6)
    at = 13e-6 * np.arange(1, 750)
    assert error(found, truth, at, ("i(m1)", "alpha(hinge)", "fx(hinge)", "fy(hinge)")) < 1e-5


def test_a_row_at_a_corner_of_the_machine_keeps_the_circuit_as_it_is() -> None:
    """Forces there are computed by short steps backwards: of a junction of 10 ps they made 0.36 V at the coil's node."""
    text = """a junction in a row of the machine
V1 n1 0 EXP(0 4.47 0.2m 0.1m 1.5m 0.3m)
L1 n1 n2x 20.13m
Rl1 n2x n2 13.4
Cg1 n2 0 2n
C4 n4 n2 0.499u
Rg3 n4 0 2.2k
D6 n2 0 dm
.model dm D(is=10n n=1.5 rs=0.5 cjo=20p)
BODY arm shape=rod(0.3) m=0.2
JOINT h 0 arm pin ic=(0.8,4)
MOTOR m1 n1m 0 h kt=30m r=4 l=1m j=1u gear=1
Rm n1 n1m 3
TORQUE tt h tau=PULSE(0 0.05 0.5m 10u 10u 1m 2m)
.save v(n2x) fx(h) alpha(h)
.tran 50u 3m
.end
"""
    truth, found = run(text, "radau", 1e-8), run(text, "multirate", 1e-6)
    at = found.time[np.abs(found.time - 1.51e-3) < 1e-12]
    assert len(at) and error(found, truth, at, ("v(n2x)", "fx(h)", "alpha(h)")) < 1e-5

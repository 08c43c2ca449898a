"""What the drawing of a circuit shows of a run: its currents cancel at every node, and it changes nothing of the run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from emsim import pipeline

ROOT = Path(__file__).resolve().parents[3]
DRAWN = """electrical/bjt_amplifier electrical/diode_bridge electrical/cmos_nand coupled/pendulum_servo coupled/relay
    lessons/13_pwm""".split()


@pytest.fixture(params=DRAWN)
def both(request):
    deck = ROOT / "netlists" / f"{request.param}.cir"
    return pipeline.run(deck), pipeline.run(deck, scene=True)


def current(table, terms):
    """[A] of all rows, those of capacitors between the rows."""
    columns = {
        c["name"]: np.frombuffer(table.circuit.waves.column(k))
        for k, c in enumerate(table.circuit.data["channels"])
    }
    t, total = table.time, 0.0
    for factor, name, rate in terms:
        total = total + factor * (np.gradient(columns[name], t) if rate else columns[name])
    return total


def test_currents_cancel_at_every_node(both):
    table = both[1].main
    flows = table.circuit.data
    picture = flows["pictures"][""]
    nets: dict[str, list] = {}
    for part in picture["parts"]:
        for (name, terminal), (_, _, net) in zip(part["sources"], part["pins"], strict=True):
            nets.setdefault(net, []).append(
                flows["currents"][name][terminal] if flows["currents"][name] else None
            )
    judged = 0
    for net, known in nets.items():
        if net == "0" or None in known:
            continue
        # where nothing is charged the sum is exact; steps of one row spoil a rate
        sums = sum(current(table, terms) for terms in known)
        top = max(np.max(np.abs(current(table, terms))) for terms in known)
        assert np.median(np.abs(sums)) <= 2e-3 * top + 1e-12, net
        judged += 1
    assert judged


def test_the_run_is_the_same_with_and_without_its_drawing(both):
    plain, drawn = both
    assert plain.main.circuit is None and drawn.main.circuit is not None
    assert plain.main.names == drawn.main.names
    assert [d.code for d in plain.diagnostics] == [d.code for d in drawn.diagnostics]
    for name in plain.main.names[1:]:
        a, b = plain.main[name], np.interp(plain.main.time, drawn.main.time, drawn.main[name])
        assert np.median(np.abs(a - b)) <= 1e-3 * max(np.ptp(a), 1e-9 * np.max(np.abs(a))) + 1e-15, name


def test_a_result_with_a_drawing_survives_pickling():
    import pickle

    table = pipeline.run(ROOT / "netlists/lessons/01_rc.cir", scene=True).main
    again = pickle.loads(pickle.dumps(table))
    assert (
        again.circuit.data == table.circuit.data
        and again.circuit.waves.columns == table.circuit.waves.columns
    )

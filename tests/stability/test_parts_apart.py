"""Circuits in one deck that nothing ties to each other: where their sources move at different paces each has steps of its own.

What every circuit gives alone, and closed forms, are the measure.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

import emsim
from emsim import pipeline
from emsim.diagnostics import ConvergenceError

FAST = "VP g 0 PULSE(0 5 0 20n 20n 480n 1u)\nRG g h 1k\nCG h 0 100p\n"
SWITCHED = (
    "VC c 0 PULSE(0 1 0 20n 20n 400n 2u)\nVI in 0 10\nS1 in sw c 0 sm\nD1 0 sw dm\nL1 sw out 100u\nCO out 0 10u\nRL out 0 5\n"
    ".model sm SW(vt=0.5 vh=0.1 ron=0.05 roff=1meg)\n.model dm D(is=1e-12 rs=0.02)\n"
)
RECTIFIER = "VR a 0 SIN(0 5 1k)\nDR a b dr\nCR b 0 1u\nRR b 0 1k\n.model dr D(is=1e-14 rs=0.1 cjo=10p)\n"
STAGE = (
    "VQ q 0 SIN(0 10m 2k)\nVDD vdd 0 5\nRD vdd d 2k\nM1 d k 0 0 nm w=20u l=1u\nVB bias 0 1.2\nRB bias k 100k\nCB q k 1u\n"
    ".model nm NMOS(vto=0.8 kp=100u lambda=0.02 cgso=0.2n tox=20n)\n"
)


def deck(*parts: str, run: str = ".tran 10u 1m", also: str = "") -> str:
    return "parts\n" + "".join(parts) + also + run + "\n.end\n"


def paces(text: str) -> list[list[int]]:
    assembly, planned = pipeline.prepare(pipeline.flatten(pipeline.load(text)))
    return assembly.system.paces(planned[0].times()[1])


def same(whole: emsim.Result, alone: emsim.Result, *names: str) -> None:
    """Where one has a row the other has it too, with the same bits."""
    times, i, j = np.intersect1d(whole.time, alone.time, return_indices=True)
    assert len(times) == len(alone.time)
    for name in names:
        assert np.array_equal(whole[name][i], alone[name][j]), name


@pytest.mark.parametrize("method", ["", "trap", "gear", "radau", "trbdf2", "esdirk"])
@pytest.mark.parametrize("slow", [RECTIFIER, STAGE])
def test_each_is_what_it_is_alone(slow: str, method: str) -> None:
    also = f".options method={method}\n" if method else ""
    nodes = ("v(a)", "v(b)") if slow is RECTIFIER else ("v(d)", "v(k)")
    whole = emsim.run(deck(FAST, slow, also=also))
    assert np.all(np.diff(whole.time) > 0.0)
    same(whole, emsim.run(deck(FAST, also=also)), "v(g)", "v(h)", "i(vp)")
    same(whole, emsim.run(deck(slow, also=also)), *nodes)
    assert not whole.diagnostics


def test_a_slow_one_takes_no_steps_for_a_fast_one() -> None:
    whole, fast, slow = (emsim.run(deck(*parts)) for parts in ((FAST, RECTIFIER), (FAST,), (RECTIFIER,)))
    assert whole.stats["steps"] == fast.stats["steps"] + slow.stats["steps"]
    assert slow.stats["steps"] < 0.1 * fast.stats["steps"]


def test_conditions_are_those_of_their_part() -> None:
    """A switched converter beside a comparator with a condition of its own."""
    comparator = "VS s 0 SIN(0 1 1k)\nRS s y 1k\nCS y 0 10n\nBS z 0 V = v(y) > 0.2 ? 3 : -1\nRZ z 0 1k\n"
    whole = emsim.run(deck(SWITCHED, comparator))
    same(whole, emsim.run(deck(comparator)), "v(y)", "v(z)")
    same(whole, emsim.run(deck(SWITCHED)), "v(out)", "i(l1)")
    high = whole["v(y)"] > 0.2
    assert np.mean(np.where(high, 3.0, -1.0) == whole["v(z)"]) > 0.999  # but for rows at the threshold itself


def test_rows_of_another_part_are_as_good_as_ones_own() -> None:
    """The current of a capacitor across a slow source, C dv/dt, at the rows of a fast circuit; RC behind a sine."""
    slow = "VS s 0 SIN(0 1 1k)\nCS s 0 1u\nRS s y 1k\nCY y 0 100n\n"
    r = emsim.run(deck(FAST, slow, run=".tran 10u 1m", also=".options reltol=1e-6\n"))
    w, tau = 2e3 * math.pi, 1e-4
    t = r.time
    y = (np.sin(w * t) - w * tau * np.cos(w * t) + w * tau * np.exp(-t / tau)) / (1 + (w * tau) ** 2)
    assert np.abs(r["v(y)"] - y).max() < 2e-5
    assert np.abs(r["v(s)"] - np.sin(w * t)).max() < 1e-8
    current = -(1e-6 * w * np.cos(w * t) + (np.sin(w * t) - y) / 1e3)
    late = t > 2e-6
    assert np.abs(r["i(vs)"] - current)[late].max() < 1e-4 * np.abs(current).max()


def test_what_is_tied_goes_together() -> None:
    assert len(paces(deck(FAST, RECTIFIER))) == 2
    assert paces(deck(FAST, RECTIFIER, also="RT h b 1g\n")) == []
    assert paces(deck(FAST, RECTIFIER, also="BT h 0 I = 1e-9*v(b)\n")) == []
    assert paces(deck(FAST, RECTIFIER, also="FT h 0 VR 1e-6\n")) == []
    assert paces(deck(FAST, RECTIFIER, also="BT h 0 I = v(b) > 1 ? 1u : 0\n")) == []
    assert paces(deck(FAST)) == [] == paces(deck(RECTIFIER))
    assert paces(deck(FAST, RECTIFIER, run=".tran 10n 10u")) == []  # ten periods


def test_three_paces() -> None:
    slower = "VX x 0 PULSE(0 1 0 1u 1u 4u 10u)\nRX x xx 1k\nCX xx 0 1n\n"
    found = paces(deck(FAST, slower, RECTIFIER, run=".tran 100u 10m"))
    assert len(found) == 3
    whole = emsim.run(deck(FAST, slower, RECTIFIER, run=".tran 100u 10m"))
    for part, name in ((FAST, "v(h)"), (slower, "v(xx)"), (RECTIFIER, "v(b)")):
        same(whole, emsim.run(deck(part, run=".tran 100u 10m")), name)


def test_initial_values_hold() -> None:
    free = "CF f 0 1u ic=2\nRF f 0 1k\n"
    r = emsim.run(deck(FAST, free, run=".tran 10u 1m uic"))
    assert np.abs(r["v(f)"] - 2.0 * np.exp(-r.time / 1e-3)).max() < 1e-3


def test_measurements_go_with_one_run() -> None:
    also = ".meas tran top MAX v(h)\n.meas tran ripple PP v(b) FROM=0.6m TO=1m\n"
    r, alone = (
        emsim.run(deck(FAST, RECTIFIER, also=also)),
        emsim.run(deck(RECTIFIER, also=also.split("\n")[1] + "\n")),
    )
    assert r.measures["ripple"] == pytest.approx(alone.measures["ripple"], rel=1e-3)


def test_one_that_fails_ends_all_and_is_named() -> None:
    """dv/dt = v^2 from 1 V ends at 1 s."""
    blows = "CB p 0 1 ic=1\nBP 0 p I = v(p)^2\nVR a 0 SIN(0 5 1)\nRA a 0 1k\n"
    fast = "VP g 0 PULSE(0 5 0 20u 20u 480u 1m)\nRG g h 1k\nCG h 0 100n\n"
    with pytest.raises(ConvergenceError) as failed:
        emsim.run(deck(fast, blows, run=".tran 10m 2 uic"))
    kept = failed.value.partial
    assert kept is not None
    assert 0.9 < kept.time[-1] < 1.01
    early = kept.time < 0.9
    assert np.abs(kept["v(p)"][early] * (1.0 - kept.time[early]) - 1.0).max() < 0.02
    assert "v(p)" in " ".join(d.message for d in failed.value.diagnostics) or "`p`" in str(failed.value)


def test_a_run_that_is_stopped_keeps_its_rows() -> None:
    assembly, planned = pipeline.prepare(
        pipeline.flatten(pipeline.load(deck(FAST, RECTIFIER, run=".tran 1m 1")))
    )
    told = []

    def stop(now: float, *_: object) -> bool:
        told.append(now)
        return len(told) > 2

    (run,) = pipeline.solve(assembly, planned, stop)
    assert run.waves.status == "interrupted"
    assert run.waves.rows > 100
    assert sorted(told) == told


@pytest.mark.parametrize("method", ["radau", "rk45", "dop853", "gauss"])
def test_a_condition_of_time_is_of_the_part_that_reads_it(method: str) -> None:
    turns = "VS s 0 SIN(0 1 1k)\nRS s y 1k\nCY y 0 10n\nBT q 0 V = time > 0.3m ? v(y) : -v(y)\nRQ q 0 1k\n"
    also = f".options method={method}\n"
    whole = emsim.run(deck(FAST, turns, also=also))
    same(whole, emsim.run(deck(FAST, also=also)), "v(h)")
    same(whole, emsim.run(deck(turns, also=also)), "v(y)", "v(q)")
    assert whole.stats["events"] <= 1

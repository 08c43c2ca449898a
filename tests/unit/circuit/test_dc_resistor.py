""".dc of a resistor: its value is one from outside of equations that are made once."""

from __future__ import annotations

import math
import time

import pytest

import emsim

VT = 8.617333262e-5 * 300.15  # k T/q at 27 C [V], CODATA 2018

# a current source, a diode and the swept resistor on one node
CELL = """a solar cell over its load
i1 0 a 8m
d1 a 0 dd
r1 a 0 1
.model dd d(is=1e-13)
.options gmin=1e-15 reltol=1e-9 vntol=1e-12 abstol=1e-18
.dc r1 {}
.end
"""


def test_the_node_obeys_the_diodes_law():
    result = emsim.run(CELL.format("50 500 0.9"))
    r, v = result["res-sweep"], result["v(a)"]
    assert len(r) == 501
    # i = v/r + is (exp(v/vt) - 1), at every point
    left = [8e-3 - x / ohm - 1e-13 * math.expm1(x / VT) for ohm, x in zip(r, v, strict=True)]
    assert max(map(abs, left)) < 1e-5 * 8e-3


DIVIDER = "divider\nv1 a 0 5\nr1 a b 1k\nr2 b 0 1k{}\n.dc {}\n.end\n"


def test_two_resistors_with_zero_and_negative_values():
    result = emsim.run(DIVIDER.format("", "r1 0 2k 500 r2 -300 300 300"))
    r1, r2, v = (result[name].tolist() for name in ("res-sweep", "sweep(r2)", "v(b)"))
    assert r1 == [0.0, 500.0, 1000.0, 1500.0, 2000.0] * 3 and r2 == [-300.0] * 5 + [0.0] * 5 + [300.0] * 5
    for a, b, found in zip(r1, r2, v, strict=True):
        a, b = a or 1e-3, b or 1e-3  # 0 ohm is 1 milliohm, as in ngspice
        assert found == pytest.approx(5 * b / (a + b), rel=1e-9)
    assert {d.code for d in result.diagnostics} == {"W281"}


@pytest.mark.parametrize(
    "more, law", [(" m=2", lambda r: r / 2), (" tc=1m", lambda r: r), (" scale=3", lambda r: 3 * r)]
)
def test_one_that_parameters_scale(more, law):
    result = emsim.run(DIVIDER.format(more, "r2 100 500 100"))
    for r, v in zip(result["res-sweep"], result["v(b)"], strict=True):
        assert v == pytest.approx(5 * law(r) / (1000 + law(r)), rel=1e-9)


def test_the_line_is_as_it_was_behind_the_sweep():
    """The next analysis of the deck, and the next run of it, see the value that is written."""
    deck = emsim.Deck(DIVIDER.format("", "r2 1 5 1\n.op"))
    for _ in range(2):
        result = deck.run()
        assert result.table("op")["v(b)"][0] == pytest.approx(2.5, rel=1e-9)


def test_points_cost_what_those_of_a_source_do():
    """Ratio of CPU times in one process, least of three; it was above 100."""

    def spent(swept: str) -> float:
        text = CELL.format("1 500 0.1").replace("\n.dc", "\ni2 0 a 0\n.dc").replace(".dc r1", f".dc {swept}")
        least = math.inf
        for _ in range(3):
            start = time.process_time()
            emsim.run(text)
            least = min(least, time.process_time() - start)
        return least

    assert spent("r1") < 5 * spent("i2 0 8m 1.6u\n*")

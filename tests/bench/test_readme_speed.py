"""README.md's own figures of speed are measured again: ratios of CPU times of whole processes that run by turns.

Three of the kinds of decks that are timed beside ngspice, and a ten-line deck beside `python -c pass`. A ratio that README.md
gives may be off by 1.5 either way. What else the machine does moves both sides, but not alike: one that is off is measured again,
twice at most.
"""

from __future__ import annotations

import re
import statistics
from collections.abc import Callable

import people
import pytest
import startup
from support import ROOT, needs_ngspice

TEXT = (ROOT / "README.md").read_text(encoding="utf-8")
OFF = 1.5
KINDS = ("large", "logic", "long")  # the shortest decks tell of python's start alone


def nearest(claimed: float, measure: Callable[[], float]) -> float:
    """What is measured in parts of what is claimed, of the measurement that is nearest."""
    found: list[float] = []
    while len(found) < 3 and not (found and 1 / OFF < found[-1] < OFF):
        found.append(measure() / claimed)
    return min(found, key=lambda ratio: max(ratio, 1 / ratio))


@needs_ngspice
@pytest.mark.ngspice
@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_ratios_to_ngspice(kind):
    (claimed,) = re.findall(rf"^\| {kind} \| \d+ \| ([\d.]+) \(", TEXT, re.M)
    decks = {name: text for name, (of, text) in people.decks().items() if of == kind}

    def measure() -> float:
        rows = [people.measured(name, kind, text, 3, False) for name, text in decks.items()]
        return statistics.median(row.ratio for row in rows)

    assert 1 / OFF < nearest(float(claimed), measure) < OFF


@pytest.mark.slow
def test_ratios_of_a_short_process_to_an_empty_one():
    (claimed,) = re.findall(r"takes ([\d.]+) times the CPU of `python -c pass`", TEXT)

    def measure() -> float:
        found = startup.measure(5)
        return found["console script"][1] / found["python -c pass"][1]

    assert 1 / OFF < nearest(float(claimed), measure) < OFF


def test_what_is_off_is_measured_three_times_and_then_told():
    asked: list[float] = []

    def off() -> float:
        asked.append(4.0)
        return 4.0

    assert nearest(2.0, off) == 2.0 and len(asked) == 3
    assert nearest(4.0, off) == 1.0 and len(asked) == 4

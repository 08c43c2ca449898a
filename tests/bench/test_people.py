"""The decks that people.py times run without a word of trouble, as near to a tight run as a default run is to be."""

from __future__ import annotations

import numpy as np
import people
import pytest

import emsim

DECKS = people.decks()
LONG = ("flyback_switch", "three_phase")  # their tight runs take seconds


def test_there_are_sixty_of_a_dozen_kinds():
    assert len(DECKS) >= 60 and len({kind for kind, _ in DECKS.values()}) >= 12


@pytest.mark.parametrize("name", [name for name, (_, text) in DECKS.items() if ".tran" not in text])
def test_a_point_or_a_sweep_runs(name):
    r = emsim.run(DECKS[name][1])
    assert r.plots and not r.diagnostics


def test_transients_are_as_near_as_they_are_asked_to_be():
    errors = {}
    for name, (_, text) in DECKS.items():
        if ".tran" not in text or name in LONG:
            continue
        times = np.linspace(0, people.tran(text)[1], people.TIMES + 1)[1:]
        loose, tight = (people.of(emsim.run(text, reltol=tol), times) for tol in (1e-3, 1e-6))
        errors[name] = people.distance(loose, tight)
    # one of them rings freely at 200 MHz, one is asked at the edges of its switch, of a nanosecond
    assert max(errors.values()) < 0.12, errors
    assert np.median(list(errors.values())) < 1e-4


def test_the_same_signal_is_no_distance_away_and_a_shifted_one_is():
    one = {"v(a)": np.array([0.0, 1.0, 2.0]), "v(b)": np.zeros(3)}
    assert people.distance(one, one) == 0.0
    assert people.distance({**one, "v(a)": one["v(a)"] + 0.2}, one) == pytest.approx(0.1)

"""What an event costs where many parts touch or rub, by counting: it may not rise."""

from __future__ import annotations

import pytest
from against import chain_deck, pile_deck

import emsim

PILES = (6, 9, 12)


def cost(text: str) -> dict[str, float]:
    stats = emsim.run(text).stats
    return {name: stats[name] / stats["events"] for name in ("factorisations", "solves")}


@pytest.mark.parametrize("n", [5, 10, 20])
def test_an_event_of_a_chain_with_friction_takes_as_many_factorisations_whatever_its_length(n: int) -> None:
    """What stops, what follows, and the forces before they are asked and behind it: two short steps and three lengths twice."""
    found = cost(chain_deck(n))
    assert found["factorisations"] < 10
    # a column for each law that may let go, in both steps
    assert found["solves"] < 20 + 2 * n


@pytest.fixture(scope="module")
def piles() -> dict[int, dict[str, float]]:
    return {n: cost(pile_deck(n)) for n in PILES}


def test_an_event_of_a_pile_takes_as_many_factorisations_however_many_lie_there(
    piles: dict[int, dict[str, float]],
) -> None:
    """Steps, rows, impacts and what follows them."""
    assert all(found["factorisations"] < 40 for found in piles.values())


def test_solutions_at_an_event_of_a_pile_grow_with_what_touches_not_with_all_pairs(
    piles: dict[int, dict[str, float]],
) -> None:
    assert all(found["solves"] < 25 * n for n, found in piles.items())

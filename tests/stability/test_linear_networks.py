"""Random linear networks against their exact solutions, by every method: within ten tolerances, or a message says so.

A tolerance is reltol of what the signal comes to at most, with a fiftieth of the largest of its kind. Rows are compared where
they stand, not between them.
"""

from __future__ import annotations

import numpy as np
import pytest
from linear_networks import GRID, SPAN, Network, network

import emsim
from emsim.diagnostics import ConvergenceError, DeckError

TIMES = np.arange(1, round(SPAN / GRID) + 1)[::7] * GRID
SEEDS = 110
ASKED = [
    ("auto", 1e-3), ("gear", 1e-3), ("radau", 1e-3), ("trbdf2", 1e-3), ("esdirk", 1e-3), ("dop853", 1e-3),
    ("auto", 1e-6), ("gear", 1e-6), ("esdirk", 1e-6),
]  # fmt: skip
MOST = 10.0
TOLD = (
    "W406",
    "W412",
    "W416",
)  # an equation does not hold, the method rings, a second derivative of a source


def off(net: Network, result: emsim.Result, reltol: float, largest: np.ndarray) -> float:
    """Largest deviation of any signal, in tolerances."""
    t = np.asarray(result.time) * 1e6
    rows = np.unique(np.clip(np.searchsorted(t, TIMES), 0, len(t) - 1))
    corners = np.array([*net.corners(), np.inf])
    rows = rows[[bool(np.abs(corners - now).min() > 1e-4) for now in t[rows]]]
    exact = net.solution(t[rows])
    assert exact is not None
    voltage = np.array([u.startswith("v") for u in net.unknowns])
    worst = 0.0
    for k, name in enumerate(net.unknowns):
        if name in result.names:
            kind = largest[voltage == voltage[k]].max()
            unit = reltol * (largest[k] + 0.02 * kind) + (1e-9 if voltage[k] else 1e-12)
            worst = max(worst, float(np.abs(np.asarray(result[name])[rows] - exact[:, k]).max() / unit))
    return worst


@pytest.mark.parametrize("seed", range(SEEDS))
def test_a_random_linear_network_is_what_its_matrix_exponential_says(seed, record_property):
    net = network(seed)
    exact = net.solution(np.arange(0.01, SPAN, 0.11))
    if exact is None:
        return
    largest = np.abs(exact).max(axis=0)
    wrong = []
    for method, reltol in ASKED:
        try:
            result = emsim.run(net.deck(f"method={method} reltol={reltol:g}"))
        except (DeckError, ConvergenceError) as refused:
            codes = {d.code for d in refused.diagnostics}
            assert method == "dop853" and "E413" in codes, (method, codes, net.deck())
            continue
        found = off(net, result, reltol, largest)
        if found > MOST and not [d for d in result.diagnostics if d.code in TOLD]:
            wrong.append(f"{method} at {reltol:g}: {found:.3g} tolerances")
    record_property("runs", len(ASKED))
    assert not wrong, "\n".join([*wrong, net.deck()])


def test_so_many_of_the_networks_have_a_solution_to_compare_with():
    assert sum(network(seed).solution(TIMES) is not None for seed in range(SEEDS)) >= 25

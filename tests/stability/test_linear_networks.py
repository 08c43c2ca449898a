"""Random linear networks against their exact solutions, by every method: within ten tolerances, or a message says so.

A tolerance is reltol of what the signal comes to at most, with a fiftieth of the largest of its kind. Rows are compared where
they stand, not between them. Where a loop of coils leaves the start open, the run's own first row is the start of both.
Three networks run away within the run and are left out. trap is not asked: what rings keeps its errors, and it rings by itself
where a source's current is a derivative (W412 from a hundredth on).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from linear_networks import GRID, SPAN, Network, Unsuitable, capacitor_loops, driven, network
from support import daily

import emsim
from emsim.diagnostics import ConvergenceError, DeckError

TIMES = np.arange(1, round(SPAN / GRID) + 1)[::7] * GRID
RUN_AWAY = [47, 78, 108]
SEEDS = [seed for seed in range(110) if seed not in RUN_AWAY]
LOOPS = [seed for seed in range(120) if seed != 114]  # that one runs away as well
DRIVEN = [seed for seed in range(9) if seed != 6]  # that one too
EXPLICIT = ("dop853", "rk45")
METHODS = ("auto", "gear", "radau", "trbdf2", "esdirk", *EXPLICIT)
ASKED = [(method, reltol) for method in METHODS for reltol in (1e-3, 1e-6)]
MOST = 10.0
BEHIND = 6  # rows behind every corner
BESIDE = 1e-11  # [us]: nearer to a corner is on it
# an inductor loop's current, and a node between two tanks, of dozens of swings
SWINGS = {(9, "gear", 1e-6): 16.0, (18, "gear", 1e-6): 11.0}
# Not mended yet: gear stays at order one behind a corner, in steps of 1e-12 s (3 of some 1 900 runs; rows further on are right).
# Nothing else may be.
OPEN = {
    "network": {
        (71, "gear", 1e-6),
    },
    "capacitor_loops": {(4, "gear", 1e-6), (47, "gear", 1e-6)},
}  # fmt: skip
# an equation does not hold, the method rings, a second derivative of a source
TOLD = ("W406", "W412", "W416")


def worst_row(
    net: Network, result: emsim.Result, reltol: float, largest: np.ndarray, start: np.ndarray | None
) -> tuple[float, str, float]:
    """Largest deviation of any signal in tolerances, of which one, and when [us]. On a corner there are two values: what is
    compared lies before or behind it."""
    t = np.asarray(result.time) * 1e6
    corners = np.array([*net.corners(), np.inf])
    behind = np.searchsorted(t, corners[:-1] + BESIDE)[:, None] + np.arange(BEHIND)
    rows = np.concatenate([np.searchsorted(t, TIMES), behind.ravel()])
    rows = np.unique(np.clip(rows, 0, len(t) - 1))
    rows = rows[[bool(np.abs(corners - now).min() > BESIDE) for now in t[rows]]]
    exact = net.solution(t[rows], start)
    voltage = np.array([u.startswith("v") for u in net.unknowns])
    worst = (0.0, "", 0.0)
    for k, name in enumerate(net.unknowns):
        if name in result.names:
            kind = largest[voltage == voltage[k]].max()
            unit = reltol * (largest[k] + 0.02 * kind) + (1e-9 if voltage[k] else 1e-12)
            off = np.abs(np.asarray(result[name])[rows] - exact[:, k]) / unit
            row = int(off.argmax())
            worst = max(worst, (float(off[row]), name, float(t[rows[row]])))
    return worst


def own_start(net: Network, result: emsim.Result) -> np.ndarray:
    return np.array([float(result[u][0]) if u in result.names else 0.0 for u in net.unknowns])


def too_far(
    net: Network, asked: list[tuple[str, float]], most: Callable[[str, float], float] = lambda *_: MOST
) -> list[str]:
    """Runs that are off by more than `most`, and say nothing. A method may refuse by name what it has no form for (E413) or
    what would take too long (E414)."""
    try:
        net.solution(TIMES[:1])
        determined = True
    except Unsuitable as why:
        assert str(why) == "nothing determines the start", net.deck()
        determined = False
    wrong = []
    for method, reltol in asked:
        try:
            result = emsim.run(net.deck(f"method={method} reltol={reltol:g}"))
        except (DeckError, ConvergenceError) as refused:
            codes = {d.code for d in refused.diagnostics}
            assert method != "auto" and codes & {"E413", "E414"}, (method, codes, net.deck())
            continue
        start = None if determined else own_start(net, result)
        largest = np.abs(net.solution(np.arange(0.01, SPAN, 0.11), start)).max(axis=0)
        found, *_ = worst_row(net, result, reltol, largest, start)
        if found > most(method, reltol) and not [d for d in result.diagnostics if d.code in TOLD]:
            wrong.append(f"{method} at {reltol:g}: {found:.3g} tolerances")
    return wrong


@pytest.mark.parametrize("seed", daily(SEEDS, 3))
def test_a_random_linear_network_is_what_its_matrix_exponential_says(seed, record_property):
    net = network(seed)
    asked = [one for one in ASKED if (seed, *one) not in OPEN["network"]]
    wrong = too_far(net, asked, lambda method, reltol: SWINGS.get((seed, method, reltol), MOST))
    record_property("runs", len(asked))
    assert not wrong, "\n".join([*wrong, net.deck()])


@pytest.mark.parametrize("seed", daily(LOOPS, 3))
def test_a_loop_of_capacitors_through_sources_whose_current_is_read(seed):
    """Under auto at 1e-6, 19 of 186 were off by more than a hundred tolerances, 12 of 80 with F and H."""
    net = capacitor_loops(seed)
    asked = [("auto", 1e-3), ("auto", 1e-6), ("gear", 1e-6), ("esdirk", 1e-3), ("esdirk", 1e-6)]
    asked = [one for one in asked if (seed, *one) not in OPEN["capacitor_loops"]]
    # (a coil between two sources, in one long step behind a corner)
    wrong = too_far(net, asked, lambda *_: 15.0 if seed == 26 else MOST)
    assert not wrong, "\n".join([*wrong, net.deck()])


@pytest.mark.parametrize("seed", DRIVEN)
def test_what_the_slope_of_a_pulse_or_a_line_drives(seed):
    """Capacitors across supplies and coils that carry a source's current: rows right behind the corners as well. By auto at
    1e-9, five of the first seven were beyond ten tolerances without a word, by up to 2e7. All methods, more networks:
    tests/bench/linear_networks.py."""
    net = driven(seed)
    asked = [
        (m, r) for m, r in (("auto", 1e-3), ("auto", 1e-6), ("auto", 1e-9), ("gear", 1e-3), ("esdirk", 1e-6))
    ]
    wrong = too_far(net, asked)
    assert not wrong, "\n".join([*wrong, net.deck()])


@pytest.mark.parametrize("method", ["auto", "esdirk"])
@pytest.mark.parametrize(
    "net, reltol", [(driven(59), 1e-9), (network(95), 1e-6)], ids=["driven 59", "network 95"]
)
def test_a_voltage_that_follows_from_microamperes_beside_milliamperes(
    net: Network, reltol: float, method: str
):
    """Its 1e-12 A times 68 kohm was 155 tolerances of v(4), which no error norm held; 38 of network 95."""
    assert not too_far(net, [(method, reltol)])


@pytest.mark.parametrize("make, seeds", [(network, SEEDS), (capacitor_loops, LOOPS)])
def test_nearly_all_of_the_networks_have_a_solution_to_compare_with(
    make: Callable[[int], Network], seeds: list[int]
):
    def known(net: Network) -> bool:
        try:
            net.solution(TIMES[:1])
        except Unsuitable as why:
            return str(why) == "nothing determines the start"
        return True

    assert sum(known(make(seed)) for seed in seeds) >= 0.97 * len(seeds)

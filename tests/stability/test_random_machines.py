"""Random machines by two sets of equations and by every method, and what mechanics keeps.

Maximal coordinates share no closure row, mass matrix or multiplier with joint coordinates: at a tight tolerance both tell one
motion and the same forces. Every method then keeps within its tolerances of it, or a message says so.
"""

from __future__ import annotations

import numpy as np
import pytest
from random_machines import GRID, SPAN, Machine, machine
from support import daily

import emsim
from emsim.diagnostics import ConvergenceError

TIMES = np.round(np.arange(1, round(SPAN / GRID) + 1)) * GRID
SEEDS = 150
TIGHT = 1e-10
# so many tolerances at reltol 1e-4: what methods sum up over some hundred steps, in machines that amplify it
METHODS = {
    "auto": 5, "gear": 30, "esdirk": 150, "radau": 2, "radau5": 2, "gauss4": 20, "gauss6": 5, "rk45": 30, "dop853": 5,
    "multirate": 10, "trbdf2": 150, "trap": 600,
}  # fmt: skip
REFUSES = {
    "multirate": "taken apart",
    "gauss6": "closed loops need two stages",
    "gauss4": "rings under gauss",
}


def run(m: Machine, options: str) -> tuple[emsim.Result, dict[str, np.ndarray]]:
    r = emsim.run(m.deck(options))
    names = [*m.reads, *m.speeds, *m.forces, "energy()"]
    return r, {name: np.asarray(r.at(name, TIMES)) for name in names}


def off(found: dict[str, np.ndarray], exact: dict[str, np.ndarray], names: list[str], least: float) -> float:
    """Largest deviation, by the largest value of all of these."""
    largest = max(least, *(float(np.abs(exact[n]).max()) for n in names))
    return max(float(np.abs(found[n] - exact[n]).max()) for n in names) / largest


def moments(m: Machine, at: dict[str, np.ndarray]) -> list[np.ndarray]:
    """Momentum along x and y and its moment about the origin, of a machine in the plane that nothing holds."""
    px, py, turning = (np.zeros(len(TIMES)) for _ in range(3))
    for body, mass, inertia in m.masses:
        x, y, vx, vy = (at[f"{word}({body}.com)"] for word in ("x", "y", "vx", "vy"))
        along, across = (at[f"{word}({body}(1,0))"] - at[f"{word}({body}(0,0))"] for word in ("x", "y"))
        ahead, up = (at[f"{word}({body}(1,0))"] - at[f"{word}({body}(0,0))"] for word in ("vx", "vy"))
        px, py = px + mass * vx, py + mass * vy
        turning = turning + mass * (x * vy - y * vx) + inertia * (along * up - across * ahead)
    return [px, py, turning]


@pytest.mark.parametrize("seed", daily(range(SEEDS), 3))
def test_a_random_machine_moves_alike_by_two_sets_of_equations_and_every_method(seed):
    m = machine(seed)
    r, exact = run(m, f"reltol={TIGHT:g}")
    assert not [d for d in r.diagnostics if d.severity == "warning" and d.code != "W240"], r.diagnostics
    told, absolute = run(m, "reltol=1e-9 method=radau formulation=absolute")
    assert off(absolute, exact, m.reads, 0.1) < 1e-7, m.deck("")
    assert off(absolute, exact, m.speeds, 0.1) < 1e-6, m.deck("")
    if not [d for d in (*r.diagnostics, *told.diagnostics) if d.code == "W240"]:
        assert off(absolute, exact, m.forces, 0.1) < 1e-4, m.deck("")
    if m.keeps_energy:
        assert np.ptp(exact["energy()"]) < 1e-7 * max(1.0, np.abs(exact["energy()"]).max()), m.deck("")
    if m.floats:
        for kept in moments(m, exact):
            assert np.ptp(kept) < 1e-7, m.deck("")
    wrong = []
    for method, most in METHODS.items():
        try:
            r, found = run(m, f"method={method} reltol=1e-4")
        except ConvergenceError as refused:
            assert REFUSES.get(method, "-") in str(refused), f"{method}: {refused}\n{m.deck('')}"
            continue
        deviation = off(found, exact, m.reads, 0.1) / 1e-4
        if deviation > most:
            wrong.append(f"{method}: {deviation:.3g} tolerances")
        wrong += [f"{method}: {d.code}" for d in r.diagnostics if d.code in ("W404", "W407")]
        assert abs(r.energy.residual) < 1e-2 * max(1.0, r.energy.turnover), f"{method}\n{m.deck('')}"
    assert not wrong, "\n".join([*wrong, m.deck("")])


def test_so_many_of_the_machines_are_of_each_kind():
    machines = [machine(seed) for seed in range(SEEDS)]
    words = " ".join(card for m in machines for card in m.cards)
    for word in (
        "pin", "slide", "pinslot", "ball", "universal", "cylinder", "rod", "planar", "cut=yes",
        "GEAR", "DRIVE", "MOTOR", "DAMPER", "FORCE", "TORQUE", "SPRING",
    ):  # fmt: skip
        assert words.count(f"{word} ") + words.count(f" {word}") >= 4, word
    assert 50 <= sum(m.space for m in machines) <= 100
    assert sum(m.keeps_energy for m in machines) >= 50 and sum(m.floats for m in machines) >= 10

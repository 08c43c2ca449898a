"""Random networks of diodes, switches and logic against fine steps of a method of the tests' own, and against ngspice."""

from __future__ import annotations

import subprocess
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from diode_networks import ROWS, SPAN, Network, network
from support import daily, needs_ngspice

import emsim
from emsim.outputs import raw

METHODS = ["auto", "trap", "gear", "radau", "trbdf2", "esdirk"]
SEEDS = range(32)
MOST = 0.01  # of the range of all nodes: ten tolerances of 1e-3


@cache
def known(seed: int) -> tuple[Network, dict[str, np.ndarray]]:
    net = network(seed)
    return net, net.solution()


def quiet(net: Network) -> np.ndarray:
    """Rows that lie apart from every corner: there what turns within a step of the reference is over."""
    rows = np.arange(1, ROWS)
    corners = np.array([*net.corners(), np.inf])
    return rows[[bool(np.abs(corners - k * SPAN / ROWS).min() > 1.1) for k in rows]]


def worst(
    net: Network, exact: dict[str, np.ndarray], times: np.ndarray, table: dict[str, np.ndarray]
) -> tuple[float, str]:
    rows = quiet(net)
    span = max(1.0, *(np.ptp(exact[name]) for name in net.nodes))
    found = []
    for name in net.nodes:
        values = np.interp(rows * SPAN / ROWS, times * 1e6, table[name])
        off = np.abs(values - exact[name][rows])
        found.append((float(off.max() / span), f"{name} at {rows[off.argmax()] * SPAN / ROWS:g} us"))
    return max(found)


@pytest.mark.parametrize("seed", daily(SEEDS, 3))
def test_a_network_of_diodes_switches_and_logic_is_what_fine_steps_say(seed):
    net, exact = known(seed)
    wrong = []
    for method in METHODS:
        result = emsim.run(net.deck(f"method={method}"))
        assert not [d for d in result.diagnostics if d.code in ("W404", "W405", "W406")], result.diagnostics
        times = np.asarray(result.time)
        off, where = worst(net, exact, times, {n: np.asarray(result[f"v({n})"]) for n in net.nodes})
        if off > MOST:
            wrong.append(f"{method}: {where} off by {off:.2g} of the range")
    assert not wrong, "\n".join([*wrong, net.deck()])


@needs_ngspice
@pytest.mark.ngspice
@pytest.mark.parametrize("seed", range(12))
def test_a_network_of_diodes_switches_and_logic_is_what_ngspice_says(tmp_path: Path, seed: int):
    net, exact = known(seed)
    tight = f".tran 0.05u {SPAN:g}u 0 0.05u"
    text = net.deck("reltol=1e-5").replace(f".tran {SPAN / ROWS:g}u {SPAN:g}u", tight)
    (tmp_path / "deck.cir").write_text(text)
    subprocess.run(
        ["ngspice", "-b", "-r", "out.raw", "deck.cir"], cwd=tmp_path, capture_output=True, timeout=120, stdin=subprocess.DEVNULL
    )  # fmt: skip
    theirs = raw.read(str(tmp_path / "out.raw")).plots[0]
    table = {n: np.asarray(theirs.column(f"v({n})")) for n in net.nodes}
    off, where = worst(net, exact, np.asarray(theirs.column("time")), table)
    assert off <= MOST, f"{where} off by {off:.2g} of the range\n{net.deck()}"

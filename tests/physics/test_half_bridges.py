"""Half bridges whose diodes hold charge: the current of the supply follows from changes of charge. `auto` asks who sees it."""

from __future__ import annotations

import numpy as np
import pytest

import emsim

DECK = """Synchronous buck with body diodes and dead time
Vb in 0 12
Vh gh 0 PULSE(0 5 0 10n 10n 0.7u 2u)
Vl gl 0 PULSE(0 5 0.75u 10n 10n 1.2u 2u)
S1 in sw gh 0 sw
S2 sw 0 gl 0 sw
.model sw SW(vt=2.5 vh=0.2 ron=10m roff=1meg)
D1 sw in db
D2 0 sw db
.model db D(is=1n n=1.2 rs=10m cjo=500p tt=10n)
L1 sw out 2.2u
C1 out 0 4.7u
RL out 0 0.5
.tran 50n 40u
.save v(out) i(l1) {more}
.end
"""
SIGNALS = ("v(out)", "i(l1)")


def test_switches_do_without_long_memory() -> None:
    shown = emsim.run(DECK.format(more="i(vb)")).main
    table = emsim.run(DECK.format(more="")).main
    assert shown.stats["method"] == "gear"
    assert table.stats["method"] == "esdirk"
    assert table.stats["steps"] < shown.stats["steps"] / 4
    exact = emsim.run(DECK.format(more=""), method="radau", reltol=1e-8).main
    times = np.linspace(0.0, 40e-6, 2001)[1:]
    for name in SIGNALS:
        values = np.asarray(exact.at(name, times))
        for of in (table, shown):
            assert np.abs(np.asarray(of.at(name, times)) - values).max() <= 1e-3 * np.ptp(values), name


@pytest.mark.parametrize("more", ["i(vb)", ""])
def test_reltol_decides_the_error(more: str) -> None:
    exact = emsim.run(DECK.format(more=""), method="radau", reltol=1e-8).main
    times = np.linspace(0.0, 40e-6, 2001)[1:]
    values = np.asarray(exact.at("v(out)", times))
    for reltol in (1e-2, 1e-4):
        found = np.asarray(emsim.run(DECK.format(more=more), reltol=reltol).main.at("v(out)", times))
        assert np.abs(found - values).max() <= reltol * np.ptp(values)

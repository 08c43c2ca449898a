"""domino_wave.cir: strikes, speed of the wave, forces and rest, beside an integration of its own and a quadrature."""

from __future__ import annotations

from functools import cache
from math import pi, sqrt
from pathlib import Path

import numpy as np
import pytest
from domino_row import G, Row

import emsim

DECK = Path(__file__).parents[2] / "netlists" / "mechanical" / "domino_wave.cir"
N, H, D, S = 10, 0.048, 0.008, 0.02
# what of a time [0.1 s], a speed (relative) and an angle [rad] may be off
TOLERANCES = ((1e-4, 1e-5), (1e-6, 1e-7), (1e-8, 2e-9))


@cache
def row(n: int = N, push: float = 6.0) -> Row:
    return Row(n, H, D, S, 0.01, push)


def when(r, hits: str, count: int) -> float:
    return r.time[np.flatnonzero(np.asarray(r[hits]) >= count)[0]]


def struck(r, n: int = N):
    return np.array([when(r, f"hits(c{k})", 1) for k in range(1, n)])


def test_the_own_integration_takes_the_times_of_its_energy():
    own = row()
    assert np.diff([0.0, *own.strikes]) == pytest.approx([own.by_energy(k) for k in range(1, N)], abs=2e-12)


@pytest.mark.parametrize(("reltol", "error"), TOLERANCES)
def test_a_row_falls_as_by_its_own_integration(reltol, error):
    own, pairs = row(), range(1, N)
    forces = " ".join(f"force(c{k})" for k in pairs)
    r = emsim.run(DECK, reltol=reltol, also=f"{forces} energy()")
    t = np.asarray(r.time)
    strikes = struck(r)
    assert strikes == pytest.approx(own.strikes, abs=0.1 * error)
    assert S / np.diff(strikes) == pytest.approx(S / np.diff(own.strikes), rel=error)
    assert [when(r, f"hits(c{k})", 2) for k in pairs] == pytest.approx(
        [own.parallel] * (N - 1), abs=0.1 * error
    )
    down = t[np.flatnonzero(np.asarray(r[f"angle(p{N})"]) < 1e-9 - pi / 2)[0]]
    assert down == pytest.approx(own.down, abs=0.1 * error)
    # what each strike took, and then all the faces that meet at once
    start = r["energy()"][0]
    then = np.array([*own.strikes[1:], own.parallel, own.down]) - 1e-4
    taken = np.cumsum([*own.lost, own.stopped])
    assert start - r.at("energy()", then) == pytest.approx(taken, abs=reltol * start)
    assert abs(r.energy.residual) < reltol * start
    # angles and forces, at times of the run itself that are not next to a strike
    rows = [
        k for k in np.flatnonzero(t < own.parallel - 1e-4)[::7] if np.abs(t[k] - own.strikes).min() > 1e-4
    ]
    assert len(rows) > 40
    for k in rows:
        angles, loads = own.at(t[k])
        assert [-r[f"angle(p{i + 1})"][k] for i in range(len(angles))] == pytest.approx(angles, abs=error)
        assert [r[f"force(c{i + 1})"][k] for i in range(len(loads))] == pytest.approx(loads, rel=10 * error)
    assert [-r[f"angle(p{k})"][-1] for k in range(1, N + 1)] == pytest.approx(own.rest(N), abs=error)


def longer(n: int) -> str:
    """The deck's lines for the first two dominoes, for n of them."""
    deck = DECK.read_text().splitlines()
    rest = [
        line
        for line in deck
        if not line.startswith(("BODY", "JOINT", "STOP", "CONTACT", ".save", ".end", ".tran"))
    ]
    for k in range(1, n + 1):
        start = " ic=(0,{-push})" if k == 1 else ""
        rest += [
            f"BODY d{k} m=10m shape=box({{d}},{{h}})",
            f"JOINT p{k} 0({{{k - 1}*s}},0) d{k}({{d/2}},{{-h/2}}) pin{start}",
            f"STOP f{k} p{k} min=-90deg max=0 e=0",
        ]
    names = range(1, n)
    contacts = [f"CONTACT c{k} d{k} d{k + 1} e=0" for k in names]
    saved = ".save " + " ".join(f"hits(c{k})" for k in names)
    return "\n".join([*rest, *contacts, saved, ".tran 1m 0.75", ".end", ""])


@pytest.mark.parametrize("push", (4, 8))
def test_the_wave_has_one_speed_whatever_pushed_it(push, tmp_path):
    """24 dominoes: by then it is within 0.3 % of the limit, 1.889 sqrt(g h); the first gaps take more than twice as long."""
    deck = tmp_path / "long.cir"
    deck.write_text(longer(24))
    speeds = S / np.diff(struck(emsim.run(deck, {"push": push}, reltol=1e-6), 24))
    limit = S / np.diff(row(40, push).strikes)[-1]
    assert speeds == pytest.approx(S / np.diff(row(24, push).strikes), rel=1e-6)
    assert speeds[-1] == pytest.approx(limit, rel=3e-3) and speeds[0] < 0.5 * limit
    assert limit == pytest.approx(1.889 * sqrt(G * H), rel=3e-4)

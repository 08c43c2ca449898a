"""An independent witness: scipy's integrators on the equations that `emsim.compile` hands out.

d/dt Q(x, t) + F(x, t) = 0 is reduced to an ODE here, by nothing but the public System: with d the unknowns under d/dt and
a the algebraic ones, F_a(d, a, t) = 0 is solved for a by Newton's method on G, and C_dd d' = -F_d. scipy then integrates
at 1e-10 and must meet emsim's own radau at 1e-9.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from support import NETLISTS

import emsim

DECKS = {
    # deck: (time, methods, bound as a share of each signal's range)
    "mechanical/ref_double_pendulum": (2.0, ("DOP853", "Radau"), 1e-7),
    "coupled/ref_dc_motor_step": (0.1, ("DOP853", "LSODA"), 1e-7),
    "coupled/ref_linear_pot": (0.3, ("Radau", "BDF"), 3e-6),
    "coupled/ref_es_pullin_below": (2e-4, ("Radau", "LSODA"), 3e-6),
    "electrical/rc_ladder": (None, ("Radau",), 3e-6),
}


class Reduced:
    """The ODE of an index-1 deck: state d, algebraic unknowns solved per call."""

    def __init__(self, system: emsim.System) -> None:
        self.system = system
        self.a = np.asarray(system.algebraic)
        self.d = ~self.a
        self.x = np.array(system.x0, dtype=float)
        # rows without d/dt: those whose row of C is empty
        self.rows = np.asarray(abs(system.C(self.x, 0.0)).sum(axis=1)).ravel() == 0.0
        assert self.rows.sum() == self.a.sum(), "as many algebraic rows as unknowns: index 1"

    def complete(self, t: float, d: np.ndarray) -> np.ndarray:
        x = self.x.copy()
        x[self.d] = d
        for _ in range(30):
            residual = self.system.F(x, t)[self.rows]
            jacobian = self.system.G(x, t).toarray()[np.ix_(self.rows, self.a)]
            step = np.linalg.solve(jacobian, -residual) if self.a.any() else np.zeros(0)
            x[self.a] += step
            if not step.size or np.abs(step).max() <= 1e-13 * (1.0 + np.abs(x[self.a]).max()):
                break
        self.x = x
        return x

    def __call__(self, t: float, d: np.ndarray) -> np.ndarray:
        x = self.complete(t, d)
        c = self.system.C(x, t).toarray()[~self.rows]
        assert not c[:, self.a].any()
        return np.linalg.solve(c[:, self.d], -self.system.F(x, t)[~self.rows])


@pytest.mark.parametrize(("deck", "method"), [(name, m) for name, case in DECKS.items() for m in case[1]])
def test_scipy_meets_emsim(deck: str, method: str) -> None:
    stop, _, bound = DECKS[deck]
    path = NETLISTS / f"{deck}.cir"
    own = emsim.run(path, method="radau", reltol=1e-9)
    stop = stop or float(own.time[-1])
    reduced = Reduced(emsim.compile(path))
    start = reduced.x[reduced.d]
    scale = np.abs(start) + 1e-6
    rtol = 1e-12 if method == "DOP853" else 1e-10  # its dense output is worse than its steps
    witness = solve_ivp(
        reduced, (0.0, stop), start, method=method, rtol=rtol, atol=rtol * scale, dense_output=True
    )
    assert witness.success
    # an unknown's column: its own name, v(node) or i(branch)
    kinds = {"node": "v({})", "branch": "i({})"}
    system = reduced.system
    columns = [
        kinds.get(kind, "{}").format(name)
        for name, kind, state in zip(system.names, system.kinds, reduced.d, strict=True)
        if state
    ]
    compared = [c for c in columns if c in own.names]
    assert compared
    for column, name in enumerate(columns):
        if name not in compared:
            continue
        rows = (own.time > 0.0) & (own.time <= stop)
        mine, theirs = own[name][rows], witness.sol(own.time[rows])[column]
        span = np.ptp(mine) or 1.0
        assert np.abs(mine - theirs).max() <= bound * span, name

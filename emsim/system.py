"""The compiled equations of a deck, open to anybody:  d/dt Q(x, t) + F(x, t) = 0.

    s = emsim.compile("deck.cir")
    s.Q(s.x0, 0.0), s.F(s.x0, 0.0), s.C(s.x0, 0.0), s.G(s.x0, 0.0)

Row i belongs to unknown i. Rows marked `algebraic` have no Q: they read F = 0. Conditions (switches,
comparisons) take the side on which (x, t) lies.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np
    from scipy.sparse import csc_array

    from .analyses import Analysis
    from .assemble import Assembly


class System:
    """Unknowns by name and unit, and the equations' values and Jacobians.

    n          number of unknowns, and of rows
    names      of the unknowns: nodes by their name, branches by their element's, angle(j) omega(j) pos(j)
               vel(j), lambda(...) mu(...) of closed loops
    kinds      "node" "branch" "coordinate" "speed" "lambda" "mu" "derivative"
    units      "V" "A" "rad" "rad/s" "m" "m/s" ...
    algebraic  bool array: rows without d/dt
    x0         consistent starting point of the deck's transient (operating point, or UIC)
    """

    def __init__(self, assembly: Assembly, planned: list[Analysis]) -> None:
        from .analyses import transients

        self._engine = assembly.system
        self._assembly = assembly
        self._transient = next(iter(transients(planned)), None)
        self.n: int = self._engine.n
        self.names: list[str] = self._engine.names
        self.kinds: list[str] = self._engine.kinds
        self.units: list[str] = self._engine.units
        self._x0: Any = None
        self._pattern: Any = None

    def index(self, name: str) -> int:
        """Place of an unknown; `v(out)` and `i(v1)` are understood. Raises KeyError with the nearest name."""
        word = "".join(name.split()).lower()
        for spelling in (word, word[2:-1] if word[:2] in ("v(", "i(") else word):
            if spelling in self.names:
                return self.names.index(spelling)
        from .diagnostics import suggest

        near = suggest(word, self.names)
        raise KeyError(f"no unknown {name!r}" + (f", did you mean {near!r}?" if near else ""))

    @property
    def algebraic(self) -> np.ndarray:
        """Shape (n,), bool: rows whose Q is structurally zero."""
        import numpy as np

        return ~np.array(self._engine.differential_rows, dtype=bool)

    @property
    def differential(self) -> np.ndarray:
        """Shape (n,), bool: unknowns that stand under d/dt."""
        import numpy as np

        return np.array(self._engine.differential_unknowns, dtype=bool)

    @property
    def conditions(self) -> list[str]:
        """Names of the conditions (switches, comparisons, clamps), whose sides a run holds between events."""
        return self._engine.flag_names

    @property
    def latches(self) -> list[str]:
        """Those of `conditions` that have two thresholds: between these (x, t) does not tell their side."""
        return [name for name, up, down in self._engine.flags if up.id != down.id]

    def tolerances(self, reltol: float) -> np.ndarray:
        """Shape (n,): absolute tolerance of every unknown, in its unit, as a run at this reltol takes it."""
        import numpy as np

        return np.array(self._engine.tolerances({**self._assembly.options, "reltol": reltol}))

    @property
    def x0(self) -> np.ndarray:
        """Shape (n,): the consistent starting point. Raises ConvergenceError when there is none."""
        import numpy as np

        if self._x0 is None:
            t = self._transient
            uic, tstep = (t.uic, t.tstep) if t is not None else (False, 1e-6)
            found, x, failure = self._engine.start(self._assembly.options, uic, tstep)
            if not found:
                from .analyses.failure import explain_failure
                from .diagnostics import ConvergenceError

                raise ConvergenceError(explain_failure(self._assembly, None, failure or {}))
            self._x0 = np.array(x)
        return self._x0.copy()

    def Q(self, x: Any, t: float = 0.0) -> np.ndarray:
        """Charges, flux linkages, momenta; shape (n,). Of nodes that capacitors tie to each other alone one row is the sum
        of all of theirs, here and in F, C, G; it stores nothing."""
        import numpy as np

        return np.array(self._engine.q(_floats(x), t))

    def F(self, x: Any, t: float = 0.0) -> np.ndarray:
        """Currents, voltages, forces; shape (n,)."""
        import numpy as np

        return np.array(self._engine.f(_floats(x), t))

    def C(self, x: Any, t: float = 0.0) -> csc_array:
        """dQ/dx, sparse (n, n)."""
        return self._matrix(self._engine.jac(_floats(x), t)[0])

    def G(self, x: Any, t: float = 0.0) -> csc_array:
        """dF/dx, sparse (n, n)."""
        return self._matrix(self._engine.jac(_floats(x), t)[1])

    def jac(self, x: Any, t: float = 0.0) -> tuple[csc_array, csc_array]:
        """(C, G) in one evaluation."""
        c, g = self._engine.jac(_floats(x), t)
        return self._matrix(c), self._matrix(g)

    def dense(self, x: Any, t: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """(C, G) as dense arrays of shape (n, n), without scipy."""
        import numpy as np

        indptr, indices = self._engine.pattern()
        columns = np.repeat(np.arange(self.n), np.diff(indptr))
        out = np.zeros((2, self.n, self.n))
        out[:, indices, columns] = self._engine.jac(_floats(x), t)
        return out[0], out[1]

    def _matrix(self, values: list[float]) -> csc_array:
        import numpy as np
        from scipy.sparse import csc_array

        if self._pattern is None:
            indptr, indices = self._engine.pattern()
            self._pattern = np.array(indices, dtype=np.int32), np.array(indptr, dtype=np.int32)
        indices, indptr = self._pattern
        return csc_array((np.array(values), indices.copy(), indptr.copy()), shape=(self.n, self.n))

    def _repr_html_(self) -> str:
        """For notebooks: every unknown and its row."""
        from . import tabular

        return tabular.unknowns(self.names, self.kinds, self.units, self.algebraic)

    def __repr__(self) -> str:
        lines = [f"System of {self.n} unknowns"]
        lines += [
            f"  {n}  {k} [{u}]" for n, k, u in zip(self.names[:20], self.kinds, self.units, strict=False)
        ]
        if self.n > 20:
            lines.append(f"  ... and {self.n - 20} more")
        return "\n".join(lines)


def _floats(x: Any) -> list[float]:
    return x.tolist() if hasattr(x, "tolist") else list(x)

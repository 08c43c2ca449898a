"""P: coupled lines. With r, l, g, c matrices of a length and v = A u, i = A^-T j the lines of u and j do not know of each
other (telegraph.py) where A' c A, A^-1 l A^-T, A^-1 r A^-T and A' g A are diagonal together: A = c^(-1/2) U, U the
eigenvectors that c^(1/2) l c^(1/2) and the other two share. They do where r and g are the same in all conductors and l c, too:
one speed in all of them, or lines alike side by side. Where they do not, the deck is refused."""

from __future__ import annotations

from .base import Param, named
from .o import ModelledLine
from .telegraph import Mode, Telegraph
from .y import LENGTH, SingleLine

TYPE_CHECKING = False
if TYPE_CHECKING:
    import numpy as np

    from .contract import Circuit


MOST = 8  # conductors, as in ngspice
WEIGHTS = (1.0, 1e-3, 7e-4)  # of l, r, g: the losses choose where l has equal eigenvalues
NOTHING = 1e-5  # of the largest entry: what is off the diagonal comes from the digits of the numbers
DIGITS = 1e-12  # of the largest entry: a diagonal that rounding made
LITTLE = 1e-2  # more than this cannot be left out


class CoupledLines(ModelledLine):
    __slots__ = ()
    letter = "p"
    what = "coupled lines"
    form = "Pname a1 a2 .. against b1 b2 .. against model [len=]"
    terminals = tuple(f"n{k}" for k in range(1, 2 * MOST + 3))
    least = 4
    instance = named(
        **SingleLine.instance,
        dimension=Param("number of conductors, which the nodes tell too"),
    )
    model_types = ("cpl",)
    model_form = "cpl(r=.. l=.. g=.. c=.. length=), each row by row from the diagonal on"
    long_names = ("len", "length")
    model_words = named(
        r=Param("resistances of a length: the rows of the matrix from the diagonal on, or the diagonal", "Ohm/m"),
        l=Param("inductances of a length, likewise", "H/m"), g=Param("conductances of a length, likewise", "S/m"),
        c=Param("capacitances of a length, likewise; between two conductors negative, as Maxwell has them", "F/m"),
        **LENGTH,
    )  # fmt: skip

    def modes(self) -> list[Mode]:
        import numpy as np

        if len(self.nodes) % 2:
            raise ValueError(
                f"has {len(self.nodes)} nodes: both ends have the same conductors, and one that they are against"
            )
        if (said := self.params.get("dimension", count := len(self.nodes) // 2 - 1)) != count:
            raise ValueError(f"has dimension={said:g}, and nodes for {count}")
        r, l, g, c = (self._matrix(key) for key in "rlgc")  # noqa: E741
        if not (c.any() and np.linalg.eigvalsh(c)[0] > 0.0):
            raise ValueError("has a c= that no lines have: it must be positive definite")
        size = float(np.mean(np.diag(c)))
        values, vectors = np.linalg.eigh(c / size)
        root, inverse = (vectors * values**power @ vectors.T for power in (0.5, -0.5))
        turned = [root @ l @ root, root @ r @ root, inverse @ g @ inverse]
        sizes = [float(np.abs(m).max()) or 1.0 for m in turned]
        shared = np.linalg.eigh(sum(w * m / s for w, m, s in zip(WEIGHTS, turned, sizes, strict=True)))[1]
        a, b = inverse @ shared, root @ shared
        of = [shared.T @ m @ shared for m in turned]
        off = [float(np.abs(m - np.diag(np.diag(m))).max()) / s for m, s in zip(of, sizes, strict=True)]
        self.extra["off"] = max(off)
        if max(off) > LITTLE:
            raise ValueError(
                "has no modes: its losses couple them. Give all conductors the same r and no g, "
                "or write pieces of R, L with K, and C"
            )
        lines = zip(
            *(
                np.where(np.diag(m) > DIGITS * s, np.diag(m), 0.0).tolist()
                for m, s in zip(of, sizes, strict=True)
            ),
            strict=True,
        )
        return [
            Mode(
                Telegraph(r_k, l_k, g_k, size, self.length),
                [float(x) for x in b[:, k]],
                [float(x) for x in a[:, k]],
            )
            for k, (l_k, r_k, g_k) in enumerate(lines)
        ]

    def check(self, ctx: Circuit) -> None:
        super().check(ctx)
        if NOTHING < (off := self.extra.get("off", 0.0)) <= LITTLE:
            ctx.sink.warning(
                "W290", f"`{self.name}`: losses that couple its modes, {off:.2g} of all, are left out", self.span,
                "they are none where all conductors have the same r and l c is the same in all",
            )  # fmt: skip

    def _matrix(self, key: str) -> np.ndarray:
        """Symmetric, from its rows behind the diagonal, or from the diagonal alone."""
        import numpy as np

        assert self.model is not None
        n = len(self.nodes) // 2 - 1
        given = self.model.params.get(key, 0.0)
        values = [float(v) for v in (given if isinstance(given, (tuple, list)) else [given])]
        if not any(values):
            return np.zeros((n, n))
        if len(values) == n:
            return np.diag(values)
        if len(values) != n * (n + 1) // 2:
            raise ValueError(
                f"has {len(values)} values of {key}=: for {n} conductors there are {n * (n + 1) // 2}, or the {n} of the diagonal"
            )
        found = np.zeros((n, n))
        found[np.triu_indices(n)] = values
        return found + np.triu(found, 1).T

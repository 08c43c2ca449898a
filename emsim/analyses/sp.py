"""`.sp dec|oct|lin n fstart fstop [static]`: scattering parameters between the ports; admittances, impedances.

A port is a voltage source with `portnum` and the resistance `z0`. With one source e_j of 1 V at a time, and v_i across the ports,

    s_ij = 2 v_i/e_j sqrt(z0_j/z0_i) - (i = j)

(power waves, Kurokawa 1965), z = r (1 - s)^-1 (1 + s) r and y = z^-1 with r the roots of z0. Columns s_1_1, y_1_1, z_1_1 as in
ngspice; impedances or admittances that there are none of, as of a lone element in series, are left out. Behind them stand the
voltages and currents of the deck while the last port is driven by 1 V, as in ngspice.
"""

from __future__ import annotations

import math

from .ac import OverFrequencies, grid, linearised, singular
from .base import Computed, Run, wrong

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Self

    import numpy as np

    from ..assemble import Assembly, Context, Output
    from ..deck import Analysis as Card
    from ..diagnostics import Sink
    from ..elements import Element
    from .base import Progress

REGULAR = 1e12  # a matrix of a larger condition has no inverse


class Sp(OverFrequencies):
    word = "sp"
    asks_as = "ac"
    form = ".sp dec|oct|lin points fstart fstop"
    meaning = "scattering parameters between the sources with portnum and z0"
    plotname = "SP Analysis"
    has_responses = True
    names_itself = True
    complex = True

    @classmethod
    def read(cls, card: Card, sink: Sink) -> Self | None:
        args = [a for a in card.args if a != "static"]
        if [isinstance(a, str) for a in args] == [True, *[False] * 4] and args.pop():
            wrong(cls, card, sink, ".sp does not tell the noise of ports yet: .noise does, of any signal")
            return None
        found = grid(cls, card, sink, args)
        return None if found is None else cls(card, found)

    def columns(self, ctx: Context) -> list[Output]:
        from ..assemble import Output
        from ..assemble.outputs import saved

        ports = _ports(ctx)
        numbers = [number for number, _ in ports]
        if numbers != list(range(1, len(ports) + 1)) or not ports:
            order = ", ".join(map(str, numbers))
            said = f"the ports of .sp are numbered {order}, not 1, 2, ..." if ports else ".sp finds no port"
            ctx.sink.error("E305", said, self.card.span, "V1 in 0 dc 0 ac 1 portnum 1 z0 50")
        for _, e in ports:
            if not e.number("z0", 0.0) > 0.0:
                ctx.sink.error("E305", f"port `{e.name}` has no z0=, which must be positive", e.span)
        across = [Output(e.name, "V", e.between(ctx)) for _, e in ports]
        return [*across, *(o for o in saved(ctx).values() if o.expr is not None)]

    def run(self, assembly: Assembly, progress: Progress | None = None) -> Run:
        import numpy as np

        ctx = assembly.ctx
        ports = [e for _, e in _ports(ctx)]
        outputs = assembly.outputs[self]
        exprs = [o.expr for o in outputs if o.expr is not None]
        roots = np.sqrt([e.number("z0") for e in ports])
        linear, trouble = linearised(assembly, self, self.static)
        names: list[str] = []
        units: list[str] = []
        data: list[np.ndarray] = []
        if linear is not None:
            points = [(0.0, 2.0 * math.pi * f) for f in self.frequencies]
            s = np.zeros((len(points), len(ports), len(ports)), dtype=complex)
            try:
                for j, e in enumerate(ports):
                    found = linear.respond(points, exprs, [(ctx.wave(e), (1.0, 0.0))])
                    for i, column in enumerate(found[: len(ports)]):
                        s[:, i, j] = 2.0 * np.frombuffer(column, complex) * roots[j] / roots[i] - (i == j)
            except ValueError as error:
                trouble = [singular(assembly, self, error)]
            else:
                one = np.eye(len(ports))
                outer = np.outer(roots, roots)
                for letter, unit, matrix in (
                    ("s", "", s),
                    ("y", "S", _divided(one - s, one + s, 1.0 / outer)),
                    ("z", "Ohm", _divided(one + s, one - s, outer)),
                ):
                    if matrix is None:
                        continue
                    for i in range(len(ports)):
                        for j in range(len(ports)):
                            names.append(f"{letter}_{i + 1}_{j + 1}")
                            units.append(unit)
                            data.append(matrix[:, i, j])
                for output, column in zip(outputs[len(ports) :], found[len(ports) :], strict=True):
                    names.append(output.name)
                    units.append(output.unit)
                    data.append(np.frombuffer(column, complex))
        columns = [np.ascontiguousarray(c).tobytes() for c in data]
        frequencies = list(self.frequencies) if columns else []
        waves = Computed(
            [frequencies, *columns], [False] + [True] * len(columns), "failed" if trouble else "ok"
        )
        return Run(self, ["frequency", *names], ["Hz", *units], waves, self.axis, trouble=trouble)


def _divided(a: np.ndarray, b: np.ndarray, by: np.ndarray) -> np.ndarray | None:
    """b^-1 a, which commute, at each frequency; None where there is none."""
    import numpy as np

    if not (np.linalg.cond(b) < REGULAR).all():
        return None
    return np.linalg.solve(b, a) * by


def _ports(ctx: Context) -> list[tuple[int, Element]]:
    """The ports by their numbers."""
    found = [
        (int(e.number("portnum")), e)
        for e in ctx.elements.values()
        if e.letter in "Vv" and "portnum" in e.params
    ]
    return sorted(found, key=lambda pair: pair[0])

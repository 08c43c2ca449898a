"""O: a line with losses (telegraph.py), by the r, l, g, c and length of its .model ltra; what Y and P have in common with it."""

from __future__ import annotations

import math

from .base import BOLTZMANN, ZERO_CELSIUS, Element, Param, ignored, named
from .telegraph import Mode, Telegraph

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import ClassVar

    import numpy as np

    from .base import Coloured, Path
    from .contract import Accounts, Circuit, Expr
    from .net import Net

OF_LENGTH = {
    "r": Param("resistance of a length", "Ohm/m", 0.0), "l": Param("inductance of a length", "H/m", 0.0),
    "g": Param("conductance of a length", "S/m", 0.0), "c": Param("capacitance of a length", "F/m", 0.0),
}  # fmt: skip


class ModelledLine(Element):
    """A line of one or several conductors, which its modes describe."""

    __slots__ = ()
    behind = ("model",)
    accounted = "supplied"
    law = "-dv/dx = r i + l di/dt, -di/dx = g v + c dv/dt along the line"
    long_names: ClassVar[tuple[str, ...]] = ("length",)  # of the length, on the line or in the .model

    @property
    def ends(self) -> tuple[list[str], list[str]]:
        """The nodes of either end; the last is that which the others are against."""
        half = len(self.nodes) // 2
        return self.nodes[:half], self.nodes[half:]

    @property
    def length(self) -> float:
        assert self.model is not None
        of = [self.params, self.model.params]
        return next((float(p[key]) for p in of for key in self.long_names if key in p), 0.0)

    def modes(self) -> list[Mode]:
        """Lines that do not know of each other. Raises ValueError with what is wrong."""
        assert self.model is not None
        r, l, g, c = (float(self.model.params.get(key, 0.0)) for key in "rlgc")  # noqa: E741
        return [Mode(Telegraph(r, l, g, c, self.length), [1.0], [1.0])]

    def checked(self) -> list[Mode]:
        """Raises ValueError with what is wrong."""
        if not self.length > 0.0:
            raise ValueError("has no length, which must be positive")
        found = self.modes()
        for mode in found:
            if trouble := mode.line.trouble():
                raise ValueError(trouble)
        return found

    def check(self, ctx: Circuit) -> None:
        super().check(ctx)
        assert self.model is not None
        try:
            self.checked()
        except ValueError as why:
            said = f"`{self.name}` by .model `{self.model.name}` {why}"
            ctx.sink.error("E295", said, self.span, "form: .model name " + self.model_form)

    model_form: ClassVar[str] = ""

    def paths(self) -> tuple[Path, ...]:
        half = len(self.nodes) // 2
        return tuple(
            path
            for k in range(half - 1)
            for path in (
                (k, half - 1, "conducts"),
                (half + k, len(self.nodes) - 1, "conducts"),
                (k, half + k, "conducts"),
            )
        )

    def _initial(self) -> list[float]:
        given = self.params.get("ic", ())
        values = [float(v) for v in (given if isinstance(given, (tuple, list)) else [given])]
        return [*values, *[0.0] * (4 - len(values))]

    def branches(self, is_read: bool) -> tuple[tuple[str, float], ...]:
        ic = self._initial()
        return tuple((name, ic[1 + 2 * end]) for end in (0, 1) for name in self._names(end))

    def _names(self, end: int) -> list[str]:
        """Of the currents into an end's conductors."""
        count = len(self.nodes) // 2 - 1
        return [f"{self.name}#i{end + 1}" + (f"_{k + 1}" if count > 1 else "") for k in range(count)]

    def current(self, ctx: Circuit, terminal: int = 0) -> Expr:
        half = len(self.nodes) // 2
        into = [ctx.b.x(ctx.branches[name]) for name in self._names(terminal // half)]
        k = terminal % half
        if k < len(into):
            return into[k]
        return -sum(into[1:], into[0])

    def flow(self, ctx: Circuit) -> Expr:
        return self.current(ctx)

    def contribute(self, ctx: Circuit) -> None:
        try:
            modes = self.checked()
        except ValueError:
            return  # told by `check`
        branches = [[ctx.branches[name] for name in self._names(end)] for end in (0, 1)]
        volts: list[list[Expr]] = []
        for (*nodes, against), into in zip(self.ends, branches, strict=True):
            for node, i in zip(nodes, into, strict=True):
                ctx.b.g(ctx.node(node), i, 1.0)
                ctx.b.g(ctx.node(against), i, -1.0)
            volts.append([ctx.v(node, against) for node in nodes])
        amps = [[ctx.b.x(i) for i in into] for into in branches]
        for k, mode in enumerate(modes):
            name = self.name if len(modes) == 1 else f"{self.name}#m{k + 1}"
            v1, v2 = (mode.voltage(v) for v in volts)
            i1, i2 = (mode.current(i) for i in amps)
            rows = mode.line.rows(ctx, name, (v1, v2), (i1, i2), self._initial())
            for into, row in zip(branches, rows, strict=True):
                ctx.b.add_f(into[k], row)

    def slope(self, value: float, write: Callable[[float], None]) -> Callable[[complex], np.ndarray]:
        """By a parameter of that value, which `write` sets: what it changes at s [rad/s] in the currents into the conductors of
        the first end, then of the second, for voltages of 1 [S]. r, l, g, c of all of the line are straight lines over it."""
        import numpy as np

        of = []
        for side in (1.5, 0.5):
            write(side * value)
            of.append([(m.line.r, m.line.l, m.line.g, m.line.c) for m in self.modes()])
        write(value)
        modes = self.modes()
        by = [[(a - b) / value for a, b in zip(*pair, strict=True)] for pair in zip(*of, strict=True)]

        def at(s: complex) -> np.ndarray:
            total = np.zeros((len(self.nodes) - 2, len(self.nodes) - 2), complex)
            for mode, change in zip(modes, by, strict=True):
                common, opposite = mode.line.admittances(s, change)
                shape = 0.5 * np.outer(mode.of_voltage, mode.of_voltage)
                one, other = (common + opposite) * shape, (common - opposite) * shape
                total += np.block([[one, other], [other, one]])
            return total

        return at

    def coloured(self, ctx: Circuit) -> Sequence[Coloured]:
        """Thermal noise of what is warm alike everywhere: 4 k T times the real part of its admittances (Twiss 1955)."""
        kelvin = self.temperature(ctx) + ZERO_CELSIUS
        found: list[Coloured] = []
        for mode in self.modes():
            for parity, sign in enumerate((1.0, -1.0)):
                rows: list[tuple[int, float]] = []
                for (*nodes, against), side in zip(self.ends, (1.0, sign), strict=True):
                    rows += [
                        (ctx.node(node), side * b) for node, b in zip(nodes, mode.of_voltage, strict=True)
                    ]
                    rows.append((ctx.node(against), -side * sum(mode.of_voltage)))

                def power(f: float, line: Telegraph = mode.line, parity: int = parity) -> float:
                    return (
                        2.0 * BOLTZMANN * kelvin * max(line.admittances(2j * math.pi * f)[parity].real, 0.0)
                    )

                found.append(("thermal", [(row, factor) for row, factor in rows if row >= 0], power))
        return found

    def account(self, ctx: Circuit, book: Accounts) -> None:
        """What it holds is on its way, and what it loses is not told apart."""
        taken = ctx.b.const(0.0)
        for end, (*nodes, against) in enumerate(self.ends):
            for k, node in enumerate(nodes):
                taken = taken + ctx.v(node, against) * self.current(ctx, end * (len(nodes) + 1) + k)
        book.supplies(self, -taken)

    def analogue(self, net: Net) -> str:
        model = self.model.name if self.model is not None else ""
        return f"{net.head(self)} {model}{net.parameters(self)}"


class LossyLine(ModelledLine):
    __slots__ = ()
    letter = "o"
    what = "lossy line"
    form = "Oname a+ a- b+ b- model [ic=v1,i1,v2,i2]"
    terminals = ("a+", "a-", "b+", "b-")
    instance = named(ic=Param("v1, i1, v2, i2 before a start with uic", "V, A, V, A"))
    model_types: ClassVar[tuple[str, ...]] = ("ltra",)
    model_form = "ltra(r= l= g= c= len=)"
    long_names: ClassVar[tuple[str, ...]] = ("len",)
    # what ngspice's convolution is told has no meaning here
    model_words = named(
        **OF_LENGTH, len=Param("length", "m"),
        **ignored("rel abs nocontrol steplimit nosteplimit lininterp quadinterp mixedinterp truncnr truncdontcut"),
        **ignored("compactrel compactabs"),
    )  # fmt: skip

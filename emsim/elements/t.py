"""T: a lossless line. With z0 and the delay td, i1 and i2 into its two ends:

    v1 - z0 i1 = (v2 + z0 i2)(t - td)        v2 - z0 i2 = (v1 + z0 i1)(t - td)

(Branin 1967), here divided by z0. At the operating point it is a wire.
"""

from __future__ import annotations

import cmath

from .base import Element, Param, Path, named

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .contract import Accounts, Circuit, Expr
    from .net import Net

QUARTER = 0.25  # nl where f is given alone


class Line(Element):
    __slots__ = ()
    letter = "t"
    what = "lossless line"
    form = "Tname a+ a- b+ b- z0= td= [ic=v1,i1,v2,i2], or f= [nl=] in place of td="
    law = "v1 - z0 i1 is v2 + z0 i2 a time td ago, and the other way round"
    terminals = ("a+", "a-", "b+", "b-")
    accounted = "supplied"
    instance = named(
        z0=Param("characteristic impedance", "Ohm"), zo=Param("z0= by another name", "Ohm"),
        td=Param("delay", "s"), f=Param("frequency at which it is nl wavelengths long", "Hz"),
        nl=Param("wavelengths at f", default=QUARTER),
        ic=Param("v1, i1, v2, i2 before a start with uic", "V, A, V, A"),
    )  # fmt: skip

    @property
    def impedance(self) -> float:
        return self.number("z0", self.number("zo"))

    @property
    def delay(self) -> float:
        if "td" in self.params:
            return self.number("td")
        f = self.number("f")
        return self.number("nl", QUARTER) / f if f else 0.0

    def check(self, ctx: Circuit) -> None:
        super().check(ctx)
        if not self.impedance > 0.0:
            ctx.sink.error("E281", f"`{self.name}` has no z0=, which must be positive", self.span, self.hint)
        if not self.delay > 0.0:
            said = f"`{self.name}` has no delay: td= must be positive, or f="
            ctx.sink.error("E281", said, self.span, self.hint)

    def paths(self) -> tuple[Path, ...]:
        return ((0, 1, "conducts"), (2, 3, "conducts"), (0, 2, "conducts"))

    def branches(self, is_read: bool) -> tuple[tuple[str, float], ...]:
        ic = self._initial()
        return ((f"{self.name}#i1", ic[1]), (f"{self.name}#i2", ic[3]))

    def _initial(self) -> list[float]:
        given = self.params.get("ic", ())
        values = [float(v) for v in (given if isinstance(given, (tuple, list)) else [given])]
        return [*values, *[0.0] * (4 - len(values))]

    def current(self, ctx: Circuit, terminal: int = 0) -> Expr:
        i = ctx.b.x(ctx.branches[f"{self.name}#i{1 + terminal // 2}"])
        return -i if terminal % 2 else i

    def flow(self, ctx: Circuit) -> Expr:
        return self.current(ctx)

    def contribute(self, ctx: Circuit) -> None:
        z0, td, ic = self.impedance, self.delay, self._initial()
        if not (z0 > 0.0 and td > 0.0):
            return
        ends = []
        for k in (0, 2):
            i = ctx.branches[f"{self.name}#i{1 + k // 2}"]
            ends.append((ctx.v(self.nodes[k], self.nodes[k + 1]) / z0, i, ic[k] / z0 + ic[k + 1], k))
        for (v, i, _, k), (v_far, i_far, before, _) in (ends, ends[::-1]):
            for node, sign in ((self.nodes[k], 1.0), (self.nodes[k + 1], -1.0)):
                ctx.b.g(ctx.node(node), i, sign)
            arrives = ctx.delay(v_far + ctx.b.x(i_far), td, f"{self.name}#wave{1 + k // 2}", before)
            ctx.b.add_f(i, v - ctx.b.x(i) - arrives)

    def turns(
        self, s: complex, volts: tuple[complex, complex], amps: tuple[complex, complex]
    ) -> dict[str, tuple[complex, complex]]:
        """What a parameter that is given changes in the two rows  v1/z0 - i1 - (v2/z0 + i2) exp(-s td)  of a small
        signal, per unit of it: volts [V] and amps [A] at the two ends, s [rad/s]."""
        z0, late = self.impedance, cmath.exp(-s * self.delay)
        by_td = [s * late * (v / z0 + i) for v, i in zip(volts, amps, strict=True)][::-1]
        by = {
            "z0" if "z0" in self.params else "zo": [
                -(v - late * far) / z0**2 for v, far in zip(volts, volts[::-1], strict=True)
            ]
        }
        if "td" in self.params:
            by["td"] = by_td
        else:
            f, nl = self.number("f"), self.number("nl", QUARTER)
            by |= {"f": [-nl / f**2 * d for d in by_td], "nl": [d / f for d in by_td]}
        return {key: (first, second) for key, (first, second) in by.items()}

    def account(self, ctx: Circuit, book: Accounts) -> None:
        """What it holds is on its way: it takes at one end and gives later at the other."""
        one, two = (ctx.v(self.nodes[k], self.nodes[k + 1]) * self.current(ctx, k) for k in (0, 2))
        book.supplies(self, -(one + two))

    def analogue(self, net: Net) -> str:
        words = [net.head(self), f"z0={self.impedance!r}", f"td={self.delay!r}"]
        return " ".join(words)

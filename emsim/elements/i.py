"""I: i(t) from n+ through the source to n-, times m."""

from __future__ import annotations

from .base import DRIVES, M, Path, named
from .independent import DISTORTION, Independent

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .contract import Accounts, Circuit, Expr


class CurrentSource(Independent):
    __slots__ = ()
    accounted = "supplied"
    letter = "i"
    what = "current source"
    form = Independent.form.format("I")
    law = "i = i(t), from n+ through the source to n-"
    unit = "A"
    instance = named(**M, **DISTORTION)
    current_name = "current"
    jumps = 4

    def paths(self) -> tuple[Path, ...]:
        return DRIVES

    def imposes(self, ctx: Circuit) -> bool:
        return True

    def contribute(self, ctx: Circuit) -> None:
        m, k = self.number("m", 1.0), ctx.wave(self)
        if ctx.rise() is None:
            ctx.b.f_wave(ctx.node(self.nodes[0]), k, m)
            ctx.b.f_wave(ctx.node(self.nodes[1]), k, -m)
            return
        current = self.flow(ctx)
        ctx.b.add_f(ctx.node(self.nodes[0]), current)
        ctx.b.add_f(ctx.node(self.nodes[1]), -current)

    def flow(self, ctx: Circuit) -> Expr:
        current, rise = self.number("m", 1.0) * ctx.b.wave_expr(ctx.wave(self)), ctx.rise()
        return current if rise is None else current * rise

    def account(self, ctx: Circuit, book: Accounts) -> None:
        book.supplies(self, -(self.between(ctx) * self.flow(ctx)))

"""`.op [static]`: the operating point, one row.

The machine is held at its initial coordinates and speeds; with `static` it comes to rest.
"""

from __future__ import annotations

from .base import Analysis, Run, channels, derived, recorded

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Self

    from ..assemble import Assembly
    from ..deck import Analysis as Card
    from ..diagnostics import Sink
    from .base import Progress


class Op(Analysis):
    word = "op"
    form = ".op [static]"
    meaning = "the operating point; static: the machine comes to rest"
    plotname = "Operating Point"
    has_responses = True
    draws = ("machine", "circuit")

    def __init__(self, card: Card) -> None:
        self.card = card
        self.static = is_static(card)

    @classmethod
    def read(cls, card: Card, sink: Sink) -> Self:
        return cls(card)

    def run(self, assembly: Assembly, progress: Progress | None = None) -> Run:
        names, units, exprs = recorded(assembly, self)
        machine = assembly.machine if self.static else None
        state = (
            [machine.b.x(k) for k in range(assembly.system.n)] if machine is not None and machine.own else []
        )
        from .rest import bounds, holding, unstable

        exprs = [*exprs, *channels(assembly, self)]
        most = bounds(assembly) if state else []
        waves = assembly.system.op([*exprs, *state, *most], assembly.options, self.static)
        trouble = []
        if waves.status == "failed":
            from .failure import explain

            trouble = explain(assembly, self, waves)
        if state and not trouble:
            at = 1 + len(exprs)
            values = [waves.value(0, at + k) for k in range(len(state) + len(most))]
            x, can = values[: len(state)], values[len(state) :]
            if held := holding(assembly, x, can):
                assembly.flat.sink.note(
                    "N240",
                    f"friction holds the machine where it is: {held}",
                    self.card.span,
                    "it rests as well wherever else that much is enough; ic= says where it is looked for from",
                )
            falls = unstable(assembly, x, can)
            if falls is not None:
                assembly.flat.sink.warning(
                    "W241",
                    f"the machine is at rest where it does not stay: the least push and {falls} moves on, away from it",
                    self.card.span,
                    "start a little aside, with ic= or guess= of that joint, and it comes to the rest that lies downhill",
                )
        return Run(self, names, units, waves, None, derived=derived(assembly, self), trouble=trouble)

    def text(self) -> str:
        return ".op" + (" static" if self.static else "")


def is_static(card: Card) -> bool:
    return "static" in card.flags or "static" in card.args

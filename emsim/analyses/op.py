"""`.op [static]`: the operating point, one row.

The machine is held at its initial coordinates and speeds; with `static` it comes to rest.
"""

from __future__ import annotations

from .base import Analysis, Run, derived, recorded
from .failure import explain

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

    def __init__(self, card: Card) -> None:
        self.card = card
        self.static = is_static(card)

    @classmethod
    def read(cls, card: Card, sink: Sink) -> Self:
        return cls(card)

    def run(self, assembly: Assembly, progress: Progress | None = None) -> Run:
        names, units, exprs = recorded(assembly, self)
        waves = assembly.system.op(exprs, assembly.options, self.static)
        trouble = explain(assembly, self, waves) if waves.status == "failed" else []
        return Run(self, names, units, waves, None, derived=derived(assembly, self), trouble=trouble)

    def text(self) -> str:
        return ".op" + (" static" if self.static else "")


def is_static(card: Card) -> bool:
    return "static" in card.flags or "static" in card.args

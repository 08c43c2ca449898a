"""What cmeter and lmeter tell: the values of the parts that lie at a node."""

from __future__ import annotations

from ...expr import Node
from .base import CodeModel, Seat, Word, driving, named, reading

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import ClassVar


class Meter(CodeModel):
    letter: ClassVar[str]
    ports = (reading("in"), driving("out"))
    parameters = named(gain=Word("factor on what is told", "", 1.0))

    def found(self, seat: Seat) -> list[float]:
        """Values of the parts at the node, and of those behind sources of voltage there, as XSPICE looks for them."""
        flat, (node, ground) = seat.ctx.flat, seat.at["in"][0].nodes
        if ground != "0":
            seat.wrong("it measures between a node and ground", "", "take %v in place of %vd")
        near = {node}
        for e in flat.elements:
            if e.letter == "v" and node in e.nodes:
                near.update(n for n in e.nodes if n != "0")
        parts = [e for e in flat.elements if e.letter == self.letter and near.intersection(e.nodes)]
        behaving = next((e for e in parts if isinstance(e.value, Node)), None)
        if behaving is not None:
            seat.wrong(f"`{behaving.name}` at `{node}` has no value that is a number")
            return []
        return [value for e in parts if (value := e.quantity(seat.ctx)) is not None]

    def total(self, values: list[float]) -> float:
        raise NotImplementedError

    def build(self, seat: Seat) -> None:
        seat.drive("out", seat["gain"] * self.total(self.found(seat)))

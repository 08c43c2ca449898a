"""POINT: a name for a point of a body, `arm.tip`. It contributes nothing to the equations."""

from __future__ import annotations

from .base import Card, Required, Spec

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..diagnostics import Sink


class Point(Card):
    spec = Spec(
        "POINT",
        "POINT body.name x y [z]",
        terminals="",
        mark=("at",),
        meaning="a named point of a body",
        at=Required("m", "the coordinates in body axes", "vector"),
    )
    at: tuple[float, ...]
    local: tuple[float, ...]

    @classmethod
    def marked(cls, code: str) -> bool:
        body, _, own = (code.split()[1:2] or [""])[0].partition(".")
        return bool(body and own)

    @classmethod
    def mark_in_words(cls) -> str:
        return "a name with a dot"

    def check(self, sink: Sink) -> None:
        if len(self.at) not in (2, 3):
            sink.error("E232", f"POINT {self.name} has two or three coordinates", self.span)
        self.local = (*self.at, 0.0)[:3]
        self.body, dot, _ = self.name.rpartition(".")
        if not dot:
            sink.error(
                "E233", f"POINT {self.name} names no body", self.span, f"the form is: {self.spec.form}"
            )

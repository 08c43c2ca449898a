"""Letters of SPICE that are read and refused by name. Each goes when it gets a file of its own."""

from __future__ import annotations

from .base import Element


class Later(Element):
    __slots__ = ()
    supported = False
    least = 3

    def paths(self) -> tuple[()]:
        return ()


class LossyLine(Later):
    letter, what, model_types, least = "o", "lossy line", ("ltra",), 4


class CoupledLines(Later):
    letter, what, model_types, least = "p", "coupled lines", ("cpl",), 0


class SingleLine(Later):
    letter, what, model_types, least = "y", "lossy line", ("txl",), 0


LATER: tuple[type[Element], ...] = (LossyLine, CoupledLines, SingleLine)

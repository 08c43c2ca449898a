"""Letters of SPICE that are read and refused by name. Each goes when it gets a file of its own."""

from __future__ import annotations

from .base import Element, ignored


class Later(Element):
    __slots__ = ()
    supported = False
    least = 3

    def paths(self) -> tuple[()]:
        return ()


class CodeModel(Later):
    letter, what, least = "a", "XSPICE code model", 0


class Jfet(Later):
    letter, what, model_types, instance = "j", "JFET", ("njf", "pjf"), ignored("m")


class Mosfet(Later):
    letter, what, usual, instance = "m", "MOSFET", 4, ignored("m")
    model_types = ("nmos", "pmos", "vdmos", "vdmosn", "vdmosp", "nsoi", "psoi")


class Compiled(Later):
    letter, what, least = "n", "OSDI model", 0


class LossyLine(Later):
    letter, what, model_types, least = "o", "lossy line", ("ltra",), 4


class CoupledLines(Later):
    letter, what, model_types, least = "p", "coupled lines", ("cpl",), 0


class Bipolar(Later):
    letter, what, model_types, instance = "q", "bipolar transistor", ("npn", "pnp", "lpnp"), ignored("m")


class TransmissionLine(Later):
    letter, what, least = "t", "transmission line", 0


class RcLine(Later):
    letter, what, model_types = "u", "RC line", ("urc",)


class SingleLine(Later):
    letter, what, model_types, least = "y", "lossy line", ("txl",), 0


class Mesfet(Later):
    letter, what, model_types = "z", "MESFET", ("nmf", "pmf", "nhfet", "phfet")


LATER: tuple[type[Element], ...] = (
    CodeModel, Jfet, Mosfet, Compiled, LossyLine, CoupledLines, Bipolar, TransmissionLine, RcLine, SingleLine, Mesfet,
)  # fmt: skip

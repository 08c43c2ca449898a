"""Z: a MESFET after Statz (devices/mesfet.va)."""

from __future__ import annotations

from .base import named
from .compiled import Compiled
from .j import Jfet

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import ClassVar


class Mesfet(Jfet):
    __slots__ = ()
    letter = "z"
    what = "MESFET"
    form = "Zname drain gate source model [area] [off] [ic=] [m=]"
    law = "Statz: id = beta (vgs - vto)^2/(1 + b (vgs - vto)) (1 + lambda vds), saturating with alpha: the module mesfet"
    sorts = named(
        nmf=("mesfet", 1.0), pmf=("mesfet", -1.0), nhfet=("hfet1", 1.0), phfet=("hfet1", -1.0),
    )  # fmt: skip
    levels: ClassVar[dict[int, str]] = {1: "mesfet"}
    model_types = tuple(sorts)
    instance = named(**Compiled.instance, area=Jfet.instance["area"])

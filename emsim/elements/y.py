"""Y: a line with losses as TXL of KSPICE has it; the same line as O (telegraph.py)."""

from __future__ import annotations

from .base import Param, named
from .o import OF_LENGTH, ModelledLine

LENGTH = {"length": Param("length", "m"), "len": Param("length= by another name", "m")}


class SingleLine(ModelledLine):
    __slots__ = ()
    letter = "y"
    what = "single lossy line"
    form = "Yname a+ a- b+ b- model [len=]"
    terminals = ("a+", "a-", "b+", "b-")
    instance = named(
        len=Param("length, in place of the model's", "m"), length=Param("len= by another name", "m"),
    )  # fmt: skip
    model_types = ("txl",)
    model_form = "txl(r= l= g= c= length=)"
    long_names = ("len", "length")
    model_words = named(**OF_LENGTH, **LENGTH)

"""N: an instance of any module of Verilog-A: of devices/, or of a file that .hdl names."""

from __future__ import annotations

from .compiled import Compiled


class OfModule(Compiled):
    __slots__ = ()
    letter = "n"
    what = "device in Verilog-A"
    form = "Nname node [node ...] model [parameter=value ...]; .model model module(...)"
    law = "that of the module which its .model names"
    terminals = tuple(f"node{k}" for k in range(1, 65))
    least = 1
    usual = 2

"""The analogue circuit as elements write it; reports/analogue.py makes it."""

from __future__ import annotations

from typing import Any, Protocol

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..deck import Waveform
    from ..expr import Node


class Net(Protocol):
    """Names and values as ngspice reads them."""

    def head(self, e: Any) -> str: ...  # name and nodes
    def name_of(self, name: str) -> str: ...
    def plain(self, node: str) -> str: ...
    def parameters(self, e: Any) -> str: ...
    def expression(self, ast: Node) -> str: ...
    def wave(self, w: Waveform) -> str: ...
    def initial_current(self, name: str) -> float: ...

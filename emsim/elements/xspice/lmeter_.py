"""lmeter: the inductance at a node."""

from __future__ import annotations

from .meters import Meter


class InductanceMeter(Meter):
    name, letter = "lmeter", "l"
    what = "inductance at a node, as a voltage"
    law = "out = gain times what the coils at the node, and behind sources of voltage there, come to in parallel"

    def total(self, values: list[float]) -> float:
        return 1.0 / sum(1.0 / v for v in values) if values else 1e12


MODEL = InductanceMeter

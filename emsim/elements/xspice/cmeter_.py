"""cmeter: the capacitance at a node."""

from __future__ import annotations

from .meters import Meter


class CapacitanceMeter(Meter):
    name, letter = "cmeter", "c"
    what = "capacitance at a node, as a voltage"
    law = "out = gain times the sum of the capacitors at the node, and behind sources of voltage there"

    def total(self, values: list[float]) -> float:
        return sum(values)


MODEL = CapacitanceMeter

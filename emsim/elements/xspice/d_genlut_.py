"""d_genlut: several functions of several inputs."""

from __future__ import annotations

from . import PARTS
from .base import Seat, named, numbers, text
from .digital import Part, ports

STATES = {"0": 0.0, "1": 1.0, "z": 2.0}


class GeneralLut(Part):
    name, what = PARTS["d_genlut"][:2]
    law = "each output is the entry of its part of table_values whose number the inputs make"
    ports = ports(PARTS["d_genlut"][2])
    parameters = named(
        rise_delay=numbers(
            "delays of what goes up, an output each; the last is that of all further ones", "s", (1e-9,)
        ),
        fall_delay=numbers("delays of what goes down", "s", (1e-9,)),
        input_load=numbers(""),
        input_delay=numbers("delays of the inputs; the largest of those that change counts", "s", (0.0,)),
        table_values=text(
            "0, 1, z (open) or another letter (undefined) for each of the inputs' values, one output behind the other"
        ),
    )

    def build(self, seat: Seat) -> None:
        table = [STATES.get(c, 3.0) for c in (seat["table_values"] or "").lower()]
        delays = {key: seat[key] for key in ("rise_delay", "fall_delay", "input_delay")}
        self.place(seat, {**delays, "table": table})


MODEL = GeneralLut

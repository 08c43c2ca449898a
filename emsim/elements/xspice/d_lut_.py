"""d_lut: any function of several inputs."""

from __future__ import annotations

from . import PARTS
from .base import Seat
from .digital import Part, ports, words


class Lut(Part):
    name, what = PARTS["d_lut"][:2]
    law = "out is the entry of table_values whose number the inputs make"
    ports = ports(PARTS["d_lut"][2])
    parameters = words(PARTS["d_lut"][3])

    def build(self, seat: Seat) -> None:
        table = seat["table_values"] or ""
        if set(table) - set("01"):
            return seat.wrong(f"table_values=`{table}` is not made of 0 and 1", "table_values")
        self.place(seat, {"table": [float(c) for c in table]})


MODEL = Lut

"""d_source: states that a file gives."""

from __future__ import annotations

from ...tables import TableError, number
from . import PARTS
from .base import Seat
from .digital import Part, ports, words
from .files import lines, report, state


class Source(Part):
    name, what = PARTS["d_source"][:2]
    law = "a line of input_file: a time [s], and the state of each output from then on"
    ports = ports(PARTS["d_source"][2])
    parameters = words(PARTS["d_source"][3])

    def build(self, seat: Seat) -> None:
        table = lines(seat, "input_file")
        if table is None:
            return
        width = seat.width("out")
        times: list[float] = []
        states: list[float] = []
        try:
            for line, row in table:
                if len(row) != width + 1:
                    raise TableError(f"line {line} has {len(row) - 1} states, `{seat.name}` {width} outputs")
                times.append(number(row[0], line))
                if len(times) > 1 and times[-1] <= times[-2]:
                    raise TableError(f"line {line}: times do not ascend")
                states += [state(word, line) for word in row[1:]]
            if not times:
                raise TableError("there is no line in it")
        except TableError as error:
            return report(seat, "input_file", error)
        self.place(seat, {"times": times, "states": states})


MODEL = Source

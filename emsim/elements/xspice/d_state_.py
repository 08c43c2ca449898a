"""d_state: a state machine that a file describes."""

from __future__ import annotations

from ...tables import TableError, number
from . import PARTS
from .base import Seat
from .digital import Part, ports, words
from .files import lines, report, state

INPUTS = {"0": 0.0, "1": 1.0, "x": 2.0}


class Machine(Part):
    name, what = PARTS["d_state"][:2]
    law = "lines of state_file: state, outputs, inputs (0 1 x) -> next state; without the first two: more inputs of that state"
    ports = ports(PARTS["d_state"][2])
    parameters = words(PARTS["d_state"][3])

    def build(self, seat: Seat) -> None:
        table = lines(seat, "state_file")
        if table is None:
            return
        inputs, width = seat.width("in"), seat.width("out")
        rows: list[float] = []
        outputs: list[float] = []
        known: list[float] = []
        try:
            for line, row in table:
                if len(row) == 1 + width + inputs + 2:
                    known.append(number(row[0], line))
                    outputs += [known[-1], *(state(word, line) for word in row[1 : 1 + width])]
                    row = row[1 + width :]
                elif len(row) != inputs + 2:
                    said = f"line {line} has {len(row)} words: state, {width} outputs, {inputs} inputs, ->, next state"
                    raise TableError(said)
                if not known:
                    raise TableError(f"line {line}: no state stands before it")
                if row[inputs] != "->":
                    raise TableError(f"line {line}: `->` stands before the next state")
                wrong = [word for word in row[:inputs] if word not in INPUTS]
                if wrong:
                    raise TableError(f"line {line}: `{wrong[0]}` is no input, it is 0, 1 or x")
                rows += [known[-1], number(row[inputs + 1], line), *(INPUTS[word] for word in row[:inputs])]
            missing = set(rows[1 :: inputs + 2]) - set(known)
            if missing:
                raise TableError(f"there is no state {min(missing):g}")
            if not known:
                raise TableError("there is no line in it")
        except TableError as error:
            return report(seat, "state_file", error)
        if seat["reset_state"] not in known:
            return seat.wrong(
                f"reset_state={seat['reset_state']:g} is no state of {seat['state_file']}", "reset_state"
            )
        self.place(seat, {"rows": rows, "outputs": outputs})


MODEL = Machine

"""filesource: voltages and currents that a file gives."""

from __future__ import annotations

from ...tables import TableError, number
from .base import CodeModel, Seat, Word, driving, flag, named, numbers, text
from .files import lines, report


class FileSource(CodeModel):
    name = "filesource"
    what = "source whose courses stand in a file"
    law = "a line of file: a time [s], and the value of each output there; straight lines between, constant behind the last"
    ports = (driving("out", is_list=True),)
    parameters = named(
        file=text("name of the file, beside the deck"),
        timeoffset=Word("added to every time", "s", 0.0),
        timescale=Word("factor on every time", "", 1.0),
        timerelative=flag("times count from the line before"),
        amplstep=flag("a value holds until the next line, with no line between"),
        amploffset=numbers("added to each output's values"),
        amplscale=numbers("factor on each output's values"),
    )

    def build(self, seat: Seat) -> None:
        table = lines(seat, "file", "#;")
        if table is None:
            return
        b, width = seat.ctx.b, seat.width("out")
        # before the first line all outputs are at their offsets, from the time offset on
        times = [0.0, seat["timeoffset"]]
        starts = [seat.entry("amploffset", k, 0.0) for k in range(width)]
        rows = [starts, starts]
        try:
            for line, words in table:
                if len(words) != width + 1:
                    raise TableError(
                        f"line {line} has {len(words) - 1} values, `{seat.name}` {width} outputs"
                    )
                t = number(words[0], line) * seat["timescale"]
                times.append(t + (times[-1] if seat["timerelative"] else seat["timeoffset"]))
                if times[-1] < times[-2] or (len(times) > 3 and times[-1] == times[-2]):
                    raise TableError(f"line {line}: times do not ascend")
                rows.append(
                    [
                        number(word, line) * seat.entry("amplscale", k, 1.0) + starts[k]
                        for k, word in enumerate(words[1:])
                    ]
                )
            if len(times) == 2:
                raise TableError("there is no line in it")
        except TableError as error:
            return report(seat, "file", error)
        for k in range(width):
            points: list[float] = []
            for j, t in enumerate(times):
                if seat["amplstep"] and j:
                    points += [t, rows[j - 1][k]]
                points += [t, rows[j][k]]
            wave = b.wave("pwl", points, None)
            seat.drive("out", b.wave_expr(wave), k)


MODEL = FileSource

"""FMU: a functional mock-up unit of others as part of the deck: a controller, a tyre, a battery.

Its lists are read in build_unit.py: `in u` holds the expression that the variable u takes, `out y` the variable whose value is
read as `name.y`, `out v(node)` that of a voltage, `p k` a value before the start. How it becomes a rule or equations:
assemble/foreign.py.
"""

from __future__ import annotations

from ..deck import MachineCard
from .base import Card, Default, Spec, is_number, sets

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from ..diagnostics import Sink

LISTS = ("in", "out", "p")


class Fmu(Card):
    spec = Spec(
        "FMU",
        "FMU name file.fmu in=(u=v(a) ..) out=(y v(b)=z ..) [p=(k=2 ..)] [step=] [kind=cosim|model] [log=no]",
        terminals="",
        mark=("in", "out", "step"),
        meaning="a functional mock-up unit (FMI 2.0, 3.0) as part of the deck",
        laws={"k": "y = FMU(u)"},
        step=Default(None, "s", "time from one exchange of values to the next", above=0.0),
        kind=Default(
            "", "", "for co-simulation or for model exchange", kind="word", words=("", "cosim", "model")
        ),
        log=Default("no", "", "tell all that it says", kind="word", words=("yes", "no")),
    )
    step: float | None
    kind: str
    log: str

    def __init__(self, raw: MachineCard, sink: Sink) -> None:
        self.lists: dict[str, dict[str, Any]] = {key: {} for key in LISTS}
        own: dict[str, Any] = {}
        self.file = ""
        for key, value in raw.params.items():
            which, blank, name = key.partition(" ")
            if key == "file":
                self.file = str(value)
            elif blank and which in LISTS:
                self.lists[which][name] = value
            else:
                own[key] = value
        bare = MachineCard(raw.kind, raw.name, raw.args, own, raw.wave, raw.span, raw.param_spans, raw.line)
        super().__init__(bare, sink)
        self.raw = raw

    @classmethod
    def marked(cls, code: str) -> bool:
        """A file name ends in .fmu, or one of its lists is set."""
        words = code.split(None, 3)
        return len(words) > 2 and (
            words[2].strip("'\"").lower().endswith(".fmu") or sets(code, cls.spec.mark)
        )

    def check(self, sink: Sink) -> None:
        for name, value in self.lists["p"].items():
            if not isinstance(value, str) and not is_number(value):
                said = f"`{name}` of FMU {self.name} has to be known before the run"
                sink.error(
                    "E386",
                    said,
                    self.place(f"p {name}"),
                    "a number, a text in quotes, or parameters in braces",
                )

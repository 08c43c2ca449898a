"""BLOCK: difference equations, computed at the ticks of a clock; their values stay what they are in between.

Its parameters are its signals: x={expression}, x[-1]=value before the first tick, v(node)={expression} for a voltage. How they
become rules of the engine: assemble/clocked.py.
"""

from __future__ import annotations

from ..deck import MachineCard
from ..expr import ticks_ago
from .base import Card, Required, Spec, is_number

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from ..diagnostics import Sink

# what else a name in an equation could be
RESERVED = ("time", "temper", "hertz", "ts", "clock", "pi", "inf")


class Block(Card):
    spec = Spec(
        "BLOCK",
        "BLOCK name clock= x={expression} ... [x[-1]=0] [v(node)={expression}]",
        terminals="",
        mark=("clock",),
        meaning="difference equations at the ticks of a clock",
        laws={"k": "x = f(x[-1], ..)"},
        clock=Required("", "clock at whose ticks it is computed", kind="word"),
    )
    clock: str

    def __init__(self, raw: MachineCard, sink: Sink) -> None:
        self.equations: dict[str, Any] = {}
        self.starts: dict[str, dict[int, float]] = {}
        own = {key: value for key, value in raw.params.items() if key in self.spec.params}
        bare = MachineCard(raw.kind, raw.name, raw.args, own, raw.wave, raw.span, raw.param_spans, raw.line)
        super().__init__(bare, sink)
        for key, value in raw.params.items():
            if key not in own:
                self._take(key, value, sink)
        self.raw = raw

    def _take(self, key: str, value: Any, sink: Sink) -> None:
        at, bracket, past = self.place(key), *key.partition("[")[1:]
        name = key.partition("[")[0]
        said = hint = ""
        if key == "value":
            said, hint = (
                f"BLOCK {self.name} has a value without a name",
                "each signal has a name: x={expression}",
            )
        elif name in RESERVED:
            said, hint = (
                f"a signal cannot be called `{name}`",
                "that word means something else in expressions",
            )
        elif isinstance(value, (str, tuple)) or type(value).__name__ == "Waveform":
            said, hint = (
                f"`{key}` of BLOCK {self.name} is no expression",
                "an expression stands in braces: x={v(in)}",
            )
        elif bracket and (ago := ticks_ago(bracket + past)) is None:
            said, hint = (
                f"`{key}` is no tick before the first",
                "x[-1]=0 is x before the first tick, x[-2] before that",
            )
        elif bracket and not is_number(value):
            said, hint = (
                f"{key}= of BLOCK {self.name} has to be known before the run",
                "a number, or parameters in braces",
            )
        elif bracket:
            self.starts.setdefault(name, {})[ago or 1] = float(value)
        elif (name[:2] != "v(" and not name.replace("_", "a").isalnum()) or name[:1].isdigit():
            said, hint = f"`{name}` cannot be a signal's name", "letters, digits and _ make a name"
        else:
            self.equations[name] = value
        if said:
            sink.error("E390", said, at, hint)

    def check_starts(self, sink: Sink) -> None:
        """Initial values are of signals that there are."""
        for name in self.starts:
            if name not in self.equations:
                key = next(key for key in self.raw.params if key.partition("[")[0] == name)
                said = f"BLOCK {self.name} has no signal `{name}`"
                sink.error("E390", said, self.place(key), f"give it an equation: {name}={{..}}")

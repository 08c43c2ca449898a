"""FMUs of others: what their files say of them, held to what the deck asks, and handed to the engine (engine/src/foreign).

One for co-simulation has a clock of its own: at each tick it has made its step by the inputs of the tick before, shows its
outputs, and takes its inputs anew.

One for model exchange is part of equation (1): its states x, its inputs u, its outputs y and its event indicators z are unknowns,

    d/dt x - f(x, u, t) = 0,   u - expression = 0,   y - g(x, u, t) = 0,   z - h(x, u, t) = 0.

Operating points hold its states where it begins. A z that changes its sign is an event of it.
"""

from __future__ import annotations

import os

from ..cards.fmu import Fmu
from ..described import FLOATS, NUMBERS, FmuError, Unpacked, Variable
from ..diagnostics import Diagnostic, OutsideError, suggest
from ..expr import Node

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, NoReturn

    from ..diagnostics import Span
    from .context import Context

CAUSES = {
    "in": ("input",),
    "out": ("output", "local", "independent", "calculatedParameter"),
    "p": ("parameter",),
}
WHAT = {"in": "input", "out": "output", "p": "parameter"}
LAST_WORDS = "error[E516]: the FMU {name} ({file})"
# a file is unpacked once while a deck that uses it is there: (path, time of change) -> content
_UNPACKED: dict[tuple[str, float], Any] = {}


class Foreign:
    """A card with its file, opened. `inputs`, `outputs`: name in the deck -> variable. Raises OutsideError (E515, E501)."""

    def __init__(self, ctx: Context, card: Fmu) -> None:
        self.card, self.ok = card, card.ok
        place = card.place("file")
        base = os.path.dirname(place.file.path) if place.file.path else "."
        path = os.path.join(base, card.file)
        try:
            self.unpacked = _open(path)
            self.described = self.unpacked.described
            self.is_model, self.identifier = self._kind(ctx)
            self._supported()
        except FmuError as error:
            self._refuse(error.said, error.hint)
        except OSError as error:
            said = f"the FMU {card.file} cannot be read: {error.strerror or error}"
            raise OutsideError(
                Diagnostic("error", "E501", said, place, "a path is relative to the deck's folder")
            ) from None
        ctx.unpacked.append(self.unpacked)
        self.inputs = self._variables(ctx, "in")
        self.outputs = self._variables(ctx, "out")
        self.parameters = self._variables(ctx, "p")

    def _refuse(self, said: str, hint: str = "") -> NoReturn:
        raise OutsideError(Diagnostic("error", "E515", said, self.card.place("file"), hint or None))

    def _kind(self, ctx: Context) -> tuple[bool, str]:
        """Is it used for model exchange, and the name of its library."""
        of, asked, path = self.described, self.card.kind, self.card.file
        is_model = asked == "model" or (asked == "" and of.couples is None)
        found = of.exchanges if is_model else of.couples
        if found is None:
            word = "model exchange" if is_model else "co-simulation"
            other = "" if asked == "" else "leave kind= out: it is used for what it is for"
            if of.couples is None and of.exchanges is None:
                word, other = (
                    "co-simulation or model exchange",
                    "scheduled execution, by clocks of others, is not supported",
                )
            raise FmuError(f"{path} is no FMU for {word}", other)
        if found.get("needsExecutionTool") == "true":
            raise FmuError(f"{path} needs the program that made it: it is no model by itself")
        times = sum(c.kind == "FMU" and c.params["file"] == path for c in ctx.flat.clocked)
        if found.get("canBeInstantiatedOnlyOncePerProcess") == "true" and times > 1:
            raise FmuError(
                f"{path} can be there once (canBeInstantiatedOnlyOncePerProcess), the deck has it {times} times"
            )
        if is_model and of.arrays:
            raise FmuError(
                f"`{of.arrays[0]}` of {path} is an array: states and event indicators are single values"
            )
        return is_model, found.get("modelIdentifier", "")

    def _supported(self) -> None:
        library = os.path.join(self.unpacked.folder, *self.described.library(self.identifier).split("/"))
        if not os.path.isfile(library):
            inside = os.path.join(self.unpacked.folder, "binaries")
            there = sorted(os.listdir(inside)) if os.path.isdir(inside) else []
            known = f"it has {', '.join(there)}" if there else "it has none at all"
            raise FmuError(f"{self.card.file} has no library for this platform", known)
        self.library = library

    def _variables(self, ctx: Context, which: str) -> dict[str, Variable]:
        found: dict[str, Variable] = {}
        for name, value in self.card.lists[which].items():
            span = self.card.place(f"{which} {name}")
            variable = self._variable(ctx, value if which == "out" else name, which, span)
            if variable is not None:
                found[name] = variable
        return found

    def _variable(self, ctx: Context, name: str, which: str, span: Span) -> Variable | None:
        variable, causes = self.described.find(name), CAUSES[which]
        said = hint = ""
        if variable is None:
            own = [v.name for v in self.described.order if v.causality in causes]
            near = suggest(name, own)
            said = f"{self.card.file} has no {WHAT[which]} `{name}`"
            hint = f"did you mean `{near}`?" if near else f"there are {', '.join(own[:12]) or 'none'}"
        elif (
            which != "p"
            and variable.causality not in causes
            and not (which == "out" and variable.causality == "input")
        ):
            said = f"`{variable.name}` of {self.card.file} is no {WHAT[which]}"
            hint = f"it is of causality {variable.causality}"
        elif which == "p" and not variable.is_settable:
            said = f"`{variable.name}` of {self.card.file} cannot be set before the start"
            hint = f"it is {variable.variability or variable.causality}"
        elif variable.is_array:
            said = (
                f"`{variable.name}` of {self.card.file} is an array: single values alone are read and written"
            )
        elif variable.kind not in NUMBERS and not (which == "p" and variable.kind == "String"):
            said = f"`{variable.name}` of {self.card.file} is of the type {variable.kind}"
            hint = "numbers and truth values alone go through"
        elif which == "p" and isinstance(self.card.lists["p"][name], str) != (variable.kind == "String"):
            said = f"`{variable.name}` of {self.card.file} is of the type {variable.kind}"
            hint = "a text stands in quotes, a number does not"
        if said or variable is None:
            ctx.sink.error("E386", said, span, hint)
            self.ok = False
            return None
        return variable

    def step(self, ctx: Context) -> float:
        """Its communication step [s]."""
        found = self.card.step or self.described.step
        if found is None or not found > 0.0:
            said = f"FMU {self.card.name} needs a step: {self.card.file} does not say one"
            ctx.sink.error(
                "E386", said, self.card.span, "step=1m is the time from one exchange of values to the next"
            )
            self.ok = False
            return 1.0
        return found

    def spec(self, step: float) -> dict[str, Any]:
        """As the engine takes it."""
        of, card = self.described, self.card
        attributes = (of.exchanges if self.is_model else of.couples) or {}
        parameters = [(v, card.lists["p"][name]) for name, v in self.parameters.items()]
        resources = os.path.join(self.unpacked.folder, "resources")
        if of.version == 2:
            from pathlib import Path

            resources = Path(resources).as_uri()
        else:
            resources = os.path.join(resources, "")
        word = "canGetAndSetFMUstate" if of.version == 2 else "canGetAndSetFMUState"
        directional = "providesDirectionalDerivative" + ("s" if of.version == 3 else "")
        return {
            "card": card.name, "version": of.version, "exchange": self.is_model, "library": self.library,
            "resources": resources, "token": of.token,
            "starts": [((v.reference, v.kind), float(x)) for v, x in parameters if not isinstance(x, str)],
            "texts": [(v.reference, x) for v, x in parameters if isinstance(x, str)],
            "inputs": [(v.reference, v.kind) for v in self.inputs.values()],
            "outputs": [(v.reference, v.kind) for v in self.outputs.values()],
            "rough": [v.kind in FLOATS and v.causality != "output" for v in self.outputs.values()],
            "discrete": [self._at_events(v) for v in self.inputs.values()],
            "states": [of.state(v).reference for v in of.derivatives] if self.is_model else [],
            "derivatives": [v.reference for v in of.derivatives] if self.is_model else [],
            "indicators": of.indicators, "returns": attributes.get(word) == "true",
            "differentiates": attributes.get(directional) == "true",
            "hears_steps": self._hears(attributes), "logs": card.log == "yes", "tolerance": None, "stop": float("inf"),
            "step": step, "last_words": LAST_WORDS.format(name=card.name, file=card.file),
            "files": self.unpacked.content, "folders": self.unpacked.folders,
        }  # fmt: skip

    def _at_events(self, variable: Variable) -> bool:
        """Does an input change at events alone?"""
        return self.is_model and (variable.variability == "discrete" or variable.kind not in FLOATS)

    def begins(self, ctx: Context) -> list[float]:
        """Its states before the run: as the deck or its file says, where that is exact; else as an instance has them."""
        states = [self.described.state(v) for v in self.described.derivatives]
        given = {id(v): self.card.lists["p"][name] for name, v in self.parameters.items()}
        found = [given.get(id(v), v.start) if v.initial == "exact" else None for v in states]
        if all(x is not None for x in found):
            return [float(x) for x in found if x is not None]
        from .._engine import Builder

        try:
            return Builder.exchange_starts(self.spec(0.0))
        except ValueError as error:
            self._refuse(f"the FMU {self.card.name} ({self.card.file}) cannot be initialised: {error}")

    def _hears(self, attributes: dict[str, str]) -> bool:
        """Is it to be told of completed steps?"""
        if self.described.version == 2:
            return attributes.get("completedIntegratorStepNotNeeded") != "true"
        return attributes.get("needsCompletedIntegratorStep") != "false"

    def start(self, variable: Variable) -> float:
        """What an output is before the run, where that is said."""
        try:
            return {"true": 1.0, "false": 0.0}.get(variable.start or "0") or float(variable.start or 0.0)
        except ValueError:
            return 0.0


class Exchanged:
    """An FMU for model exchange: its unknowns are there before any expression is compiled."""

    def __init__(self, ctx: Context, foreign: Foreign) -> None:
        self.foreign, b, name = foreign, ctx.b, foreign.card.name
        described, states = foreign.described, foreign.begins(ctx)
        self.states = []
        for derivative, start in zip(described.derivatives, states, strict=True):
            row = b.unknown(f"{name}#{described.state(derivative).name}", "coordinate", "", start)
            b.c(row, row, 1.0)
            self.states.append(row)
        self.inputs = [self._value(ctx, f"{name}#{v.name}") for v in foreign.inputs.values()]
        self.time = [self._value(ctx, f"{name}#time")]
        self.outputs = [self._value(ctx, f"{name}.{key}") for key in foreign.outputs]
        self.indicators = [self._value(ctx, f"{name}#z{k + 1}") for k in range(described.indicators)]
        for key, row in zip(foreign.outputs, self.outputs, strict=True):
            ctx.signals[f"{name}.{key}"] = b.x(row)

    @staticmethod
    def _value(ctx: Context, name: str) -> int:
        row = ctx.b.unknown(name, "branch", "", 0.0)
        ctx.b.g(row, row, 1.0)
        return row

    def contribute(self, ctx: Context) -> None:
        """What its inputs are, and the FMU."""
        card, b = self.foreign.card, ctx.b
        for row, name in zip(self.inputs, self.foreign.inputs, strict=True):
            value = card.lists["in"][name]
            e = (
                ctx.compile(value, card.place(f"in {name}"))
                if isinstance(value, Node)
                else b.const(float(value))
            )
            b.add_f(row, -e)
        b.add_f(self.time[0], -b.time())
        flags = [
            b.flag(b.x(row), None, f"event indicator {k + 1} of FMU {card.name}")
            for k, row in enumerate(self.indicators)
        ]
        places = [self.states, self.inputs, self.time, self.outputs, self.indicators]
        b.exchange(self.foreign.spec(0.0), places, flags)


def _open(path: str) -> Unpacked:
    """Raises FmuError, OSError."""
    import weakref

    key = (os.path.abspath(path), os.stat(path).st_mtime)
    known = _UNPACKED.get(key)
    found: Unpacked | None = None if known is None else known()
    if found is None or not os.path.isdir(found.folder):
        found = Unpacked(path)
        _UNPACKED[key] = weakref.ref(found)
    return found

"""A run that Python leads: inputs are set and outputs read between steps, and a state is kept and gone back to."""

from __future__ import annotations

import re
from copy import copy

from .._engine import Instance
from ..assemble.hands import movable
from ..diagnostics import ConvergenceError, Diagnostic, suggest
from . import ports
from .export import given, opened, packed

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from typing import Any

    from .._engine import State
    from ..source import Source

CODED = re.compile(r"\[([EWN]\d+)\] (.*)", re.S)


class Session:
    """A deck between two steps of a run. Several may run at once, in threads too.

    source      a path, the text itself, or a PySpice Circuit; its .tran says how long steps may be
    inputs      sources (V, I), values of machine cards (TORQUE load, or load(tau)) and parameters (.param) that are set from step
                to step, besides those of a .fmu card; they may jump, or go on along a line
    outputs     expressions as .print takes them
    tunables    R, L, C, numbers of cards and parameters that are set between steps
    defines     parameters that stand above the deck's .param; options: .options, by name
    Raises DeckError, OutsideError; ConvergenceError where the run cannot start.
    """

    def __init__(
        self,
        source: Source,
        inputs: str | Sequence[str] = (),
        outputs: str | Sequence[str] = (),
        tunables: str | Sequence[str] = (),
        defines: Mapping[str, Any] | None = None,
        options: Mapping[str, Any] | None = None,
    ) -> None:
        more = {
            "in": ports.given(inputs, False),
            "param": [],
            "tune": ports.given(tunables, False),
            "out": ports.given(outputs, True),
        }
        assembly, model, variables = opened(source, more, defines, options)
        self.diagnostics = list(assembly.flat.sink.diagnostics)
        self.units = {v.name: v.unit for v in variables}
        self._places = {v.name: k for k, v in enumerate(variables)}
        self.inputs = tuple(v.name for v in given(variables))
        self.outputs = tuple(v.name for v in variables if v.causality == "output")
        machine = assembly.machine
        places = [] if machine is None else movable(machine)[0]
        grouped = machine is not None and bool(machine.groups)
        # where rates of coordinates are no speeds of their own (quaternions) the mass matrix is none of theirs
        self._coordinates = {
            c.q_name: (c.row, None if grouped or c.speed_row < 0 else c.speed_row) for c in places
        }
        self._packed = packed(assembly, model, variables)
        self._make()

    def _make(self) -> None:
        self._instance = Instance(self._packed)
        for coordinate, speed in self._coordinates.values():
            self._instance.may_move(coordinate, speed)
        self._do(self._instance.start)

    def twin(self) -> Session:
        """Another session of the same deck at t = 0, with its inputs as the deck has them: nothing is read anew. Raises
        ConvergenceError."""
        made = copy(self)
        made.diagnostics = []
        made._make()
        return made

    @property
    def time(self) -> float:
        """Where it stands [s]."""
        return self._instance.time

    def __getitem__(self, name: str) -> float:
        """The value of an input or output where it stands. Raises KeyError; ConvergenceError where a run could not start."""
        return self._do(self._instance.get, self._place(name))

    def __setitem__(self, name: str, value: float) -> None:
        """Sets an input for the step to come, where it jumps; it stays so. Raises KeyError, ValueError."""
        self.set(name, value)

    def reference(self, name: str) -> int:
        """The value reference of an input or output, for `at`, or for `lead` of the engine. Raises KeyError."""
        return self._place(name)

    def at(self, reference: int) -> float:
        """The value of what has this reference. Raises ConvergenceError."""
        return self._do(self._instance.get, reference)

    @property
    def instance(self) -> Instance:
        return self._instance

    def set(self, name: str, value: float, slope: float = 0.0) -> None:
        """An input from here on, and how fast it goes on during the next step [1/s]. Raises KeyError, ValueError."""
        place = self._place(name)
        try:
            self._instance.set(place, value, slope)
        except RuntimeError as error:
            raise ValueError(str(error)) from None

    def values(self) -> dict[str, float]:
        """All outputs where it stands."""
        return {name: self[name] for name in self.outputs}

    def step(self, h: float) -> None:
        """On for h [s]. Raises ConvergenceError, ValueError where h leads nowhere."""
        if not 0.0 < h < float("inf"):
            raise ValueError(f"a step goes forward, not by {h} s")
        self._told(self._do(self._instance.step, h))

    def run(self, until: float) -> None:
        """On to a time [s]; to where it stands already is no step. Raises as `step` does."""
        if until != self.time:
            self.step(until - self.time)

    def reset(self, **inputs: float) -> None:
        """At t = 0 again, with the inputs as the deck has them, or as these say. Raises as `set` and `step` do."""
        for name in inputs:
            self._place(name)  # what is no input leaves the run as it is
        self._instance.reset()
        for name, value in inputs.items():
            self.set(name, value)
        self._do(self._instance.start)

    def place(self, name: str, value: float | None = None) -> None:
        """Where a coordinate, `angle(hinge)` or `pos(rail)`, is at the start [rad or m]; None: where the deck has it. Closed
        loops
        follow. It counts from the next `reset` on. Raises KeyError; ValueError where a loop cannot close so."""
        found = self._coordinates.get(name.lower())
        if found is None:
            near = suggest(name, self._coordinates)
            raise KeyError(f"no coordinate {name!r}" + (f"; did you mean {near!r}?" if near else ""))
        if value is not None and not abs(value) < float("inf"):
            raise ValueError(f"{name} is placed at {value}: a coordinate is a finite number")
        try:
            self._instance.place(found[0], value)
        except RuntimeError as error:
            raise ValueError(str(error)) from None

    def save(self) -> State:
        """What it can be put back to, any number of times. Raises ValueError for decks that read what was a time ago."""
        try:
            return self._instance.save()
        except RuntimeError as error:
            raise ValueError(str(error)) from None

    def restore(self, state: State) -> None:
        """Where it was when it was saved, values and states to the last bit. The method starts there anew. Raises ValueError for
        the state of another session."""
        try:
            self._instance.restore(state)
        except RuntimeError as error:
            raise ValueError(str(error)) from None

    def _do(self, what: Any, *arguments: float) -> Any:
        try:
            return what(*arguments)
        except RuntimeError as error:
            code, text = _coded(str(error), "E412")
            raise ConvergenceError(Diagnostic("error", code, text)) from None

    def _told(self, texts: Sequence[str]) -> None:
        for text in texts:
            code, said = _coded(text, "W402")
            self.diagnostics.append(Diagnostic("warning", code, said))

    def _place(self, name: str) -> int:
        found = self._places.get(name.lower())
        if found is None:
            near = suggest(name, self._places)
            raise KeyError(f"no input or output {name!r}" + (f"; did you mean {near!r}?" if near else ""))
        return found

    def __repr__(self) -> str:
        return f"<Session at {self.time:g} s: {', '.join(self.inputs)} -> {', '.join(self.outputs)}>"


def _coded(text: str, default: str) -> tuple[str, str]:
    found = CODED.match(text)
    return (found[1], found[2]) if found else (default, text)

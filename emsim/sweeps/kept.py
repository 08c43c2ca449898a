"""Runs whose equations differ in numbers alone: assembled once, then made again by the engine from other numbers.

One run is assembled with traced numbers (traced.py) in the place of what varies. Where these got to numbers of R, L, C, K, V,
I, E, F, G and H lines alone, and from there to constants of the equations and to waveforms, another run has the same equations
with other numbers: the same arithmetic gives these, to the last bit, and the same compiler the system (`System.again`). What was
decided on the way has to be decided so again; where it is not, where a run fails or has something to say, it is run by itself.
"""

from __future__ import annotations

from copy import copy
from math import copysign, isnan

from ..elements import Element
from ..traced import Trace, Traced, holds

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from ..analyses import Analysis
    from ..assemble import Assembly
    from ..draws import Draws
    from ..elaborate.flat import FlatDeck

LETTERS = "rlckviefgh"  # of elements whose numbers are numbers of the equations
ASIDE, PLACE = 1.001, 0.37  # in place of values, and of random ones in their distributions
# analyses that take nothing from the flat deck but what the elements say when they run
ANALYSES = ("op", "tran", "ac", "noise", "dc", "tf", "pz")
# of a flat deck, what is not looked through for traced numbers: texts, and what is told of them
TOLD = ("sink", "sources", "origin", "draws", "params", "option_spans", "named", "elements", "modules")


def learn(runner: Any, point: Any) -> Kept | None:
    """The equations of a run, for those that follow; None where these have to be assembled anew. They are made for values a
    little aside, so that what hangs on a value and is not traced would be seen: the run has to come out to the last bit."""
    from ..diagnostics import DiagnosticError

    if "temp" in runner.task.names:
        return None
    trace = Trace()
    values = {name: trace.root(v * ASIDE) for name, v in zip(runner.task.names, point.values, strict=True)}
    draws = runner.drawing(point)
    if draws is not None and point.places is not None:
        draws.places = tuple(trace.root(PLACE) for _ in point.places)
    try:
        kept = _assembled(runner, trace, values, draws)
        if kept is None:
            return None
        found, own = kept.run(point), runner.alone(point)
    except DiagnosticError:
        return None
    return kept if found is not None and _same(found, own) else None


def _assembled(runner: Any, trace: Trace, values: dict[str, Traced], draws: Draws | None) -> Kept | None:
    flat = runner.read(dict(values), draws)
    places = _places(flat, trace)
    # (an instance of an FMU is for one run at a time)
    if trace.lost or any(card.kind == "FMU" for card in flat.clocked):
        return None
    assembly, planned = runner.prepared(flat, dict(runner.task.options), trace)
    if trace.lost or any(a.word not in ANALYSES for a in planned):
        return None
    return Kept(runner, trace, assembly, planned, places)


def _places(flat: FlatDeck, trace: Trace) -> list[tuple[dict[Any, Any] | list[Any] | Any, Any, int]]:
    """Where traced numbers are in lines of elements: the object, its attribute, key or place, the number's. Elsewhere they are
    lost."""
    found: list[tuple[Any, Any, int]] = []

    def take(of: Any, key: Any, value: Any, allowed: bool) -> None:
        if value.__class__ is Traced:
            if allowed:
                found.append((of, key, value.number))
            else:
                trace.lose(str(key))

    for e in flat.elements:
        allowed = e.letter in LETTERS
        take(e, "value", e.value, allowed)
        inside: list[Any] = [e.params, *([] if e.wave is None else [e.wave.args, e.wave.params])]
        for part in inside:
            for key, value in part.items() if isinstance(part, dict) else enumerate(part):
                take(part, key, value, allowed)
                if isinstance(value, (list, tuple)) and holds(value):
                    trace.lose(str(key))
        for key, value in e.extra.items():
            take(e.extra, key, value, allowed and key == "dc")
            if value.__class__ is not Traced and _within(value):
                trace.lose(str(key))
        if _within(e.model) or (e.value.__class__ is not Traced and _within(e.value)):
            trace.lose(e.name)
    for name in vars(flat):
        if name not in TOLD and _within(getattr(flat, name)):
            trace.lose(name)
    return found


def _within(value: Any) -> bool:
    """Is a traced number anywhere in it?"""
    if value.__class__ is Traced:
        return True
    if value is None or isinstance(value, (str, float, int, bytes)):
        return False
    if isinstance(value, dict):
        return any(_within(v) for v in value.values())
    if isinstance(value, (list, tuple, set)):
        return any(map(_within, value))
    module = type(value).__module__
    if (
        not module.startswith("emsim.")
        or module in ("emsim.source", "emsim.diagnostics")
        or isinstance(value, Element)
    ):
        return False
    slots = [name for kind in type(value).__mro__ for name in getattr(kind, "__slots__", ())]
    names = [*slots, *getattr(value, "__dict__", ())]
    return any(_within(getattr(value, name, None)) for name in names if name not in ("span", "at", "file"))


class Kept:
    """An assembled deck, and what of it hangs on what varies; `runner`, points and outcomes are those of runs.py."""

    def __init__(
        self,
        runner: Any,
        trace: Trace,
        assembly: Assembly,
        planned: list[Analysis],
        places: list[tuple[Any, Any, int]],
    ) -> None:
        self.runner, self.trace, self.assembly, self.planned, self.places = (
            runner,
            trace,
            assembly,
            planned,
            places,
        )
        sink = assembly.flat.sink
        self.said, self.remarked = list(sink.diagnostics), set(assembly.ctx._remarked)
        self.builder: Any = assembly.ctx.b
        draws = assembly.flat.draws
        self.drawn = [v.number if v.__class__ is Traced else v for v in draws.drawn]
        self.params = {k: v.number for k, v in assembly.flat.params.items() if v.__class__ is Traced}

    def run(self, point: Any) -> Any:
        """None where it is to be run by itself."""
        from ..diagnostics import DiagnosticError

        values = self.trace.again([*point.values, *(point.places or ())])
        if values is None:
            return None
        assembly, flat = self.assembly, self.assembly.flat
        for of, key, number in self.places:
            if isinstance(of, (dict, list)):
                of[key] = values[number]
            else:
                setattr(of, key, values[number])
        flat.params.update({name: values[k] for name, k in self.params.items()})
        flat.draws.drawn = [values[v] if v.__class__ is int else v for v in self.drawn]
        self._forget()
        made = copy(assembly)
        try:
            made.system = self._system(values)
            result = self.runner.solved(made, self.planned)
            signals = self.runner.signals(result)
        except (DiagnosticError, ValueError):
            return None
        known = len(self.said)
        if any(d.severity != "note" for d in flat.sink.diagnostics[known:]):
            return None
        return self.runner.outcome(point, result, signals, list(flat.draws.drawn))

    def _system(self, values: list[Any]) -> Any:
        b = self.builder

        waves = [
            (k, kind, [_now(a, values) for a in args], _now(dc, values)) for k, kind, args, dc in b.waves
        ]
        numbers = [[(place, values[k]) for place, k in of] for of in b.numbers]
        return self.assembly.system.again(numbers, waves)

    def _forget(self) -> None:
        """What the run before had to say."""
        sink = self.assembly.flat.sink
        sink.diagnostics[:] = self.said
        sink.error_count = 0
        sink._seen = {(d.code, d.message, d.span) for d in self.said}
        self.assembly.ctx._remarked = set(self.remarked)


def _now(value: Any, values: list[Any]) -> Any:
    return values[value.number] if value.__class__ is Traced else value


def _same(a: Any, b: Any) -> bool:
    """To the last bit, nan or not."""

    def equal(x: Any, y: Any) -> bool:
        if isinstance(x, dict):
            return list(x) == list(y) and all(equal(x[k], y[k]) for k in x)
        if isinstance(x, (list, tuple)):
            return len(x) == len(y) and all(map(equal, x, y))
        if isinstance(x, float) and isinstance(y, float):
            return (isnan(x) and isnan(y)) or (x == y and copysign(1.0, x) == copysign(1.0, y))
        return bool(x == y)

    return all(map(equal, a, b))

"""A context that remembers who contributed what to equation (1), for `emsim explain`; plain runs know nothing of it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from .._engine import Builder
from .compiling import Compiling

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from typing import Any

    from .._engine import Expr
    from ..elaborate.flat import FlatDeck


class Share:
    """One contribution: who, to which row, of F or (with `rate`) of Q: an expression, or a sum of (factor, unknown).
    `quotient`: a conductance, to be read as 1/R."""

    __slots__ = ("owner", "quotient", "rate", "row", "what")

    def __init__(
        self, owner: str, row: int, rate: bool, what: Expr | list[tuple[float, int]], quotient: bool = False
    ) -> None:
        self.owner, self.row, self.rate, self.what, self.quotient = owner, row, rate, what, quotient


class Placed(NamedTuple):
    """A device: its branches from unknown to unknown (-1 ground), inside of its series resistances, each with whether it
    stores charge; temperatures in C."""

    kind: str
    name: str
    branches: list[tuple[int, int, bool]]
    model: dict[str, float]
    instance: dict[str, float]
    temp: float
    tnom: float

    def number(self, branch: int) -> str:
        """What the current of a branch is called by behind `i`: nothing where there is one alone."""
        return str(branch + 1) if len(self.branches) > 1 else ""


class Recorder:
    """A Builder that writes down what it is given, under the name of the `owner` whose turn it is."""

    def __init__(self) -> None:
        self._builder = Builder()
        self.owner = ""
        self.shares: list[Share] = []
        self.waves: list[tuple[str, list[float], str]] = []  # kind, arguments, owner
        self.devices: list[Placed] = []

    def __getattr__(self, name: str) -> Any:
        return getattr(self._builder, name)

    def _share(
        self, row: int, rate: bool, what: Expr | list[tuple[float, int]], quotient: bool = False
    ) -> None:
        if row >= 0:
            self.shares.append(Share(self.owner, row, rate, what, quotient))

    def _between(self, p: int, n: int, rate: bool, v: float, quotient: bool) -> None:
        """v times the difference of two nodes, into one row and out of the other."""
        for row, other in ((p, n), (n, p)):
            self._share(row, rate, [(v, row), (-v, other)] if other >= 0 else [(v, row)], quotient)

    def g(self, row: int, col: int, v: float) -> None:
        self._builder.g(row, col, v)
        if col >= 0:
            self._share(row, False, [(v, col)])

    def c(self, row: int, col: int, v: float) -> None:
        self._builder.c(row, col, v)
        if col >= 0:
            self._share(row, True, [(v, col)])

    def conductance(self, p: int, n: int, v: float) -> None:
        self._builder.conductance(p, n, v)
        self._between(p, n, False, v, True)

    def capacitance(self, p: int, n: int, v: float) -> None:
        self._builder.capacitance(p, n, v)
        self._between(p, n, True, v, False)

    def f_wave(self, row: int, wave: int, coefficient: float) -> None:
        self._builder.f_wave(row, wave, coefficient)
        self._share(row, False, coefficient * self.wave_expr(wave))

    def add_f(self, row: int, e: Any) -> None:
        self._builder.add_f(row, e)
        self._share(row, False, self.const(0.0) + e)

    def add_q(self, row: int, e: Any) -> None:
        self._builder.add_q(row, e)
        self._share(row, True, self.const(0.0) + e)

    def wave(self, kind: str, args: list[float], dc: float | None = None) -> int:
        k = self._builder.wave(kind, args, dc)
        assert k == len(self.waves)
        self.waves.append((kind, list(args), self.owner))
        return k

    def delay(self, row: int, of: Any, by: float, initial: float) -> int:
        k = self._builder.delay(row, of, by, initial)
        self.waves.append(("delay", [by], f"{self.owner}_{k}"))
        return k

    def still(self) -> int:
        k = self._builder.still()
        self.waves.append(("still", [0.0], ""))
        return k

    def digital_node(self, name: str) -> tuple[int, int]:
        node, k = self._builder.digital_node(name)
        self.waves.append(("level", [], name.replace("#", "_")))
        return node, k

    def clocked_signal(self, name: str, clock: int, initial: float) -> tuple[int, int, int]:
        found = self._builder.clocked_signal(name, clock, initial)
        self.waves += [("signal", [], name.replace("#", "_"))] * (found[2] + 1 - len(self.waves))
        return found

    def clocked_timer(self, clock: int, on: int, off: int, dead: float) -> tuple[int, int]:
        found = self._builder.clocked_timer(clock, on, off, dead)
        self.waves += [("signal", [], f"{self.owner}_{k}") for k in found]
        return found

    def digital_ramp(self, node: Any, values: Any, times: Any) -> int:
        k = self._builder.digital_ramp(node, values, times)
        self.waves.append(("ramp", [*values, *times], f"{self.owner}_{k}"))
        return k

    def device(
        self,
        kind: str,
        name: str,
        nodes: Sequence[int],
        model: dict[str, float],
        instance: dict[str, float],
        temp: float,
        tnom: float,
    ) -> list[tuple[int, int, float]]:
        series = self._builder.device(kind, name, nodes, model, instance, temp, tnom)
        branches = self._builder.device_branches(name)
        self.devices.append(Placed(kind, name, branches, model, instance, temp, tnom))
        for terminal, inner, conductance in series:
            self._between(nodes[terminal], inner, False, conductance, True)
        return series

    def module(
        self, texts: Any, module: str, name: str, nodes: Sequence[int], model: Any, instance: Any, *rest: Any
    ) -> Any:
        said = self._builder.module(texts, module, name, nodes, model, instance, *rest)
        branches = self._builder.device_branches(name)
        self.devices.append(Placed(module, name, branches, model.given, instance, rest[0], rest[1]))
        return said


class Recording(Compiling):
    """The context of a deck that is to be explained."""

    def __init__(self, b: Builder, flat: FlatDeck, options: dict[str, Any]) -> None:
        self.recorder = Recorder()
        super().__init__(self.recorder, flat, options)  # type: ignore[arg-type]

    def in_turn(self, contributors: Iterable[Any]) -> Iterator[Any]:
        for contributor in contributors:
            self.recorder.owner = contributor.name
            yield contributor
        self.recorder.owner = ""

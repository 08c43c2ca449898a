"""Scopes: what parameter, function, model and subcircuit names mean at a place of the deck.

Parameters are looked up through the chain of calls, as ngspice does: a subcircuit sees the parameters of the
circuit that uses it. Models and subcircuits are looked up where the text stands.
"""

from __future__ import annotations

from ..deck import Func, Model, Param, Subckt
from ..diagnostics import Sink
from ..draws import Draws
from ..expr import OUTSIDE, SIGNAL, ExprError, Name, Node, Num, Scope, evaluate, fold, names
from ..traced import number

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable
    from typing import Any

    from ..expr import Call


MAX_CHAIN = 150  # parameters that each wait for the next: more are too many calls


class DeckScope(Scope):
    """One level: the top, or one use of a subcircuit.

    `caller` is the scope of the X line, `home` the scope in whose text the subcircuit is defined.
    """

    def __init__(
        self,
        sink: Sink,
        caller: DeckScope | None = None,
        home: DeckScope | None = None,
        draws: Draws | None = None,
    ) -> None:
        super().__init__()
        self.sink = sink
        self._draws = caller.draws if caller is not None else draws or Draws()
        self.caller = caller
        self.home = home
        self.exprs: dict[str, Param] = {}
        self.funcs: dict[str, Func] = {}
        self.models: dict[str, Model] = {}
        self.subckts: dict[str, tuple[Subckt, DeckScope]] = {}
        self.blocks: set[str] = set()  # that have signals
        self.evaluated_models: dict[str, Model] = {}
        self._open: list[str] = []
        self._failed: dict[str, ExprError] = {}  # so that a wrong parameter is reported once
        self.prober: Any = None
        self.prefix = ""
        self.temper: float | None = None  # of the top level: the circuit's temperature, once it is known
        self.read_temper = False  # ... and whether a parameter asked for it
        self.opened: frozenset[str] = (
            frozenset()
        )  # parameters of the top level whose values come from outside

    def reads(self, function: str) -> bool:
        from ..cards.joints import WORDS

        return function in WORDS

    def unknown(self, node: Name) -> Node | None:
        """`pi.u`, where a block of this level is called `pi`."""
        block, dot, _ = node.id.rpartition(".")
        return Name(SIGNAL + self.prefix + node.id, node.at) if dot and block in self.blocks else None

    @property
    def draws(self) -> Draws:
        return self._draws

    # ---- parameters ----

    @property
    def top(self) -> DeckScope:
        return self if self.caller is None else self.caller.top

    def outside(self, node: Name) -> Node | None:
        name = node.id
        if not self.top.opened:
            return None
        if name.startswith(OUTSIDE):
            return node
        if name in self.opened:
            return Name(OUTSIDE + name, node.at)
        if name in self.values:
            return None
        param = self.exprs.get(name)
        if param is None:
            return self.caller.outside(node) if self.caller is not None else None
        value = param.value
        return fold(value, self) if isinstance(value, Node) and self._reads_outside(value) else None

    def _reads_outside(self, value: Node) -> bool:
        """Does an expression hang on what comes from outside, by way of other parameters too?"""
        return any(self.outside(Name(name)) is not None for name in names(value))

    def lookup(self, name: str) -> float | None:
        if name in self.opened or name.startswith(OUTSIDE):
            word = name.removeprefix(OUTSIDE)
            said = f"`{word}` comes from outside while the model runs: this value has to be known before"
            hint = f"take `{word}` out of .fmu and give it with -D; expressions, R, L and C may read it"
            raise ExprError("E385", said, None, hint)
        value = self.values.get(name)
        if value is not None:
            return value
        param = self.exprs.get(name)
        if param is None:
            if self.caller is not None:
                return self.caller.lookup(name)
            if name != "temper":
                return None
            self.read_temper = True
            return self.temper
        if name in self._failed:
            raise self._failed[name]
        if name in self._open:
            ring = " -> ".join([*self._open[self._open.index(name) :], name])
            raise ExprError("E121", f"the parameters {ring} need each other", param.span)
        if len(self._open) >= MAX_CHAIN:
            said = (
                f"`{self._open[0]}` needs `{name}` by way of {MAX_CHAIN} parameters that stand further down"
            )
            raise ExprError("E121", said, param.span, "write each parameter below those that it needs")
        self._open.append(name)
        try:
            value = param.value if isinstance(param.value, float) else evaluate(param.value, self)
        except ExprError as error:
            self._failed[name] = error
            raise
        finally:
            self._open.pop()
        self.values[name] = value
        return value

    def function(self, name: str) -> tuple[list[str], Node] | None:
        scope: DeckScope | None = self
        while scope is not None:
            if name in scope.funcs:
                func = scope.funcs[name]
                return func.args, func.body
            scope = scope.caller
        return None

    def names(self) -> Iterable[str]:
        return [*self.exprs, *self.values, *(self.caller.names() if self.caller else ())]

    def probe(self, call: Call) -> Node:
        return call if self.prober is None else self.prober(call)

    def check_all(self) -> None:
        """Evaluate every parameter, so that what is wrong in unused ones is said too."""
        for name in self.exprs:
            try:
                self.lookup(name)
            except ExprError as error:
                if error.code != "E385":
                    self.report(error)

    def report(self, error: ExprError) -> None:
        self.sink.error(error.code, error.message, error.span, error.hint, fixes=error.fixes)

    # ---- models and subcircuits, by place in the text ----

    def find_model(self, name: str) -> tuple[Model, DeckScope] | None:
        scope: DeckScope | None = self
        while scope is not None:
            if name in scope.models:
                return scope.models[name], scope
            scope = scope.home
        return None

    def find_subckt(self, name: str) -> tuple[Subckt, DeckScope] | None:
        scope: DeckScope | None = self
        while scope is not None:
            if name in scope.subckts:
                return scope.subckts[name]
            scope = scope.home
        return None

    def subckt_with_model(self, name: str) -> str | None:
        """A subcircuit in whose text a .model of that name stands."""
        for subckt in self.all_subckts():
            found = self.find_subckt(subckt)
            if found and any(isinstance(card, Model) and card.name == name for card in found[0].body):
                return subckt
        return None

    def all_models(self) -> list[str]:
        return [*self.models, *(self.home.all_models() if self.home else ())]

    def all_subckts(self) -> list[str]:
        return [*self.subckts, *(self.home.all_subckts() if self.home else ())]


def as_float(value: Any, scope: Scope) -> float:
    """A value that has to be known before the run. Raises ExprError."""
    if isinstance(value, Num):
        return value.value
    if isinstance(value, Node):
        return evaluate(value, scope)
    return number(value)

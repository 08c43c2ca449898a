"""Helpers of the machine's tests: a machine before it is compiled, values at any state, errors by code."""

from __future__ import annotations

from typing import Any

from emsim import pipeline
from emsim._engine import Builder, Expr
from emsim.assemble import circuit
from emsim.assemble.compiling import Compiling
from emsim.assemble.machine import Machine
from emsim.assemble.options import resolve
from emsim.diagnostics import DeckError, Diagnostic
from emsim.expr import Call, Name, Node, Num


def flat(cards: str) -> Any:
    """A flat deck of these cards."""
    return pipeline.read(f"test deck\n{cards}\n.tran 1m 1\n.end\n")


def machine(cards: str) -> Machine:
    """The machine, built and contributed, in a builder that is still open. Raises DeckError."""
    deck = flat(cards)
    ctx = Compiling(Builder(), deck, resolve(deck))
    circuit.allocate(ctx)
    m = Machine(ctx)
    m.build()
    deck.sink.raise_if_errors()
    circuit.contribute(ctx)
    m.contribute()
    deck.sink.raise_if_errors()
    return m


def problems(cards: str) -> list[Diagnostic]:
    """Everything that is said about a deck, errors or not."""
    try:
        return list(machine(cards).sink.diagnostics)
    except DeckError as trouble:
        return list(trouble.diagnostics)


def only_error(cards: str) -> Diagnostic:
    """The one error of a bad deck."""
    errors = [d for d in problems(cards) if d.severity == "error"]
    assert len(errors) == 1, [f"{d.code} {d.message}" for d in errors]
    return errors[0]


def state(m: Machine, values: dict[str, float] | None = None) -> list[float]:
    """The start, with unknowns set by name: angle(j), omega(j), a node, i(m1)."""
    rows: dict[str, int] = {}
    for c in (*m.own, *m.given):
        rows[c.q_name], rows[c.u_name] = c.row, c.speed_row
    rows.update(m.ctx.nodes)
    rows.update({f"i({name})": row for name, row in m.ctx.branches.items()})
    rows.update(m.derivatives)
    x = [0.0] * (1 + max(rows.values(), default=0) + 4 * len(m.rows))
    for c in m.own:
        x[c.row], x[c.speed_row] = c.start, c.start_speed
    for name, value in (values or {}).items():
        assert rows.get(name, -1) >= 0, f"no unknown {name} among {sorted(rows)}"
        x[rows[name]] = value
    return x


def value(m: Machine, e: Expr, values: dict[str, float] | None = None, t: float = 0.0) -> float:
    """An expression at a state."""
    return m.b.eval([m.public(e)], state(m, values), t)[0]


def reads(
    m: Machine, fn: str, *args: str | tuple, at: dict[str, float] | None = None, t: float = 0.0
) -> float:
    """fn(args) at a state; an argument is a name or (name, x, y)."""
    nodes: list[Node] = [
        Name(a) if isinstance(a, str) else Call(a[0], [Num(float(v)) for v in a[1:]]) for a in args
    ]
    found = m.ctx.compile(Call(fn, nodes), None)
    m.sink.raise_if_errors()
    return value(m, found, at, t)


def momentum(m: Machine, name: str, at: dict[str, float]) -> float:
    """Generalised momentum of a coordinate."""
    return value(m, m.momentum[id(_coordinate(m, name))][0], at)


def generalised_force(m: Machine, name: str, at: dict[str, float], t: float = 0.0) -> float:
    """Right-hand side of dp/dt = ... of a coordinate."""
    return value(m, m.momentum[id(_coordinate(m, name))][1], at, t)


def _coordinate(m: Machine, name: str) -> Any:
    return next(c for c in (*m.own, *m.given) if c.q_name == name)

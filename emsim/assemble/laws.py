"""Laws with modes: unknowns, flags and rows (cards/laws.py says what they are, engine/dae/src/modes.rs decides their modes).

    relay     sticks: w = 0            slides: f + s F = 0         s: sign of w; held by others: f + s Fs = 0, s a share
    corner    open:   f = 0, mu = 0    closed: dg/dt = 0, g = 0    (stabilised as closed loops are, see equations.py)
    one way   open:   f = 0            closed: w = 0              (and so a bond, let go or held: bonds.py)
    slip      a relay with F = mu f of a corner; where that is open nothing asks for another mode
    joined    several relays, sticks: w = 0    slides: f + F w/|w| = 0
One pattern: the flags choose. Power f w of every law, and mu g of every corner, act as those of closed loops do.
"""

from __future__ import annotations

from ..cards.kinematics import dot
from ..cards.touch import NOTHING
from . import alike, bonds

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from .._engine import Builder, Expr
    from ..cards.base import Card
    from ..cards.laws import Law
    from .mechanism import Mechanism


SLOW = 1e-12  # [m/s] of a direction at rest


def allocate(m: Mechanism, cards: Sequence[Card]) -> None:
    """Unknowns and flags of the cards' laws; the cards may read them from now on."""
    found = [(card, card.laws(m)) for card in cards]
    for card, laws in found:
        for k, law in enumerate(laws, 1):
            label = f"{card.name},{k}"
            law.row = m.b.unknown(f"lambda({label})", "lambda", law.unit, 0.0)
            law.effort = m.b.x(law.row)
            if law.gap is not None:
                law.second = m.b.unknown(f"mu({label})", "mu", "", 0.0)
    alike.share(m, [law for _, laws in found for law in laws])
    for card, laws in found:
        if laws and laws[0].form == "bond":
            bonds.allocate(m, card, laws)  # type: ignore[arg-type]
        else:
            _flags(m, card, laws)


def _flags(m: Mechanism, card: Card, laws: Sequence[Law]) -> None:
    b = m.b
    for k, law in enumerate(laws):
        assert law.flow is not None
        flow, way = m.public(law.flow), None
        name = f"{card.spec.word} {card.name}"
        if law.normal is not None:
            corner, mu, mus = law.normal
            law.bound, law.stick, law.where = mu * corner.effort, mus * corner.effort, corner.flags[0]
        if law.form == "relay":
            bound, stick = m.public(law.bound), m.public(law.stick)
            for j, one in enumerate(law.across if law is law.across[0] else (), k):
                own = (f"{name} {j} share", f"{name} {j} mode")
                one.flags = [b.flag(one.effort, None, word, law="kept") for word in own]
            share, mode = law.flags[-2:]
            if len(law.across) == 1:
                effort, speed, along = b.call("abs", law.effort), b.call("abs", flow), share * flow
            else:
                effort, speed, along, way = _several(m, law)
            free = effort - stick
            # behind its threshold where it slides back; held by others where any motion is one
            moves = b.select(mode, along, -speed)
            if law.where is not None:
                moves = b.select(law.where, moves, 1.0)
            slides = b.flag(free, moves, f"{name} slides", law="mode")
            law.flags = [slides, share, mode]
            edge = None
        else:
            gap = flow if law.gap is None else m.public(law.gap)
            stays, edge = law.effort, None
            if law.edge is not None:  # past its end it would pull
                stays = b.select(b.call("notless", 0.0, m.public(law.edge.past)), stays, -1e30)
                edge = law.edge.held, m.public(law.edge.which)
            closed = b.flag(-gap, stays, f"{name} {k} closed", law="mode")
            words = ("hits", "impulse", "lost")
            law.flags = [
                closed,
                *(b.flag(law.effort, None, f"{name} {k} {word}", law="kept") for word in words),
            ]
            bound = stick = b.const(0.0)
        shown = b.const(0.0) if law.gap is None else m.public(law.gap)
        across = None if law is law.across[0] else law.across[0].row
        b.law(
            law.form,
            law.row,
            flow=flow,
            bound=bound,
            stick=stick,
            gap=shown,
            restitution=law.e,
            flags=law.flags,
            normal=_bounded_by(law),
            way=way,
            across=across,
            feature=edge,
        )
        m.laws.append((card, law))


def _several(m: Mechanism, law: Law) -> tuple[Expr, Expr, Expr, Expr]:
    """Of a law with several directions: |f|, |w|, what ends sliding below 0, and its part of the direction of sliding, w/|w|.

    Along the direction d of the last event w goes through 0 with it: w/|w| sign(w d) is smooth there, so that a step may lead
    beyond. Elsewhere it is asked again where w has turned by 60 degrees. At rest the direction is d."""
    b = m.b
    flows = [m.public(one.flow) for one in law.across if one.flow is not None]
    shares = [one.flags[-2] for one in law.across]
    own = law.across.index(law)
    speed = _size(b, *flows)
    along = dot(flows, shares) - 0.5 * speed
    w = [flow + SLOW * share for flow, share in zip(flows, shares, strict=True)]
    turned = b.const(0.0) + dot(w, shares)
    way = w[own] / _size(b, *w) * (turned / _size(b, turned))
    law.way = b.select(law.flags[-1], way, shares[own])
    return _size(b, *(one.effort for one in law.across)), speed, along, law.way


def _size(b: Builder, *parts: Expr) -> Expr:
    """Their length, with a slope at 0."""
    return b.call("sqrt", sum((part * part for part in parts), b.const(NOTHING)))


def _bounded_by(law: Law) -> tuple[int, float, float] | None:
    """The unknown by whose effort it is bounded, mu and mus."""
    return law.normal and (law.normal[0].row, *law.normal[1:])


def contribute(m: Mechanism) -> None:
    """Rows of all laws."""
    b = m.b
    for _, law in m.laws:
        assert law.flow is not None
        flow = m.public(law.flow)
        if law.form == "relay":
            slides, share, mode = law.flags
            way = share if len(law.across) == 1 else law.way
            most = b.select(mode, m.public(law.bound), m.public(law.stick))
            b.add_f(law.row, b.select(slides, law.effort + way * most, flow))
            continue
        b.add_f(law.row, b.select(law.flags[0], flow, law.effort))
        if law.gap is not None:
            b.add_f(law.second, b.select(law.flags[0], m.public(law.gap), b.x(law.second)))


def of(m: Mechanism, card: Card) -> list[Law]:
    return [law for owner, law in m.laws if owner is card]

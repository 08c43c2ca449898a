"""Laws of a LATCH: the flag that all of its rows share, and that they hold no more than can move. What they are: cards/latch.py;
when they change over: engine/dae/src/modes/bonds.rs."""

from __future__ import annotations

from ..cards.along import size
from .start import MOVED, RANK

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..cards.base import Card
    from ..cards.latch import Bond
    from .mechanism import Mechanism


def allocate(m: Mechanism, card: Card, laws: Sequence[Bond]) -> None:
    """Flags of all rows, whose efforts are unknowns already."""
    b, name = m.b, f"{card.spec.word} {card.name}"
    _check_free(m, card, laws)
    for k, law in enumerate(laws):
        words = ("hits", "impulse", "lost")
        law.flags = [b.flag(law.effort, None, f"{name} {k} {word}", law="kept") for word in words]
    first = laws[0]
    broken = b.flag(first.effort, None, f"{name} broken", law="kept")
    catches = b.const(1.0) * first.catch * (1.0 - first.release) * (1.0 - broken)
    shares = [m.abs(size(b, [row.effort for row in rows])) / most for rows, most in first.limits]
    loaded = shares[0] if len(shares) == 1 else m.maximum(*shares) if shares else 0.0
    stays = b.select(first.release, -0.5, 1.0 - loaded)
    held = b.flag(catches - 0.5, stays, f"{name} holds", law="mode")
    for law in laws:
        assert law.flow is not None
        law.flags = [held, *law.flags, broken]
        nothing, release = b.const(0.0), m.public(law.release)
        b.law(
            law.form, law.row, flow=m.public(law.flow), bound=nothing, stick=release, gap=b.const(float(law.held)),
            restitution=0.0, flags=law.flags,
        )  # fmt: skip
        m.laws.append((card, law))


def _check_free(m: Mechanism, card: Card, laws: Sequence[Bond]) -> None:
    """E240 where its rows hold one motion twice, or one that joints hold: nothing would say how they share the load."""
    held = [m.row_slopes(row) for row in m.rows]
    flows = [m.b.const(0.0) + law.flow for law in laws if law.flow is not None]
    own = [m.b.grad(flow, [c.u for c in m.motions]) for flow in flows]
    values, wide = m.at_start([slope for row in (*held, *own) for slope in row]), len(m.motions)
    rows = [values[k * wide : (k + 1) * wide] for k in range(len(held) + len(own))]
    free = len(m.b.rank(rows, RANK)[1]) - len(held)
    if free < len(own):
        said = f"LATCH {card.name} holds {len(own)} motions, of which {max(free, 0)} can be: joints hold the others"
        hint = "hold=point or hold=distance holds less; LATCH name joint one coordinate"
        m.sink.error("E240", said, card.span, hint)
        m.broken = True
    # an impact would change what is given, and take its energy without a word
    *starts, release = m.at_start([*flows, laws[0].release])
    fastest = max(starts, key=abs)
    if laws[0].held and release < 0.5 and abs(fastest) > MOVED * max(1.0, *map(abs, m.found.x)):
        said = f"LATCH {card.name} holds from the start what moves there, by {abs(fastest):.4g} m/s or rad/s"
        m.sink.error(
            "E244",
            said,
            card.span,
            "give its parts one speed (ic=), or catch= in place of held=yes: an impact",
        )
        m.broken = True


def breakable(m: Mechanism) -> str | None:
    """The first latch that a force or torque breaks."""
    return next((card.name for card, law in m.laws if law.form == "bond" and law.limits), None)  # type: ignore[attr-defined]

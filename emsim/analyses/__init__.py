"""Analyses: one dot card each, one file each (base.py says what such a file offers), and the one list of what there is."""

from __future__ import annotations

from ..registry import Registry
from .base import Analysis, Axis, Run

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from ..diagnostics import Diagnostic, Span
    from ..elaborate.flat import FlatDeck
    from .tran import Tran

__all__ = ["ANALYSES", "Analysis", "Axis", "Run", "find", "plan", "refused", "transients"]

# word of the card -> file and class; the file is imported when a deck has the card
INDEX = {
    "op": "op Op",
    "dc": "dc Dc",
    "tran": "tran Tran",
    "ac": "ac Ac",
    "disto": "disto Disto",
    "noise": "noise Noise",
    "pss": "pss Pss",
    "pz": "pz Pz",
    "sens": "sens Sens",
    "sp": "sp Sp",
    "ss": "ss Ss",
    "modes": "modes Modes",
    "tf": "tf Tf",
}
ANALYSES: Mapping[str, type[Analysis]] = Registry(__name__, INDEX)


def find(word: str) -> type[Analysis] | None:
    """The analysis of that name."""
    return ANALYSES.get(word)


def plan(flat: FlatDeck, tmax: float | None = None) -> list[Analysis]:
    """Every analysis that can run, in deck order; `tmax` [s] stands above the one of a transient."""
    planned: list[Analysis] = []
    for card in flat.analyses:
        kind = find(card.kind)
        if kind is not None and (analysis := kind.read(card, flat.sink)) is not None:
            planned.append(analysis)
    over = next((a for a in planned if a.axis is not None), None) or next(iter(planned), None)
    words = [a.word for a in planned]
    steady = next((w for w in words if w in ("ss", "pss")), None)
    if steady is not None and "tran" not in words:
        for harmonics in flat.fours:
            harmonics.analysis = steady
    for measure in (*flat.measures, *flat.fours):
        # LTspice leaves out which analysis is meant
        if not measure.analysis and over is not None:
            measure.analysis = over.word
        elif measure.analysis not in words:
            said = f"`{measure.name}` is not measured: the deck has no .{measure.analysis or 'tran'}"
            flat.sink.note("N282", said, measure.span)
    for transient in transients(planned) if tmax is not None else ():
        if not (tmax or 0.0) > 0:
            said = f"the largest step is {tmax:g} s, it must be positive"
            flat.sink.error("E305", said, transient.card.span, hint=transient.form)
        transient.tmax = tmax
    return planned


def refused(flat: FlatDeck) -> list[Diagnostic]:
    """An error for each kind of analysis that the deck asks for and emsim does not have."""
    from ..diagnostics import Diagnostic

    missing: dict[str, Span] = {}
    for card in flat.analyses:
        if find(card.kind) is None:
            missing.setdefault(card.kind, card.span)
    hint = "there are " + ", ".join(f".{word}" for word in ANALYSES)
    return [
        Diagnostic("error", "E306", f".{word} is not supported yet", span, hint)
        for word, span in missing.items()
    ]


def transients(planned: Sequence[Analysis]) -> list[Tran]:
    """Those that run through time, .ss and .pss among them."""
    if not any(a.in_time for a in planned):
        return []
    from .tran import Tran

    return [a for a in planned if isinstance(a, Tran)]

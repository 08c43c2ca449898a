"""What is asked for, as cards of .meas: names of the deck's own, or signals at places of the axis."""

from __future__ import annotations

from ..diagnostics import Span, deck_error, did_you_mean
from .found import Gradient

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from typing import Any

    from ..deck import Measure
    from ..elaborate.flat import FlatDeck

RELTOL = 1e-6  # of runs whose derivatives are asked for, or that are fitted: errors are to be far below those of data


def gradient(
    flat: FlatDeck,
    of: Sequence[str] | str | None,
    by: Sequence[str] | str | None,
    at: Sequence[float] | float | None,
    options: Mapping[str, Any],
) -> Gradient:
    """`emsim.Deck.gradient` of a flat deck that says which analysis is run; with nothing in `by`, values alone."""
    import numpy as np

    from ..analyses import plan
    from ..analyses.slopes import chosen
    from ..assemble.options import resolve

    place = Span(flat.sources[0], 1, 1, 2)
    names = [by] if isinstance(by, str) else list(by) if by is not None else chosen(flat)
    names = ["".join(name.split()).lower() for name in names]
    if twice := next((name for k, name in enumerate(names) if name in names[:k]), None):
        deck_error("E345", f"`{twice}` is derived by twice", place)
    if flat.origin is None:
        said = "no gradient: the deck was altered, and cannot be read again with other values"
        deck_error("E364", said, place, "give the values as `defines`, or alter a .param")
    settings = resolve(flat, dict(options))
    if "reltol" not in options and "reltol" not in flat.options:
        settings["reltol"] = min(settings.get("reltol", RELTOL), RELTOL)
    planned = plan(flat, settings.pop("tmax", None))
    known = [a for a in planned if a.word in ("tran", "op", "dc", "ac")]
    asked = [of] if isinstance(of, str) else None if of is None else list(of)
    cards, word = _cards(flat, asked, at, [a.word for a in known], place)
    runs = [a for a in known if a.word == word]
    if len(runs) != 1:
        said = f"the deck has no .{word}" if not runs else f"the deck has .{word} {len(runs)} times"
        deck_error(
            "E364", f"no gradient: {said}", place, "say which analysis: gradient(.., analysis='tran 1u 1m')"
        )
    analysis: Any = runs[0]
    if word == "tran":
        from .transient import along

        values, matrix, remarks = along(flat, settings, analysis, cards, names)
        found = Gradient([c.name for c in cards], names, values, matrix, remarks)
    elif word == "ac" and at is not None:
        from .points import responses

        assert asked is not None
        places = np.atleast_1d(np.asarray(at, float))
        values, matrix = responses(flat, settings, analysis, asked, places, names)
        titles = [_title(signal, place) for signal in asked for place in places.tolist()]
        found = Gradient(titles, names, values, matrix)
    else:
        from .points import measured

        values, matrix = measured(flat, settings, analysis, cards, names)
        found = Gradient([c.name for c in cards], names, values, matrix)
    return found


def _title(signal: str, place: float) -> str:
    return f"{''.join(signal.split()).lower()}@{place:.12g}"


def _cards(
    flat: FlatDeck, asked: list[str] | None, at: Any, words: list[str], place: Span
) -> tuple[list[Measure], str]:
    """The cards, all of one analysis, and which one."""
    from ..build import parse_measure

    if at is not None or (asked and words == ["op"] and not _named(flat, asked)):
        if not asked:
            deck_error("E364", "no gradient: `at` says where, not of which signals", place)
        if len(set(words)) != 1:
            said = f"no gradient: `at` lies on the axis of one analysis, the deck has {', '.join(words) or 'none'}"
            deck_error("E364", said, place, "say which analysis: gradient(.., analysis='tran 1u 1m')")
        word = words[0]
        if word == "ac":
            return [], word
        places = [None] if at is None else [float(p) for p in ([at] if isinstance(at, (int, float)) else at)]
        cards = []
        for signal in asked:
            for where in places:
                card = parse_measure(
                    f"{word} one find {signal}" + ("" if where is None else f" at={where!r}")
                )
                card.name = "".join(signal.split()).lower() if where is None else _title(signal, where)
                cards.append(card)
        return cards, word
    own = {card.name: card for card in flat.measures}
    wanted = list(own) if asked is None else ["".join(name.split()).lower() for name in asked]
    for name in wanted:
        if name not in own:
            hint = did_you_mean(name, list(own), "there are " + (", ".join(own) or "none"))
            deck_error("E438", f"the deck has no .meas `{name}`", place, f"{hint}; of a signal say at=")
    if not wanted:
        deck_error(
            "E437", "the deck has no .meas: there is nothing to derive", place, ".meas tran vmax MAX v(out)"
        )
    found = _with_read(flat, wanted)
    for card in found:
        card.analysis = card.analysis or (words[0] if len(set(words)) == 1 else "tran")
    kinds = {card.analysis for card in found}
    if len(kinds) > 1:
        said = f"no gradient: measures of {' and '.join(sorted(kinds))} are not of one analysis"
        deck_error("E364", said, place, "ask for those of one at a time")
    word = kinds.pop()
    if word not in ("tran", "op", "dc", "ac"):
        deck_error(
            "E364", f"no gradient: of .{word} none is computed", place, "of tran, op, dc and ac there is one"
        )
    return found, word


def _named(flat: FlatDeck, asked: list[str]) -> bool:
    own = {card.name for card in flat.measures}
    return any("".join(name.split()).lower() in own for name in asked)


def _with_read(flat: FlatDeck, wanted: list[str]) -> list[Measure]:
    """The cards, in the order asked for, and behind them those that they read."""
    from ..measures import read_by

    own = {card.name: card for card in flat.measures}
    found = list(wanted)
    for name in found:
        found += sorted(other for other in read_by(own[name]) if other in own and other not in found)
    return [own[name] for name in found]

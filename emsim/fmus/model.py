"""A deck whose values come from outside in part: read, assembled, as bytes for an engine without Python (engine/src/packed)."""

from __future__ import annotations

from typing import NamedTuple

from ..analyses.afterwards import condition
from ..analyses.failure import CODES
from ..analyses.gaps import overlapping
from ..analyses.tran import Tran
from ..diagnostics import Sink, deck_error
from ..elaborate.flat import FlatDeck
from ..expr import OUTSIDE
from ..pipeline import flatten
from . import ports

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence
    from typing import Any, TypeVar

    from .._engine import Expr
    from ..assemble import Assembly
    from ..deck import Deck, Probe

    Kind = TypeVar("Kind", bound=Tran)


class Packed(NamedTuple):
    """A model as bytes; inputs that keep hidden constraints from being differentiated, each with an output that shows it;
    the deck as
    an explicit ODE, by its states (what stores it, of which kind, unit, nominal value), event indicators, are slopes known;
    or why
    it is none."""

    data: bytes
    impeding: list[tuple[str, str | None]]
    exchange: tuple[list[tuple[str, str, str, float]], int, bool] | None
    refused: str | None


def read(
    deck: Deck, options: Mapping[str, Any] | None, more: Mapping[str, list[Probe]]
) -> tuple[FlatDeck, dict[str, float]]:
    """The flat deck with the lists of its .fmu card and `more`, and those of its parameters that come from outside, with what
    they are where nothing is said. Raises DeckError."""
    said = list(deck.sink.diagnostics)

    def flat() -> FlatDeck:
        found = flatten(deck, options)
        for key, probes in more.items():
            found.fmu[key] = [*found.fmu.get(key, []), *probes]
        return found

    first = flat()
    params = ports.opened(first)
    if not params:
        return first, params
    # once more, with these left open
    deck.outside, deck.sink = frozenset(params), Sink()
    for diagnostic in said:
        deck.sink.add(diagnostic)
    return flat(), params


def prepare(
    flat: FlatDeck,
    options: dict[str, Any],
    params: Mapping[str, float],
    kind: type[Kind],
    more: Iterable[str] = (),
    energy: bool = False,
) -> tuple[Assembly, Kind, list[ports.Port]]:
    """The deck with its values from outside, compiled, its transient as that kind, and what comes from
    outside; `more` of it by name, which is 0 where nothing is said; with accounts of `energy`. Raises DeckError."""
    from ..assemble import assemble
    from ..assemble.options import resolve
    from ..source import NoCollection

    settings = resolve(flat, {key.lower(): value for key, value in options.items()})
    tmax = settings.pop("tmax", None)
    transient = next((a for a in flat.analyses if a.kind == "tran"), None)
    tran = kind.read(transient, flat.sink) if transient is not None else None
    flat.sink.raise_if_errors()
    if tran is None:
        said = (
            "the deck has no .tran: an FMU has its steps, its start and the end of its experiment from there"
        )
        deck_error("E383", said, None, "add .tran tstep tstop")
    if settings["method"] == "multirate":
        said, hint = (
            "method=multirate goes its own way from start to end: an FMU is led",
            "leave method= out: emsim chooses",
        )
        deck_error("E383", said, flat.option_spans.get("method"), hint)
    if flat.steps:
        said = f"the deck steps `{flat.steps[0].column}`: an FMU is one model"
        deck_error("E383", said, flat.steps[0].span, "take .step out, and give the value with -D")
    if (unit := next((c for c in flat.clocked if c.kind == "FMU"), None)) is not None:
        said = f"FMU {unit.name} is part of the deck: an FMU with another one inside is not written"
        deck_error("E383", said, unit.span, "export the rest of the deck, and let the master connect the two")
    tran.tmax = tran.tmax if tmax is None else tmax
    flat.measures, flat.fours = [], []
    taken = ports.take(flat, params)
    assert flat.inputs is not None
    flat.inputs.update({OUTSIDE + name: 0.0 for name in more})
    with NoCollection():
        return assemble(flat, settings, (tran.tstep, tran.tstop), analyses=[tran], energy=energy), tran, taken


def pack(
    assembly: Assembly,
    tran: Tran,
    inputs: Sequence[tuple[str, float, str]],
    outputs: Sequence[tuple[Expr, str]],
    token: str,
    exchange: bool = False,
) -> Packed:
    """The model as bytes. Inputs by name, value where nothing is said, and when they vary; `token`: by which the engine knows its
    description; `exchange`: as an explicit ODE too."""
    ctx = assembly.ctx
    wave = {name.removeprefix(OUTSIDE): k for name, k in ctx.inputs.items()}
    names = assembly.system.flag_names
    conditions = [condition(assembly, k)[0] for k in range(len(names))]
    said = {name: f"[W402] {text}" for name, (_, text, _) in ctx.domains.items()}
    if assembly.machine is not None:
        said |= {name: f"[W401] {text}" for name, text in assembly.machine.flag_warnings.items()}
        said |= {name: f"[E415] {text}" for name in names if (text := overlapping(name))}
    warnings = {k: said[name] for k, name in enumerate(names) if name in said}
    opened, book = assembly.flat.inputs, assembly.accounts
    made = assembly.system.pack(
        token=token,
        inputs=[(wave[name], name, start, varies) for name, start, varies in inputs],
        outputs=outputs,
        guards=[*opened.guards.values()] if opened is not None else [],
        options_=assembly.options,
        times=(tran.tstep, tran.tstop, tran.longest(assembly), tran.tstart),
        uic=tran.uic,
        codes={**CODES, "chattering": "W405"},
        conditions=conditions,
        warnings=warnings,
        accounts=None if book is None else book.expressions(),
        exchange=exchange,
    )
    return Packed(*made)

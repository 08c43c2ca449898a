"""Options: what .options, .temp and the command line say, with ngspice's defaults, checked and named once.

`resolve` gives one dict that the engine, the circuit and the analyses share.
"""

from __future__ import annotations

from .._engine import methods
from ..diagnostics import suggest
from ..units import ABSOLUTE_ZERO

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from ..deck import FlatDeck
    from ..diagnostics import Sink, Span

METHODS = (
    "auto",
    "trap",
    "gear",
    "radau",
    "radau5",
    "radau9",
    "radau13",
    "trbdf2",
    "esdirk",
    "gauss",
    "rk45",
    "dop853",
)
SPECIAL = ("multirate",)  # for some decks only: a chart runs it where it is asked for
SPELLINGS = {
    "auto": "auto", "trapezoidal": "trap", "trap": "trap", "gear": "gear", "bdf": "gear", "radau": "radau",
    "radau5": "radau5", "radau9": "radau9", "radau13": "radau13",
    "trbdf2": "trbdf2", "esdirk": "esdirk", "gauss": "gauss", "gauss4": "gauss4", "gauss6": "gauss6",
    "rk45": "rk45", "dopri5": "rk45", "dop853": "dop853",
    "multirate": "multirate",
}  # fmt: skip

FORMULATIONS = ("joint", "absolute")  # coordinates of joints along a tree, or of every body

GMIN = 1e-12  # least conductance of a junction [S]
# name -> least value allowed. Only what is given is passed on: the engine's defaults are ngspice 39's
# (cktntask.c), with the absolute tolerances following a reltol tighter than 1e-3 unless they are given too.
NUMBERS: dict[str, float] = {
    "reltol": 1e-14,  # relative tolerance of every quantity, 1e-3
    # absolute tolerances, by kind of quantity; what is not given is the engine's (engine/src/tolerances.rs)
    "vntol": 0.0,  # voltages [V], 1e-6
    "abstol": 0.0,  # currents [A], 1e-12
    "chgtol": 0.0,  # charges [C], 0: errors of capacitors are measured in volt
    "flxtol": 0.0,  # flux linkages [Wb], 0: those of inductors in ampere
    "lentol": 0.0,  # lengths [m], 1e-8 of the largest that the deck states
    "angtol": 0.0,  # angles [rad], 1e-8
    "veltol": 0.0,  # velocities [m/s], 1e-8 sqrt(g L)
    "spintol": 0.0,  # angular velocities [rad/s], 1e-6
    "forcetol": 0.0,  # multipliers that are forces [N], 1e-8 of the largest weight
    "torquetol": 0.0,  # multipliers that are torques [N m], the same at the largest length
    "trtol": 0.0,  # how far the truncation error may exceed its estimate
    "gmin": 0.0,
    "itl1": 1.0,  # Newton iterations of the operating point
    "itl2": 1.0,  # ... of each of its stepping stages
    "itl4": 1.0,  # ... of a time point
    "maxord": 1.0,  # highest order of gear, 5
    "fixed_step": 1e-30,  # every step this long [s], no error control; gear then runs at exactly maxord, 2
    "projection": 0.0,  # 0: explicit methods let closed loops drift
    "maxsteps": 1.0,  # a run that would need more is refused with an estimate, 1e8
    "rshunt": 0.0,  # from every node to ground [ohm]
    "gshunt": 0.0,  # the same as a conductance [S]
    "cshunt": 0.0,  # from every node to ground [F]
}
TEMPERATURES = ("temp", "tnom")  # [C]
# read by the front end, or about ngspice's own printing and matrix code: nothing to say about them
SILENT_WORDS = """
    dialect temp tnom acct noacct noinit nomod nopage list node opts numdgt post brief fast
    savecurrents interp plotwinsize cptime limpts lvlcod lvltim itl3 itl5 itl6 pivtol pivrel badmos3
    bypass delmin keepopinfo klu sparse noopiter noopac gminsteps srcsteps gminfactor minbreak
    autostop seedinfo warn maxwarns scale defl defw defad defas xmu xtrtol nostepsizelimit
    ramptime convstep convabsstep altinit width probe ingold measdgt captab filetype ngdebug wnflag
    oldlimit trytocompact reltolfactor runlvl delmax accurate parhier co
"""
SILENT = frozenset(SILENT_WORDS.split())


def resolve(flat: FlatDeck, above: dict[str, Any] | None = None) -> dict[str, Any]:
    """Options of a deck under those given from outside (`above`: command line, Python), which win.

    Without a method, the engine chooses (engine/src/integrate/auto.rs); `trap` and `gear` mean what they mean in ngspice.
    """
    sink = flat.sink
    above = {key.lower(): value for key, value in (above or {}).items()}
    given = {**flat.options, **above}
    out: dict[str, Any] = {
        "gmin": GMIN,
        "method": "auto",
        "formulation": "auto",
    }
    strange: list[str] = []
    for name, value in given.items():
        span = None if name in above else flat.option_spans.get(name)
        if name == "method":
            out["method"] = _method(str(value), sink, span) or out["method"]
        elif name == "formulation":
            out[name] = _formulation(str(value), sink, span)
        elif name in NUMBERS or (name == "tmax" and name in above):  # a deck says that one on .tran
            number = _number(name, value, sink, span)
            if number is not None:
                out[name] = number
        elif name == "seed":
            _seed(value, sink, span)
        elif name in TEMPERATURES:
            number = _number(name, value, sink, span)
            if number is not None and name in above:  # the deck's own are read where .temp is
                setattr(flat, name, number)
        elif name not in SILENT:
            strange.append(name)
    if strange:
        known = [*NUMBERS, "method", "formulation", "dialect", "seed", "temp", "tnom"]
        near = {s: suggest(s, known) for s in strange}
        hints = ", ".join(f"`{n}` for `{s}`" for s, n in near.items() if n)
        hint = f"did you mean {hints}?" if hints else None
        if "tmax" in strange:
            hint = "the largest step is the fourth number of .tran: .tran tstep tstop tstart tmax"
        sink.note("N281", f"options without effect here: {', '.join(sorted(strange))}", hint=hint)
    return out


def _number(name: str, value: object, sink: Sink, span: Span | None) -> float | int | None:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        hint = f"a parameter stands in braces: {name}={{{value}}}" if isinstance(value, str) else None
        sink.error("E293", f"option {name} needs a number", span, hint)
        return None
    least = NUMBERS.get(name, 0.0 if name == "tmax" else ABSOLUTE_ZERO)
    if not least <= value < float("inf") or (name == "reltol" and value >= 1.0):
        hint = f"at least {least:g}" + (", below 1" if name == "reltol" else "")
        sink.error("E293", f"option {name}={value:g} is out of range", span, hint=hint)
        return None
    if name == "maxord":
        return min(int(value), 6)
    return int(value) if name in ("itl1", "itl2", "itl4") else float(value)


def _seed(value: object, sink: Sink, span: Span | None) -> None:
    """It has been read where the deck's parameters were (elaborate/flatten.py)."""
    if isinstance(value, bool) or not isinstance(value, (int, float)) or value != abs(value) // 1:
        sink.error("E293", "option seed needs a whole number, 0 or more", span)


def _method(word: str, sink: Sink, span: Span | None) -> str | None:
    name = SPELLINGS.get(word.lower())
    if name is None and word.lower() in methods():
        return word.lower()
    if name is None:
        near = suggest(word, SPELLINGS)
        sink.error(
            "E294", f"there is no method `{word}`", span,
            hint=f"did you mean `{near}`?" if near else f"there are {', '.join(METHODS + SPECIAL)}",
        )  # fmt: skip
    return name


def _formulation(word: str, sink: Sink, span: Span | None) -> str:
    known = ("auto", *FORMULATIONS)
    if word.lower() not in known:
        near = suggest(word.lower(), known)
        sink.error(
            "E294", f"there is no formulation `{word}`", span,
            hint=f"did you mean `{near}`?" if near else f"there are {', '.join(known)}",
        )  # fmt: skip
        return known[0]
    return word.lower()

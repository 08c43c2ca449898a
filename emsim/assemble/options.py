"""Options: what .options, .temp and the command line say, with ngspice's defaults: one table, OPTIONS.

`resolve` gives one dict that the engine, the circuit and the analyses share.
"""

from __future__ import annotations

from .._engine import methods
from ..diagnostics import did_you_mean, suggest
from ..units import ABSOLUTE_ZERO

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from ..diagnostics import Sink, Span
    from ..elaborate.flat import FlatDeck

# the integrators are told by the engine: of each its names, the first its own, and what help says
REGISTRY = methods()
SPECIAL = ("multirate", "gauss4", "gauss6")  # a chart runs these only where it is asked for them
METHODS = tuple(names[0] for names, *_ in REGISTRY if names[0] not in SPECIAL)
SPELLINGS = {name: names[0] for names, *_ in REGISTRY for name in names}

FORMULATIONS = ("joint", "absolute")  # coordinates of joints along a tree, or of every body

GMIN = 1e-12  # least conductance of a junction [S]


class Option:
    """An option of .options, of the command line and of emsim.run: one line of the table below, which help, hover, completion and
    the reference tell.

    unit, default, what   as they are told; default "-" where there is none
    least    the least value allowed of a number; None for what is not one, or is checked where it is read
    whole    a count: what is behind its point is dropped
    reader   the file that acts on it
    """

    __slots__ = ("default", "least", "name", "reader", "unit", "what", "whole")

    def __init__(
        self,
        name: str,
        unit: str,
        default: str,
        what: str,
        least: float | None,
        reader: str,
        whole: bool = False,
    ) -> None:
        self.name, self.unit, self.default, self.what = name, unit, default, what
        self.least, self.reader, self.whole = least, reader, whole


_TOLERANCES, _RUN, _CIRCUIT = "engine/dae/src/tolerances.rs", "engine/src/py/system.rs", "assemble/circuit.py"
# Only what is given is passed on: the engine's defaults are ngspice 39's (cktntask.c), with the absolute tolerances following a
# reltol tighter than 1e-3 unless they are given too.
OPTIONS = {option.name: option for option in (
    Option("method", "", "auto", "integration method", None, "engine/integrate/src/lib.rs"),
    Option("formulation", "", "auto", "coordinates of the machine: of joints, or of bodies (absolute), as long chains have them",
           None, "assemble/__init__.py"),
    Option("dialect", "", "-", "how the deck is read where they differ: ngspice, ltspice, pspice; see `emsim help dialects`",
           None, "build.py"),
    Option("reltol", "", "1e-3", "relative tolerance of every quantity", 1e-14, _RUN),
    Option("vntol", "V", "1e-6", "absolute tolerance of voltages", 0.0, _TOLERANCES),
    Option("abstol", "A", "1e-12", "absolute tolerance of currents", 0.0, _TOLERANCES),
    Option("chgtol", "C", "0", "absolute tolerance of charges; 0: errors of capacitors are measured in volt", 0.0, _TOLERANCES),
    Option("flxtol", "Wb", "0", "absolute tolerance of flux linkages; 0: errors of inductors are measured in ampere", 0.0,
           _TOLERANCES),
    Option("lentol", "m", "1e-8 L", "absolute tolerance of lengths; L is the largest length that the deck states", 0.0,
           _TOLERANCES),
    Option("angtol", "rad", "1e-8", "absolute tolerance of angles", 0.0, _TOLERANCES),
    Option("veltol", "m/s", "1e-8 sqrt(g L)", "absolute tolerance of velocities; g = 9.81 m/s^2", 0.0, _TOLERANCES),
    Option("spintol", "rad/s", "1e-6", "absolute tolerance of angular velocities", 0.0, _TOLERANCES),
    Option("forcetol", "N", "1e-8 M g", "absolute tolerance of forces that hold joints; M is the largest mass", 0.0, _TOLERANCES),
    Option("torquetol", "N m", "1e-8 M g L", "absolute tolerance of torques that hold joints", 0.0, _TOLERANCES),
    Option("trtol", "", "1; 0.1 for gear of free order", "how far the truncation error of trap and gear may exceed its estimate",
           0.0, _RUN),
    Option("gmin", "S", "1e-12", "least conductance of a junction", 0.0, _RUN),
    Option("seed", "", "1", "of random values: the same seed draws the same", None, "elaborate/flatten.py"),
    Option("itl1", "", "100", "Newton iterations of the operating point", 1.0, _RUN, whole=True),
    Option("itl2", "", "-", "accepted as ngspice has it; the stages of the operating point have their own limits", 1.0, "",
           whole=True),
    Option("itl4", "", "30", "Newton iterations of a time point of trap and gear, 10 at least", 1.0, _RUN, whole=True),
    Option("maxord", "", "5", "highest order of gear; 2 is SPICE's method", 1.0, _RUN),
    Option("maxsteps", "", "1e8", "a run that would need more steps is refused with an estimate", 1.0, _RUN),
    Option("fixed_step", "s", "-", "every step this long, no error control; gear then has order 2, or maxord", 1e-30, _RUN),
    Option("temp", "C", "27", "temperature", None, "elaborate/flatten.py"),
    Option("tnom", "C", "27", "temperature at which models were measured", None, "elaborate/flatten.py"),
    Option("rshunt", "ohm", "-", "resistance from every node to ground", 0.0, _CIRCUIT),
    Option("gshunt", "S", "0", "conductance from every node to ground", 0.0, _CIRCUIT),
    Option("cshunt", "F", "0", "capacitance from every node to ground", 0.0, _CIRCUIT),
    Option("pictures", "", "0", "1: plot in a .control section draws, as hardcopy does", 0.0, "control/pictures.py"),
    Option("projection", "", "1", "0: explicit methods let closed loops drift", 0.0, _RUN),
)}  # fmt: skip
NUMBERS = {name: option.least for name, option in OPTIONS.items() if option.least is not None}
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

    Without a method, the engine chooses (engine/integrate/src/auto.rs); `trap` and `gear` mean what they mean in ngspice.
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
        near = {s: suggest(s, OPTIONS) for s in strange}
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
    return int(value) if name in OPTIONS and OPTIONS[name].whole else float(value)


def _seed(value: object, sink: Sink, span: Span | None) -> None:
    """It has been read where the deck's parameters were (elaborate/flatten.py)."""
    if isinstance(value, bool) or not isinstance(value, (int, float)) or value != abs(value) // 1:
        sink.error("E293", "option seed needs a whole number, 0 or more", span)


def _method(word: str, sink: Sink, span: Span | None) -> str | None:
    name = SPELLINGS.get(word.lower())
    if name is None:
        sink.error(
            "E294", f"there is no method `{word}`", span,
            hint=did_you_mean(word, SPELLINGS, f"there are {', '.join(METHODS + SPECIAL)}"),
        )  # fmt: skip
    return name


def _formulation(word: str, sink: Sink, span: Span | None) -> str:
    known = ("auto", *FORMULATIONS)
    if word.lower() not in known:
        sink.error(
            "E294", f"there is no formulation `{word}`", span,
            hint=did_you_mean(word.lower(), known, f"there are {', '.join(known)}"),
        )  # fmt: skip
        return known[0]
    return word.lower()

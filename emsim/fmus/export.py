"""From a deck to the FMU's file."""

from __future__ import annotations

import hashlib
import os
import re
import zipfile

from .._engine import __version__
from ..analyses.tran import Tran
from ..assemble.outputs import column
from ..diagnostics import Diagnostic, OutsideError, deck_error
from ..expr import OUTSIDE
from ..outputs.beside import replacing
from ..pipeline import load
from . import description, library, ports
from .description import Variable
from .model import Packed, pack, prepare, read

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from typing import Any

    from ..assemble import Assembly, Context, Output
    from ..deck import Probe
    from ..diagnostics import Span
    from ..source import Source

    Exchange = tuple[list[tuple[str, str, str, float]], int, bool]

MODEL = "model.emsim"  # engine/src/fmi/mod.rs reads it
VERSIONS = (2, 3)
KINDS = {"both": ("model", "cosim"), "cosim": ("cosim",), "model": ("model",)}
# of an unknown's kind what its row stores, how the unknown is read, and by its unit the units of what is stored and of its rate
STORED = {
    "node": ("charge", "v", {"V": ("A s", "A")}),
    "branch": ("flux linkage", "i", {"A": ("Wb", "V")}),
    "coordinate": ("position", "", {"m": ("m", "m/s"), "rad": ("rad", "rad/s")}),
    "speed": ("momentum", "", {"m/s": ("kg m/s", "N"), "rad/s": ("N m s", "N m")}),
}
WRITTEN = (1980, 1, 1, 0, 0, 0)  # the same deck gives the same file


class Exported:
    """An FMU that was written: its `path`, its `kinds` (cosim, model), the `variables` of its description, and what was said
    of the
    deck."""

    __slots__ = ("diagnostics", "kinds", "path", "variables", "version")

    def __init__(
        self,
        path: str,
        version: int,
        kinds: Sequence[str],
        variables: list[Variable],
        diagnostics: list[Diagnostic],
    ) -> None:
        self.path, self.version, self.variables, self.diagnostics = path, version, variables, diagnostics
        self.kinds = tuple(kinds)

    def of(self, causality: str) -> list[Variable]:
        return [v for v in self.variables if v.causality == causality]

    def __repr__(self) -> str:
        return f"<{self.path}: FMI {self.version}.0, {len(self.variables)} variables>"


class Model(Tran):
    """The deck's transient, of which an FMU shows what it gives."""

    def columns(self, ctx: Context) -> list[Output]:
        found = [column(ctx, probe.text, probe.ast, probe.span) for probe in ctx.flat.fmu["out"]]
        for output, probe in zip(found, ctx.flat.fmu["out"], strict=True):
            if output.expr is None:
                said = f"`{output.name}` follows from other columns when a run is over: an FMU cannot give it"
                ctx.sink.error("E382", said, probe.span, "give what it is made of")
        return found


def export(
    source: Source,
    path: str | None = None,
    version: int = 3,
    inputs: str | Sequence[str] = (),
    outputs: str | Sequence[str] = (),
    parameters: str | Sequence[str] = (),
    tunables: str | Sequence[str] = (),
    defines: Mapping[str, Any] | None = None,
    options: Mapping[str, Any] | None = None,
    libraries: Sequence[str] = (),
    kind: str = "both",
) -> Exported:
    """Writes a deck as an FMU for co-simulation and, where its equations are an explicit ODE, for model exchange.

    source      a path, the text itself, or a PySpice Circuit
    path        of the FMU; left out: the deck's name with .fmu, here
    version     of FMI: 3 or 2
    inputs      sources (V, I), values of machine cards (TORQUE load, or load(tau)) and parameters (.param) that are driven from
                outside, besides those of the deck's .fmu card; parameters: the same, held while the model runs;
                tunables: parameters that are set between two steps as well
    outputs     expressions as .print takes them, besides those of the card
    defines     parameters that stand above the deck's .param; options: .options, by name
    libraries   libraries for other platforms, in place of that of this one
    kind        cosim, model, or both: co-simulation alone, with a note (N383), where the deck cannot be exchanged
    Raises DeckError, OutsideError; ValueError for another version or kind.
    """
    if version not in VERSIONS:
        raise ValueError(f"there are FMI 2 and 3, not {version}")
    if kind not in KINDS:
        raise ValueError(f"there are the kinds {', '.join(KINDS)}, not {kind}")
    binaries = library.binaries(libraries, version)
    more = {
        "in": ports.given(inputs, False),
        "param": ports.given(parameters, False),
        "tune": ports.given(tunables, False),
        "out": ports.given(outputs, True),
    }
    assembly, model, variables = opened(source, more, defines, options)
    flat = assembly.flat
    where = flat.sources[0].path
    stem = os.path.splitext(os.path.basename(where))[0] if where else "model"
    path = f"{stem}.fmu" if path is None else path
    name = identifier(stem)
    kinds = KINDS[kind]
    exchange = exchanged(assembly, model, variables, kind) if "model" in kinds else None
    if exchange is None:
        kinds = KINDS["cosim"]
    else:
        variables += stored(exchange, len(variables))
    data, token = stamped(assembly, model, variables, exchange is not None)
    of_model = description.Model(
        (name, flat.title.strip() or stem, token),
        (model.tstop, model.tstep, float(assembly.options.get("reltol", 1e-3))),
        kinds,
        can_return=not assembly.ctx.delayed,
        slopes=exchange is not None and exchange[2],
    )
    files = {
        "modelDescription.xml": description.text(of_model, variables, version).encode(),
        f"resources/{MODEL}": data,
        **{f"binaries/{folder}/{name}{ending}": data for folder, ending, data in binaries},
        **library.licences(),
    }
    write(path, files)
    return Exported(path, version, kinds, variables, flat.sink.diagnostics)


def opened(
    source: Source,
    more: Mapping[str, list[Probe]],
    defines: Mapping[str, Any] | None,
    options: Mapping[str, Any] | None,
) -> tuple[Assembly, Model, list[Variable]]:
    """The deck with what its .fmu card and `more` name, compiled. Raises DeckError."""
    flat, params = read(load(source, defines), options, more)
    if not flat.fmu["out"]:
        hint = "name some: .fmu out=v(out),angle(arm), or --out"
        deck_error("E383", "nothing is asked of the FMU: it has no output", None, hint)
    flat.is_drawn = False
    assembly, model, taken = prepare(flat, dict(options or {}), params, Model)
    variables = listed(assembly, model, taken)
    check(assembly, variables)
    return assembly, model, variables


def listed(assembly: Assembly, tran: Tran, taken: list[ports.Port]) -> list[Variable]:
    """Of the FMU, in the order of their value references. Raises DeckError where a name stands twice."""
    found = [Variable("time", "independent", "s")]
    for port in taken:
        causality, variability = ports.WAYS[port.way]
        found.append(Variable(port.name, causality, port.unit, port.start, port.says, variability))
    for output in assembly.outputs[tran]:
        found.append(Variable(output.name, "output", output.unit))
    probes = [None, *(p.place for p in taken), *(p.span for p in assembly.flat.fmu["out"])]
    seen: set[str] = set()
    for variable, place in zip(found, probes, strict=True):
        if variable.name in seen:
            deck_error(
                "E384", f"the FMU has `{variable.name}` twice", place, "name each of its variables once"
            )
        seen.add(variable.name)
    return found


def exchanged(assembly: Assembly, tran: Model, of: list[Variable], kind: str) -> Exchange | None:
    """The deck as an explicit ODE; None, with a note, where it is none and may be for co-simulation alone. Raises DeckError
    (E383)."""
    found = _pack(assembly, tran, of, "", True)
    if found.exchange is not None:
        return found.exchange
    said = f"model exchange asks for an explicit ODE, and this deck is none: {found.refused}"
    if kind == "model":
        deck_error("E383", said, None, "--kind cosim has emsim's own integrator in it, which needs none")
    assembly.flat.sink.note("N383", f"the FMU is for co-simulation alone: {said}")
    return None


def stored(exchange: Exchange, first: int) -> list[Variable]:
    """The states, their rates and the event indicators, as variables from this value reference on."""
    states, indicators, _ = exchange
    found: list[Variable] = []
    rates: list[Variable] = []
    for k, (of, kind, unit, nominal) in enumerate(states):
        what, word, units = STORED[kind]
        name = f"{word}({of})" if word and "(" not in of else of
        own, changing = units.get(unit, ("", ""))
        state = Variable(f"stored({name})", "local", own, says=f"{what} in the equation of {name}")
        state.role, state.nominal = "state", nominal
        rate = Variable(f"der({state.name})", "local", changing)
        rate.role, rate.derivative = "rate", first + k
        found.append(state)
        rates.append(rate)
    found += rates
    for k in range(indicators):
        indicator = Variable(f"indicator({k + 1})", "local", "")
        indicator.role = "indicator"
        found.append(indicator)
    return found


def stamped(assembly: Assembly, tran: Model, of: list[Variable], exchange: bool) -> tuple[bytes, str]:
    """The model as bytes, and the token by which the library knows the description that belongs to it."""
    text = "\n".join(repr(v) for v in of)
    made = packed(assembly, tran, of, "", exchange)
    token = hashlib.sha256(made + text.encode() + __version__.encode()).hexdigest()[:32]
    return packed(assembly, tran, of, token, exchange), token


def packed(
    assembly: Assembly, tran: Model, of: list[Variable], token: str = "", exchange: bool = False
) -> bytes:
    """The model as bytes. Raises DeckError (E381) where an output follows from a slope that an input leaves open."""
    return _pack(assembly, tran, of, token, exchange).data


def _pack(assembly: Assembly, tran: Model, of: list[Variable], token: str, exchange: bool) -> Packed:
    inputs = [(v.name, float(v.start or 0.0), v.variability) for v in given(of)]
    outputs = [(o.expr, o.name) for o in assembly.outputs[tran] if o.expr is not None]
    made = pack(assembly, tran, inputs, outputs, token, exchange)
    for name, shown in made.impeding:
        follows = f"`{shown}` follows" if shown else "conditions of the deck follow"
        said = f"`{name}` cannot come from outside: {follows} from slopes that it leaves open"
        hint = "a loop of capacitors and voltages, or a cutset of coils and currents, holds it: put a resistance in there"
        deck_error("E381", said, _asked(assembly, name), hint)
    return made


def given(of: list[Variable]) -> list[Variable]:
    """What comes from outside."""
    return [v for v in of if v.causality in ("input", "parameter")]


def check(assembly: Assembly, of: list[Variable]) -> None:
    """Raises DeckError (E381) for what cannot come from outside."""
    known = {name.removeprefix(OUTSIDE) for name in assembly.ctx.inputs}
    unread = next((v.name for v in given(of) if v.name not in known), None)
    if unread is not None:
        deck_error(
            "E381",
            f"nothing of the deck reads `{unread}`",
            _asked(assembly, unread),
            "take it out of the list",
        )
    assert assembly.flat.inputs is not None
    lost = next((v.name for v in given(of) if OUTSIDE + v.name in assembly.flat.inputs.lost), None)
    if lost is not None:
        said = f"`{lost}` cannot come from outside: its card decides by it, or takes it as a plain number"
        deck_error("E381", said, _asked(assembly, lost), "take it out of the list, and give it in the deck")


def _asked(assembly: Assembly, word: str) -> Span:
    return next(p.span for key in ports.WAYS for p in assembly.flat.fmu.get(key, ()) if p.text == word)


def identifier(stem: str) -> str:
    """A name as C has them: that of the library."""
    name = re.sub(r"\W", "_", stem, flags=re.ASCII)
    return name if re.match(r"[A-Za-z_]", name) else f"_{name}"


def write(path: str, files: Mapping[str, bytes]) -> None:
    """The archive. Raises OutsideError (E503)."""
    try:
        with replacing(path) as beside, zipfile.ZipFile(beside, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, data in files.items():
                entry = zipfile.ZipInfo(name, WRITTEN)
                entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
                archive.writestr(entry, data)
    except OSError as error:
        raise OutsideError(Diagnostic("error", "E503", f"cannot write {path}: {error.strerror}")) from None

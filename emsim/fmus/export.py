"""From a deck to the FMU's file."""

from __future__ import annotations

import hashlib
import os
import re
import zipfile

from .._engine import __version__
from ..analyses.afterwards import condition
from ..analyses.failure import CODES
from ..analyses.tran import Tran
from ..assemble.outputs import column
from ..diagnostics import Diagnostic, OutsideError, Sink, deck_error
from ..expr import OUTSIDE
from ..outputs.beside import replacing
from ..pipeline import flatten, load
from . import description, library, ports
from .description import Variable

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from typing import Any

    from ..assemble import Assembly, Context, Output
    from ..deck import Deck, FlatDeck, Probe
    from ..source import Source

MODEL = "model.emsim"  # engine/src/fmi/mod.rs reads it
VERSIONS = (2, 3)
WRITTEN = (1980, 1, 1, 0, 0, 0)  # the same deck gives the same file


class Exported:
    """An FMU that was written: its `path`, the `variables` of its description, and what was said of the deck."""

    __slots__ = ("diagnostics", "path", "variables", "version")

    def __init__(
        self, path: str, version: int, variables: list[Variable], diagnostics: list[Diagnostic]
    ) -> None:
        self.path, self.version, self.variables, self.diagnostics = path, version, variables, diagnostics

    def of(self, causality: str) -> list[Variable]:
        return [v for v in self.variables if v.causality == causality]

    def __repr__(self) -> str:
        return f"<{self.path}: FMI {self.version}.0, {len(self.variables)} variables>"


class Model(Tran):
    """The deck's transient, of which an FMU shows what it gives."""

    asked: Sequence[Probe] = ()

    def columns(self, ctx: Context) -> list[Output]:
        found = [column(ctx, probe.text, probe.ast, probe.span) for probe in self.asked]
        for output, probe in zip(found, self.asked, strict=True):
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
) -> Exported:
    """Writes a deck as a co-simulation FMU.

    source      a path, the text itself, or a PySpice Circuit
    path        of the FMU; left out: the deck's name with .fmu, here
    version     of FMI: 3 or 2
    inputs      sources (V, I), values of machine cards (TORQUE load, or load(tau)) and parameters (.param) that are driven from
                outside, besides those of the deck's .fmu card; parameters: the same, held while the model runs;
                tunables: parameters that are set between two steps as well
    outputs     expressions as .print takes them, besides those of the card
    defines     parameters that stand above the deck's .param; options: .options, by name
    libraries   libraries for other platforms, in place of that of this one
    Raises DeckError, OutsideError; ValueError for another version.
    """
    if version not in VERSIONS:
        raise ValueError(f"there are FMI 2 and 3, not {version}")
    binaries = library.binaries(libraries, version)
    more = {
        "in": ports.given(inputs, False),
        "param": ports.given(parameters, False),
        "tune": ports.given(tunables, False),
        "out": ports.given(outputs, True),
    }
    flat, params = read(load(source, defines), options, more)
    assembly, model, variables = prepare(flat, dict(options or {}), params)
    where = flat.sources[0].path
    stem = os.path.splitext(os.path.basename(where))[0] if where else "model"
    path = f"{stem}.fmu" if path is None else path
    name = identifier(stem)
    packed, token = pack(assembly, model, variables)
    of_model = description.Model(
        name, flat.title.strip() or stem, token, model.tstop, model.tstep, float(assembly.options.get("reltol", 1e-3)),
        can_return=not assembly.ctx.delayed,
    )  # fmt: skip
    files = {
        "modelDescription.xml": description.text(of_model, variables, version).encode(),
        f"resources/{MODEL}": packed,
        **{f"binaries/{folder}/{name}{ending}": data for folder, ending, data in binaries},
        **library.licences(),
    }
    write(path, files)
    return Exported(path, version, variables, flat.sink.diagnostics)


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
    flat: FlatDeck, options: dict[str, Any], params: Mapping[str, float]
) -> tuple[Assembly, Model, list[Variable]]:
    """The deck with its values from outside, compiled, and the variables of the FMU. Raises DeckError."""
    from ..assemble import assemble
    from ..assemble.options import resolve
    from ..source import NoCollection

    settings = resolve(flat, {key.lower(): value for key, value in options.items()})
    tmax = settings.pop("tmax", None)
    transient = next((a for a in flat.analyses if a.kind == "tran"), None)
    tran = Model.read(transient, flat.sink) if transient is not None else None
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
    assert isinstance(tran, Model)
    tran.tmax = tran.tmax if tmax is None else tmax
    tran.asked = flat.fmu["out"]
    if not tran.asked:
        said, hint = (
            "nothing is asked of the FMU: it has no output",
            "name some: .fmu out=v(out),angle(arm), or --out",
        )
        deck_error("E383", said, None, hint)
    flat.measures, flat.fours, flat.is_drawn = [], [], False
    taken = ports.take(flat, params)
    times = (tran.tstep, tran.tstop)
    with NoCollection():
        assembly = assemble(flat, settings, times, analyses=[tran])
    return assembly, tran, variables(assembly, tran, taken)


def variables(assembly: Assembly, tran: Tran, taken: list[ports.Port]) -> list[Variable]:
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


def pack(assembly: Assembly, tran: Tran, of: list[Variable]) -> tuple[bytes, str]:
    """The model as bytes, and the token by which the library knows the description that belongs to it."""
    ctx, flat = assembly.ctx, assembly.flat
    wave = {name.removeprefix(OUTSIDE): k for name, k in ctx.inputs.items()}
    given = [v for v in of if v.causality in ("input", "parameter")]
    unread = next((v.name for v in given if v.name not in wave), None)
    if unread is not None:
        place = next(p.span for key in ports.WAYS for p in flat.fmu.get(key, ()) if p.text == unread)
        deck_error("E381", f"nothing of the deck reads `{unread}`", place, "take it out of the list")
    inputs = [(wave[v.name], v.name, float(v.start or 0.0), v.variability) for v in given]
    outputs = [(o.expr, o.name) for o in assembly.outputs[tran] if o.expr is not None]
    times = (tran.tstep, tran.tstop, tran.longest(assembly))

    names = assembly.system.flag_names
    conditions = [condition(assembly, k)[0] for k in range(len(names))]
    said = {name: f"[W402] {text}" for name, (_, text, _) in ctx.domains.items()}
    if assembly.machine is not None:
        said |= {name: f"[W401] {text}" for name, text in assembly.machine.flag_warnings.items()}
    warnings = {k: said[name] for k, name in enumerate(names) if name in said}

    codes = {**CODES, "chattering": "W405"}

    def packed(token: str) -> bytes:
        return assembly.system.pack(
            token, inputs, outputs, assembly.options, times, tran.uic, codes, conditions, warnings
        )

    text = "\n".join(repr(v) for v in of)
    token = hashlib.sha256(packed("") + text.encode() + __version__.encode()).hexdigest()[:32]
    return packed(token), token


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

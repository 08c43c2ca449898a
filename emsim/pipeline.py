"""From text to a Result, one named step after the other. This is the table of contents of emsim.

text -> deck -> flat deck -> equation (1) -> solution -> Result
"""

from __future__ import annotations

import os
from math import isfinite

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from typing import Any, ParamSpec, TypeVar

    P = ParamSpec("P")
    T = TypeVar("T")

    from .analyses import Analysis, Run
    from .assemble import Assembly
    from .deck import Deck, Probe
    from .diagnostics import Diagnostic, Fix
    from .elaborate.flat import FlatDeck
    from .elaborate.steps import Change
    from .measures import Measured
    from .measures.fourier import Spectrum
    from .outputs.raw import Stream
    from .reports.equations import Explained
    from .result import Result
    from .source import Source
    from .store import Scene
    from .system import System
    from .table import Table
    from .traced import Trace

    Options = Mapping[str, Any]
    Progress = Callable[[float, float, float, int, int], object]


def explained(entry: Callable[P, T]) -> Callable[P, T]:
    """An entry whose panics in the engine, and loops without end, are told as every other fault is: with a diagnostic."""

    def told(*args: P.args, **given: P.kwargs) -> T:
        try:
            return entry(*args, **given)
        except Exception as error:
            from ._engine import Endless, Panic
            from .diagnostics import REPORT, ConvergenceError, Diagnostic, InternalError

            if isinstance(error, Endless):
                raise ConvergenceError(Diagnostic("error", "E410", str(error))) from error
            if not isinstance(error, Panic):
                raise
            raise InternalError(
                Diagnostic("error", "E499", f"internal error: {error}", None, REPORT)
            ) from error

    # (functools would be loaded for this alone)
    for name in ("__module__", "__name__", "__qualname__", "__doc__", "__annotations__"):
        setattr(told, name, getattr(entry, name))
    told.__wrapped__ = entry  # type: ignore[attr-defined]
    return told


DRAWN_RUNS = 24  # of a deck with .step: so many have their drawings, evenly chosen


@explained
def run(
    source: Source,
    defines: Mapping[str, Any] | None = None,
    method: str | None = None,
    reltol: float | None = None,
    tmax: float | None = None,
    progress: Progress | None = None,
    options: Options | None = None,
    scene: bool | None = None,
    energy: bool | None = None,
    also: str | Sequence[str | Probe] = (),
    stream: Stream | None = None,
    say: Callable[[str], object] | None = None,
    analyses: str | Sequence[str] | None = None,
) -> Result:
    """Simulates a deck: a path, the text itself, or a PySpice Circuit. One with a .control section does what that says.

    defines    parameters that stand above the deck's .param
    method     "trap", "gear", "radau", "trbdf2", "esdirk", "gauss", "rk45", "dop853"; otherwise .options method,
               else "auto", which chooses
    reltol     relative tolerance; tmax: largest time step [s]
    options    any of these three, and further .options, by name; dialect="ltspice", "pspice" or "ngspice": how the deck
               is read where they differ
    scene      record what moves the drawing of the machine, for pages and films; left out: in a notebook
    energy     keep energy accounts (`Result.energy`); left out: where the deck has a machine
    also       further columns: expressions as .print takes them, such as "fx(pin) x(arm(0.3,0))", one text or several
    analyses   dot cards that stand in place of the deck's own analyses, one or several: [".tran 1u 1m", "ac dec 10 1 1meg"]
    stream     a raw file that the rows go to while the run goes on (outputs/raw.py); `raw.write` completes it
    say        gets what a .control section prints, as it comes; left out: `Result.output` has it
    progress   called now and then with (t, tstop, step [s], steps, events); a true return value stops the run, whose
               result then has the status "interrupted"; what it raises is raised here
    Raises DeckError, ConvergenceError (with the partial Result), OutsideError; after Ctrl-C Interrupted, a
    KeyboardInterrupt with the partial Result.
    """
    options = _merged(options, method, reltol, tmax)
    # text to typed deck, typed deck to flat deck
    deck = load(source, defines, also, analyses, options)
    flat = flatten(deck, options)
    energy = flat.machine != [] if energy is None else energy
    heard = None if progress is None else Heard(progress)
    scene = in_notebook() if scene is None else scene
    if analyses is not None:
        flat.commands = []
    # flat deck to a result
    result = carry_out(deck, flat, options, energy, heard, scene, say, stream)
    if result.status == "interrupted" and not (heard and heard.stopped):
        if heard and heard.error:
            raise heard.error
        from .diagnostics import Interrupted

        raise Interrupted(result)
    return result


def carry_out(
    deck: Deck,
    flat: FlatDeck,
    options: Options,
    energy: bool,
    progress: Progress | None = None,
    scene: bool = False,
    say: Callable[[str], object] | None = None,
    stream: Stream | None = None,
) -> Result:
    """A deck run: by its commands, whose analyses heed .step; with .step each of its variants; or as it is."""
    if flat.commands:
        return command(deck, flat, options, energy, progress, scene, say)
    if flat.steps:
        return _stepped(deck, flat, options, energy, progress, scene)
    return _once(flat, options, energy, progress, scene, stream)


def _once(
    flat: FlatDeck, options: Options, energy: bool, progress: Progress | None, scene: bool, stream: Stream | None = None
) -> Result:  # fmt: skip
    """A flat deck run."""
    flat.is_drawn = scene
    # flat deck to equations
    assembly, planned = prepare(flat, options, energy)
    # equations to solutions
    runs = solve(assembly, planned, progress, scene, stream)
    # solutions to a result
    return deliver(assembly, runs)


def _stepped(
    deck: Deck, flat: FlatDeck, options: Options, energy: bool, progress: Progress | None, scene: bool
) -> Result:
    """A deck run once for each value of its steps; the first run that fails is the last."""
    from .diagnostics import ConvergenceError
    from .elaborate.steps import points
    from .stepped import join, stopped

    results: list[Result] = []
    failed, done = None, []
    variants = list(points(flat.steps))
    seen = {round(k * (len(variants) - 1) / (DRAWN_RUNS - 1)) for k in range(DRAWN_RUNS)}
    for k, changes in enumerate(variants):
        own = {**options, **{step.name: value for step, value in changes if step.kind == "temp"}}
        done.append([value for _, value in changes])
        try:
            results.append(
                _once(
                    flatten(deck, options, changes),
                    own,
                    energy,
                    progress,
                    scene and (len(variants) <= DRAWN_RUNS or k in seen),
                )
            )
        except ConvergenceError as error:
            if error.partial is None:
                raise
            results.append(error.partial)
            failed = error
        if failed or results[-1].status != "ok":
            break
    result = join(results, flat.steps, done)
    if failed:
        raise ConvergenceError(stopped(failed.diagnostics, flat.steps, done), result)
    return result


class Heard:
    """A progress callback, and how it ended the run: by what it returned, or by what it raised. Ctrl-C is neither."""

    __slots__ = ("call", "error", "stopped")

    def __init__(self, call: Progress) -> None:
        self.call, self.stopped = call, False
        self.error: BaseException | None = None

    def __call__(self, t: float, stop: float, step: float, steps: int, events: int) -> bool:
        try:
            self.stopped = bool(self.call(t, stop, step, steps, events))
            return self.stopped
        except KeyboardInterrupt:
            return True
        except BaseException as error:
            self.error = error
            return True


def in_notebook() -> bool:
    """Whether a notebook's kernel runs this: results are then shown with the moving machine."""
    import sys

    return "ipykernel" in sys.modules


@explained
def check(
    source: Source, defines: Mapping[str, Any] | None = None, options: Options | None = None
) -> dict[str, Any]:
    """The facts of a deck, without running it: unknowns by kind, degrees of freedom, loops, what folded away,
    tolerances, events, diagnostics. Raises DeckError."""
    flat = read(source, defines, options=options)
    if flat.commands:
        from .control import check as check_commands

        check_commands(flat.commands, flat.sink)
    assembly, planned = prepare(flat, options)
    from .analyses.facts import facts

    return facts(assembly, planned)


def explain(
    source: Source, defines: Mapping[str, Any] | None = None, options: Options | None = None
) -> Explained:
    """The deck's equations to be read by people, term by term with the cards that they come from; `reports.explained` writes
    them. Raises DeckError."""
    return explain_flat(read(source, defines, options=options), options)


def explain_flat(flat: FlatDeck, options: Options | None = None) -> Explained:
    """`explain` of a deck that is flat already."""
    assembly, planned = prepare(flat, options, energy=True, recording=True)
    from .reports.equations import explain as explained

    return explained(assembly, planned)


@explained
def compile(
    source: Source, defines: Mapping[str, Any] | None = None, options: Options | None = None
) -> System:
    """The deck's equations d/dt Q(x, t) + F(x, t) = 0 for anybody's integrator. Raises DeckError."""
    from .system import System

    assembly, planned = prepare(read(source, defines, options=options), options)
    if assembly.ctx.delayed or assembly.ctx.responses:
        from .diagnostics import deck_error

        said = "delays and gains over frequency are in it: its equations are not of the form d/dt Q(x) + F(x, t) = 0"
        raise deck_error("E413", said, None, "take lines and transfer functions out, or run the deck")
    return System(assembly, planned)


# ---- the steps ---------------------------------------------------------------------------------


def read(
    source: Source,
    defines: Mapping[str, Any] | None = None,
    also: str | Sequence[str | Probe] = (),
    options: Options | None = None,
) -> FlatDeck:
    """Text or file -> typed deck -> flat deck: one level, parameters evaluated, models looked up. Of the options it is
    `temp` and `seed` that parameters can read."""
    return flatten(load(source, defines, also, options=options), options)


def load(
    source: Source,
    defines: Mapping[str, Any] | None = None,
    also: str | Sequence[str | Probe] = (),
    analyses: str | Sequence[str] | None = None,
    options: Options | None = None,
) -> Deck:
    """Text or file -> typed deck. Of the options it is `dialect` that says how text is read."""
    from .build import parse_analysis, parse_signals
    from .build import read as build
    from .source import NoCollection

    source = path_or_text(source)
    with NoCollection():
        also = (also,) if isinstance(also, str) else also
        probes = [p for given in also for p in (parse_signals(given) if isinstance(given, str) else (given,))]
        deck = build(source, dict(defines or {}), probes, _option(options, "dialect"))
        if analyses is not None:
            asked = (analyses,) if isinstance(analyses, str) else analyses
            deck.asked = [parse_analysis(text) for text in asked]
        return deck


def path_or_text(source: Source) -> str | bytes:
    """A deck as whoever keeps it can: its path, or its text. TypeError for what is none."""
    if isinstance(source, (str, bytes)):
        return source
    if isinstance(source, os.PathLike):
        return os.fspath(source)
    from .interop.pyspice import netlist

    return netlist(source)


def flatten(deck: Deck, options: Options | None = None, changes: Sequence[Change] = ()) -> FlatDeck:
    """Typed deck -> flat deck, with the `changes` of a step. Of the options it is `temp` and `seed` that parameters can read."""
    from .draws import seeded
    from .elaborate import flatten as flat

    return flat(deck, _option(options, "temp"), seeded(_option(options, "seed")), changes)


def _option(options: Options | None, name: str) -> Any:
    return next((value for key, value in (options or {}).items() if key.lower() == name), None)


def prepare(
    flat: FlatDeck,
    options: Options | None = None,
    energy: bool = False,
    recording: bool = False,
    trace: Trace | None = None,
) -> tuple[Assembly, list[Analysis]]:
    """Flat deck -> compiled system, and the analyses with their settings. `recording` notes who contributed what,
    `trace` of which numbers that it follows the equations are made (assemble/numbered.py)."""
    from .analyses import plan, refused
    from .assemble import Compiling, assemble
    from .assemble.options import resolve
    from .source import NoCollection

    options = {key.lower(): value for key, value in (options or {}).items()}
    settings = resolve(flat, options)
    planned = plan(flat, settings.pop("tmax", None))
    if flat.measures:
        from .measures import check

        check(flat.measures, flat.sink)
    times = next((found[:2] for a in planned if (found := a.times()) is not None), (1.0, 1.0))
    context: Any = Compiling
    if recording:
        from .assemble.recording import Recording as context
    if trace is not None:
        from .assemble.numbered import context as of_trace

        context = of_trace(trace)
    with NoCollection():
        assembly = assemble(flat, settings, times, energy, context, planned)
    for step in flat.steps:
        value = flat.params.get(step.name) if step.kind == "param" else None
        said = f"`{step.column}` is not stepped here" + ("" if value is None else f": it is {value:g}")
        flat.sink.note("N332", said, step.span, "`emsim run` takes one value after the other")
    if count := len(flat.draws.drawn):
        values = "value was" if count == 1 else "values were"
        flat.sink.note(
            "N285", f"{count} random {values} drawn, with seed {flat.draws.seed}",
            hint="--seed N or .options seed=N draws others; ngspice draws anew in every run",
        )  # fmt: skip
    if not planned and not refused(flat):
        said = "the deck asks for no analysis that can run"
        flat.sink.note("N283", said, hint="add .tran tstep tstop, or .op", fixes=_one_more_line(flat))
    return assembly, planned


def _one_more_line(flat: FlatDeck) -> list[Fix]:
    """An analysis for a deck without one: its time course where something moves, else its operating point."""
    from .diagnostics import Fix, Span

    file = flat.sources[0]
    lines = file.text.split("\n")
    last = next((k for k, line in enumerate(lines, 1) if line.strip().lower() == ".end"), len(lines))
    moves = flat.machine or any(getattr(e, "wave", None) is not None for e in flat.elements)
    card = ".tran 1m 1" if moves else ".op"
    behind = (
        "\n"
        if last == len(lines) and lines[last - 1].strip() and lines[last - 1].strip().lower() != ".end"
        else ""
    )
    col = len(lines[last - 1]) + 1 if behind else 1
    return [Fix(Span(file, last, col, col), f"{behind}{card}\n", f"add `{card}`")]


def solve(
    assembly: Assembly,
    planned: Sequence[Analysis],
    progress: Progress | None = None,
    scene: bool = False,
    stream: Stream | None = None,
) -> list[Run]:
    """Every analysis in deck order; the first one that fails is the last."""
    from .analyses.base import derived

    runs: list[Run] = []
    for analysis in planned:
        own = _timed(assembly, analysis)
        if scene:
            assembly.drawing(), own.drawing()
        if stream is not None and analysis.streams and not derived(own, analysis):
            analysis.into = _streamed(own, analysis, runs, stream)
        if analysis.size(own) > 1 << 20:  # a megabyte is there
            from .analyses.points import check_memory

            check_memory(own, analysis)
        own.system.begin(analysis.asks_as)
        run = analysis.run(own, progress)
        runs += (run, *run.beside)
        if run.waves.status != "ok":
            break
        for made in (run, *run.beside):
            if gaps := made.gaps():
                from .analyses.failure import not_finite

                made.trouble.append(not_finite(gaps, analysis))
    return runs


def command(
    deck: Deck,
    flat: FlatDeck,
    options: Options | None = None,
    energy: bool = False,
    progress: Progress | None = None,
    scene: bool = False,
    say: Callable[[str], object] | None = None,
) -> Result:
    """A deck with a .control section: what that says, as under ngspice -b. The analyses of the deck's dot cards run where it says
    `run`, or behind it where it never does. Plots are the tables of the result, the current one the last."""
    from .control import COMMANDS, Section
    from .diagnostics import ConvergenceError, DeckError
    from .elaborate.altered import Altered
    from .result import Result

    said: list[str] = []
    first = list(flat.sink.diagnostics)

    def analyse(flat: FlatDeck, cards: list[Any]) -> Result:
        flat.analyses, flat.is_drawn = cards, scene
        assembly, planned = prepare(flat, options, energy)
        return deliver(assembly, solve(assembly, planned, progress, scene))

    altered = Altered(deck, flat, _option(options, "temp"), _option(options, "seed"))
    session = Section(
        COMMANDS, altered, analyse, say or said.append, [f.path for f in flat.sources if f.path]
    )
    session.draws = bool(_option(options, "pictures") or flat.options.get("pictures"))
    session.run(flat.commands)
    result = Result(
        flat.title, session.tables(), [*first, *(d for d in session.sink.diagnostics if d not in first), *session.trouble],
        session.prints, deck.file.text, session.measured, "".join(said), session.files, session.code, session.steps,
    )  # fmt: skip
    if session.trouble:
        raise ConvergenceError(session.trouble, result)
    if session.sink.has_errors and not result.plots:
        raise DeckError(result.diagnostics)
    return result


def _streamed(
    assembly: Assembly, analysis: Analysis, runs: list[Run], stream: Stream
) -> tuple[str, bool, Any]:
    """Where the rows of the next analysis go, behind the tables of the runs so far."""
    from .analyses.base import recorded
    from .outputs.raw import Head

    names, units, _ = recorded(assembly, analysis)
    assert analysis.axis is not None
    head = Head(
        assembly.flat.title, analysis.plotname, [analysis.axis.name, *names], [analysis.axis.unit, *units]
    )
    return stream.follow([_named(assembly, r) for r in runs], head)


def _timed(assembly: Assembly, analysis: Analysis) -> Assembly:
    """The same deck with what waveforms leave out by the times of this analysis: a deck may have several transients."""
    from .assemble import assemble

    times = analysis.times()
    if times is None or times == assembly.ctx.times:
        return assembly
    energy = assembly.accounts is not None
    return assemble(assembly.flat, assembly.options, times, energy, analyses=assembly.analyses)


def deliver(assembly: Assembly, runs: list[Run]) -> Result:
    """Tables, warnings from the run, and the verdict: ConvergenceError carries what was computed. Analyses that emsim does not
    have are errors among the diagnostics; DeckError where there are no others."""
    from .analyses import refused
    from .analyses.afterwards import remarks
    from .result import Result

    flat = assembly.flat
    for run in runs:
        remarks(assembly, run)
    tables = [_table(assembly, r) for r in runs]
    prints = [*assembly.prints, *_own_prints(assembly, tables)]
    measures, spectra, lacking = [], [], []
    for run, table in zip(runs, tables, strict=True):
        found, own, trouble_of = _measured(assembly, run, table)
        measures += found
        spectra += own
        lacking += trouble_of
    deck = flat.sources[0].text if flat.sources else ""
    trouble, missing = [d for r in runs for d in r.trouble], refused(flat)
    diagnostics = [*flat.sink.diagnostics, *missing, *trouble, *lacking]
    result = Result(flat.title, tables, diagnostics, prints, deck, measures, spectra=spectra)
    if missing and not runs:
        from .diagnostics import DeckError

        raise DeckError(result.diagnostics)
    if trouble:
        from .diagnostics import ConvergenceError

        raise ConvergenceError(trouble, result)
    return result


def _measured(
    assembly: Assembly, r: Run, table: Table
) -> tuple[list[Measured], list[Spectrum], list[Diagnostic]]:
    """What the .meas and .four cards of an analysis find in its table, and what is to be said of that."""
    cards = [card for card in assembly.flat.measures if card.analysis == table.kind]
    fours = [card for card in assembly.flat.fours if card.analysis == table.kind]
    if not (cards or fours):
        return [], [], []
    from .measures import harmonics, measure

    outputs, degree = r.inside
    fine = None
    if outputs and r.axis is not None:
        from .store import Columns
        from .table import Table

        names, units = [r.axis.name, *(o.name for o in outputs)], [r.axis.unit, *(o.unit for o in outputs)]
        complex = [False, *(r.analysis.complex for _ in outputs)]
        data = Columns((r.waves.inside(k) for k in range(len(names))), complex=complex)
        fine = (Table(r.kind, names, units, data, axis=r.axis, steps=r.steps), degree) if data.rows else None
    found = measure(cards, table, fine=fine)
    spectra, trouble = harmonics(fours, table, fine)
    return found, spectra, [*(d for m in found for d in (m.trouble, m.remark) if d is not None), *trouble]


def _own_prints(assembly: Assembly, tables: list[Table]) -> list[tuple[str, list[str]]]:
    """(table, columns) that are to be shown of analyses whose columns are their own: known when these have run."""
    found: list[tuple[str, list[str]]] = []
    for analysis in {a.word: a for a in assembly.analyses if a.names_itself}.values():
        cards = [card for card in assembly.flat.prints if card.kind == analysis.word]
        kinds = analysis.tables or (analysis.word,)
        own = [t for t in tables if t.kind in kinds]
        for card in cards:
            names = [text for text, _ in card.items]
            found += [(kind, names) for kind in kinds]
            for text, ast in card.items:
                if text != "all" and own and not any(text in table for table in own):
                    said = f".{analysis.word} has no column `{text}`: it is left out"
                    some = ", ".join(name for table in own for name in table.signals[-4:])
                    assembly.flat.sink.warning("W287", said, ast.span or card.span, f"there are {some}")
        if not cards:
            found += [(kind, ["all"]) for kind in analysis.shown]
    return found


def _table(assembly: Assembly, r: Run) -> Table:
    from .analyses.base import Part
    from .store import Scene

    drawing = assembly.drawn if "machine" in r.analysis.draws and r.channels.columns else None
    moving = 0 if drawing is None else len(drawing.channels)
    found = r.waves.accounts if assembly.accounts is not None else None
    ledger = None
    if found is not None and assembly.accounts is not None:
        from .analyses.afterwards import driven_linkage
        from .reports.energy import Ledger, doubt

        ledger = Ledger(assembly.accounts, found, assembly.system.device_names)
        if not isfinite(ledger.residual):  # a run that ended at a pole has no balance to show
            ledger = None
        elif r.waves.status == "ok":
            sink = assembly.flat.sink
            wrong = doubt(ledger, sink, assembly.options, lambda: driven_linkage(assembly, r))
            r.trouble += [wrong] if wrong else []

    stats = {**r.waves.stats, **r.stats}
    stats.setdefault("seconds", stats.get("solve_time"))
    if assembly.machine is not None and r.waves.gaps:
        stats["open"] = assembly.machine.widest([wide for _, wide in r.waves.gaps])
    grid = None if r.grid is None else (r.grid[0], r.grid[2], r.grid[1])
    scene = None if drawing is None else Scene(drawing.data(), Part(r.channels, 0, moving))
    if r.swing is not None and assembly.drawn is not None:
        scene = Scene(assembly.drawn.data(), r.swing[1], r.swing[0])
    circuit = _circuit(assembly, r, moving)
    more = {"grid": grid, "stats": stats, "scene": scene, "energy": ledger, "circuit": circuit}
    return _named(assembly, r, status=r.waves.status, **more)


def _circuit(assembly: Assembly, r: Run, first: int) -> Scene | None:
    """The circuit as it is drawn, with what flows in it where that is recorded, or why it is not; None: there is none."""
    flat, flows = assembly.flat, assembly.flows
    if not flat.is_drawn or not (flat.elements or flat.machine):
        return None
    from .analyses.base import Part
    from .diagnostics import DeckError
    from .schematic.picture import pictures
    from .store import Scene

    if "circuit" not in r.analysis.draws or not r.channels.columns:
        flows = None  # drawn without what flows in it
    channels = [] if flows is None else flows.channels
    still: dict[str, Any] = {"volts": {}, "currents": {}, "uses": {}, "channels": []}
    try:
        drawn = {**(still if flows is None else flows.data()), "pictures": pictures(flat)}
    except DeckError as error:
        drawn = {"refused": error.diagnostics[0].message}
        channels = []
    except Exception as error:  # a drawing never takes the run and its page with it
        said = f"the circuit could not be drawn ({type(error).__name__}: {error})"
        flat.sink.warning("W352", said, None, "a fault of emsim: please report it with the deck")
        drawn = {"refused": said}
        channels = []
    if drawn.get("pictures") == {}:
        return None
    return Scene(drawn, Part(r.channels, first, len(channels)))


def _named(assembly: Assembly, r: Run, **more: Any) -> Table:
    """The columns of a run, those among them that follow from others."""
    from .table import Table

    title = assembly.flat.title
    more.setdefault("plotname", r.plotname)
    table = Table(r.kind, r.names, r.units, r.store, title=title, axis=r.axis, steps=r.steps, **more)
    return table.extended(r.derived) if r.derived else table


def _merged(
    options: Options | None, method: str | None, reltol: float | None, tmax: float | None
) -> dict[str, Any]:
    given = {"method": method, "reltol": reltol, "tmax": tmax}
    return {
        **{key.lower(): value for key, value in (options or {}).items()},
        **{key: value for key, value in given.items() if value is not None},
    }

"""usage: emsim sweep [options] deck.cir

Runs a deck many times: over a grid of values, with random ones (agauss, unif, mc, ..), at their corners. What varies is a
parameter of the deck (.param), an element, temp, or a parameter of a model as in npn(vaf). The measures of the runs (.meas; of a
deck without, the last values of what it prints) go to a table.

  -D r=1k..10k:20       20 values, equally spaced; :20log equal ratios, :5dec five a decade, :3oct three an octave
  -D r=1k,2.2k,4.7k     a list; several -D make a grid; -D r=1k is one value"""

from __future__ import annotations

from os.path import basename, splitext
from time import monotonic

from ..diagnostics import DeckError, Diagnostic, OutsideError
from .arguments import HELP, JSON, METHOD, QUIET, RELTOL, Arguments, Option, UsageError, overrides, parse
from .console import (
    INTERRUPTED,
    OK,
    Line,
    check_targets,
    engineering,
    print_json,
    print_lines,
    show,
    stdin_text,
    unwritten,
)

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from ..sweeps.result import Goal, Swept

KINDS = ("mc", "lhs", "sobol", "indices")
OPTIONS = [
    Option("-D --define", "what varies, see above", "NAME=VALUES", repeat=True),
    Option("--mc", "N runs at each point of the grid with random values of their own", "N"),
    Option("--lhs", "the same as a Latin hypercube", "N"),
    Option("--sobol", "the same by a Sobol' sequence; powers of 2 are best", "N"),
    Option("--corners", "all random values at their least and greatest"),
    Option("--sensitivity", "each random value at its least and greatest, one at a time"),
    Option(
        "--indices",
        "N (n + 2) runs of n random values: Sobol' indices, what each does alone and with others",
        "N",
    ),
    Option(
        "--worst",
        "decks that repeat the runs with the least and the greatest MEASURE: deck.MEASURE.least.cir",
        "MEASURE",
    ),
    Option("--seed", "of the random values, 1", "N"),
    Option(
        "--goal",
        "what a measure is to be, as in 'vmax<1.2'; the share of runs that meet all is told",
        "GOAL",
        repeat=True,
    ),
    Option(
        "--save",
        "a signal to keep of every run, as .print takes it; ac:vdb(out), op:v(a) are those of an analysis",
        "SIGNAL",
        repeat=True,
    ),
    Option(
        "-o --output",
        "the table, instead of deck.sweep.csv; .parquet; .nc or .zarr: with the signals",
        "FILE",
    ),
    Option(
        "--plot",
        "a picture: families, courses, histograms, or what each random value does; .png .svg .pdf",
        "FILE",
    ),
    Option("--html", "a page of its own: tables, yield, these pictures", "FILE"),
    Option("-j --jobs", "processes, instead of one a core", "N"),
    Option("--dask", "address of a Dask scheduler whose workers run it", "ADDRESS"),
    Option("--fresh", "begin anew where an interrupted sweep of this deck could go on"),
    METHOD,
    RELTOL,
    JSON,
    QUIET,
    HELP,
]


def main(args: Sequence[str]) -> int:
    from ..sweeps import sweep
    from ..sweeps.result import Goal

    given = parse(args, OPTIONS)
    if len(given.words) != 1:
        raise UsageError("emsim sweep takes one deck")
    deck = given.words[0]
    scheme, runs = _scheme(given)
    try:
        goals = [Goal(text) for text in given.all("goal")]
    except ValueError as error:
        raise UsageError(str(error)) from None
    stem = "stdin" if deck == "-" else splitext(basename(deck))[0]
    table = given.text("output") or f"{stem}.sweep.csv"
    if not table.endswith((".csv", ".parquet", ".nc", ".zarr")):
        raise UsageError(f"-o {table}: a sweep is written as .csv, .parquet, .nc or .zarr")
    picture = given.picture()
    site = given.text("html")
    worst = given.text("worst")
    ends = {f"{stem}.{worst}.{end}.cir": k for k, end in enumerate(("least", "greatest")) if worst}
    check_targets(
        [path for path in (table, picture, site, *ends) if path and not path.endswith(".zarr")], deck
    )
    journal = f"{splitext(table)[0]}.journal"
    jobs = given.whole("jobs", None)
    heard = _Progress(given.has("quiet") or given.has("json"))
    try:
        swept = sweep(
            stdin_text() if deck == "-" else deck, given.all("define"), scheme, runs, given.whole("seed", 1) or 1,
            given.all("save"), overrides(given, ["reltol"]), jobs, given.text("dask"), journal, given.has("fresh"), heard,
        )  # fmt: skip
    except KeyboardInterrupt:
        heard.end()
        show([Diagnostic("error", "E433", f"interrupted; the same command goes on from {journal}")])
        return INTERRUPTED
    except OSError as error:
        raise OutsideError(unwritten(journal, error)) from None
    heard.end()
    code = report(swept, goals, given, table, picture)
    if worst is not None:
        _repeats(swept, worst.lower(), ends)
    return code


def _repeats(swept: Swept, measure: str, ends: dict[str, int]) -> None:
    """The decks of --worst."""
    from ..outputs.beside import write_text

    try:
        texts = {path: swept.repeat(swept.extremes(measure)[k]) for path, k in ends.items()}
    except (KeyError, ValueError) as error:
        raise UsageError(f"--worst {measure}: {error.args[0]}") from None
    for path, text in texts.items():
        try:
            write_text(path, text)
        except OSError as error:
            raise OutsideError(unwritten(path, error)) from None


def report(swept: Swept, goals: list[Goal], given: Arguments, table: str, picture: str | None) -> int:
    """Files, the summary, the exit code."""
    try:
        swept.save(table)
        if picture is not None:
            from ..sweeps.pictures import draw

            draw(swept, picture, goals)
        if (site := given.text("html")) is not None:
            from ..sweeps.page import write

            write(swept, site, goals)
        yielded = swept.yielded(goals) if goals else None
    except ImportError as error:
        from ..outputs import missing_package

        raise missing_package(f"{splitext(table)[1]} files need", str(error.name), "tables,files") from None
    except ValueError as error:
        raise UsageError(str(error)) from None
    except OSError as error:
        raise OutsideError(unwritten(table, error)) from None
    failed, of = swept.failed, f"of {len(swept)} runs"
    told = [("W430", f"{len(failed)} {of} failed: {_some(swept)}")] if failed else []
    for text, runs in swept.warnings.items():
        code, _, message = text.partition(": ")
        told.append((code, f"{message} (in {len(runs)} {of}, the first is {runs[0]})"))
    said = [Diagnostic("warning", code, message) for code, message in told]
    if len(failed) == len(swept):
        first = next(iter(failed.values()))
        raise DeckError(Diagnostic("error", "E432", f"all {len(swept)} runs failed, the first with {first}"))
    show(said, given.has("quiet"))
    statistics = {name: swept.statistics(name) for name in swept.names}
    if given.has("json"):
        keys = ("met", "runs", "least", "greatest")
        share = None if yielded is None else dict(zip(keys, yielded, strict=True))
        print_json(
            OK, said, runs=len(swept), failed={str(k): v for k, v in failed.items()}, scheme=swept.scheme.label(),
            random_values=dict(zip(swept.random, swept.labels, strict=True)), measures=statistics, goals=share, file=table,
        )  # fmt: skip
    else:
        print_lines(summary(swept, statistics))
        if yielded is not None:
            met, n, low, high = yielded
            ends = f"95 % bounds {100 * low:.4g} to {100 * high:.4g} %"
            print_lines([f"yield {100 * met / n:.4g} % ({met} of {n} runs; {ends})"])
    return OK


def summary(swept: Swept, statistics: dict[str, dict[str, float]]) -> Iterator[str]:
    """A line a measure; of a sweep one at a time what each random value does."""
    resumed = f", {swept.resumed} of them from before" if swept.resumed else ""
    yield f"{len(swept)} runs{resumed}: {swept.scheme.label()}"
    width = max((len(name) for name in statistics), default=0)
    for name, about in statistics.items():
        if not about["runs"]:
            yield f"  {name:<{width}}  found in no run"
            continue
        numbers = "  ".join(
            f"{word} {about[word]:.6g}" for word in ("mean", "deviation", "least", "greatest")
        )
        found = "" if about["runs"] == len(swept) else f"  in {about['runs']:.0f} runs"
        yield f"  {name:<{width}}  {numbers}{found}"
    for name in statistics:
        shares, said = swept.shares(name)
        if shares:
            yield f"  what moves {name}, in shares of its variance ({said}):"
        for value, alone, total in shares[:20]:
            others = "" if swept.scheme.name != "indices" else f"  {100 * total:6.2f} %"
            yield f"    {100 * alone:6.2f} %{others}  {value}"
    if swept.scheme.name == "sensitivity" and not swept.axes:
        for name in statistics:
            yield f"  what moves {name}, at the least and the greatest of:"
            for label, low, high in swept.influences(name)[:20]:
                yield f"    {low:+.4g}  {high:+.4g}  {label}"
            least, greatest = swept.worst(name)
            yield f"    all together: {least:.6g} .. {greatest:.6g}"


def _some(swept: Swept) -> str:
    """What the failed runs say, by kind."""
    kinds: dict[str, list[int]] = {}
    for k, error in swept.failed.items():
        kinds.setdefault(error, []).append(k)
    told = [
        f"{error} (run {runs[0]}{f' and {len(runs) - 1} more' if len(runs) > 1 else ''})"
        for error, runs in kinds.items()
    ]
    return "; ".join(told[:3]) + ("; .." if len(told) > 3 else "")


def _scheme(given: Arguments) -> tuple[str, int]:
    chosen = [name for name in (*KINDS, "corners", "sensitivity") if given.has(name)]
    if len(chosen) > 1:
        raise UsageError(f"--{chosen[0]} and --{chosen[1]} exclude each other")
    if not chosen:
        return "nominal", 1
    return chosen[0], given.whole(chosen[0], 1) or 1 if chosen[0] in KINDS else 1


class _Progress(Line):
    """How far the sweep is, and about how long it still takes."""

    def __init__(self, quiet: bool) -> None:
        super().__init__(quiet)
        self.start, self.first, self.told = monotonic(), -1, 0.0

    def __call__(self, done: int, runs: int) -> None:
        now = monotonic()
        if self.first < 0:
            self.first, self.start = done, now
        if now - self.told >= 0.2:
            self.told = now
            speed = (done - self.first) / max(now - self.start, 1e-9)
            left = f", {engineering((runs - done) / speed)}s left" if speed > 0.0 else ""
            self.write(f"{done} of {runs} runs{left}")

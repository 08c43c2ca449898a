"""usage: emsim fit [options] deck.cir data.csv ... -p NAME ...

Finds values of parameters, elements, models and machine cards with which the deck's transient goes through measured curves,
by least squares with exact derivatives. data.csv has a column `time` and one for each signal, called as .print calls it. Told
are the values, the intervals that hold the true ones with 95 % probability, and what the data cannot tell apart. A column
sigma(v(out)) has the standard deviations of v(out). Several files are several experiments, and what was set in one of them
stands behind its name: hot.csv:vin=5,temp=85

  emsim fit motor.cir startup.csv -p r -p l -p kt -p j=1u..1m --column speed='omega(shaft)'"""

from __future__ import annotations

from ..diagnostics import Diagnostic, OutsideError, deck_error
from .arguments import Arguments, Option, UsageError, number, parse
from .console import OK, check_targets, print_json, print_lines, show, stdin_text, unwritten
from .searching import SHARED, VARY, Heard, asked, shared, unsure

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from ..fits.fitted import Fitted

OPTIONS = [
    VARY,
    Option(
        "--column",
        "the signal that a column of the data is; nothing behind = leaves the column out",
        "NAME=SIGNAL",
        repeat=True,
    ),
    Option(
        "--prior",
        "what is known before: a mean and a standard deviation, r=1k+-50 or r=1k+-5%",
        "NAME=MEAN+-DEVIATION",
        repeat=True,
    ),
    Option("--sigma", "standard deviation of the noise, instead of what is left", "X"),
    Option("-o --output", "time, data, curves and what is left, as CSV", "FILE"),
    Option("--plot", "a picture of data and curves; .png .svg .pdf", "FILE"),
    *SHARED,
]


def main(args: Sequence[str]) -> int:
    from ..fits import data as curves
    from ..fits import fit

    given = parse(args, OPTIONS)
    if len(given.words) < 2:
        raise UsageError("emsim fit takes a deck and files of data: emsim fit deck.cir data.csv -p NAME")
    deck, *files = given.words
    quantities = asked(given)
    more = shared(given)
    table, picture = given.text("output"), given.picture()
    check_targets([path for path in (table, picture) if path], deck)
    columns = dict(text.partition("=")[::2] for text in given.all("column"))
    try:
        measured = curves.experiments([curves.conditioned(file) for file in files], columns)
    except (ValueError, UnicodeError) as error:
        deck_error("E436", str(error), hint="a line of names, `time` among them, then numbers")
    heard = Heard(given.has("quiet") or given.has("json"))
    priors = dict(text.partition("=")[::2] for text in given.all("prior"))
    vary = {q.name: q for q in quantities}
    try:
        found = fit(
            stdin_text() if deck == "-" else deck,
            measured,
            vary,
            sigma=_sigma(given),
            progress=heard,
            priors=priors,
            **more,
        )
    except ValueError as error:
        raise UsageError(str(error)) from None
    finally:
        heard.end()
    try:
        if table is not None:
            write(found, table)
        if picture is not None:
            from ..fits.pictures import draw

            draw(found, picture)
    except OSError as error:
        raise OutsideError(unwritten(table or picture or "", error)) from None
    said = list(remarks(found))
    show(said, given.has("quiet"))
    if given.has("json"):
        print_json(
            OK, said, values=found.values, intervals={k: list(v) for k, v in found.intervals.items()}, level=found.level,
            correlation=found.correlation.tolist(), left=found.left, runs=found.runs, converged=found.converged,
            mixtures=[m.changes for m in found.mixtures], at_bounds=found.at_bounds,
        )  # fmt: skip
    else:
        print_lines(summary(found))
    return OK


def _sigma(given: Arguments) -> float | None:
    text = given.text("sigma")
    value = None if text is None else number(text)
    if text is not None and (value is None or value <= 0.0):
        raise UsageError(f"--sigma: {text!r} is not a positive number")
    return value


def remarks(found: Fitted) -> Iterator[Diagnostic]:
    for mixture in found.mixtures:
        yield Diagnostic(
            "warning", "W431", mixture.sentence(), None, "fix one of them, or measure another signal"
        )
    yield from unsure(found)


def summary(found: Fitted) -> Iterator[str]:
    signals, several = len(found.left), len(found.experiments)
    times = sum(len(data.times) for data, _ in found.experiments)
    of = f" in {several} experiments" if several > 1 else ""
    yield f"{times} times of {signals} signal{'s' if signals > 1 else ''}{of}, {found.runs} runs"
    values = [v for data, _ in found.experiments for row in data.values.tolist() for v in row]
    if missing := sum(v != v for v in values):
        yield f"{missing} of {len(values)} values are missing in the data, and count for nothing"
    width = max(map(len, [*found.names, *found.left]))
    for name in found.names:
        low, high = found.intervals[name]
        between = f"{low:.6g} .. {high:.6g}" if high < float("inf") else "not known from these data"
        yield f"  {name:<{width}}  {found.values[name]:.7g}   {between}"
    yield f"  ({100 * found.level:.0f} % intervals)"
    for first, second, value in found.correlated()[:10]:
        yield f"  {first} and {second} go together: correlation {value:+.4f}"
    yield "left, root mean square:"
    for name, value in found.left.items():
        yield f"  {name:<{width}}  {value:.4g}"


def write(found: Fitted, path: str) -> None:
    """Of each signal the data, the curve, and their difference; of several experiments with their numbers, from 1 on."""
    import csv

    from ..outputs.beside import replacing

    signals = list(found.left)
    names = ["time", *(f"{word}{name}" for name in signals for word in ("", "fit:", "left:"))]
    several = len(found.experiments) > 1
    with replacing(path) as beside, open(beside, "w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow(["experiment", *names] if several else names)
        for number, (data, curves) in enumerate(found.experiments, 1):
            for k, t in enumerate(data.times):
                cells = [*([str(number)] if several else []), repr(float(t))]
                for name in signals:
                    if name not in data.names:
                        cells += [""] * 3
                        continue
                    j = data.names.index(name)
                    was, curve = float(data.values[k, j]), float(curves[k, j])
                    cells += [repr(was), repr(curve), repr(curve - was)]
                rows.writerow(cells)

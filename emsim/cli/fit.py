"""usage: emsim fit [options] deck.cir data.csv -p NAME ...

Finds values of parameters, elements, models and machine cards with which the deck's transient goes through measured curves,
by least squares with exact derivatives. data.csv has a column `time` and one for each signal, called as .print calls it. Told
are the values, the intervals that hold the true ones with 95 % probability, and what the data cannot tell apart.

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
    Option("--sigma", "standard deviation of the noise, instead of what is left", "X"),
    Option("-o --output", "time, data, curves and what is left, as CSV", "FILE"),
    Option("--plot", "a picture of data and curves; .png .svg .pdf", "FILE"),
    *SHARED,
]


def main(args: Sequence[str]) -> int:
    from ..fits import data as curves
    from ..fits import fit

    given = parse(args, OPTIONS)
    if len(given.words) != 2:
        raise UsageError("emsim fit takes a deck and a file of data: emsim fit deck.cir data.csv -p NAME")
    deck, file = given.words
    quantities = asked(given)
    more = shared(given)
    table, picture = given.text("output"), given.picture()
    check_targets([path for path in (table, picture) if path], deck)
    columns = dict(text.partition("=")[::2] for text in given.all("column"))
    try:
        measured = curves.read(file, columns)
    except (ValueError, UnicodeError) as error:
        deck_error("E436", str(error), hint="a line of names, `time` among them, then numbers")
    heard = Heard(given.has("quiet") or given.has("json"))
    values = {"time": measured.times, **dict(zip(measured.names, measured.values.T, strict=True))}
    vary = {q.name: q for q in quantities}
    try:
        found = fit(
            stdin_text() if deck == "-" else deck, values, vary, sigma=_sigma(given), progress=heard, **more
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
    signals = len(found.data.names)
    yield f"{len(found.data.times)} times of {signals} signal{'s' if signals > 1 else ''}, {found.runs} runs"
    if missing := sum(v != v for row in found.data.values.tolist() for v in row):
        yield f"{missing} of {found.data.values.size} values are missing in the data, and count for nothing"
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
    """Of each signal the data, the curve, and their difference."""
    import csv

    from ..outputs.beside import replacing

    names = ["time", *(f"{word}{name}" for name in found.data.names for word in ("", "fit:", "left:"))]
    with replacing(path) as beside, open(beside, "w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow(names)
        for k, t in enumerate(found.data.times):
            cells = [float(t)]
            for j in range(len(found.data.names)):
                data, curve = float(found.data.values[k, j]), float(found.curves[k, j])
                cells += [data, curve, curve - data]
            rows.writerow([repr(c) for c in cells])

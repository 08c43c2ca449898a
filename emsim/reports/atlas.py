"""The stability atlas: every case of hard.py under every method, its verdicts as a table, CSV, Markdown and a picture.

A run is bounded by the number of its steps and by CPU time; what is over the bound stops.
"""

from __future__ import annotations

from pathlib import Path

from ..diagnostics import ConvergenceError, DeckError, Diagnostic, OutsideError
from .criteria import DAMPED, DRIFTS, EXPLODES, OK, RINGS, STOPS, Trial, Verdict, stopped
from .hard import CASES, METHODS, Case
from .source_tree import root

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import Any

    from ..result import Result

SECONDS = 30.0  # CPU time of one run, a safety: steps are what bounds it
ENOUGH = 150_000  # steps after which their present rate tells what the whole run would need
COLOURS = {
    OK: "#7fb77e", DAMPED: "#f2c57c", RINGS: "#e8a0bf", DRIFTS: "#a7bed3", EXPLODES: "#d1495b", STOPS: "#8d99ae",
}  # fmt: skip
ESCAPES = {OK: "32", DAMPED: "33", RINGS: "35", DRIFTS: "36", EXPLODES: "31", STOPS: "90"}


class Cell:
    """One case under one method: verdict, cost, and whether it is what must be."""

    __slots__ = ("case", "method", "seconds", "steps", "verdict")

    def __init__(self, case: Case, method: str, verdict: Verdict, steps: int, seconds: float) -> None:
        self.case, self.method, self.verdict = case, method, verdict
        self.steps, self.seconds = steps, seconds

    def as_dict(self) -> dict[str, Any]:
        v = self.verdict
        return {
            "case": self.case.name, "deck": self.case.deck, "method": self.method, "verdict": v.word,
            "number": v.number, "text": v.text, "expected": self.expected, "steps": self.steps,
            "seconds": self.seconds,
        }  # fmt: skip

    @property
    def expected(self) -> bool:
        """False where auto fails, or a method passes (or fails otherwise) that theory says must fail."""
        from .hard import AUTO

        if self.method == AUTO:
            return self.verdict.word == OK
        must = self.case.must.get(self.method)
        return must is None or self.verdict.word in must


def decks() -> Path:
    """The folder netlists/. OutsideError where only the package is installed."""
    return root() / "netlists"


def methods() -> list[str]:
    """The columns."""
    return list(METHODS)


def called(case: Case, word: str) -> bool:
    """Whether a word is part of the case's name or of its deck's."""
    return word.lower() in case.name.lower() or word.lower() in case.deck.lower()


def strangers(words: Sequence[str]) -> list[str]:
    """Words that name neither a method nor a case."""
    return [w for w in words if w not in METHODS and not any(called(case, w) for case in CASES)]


def measure(case: Case, method: str, run: Callable[..., Result]) -> Cell:
    """One cell. `run` is pipeline.run."""
    trial = _trial(case, {**case.own.get(method, case.options), **METHODS[method]}, run)
    judges_stops = getattr(case.judge, "judges_stops", False)
    if trial.result is None or not len(trial.result.plots) or (not trial.finished and not judges_stops):
        verdict = stopped(trial)
    else:
        verdict = case.judge(trial)
    return Cell(case, method, verdict, trial.steps, trial.seconds)


def _trial(case: Case, options: dict[str, Any], run: Callable[..., Result]) -> Trial:
    from time import process_time

    began, reached, trouble = process_time(), 1.0, None
    judges_stops = getattr(case.judge, "judges_stops", False)
    result: Result | None = None

    def watch(t: float, stop: float, _step: float, steps: int, _events: int) -> bool:
        nonlocal reached
        hopeless = not judges_stops and steps > ENOUGH and steps * stop > 4 * case.steps * t
        over = hopeless or steps > case.steps or process_time() - began > SECONDS
        if over:
            reached = t / stop
        return over

    try:
        result = run(decks() / case.deck, defines=case.defines, options=options, progress=watch)
    except ConvergenceError as error:
        result, trouble, reached = error.partial, error.diagnostics[0], 0.0
    except DeckError as error:
        trouble, reached = error.diagnostics[0], 0.0
    return Trial(result, trouble, reached, lambda **more: _trial(case, {**options, **more}, run))


def atlas(
    run: Callable[..., Result], names: Sequence[str] = (), told: Callable[[str], object] | None = None
) -> list[list[Cell]]:
    """Rows of cells, a row a case. names: parts of names of cases or decks, or methods, to keep; told(text) before each
    row."""
    rows = []
    columns = [m for m in methods() if m in names] or methods()
    wanted = [word for word in names if word not in METHODS]
    for case in CASES:
        if wanted and not any(called(case, word) for word in wanted):
            continue
        if told:
            told(case.name)
        rows.append([measure(case, method, run) for method in columns])
    return rows


# ---- what is shown -------------------------------------------------------------------------------


def table_lines(rows: Sequence[Sequence[Cell]], colour: bool = False) -> list[str]:
    """Two lines a case: the verdicts, and below them the numbers."""
    if not rows:
        return ["no case of that name"]
    width = max(len(row[0].case.name) for row in rows) + 2
    lines = ["".ljust(width) + "".join(cell.method.rjust(10) for cell in rows[0])]
    for row in rows:
        words, numbers = row[0].case.name.ljust(width), "".ljust(width)
        for cell in row:
            word = cell.verdict.word + ("" if cell.expected else "!")
            code = ESCAPES[cell.verdict.word] if colour else ""
            words += f"\x1b[{code}m{word:>10}\x1b[0m" if code else f"{word:>10}"
            numbers += cell.verdict.number[:9].rjust(10)
        lines += [words, numbers]
    surprises = [cell for row in rows for cell in row if not cell.expected]
    for cell in surprises:
        lines.append(f"! {cell.case.name}, {cell.method}: {cell.verdict.text}")
    seconds = sum(cell.seconds for row in rows for cell in row)
    lines.append(
        f"{len(rows)} cases, {len(surprises)} not as theory or auto must be; {seconds:.1f} s of solving"
    )
    return lines


def markdown_lines(rows: Sequence[Sequence[Cell]]) -> list[str]:
    """What is hard about each case, what it is asked and who must fail; then the verdicts."""
    lines = ["| case | deck | hard because | asked | must fail |", "|---|---|---|---|---|"]
    for case in (row[0].case for row in rows):
        must = "; ".join(f"{method}: {' or '.join(words)}" for method, words in case.must.items())
        lines.append(f"| {case.name} | `{case.deck}` | {case.why} | {case.asked} | {must} |")
    lines += [
        "",
        "| case | " + " | ".join(cell.method for cell in rows[0]) + " |",
        "|---" * (len(rows[0]) + 1) + "|",
    ]
    for row in rows:
        cells = [f"{cell.verdict.word} {cell.verdict.number}" for cell in row]
        lines.append("| " + " | ".join([row[0].case.name, *cells]) + " |")
    return lines


BEGIN, END = "<!-- atlas -->\n", "<!-- end of atlas -->\n"


def write_readme(rows: Sequence[Sequence[Cell]], path: Path | None = None) -> Path:
    """Puts the tables between the marks of netlists/hard/README.md."""
    path = path or decks() / "hard" / "README.md"
    text = path.read_text(encoding="utf-8")
    head, _, rest = text.partition(BEGIN)
    tables = "".join(line + "\n" for line in markdown_lines(rows))
    path.write_text(head + BEGIN + tables + END + rest.partition(END)[2], encoding="utf-8")
    return path


def csv_lines(rows: Sequence[Sequence[Cell]]) -> list[str]:
    """A line a cell, quoted as CSV."""
    import csv
    import io

    out = io.StringIO()
    cells = [cell.as_dict() for row in rows for cell in row]
    table = csv.DictWriter(out, list(cells[0]), lineterminator="\n")
    table.writeheader()
    table.writerows({**cell, "text": cell["text"].replace("\n", " ")} for cell in cells)
    return out.getvalue().splitlines()


def picture(path: str, rows: Sequence[Sequence[Cell]]) -> None:
    """A coloured grid, to a file in the format of its extension. OutsideError without matplotlib."""
    from . import draw

    pyplot = draw.pyplot()
    columns, n = [cell.method for cell in rows[0]], len(rows)
    figure, axis = pyplot.subplots(figsize=(2.2 + 0.95 * len(columns), 1.2 + 0.36 * n), layout="constrained")
    for y, row in enumerate(rows):
        for x, cell in enumerate(row):
            box = pyplot.Rectangle(
                (x, y), 1, 1, facecolor=COLOURS[cell.verdict.word], edgecolor="white", linewidth=1.5
            )
            axis.add_patch(box)
            weight = "normal" if cell.expected else "bold"
            mark = "" if cell.expected else " !"
            axis.text(
                x + 0.5,
                y + 0.36,
                cell.verdict.word + mark,
                ha="center",
                va="center",
                fontsize=8,
                weight=weight,
            )
            axis.text(
                x + 0.5,
                y + 0.72,
                cell.verdict.number,
                ha="center",
                va="center",
                fontsize=6.5,
                color="#333333",
            )
    axis.set_xlim(0, len(columns))
    axis.set_ylim(n, 0)
    axis.set_xticks([x + 0.5 for x in range(len(columns))], columns)
    axis.set_yticks([y + 0.5 for y in range(n)], [row[0].case.name for row in rows])
    axis.tick_params(length=0, labelsize=8.5, top=True, labeltop=True, bottom=False, labelbottom=False)
    axis.set_frame_on(False)
    handles = [pyplot.Rectangle((0, 0), 1, 1, facecolor=COLOURS[word]) for word in COLOURS]
    figure.legend(
        handles, list(COLOURS), loc="outside lower center", ncols=len(COLOURS), frameon=False, fontsize=8.5
    )
    try:
        figure.savefig(path, dpi=130)
    finally:
        pyplot.close(figure)


def write(path: str, rows: Sequence[Sequence[Cell]], kind: str = "") -> None:
    """A file of a kind (csv, md), or that of its extension, or a picture. ValueError for one that nobody knows."""
    kind = kind or path.rpartition(".")[2].lower()
    lines = csv_lines(rows) if kind == "csv" else markdown_lines(rows) if kind == "md" else None
    if lines is None:
        picture(path, rows)
        return
    try:
        with open(path, "w", encoding="utf-8") as file:
            file.writelines(line + "\n" for line in lines)
    except OSError as error:
        raise OutsideError(Diagnostic("error", "E503", f"cannot write {path}: {error.strerror}")) from None

"""Numbers from files, one reader for all: points of PWL, tables of code models, measured curves.

What a file says must be clear: `0,5` beside another value of its line may be a half or two numbers, and is neither.
"""

from __future__ import annotations

from .units import spice_leftover, spice_number

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator


class TableError(ValueError):
    """What is wrong, with the number of the line."""


def lines(text: str, comments: str) -> Iterator[tuple[int, list[str]]]:
    """Number and words of each line that says something; blanks, commas and semicolons separate. Raises TableError."""
    for k, line in enumerate(text.split("\n"), 1):
        for c in comments:
            line = line.partition(c)[0]
        fields = line.replace(";", " ").split()
        if "," in line and len(fields) > 1:
            check_commas(fields, k)
        if words := line.replace(",", " ").replace(";", " ").split():
            yield k, words


def check_commas(fields: list[str], line: int) -> None:
    """Raises TableError for a field with digits on both sides of a comma."""
    for field in fields:
        whole, comma, rest = field.partition(",")
        if comma and whole.lstrip("+-").isdigit() and rest[:1].isdigit() and "," not in rest:
            raise TableError(
                f"line {line}: `{field}` has a decimal comma, or is two numbers: write {whole}.{rest}, or a blank"
            )


def number(word: str, line: int) -> float:
    """A number by SPICE's rule, all of the word. Raises TableError."""
    value = spice_number(word)
    if value is None or spice_leftover(word):
        raise TableError(f"line {line}: `{word[:40]}` is no number")
    return value


def measured(cell: str, line: int) -> float:
    """A cell of a table of measurements; nan where it is empty or says so, for nothing was measured."""
    word = cell.strip()
    if not word or word.lower() == "nan":
        return float("nan")
    if word.lower().lstrip("+-") in ("inf", "infinity"):
        raise TableError(
            f"row {line}: `{word}` is no measurement; leave the cell empty, or write nan, where there is none"
        )
    try:
        return float(word)
    except ValueError:
        pass
    if "," in word:
        check_commas([word], line)
    raise TableError(f"row {line}: `{word[:40]}` is no number")

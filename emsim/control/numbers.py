"""Numbers as ngspice prints them, and tables of vectors in its columns."""

from __future__ import annotations

import math

from .errors import CommandError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from .plots import Plot, Vector

DIGITS = 6
MOST_DIGITS = 15
REAL, COMPLEX, INDEX = 16, 32, 8  # widths of columns
PAGE = 60  # rows to a heading: the heading itself is 5 of them
LEAST_WIDTH = 40


def number(x: float, digits: int = DIGITS) -> str:
    """One number; a minus takes the place of a digit."""
    if math.isnan(x):
        return "nan"
    return f"{x:.{digits - 1 if x < 0 else digits}e}"


def short(x: float) -> str:
    """A number as echo shows it: a whole one without a point, others with six digits."""
    if math.isfinite(x) and x == int(x) and abs(x) < 1e9:
        return str(int(x))
    return f"{x:G}"


def both(value: complex | float, digits: int) -> str:
    if isinstance(value, complex):
        return f"{number(value.real, digits)},{number(value.imag, digits)}"
    return number(value, digits)


def lines_of(vectors: Sequence[Vector], current: Plot, digits: int, width: int) -> Iterator[str]:
    """`name = value`, of longer vectors `name = ( ... )`; with the plots in front where there are several."""
    several = len({(v.plot or current).name for v in vectors}) > 1
    for v in vectors:
        name = (f"{(v.plot or current).name}.{v.name}" if several else v.name).lower()
        values = v.values.tolist()
        if len(values) == 1:
            yield f"{name} = {both(values[0], digits)}"
            continue
        line, at = f"{name} = (  ", 10
        for value in values:
            text = both(value, digits)
            line += text
            at = (at + len(text) + 7) // 8 * 8 + 1
            if at > width:
                line, at = line + "\n\t", 9
            else:
                line += "\t"
        yield from (line + ")").split("\n")


def columns(
    vectors: Sequence[Vector], plot: Plot, digits: int, width: int, height: int, scale: bool
) -> Iterator[str]:
    """Vectors side by side below `Index`, as many as fit, the scale first; then the others below them."""
    rest = list(vectors)
    while rest:
        own = plot.scale if scale and plot.has_scale and plot.shows_scale else None
        shown = [*([own] if own is not None and rest[0].key != own.key else []), rest[0]]
        rest = rest[1:]
        used = INDEX + sum(_wide(v) for v in shown)
        while rest and (used + _wide(rest[0]) <= width or len(shown) < 2):
            used += _wide(rest[0])
            shown.append(rest.pop(0))
        yield from _page(shown, plot, digits, width, height)
        if rest:
            yield ""


def _wide(v: Vector) -> int:
    return COMPLEX if v.is_complex and v.key != "frequency" else REAL


def _page(shown: list[Vector], plot: Plot, digits: int, width: int, height: int) -> Iterator[str]:
    indent = " " * max(0, (width - len(plot.title)) // 2)
    yield indent + plot.title
    yield f"{indent}{plot.plotname}  {plot.date}"
    head = f"{'Index':<8}" + "".join(f"{v.name[: _wide(v) - 1]:<{_wide(v)}}" for v in shown)
    yield "-" * width
    yield head
    yield "-" * width
    data = [v.values.real.tolist() if v.key == "frequency" else v.values.tolist() for v in shown]
    line = 5
    for row in range(max(map(len, data))):
        if line >= height:
            yield ""
            yield head
            yield "-" * width
            line = 2
        cells = [f"{row}\t"]
        for v, values in zip(shown, data, strict=True):
            if row >= len(values):
                cells.append("\t" * (_wide(v) // 8))
            elif isinstance(value := values[row], complex):
                cells.append(f"{number(value.real, digits)},\t{number(value.imag, digits)}\t")
            else:
                cells.append(f"{number(value, digits)}\t")
        yield "".join(cells)
        line += 1


def whole(text: str, what: str) -> int:
    """A count that a command takes."""
    from ..units import spice_number

    value = spice_number(text)
    if value is None or value != int(value):
        raise CommandError("E161", f"{what} is a whole number, not `{text}`")
    return int(value)

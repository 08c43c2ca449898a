"""What varies: values of a name, as `-D` writes them.

R1=1k..10k:20        20 values, equally spaced            R1=1k..10k:20log     equal ratios
R1=1k..10k:5dec      5 a decade (oct: an octave)          R1=1k,2.2k,4.7k      a list
"""

from __future__ import annotations

import math
import re
from typing import NamedTuple

from ..units import spice_number

MOST = 1_000_000  # values of an axis

_RANGE = re.compile(
    r"(?P<first>[^.,]*(?:\.(?!\.)[^.,]*)*)\.\.(?P<last>[^:]+):(?P<count>\d+)(?P<spacing>log|dec|oct)?$"
)


class Axis(NamedTuple):
    name: str
    values: tuple[float, ...]


def parse(text: str) -> Axis | tuple[str, str]:
    """An axis, or (name, value) of what has one value. Raises ValueError with a sentence."""
    name, equals, given = text.partition("=")
    name, given = name.strip().lower(), given.strip()
    if not equals or not name or not given:
        raise ValueError(f"{text}: write name=value, name=first..last:count or name=a,b,c")
    found = _RANGE.match(given)
    if found is None and ".." in given:
        raise ValueError(f"{text}: a range is first..last:count, as in {name}=1k..10k:20, :20log, :5dec")
    if found is not None:
        first, last, count = _number(found["first"], text), _number(found["last"], text), int(found["count"])
        return Axis(name, spaced(first, last, count, found["spacing"] or "lin", text))
    if "," in given and "(" not in given:
        return Axis(name, tuple(_number(part, text) for part in given.split(",")))
    return name, given


def spaced(first: float, last: float, count: int, spacing: str, text: str) -> tuple[float, ...]:
    """`count` values, or that many a decade or octave, the last one included."""
    if not 1 <= count <= MOST:
        raise ValueError(f"{text}: 1 to {MOST} values")
    if spacing != "lin" and not (first > 0.0 < last):
        raise ValueError(f"{text}: equal ratios need values above 0")
    if spacing in ("dec", "oct"):
        base = 10.0 if spacing == "dec" else 2.0
        steps = math.floor(abs(math.log(last / first, base)) * count * (1.0 + 1e-12))
        if steps > MOST:
            raise ValueError(f"{text}: more than {MOST} values")
        ratio = base ** ((1.0 if last >= first else -1.0) / count)
        values = [first * ratio**k for k in range(steps + 1)]
        if not math.isclose(values[-1], last, rel_tol=1e-9):
            values.append(last)
    elif count == 1:
        values = [first]
    elif spacing == "log":
        values = [first * (last / first) ** (k / (count - 1)) for k in range(count)]
    else:
        values = [first + (last - first) * (k / (count - 1)) for k in range(count)]
    if count > 1:
        values[-1] = last  # to the last bit
    return tuple(values)


def _number(text: str, whole: str) -> float:
    value = spice_number(text.strip())
    if value is None:
        raise ValueError(f"{whole}: `{text.strip()}` is not a number")
    return float(value)

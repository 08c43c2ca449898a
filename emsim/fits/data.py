"""Measured curves: times, and signals of the deck at them."""

from __future__ import annotations

import os

from ..tables import TableError, measured

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping
    from typing import Any

    import numpy as np

TIMES = ("time", "t", "time [s]")


class Data:
    """`times` ascending, `values` an array of (times, signals) with nan where nothing was measured, `names` their signals."""

    def __init__(self, times: np.ndarray, values: np.ndarray, names: list[str]) -> None:
        self.times, self.values, self.names = times, values, names


def read(source: Any, columns: Mapping[str, str] | None = None) -> Data:
    """From a CSV file, a mapping of names to values, or a pandas DataFrame. `columns` says what signals columns are: {"speed":
    "omega(j1)"}; those with an empty signal are left out. Raises OSError, ValueError with a sentence."""
    import numpy as np

    if isinstance(source, str) or hasattr(source, "__fspath__"):
        found, where = _of_file(os.fspath(source)), os.fspath(source)
    else:
        found, where = {str(k): np.asarray(source[k], float) for k in source}, "the data"
    given = {key.strip().lower(): value.strip().lower() for key, value in (columns or {}).items()}
    if strange := next((key for key in given if key not in [name.lower() for name in found]), None):
        raise ValueError(f"{where} has no column `{strange}`: it has {', '.join(found)}")
    time = next((name for name in found if given.get(name.lower(), name.lower()) in TIMES), None)
    if time is None:
        raise ValueError(f"{where} has no column `time`: it has {', '.join(found)}")
    signals = {n: given.get(n.lower(), n.lower()) for n in found if n != time}
    signals = {n: signal for n, signal in signals.items() if signal}
    if not signals:
        raise ValueError(f"{where} has no column but the time")
    times = found[time]
    values = np.stack([found[name] for name in signals], axis=1)
    if not np.isfinite(times).all():
        raise ValueError(f"{where}: a time is no finite number")
    if np.isinf(values).any():
        raise ValueError(f"{where}: a value is infinite; nan says that nothing was measured")
    order = np.argsort(times, kind="stable")
    return Data(times[order], values[order], list(signals.values()))


def _of_file(path: str) -> dict[str, np.ndarray]:
    """The columns of a CSV file; a cell that is empty or says nan was not measured, a second line of words is units."""
    import csv

    import numpy as np

    with open(path, encoding="utf-8-sig", newline="") as file:
        text = file.read()
    first = text.partition("\n")[0]
    delimiter = next((d for d in (",", ";", "\t") if d in first), ",")
    rows = [
        row
        for row in csv.reader(_joined(text).splitlines(), delimiter=delimiter, skipinitialspace=True)
        if row
    ]
    names = [name.strip() for name in rows[0]] if rows else []
    numbers: list[list[float]] = []
    for line, row in enumerate(rows[1:], 2):
        if len(row) != len(names):
            raise ValueError(f"{path}: row {line} has {len(row)} values for {len(names)} names")
        try:
            numbers.append([measured(cell, line) for cell in row])
        except TableError as error:
            units = line == 2 and not any(c.isdigit() for cell in row for c in cell) and "inf" not in row
            if not units:
                raise ValueError(f"{path}: {error}") from None
    if not numbers:
        raise ValueError(f"{path}: no numbers below a line of names")
    return dict(zip(names, np.array(numbers).T, strict=True))


def _joined(text: str) -> str:
    """Names such as v(a,b) have commas of their own: they are quoted for the reader of CSV."""
    head, newline, rest = text.partition("\n")
    out, depth, cell = [], 0, ""
    if '"' in head:
        return text
    for c in head.rstrip("\r"):
        depth += (c == "(") - (c == ")")
        if c == "," and depth == 0:
            out.append(cell)
            cell = ""
        else:
            cell += c
    out.append(cell)
    quoted = ",".join(f'"{cell.strip()}"' if "," in cell else cell for cell in out)
    return quoted + newline + rest

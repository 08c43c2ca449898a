"""Measured curves: times, and signals of the deck at them; of one experiment, or of several under conditions of their own."""

from __future__ import annotations

import math
import os
import re

from ..tables import TableError, measured
from ..units import spice_number

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from typing import Any

    import numpy as np

TIMES = ("time", "t", "time [s]")
SIGMA = "sigma("
CONDITIONS = re.compile(r":(?=[A-Za-z_]\w*(\(\w+\))?=)")


class Data:
    """`times` ascending, `values` an array of (times, signals) with nan where nothing was measured, `names` their signals.
    `errors`: standard deviations of the values, nan where nothing is said; `conditions`: what was set meanwhile."""

    def __init__(
        self,
        times: np.ndarray,
        values: np.ndarray,
        names: list[str],
        errors: np.ndarray,
        conditions: Mapping[str, float] | None = None,
    ) -> None:
        self.times, self.values, self.names = times, values, names
        self.errors, self.conditions = errors, dict(conditions or {})


def experiments(source: Any, columns: Mapping[str, str] | None = None) -> list[Data]:
    """Of one source, or of a list of them, each alone or with its conditions: ("a.csv", {"vin": 5}). Raises as `read` does."""
    if not isinstance(source, (list, tuple)):
        return [read(source, columns)]
    if not source:
        raise ValueError("there are no data")
    found: list[Data] = []
    asked = {key.strip().lower(): value for key, value in (columns or {}).items()}
    used: set[str] = set()
    for one in source:
        of, given = one if isinstance(one, tuple) else (one, {})
        table = of if isinstance(of, Data) else _table(of)
        there = (
            {} if isinstance(table, Data) else {k: v for k, v in asked.items() if k in map(str.lower, table)}
        )
        used |= set(there)
        data = table if isinstance(table, Data) else read(table, there, _name(of))
        found.append(
            Data(data.times, data.values, data.names, data.errors, {**data.conditions, **_conditions(given)})
        )
    if strange := next((key for key in asked if key not in used), None):
        raise ValueError(f"no data have a column `{strange}`")
    return found


def conditioned(text: str) -> tuple[str, dict[str, float]]:
    """A file and its conditions, as in cold.csv:vin=5,temp=-20. Raises ValueError."""
    path, given = text, ""
    if (at := CONDITIONS.search(text)) is not None:
        path, given = text[: at.start()], text[at.start() + 1 :]
    return path, _conditions(dict(word.partition("=")[::2] for word in given.split(",") if word))


def _conditions(given: Mapping[str, Any]) -> dict[str, float]:
    found: dict[str, float] = {}
    for name, value in given.items():
        number = spice_number(value.strip()) if isinstance(value, str) else float(value)
        if number is None or not math.isfinite(number):
            raise ValueError(f"{name}={value}: a condition is a number")
        found[name.strip().lower()] = float(number)
    return found


def _table(source: Any) -> dict[str, np.ndarray]:
    import numpy as np

    if isinstance(source, str) or hasattr(source, "__fspath__"):
        return _of_file(os.fspath(source))
    return {str(k): np.asarray(source[k], float) for k in source}


def _name(source: Any) -> str:
    return os.fspath(source) if isinstance(source, str) or hasattr(source, "__fspath__") else "the data"


def read(source: Any, columns: Mapping[str, str] | None = None, called: str = "") -> Data:
    """From a CSV file, a mapping of names to values, or a pandas DataFrame. `columns` says what signals columns are: {"speed":
    "omega(j1)"}; those with an empty signal are left out. A column sigma(v(out)) has the standard deviations of v(out). Raises
    OSError, ValueError with a sentence."""
    import numpy as np

    if isinstance(source, Data):
        return source
    found, where = _table(source), called or _name(source)
    given = {key.strip().lower(): value.strip().lower() for key, value in (columns or {}).items()}
    if strange := next((key for key in given if key not in [name.lower() for name in found]), None):
        raise ValueError(f"{where} has no column `{strange}`: it has {', '.join(found)}")
    time = next((name for name in found if given.get(name.lower(), name.lower()) in TIMES), None)
    if time is None:
        raise ValueError(f"{where} has no column `time`: it has {', '.join(found)}")
    signals = {n: given.get(n.lower(), n.lower()) for n in found if n != time}
    signals = {n: signal for n, signal in signals.items() if signal}
    told = {signal: n for n, signal in signals.items() if signal.startswith(SIGMA) and signal.endswith(")")}
    signals = {n: signal for n, signal in signals.items() if signal not in told}
    if not signals:
        raise ValueError(f"{where} has no column but the time")
    times = found[time]
    values = np.stack([found[name] for name in signals], axis=1)
    errors = _errors(
        {s[len(SIGMA) : -1].strip(): found[n] for s, n in told.items()}, list(signals.values()), values, where
    )
    if not np.isfinite(times).all():
        raise ValueError(f"{where}: a time is no finite number")
    if np.isinf(values).any():
        raise ValueError(f"{where}: a value is infinite; nan says that nothing was measured")
    order = np.argsort(times, kind="stable")
    return Data(times[order], values[order], list(signals.values()), errors[order])


def _errors(
    given: Mapping[str, np.ndarray], signals: Sequence[str], values: np.ndarray, where: str
) -> np.ndarray:
    """Standard deviations, in the shape of the values. Raises ValueError where a value's is not above zero."""
    import numpy as np

    errors = np.full(values.shape, np.nan)
    for signal, column in given.items():
        if signal not in signals:
            raise ValueError(f"{where} has sigma({signal}), and no column `{signal}`")
        k = signals.index(signal)
        measured = np.isfinite(values[:, k])
        if not (np.isfinite(column[measured]).all() and (column[measured] > 0.0).all()):
            raise ValueError(f"{where}: sigma({signal}) is to be above zero wherever `{signal}` was measured")
        errors[measured, k] = column[measured]
    return errors


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

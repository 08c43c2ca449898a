"""Apache Parquet: one column a signal, float64, through pyarrow (the extra `files`). One file holds one table.

Each column carries its unit as the field's metadata `unit`; title, analysis and the raw file's plot name stand in the
schema's. A complex column is two, re(name) and im(name). Files of other programs are read too: their columns of numbers,
with units where the metadata has them.
"""

from __future__ import annotations

from ..store import paired
from ..table import is_axis, kind_of, plotname_of
from . import missing_package
from .beside import replacing

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from ..outcome import Outcome

KEYS = ("title", "analysis", "plotname", "axis", "steps", "status")


def _pyarrow() -> tuple[Any, Any]:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise missing_package("Parquet files need", "pyarrow", "files") from None
    return pyarrow, pyarrow.parquet


def write(path: str, result: Outcome) -> None:
    """Writes the main table. OSError as open() and write() raise it."""
    pa, pq = _pyarrow()
    table = result.main
    about = dict(
        zip(
            KEYS,
            (
                table.title,
                table.kind,
                table.plotname,
                str(int(table.axis is not None)),
                ",".join(table.steps),
                table.status,
            ),
            strict=True,
        )
    )
    fields, columns = [], []
    for name, unit, numbers in table.flat():
        fields.append(pa.field(name, pa.float64(), nullable=False, metadata={"unit": unit}))
        # the parts of complex numbers lie apart from each other
        buffer = pa.py_buffer(numbers.tobytes())
        columns.append(pa.Array.from_buffers(pa.float64(), len(table), [None, buffer]))
    with replacing(path) as beside:
        pq.write_table(pa.Table.from_arrays(columns, schema=pa.schema(fields, metadata=about)), beside)


def read(path: str) -> Outcome:
    """OSError where the file cannot be opened, ValueError where it is no Parquet file or holds no numbers."""
    from ..outcome import Outcome
    from ..table import Table

    pa, pq = _pyarrow()
    with open(path, "rb") as file:  # pyarrow's own errors name no file
        try:
            found = pq.ParquetFile(file).read()
        except pa.ArrowInvalid as error:
            raise ValueError(f"{path}: {error}") from None
    about = {
        key.decode(): value.decode()
        for key, value in (found.schema.metadata or {}).items()
        if key.decode() in KEYS
    }
    names, units, columns = [], [], []
    for field, column in zip(found.schema, found.columns, strict=True):
        kind = pa.types
        if not (kind.is_floating(field.type) or kind.is_integer(field.type)):
            continue
        # a value that is missing is not a number
        values = column.cast(pa.float64(), safe=False).fill_null(float("nan")).combine_chunks()
        names.append(field.name)
        units.append((field.metadata or {}).get(b"unit", b"").decode())
        columns.append(values.to_numpy().tobytes())
    if not names:
        raise ValueError(f"{path}: no column of numbers")
    axis = about["axis"] == "1" if "axis" in about else is_axis(names[0])
    kind = about.get("analysis", kind_of(names))
    names, units, store = paired(names, units, columns)
    steps = [name for name in about.get("steps", "").split(",") if name]
    table = Table(
        kind, names, units, store, title=about.get("title", ""), axis=axis, steps=steps,
        plotname=about.get("plotname", plotname_of(kind)), status=about.get("status", "ok"),
    )  # fmt: skip
    return Outcome(table.title, [table])

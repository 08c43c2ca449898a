"""NetCDF-4: every table of a result, through h5netcdf (the extra `files`).

The main table stands at the root, where xarray finds it, the others in groups named after their analysis. The
independent column is the coordinate variable of the one dimension, float64 as all of them; each variable carries
`units`, each group `title`, `analysis`, `plotname`. A complex column is two, re(name) and im(name): NetCDF knows no type
for it. A sweep within sweeps lies along `point`, and attributes name its axis and its steps. A name with a slash, which
NetCDF does not allow, is stored with a division slash in its place and in full as the attribute `long_name`.
"""

from __future__ import annotations

from ..store import paired
from ..table import kind_of, plotname_of
from . import missing_package
from .beside import replacing

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from ..outcome import Outcome
    from ..table import Table

SLASH = "\N{DIVISION SLASH}"


def _h5netcdf() -> Any:
    try:
        import h5netcdf
        import h5py  # noqa: F401, h5netcdf's way to files: it no longer requires it by itself
    except ImportError:
        raise missing_package("NetCDF files need", "h5netcdf", "files") from None
    return h5netcdf


def write(path: str, result: Outcome) -> None:
    """Writes every table. OSError where the file cannot be written."""
    h5netcdf = _h5netcdf()
    # the file is there before the library, whose own errors have no errno
    with replacing(path) as beside, h5netcdf.File(beside, "w") as file:
        _write_table(file, result.main, result.plots.index(result.main))
        taken: set[str] = set()
        for k, table in enumerate(result.plots):
            if table is result.main:
                continue
            name, n = table.kind or "table", 2
            while name in taken:
                name, n = f"{table.kind}_{n}", n + 1
            taken.add(name)
            _write_table(file.create_group(name), table, k)


def _write_table(group: Any, table: Table, place: int) -> None:
    alone = table.axis is not None and not table.steps
    dim = table.names[0].replace("/", SLASH) if alone else "point"
    group.dimensions[dim] = len(table)
    group.attrs.update(
        title=table.title,
        analysis=table.kind,
        plotname=table.plotname,
        status=table.status,
        plot_number=place,
        **({"axis": table.names[0], "steps": ",".join(table.steps)} if table.steps else {}),
    )
    for name, unit, numbers in table.flat():
        variable = group.create_variable(name.replace("/", SLASH), (dim,), "f8", data=numbers)
        variable.attrs["units"] = unit
        if "/" in name:
            variable.attrs["long_name"] = name


def read(path: str) -> Outcome:
    """Variables along one dimension, of the root and of the groups under it. OSError, ValueError."""
    from ..outcome import Outcome

    h5netcdf = _h5netcdf()
    with open(path, "rb") as file:
        if file.read(8) != b"\x89HDF\r\n\x1a\n":
            raise ValueError(f"{path}: no NetCDF-4 file")
    try:
        with h5netcdf.File(path, "r", decode_vlen_strings=True) as file:
            found = [t for group in (file, *file.groups.values()) if (t := _read_table(group)) is not None]
    except OSError:
        raise
    except Exception as error:  # of a damaged file the library tells by errors of any kind
        raise ValueError(f"{path}: {str(error) or type(error).__name__}") from None
    if not found:
        raise ValueError(f"{path}: no variables along one dimension")
    tables = [table for _, table in sorted(found, key=lambda pair: pair[0])]
    return Outcome(tables[0].title, tables)


def _read_table(group: Any) -> tuple[int, Table] | None:
    from ..table import Table

    lines = {
        name: v for name, v in group.variables.items() if len(v.dimensions) == 1 and v.dtype.kind in "fiu"
    }
    if not lines:
        return None
    dims = [v.dimensions[0] for v in lines.values()]
    dim = max(dims, key=dims.count)
    kept = [name for name, v in lines.items() if v.dimensions[0] == dim and name != dim]
    about = {key: group.attrs[key] for key in group.attrs}
    axis = dim in lines or "axis" in about
    names = [dim, *kept] if dim in lines else kept
    kind = str(about.get("analysis", kind_of([dim])))
    columns = [lines[name][...].astype("f8").tobytes() for name in names]
    units = [str(lines[name].attrs.get("units", "")) for name in names]
    names = [str(lines[name].attrs["long_name"]) if SLASH in name else name for name in names]
    names, units, store = paired(names, units, columns)
    steps = [name for name in str(about.get("steps", "")).split(",") if name]
    table = Table(
        kind, names, units, store, title=str(about.get("title", "")), axis=axis, steps=steps,
        plotname=str(about.get("plotname", plotname_of(kind))), status=str(about.get("status", "ok")),
    )  # fmt: skip
    return int(about.get("plot_number", 0)), table

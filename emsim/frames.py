"""Tables as pandas and xarray have them."""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    import pandas as pd
    import xarray as xr

    from .table import Table


def pandas(table: Table) -> pd.DataFrame:
    """DataFrame indexed by the independent column; `attrs["units"]` maps name to unit."""
    import pandas as pd

    index = pd.Index(table[table.names[0]], name=table.names[0]) if table.axis else None
    frame = pd.DataFrame({name: table[name] for name in table.signals}, index=index)
    frame.attrs.update(title=table.title, units=dict(zip(table.names, table.units, strict=True)))
    return frame


def xarray(table: Table) -> xr.Dataset:
    """Dataset with the independent column as coordinate; every variable carries `units`."""
    import xarray as xr

    dim = table.names[0] if table.axis else "point"
    unit = dict(zip(table.names, table.units, strict=True))
    if table.steps and (shaped := _by_steps(table, xr)) is not None:
        return shaped
    coords = {dim: (dim, table[dim], {"units": unit[dim]})} if table.axis else {}
    data = {name: (dim, table[name], {"units": unit[name]}) for name in table.signals}
    return xr.Dataset(data, coords=coords, attrs={"title": table.title, "analysis": table.kind})


def _by_steps(table: Table, xr: Any) -> xr.Dataset | None:
    """The Dataset with a dimension for each step, where every block has the same points; None where it has not."""
    import numpy as np

    dims = [*table.steps, table.names[0]]
    levels = [list(dict.fromkeys(table.column(d).tolist())) for d in dims]
    shape = tuple(map(len, levels))
    if len(table) != np.prod(shape):
        return None
    grid = np.meshgrid(*levels, indexing="ij")
    if any((g.ravel() != table.column(d)).any() for g, d in zip(grid, dims, strict=True)):
        return None
    unit = dict(zip(table.names, table.units, strict=True))
    coords = {d: (d, level, {"units": unit[d]}) for d, level in zip(dims, levels, strict=True)}
    rest = [name for name in table.names if name not in dims]
    data = {name: (dims, table.column(name).reshape(shape), {"units": unit[name]}) for name in rest}
    return xr.Dataset(data, coords=coords, attrs={"title": table.title, "analysis": table.kind})

"""`.op`: the operating point, mechanics held where it starts; `.op static` lets everything come to rest."""

from __future__ import annotations

from . import Run, columns
from .failure import explain

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..assemble import Assembly
    from ..deck import Analysis


def run(assembly: Assembly, analysis: Analysis, static: bool, progress: object = None) -> Run:
    """One row: every column at the operating point."""
    names, units, exprs = columns(assembly, "op")
    waves = assembly.system.op(exprs, assembly.options, static)
    trouble = explain(assembly, analysis, waves) if waves.status == "failed" else []
    return Run("op", names, units, waves, False, None, trouble)

"""emsim: a netlist-driven simulator that extends SPICE with machines.

    run(source)      simulate a deck: path or text -> Result
    compile(source)  the deck's equations -> System
    check(source)    the facts of a deck without running it
    Deck(source)     a deck that is read once, altered and run as often as one likes
    env(source)      an environment of Gymnasium: a deck that an agent leads (emsim[gym])
    Session(source)  a run that is led: inputs set, outputs read, from step to step, and put back
    sweep(source)    many runs of a deck -> Swept
    fit(source, data, vary)        values from measured curves -> Fitted
    optimise(source, vary, goals)  values from goals of .meas -> Optimised
    jax.function, torch.function   a deck's measures as a function that JAX or PyTorch differentiates
    Result, Table, System, DeckError, ConvergenceError, OutsideError, Interrupted

Importing emsim costs nothing: each name is loaded when it is first used.
"""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .alterable import Deck
    from .diagnostics import ConvergenceError, DeckError, Interrupted, OutsideError
    from .environments import env
    from .fits import fit, optimise
    from .fmus.session import Session
    from .pipeline import check, compile, run
    from .result import Result
    from .sweeps import sweep
    from .system import System
    from .table import Table

__all__ = [
    "ConvergenceError", "Deck", "DeckError", "Interrupted", "OutsideError", "Result", "Session", "System", "Table", "check",
    "compile", "env", "fit", "optimise", "run", "sweep",
]  # fmt: skip

_HOMES = {
    "run": "pipeline", "sweep": "sweeps", "fit": "fits", "optimise": "fits", "compile": "pipeline", "check": "pipeline",
    "Deck": "alterable", "Result": "result", "Table": "table", "System": "system",
    "DeckError": "diagnostics", "ConvergenceError": "diagnostics", "OutsideError": "diagnostics",
    "Interrupted": "diagnostics", "Session": "fmus.session", "env": "environments",
}  # fmt: skip


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from ._engine import __version__

        return __version__
    if name in ("jax", "torch"):  # emsim.jax.function: what they bridge to is imported by that
        from importlib import import_module

        return import_module("." + name, "emsim")
    home = _HOMES.get(name)
    if home is None:
        raise AttributeError(f"module 'emsim' has no attribute {name!r}")
    from importlib import import_module

    value = getattr(import_module("." + home, "emsim"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return [*__all__, "__version__"]

"""What `emsim fit` and `emsim optimise` share: options, progress, lines of values."""

from __future__ import annotations

from ..diagnostics import Diagnostic
from .arguments import HELP, JSON, METHOD, QUIET, Arguments, Option, UsageError, defines, overrides
from .console import Line

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import Any

    from ..fits.fitted import Fitted
    from ..fits.optimised import Optimised
    from ..fits.quantities import Quantity

VARY = Option(
    "-p --parameter",
    "what is to be found: NAME, NAME=low..high, NAME=low..high:start; a parameter, element, model(word) or card(word)",
    "NAME",
    repeat=True,
)
SHARED = [
    Option("--everywhere", "first look all over the bounds, by differential evolution"),
    Option("--seed", "of that search, 1", "N"),
    Option("-j --jobs", "its processes, instead of one a core", "N"),
    Option("-D --define", "a parameter of the deck that stays", "NAME=VALUE", repeat=True),
    METHOD,
    Option("--reltol", "relative tolerance of the runs, 1e-6", "X"),
    JSON,
    QUIET,
    HELP,
]


def asked(given: Arguments) -> list[Quantity]:
    from ..fits.quantities import read

    if not given.all("parameter"):
        raise UsageError("name what is to be found: -p NAME or -p NAME=low..high")
    try:
        return read(given.all("parameter"))
    except ValueError as error:
        raise UsageError(str(error)) from None


def shared(given: Arguments) -> dict[str, Any]:
    """Arguments of `emsim.fit` and `emsim.optimise`."""
    return {
        "defines": defines(given), "options": overrides(given, ["reltol"]),
        "everywhere": given.has("everywhere"), "seed": given.whole("seed", 1), "jobs": given.whole("jobs", None),
    }  # fmt: skip


def unsure(found: Fitted | Optimised, missed: bool = False) -> Iterator[Diagnostic]:
    """A search that did not stand still, which goals that were `missed` say already; values at a bound."""
    if not found.converged and not missed:
        said = f"the search ended after {found.runs} runs, before it stood still"
        yield Diagnostic("warning", "W433", said, None, "other start values, or --everywhere")
    if found.at_bounds:
        names = ", ".join(f"`{name}` = {found.values[name]:.6g}" for name in found.at_bounds)
        yield Diagnostic("warning", "W432", f"at a bound: {names}", None, "wider bounds, or another model")


class Heard(Line):
    """How far a search is."""

    def __call__(self, runs: int, left: float) -> None:
        self.write(f"{runs} runs, {left:.4g} left")

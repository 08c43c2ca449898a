"""What `emsim fit` and `emsim optimise` share: options, progress, lines of values."""

from __future__ import annotations

from .arguments import HELP, JSON, QUIET, Arguments, Option, UsageError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

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
    Option("--method", "integration method", "NAME"),
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
    defines: dict[str, str] = {}
    for text in given.all("define"):
        name, equals, value = text.partition("=")
        if not equals or not name.strip() or not value.strip():
            raise UsageError(f"-D {text}: write NAME=VALUE")
        defines[name.strip()] = value.strip()
    options: dict[str, Any] = {}
    if (method := given.text("method")) is not None:
        options["method"] = method
    if (reltol := given.number("reltol")) is not None:
        options["reltol"] = reltol
    return {
        "defines": defines, "options": options, "everywhere": given.has("everywhere"), "seed": whole(given, "seed", 1) or 1,
        "jobs": whole(given, "jobs", None),
    }  # fmt: skip


def whole(given: Arguments, key: str, default: int | None) -> int | None:
    value = given.number(key)
    if value is None:
        return default
    if value != int(value):
        raise UsageError(f"--{key} takes a whole number")
    return int(value)


class Heard:
    """How far a search is, on a terminal's stderr."""

    def __init__(self, quiet: bool) -> None:
        import sys

        self.on = not quiet and sys.stderr is not None and sys.stderr.isatty()

    def __call__(self, runs: int, left: float) -> None:
        import sys

        if self.on:
            sys.stderr.write(f"\r\x1b[K{runs} runs, {left:.4g} left")
            sys.stderr.flush()

    def end(self) -> None:
        import sys

        if self.on:
            sys.stderr.write("\r\x1b[K")
            sys.stderr.flush()

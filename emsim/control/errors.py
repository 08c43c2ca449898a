"""What goes wrong in a command, and how commands end early."""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import NoReturn

    from ..diagnostics import Span


class CommandError(Exception):
    """A command that cannot be carried out; the session makes a diagnostic of it, with the place of the command."""

    def __init__(self, code: str, message: str, hint: str | None = None, span: Span | None = None) -> None:
        super().__init__(message)
        self.code, self.message, self.hint, self.span = code, message, hint, span


class Followed(CommandError):
    """What follows from an error that was told: a vector of a plot whose analysis failed."""


class Stop(Exception):
    """The section ends: quit, an interrupted run, or a limit."""


class Jump(Exception):
    """break, continue (through so many loops), goto."""

    def __init__(self, kind: str, count: int = 1, label: str = "") -> None:
        super().__init__(kind)
        self.kind, self.count, self.label = kind, count, label


def usage(form: str, said: str) -> NoReturn:
    """E161: what stands behind the command's word does not fit."""
    raise CommandError("E161", said, f"form: {form}")

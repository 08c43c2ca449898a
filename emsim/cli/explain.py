"""usage: emsim explain [options] WHAT

Explains a diagnostic by its code, E203, with a deck that gives it, the message, and the deck mended; or an exit code by
its number."""

from __future__ import annotations

from typing import NamedTuple

from ..diagnostics import suggest
from .arguments import HELP, JSON, Option, UsageError, parse
from .console import OK, print_json, print_lines

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from typing import NoReturn

    from ..reports.codes import Entry
    from .arguments import Arguments

OPTIONS: list[Option] = [
    Option("--list", "all codes with their titles"),
    JSON,
    HELP,
]


class Form(NamedTuple):
    """One kind of WHAT. `fits` says whether an argument is of it, `tell` explains the argument and returns an exit
    code; the first form that fits has it."""

    shape: str
    fits: Callable[[str], bool]
    tell: Callable[[str, Arguments], int]


def main(args: Sequence[str]) -> int:
    given = parse(args, OPTIONS)
    if given.has("list") and not given.words:
        return tell_all(given)
    if len(given.words) != 1:
        raise UsageError(f"emsim explain takes one of {', '.join(form.shape for form in FORMS)}")
    what = given.words[0]
    for form in FORMS:
        if form.fits(what):
            return form.tell(what, given)
    unknown(what)


def unknown(what: str) -> NoReturn:
    """An argument of no form, or of a form but without an entry."""
    from ..reports.codes import catalogue

    known = catalogue()
    # the beginning of a code says more than a code that is off by a digit
    near = ", ".join(code for code in known if code.startswith(what.upper())) or suggest(what, known)
    shapes = ", ".join(form.shape for form in FORMS)
    hint = f"did you mean {near}?" if near else f"emsim explain takes {shapes}; emsim explain --list"
    raise UsageError(f"there is nothing to explain of the name {what}; {hint}")


# ---- messages and exit codes --------------------------------------------------------------------


def is_code(what: str) -> bool:
    """E203, w402, e203]: a letter and three digits."""
    return len(what) == 4 and what[0] in "EWNewn" and what[1:].isdigit()


def tell_code(what: str, given: Arguments) -> int:
    """A diagnostic or an exit code, from the catalogue."""
    from ..reports.codes import catalogue

    entry = catalogue().get(f"exit {int(what)}" if what.isdigit() else what.upper())
    if entry is None:
        unknown(what)
    said = message(entry)
    if given.has("json"):
        print_json(OK, [], entry={**entry._asdict(), "message": said})
    else:
        print_lines(text_of(entry, said))
    return OK


def tell_all(given: Arguments) -> int:
    """Every code with its title, by family."""
    from ..reports.codes import catalogue

    known = catalogue().values()
    if given.has("json"):
        print_json(OK, [], codes=[{"code": e.code, "title": e.title, "family": e.family} for e in known])
        return OK
    families = dict.fromkeys(entry.family for entry in known)
    lines: list[str] = []
    for family in families:
        lines += ["", family, *(f"  {e.code:<9}{e.title}" for e in known if e.family == family)]
    print_lines(lines[1:])
    return OK


def text_of(entry: Entry, said: str) -> Iterator[str]:
    """An entry for the terminal."""
    yield f"{entry.code}: {entry.title}"
    yield ""
    yield entry.meaning
    if entry.command:
        yield from _files(entry.example)
        yield ""
        yield from (f"    $ {line}" for line in entry.command.splitlines())
        for line in said.split("\n"):
            yield "    " + line if line else ""
    if entry.remedy:
        yield from ("", entry.remedy)
    yield from _files(entry.fixed, ", mended")


def _files(files: dict[str, str], more: str = "") -> Iterator[str]:
    for name, text in files.items():
        yield from ("", f"  {name}{more}", "")
        for number, line in enumerate(text.rstrip("\n").split("\n"), 1):
            yield f"    {number:>3} | {line}"


def message(entry: Entry) -> str:
    """What the entry's example says of its code, as a terminal shows it; for an exit code all that it says."""
    if not entry.command:
        return ""
    _, said = perform(entry.command, entry.example)
    own = [text for code, text in blocks(said) if code == entry.code]
    return "\n\n".join(own) or said.rstrip("\n")


def blocks(said: str) -> Iterator[tuple[str, str]]:
    """(code, text) of every diagnostic among what stood on stderr."""
    import re

    for found in re.finditer(r"^(?:error|warning|note)\[(\w+)\](?:.+\n?)+", said, re.M):
        yield found[1], found[0].rstrip("\n")


def perform(commands: str, files: dict[str, str]) -> tuple[int, str]:
    """Runs command lines of emsim, one after the other, in a new folder that holds the files; the last one's exit code and
    what stood on stderr. `NAME=value` before a command is set in its environment."""
    import os
    import shlex
    import tempfile

    code, said, back = OK, "", os.getcwd()
    with tempfile.TemporaryDirectory() as folder:
        for name, text in files.items():
            with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
                file.write(text)
        os.chdir(folder)
        try:
            for line in commands.splitlines():
                code, errors = _command(shlex.split(line))
                said += errors
        finally:
            os.chdir(back)
    return code, said


def _command(words: list[str]) -> tuple[int, str]:
    import io
    import os
    from contextlib import redirect_stderr, redirect_stdout

    from . import main as emsim

    start, errors, kept = words.index("emsim"), io.StringIO(), dict(os.environ)
    for word in words[:start]:
        name, _, value = word.partition("=")
        os.environ[name] = value
    try:
        with redirect_stdout(io.StringIO()), redirect_stderr(errors):
            return emsim(words[start + 1 :]), errors.getvalue()
    finally:
        os.environ.clear()
        os.environ.update(kept)


# what may be explained: the first form that fits an argument has it
FORMS = (
    Form("CODE", is_code, tell_code),
    Form("EXIT CODE", str.isdigit, tell_code),
)

"""usage: emsim explain [options] WHAT

Explains a deck: its equations with the cards that the terms come from, energies, degrees of freedom, index, what folded
away; as LaTeX with --latex. deck.cir:12 says how that line was read and what it contributes. MOTOR, R, .tran, PULSE, omega,
reltol, radau: what a word of the language means. cards, elements, joints, dots, waveforms, probes, functions, options, methods:
lists of them. E203: a diagnostic, with a deck that gives it, the message, and the deck mended; 3: an exit code."""

from __future__ import annotations

from os.path import exists
from typing import NamedTuple

from ..diagnostics import suggest
from .arguments import DEFINE, HELP, JSON, QUIET, Option, UsageError, defines, parse
from .console import OK, print_json, print_lines, show

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from typing import NoReturn

    from ..reports.codes import Entry
    from .arguments import Arguments

OPTIONS: list[Option] = [
    Option("--latex", "the equations of a deck as a LaTeX document"),
    Option("--list", "all codes with their titles"),
    DEFINE,
    JSON,
    QUIET,
    HELP,
]


WIDTH = 100  # of running text
DECKS = (".cir", ".sp", ".net", ".ckt", ".spice", ".cki")


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
    from ..editor import meanings
    from ..reports.codes import catalogue

    known = catalogue()
    # the beginning of a code says more than a code that is off by a digit
    near = ", ".join(code for code in known if code.startswith(what.upper())) or suggest(
        what, [*known, *meanings.known()]
    )
    shapes = ", ".join(form.shape for form in FORMS)
    hint = f"did you mean {near}?" if near else f"emsim explain takes {shapes}; emsim explain --list"
    raise UsageError(f"there is nothing to explain of the name {what}; {hint}")


# ---- messages and exit codes --------------------------------------------------------------------


def is_code(what: str) -> bool:
    """E203, w402: a letter and three digits."""
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
    yield from _wrapped(entry.meaning)
    if entry.command:
        yield from _files(entry.example)
        yield ""
        yield from (f"    $ {line}" for line in entry.command.splitlines())
        for line in said.split("\n"):
            yield "    " + line if line else ""
    yield ""
    yield from _wrapped(entry.remedy)
    yield from _files(entry.fixed, ", mended")
    if entry.fixed_command != entry.command:
        yield ""
        yield from (f"    $ {line}" for line in entry.fixed_command.splitlines())


def _wrapped(text: str) -> Iterator[str]:
    """Paragraphs and lists in lines of one width."""
    import re
    import textwrap

    for k, part in enumerate(text.split("\n\n")):
        if k:
            yield ""
        for item in re.split(r"\n(?=- )", part):
            yield from textwrap.wrap(
                " ".join(item.split()), WIDTH, subsequent_indent="  " if item.startswith("- ") else ""
            )


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


# ---- decks, lines, cards -------------------------------------------------------------------------


def is_deck(what: str) -> bool:
    """A file that is there, or a name that can only be one."""
    return what == "-" or exists(what) or "/" in what or what.lower().endswith(DECKS)


def is_line(what: str) -> bool:
    """deck.cir:12"""
    path, colon, number = what.rpartition(":")
    return bool(colon) and number.isdigit() and is_deck(path) and not exists(what)


def is_word(what: str) -> bool:
    """MOTOR, R, .tran, PULSE, omega, reltol, methods"""
    from ..editor import meanings

    return bool(meanings.lines(what))


def tell_deck(what: str, given: Arguments) -> int:
    """The equations."""
    from .. import pipeline
    from ..reports import explained
    from .run import source_of

    x = pipeline.explain(source_of(what), defines(given))
    diagnostics = x.ctx.sink.diagnostics
    show(diagnostics, given.has("quiet"))
    if given.has("json"):
        print_json(OK, diagnostics, equations=explained.data(x))
    else:
        print_lines(explained.latex(x) if given.has("latex") else explained.page(x))
    return OK


def tell_line(what: str, given: Arguments) -> int:
    """How a line was read. Where the deck is wrong, its tree is shown before that is said."""
    from .. import pipeline
    from ..diagnostics import DeckError
    from ..reports import reading
    from ..reports.equations import Explained

    path, _, number = what.rpartition(":")
    try:
        where = reading.place(path, int(number))
    except ValueError as error:
        raise UsageError(str(error)) from None
    lines = [*where.text(), ""]
    if where.said:
        lines.append(f"  {where.said}")
    if where.tree is not None:
        lines += ["Tree", *reading.tree_lines(where.tree), ""]
    cards: list[str] = []
    brought: list[str] = []
    trouble: DeckError | None = None
    try:
        flat = pipeline.read(path, defines(given))
        assembly, _ = pipeline.prepare(flat, energy=True, recording=True)
        on = reading.cards_on(where, flat)
        for card in on:
            cards += reading.described(card, assembly)
        if names := reading.names_of(on):
            brought = list(reading.contributions(Explained(assembly, only=names), names))
    except DeckError as error:
        trouble = error
    lines += ["Card", *(f"  {line}" for line in cards), ""] if cards else []
    lines += ["Contributes", *brought] if brought else []
    if given.has("json") and trouble is None:
        print_json(
            OK,
            [],
            line={
                "place": what,
                "said": where.said,
                "tree": where.tree,
                "card": cards,
                "contributes": brought,
            },
        )
    elif not given.has("json"):
        print_lines(lines if lines[-1] else lines[:-1])
    if trouble is not None:
        raise trouble
    return OK


def tell_word(what: str, given: Arguments) -> int:
    """What a word of the language means."""
    from ..editor import meanings
    from ..editor.words import DOTS
    from ..reports import words

    if not given.has("json"):
        print_lines(meanings.lines(what))
    elif words.is_word(what):
        print_json(OK, [], card=words.facts(what))
    elif what.lower() in DOTS:
        form, meaning = DOTS[what.lower()]
        print_json(OK, [], card={"word": what.lower(), "form": form, "meaning": meaning})
    else:
        print_json(OK, [], word=what.lower(), lines=meanings.lines(what))
    return OK


# what may be explained: the first form that fits an argument has it
FORMS = (
    Form("CODE", is_code, tell_code),
    Form("EXIT CODE", str.isdigit, tell_code),
    Form("DECK:LINE", is_line, tell_line),
    Form("WORD", is_word, tell_word),
    Form("DECK", is_deck, tell_deck),
)

"""usage: emsim models [list]               what was added
       emsim models add FILE.va ...       add the modules of public texts in Verilog-A
       emsim models remove NAME ...       forget them

A public compact model (PSP, HICUM, BSIM-BULK, ...) is added once: its text is read, put into a circuit and copied beside your
other models. From then on any deck finds it by `level=` as ngspice, Xyce and HSPICE number it, or by the name of its module as
the type of a .model, without `.hdl`; a note of the run says which file it took. --level gives a number by hand.

The folder is $EMSIM_MODELS, otherwise emsim/models in $XDG_DATA_HOME (~/.local/share)."""

from __future__ import annotations

import os
import shutil
import sys
from hashlib import sha256

from ..diagnostics import Diagnostic, OutsideError, deck_error, suggest
from ..elements import LETTERS, added, public
from .arguments import HELP, QUIET, Option, UsageError, parse
from .console import OK

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..elements.added import Added
    from ..elements.compiled import Compiled
    from ..elements.modules import Module

ACTIONS = ("list", "add", "remove")
BY_MODEL = "qmjzd"  # letters whose lines take a model by its level
OPTIONS = [
    Option("--level", "add: the level by which it is found, in place of those of the simulators", "N"),
    Option("--of", "add: the letter of the lines that have this level: q m j z d", "LETTER"),
    QUIET, HELP,
]  # fmt: skip


def main(args: Sequence[str]) -> int:
    given = parse(args, OPTIONS)
    action, *words = given.words or ["list"]
    level, letter = given.whole("level", None), (given.text("of") or "").lower()
    if action not in ACTIONS:
        near = suggest(action, ACTIONS)
        hint = f", did you mean {near}?" if near else "; there is " + ", ".join(ACTIONS)
        raise UsageError(f"emsim models does not know {action!r}{hint}")
    if letter and (letter not in BY_MODEL or len(letter) != 1):
        raise UsageError(f"--of {letter}: one of {' '.join(BY_MODEL)}")
    if bool(words) == (action == "list"):
        raise UsageError(f"emsim models {action} takes {'no words' if words else 'a name or more'}")
    if action == "list":
        return _list()
    for word in words:
        if action == "remove":
            _remove(word, given.has("quiet"))
        else:
            _add(word, level, letter, given.has("quiet"))
    return OK


# ---- list ----


def _list() -> int:
    entries = added.all_of_them()
    if not entries:
        print(f"no models in {added.folder()}; emsim models add FILE.va adds one", file=sys.stderr)
    for entry in entries:
        print(_row(entry))
    return OK


def _row(entry: Added) -> str:
    levels = (
        f"{entry.letter.upper()} level {', '.join(map(str, entry.levels))}" if entry.levels else "by its name"
    )
    return f"{entry.module:<16} {levels:<28} {entry.title or '':<26} {entry.where()}".rstrip()


# ---- remove ----


def _remove(name: str, quiet: bool) -> None:
    entries = {entry.module.lower(): entry for entry in added.all_of_them()}
    entry = entries.get(name.lower())
    if entry is None:
        near = suggest(name.lower(), entries)
        there = ", ".join(entries) or "none"
        raise UsageError(
            f"no model {name!r} was added" + (f", did you mean {near}?" if near else f"; there is {there}")
        )
    try:
        shutil.rmtree(os.path.join(added.folder(), entry.module.lower()))
    except OSError as error:
        raise _unwritten(error) from None
    if not quiet:
        print(f"{entry.module} removed")


def _unwritten(error: OSError) -> OutsideError:
    said = f"cannot write below {added.folder()}: {error.strerror or error}"
    return OutsideError(Diagnostic("error", "E503", said, None, "EMSIM_MODELS names another folder"))


# ---- add ----


def _add(path: str, level: int | None, letter: str, quiet: bool) -> None:
    """Every module of a text that can be put into a circuit. Raises DeckError where there is none."""
    faults, good = [], 0
    for module in _read(path):
        model = public.of_module(module.name)
        if level is not None and not letter and model is None:
            raise UsageError(
                f"--level {level}: of which lines? `{module.name}` is no model known by name; --of m"
            )
        if not module.name.isidentifier():  # it names a folder
            faults.append(f"`{module.name}`: the name of a module that is added is a plain word")
            continue
        try:
            made, text = added.copied(module, path)
        except OSError as error:
            raise _unwritten(error) from None
        try:
            usual = LETTERS[model.letter].usual if model and LETTERS[model.letter].usual else None
            if said := _fault(text, module, usual):
                faults.append(f"`{module.name}`: {said}")
                continue
            _keep(made, text, module, level, letter or (model.letter if model else ""), quiet)
            good += 1
        finally:
            shutil.rmtree(made, ignore_errors=True)
    if not good:
        deck_error("E159", f"{path} was not added: {'; '.join(faults) or 'there is no module in it'}", None)
    for said in faults:
        print(f"warning: {said}: not added", file=sys.stderr)


def _read(path: str) -> list[Module]:
    from ..elements.modules import ModuleError, read, where

    try:
        return read(path)
    except OSError as error:
        said = f"cannot read {path}: {error.strerror or error}"
        raise OutsideError(Diagnostic("error", "E501", said)) from None
    except ModuleError as trouble:
        first = trouble.messages[0]
        deck_error("E154", first["text"] + where(first), None, first["hint"] or None)


def _fault(path: str, module: Module, usual: int | None) -> str:
    """Why a module cannot be put into a circuit; "" where it can: with all its terminals, or with the usual ones of its letter
    (a text may ask for the rest by a parameter). They hang on 1 kOhm each, at rest."""
    from ..diagnostics import ConvergenceError, DeckError
    from ..pipeline import run

    said = ""
    for count in dict.fromkeys((len(module.terminals), min(usual or 1_000, len(module.terminals)))):
        nodes = [f"n{k}" for k in range(count)]
        lines = [f'.hdl "{path}"', f"N1 {' '.join(nodes)} device", f".model device {module.name}"]
        lines += [f"R{node} {node} 0 1k" for node in nodes]
        try:
            run("\n".join(["a module by itself", *lines, ".op", ".end", ""]))
            return ""
        except DeckError as error:
            told = [d.message for d in error.diagnostics if d.severity == "error"]
            said = "; ".join(line.partition("`device`: ")[2] or line for line in told)
        except ConvergenceError:
            said = "at rest, with default parameters, it has no operating point"
    return said


def _keep(made: str, text: str, module: Module, level: int | None, letter: str, quiet: bool) -> None:
    """Gives a module its place, and tells how decks find it."""
    model = public.of_module(module.name)
    wanted = [level] if level is not None else model.numbers() if model else []
    kind = _kind(letter) if letter else None
    levels, said = added.free_levels(module.name, letter, wanted, kind.levels if kind else {})
    entry = added.Added(
        module.name, text, letter, levels, model.title if model else "", _digest(module, text)
    )
    try:
        added.keep(made, entry)
    except OSError as error:
        raise _unwritten(error) from None
    if quiet:
        return
    print(_row(entry))
    if kind and levels:
        print(
            f"  {letter.upper()} lines: .model NAME {' | '.join(_types(module, kind))} (level={levels[0]} ..)"
        )
    if added.is_built_in(module.name):
        said.append(f"a module {module.name} is built in, which its name means; .hdl goes before it")
    else:
        print(f"  N lines: .model NAME {module.name} (..)")
    for number in levels:
        others = [p for p in public.of_level(letter, number) if p is not model]
        if others:
            here = f" ({model.where(number)})" if model and model.where(number) else ""
            said.append(
                f"level {number} is {module.name}{here} from now on, and elsewhere {public.told(others, number)}"
            )
    for line in said:
        print(f"  {line}")


def _kind(letter: str) -> type[Compiled]:
    """The class of a letter's lines that take a module by level."""
    if letter == "d":
        from ..elements.diodes import PublicDiode

        return PublicDiode
    from ..elements.compiled import Compiled

    found = LETTERS[letter]
    assert issubclass(found, Compiled)
    return found


def _types(module: Module, kind: type[Compiled]) -> list[str]:
    """The words of .model that take a level and that the module can be told: without a type it is of one kind."""
    told = {"type", "devtype"} & module.parameters.keys()
    by_level = [word for word, (name, _) in kind.sorts.items() if name in kind.levels.values()]
    return [word for word in by_level if told or not word.startswith("p")]


def _digest(module: Module, path: str) -> str:
    """Of all its files: twelve digits of their SHA-256."""
    sums = sha256()
    for part in added.files_of(module, path):
        with open(part, "rb") as file:
            sums.update(file.read())
    return sums.hexdigest()[:12]

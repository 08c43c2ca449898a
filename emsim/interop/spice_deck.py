"""The deck that goes to ngspice: written out by us, in one piece, with nothing in it that ngspice would do but simulate.

A foreign deck can make ngspice run programs: by .control sections, its own or those of its includes, by comments that begin
with `*#`, by a title `*ng_script`, by code models that start a process or load a library (letter A: those that emsim has go,
none that reads a file). So nothing is passed on but cards of a list: elements and dot cards that describe a circuit and what to
compute. Included files and library sections stand in the place of their cards, as emsim reads files; ngspice reads none.
"""

from __future__ import annotations

import os
import re

from ..elaborate.files import MAX_DEPTH
from ..elements.xspice import NAMES
from ..source import MOST_BYTES, decode, read_bytes

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator

ELEMENTS = frozenset("bcdefghijklmopqrstuvwxyz")  # not N, compiled libraries
FROM_FILES = frozenset(("d_source", "d_state", "table2d", "table3d"))  # code models that read files
CODE_MODELS = frozenset(NAMES) - FROM_FILES
CARDS = frozenset(
    ".tran .op .dc .ac .noise .tf .pz .sens .disto .pss .sp .model .subckt .ends .macro .eom .param .params "
    ".parameter .func .global .if .elseif .else .endif .ic .nodeset .temp .options .option .opt .save".split()
)
INCLUDES = (".include", ".inc", ".incl")
OPTION_WORDS = (".option", ".options", ".opt")
# what .options may set: of other words ngspice makes variables of its commands
OPTIONS = frozenset(
    "abstol absv acct autostop badmos3 chgtol cshunt defad defas defl defw gmin gminsteps gshunt interp itl1 itl2 itl3 itl4 itl5 "
    "itl6 keepopinfo maxord maxevtiter maxopalter method minbreak noacct noinit nomod noopiter nopage norefvalue numdgt "
    "opts pivrel pivtol ramptime reltol rshunt savecurrents scale seed sparse klu "
    "srcsteps temp tnom trtol trytocompact vntol warn xmu".split()
)
MOST_CARDS = 5_000_000

Card = list[str]  # the physical lines of a card, without comments


def flattened(text: str, folder: str) -> tuple[str, list[Card], list[Card]]:
    """Title, cards, and the lines of the deck's own .control sections; `folder` is where its relative paths start."""
    title, _, rest = text.partition("\n")
    out: list[Card] = []
    control: list[Card] = []
    _collect(rest, folder, (), out, control)
    models = code_models(out)
    out = [card for card in out if passes(card, models) or first_word(card) in OPTION_WORDS]
    return "emsim: " + _printable(title).strip(), out, control


def elements_left_out(text: str, folder: str) -> list[str]:
    """Names of elements that ngspice may not have: without them its results would be those of another circuit."""
    out: list[Card] = []
    _collect(text.partition("\n")[2], folder, (), out, [])
    models = code_models(out)
    return [word for card in out if (word := first_word(card))[:1].isalpha() and not passes(card, models)]


def code_models(deck: list[Card]) -> frozenset[str]:
    """Names of models each of which is a code model that only computes."""
    kinds: dict[str, set[str]] = {}
    for card in deck:
        words = _joined(card).lower().replace("(", " ").split()
        if words[:1] == [".model"] and len(words) > 2:
            kinds.setdefault(words[1], set()).add(words[2])
    if any(kind & FROM_FILES for kind in kinds.values()):
        raise OSError("a code model reads a file, which is not handed on to ngspice")
    return frozenset(name for name, of in kinds.items() if of <= CODE_MODELS)


def _joined(card: Card) -> str:
    return " ".join(line.lstrip().lstrip("+") for line in card)


def passes(card: Card, models: frozenset[str]) -> bool:
    """Is it a card that ngspice may have, with these code models?"""
    word = first_word(card)
    if word[:1] == "a":
        text = _joined(card)
        return not re.search(r"[;$`{}'\"]|//", text) and text.split()[-1].lower() in models
    return word in CARDS if word.startswith(".") else word[:1] in ELEMENTS


def first_word(card: Card) -> str:
    words = card[0].split(None, 1)
    return words[0].lower() if words else ""


def _collect(text: str, folder: str, chain: tuple[str, ...], out: list[Card], control: list[Card]) -> None:
    inside = ended = section = False
    for card in cards(text):
        word = first_word(card)
        if section:
            section = word != ".endl"
        elif word == ".control":
            inside = True
        elif word == ".endc":
            inside = False
        elif inside:
            if not chain:
                control.append(card)
        elif ended or word == ".end":
            ended = True
        elif word == ".lib" and not _section(card):
            section = True  # for those who name it
        elif word in INCLUDES or word == ".lib":
            for found, where, link in _files(card, folder, chain):
                _collect(found, where, (*chain, link), out, control)
        elif word in OPTION_WORDS:
            out.append(_options(card))
        else:
            if len(out) >= MOST_CARDS:
                raise OSError(f"more than {MOST_CARDS:,} cards")
            out.append([only_signals(line) if word == ".save" else line for line in card])


def cards(text: str) -> Iterator[Card]:
    """Physical lines grouped with the `+` lines that follow, comments and blank lines left out."""
    group: Card = []
    for raw in text.split("\n"):
        line = _printable(raw).rstrip()
        start = line.lstrip()[:1]
        if start in ("", "*", "#"):
            continue
        if start == "+":
            if group:
                group.append(line)
            continue
        if group:
            yield group
        group = [line]
    if group:
        yield group


def _printable(line: str) -> str:
    return "".join(c if c.isprintable() else " " for c in line)


def _section(card: Card) -> str:
    """The section that `.lib file section` names; "" for the head of one, `.lib section`."""
    found = re.match(r"""\s*\.\w+\s+("[^"]*"|'[^']*'|\S+)\s+([^\s;$]+)""", " ".join(card))
    return found[2].lower() if found else ""


def _files(card: Card, folder: str, chain: tuple[str, ...]) -> Iterator[tuple[str, str, str]]:
    """(text, its folder, its name) of what an include stands for; nothing where there is no such file."""
    found = re.match(r"""\s*\.\w+\s+("[^"]*"|'[^']*'|\S+)""", card[0])
    if not found:
        return
    path = os.path.join(folder, os.path.expanduser(found[1].strip("\"'")))
    link = os.path.realpath(path) + "\0" + (_section(card) if first_word(card) == ".lib" else "")
    if link in chain or len(chain) >= MAX_DEPTH:
        return
    try:
        text = decode(read_bytes(path, regular=True)) or ""
    except OSError:
        return
    if len(text) > MOST_BYTES:
        return
    if first_word(card) == ".lib":
        text = _between(text, _section(card))
    yield text, os.path.dirname(path), link


def _between(text: str, section: str) -> str:
    """The lines of a library between `.lib section` and `.endl`."""
    kept, inside = [], False
    for line in text.split("\n"):
        words = line.lower().split()
        if words[:1] == [".lib"] and len(words) == 2:
            inside = words[1].strip("\"'") == section
        elif words[:1] == [".endl"]:
            inside = False
        elif inside:
            kept.append(line)
    return "\n".join(kept)


def _options(card: Card) -> Card:
    """The options of a card that are a simulator's."""
    text = re.sub(r"\s*=\s*", "=", " ".join(line.lstrip().lstrip("+") for line in card))
    words = re.split(r"[;$]", text)[0].split()[1:]
    return [" ".join([".options", *(w for w in words if w.split("=")[0].lower() in OPTIONS)])]


def only_signals(line: str) -> str:
    """Signals and nothing else."""
    return re.sub(r"[^\w\s.()\[\]@#,:+*/-]", " ", line)

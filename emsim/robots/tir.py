"""Tyre property files (.tir) of PAC2002, the Magic Formula of 2002: their coefficients as a .model for TYRE.

Sections in brackets, `KEY = value`, comments behind $ and !. Coefficients of camber and of the tyre's moments are named in a
comment: TYRE computes neither. A file of another formula (MF 6.1 with its pressures, for one) has other meanings under the same
names, and is refused.
"""

from __future__ import annotations

import re
from os.path import basename, splitext

from ..diagnostics import DeckError, Diagnostic
from .xml import number_of

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Collection

    from ..diagnostics import Sink, Span
    from ..source import SourceFile

UNITS = {"length": ("meter",), "force": ("newton",), "angle": ("radians", "radian"), "time": ("second",)}
FORMATS = ("pac2002", "mf_05")  # PROPERTY_FILE_FORMAT
TYPES = ("5", "6", "21")  # FITTYP of MF-Tyre 5.x and PAC2002
RENAMED = {"unloaded_radius": "r0"}


def model(file: SourceFile, known: Collection[str], sink: Sink) -> str:
    """The .model, with comments. `known`: the coefficients that TYRE takes. Mistakes go to the sink."""
    values, places = _entries(file, sink)
    for key, words in UNITS.items():
        if (said := values.get(key, words[0]).strip("'\"").lower()) not in words:
            sink.error("E532", f"the unit of {key} is {said!r}; {words[0]} is read", places[key])
    form, fit = values.get("property_file_format", "PAC2002").strip("'\"").lower(), values.get("fittyp", "6")
    if form not in FORMATS or fit not in TYPES:
        at = places["property_file_format" if form not in FORMATS else "fittyp"]
        said = f"this file is of another formula ({form}, FITTYP {fit}); that of PAC2002 is read"
        sink.error("E532", said, at)
    taken, left = {}, []
    for key, text in values.items():
        name, value = RENAMED.get(key, key), number_of(text)
        if name in known:
            if value is None:
                sink.error("E533", f"{key.upper()} is {text!r}, which is no number", places[key])
            else:
                taken[name] = value
        elif re.fullmatch(r"[pqrsl][a-z]{2,4}\d*", key) and value:
            left.append(key.upper())
    if "fnomin" not in taken:
        said = f"{file.name} has no FNOMIN: it is no tyre of PAC2002"
        raise DeckError(Diagnostic("error", "E530", said, file.span(0, 1)))
    name = re.sub(r"\W", "_", splitext(basename(file.name))[0], flags=re.ASCII)
    lines = [f"* Tyre of {file.name}: .model for TYRE name P Q joint r= fz= model={name}"]
    if left:
        lines += _folded("* not read, of camber, moments and others: ", left, "*   ")
    lines += _folded(f".model {name} tyre ", [f"{k}={v:.15g}" for k, v in taken.items()], "+ ")
    return "\n".join(lines) + "\n"


def _entries(file: SourceFile, sink: Sink) -> tuple[dict[str, str], dict[str, Span]]:
    """Values as text by lower-case key, and where they stand; tables of shapes have no key."""
    values: dict[str, str] = {}
    places: dict[str, Span] = {}
    for number, line in enumerate(file.text.split("\n"), 1):
        code = re.split(r"[$!]", line, maxsplit=1)[0]
        found = re.match(r"\s*(\w+)\s*=\s*(\S.*?)\s*$", code)
        if found:
            key = found[1].lower()
            places[key] = file.word(number, found.start(2) + 1)
            if key in values and values[key] != found[2]:
                sink.error("E534", f"{found[1]} is given twice, and not alike", places[key])
            values[key] = found[2]
    return values, places


def _folded(first: str, words: list[str], more: str, width: int = 100) -> list[str]:
    lines = [first]
    for word in words:
        if len(lines[-1]) + len(word) > width:
            lines.append(more)
        lines[-1] += word + " "
    return [line.rstrip() for line in lines]

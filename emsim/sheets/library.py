"""What a library of models says of one of its names, without being read as a deck."""

from __future__ import annotations

import re

from ..source import decode, read_bytes


def model_of(path: str, name: str) -> str:
    """The type of a model in a library; "" where it has none of that name."""
    try:
        text = decode(read_bytes(path, regular=True)) or ""
    except OSError:
        return ""
    found = re.search(rf"^[ \t]*\.model[ \t]+{re.escape(name)}[ \t]+(\w+)", text, re.I | re.M)
    return found[1].upper() if found else ""


def terminals_of(path: str, name: str) -> list[str] | None:
    """Of a subcircuit in a library; None where neither can be read."""
    try:
        text = decode(read_bytes(path, regular=True)) or ""
    except OSError:
        return None
    text = re.sub(r"\n[ \t]*\+", " ", text)
    found = re.search(rf"^[ \t]*\.subckt[ \t]+{re.escape(name)}(?=\s)([^\n;]*)", text, re.I | re.M)
    if found is None:
        return None
    terminals: list[str] = []
    for each in found[1].split():
        if "=" in each or each.lower().startswith("param") or each == "$":
            break
        terminals.append(each)
    return terminals

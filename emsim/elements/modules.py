"""Modules of Verilog-A: those in devices/, and those that a deck names by .hdl."""

from __future__ import annotations

import os

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .._engine import VerilogA

FOLDER = os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "devices")

# names, unit, default (nan where it hangs on others), meaning
Row = tuple[list[str], str, float, str]


class ModuleError(Exception):
    """What is wrong with a text: messages as the engine gives them."""

    def __init__(self, messages: list[dict[str, Any]]) -> None:
        super().__init__(messages)
        self.messages = messages


class Module:
    """One module: its terminals, and its parameters by every name in lower case, those of an element's line among them."""

    __slots__ = ("about", "disciplines", "name", "of_lines", "parameters", "terminals", "texts")

    def __init__(self, texts: VerilogA, name: str) -> None:
        self.texts, self.name = texts, name
        self.about = texts.describe(name)
        self.terminals: list[str] = self.about["terminals"]
        self.disciplines: list[str] = self.about["disciplines"]  # of each
        self.parameters: dict[str, dict[str, Any]] = {
            word.lower(): p for p in self.about["parameters"] for word in p["names"]
        }
        self.of_lines = dict.fromkeys(word for word, p in self.parameters.items() if p["instance"])

    def rows(self, instance: bool = False) -> list[Row]:
        """The parameters of a .model, or of the element's line, as tables show them."""
        return [
            (
                [name.lower() for name in p["names"]],
                p["unit"],
                float("nan") if p["default"] is None else p["default"],
                p["meaning"],
            )
            for p in self.about["parameters"]
            if p["instance"] == instance
        ]


def read(path: str) -> list[Module]:
    """The modules of a file. Raises OSError, ModuleError."""
    from .._engine import veriloga
    from ..source import decode, read_bytes

    text = decode(read_bytes(path, regular=True)) or ""
    texts = veriloga(text, path, [os.path.dirname(os.path.abspath(path)), FOLDER])
    if texts.messages:
        raise ModuleError(texts.messages)
    return [Module(texts, name) for name in texts.modules]


_SHIPPED: dict[str, Module | None] = {}


def shipped(name: str) -> Module | None:
    """A module of devices/, which stands in the file of its name."""
    if name not in _SHIPPED:
        _SHIPPED[name] = _shipped(name)
    return _SHIPPED[name]


def _shipped(name: str) -> Module | None:
    path = os.path.join(FOLDER, name + ".va")
    if not name.isidentifier() or not os.path.isfile(path):
        return None
    return next((m for m in read(path) if m.name == name), None)


def names() -> list[str]:
    """Of all modules in devices/."""
    return sorted(file[:-3] for file in os.listdir(FOLDER) if file.endswith(".va"))


def where(message: dict[str, Any]) -> str:
    """What a message is about: the place in its text, and the macros it came through."""
    file = os.path.basename(message["file"])
    place = f"{file}:{message['line']}" if message["line"] else file
    through = "".join(f", by way of `{name}" for name, *_ in message["through"])
    source = message["source"].strip()
    return f" ({place}{through}{': ' + source if source else ''})" if place else ""

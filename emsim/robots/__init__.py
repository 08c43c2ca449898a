"""Robots that other programs describe, URDF and MJCF, as decks: read into links and joints (model.py), written as cards
(deck.py)."""

from __future__ import annotations

from ..cards import magic
from ..diagnostics import DeckError, Diagnostic, Sink
from ..source import load
from . import deck, mjcf, tir, urdf, xml
from .urdf import Options

__all__ = ["Options", "imported"]

READERS = {"robot": urdf.read, "mujoco": mjcf.read}


def imported(path: str, options: Options, sink: Sink) -> str:
    """The deck of a URDF or MJCF file, the .model of a .tir file. Warnings go to the sink. Raises DeckError for what is wrong in
    the file or cannot be said, OSError and ValueError where it cannot be read."""
    file = load(path)
    if path.lower().endswith(".tir"):
        text = tir.model(file, magic.KEYS, sink)
        sink.raise_if_errors()
        return text
    root = xml.parse(file)
    reader = READERS.get(root.tag)
    if reader is None:
        said = f"{path} holds <{root.tag}>: neither <robot> (URDF) nor <mujoco> (MJCF)"
        raise DeckError(Diagnostic("error", "E530", said, root.span))
    other = {"robot": ("key", "contacts"), "mujoco": ("free", "density")}[root.tag]
    if given := [f"--{name}" for name in other if getattr(options, name)]:
        said = f"{given[0]} says nothing of a file with <{root.tag}>"
        raise DeckError(Diagnostic("error", "E532", said, root.span))
    robot = reader(root, options, sink)
    sink.raise_if_errors()
    text = deck.write(robot, sink)
    sink.raise_if_errors()
    return text

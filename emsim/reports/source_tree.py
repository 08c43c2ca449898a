"""The source tree, for what runs the decks in netlists/: they are no part of an installed package."""

from __future__ import annotations

from pathlib import Path

from ..diagnostics import Diagnostic, OutsideError


def root() -> Path:
    """The working directory or one above it, else where the package lies. OutsideError where none holds netlists/."""
    here = Path.cwd()
    for folder in (here, *here.parents, Path(__file__).resolve().parents[2]):
        if (folder / "netlists" / "index.py").is_file():
            return folder
    hint = "run it in a source tree of emsim; an installed package has no netlists/"
    raise OutsideError(Diagnostic("error", "E505", "the hard cases are not here", None, hint))

"""PySpice: its Circuit objects as decks, and its shared ngspice library as an engine for `emsim compare`.

The only file that imports PySpice, and only where the shared library is asked for. PySpice is under the GPL
and is never required.
"""

from __future__ import annotations

import os
import tempfile

from ..diagnostics import Diagnostic, OutsideError
from ..outputs import raw
from .ngspice import NgspiceError, named_alike

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from ..result import Result


def netlist(circuit: Any) -> str:
    """The deck of a PySpice Circuit, or of a simulator made from one; no import of PySpice is needed.

    A Circuit carries no analysis: put it there with `circuit.raw_spice += ".tran 1u 1m\\\\n"`.
    TypeError for anything that is not PySpice's."""
    home = type(circuit).__module__.split(".")[0]
    if home not in ("PySpice", "InSpice") and not any(
        base.__module__.startswith(("PySpice.", "InSpice.")) for base in type(circuit).__mro__
    ):
        raise TypeError(f"a deck is a path, a text or a PySpice Circuit, not {type(circuit).__name__}")
    lines = str(circuit).splitlines()
    # PySpice opens with `.title NAME`; the first line of a deck is the title as it stands
    if lines and lines[0].lower().startswith(".title"):
        lines[0] = lines[0][len(".title") :].strip()
    return "\n".join([*lines, ""])


def run_shared(deck: str) -> Result:
    """Runs a deck in libngspice inside this process; see ngspice.run for the rest.

    OutsideError without PySpice or the library, NgspiceError when the run gives no result."""
    shared = _library()
    with tempfile.TemporaryDirectory(prefix="emsim-ngspice-") as folder:
        source, target = os.path.join(folder, "deck.cir"), os.path.join(folder, "out.raw")
        with open(source, "w", encoding="utf-8") as file:
            file.write(deck)
        # PySpice takes any line on stderr for a failure, ngspice's notes too: what counts is the file
        said: list[str] = []
        commands = ("destroy all", f"source {source}", "run", "set filetype=binary", f"write {target} all")
        for command in commands:
            try:
                shared.exec_command(command)
            except Exception as error:
                said.append(f"{error}: {shared.stderr.strip()}")
        if not os.path.exists(target):
            raise NgspiceError("; ".join(said) or "no result")
        return named_alike(raw.read(target))


def _library() -> Any:
    try:
        from PySpice.Spice.NgSpice.Shared import NgSpiceShared
    except ImportError:
        hint = "pip install 'emsim[pyspice]'"
        raise OutsideError(Diagnostic("error", "E512", "PySpice is not installed", None, hint)) from None
    import logging
    from ctypes.util import find_library

    # its logger repeats every note of ngspice as an error
    logging.getLogger(NgSpiceShared.__module__).setLevel(logging.CRITICAL)
    # PySpice looks for libngspice.so alone, which only -dev packages have
    found = find_library("ngspice")
    if found and "NGSPICE_LIBRARY_PATH" not in os.environ:
        NgSpiceShared.LIBRARY_PATH = found
    try:
        return NgSpiceShared.new_instance()
    except Exception as error:  # OSError, NameError, or cffi's own after an earlier failure
        hint = "Debian, Ubuntu: apt install libngspice0"
        message = f"PySpice cannot load the shared ngspice library: {error}"
        raise OutsideError(Diagnostic("error", "E513", message, None, hint)) from None

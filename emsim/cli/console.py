"""What the verbs share towards the terminal: diagnostics on stderr, results on stdout, the progress line.

Exit codes. 0 ok · 1 the deck is wrong · 2 the command line is wrong · 3 no convergence, partial results
kept · 4 a comparison is over its tolerance, a measurement found nothing · 5 the outside world (a file, ngspice) ·
70 an error inside emsim · 130 interrupted, partial results kept; so are they after SIGTERM, 143, and SIGHUP, 129.
"""

from __future__ import annotations

import os
import sys
from os.path import abspath, dirname, exists, isdir, isfile, realpath, samefile
from time import monotonic

from ..diagnostics import Diagnostic, OutsideError, deck_error, inert, render_text, to_json
from .arguments import UsageError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from typing import Any

OK, DECK, USAGE, CONVERGENCE, TOLERANCE, OUTSIDE, INTERNAL, INTERRUPTED = 0, 1, 2, 3, 4, 5, 70, 130
STATUS = {
    OK: "ok", DECK: "deck error", USAGE: "usage error", CONVERGENCE: "no convergence",
    TOLERANCE: "over tolerance", OUTSIDE: "outside error", INTERNAL: "internal error",
    INTERRUPTED: "interrupted", 129: "interrupted", 143: "interrupted",
}  # fmt: skip
_ended_by: int | None = None  # the signal that ended this command


def end_gently() -> None:
    """From now on SIGTERM and SIGHUP (unless ignored, as by nohup) end a command as Ctrl-C does, once: what follows is the
    writing of files, which a second one does not stop."""
    import _signal as signal  # type: ignore[import-not-found]  # the module around it takes longer to load than a small deck to run

    def end(number: int, _: object) -> None:
        global _ended_by
        for other in caught:
            signal.signal(other, signal.SIG_IGN)
        _ended_by = number
        raise KeyboardInterrupt

    numbers = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
    caught = [number for number in numbers if signal.getsignal(number) == signal.SIG_DFL]
    for number in caught:
        signal.signal(number, end)


def interrupted() -> int:
    """The exit code of a command that was interrupted: 130, or 128 and the number of the signal."""
    return INTERRUPTED if _ended_by is None else 128 + _ended_by


def check_folder(path: str) -> None:
    """OutsideError where a file to write has no folder, or one that takes no files: a long run should not find out at its
    end."""
    from ..outputs.beside import can_be_replaced, takes_files

    folder = dirname(realpath(path))
    if not isdir(folder):
        raise OutsideError(Diagnostic("error", "E503", f"there is no folder {dirname(path)} for {path}"))
    if isdir(path):
        said = f"cannot write {path}: it is a folder"
    elif exists(path):
        said = (
            ""
            if os.access(path, os.W_OK) or not can_be_replaced(path)
            else f"{path} is protected from writing"
        )
    else:
        said = (
            "" if takes_files(folder) else f"cannot write {path}: no file can be made in the folder {folder}"
        )
    if said:
        raise OutsideError(Diagnostic("error", "E503", said))


def check_targets(paths: Sequence[str], deck: str = "-") -> None:
    """Refuses files to write that have no folder, that are the deck, by whatever name, or one file for two things."""
    seen: list[str] = []
    for path in paths:
        if deck != "-" and same_file(path, deck):
            raise UsageError(f"{path} is the deck; choose another file")
        # /dev/null is no file, and takes anything
        if any(same_file(path, other) for other in seen) and (isfile(path) or not exists(path)):
            raise UsageError(f"{path} would be written twice")
        check_folder(path)
        seen.append(path)


def same_file(a: str, b: str) -> bool:
    """Whether two paths lead to one file, through links too."""
    return samefile(a, b) if exists(a) and exists(b) else abspath(a) == abspath(b)


def stdin_text() -> str:
    """The deck on stdin, decoded as a file is."""
    from ..source import decode

    if sys.stdin is None:
        raise OutsideError(
            Diagnostic("error", "E500", "there is no stdin to read the deck from: it is closed")
        )
    stream = getattr(sys.stdin, "buffer", None)
    text = sys.stdin.read() if stream is None else decode(stream.read())
    if text is None:
        deck_error("E100", "what stands on stdin is not text", hint="a deck is text, one card a line")
    return text


def unwritten(path: str, error: OSError) -> Diagnostic:
    """What to say of a file that could not be written."""
    said = error.strerror or str(error).removeprefix(f"{path}: ").partition(" (os error")[0]
    return Diagnostic("error", "E503", f"cannot write {path}: {said}")


def show(diagnostics: Sequence[Diagnostic], quiet: bool = False) -> None:
    """Diagnostics to stderr, coloured on a terminal; quiet leaves the notes out."""
    kept = [d for d in diagnostics if not (quiet and d.severity == "note")]
    if kept:
        colour = sys.stderr.isatty() and not os.environ.get("NO_COLOR")
        print(render_text(kept, colour), end="\n\n", file=sys.stderr)


def point(diagnostics: Iterable[Diagnostic]) -> None:
    """Under the messages of a deck that is wrong or a run that failed: where the first of them is explained. What the
    outside world lacks (E499 and above) needs no explanation."""
    code = next((d.code for d in diagnostics if d.severity == "error"), "E499")
    if code < "E499":
        print(f"more: emsim explain {code}", file=sys.stderr)


def print_lines(lines: Iterable[str], painted: bool = False) -> None:
    """Lines to stdout in large pieces; a reader that went away (`| head`) ends it quietly. Names and titles in them that would
    steer a terminal do not; the colours of `painted` lines stay."""
    piece: list[str] = []
    clean = _painted if painted else inert
    try:
        for line in lines:
            piece.append(clean(line))
            if len(piece) == 1000:
                sys.stdout.write("\n".join(piece) + "\n")
                piece.clear()
        if piece:
            sys.stdout.write("\n".join(piece) + "\n")
        sys.stdout.flush()
    except BrokenPipeError:
        # what is still buffered would raise again when the interpreter closes stdout
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _painted(line: str) -> str:
    from re import split

    return "".join(part if k % 2 else inert(part) for k, part in enumerate(split("(\033\\[[\\d;]*m)", line)))


def print_json(code: int, diagnostics: Iterable[Diagnostic], **more: Any) -> None:
    """The one JSON document of `--json`: status, diagnostics, what the verb adds. Not-a-number is null."""
    import json

    document = {
        "status": STATUS[code], "exit_code": code, "diagnostics": [to_json(d) for d in diagnostics], **more
    }  # fmt: skip
    print_lines([json.dumps(_finite(document), indent=1)])


def _finite(value: Any) -> Any:
    """JSON knows no infinity."""
    if isinstance(value, float):
        return value if abs(value) < float("inf") else None
    if isinstance(value, dict):
        return {str(k): _finite(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(v) for v in value]
    return value


class Progress:
    """`t=12.3ms/20ms  step 40us  3.1k steps  ETA 2s  events 7`, on stderr when that is a terminal and the run
    takes longer than a second; rewritten five times a second and wiped at the end."""

    __slots__ = ("_began", "_shown", "_width", "stream")

    def __init__(self) -> None:
        self.stream, self._began, self._shown, self._width = sys.stderr, monotonic(), 0.0, 0

    @staticmethod
    def wanted(quiet: bool) -> bool:
        return not quiet and sys.stderr.isatty()

    def __call__(self, t: float, stop: float, step: float, steps: int, events: int) -> None:
        now = monotonic()
        elapsed = now - self._began
        if elapsed < 1 or now - self._shown < 0.2:
            return
        self._shown = now
        left = elapsed * (stop - t) / t if t > 0 else 0.0
        line = (
            f"t={engineering(t)}s/{engineering(stop)}s  step {engineering(step)}s  {engineering(steps)} steps"
            f"  ETA {left:.0f}s  events {events}"
        )
        # an interrupt may come as soon as something is shown, and has it wiped
        before, self._width = self._width, len(line)
        self.stream.write("\r" + line.ljust(before))
        self.stream.flush()

    def clear(self) -> None:
        if self._width:
            self.stream.write("\r" + " " * self._width + "\r")
            self.stream.flush()
            self._width = 0


class Line:
    """One line on a terminal's stderr, written over again and wiped at the end; nothing where there is no terminal."""

    def __init__(self, quiet: bool) -> None:
        self.on = not quiet and sys.stderr is not None and sys.stderr.isatty()

    def write(self, text: str) -> None:
        if self.on:
            sys.stderr.write(f"\r\x1b[K{text}")
            sys.stderr.flush()

    def end(self) -> None:
        self.write("")


def engineering(value: float, digits: int = 3) -> str:
    """12.3m, 40u, 3.1k: three digits and a scale letter."""
    if value == 0 or value != value or abs(value) == float("inf"):
        return f"{value:g}"
    for scale, letter in ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1, ""), (1e-3, "m"), (1e-6, "u"), (1e-9, "n")):
        if abs(value) >= scale * 0.9995:
            return f"{value / scale:.{digits}g}{letter}"
    return f"{value / 1e-12:.{digits}g}p"

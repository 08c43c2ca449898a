"""The options that draw: plots of signals to files or into the terminal, for `run` and `plot`; films of the machine."""

from __future__ import annotations

import sys
from os.path import splitext

from .arguments import Arguments, Option, UsageError, number
from .console import check_folder, print_lines

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..deck import Probe
    from ..outcome import Outcome

FORMATS = (".png", ".svg", ".pdf")
PLOT_OPTIONS = [
    Option(
        "--plot",
        'draw signals in the terminal, a panel a unit: "v(out) i(v1)", "v(out) vs v(in)"; several times: one below the other',
        "SIGNALS",
        repeat=True,
    ),
    Option("--plot-file", "draw to .png, .svg or .pdf instead; - is the terminal", "FILE", repeat=True),
]
FILM_OPTIONS = [
    Option("--gif", "film the machine, as a GIF", "FILE"),
    Option("--frame", "draw the machine as PNG or SVG, at --from or at the start", "FILE"),
    Option("--circuit", "film the circuit too, above the machine: voltages as colours, currents as dots"),
    Option("--speed", "simulated seconds a second of the film, otherwise it lasts 4 to 10 s", "X"),
    Option("--duration", "seconds that the film lasts, in place of --speed", "SECONDS"),
    Option("--fps", "frames a second of the film, otherwise 20", "N"),
    Option("--mode", "of .modes the N-th alone; without it all of them, one after the other", "N"),
    Option(
        "--trace",
        "point of a body whose path is drawn: a POINT, or body.com; otherwise that of .view",
        "NAME",
    ),
]
WINDOW_OPTIONS = [
    Option("--from", "draw from this time on", "SECONDS"),
    Option("--to", "draw up to this time", "SECONDS"),
    Option("--width", "width of what is drawn: pixels, or columns in the terminal", "N"),
]


class Plots:
    """What is to be drawn, and where: `files`, and `terminal` for standard output; `lists` of signals, a picture
    of all of them; empty lists: the ones that the result's choice is."""

    __slots__ = ("files", "lists", "start", "stop", "terminal", "width")

    def __init__(self, given: Arguments, lists: Sequence[str], files: Sequence[str], option: str) -> None:
        """Raises UsageError, DeckError for signals that are not understood, OutsideError without matplotlib."""
        self.files = [path for path in files if path != "-"]
        self.terminal = "-" in files or (bool(lists) and not files)
        self.lists: list[list[Probe]] = []
        self.start, self.stop = value_of(given, "from"), value_of(given, "to")
        self.width = width_of(given)
        for text in lists:
            if not text.strip(" ,"):
                raise UsageError('no signals: write them as in "v(out) i(v1)"')
            if splitext(text)[1].lower() in FORMATS:
                raise UsageError(
                    f"{text} is a file, and what is asked for are signals; the file goes to {option}"
                )
        for path in self.files:
            if splitext(path)[1].lower() not in FORMATS:
                raise UsageError(f"{path}: a picture is one of {', '.join(FORMATS)}")
            check_folder(path)
        if self.files:
            from ..outputs import picture  # noqa: F401
        for text in lists:
            from ..build import parse_signals
            from ..outputs.panels import split

            self.lists.append(parse_signals(text, "--plot" if option == "--plot-file" else "signals"))
            split(self.lists[-1])

    def __bool__(self) -> bool:
        return self.terminal or bool(self.files)

    @property
    def signals(self) -> list[Probe]:
        """Everything that has to be recorded."""
        if not self.lists:
            return []
        from ..outputs.panels import transformed

        asked = [p for items in self.lists for p in items if getattr(p.ast, "id", "") != "vs"]
        inner = [(p, transformed(p.ast)) for p in asked]
        # of fft(v(out)) the signal is recorded
        return [
            q
            for p, parts in inner
            for q in ([type(p)(repr(ast), ast, p.span) for ast in parts] if parts else [p])
        ]

    def draw(self, result: Outcome) -> None:
        """Files, then the terminal. DeckError where there is nothing to draw."""
        table = result.main
        from ..build import parse_signals
        from ..outputs import panels, terminal
        from ..outputs.html import shown

        lists = self.lists or [parse_signals(" ".join(shown(result, table)))]
        degrees = panels.writes_degrees(result.deck)
        found = [p for one in lists for p in panels.of_result(result, one, degrees, self.start, self.stop)]
        for path in self.files:
            from ..outputs import picture

            picture.write(path, found, table.title, self.width or picture.WIDTH)
        if self.terminal:
            look = terminal.Look.of(sys.stdout, self.width)
            print_lines(terminal.lines(found, table.title, look), painted=True)


class Films:
    """A film and a picture of the machine, by the names of their files."""

    __slots__ = ("_given", "files")

    def __init__(self, given: Arguments) -> None:
        """Raises UsageError, OutsideError without Pillow."""
        self._given = given
        self.files = [path for key in ("gif", "frame") if (path := given.text(key)) is not None]
        for key, extensions in (("gif", (".gif",)), ("frame", (".png", ".svg"))):
            path = given.text(key)
            if path is not None and not path.lower().endswith(extensions):
                raise UsageError(f"--{key} {path}: the file ends in {' or '.join(extensions)}")
        if given.has("speed") and given.has("duration"):
            raise UsageError("--speed and --duration say the same thing in two ways; give one")
        for key in ("speed", "duration", "fps", "mode"):
            given.number(key)
        for key in ("circuit", "speed", "duration", "fps", "mode", "trace"):
            if given.has(key) and not self.files:
                raise UsageError(f"--{key} is for a film: --gif FILE, --frame FILE")
        for path in self.files:
            check_folder(path)
        if self.files:
            from ..outputs import film  # noqa: F401

    def __bool__(self) -> bool:
        return bool(self.files)

    def draw(self, result: Outcome) -> None:
        """Writes them. DeckError where there is no machine, or nothing to draw of it."""
        from ..diagnostics import deck_error
        from ..outputs import film

        mode = self._given.number("mode")
        own = (t for t in result.plots if film.swings(t)) if mode is not None else iter((result.main,))
        table = next(own, result.main).courses()[-1]  # of a deck with .step the last run
        if mode is not None and (not film.swings(table) or not 1 <= mode <= len(table) or mode % 1):
            there = f"there are {len(table)}" if film.swings(table) else "they come of .modes"
            deck_error("E354", f"there is no mode {mode:g} of the machine to draw", hint=there)

        circuit = self._given.has("circuit")
        if circuit and (table.circuit is None or "refused" in table.circuit.data or len(table) < 2):
            deck_error("E373", "there is no circuit to draw", hint="a film of it needs elements and a .tran")
        if not circuit and (table.scene is None or (len(table) < 2 and not film.swings(table))):
            hint = "a film needs a BODY, and a .tran or .modes; --circuit films the circuit"
            deck_error("E354", "there is no machine to draw", hint=hint)
        given, trace = self._given, self._given.text("trace")
        start, stop = (value_of(given, key) for key in ("from", "to"))
        if mode is not None:
            start, stop = mode - 0.5, mode + 0.5
        width = width_of(given)
        if (path := given.text("gif")) is not None:
            timing = film.Timing(
                table,
                start,
                stop,
                given.number("fps"),
                given.number("speed"),
                given.number("duration"),
            )
            film.gif(path, table, timing, width or film.WIDTH, trace, circuit)
        if (path := given.text("frame")) is not None:
            at = float(film.instants(table)[0]) if start is None else start
            at = at if mode is None else mode  # farthest out
            film.png(path, table, at, width or 2 * film.WIDTH, trace, circuit)


def check_window(given: Arguments, plots: Plots, films: Films) -> None:
    """UsageError for a part of the run, or a width, of nothing that is drawn."""
    for key in ("from", "to", "width"):
        # a single picture has but one time
        if given.has(key) and not (plots or given.has("gif") or (films and key != "to")):
            raise UsageError(
                f"--{key} is for what is drawn: --plot SIGNALS, --gif FILE"
                + (", --frame FILE" if key != "to" else "")
            )


def value_of(given: Arguments, key: str) -> float | None:
    """A number with SPICE's suffixes, of any sign."""
    text = given.text(key)
    value = None if text is None else number(text)
    if text is not None and value is None:
        raise UsageError(f"--{key}: {text!r} is not a number")
    return value


def width_of(given: Arguments) -> int | None:
    text = given.text("width")
    if text is None:
        return None
    if not text.isdecimal() or not 20 <= int(text) <= 10_000:
        raise UsageError(f"--width: {text!r} is not a whole number from 20 to 10000")
    return int(text)

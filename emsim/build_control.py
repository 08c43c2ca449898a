"""The commands of a .control section, as far as they say what is computed. Its language is not there yet; until then:

- what only shows, stores or computes with results is passed over, with a note;
- `tran`, `op` and other analyses are run as the dot cards of that name, after those of the deck; `run` is what happens anyhow;
- options that are set before the first analysis count as .options;
- `set` and `let` of constants are put in where `$name` and `$&name` stand;
- everything else is an error by name: what changes the circuit, and analyses in a loop or under a condition. The run would be of
  another circuit than the deck's.
"""

from __future__ import annotations

from .build_expr import expression
from .diagnostics import Diagnostic
from .expr import ExprError, Scope, evaluate
from .source import Line
from .syntax import LineError, parse_line

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from typing import Any

    from .diagnostics import Sink

ANALYSES = frozenset("tran op dc ac noise tf pz sens disto sp pss".split())
BLOCKS = frozenset("foreach while dowhile repeat if".split())
BRANCHES = frozenset("else elseif end break continue label".split())
# what changes the circuit or the run -> what to write in its place
CHANGES = {
    "alter": "write the value on the card, or as a .param with -D name=value",
    "alterparam": "write the value of the .param, or -D name=value",
    "altermod": "write the value into the .model",
    "source": "run that deck",
    "mc_source": "run that deck",
    "circbyline": "write the lines into the deck",
    "edit": "edit the deck",
    "setcirc": "a deck is one circuit",
    "remcirc": "a deck is one circuit",
    "snload": "state the start with .ic",
    "stop": "write the stop time on the .tran card",
    "step": "write the stop time on the .tran card",
    "resume": "write the stop time on the .tran card",
    "goto": "write what it repeats as lines of their own",
    "setseed": "random numbers are not supported",
}
# what shows, stores, or computes with results
SHOWS = frozenset(
    """aclist alias asciiplot bug cd cdump codemodel pre_codemodel compose cross cutout define deftype delete destroy
    devhelp diff display dump echo fft fourier four gdb getcwd gnuplot hardcopy help history inventory iplot jobs led
    let linearize listing load mdump meas measure mrdump nghelp ngspice noquery option options osdi pre_osdi oldhelp
    optran plot pre_set print psd quit exit bye remzerovec reset reshape rspice run rusage save set setcs setplot
    setscale setsimvar settype shell shift show showmod spec snsave status strcmp strstr strslice sysinfo tutorial
    undefine unalias unlet unset version where wrdata write wric wrnodev wrs2p xgraph rehash state trace iprint
    alterinit altinit use wait""".split()
)
# simulator options among the variables that `set` can set; the others are about plots and files
OPTIONS = frozenset(
    """reltol abstol vntol chgtol trtol gmin itl1 itl2 itl4 maxord method temp tnom rshunt gshunt cshunt tmax scale""".split()
)


class Section:
    """Reads commands; `cards` are what they come to, `told` the first words of those that were passed over."""

    def __init__(self, sink: Sink, convert: Callable[[str, list[Any], Line], Any]) -> None:
        self.sink, self.convert = sink, convert
        self.cards: list[Any] = []
        self.unknown: list[Line] = []  # lines that begin with no command
        self.passed = False  # something was passed over
        self._values: dict[str, str] = {}
        self._blocks: list[str] = []
        self._ended = False

    def read(self, lines: list[Line]) -> None:
        for line in lines:
            for text in _commands(line.text):
                if self._ended:
                    return
                try:
                    self._command(text, line)
                except LineError as error:
                    self.sink.add(error.diagnostic)

    def _command(self, text: str, line: Line) -> None:
        word, _, rest = text.partition(" ")
        word, rest = word.lower(), rest.strip()
        if word in CHANGES:
            what = (
                "stops and goes on by itself" if word in ("stop", "step", "resume") else "changes the circuit"
            )
            raise self._refused(f"`{word}` {what}", line, CHANGES[word])
        if word in BLOCKS or word in BRANCHES:
            self._block(word)
        elif word in ANALYSES or word == "run":
            if self._blocks:
                raise self._refused(
                    f"`{word}` stands under `{self._blocks[-1]}`", line, "write the analyses as dot cards"
                )
            if word != "run":
                self.cards.append(self._analysis(word, self._with_values(text, line), line))
        elif word in ("option", "options") or (word == "set" and _set_name(rest) in OPTIONS):
            if self.cards and any(card.__class__.__name__ == "Analysis" for card in self.cards):
                raise self._refused(
                    f"`{word}` stands behind an analysis", line, "options hold for the whole deck: .options"
                )
            if rest:
                self.cards.append(self._parsed(self._with_values(text, line), line))
        elif word in ("set", "let"):
            self._assign(word, rest, line)
            self.passed = True
        elif word in SHOWS:
            self._ended = word in ("quit", "exit", "bye") and not self._blocks
            self.passed = self.passed or not self._ended
        else:
            self.unknown.append(line)

    def _block(self, word: str) -> None:
        self.passed = True
        if word in BLOCKS:
            self._blocks.append(word)
        elif word == "end" and self._blocks:
            self._blocks.pop()

    def _analysis(self, kind: str, text: str, line: Line) -> Any:
        from .deck import Analysis

        if kind in ("tran", "op"):
            return self._parsed(text, line)
        return Analysis(kind, text.split()[1:], set(), line.whole)

    def _parsed(self, text: str, line: Line) -> Any:
        """The card that a command is, by the grammar."""
        given = Line(line.file, line.number, line.col, line.start, line.end)
        if text != line.text:
            given.text, given.single = text, True
        rule, children = parse_line(given, "command")
        return self.convert(rule, children, given)

    # ---- $name and $&name ----

    def _assign(self, word: str, rest: str, line: Line) -> None:
        """Notes what a constant is; what comes of results is not known here."""
        name, equals, value = (part.strip() for part in rest.partition("="))
        if not equals or self._blocks:
            self._values.pop(name.lower(), None)
            return
        if word == "let":
            try:
                value = repr(_constant(self._with_values(value, line), line))
            except (LineError, ExprError):
                self._values.pop(name.lower(), None)
                return
        self._values[name.lower()] = value.strip("\"'")

    def _with_values(self, text: str, line: Line) -> str:
        if "$" not in text:
            return text
        import re

        def value(found: re.Match[str]) -> str:
            known = self._values.get(found[1].lower())
            if known is None:
                raise self._refused(f"`{found[0]}` is not known before the run", line, "write the number")
            return known

        return re.sub(r"\$&?(\w+)", value, text)

    def _refused(self, said: str, line: Line, hint: str) -> LineError:
        return LineError(
            Diagnostic(
                "error", "E108", f"{said}; the language of .control is not there yet", line.whole, hint
            )
        )


def _commands(text: str) -> Iterator[str]:
    """The commands of a logical line: `;` separates them, `+` goes on with the line above, and ` $ ` begins a comment."""
    joined = " ".join(
        part.strip().removeprefix("+") if k else part for k, part in enumerate(text.split("\n"))
    )
    quoted, begin = "", 0
    for at, c in enumerate(joined):
        if quoted:
            quoted = "" if c == quoted else quoted
        elif c in "\"'":
            quoted = c
        elif c == ";" or joined[at : at + 2] == "$ ":
            yield from _stripped(joined[begin:at])
            begin = at + 1
            if c == "$":
                return
    yield from _stripped(joined[begin:])


def _stripped(text: str) -> Iterator[str]:
    text = " ".join(text.split())
    if text and text[0] not in "*$#":
        yield text


def _set_name(rest: str) -> str:
    return rest.partition("=")[0].strip().lower()


def _constant(text: str, line: Line) -> float:
    given = Line(line.file, line.number, line.col, line.start, line.end)
    given.text, given.single = text, True
    return evaluate(expression(parse_line(given, "expression"), given), Scope())

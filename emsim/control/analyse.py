"""Analyses: run and the analyses by name, save, and what resumes or stops."""

from __future__ import annotations

from ..deck import Analysis, Dot
from ..elaborate.scope import as_float
from ..expr import Node, Scope
from .base import Command
from .errors import CommandError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable

    from .program import Statement
    from .session import Session

FORMS = {
    "op": ("op", "the operating point, into a plot op1"),
    "tran": ("tran tstep tstop [tstart [tmax]] [uic]", "a transient, into a plot tran1"),
    "ac": ("ac dec|oct|lin points fstart fstop", "small signals over frequency, into a plot ac1"),
    "dc": (
        "dc source start stop step [source2 start2 stop2 step2]",
        "operating points over a source, into a plot dc1",
    ),
    "noise": ("noise v(out) source dec|oct|lin points fstart fstop", "noise over frequency"),
    "tf": ("tf v(out) source", "transfer function, input and output resistance"),
    "pz": ("pz node node node node vol|cur pol|zer|pz", "poles and zeros"),
    "sens": ("sens v(out) [ac ..]", "what the output depends on"),
    "disto": ("disto dec|oct|lin points fstart fstop [f2overf1]", "distortion of small signals"),
    "sp": ("sp dec|oct|lin points fstart fstop", "scattering parameters"),
    "ss": (
        "ss tstep period [tstab] [uic]",
        "the periodic steady state of what sources drive, into a plot ss1",
    ),
    "pss": (
        "pss gfreq tstab node [points [harmonics]] [uic]",
        "the periodic steady state of an oscillator, into plots pss1 and pss2",
    ),
}


def card(s: Session, text: str, at: Statement) -> Analysis | Dot:
    """The dot card that a command mirrors, its numbers known."""
    from ..build import command_card

    found = command_card(text, at.line, at.at, at.span)
    if isinstance(found, Analysis):
        scope = Scope(s.deck.flat().params)
        found.args = [as_float(a, scope) if isinstance(a, Node) else a for a in found.args]
    return found


def run(s: Session, text: str, at: Statement) -> None:
    _heed_waiting(s)
    if not s.deck.analyses():
        s.warn("the deck has no analysis that `run` could run", "write .tran, .ac .. or tran, ac .. here")
        return
    s.run_deck()


def _analysis(word: str) -> Callable[[Session, str, Statement], None]:
    def command(s: Session, text: str, at: Statement) -> None:
        _heed_waiting(s)
        if word == "op" and "static" not in text.split():
            text = ""  # ngspice's op takes nothing, and says nothing of what stands there
        found = card(s, f"{word} {text}".strip(), at)
        if not isinstance(found, Analysis):
            raise CommandError("E161", f"this is no analysis: {word} {text}", f"form: {FORMS[word][0]}")
        s.compute([found])

    return command


def _heed_waiting(s: Session) -> None:
    if s.deck.waiting:
        names = ", ".join(dict.fromkeys(s.deck.waiting))
        s.note(f"the altered parameter {names} acts here; ngspice waits for `reset`")
        s.deck.waiting.clear()


def save(s: Session, text: str, at: Statement) -> None:
    if text.strip().lower() in ("", "none"):
        return
    found = card(s, f"save {text}", at)
    assert isinstance(found, Dot)
    s.deck.saves += found.items


def watched(s: Session, text: str, at: Statement) -> None:
    """Nothing that is computed depends on it: told, and passed over."""
    s.note(f"`{at.word}` shows a run while it goes on; there is no screen here", "plot draws what was run")


COMMANDS = (
    Command("run", "run", "runs the analyses of the deck's dot cards", run),
    *(Command(word, form, meaning, _analysis(word)) for word, (form, meaning) in FORMS.items()),
    Command("save", "save v(out) i(v1) @r1[i] ..", "what the runs that follow record", save),
    *(Command(w, w, "passed over with a note: there is no screen here", watched) for w in ("iplot", "trace")),
)

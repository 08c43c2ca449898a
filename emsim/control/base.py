"""What a command is, for the families of commands in the other files."""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable

    from .program import Statement
    from .session import Session


class Command:
    """One command of .control.

    word, form, meaning   its name, how it is written, what it does: for help, messages, editors
    run(session, text, statement)   carries it out; `text` is what stands behind the word, with variables put in
    grammar   what the text is in grammar/control.lark: "vectors", "let", or None for words
    raw       variables are not put in: the command does it
    records   its text names quantities that analyses have to record
    shows     what it says may go to a file: `> file`, `>> file` behind it
    """

    __slots__ = ("form", "grammar", "meaning", "raw", "records", "run", "shows", "word")

    def __init__(
        self,
        word: str,
        form: str,
        meaning: str,
        run: Callable[[Session, str, Statement], None],
        grammar: str | None = None,
        raw: bool = False,
        records: bool | None = None,
        shows: bool = False,
    ) -> None:
        self.word, self.form, self.meaning, self.run = word, form, meaning, run
        self.grammar, self.raw, self.shows = grammar, raw, shows
        self.records = grammar is not None if records is None else records

"""Hints in a deck's comments: `*@ place R1 right of Q1`, also left of, above, below."""

from __future__ import annotations

import re

from ..diagnostics import did_you_mean

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable

    from ..diagnostics import Sink
    from ..source import SourceFile

LINE = re.compile(r"^\*@.*$", re.MULTILINE)
HINT = re.compile(r"\*@\s*place\s+(\S+)\s+(right\s+of|left\s+of|above|below)\s+(\S+)\s*$", re.IGNORECASE)
FORM = "form: *@ place R1 right of Q1; or left of, above, below"

Hint = tuple[str, str, str]


def hints(file: SourceFile, names: Iterable[str], sink: Sink | None = None) -> list[Hint]:
    """(where, what, beside what) of every hint, in lower case; `names` are the parts that there are. What is not understood is
    reported as W350."""
    known = list(names)
    found: list[Hint] = []
    for line in LINE.finditer(file.text):
        number = file.text.count("\n", 0, line.start()) + 1
        span = file.word(number, 1)
        hint = HINT.fullmatch(line[0].rstrip())
        if hint is None:
            if sink is not None:
                sink.warning("W350", "a hint to the drawing that is not understood has no effect", span, FORM)
            continue
        a, where, b = (word.lower() for word in hint.groups())
        missing = next((name for name in (a, b) if name not in known), None)
        if missing is None:
            found.append((where.split()[0], a, b))
        elif sink is not None:
            said = f"a hint to the drawing names `{missing}`, which the deck does not have"
            sink.warning("W350", said, span, did_you_mean(missing, known, FORM))
    return found

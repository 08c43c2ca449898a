"""Tables that code models read from files beside the deck."""

from __future__ import annotations

from ...tables import TableError
from ...tables import lines as lines_of
from ..files import FileTrouble, text_beside

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .base import Seat

LEVELS, STRENGTHS = "01u", "srzu"


def lines(seat: Seat, key: str, comment: str = "*") -> list[tuple[int, list[str]]] | None:
    """Number and words of each line that is no comment, which begins with one of `comment`; None, reported, where there is no
    such file."""
    given = seat[key]
    if not given:
        seat.wrong(f"{key}= is missing", key, f'write {key}="file.txt"')
        return None
    try:
        text = text_beside(seat.ctx, given, seat.model.span)
    except FileTrouble as error:
        seat.wrong(str(error), key, f"looked for {error.path}")
        return None
    try:
        return [*lines_of(text.lower(), comment)]
    except TableError as error:
        report(seat, key, error)
        return None


def report(seat: Seat, key: str, error: TableError) -> None:
    seat.wrong(f"{seat[key]}: {error}", key)


def state(word: str, line: int) -> float:
    """0s 1r Uz ... as the engine has it: 0, 1, 2 for levels, 3 more for each strength."""
    if len(word) != 2 or word[0] not in LEVELS or word[1] not in STRENGTHS:
        raise TableError(f"line {line}: `{word}` is no state; it is 0, 1 or U, then s, r, z or u")
    return LEVELS.index(word[0]) + 3.0 * STRENGTHS.index(word[1])

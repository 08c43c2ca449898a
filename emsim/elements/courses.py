"""PWL of LTspice and PSpice beyond a list of points: from a file, with factors on times and values, with parts that repeat.

    PWL file=data.txt          PWL time_scale_factor=1u value_scale_factor=2 (0 0 1 1)
    PWL repeat for 3 (0 0 1m 1 2m 0) endrepeat       PWL repeat forever (0 0 1m 1 2m 0) endrepeat

Times in a part that repeats count from where it begins; +1m counts from the point before.
"""

from __future__ import annotations

from ..build_expr import parts
from .base import number_at
from .files import FileTrouble, text_beside
from .independent import FACTORS

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    from ..deck import Waveform
    from ..source import Line
    from .contract import Cards, Circuit, Level

    # ("at", is the time relative?, time, value), ("file", name, place), ("repeat", how often or None, items)
    Course = list[tuple[Any, ...]]

MOST = 5_000_000  # points
COMMENTS = "*;#"
FORM = "form: PWL repeat for 3 (t1 v1 t2 v2 ..) endrepeat; PWL file=data.txt, with a time and a value on each line"


def is_course(children: list[Any]) -> bool:
    """Is a PWL more than points?"""
    for child in children:
        tree = child.__class__ is tuple
        if tree and (child[0] == "own_file" or (child[0] == "param" and child[1][0].lower() in FACTORS)):
            return True
        if not tree and child.lower() == "repeat":
            return True
    return False


def read(cards: Cards, ch: list[Any], line: Line) -> tuple[Course, dict[str, Any]]:
    """What stands behind PWL, and its parameters. Raises LineError."""
    words, params = parts(ch[1:]), {}
    at = 0

    def upto(end: str | None) -> Course:
        nonlocal at
        found: Course = []
        while at < len(words):
            item = words[at]
            at += 1
            tree = item.__class__ is tuple
            if tree and item[0] == "own_file":
                name = item[1][-1]
                found.append(("file", str(name).strip('"'), line.span(name)))
            elif tree and item[0] == "param":
                key = item[1][0].lower()
                params[key] = cards.number(item[1][1], line, f"{item[1][0]}=")
            elif not tree and item.lower() == end:
                return found
            elif not tree and item.lower() == "repeat":
                found.append(repeated(item))
            elif not tree and item.lower() in ("r", "td") and at < len(words):
                params[item.lower()] = cards.number(words[at], line, f"the value of {item}")
                at += 1
            elif at == len(words) or (
                words[at].__class__ is not tuple and words[at].lower() in (end, "repeat")
            ):
                raise cards.fail("E114", "PWL needs pairs of time and value", line, item, FORM)
            else:
                values = [cards.number(v, line, "a value of PWL") for v in (item, words[at])]
                found.append(("at", not tree and item[0] == "+", *values))
                at += 1
        if end is not None:
            raise cards.fail("E114", "`repeat` without `endrepeat`", line, words[-1], FORM)
        return found

    def repeated(item: Any) -> tuple[Any, ...]:
        nonlocal at
        how = words[at].lower() if at < len(words) and words[at].__class__ is not tuple else ""
        if how == "forever":
            at += 1
            return "repeat", None, upto("endrepeat")
        if how != "for" or at + 1 >= len(words):
            raise cards.fail("E114", "`repeat` takes `for` and a number, or `forever`", line, item, FORM)
        times = cards.number(words[at + 1], line, "how often it repeats")
        at += 2
        return "repeat", times, upto("endrepeat")

    return upto(None), params


def bound(course: Course, level: Level) -> Course:
    """With numbers in place of expressions. Raises ExprError."""
    found: Course = []
    for kind, *rest in course:
        if kind == "at":
            found.append(("at", rest[0], number_at(rest[1], level), number_at(rest[2], level)))
        elif kind == "repeat":
            times = None if rest[0] is None else number_at(rest[0], level)
            found.append(("repeat", times, bound(rest[1], level)))
        else:
            found.append((kind, *rest))
    return found


def is_plain(course: Course, is_number: Callable[[list[Any]], bool]) -> bool:
    """Is nothing in it to be evaluated?"""
    return all(
        is_number(rest[1:])
        if kind == "at"
        else kind == "file" or (is_number([rest[0]]) and is_plain(rest[1], is_number))
        for kind, *rest in course
    )


def fill(ctx: Circuit, name: str, wave: Waveform, course: Course) -> None:
    """The points of a course into its waveform; an error where that is none."""
    points: list[float] = []
    try:
        if _count(course) > MOST:  # before a single one is made
            raise ValueError(f"more than {MOST:,} points")
        again = _expand(ctx, course, points)
    except FileTrouble as error:
        ctx.sink.error("E292", f"{name}: {error}", wave.span, f"looked for {error.path}")
        points, again = [0.0, 0.0], None
    except ValueError as error:
        ctx.sink.error("E292", f"{name}: {error}", wave.span, FORM)
        points, again = [0.0, 0.0], None
    along, up = (float(wave.params.pop(key, 1.0)) for key in FACTORS)
    wave.args = [v * (up if k % 2 else along) for k, v in enumerate(points)]
    if again is not None:
        wave.params["r"] = again * along


def _count(course: Course) -> float:
    """Points of a course, less those of its files."""
    total = 0.0
    for kind, *rest in course:
        if kind == "at":
            total += 1.0
        elif kind == "repeat":  # for ever: twice, the first time differs
            total += (2.0 if rest[0] is None else rest[0]) * _count(rest[1])
    return total


def _expand(ctx: Circuit, course: Course, points: list[float]) -> float | None:
    """Appends the points; the time from which they repeat for ever. Raises ValueError, FileTrouble."""
    again: float | None = None

    def put(t: float, v: float) -> None:
        if again is not None:
            raise ValueError("nothing comes behind `repeat forever`")
        points.extend((t, v))
        if len(points) > 2 * MOST:
            raise ValueError(f"more than {MOST:,} points")

    def part(items: Course, start: float, inner: bool) -> float:
        nonlocal again
        t = start
        for kind, *rest in items:
            if kind == "at":
                relative, time, value = rest
                t = (t if relative else start) + time
                put(t, value)
            elif kind == "file":
                given, place = rest
                for relative, time, value in _rows(text_beside(ctx, given, place), given):
                    t = (t if relative else start) + time
                    put(t, value)
            elif rest[0] is None:
                if inner:
                    raise ValueError("`repeat forever` within a part that repeats")
                # the first time through differs: it comes from another value
                first = part(rest[1], t, True)
                if not first > t:
                    raise ValueError("what repeats for ever takes no time")
                t = part(rest[1], first, True)
                again = first
            else:
                if not rest[0] >= 1.0 or rest[0] != round(rest[0]):
                    raise ValueError(f"it repeats {rest[0]:g} times, which is no whole number from 1 on")
                for _ in range(int(rest[0])):
                    t = part(rest[1], t, True)
        return t

    part(course, 0.0, False)
    if not points:
        raise ValueError("there are no points")
    return again


def _rows(text: str, given: str) -> list[tuple[bool, float, float]]:
    from ..tables import lines, number

    found = []
    for k, words in lines(text, COMMENTS):
        if len(words) % 2:
            raise ValueError(f"line {k} of {given} ends with a time that has no value: `{words[-1][:40]}`")
        for time, value in zip(words[::2], words[1::2], strict=True):
            found.append((time[0] == "+", number(time, k), number(value, k)))
    return found

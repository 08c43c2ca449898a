"""Words and values of SPICE lines, for elements and dot cards."""

from __future__ import annotations

from ..build_expr import expression, extent, ignored_letters
from ..diagnostics import Diagnostic, Fix, Sink
from ..expr import Bare, Num
from ..source import Line
from ..syntax import LineError
from ..units import spice_leftover, spice_number

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .base import Element

INFINITE = float("inf")
_PLAIN: dict[str, float] = {}  # number words seen so far and their values


class Cards:
    """What the builders of elements, machine cards and dot cards share: errors and values."""

    sink: Sink

    def fail(self, code: str, message: str, line: Line, leaf: Any, hint: str | None = None) -> LineError:
        return LineError(Diagnostic("error", code, message, line.span_at(*extent(leaf)), hint))

    def second_value(self, what: str, line: Line, item: Any, hint: str | None = None) -> LineError:
        """A value where there is one already: a decimal comma, a unit apart, or one too many."""
        from ..slips import decimal_comma, unit_apart

        start, end = extent(item)
        slip = decimal_comma(line, start) or unit_apart(line, start, end)
        return self.fail("E102", what, line, item, hint) if slip is None else LineError(slip)

    # ---- values on electrical cards ----

    @staticmethod
    def is_value(item: Any) -> bool:
        """A word or something in braces, not a keyword or a waveform."""
        return bool(item[0] == "braced" if item.__class__ is tuple else item.type == "WORD")

    @staticmethod
    def are_numbers(values: list[Any]) -> bool:
        """Nothing in it is to be evaluated."""
        return not any(v is not None and v.__class__ is not float for v in values)

    def word(self, leaf: Any, line: Line) -> float | str:
        """A word: a number by SPICE's rule, or its lower-case text."""
        try:
            return _PLAIN[leaf]
        except KeyError:
            pass
        value = spice_number(leaf)
        if value is None:
            return str(leaf.lower())
        if value in (INFINITE, -INFINITE):
            raise self.fail("E110", "the number is too large", line, leaf)
        leftover = spice_leftover(leaf)
        if leftover:
            if any(c in leftover.rstrip("+-") for c in "*/+-^()"):
                from ..slips import rated

                span, hint = line.span(leaf), f"write a calculation in braces: {{{leaf}}}"
                fixes = [Fix(span, f"{{{leaf}}}", hint)]
                said = f"`{leaf}` is not a number"
                raise LineError(rated(line, leaf) or Diagnostic("error", "E110", said, span, fixes=fixes))
            self.sink.add(ignored_letters(leaf, value, leftover, line))
        elif len(_PLAIN) < 100_000:
            _PLAIN[str(leaf)] = value
        return value

    def value(self, item: Any, line: Line) -> Any:
        """float, str or AST of a word or of something in braces or quotes."""
        if item.__class__ is tuple:
            node = expression(item, line)
            return node.value if isinstance(node, Num) else node
        return self.word(item, line)

    def number(self, item: Any, line: Line, what: str) -> Any:
        """float or AST; a bare word is the name of a parameter."""
        value = self.value(item, line)
        return Bare(value, what, (line, item.start_pos, item.end_pos)) if isinstance(value, str) else value

    def params(self, items: list[Any], line: Line, element: Element) -> list[Any]:
        """Takes key=value items into element.params; returns the other items in order."""
        rest: list[Any] = []
        after_tc = False
        for item in items:
            if after_tc and "tc2" not in element.params and rest and self.is_value(item):
                # tc=2m 1u behind the value: the spelling that ngspice takes
                value = self.value(item, line)
                if not isinstance(value, str):
                    element.params["tc2"] = value
                    continue
            after_tc = False
            if item.__class__ is tuple and item[0] in ("param", "named"):
                key = item[1][0].lower()
                if key in element.labels:
                    continue
                values = [self.number(v, line, f"{key}=") for v in item[1][1:]]
                if key == "tc":
                    element.params["tc1"] = values[0]
                    if len(values) > 1:
                        element.params["tc2"] = values[1]
                    after_tc = element.may_have_tc
                else:
                    element.params[key] = values[0] if len(values) == 1 else values
            else:
                rest.append(item)
        return rest

""".view: how the machine is drawn. A word that it does not have, and a value that its word does not take, are errors (E239)."""

from __future__ import annotations

from math import inf

from ..diagnostics import did_you_mean
from ..expr import Node
from .scope import as_float

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from ..deck import Dot
    from ..diagnostics import Sink
    from .scope import Scope

NUMBERS = ("fps", "speed", "scale")  # greater than zero
# all words, each with a value that it takes
EXAMPLES = {"fps": "30", "speed": "0.5", "scale": "1.5", "trace": "arm.tip", "solid": "yes"}


def viewed(card: Dot, scope: Scope, sink: Sink) -> dict[str, Any]:
    """What a .view says, by its words: numbers, the name of the point `trace`, `solid` yes or no. Raises ExprError."""
    found: dict[str, Any] = {}
    for key, value, span in card.items:
        if key not in EXAMPLES:
            said = f".view has no `{key}`: it takes {', '.join(f'{k}=' for k in EXAMPLES)}"
            sink.error("E239", said, span, did_you_mean(key, EXAMPLES))
        elif value is None:
            sink.error("E239", f"{key} of .view has no value", span, f"write {key}={EXAMPLES[key]}")
        elif key in NUMBERS:
            is_word = isinstance(value, str) and not isinstance(value, Node)
            size = 0.0 if is_word or isinstance(value, tuple) else as_float(value, scope)
            # a picture has fewer pixels than 10 000: of a machine that is so much larger it shows nothing
            if not 0.0 < size < (1e4 if key == "scale" else inf):
                said = f"{key}= of .view is a number greater than zero"
                said += ", below 10000" if key == "scale" else ""
                sink.error("E239", said, span, f"write {key}={EXAMPLES[key]}")
            found[key] = size
        elif key == "solid" and str(value) not in ("yes", "no"):
            sink.error("E239", "solid= of .view is yes or no", span, "write solid=yes")
        else:
            found[key] = str(value)
    return found

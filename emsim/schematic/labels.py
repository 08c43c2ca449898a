"""What stands beside a part: its value, or what it depends on, in the names of the level that is drawn."""

from __future__ import annotations

import re

from ..expr import Node
from .reads import amplifies, reads, told
from .words import broken, fits, quantity, short, tidy, waveform, wrapped

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable

    from ..elements import Element

UNITS = {"r": "Ohm", "c": "F", "l": "H", "v": "V", "i": "A"}
WHOLE = {"c": "Q = ", "l": "flux = "}
BY_RULE = {"table": "TABLE of ", "laplace": "LAPLACE of ", "freq": "FREQ of ", "poly": "POLY of "}


class Labels:
    """Lines of labels; `net` and `name` say what a net and an element are called on this level, `windings` are coils whose values
    are turns."""

    def __init__(self, net: Callable[[str], str], name: Callable[[str], str], windings: set[str]) -> None:
        self.net, self.name, self.windings = net, name, windings

    def value(self, e: Element) -> list[str]:
        """Of an element, below its name."""
        letter = e.letter
        if letter in "rcl" or letter in "eghfb":
            if (found := amplifies(e)) is not None:
                return broken(f"gain {short(found[2])}")
            if isinstance(e.value, Node) or e.extra.get("form") in BY_RULE:
                return self._formula(e)
            if letter in "eghf":
                return self._gain(e)
            if e.name in self.windings and isinstance(e.value, float):
                return [f"{e.value:g} turns"]
            return wrapped(quantity(e.value, UNITS[letter]) or (e.model_name or ""))
        if letter in "vi":
            return wrapped(self._source(e, UNITS[letter]))
        if letter in "sw":
            return broken("by " + ", ".join(self._probes(e)))
        if letter == "t":
            said = (f"{key}={short(v)}" for key, v in e.params.items() if key in ("z0", "td"))
            return wrapped(" ".join(said)[:24])
        return []

    def beside(self, e: Element) -> list[str]:
        """Of an element with a label of its own kind: what it reads."""
        said = self._probes(e)
        return broken("reads " + ", ".join(said)) if said else []

    def _source(self, e: Element, unit: str) -> str:
        if e.wave is not None:
            return waveform(e.wave, unit)
        dc = e.extra.get("dc")
        if dc is None and e.extra.get("ac"):
            return f"AC {quantity(e.extra['ac'][0], unit)}"
        return quantity(dc or 0.0, unit)

    def _gain(self, e: Element) -> list[str]:
        what, gain = ", ".join(self._probes(e)), short(e.value)
        return broken(what if gain == "1" else f"{gain} {what}")

    def _formula(self, e: Element) -> list[str]:
        """An expression; where it is too long, that it is a function of what it reads."""
        before = BY_RULE.get(e.extra.get("form", ""), WHOLE.get(e.letter, "") if e.extra.get("whole") else "")
        said = self._probes(e)
        if not isinstance(e.value, Node):
            return broken(before + ", ".join(said))
        lines = broken(before + tidy(self._own(e, e.value) or repr(told(e.value, self.net, self.name))))
        if fits(lines) or (not said and "time" not in repr(e.value)):
            return lines if fits(lines) else wrapped(" ".join(lines))
        return broken(f"{before}f({', '.join([*said, *(['time'] if 'time' in repr(e.value) else [])])})")

    def _own(self, e: Element, value: Node) -> str:
        """An expression in the letters of the deck, where these stand on one line and name all that is read."""
        span, read = value.span, reads(e)
        if span is None or span.file.text_line(span.line + 1).lstrip().startswith("+"):
            return ""
        text = re.sub(r"\s*([-+*/^,()])\s*", r"\1", span.text.strip())
        there = {word for group in re.findall(r"v\(([^()]*)\)", text.lower()) for word in group.split(",")}
        known = there.issuperset(map(self.net, read.nets)) and all(
            self.name(n) in text.lower() for n in read.names
        )
        return text if known else ""

    def _probes(self, e: Element) -> list[str]:
        """All that an element reads, each once."""
        return list(dict.fromkeys(repr(told(p, self.net, self.name)) for p in reads(e).probes))

"""V and I: a DC value, a waveform, and what a small-signal analysis sees."""

from __future__ import annotations

import math

from ..build_expr import extent, parts
from ..deck import Waveform
from .base import Element, Param, number_at

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from ..source import Line
    from .contract import Cards, Circuit, Level
    from .net import Net

# words that are followed by values and may stand behind a waveform
PORT_WORDS = ("distof1", "distof2", "portnum", "z0", "pwr", "freq", "phase")
DISTORTION = {
    "distof1": Param("amplitude and phase [deg] at the first frequency of .disto", ""),
    "distof2": Param("amplitude and phase [deg] at its second frequency", ""),
}
FACTORS = ("time_scale_factor", "value_scale_factor")
WAVE_PARAMETERS = {"pwl": ("r", "td", *FACTORS)}


class Independent(Element):
    __slots__ = ()
    plain = ("source", 4, True)
    has_word = True
    form = "{}name n+ n- [DC value] [AC mag [phase]] [PULSE(..) SIN(..) EXP(..) PWL(..) SFFM(..) AM(..)]"

    def take_words_alone(self) -> None:
        self.value, self.extra = None, {"dc": self.value, "ac": None}

    def read(self, cards: Cards, rule: str, ch: list[Any], line: Line) -> None:
        name = ch[0]
        self.extra = {"dc": None, "ac": None}
        rest = cards.params(_words(self.take_nodes(ch, 2)), line, self)
        at = 0
        while at < len(rest):
            item = rest[at]
            at += 1
            if _is_word(item, *PORT_WORDS):
                # distof1 0.1 0.2, portnum 1 z0 50
                key, found = item.lower(), []
                while at < len(rest) and cards.is_value(rest[at]) and not _is_word(rest[at], *PORT_WORDS):
                    found.append(cards.number(rest[at], line, f"the value of {item}"))
                    at += 1
                self.params[key] = found[0] if len(found) == 1 else found or 1.0
                continue
            kind = item[0] if item.__class__ is tuple else item.type
            if kind == "wave":
                if self.wave is not None:
                    raise cards.fail("E102", f"{name} has a second waveform here", line, item)
                self.wave = waveform(cards, item, line, self.extra)
                if self.wave.kind != "pwl" and "," in line.text:  # pairs are written with commas
                    from ..slips import judge_commas

                    judge_commas(line, extent(item), cards.sink)
                continue
            if (
                _is_word(item, "r", "td")
                and self.wave is not None
                and self.wave.kind == "pwl"
                and at < len(rest)
            ):
                self.wave.params[item.lower()] = cards.number(rest[at], line, f"the value of {item}")
                at += 1
                continue
            # AC takes up to two values, DC one; a value alone is DC
            most = {"AC": 2, "DC": 1}.get(kind, 0)
            values = [] if most else [item]
            while len(values) < most and at < len(rest) and cards.is_value(rest[at]):
                if _is_word(rest[at], *PORT_WORDS):
                    break
                values.append(rest[at])
                at += 1
            what = "the AC value" if kind == "AC" else "the DC value"
            numbers = [cards.number(v, line, what) for v in values]
            if kind == "AC":
                self.extra["ac"] = (numbers[0] if numbers else 1.0, numbers[1] if numbers[1:] else 0.0)
            elif self.extra["dc"] is not None and numbers:
                raise cards.second_value(f"{name} has a second DC value here", line, values[0], self.hint)
            else:  # DC alone is 0, as in ngspice
                self.extra["dc"] = numbers[0] if numbers else self.extra["dc"] or 0.0
                self.value_span = line.span_at(*extent(values[0] if values else item))
        if self.wave is not None:
            for key in ("r", "td"):
                if key in self.params:
                    self.wave.params[key] = self.params.pop(key)
        self.is_plain = cards.are_numbers(
            [*self.params.values(), self.extra["dc"], *(self.extra["ac"] or ())]
        ) and (self.wave is None or cards.are_numbers([*self.wave.args, *self.wave.params.values()]))
        if "course" in self.extra:
            from .courses import is_plain

            self.is_plain = self.is_plain and is_plain(self.extra["course"], cards.are_numbers)

    def bind(self, level: Level) -> None:
        extra = self.extra
        extra["dc"] = None if extra["dc"] is None else number_at(extra["dc"], level)
        if extra["ac"] is not None:
            extra["ac"] = tuple(number_at(v, level) for v in extra["ac"])
        if "course" in extra:
            from .courses import bound

            extra["course"] = bound(extra["course"], level)

    def check(self, ctx: Circuit) -> None:
        super().check(ctx)
        if self.wave is None:
            return
        self.wave.seed = f"{ctx.flat.draws.seed} {self.name}"
        if (course := self.extra.pop("course", None)) is not None:
            from .courses import fill

            fill(ctx, self.name, self.wave, course)

    def quantity(self, ctx: Circuit) -> float | None:
        plain = self.extra.get("dc") if self.value is None else self.value
        return float(plain) if self.wave is None and isinstance(plain, (int, float)) else None

    @property
    def phasor(self) -> complex:
        """What AC on its line says, 0 without."""
        magnitude, phase = self.extra.get("ac") or (0.0, 0.0)
        return complex(magnitude * math.cos(math.radians(phase)), magnitude * math.sin(math.radians(phase)))

    def excite(self, ctx: Circuit) -> tuple[tuple[int, complex], ...]:
        return ((ctx.wave(self), self.phasor),) if self.phasor else ()

    def analogue(self, net: Net) -> str:
        dc = self.extra.get("dc")
        shown = "" if dc is None else f" dc {float(dc)!r}"
        return net.head(self) + shown + ("" if self.wave is None else " " + net.wave(self.wave))


def _words(items: list[Any]) -> list[Any]:
    """The items of a source; the brackets of a waveform are blanks, and what belongs to the source may stand among its items."""
    out: list[Any] = []
    for item in items:
        if item.__class__ is tuple and item[0] == "wave":
            inner = item[1]
            cut = next((k for k, c in enumerate(inner) if _is_word(c, *PORT_WORDS)), len(inner))
            own = WAVE_PARAMETERS.get(inner[0].lower(), ())
            others = [
                c
                for c in inner[1:cut]
                if c.__class__ is tuple and c[0] == "param" and c[1][0].lower() not in own
            ]
            out += [("wave", [c for c in inner[:cut] if c not in others]), *others, *parts(inner[cut:])]
        else:
            out.append(item)
    return out


def _is_word(item: Any, *words: str) -> bool:
    return item.__class__ is not tuple and item.lower() in words


def waveform(cards: Cards, item: Any, line: Line, extra: dict[str, Any]) -> Waveform:
    """A waveform as written; of a PWL that is more than points these are still to come: extra["course"]."""
    ch = item[1]
    kind = ch[0].lower().replace("sine", "sin")
    params: dict[str, Any] = {}
    args: list[Any] = []
    if kind == "pwl":
        from . import courses

        if courses.is_course(ch[1:]):
            extra["course"], params = courses.read(cards, ch, line)
            return Waveform(kind, [], params, line.span_at(*extent(item)))
    what = f"a value of {kind.upper()}"
    children = iter(parts(ch[1:]))
    for child in children:
        if child.__class__ is tuple and child[0] == "param":
            params[child[1][0].lower()] = cards.number(child[1][1], line, f"{child[1][0]}=")
        elif kind == "pwl" and _is_word(child, "r", "td"):
            params[child.lower()] = cards.number(next(children, child), line, f"the value of {child}")
        else:
            args.append(cards.number(child, line, what))
    wave = Waveform(kind, args, params, line.span_at(*extent(item)))
    if kind == "pwl":
        if len(args) % 2:
            said, hint = "PWL needs pairs of time and value", "form: PWL(t1 v1 t2 v2 ..)"
            raise cards.fail("E114", said, line, item, hint)
        _relative_times(cards, [c for c in parts(ch[1:]) if c.__class__ is not tuple], args, line)
    return wave


def _relative_times(cards: Cards, words: list[Any], args: list[Any], line: Line) -> None:
    """LTspice and PSpice count the time +1m from the point before, ngspice from 0: refused where that differs and nobody
    has said how the deck is read."""
    if len(words) != len(args) or not cards.are_numbers(args):
        return
    times: list[float] = []
    for word, time in zip(words[::2], args[::2], strict=True):
        times.append(time + (times[-1] if word[0] == "+" and times else 0.0))
    if line.file.dialect is not None:
        if line.file.dialect.relative_times:
            args[::2] = times
        return
    wrong = [w for w, read, meant in zip(words[::2], args[::2], times, strict=True) if read != meant]
    if wrong:
        points = " ".join(f"{t:.9g} {v:.9g}" for t, v in zip(times, args[1::2], strict=True))
        said = f"`{wrong[0]}` counts from the point before in LTspice, and from 0 in ngspice"
        hint = (
            f"write times without a sign; LTspice's are PWL({points}); or say --dialect ltspice, or ngspice"
        )
        raise cards.fail("E113", said, line, wrong[0], hint)

"""Element lines: what the words of a SPICE line mean. One method per grammar rule, named `on_` + the rule."""

from __future__ import annotations

from .build_expr import expression, extent, machine_value, node_name, parts
from .deck import Element, Instance, Ref, Waveform
from .diagnostics import Diagnostic, Sink, Span
from .expr import Bare, Num
from .source import Line, SourceFile
from .syntax import LineError
from .units import spice_leftover, spice_number

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

INFINITE = float("inf")
_PLAIN: dict[str, float] = {}  # number words seen so far and their values
_new = object.__new__
NOTHING: Any = type(type.__dict__)({})  # parameters of a plain element; nobody can put one in


WAVES = "there are PULSE SIN EXP PWL SFFM AM"


def form(letter: str) -> str:
    """The form of a card, for a hint."""
    from .mistakes import FORMS

    return "form: " + FORMS[letter]


def _is_value(item: Any) -> bool:
    """A word or something in braces, not a keyword or a waveform."""
    return item[0] == "braced" if item.__class__ is tuple else item.type == "WORD"


def _is_word(item: Any, *words: str) -> bool:
    return item.__class__ is not tuple and item.lower() in words


def _are_numbers(values: list[Any]) -> bool:
    """Nothing in it is to be evaluated."""
    return not any(v is not None and v.__class__ is not float for v in values)


class Cards:
    """What the builders of elements, machine cards and dot cards share: errors and values."""

    sink: Sink

    def fail(self, code: str, message: str, line: Line, leaf: Any, hint: str | None = None) -> LineError:
        start, end = extent(leaf)
        return LineError(Diagnostic("error", code, message, line.span_at(start, end), hint))

    # ---- values on electrical cards ----

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
            if any(c in leftover for c in "*/+-^()"):
                raise self.fail(
                    "E110",
                    f"`{leaf}` is not a number",
                    line,
                    leaf,
                    f"write a calculation in braces: {{{leaf}}}",
                )
            self.sink.warning(
                "W110",
                f"`{leaf}` is read as {value:g}: SPICE ignores `{leftover}`",
                line.span(leaf),
                "a number has one dot, and its scale letter stands at its end: 1.5k",
            )
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
            if after_tc and "tc2" not in element.params and rest and _is_value(item):
                # tc=2m 1u behind the value: the spelling that ngspice takes
                value = self.value(item, line)
                if not isinstance(value, str):
                    element.params["tc2"] = value
                    continue
            after_tc = False
            if item.__class__ is tuple and item[0] in ("param", "named"):
                key = item[1][0].lower()
                values = [self.number(v, line, f"{key}=") for v in item[1][1:]]
                if key == "tc":
                    element.params["tc1"] = values[0]
                    if len(values) > 1:
                        element.params["tc2"] = values[1]
                    after_tc = element.letter in "rcl"
                else:
                    element.params[key] = values[0] if len(values) == 1 else values
            else:
                rest.append(item)
        return rest


class ElementCards(Cards):
    """R C L V I B E G F H D S W K X, and the letters whose meaning comes later."""

    file: SourceFile

    # ---- cards that are nothing but words, the most frequent of all: see source.PLAIN ----

    def plain(
        self, rule: str, name: str, nodes: list[str], last: str, value: float | None, place: int
    ) -> Element:
        """Without a tree; its spans are made when somebody asks for them."""
        e = _new(Element)
        e.letter, e.name = name[0], name
        e.nodes = nodes if "gnd" not in nodes else [node_name(node) for node in nodes]
        e.file, e.place, e.is_plain = self.file, place, True
        e.value, e.params, e.wave, e.extra, e.model_name, e.model = value, NOTHING, None, NOTHING, None, None
        if value is None:
            e.model_name = last
        elif rule == "source":
            e.value, e.extra = None, {"dc": value, "ac": None}
        elif rule == "linear":
            e.extra = {"form": "linear"}
        return e

    # ---- R, C, L ----

    def on_resistor(self, ch: list[Any], line: Line) -> Element:
        return self.passive("r", ch, line)

    def on_capacitor(self, ch: list[Any], line: Line) -> Element:
        return self.passive("c", ch, line)

    def on_inductor(self, ch: list[Any], line: Line) -> Element:
        return self.passive("l", ch, line)

    def passive(self, letter: str, ch: list[Any], line: Line) -> Element:
        name, p, n = ch[0], ch[1].lower(), ch[2].lower()
        e = Element(
            letter,
            name.lower(),
            ["0" if p == "gnd" else p, "0" if n == "gnd" else n],
            Span(line.file, line.number, line.col, line.col + len(name)),
        )
        for item in self.params(ch[3:], line, e):
            if item.__class__ is tuple:
                rule = item[0]
                if rule == "own_q":
                    e.extra["charge"] = True
                node = expression(item if rule == "braced" else item[1][1], line)
                value: Any = node.value if isinstance(node, Num) else node
            else:
                value = self.word(item, line)
                if isinstance(value, str):
                    if value == "off":
                        continue
                    if e.model_name is not None:
                        raise self.fail("E102", f"`{item}` does not fit here", line, item, form(letter))
                    e.model_name, e.model_span = value, line.span(item)
                    continue
            if e.value is not None:
                raise self.fail("E102", f"{name} has a second value here", line, item, form(letter))
            e.value, e.value_span = value, line.span_at(*extent(item))
        if e.value is None and e.model_name is None:
            raise self.fail("E109", f"{name} has no value", line, ch[2], form(letter))
        e.is_plain = _are_numbers([e.value, *e.params.values()])
        return e

    # ---- V, I, B ----

    def on_source(self, ch: list[Any], line: Line) -> Element:
        name = ch[0]
        e = self.element(name[0].lower(), ch, 2, line)
        e.extra = {"dc": None, "ac": None}
        rest = self.params(ch[3:], line, e)
        at = 0
        while at < len(rest):
            item = rest[at]
            at += 1
            kind = item[0] if item.__class__ is tuple else item.type
            if kind == "wave":
                if e.wave is not None:
                    raise self.fail("E102", f"{name} has a second waveform here", line, item)
                e.wave = self.waveform(item, line)
                continue
            if _is_word(item, "r", "td") and e.wave is not None and e.wave.kind == "pwl" and at < len(rest):
                e.wave.params[item.lower()] = self.number(rest[at], line, f"the value of {item}")
                at += 1
                continue
            # AC takes up to two values, DC one; a value alone is DC
            most = {"AC": 2, "DC": 1}.get(kind, 0)
            values = [] if most else [item]
            while len(values) < most and at < len(rest) and _is_value(rest[at]):
                values.append(rest[at])
                at += 1
            what = "the AC value" if kind == "AC" else "the DC value"
            numbers = [self.number(v, line, what) for v in values]
            if kind == "AC":
                e.extra["ac"] = (numbers[0] if numbers else 1.0, numbers[1] if numbers[1:] else 0.0)
            elif e.extra["dc"] is not None and numbers:
                raise self.fail("E102", f"{name} has a second DC value here", line, values[0], form("v"))
            else:  # DC alone is 0, as in ngspice
                e.extra["dc"] = numbers[0] if numbers else e.extra["dc"] or 0.0
                e.value_span = line.span_at(*extent(values[0] if values else item))
        if e.wave is not None:
            for key in ("r", "td"):
                if key in e.params:
                    e.wave.params[key] = e.params.pop(key)
        elif "file" in e.params:
            raise self.fail(
                "E113", "PWL file= is not supported yet", line, ch[0], "write the points: PWL(t1 v1 t2 v2 ..)"
            )
        e.is_plain = _are_numbers([*e.params.values(), e.extra["dc"], *(e.extra["ac"] or ())]) and (
            e.wave is None or _are_numbers([*e.wave.args, *e.wave.params.values()])
        )
        return e

    def waveform(self, item: Any, line: Line) -> Waveform:
        ch = item[1]
        kind = ch[0].lower().replace("sine", "sin")
        if kind.startswith("tr"):
            raise self.fail("E113", f"{kind.upper()} is not supported yet", line, ch[0], WAVES)
        args, params = [], {}
        what = f"a value of {kind.upper()}"
        children = iter(parts(ch[1:]))
        for child in children:
            if child.__class__ is tuple and child[0] == "param":
                params[child[1][0].lower()] = self.number(child[1][1], line, f"{child[1][0]}=")
            elif kind == "pwl" and _is_word(child, "r", "td"):
                params[child.lower()] = self.number(next(children, child), line, f"the value of {child}")
            else:
                args.append(self.number(child, line, what))
        if "file" in params:
            raise self.fail(
                "E113", "PWL file= is not supported yet", line, ch[0], "write the points: PWL(t1 v1 t2 v2 ..)"
            )
        wave = Waveform(kind, args, params, line.span_at(*extent(item)))
        if kind == "pwl" and len(args) % 2:
            raise self.fail(
                "E114", "PWL needs pairs of time and value", line, item, "form: PWL(t1 v1 t2 v2 ..)"
            )
        return wave

    def on_behavioural(self, ch: list[Any], line: Line) -> Element:
        e = self.element("b", ch, 2, line)
        for item in self.params(ch[3:], line, e):
            if e.value is not None:
                raise self.fail("E102", f"{ch[0]} has a second V= or I= here", line, item)
            e.extra["output"] = item[1][0].lower()
            e.value = expression(item[1][1], line)
            e.value_span = line.span_at(*extent(item[1][1]))
        if e.value is None:
            raise self.fail("E109", f"{ch[0]} has no V= or I=", line, ch[0], form("b"))
        return e

    # ---- E, G, F, H ----

    def on_linear(self, ch: list[Any], line: Line) -> Element:
        e = self.element(ch[0][0].lower(), ch, 4, line)
        e.extra["form"] = "linear"
        self.gain(e, ch[0], self.params(ch[5:], line, e), line)
        return e

    def gain(self, e: Element, name: Any, rest: list[Any], line: Line) -> None:
        if not rest:
            if "gain" in e.params:
                e.value = e.params.pop("gain")
                return
            from .mistakes import missing_mark

            hint = missing_mark("gear") if name.lower() == "gear" else form(e.letter)
            raise self.fail("E109", f"{name} has no gain", line, name, hint)
        e.value, e.value_span = self.number(rest[0], line, "the gain"), line.span_at(*extent(rest[0]))
        if len(rest) > 1:
            raise self.fail("E102", f"`{rest[1]}` does not fit here", line, rest[1], form(e.letter))

    def on_poly(self, ch: list[Any], line: Line) -> Element:
        e = self.element(ch[0][0].lower(), ch, 2, line)
        dims, rest = self.dimensions(ch, line), ch[5:]
        if len(rest) < 2 * dims:
            raise self.fail(
                "E109", f"POLY({dims}) needs {2 * dims} control nodes", line, ch[3], form(e.letter)
            )
        nodes = []
        for item in rest[: 2 * dims]:
            if item.__class__ is tuple:
                raise self.fail("E102", "a control node is expected here", line, item)
            nodes.append(node_name(item))
        e.extra.update(form="poly", dims=dims, controls=list(zip(nodes[0::2], nodes[1::2], strict=True)))
        e.extra["coeffs"] = [self.number(v, line, "a coefficient") for v in rest[2 * dims :]]
        return e

    def dimensions(self, ch: list[Any], line: Line) -> int:
        dims = spice_number(ch[4])
        if dims is None or dims < 1 or dims != int(dims) or dims > 100:
            raise self.fail("E110", "POLY(n) needs a whole number n", line, ch[4], form(ch[0][0].lower()))
        return int(dims)

    def on_formula(self, ch: list[Any], line: Line) -> Element:
        letter = ch[0][0].lower()
        e = self.element(letter, ch, 2, line)
        key = ch[3].lower()
        if key in (("i", "cur") if letter == "e" else ("v", "vol")):
            right = "V=" if letter == "e" else "I="
            other = "a G source gives a current" if letter == "e" else "an E source gives a voltage"
            raise self.fail("E115", f"{letter.upper()} sources take {right}", line, ch[3], other)
        e.extra["form"] = "expr"
        e.value, e.value_span = expression(ch[4], line), line.span_at(*extent(ch[4]))
        self.params(ch[5:], line, e)
        return e

    def on_table(self, ch: list[Any], line: Line) -> Element:
        e = self.element(ch[0][0].lower(), ch, 2, line)
        start = 5 if ch[4].__class__ is tuple else 4
        e.value = expression(ch[4], line)
        e.value_span = line.span_at(*extent(ch[4]))
        numbers = [self.number(v, line, "a table value") for v in ch[5:]]
        if len(numbers) < 2 or len(numbers) % 2:
            raise self.fail("E114", "TABLE needs pairs (x,y)", line, ch[start - 1], form(e.letter))
        e.extra.update(form="table", table=list(zip(numbers[0::2], numbers[1::2], strict=True)))
        return e

    def on_current_linear(self, ch: list[Any], line: Line) -> Element:
        e = self.element(ch[0][0].lower(), ch, 2, line)
        e.extra.update(form="linear", controls=[ch[3].lower()])
        self.gain(e, ch[0], self.params(ch[4:], line, e), line)
        return e

    def on_current_poly(self, ch: list[Any], line: Line) -> Element:
        e = self.element(ch[0][0].lower(), ch, 2, line)
        dims, rest = self.dimensions(ch, line), ch[5:]
        if len(rest) < dims or any(r.__class__ is tuple for r in rest[:dims]):
            raise self.fail(
                "E109", f"POLY({dims}) needs {dims} controlling sources", line, ch[3], form(e.letter)
            )
        e.extra.update(form="poly", dims=dims, controls=[str(r.lower()) for r in rest[:dims]])
        e.extra["coeffs"] = [self.number(v, line, "a coefficient") for v in rest[dims:]]
        return e

    # ---- D, S, W, K, X and the letters that come later ----

    def on_diode(self, ch: list[Any], line: Line) -> Element:
        e = self.element("d", ch, 2, line)
        e.model_name, e.model_span = ch[3].lower(), line.span(ch[3])
        for item in self.params(ch[4:], line, e):
            value = self.value(item, line)
            if value == "off":
                e.params["off"] = 1.0
            elif isinstance(value, str) or "area" in e.params:
                raise self.fail("E102", f"`{item}` does not fit here", line, item, form("d"))
            else:
                e.params["area"] = value
        return e

    def on_switch(self, ch: list[Any], line: Line) -> Element:
        e = self.element("s", ch, 4, line)
        return self.switched(e, ch[5], ch[6:], line)

    def on_current_switch(self, ch: list[Any], line: Line) -> Element:
        e = self.element("w", ch, 2, line)
        e.extra["controls"] = [ch[3].lower()]
        return self.switched(e, ch[4], ch[5:], line)

    def switched(self, e: Element, model: Any, rest: list[Any], line: Line) -> Element:
        e.model_name, e.model_span = model.lower(), line.span(model)
        e.extra["initial"] = None
        for item in self.params(rest, line, e):
            if item not in ("on", "off", "ON", "OFF", "On", "Off"):
                raise self.fail("E102", f"`{item}` does not fit here", line, item, form(e.letter))
            e.extra["initial"] = item.lower()
        return e

    def on_coupling(self, ch: list[Any], line: Line) -> Element:
        e = self.element("k", ch, 0, line)
        rest = self.params(ch[1:], line, e)
        if "k" in e.params:
            rest.append(ch[-1])
        if len(rest) < 3:
            raise self.fail("E109", f"{ch[0]} needs two inductors and a coupling", line, ch[0], form("k"))
        for item in rest[:-1]:
            if not isinstance(item, str):
                raise self.fail("E109", f"{ch[0]} needs the names of inductors here", line, item, form("k"))
        e.extra["inductors"] = [str(r.lower()) for r in rest[:-1]]
        e.value_span = line.span_at(*extent(rest[-1]))
        e.value = e.params.pop("k") if "k" in e.params else self.number(rest[-1], line, "the coupling")
        return e

    def on_instance(self, ch: list[Any], line: Line) -> Instance:
        refs: list[Ref] = []
        params: dict[str, Any] = {}
        for item in ch[1:]:
            if item.__class__ is not tuple:
                if item.lower() not in ("params:", "param:"):
                    refs.append(Ref(node_name(item), None, (line, item.start_pos, item.end_pos)))
            elif item[0] == "point":
                inner = item[1]
                point = tuple(machine_value(v, line) for v in parts(inner[1:]))
                refs.append(Ref(inner[0].lower(), point, line.span_at(*extent(item))))
            else:
                params[str(item[1][0].lower())] = expression(item[1][1], line)
        if not refs:
            raise self.fail("E109", f"{ch[0]} names no subcircuit", line, ch[0], form("x"))
        of = refs.pop()
        return Instance(ch[0].lower(), params, (line, ch[0].start_pos, ch[0].end_pos), refs, of)

    def on_device(self, ch: list[Any], line: Line) -> Element:
        e = self.element(ch[0][0].lower(), ch, 0, line)
        rest = self.params(ch[1:], line, e)
        e.extra["words"] = [(self.value(i, line) if i.__class__ is tuple else str(i.lower())) for i in rest]
        e.extra["word_spans"] = [line.span_at(*extent(i)) for i in rest]
        return e

    def element(self, letter: str, ch: list[Any], nodes: int, line: Line) -> Element:
        return Element(letter, ch[0].lower(), [node_name(n) for n in ch[1 : 1 + nodes]], line.span(ch[0]))

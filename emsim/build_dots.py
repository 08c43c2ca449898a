"""Dot cards. One method per grammar rule, named `on_` + the rule; blocks open and close on the builder's stack."""

from __future__ import annotations

from .build_elements import Cards, form
from .build_expr import expression, extent, machine_value, node_name
from .deck import (
    MATRIX_TYPES,
    MOTOR_TYPES,
    Analysis,
    Conditional,
    Deck,
    Dot,
    Func,
    Include,
    Model,
    Param,
    Print,
    Probe,
    Subckt,
)
from .diagnostics import Diagnostic, Fix
from .expr import Binary, Call, Name, Num, names
from .parsed import parse_line
from .source import Leaf, Line, SourceFile
from .syntax import LineError, code_end, first_word
from .units import spice_leftover, spice_number

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from typing import Any

# analyses kept as text: later stages say that they do not run yet
_ANALYSES = frozenset("noise tf sens pz disto sp hb data modes mc optran".split())
# words of LTspice's .tran, and what to do without them
LTSPICE_TRAN = {
    "steady": ": .ss finds the periodic steady state",
    "nodiscard": "; tstart says from when on rows are kept",
    "step": "; what jumps in the steady state is a PULSE",
}
_LARGEST_STEP = ("maxstep", "tmax", "dtmax")
PRINT_KINDS = frozenset(("tran", "op", "ac", "dc", "noise", "tf", "disto", "sens", "pz"))
# text cards of other programs that say what the circuit is
_OF_THE_CIRCUIT = {
    "connect": "give both nodes one name",
    "alter": "write a deck for each case, or .param and -D name=value",
    "loadbias": "set the voltages with .nodeset",
}
BESIDE = (
    "base",
    "afterwards",
    "facts",
    "failure",
    "gaps",
    "pencil",
    "rest",
    "watch",
)  # files of analyses/ that are none
_KEPT = frozenset(("plot", "graph"))  # everything else among the text cards is dropped in silence


class DotCards(Cards):
    """Everything that begins with a dot."""

    file: SourceFile
    deck: Deck
    body: list[Any]
    stack: list[tuple[str, list[Any], Any]]

    # ---- analyses ----

    def on_tran(self, ch: list[Any], line: Line) -> Analysis:
        return self.analysis("tran", ch, line)

    def on_op(self, ch: list[Any], line: Line) -> Analysis:
        return self.analysis("op", ch, line)

    def on_sweep(self, ch: list[Any], line: Line) -> Analysis:
        return self.analysis(str(ch[0][1:].lower()), ch[1:], line)

    def analysis(self, kind: str, ch: list[Any], line: Line) -> Analysis:
        """Numbers in order; the words uic, static and startup are flags."""
        args: list[Any] = []
        flags: set[str] = set()
        largest: Any = None
        for item in ch:
            if (
                item.__class__ is tuple
                and item[0] == "param"
                and kind == "tran"
                and item[1][0].lower() in _LARGEST_STEP
            ):
                largest = self.number(item[1][1], line, "the largest step")
                continue
            value = self.value(item, line) if item.__class__ is not tuple or item[0] == "braced" else None
            if value in ("uic", "static", "skipbp") or (value == "startup" and kind == "tran"):
                flags.add("uic" if value == "skipbp" else value)  # PSpice's word
            elif value is None or (kind in ("tran", "op") and isinstance(value, str)):
                raise self.strange_word(kind, item, line)
            else:
                args.append(value)
        if kind == "tran" and (dialect := line.file.dialect) is not None and dialect.short_tran and args:
            args = [0.0, *args] if len(args) == 1 else args
            if args[0] == 0.0:
                stop = args[1]
                args[0] = 1e-3 * stop if isinstance(stop, float) else Binary("*", Num(1e-3), stop)
        if kind == "tran" and not 2 <= len(args) <= 4:
            said = ".tran needs a step and a stop time" if len(args) < 2 else ".tran takes at most four times"
            hint = "form: .tran tstep tstop [tstart [tmax]] [uic] [startup]"
            if len(args) == 1 and isinstance(args[0], float):
                # LTspice's form, which leaves the grid to the viewer
                hint = f"LTspice's form has the stop time alone; here write .tran {_short(args[0] / 1000)} {_short(args[0])}"
                hint += ", or run it with --dialect ltspice"
            raise LineError(Diagnostic("error", "E118", said, line.whole, hint))
        if largest is not None:
            args = [*args[:3], *([0.0] * (3 - len(args))), largest]
        if kind == "tran" and "," in line.text:
            from .slips import judge_commas

            judge_commas(line, (0, len(line.text)), self.sink)
        return Analysis(kind, args, flags, line.whole)

    def strange_word(self, kind: str, item: Any, line: Line) -> LineError:
        """A word that no .tran takes: a unit apart, one of LTspice's, or any other."""
        span = line.span_at(*extent(item))
        if kind != "tran" or span.text.lower() not in LTSPICE_TRAN:
            return self.second_value(f"`{span.text}` does not fit here", line, item, form("." + kind))
        said = f"`{span.text}` is a word of LTspice's .tran, and not supported"
        without = Fix(span, "", f"leave `{span.text}` out" + LTSPICE_TRAN[span.text.lower()])
        return LineError(Diagnostic("error", "E113", said, span, fixes=[without]))

    def on_text(self, ch: list[Any], line: Line) -> Any:
        kind = str(ch[0][1:].lower())
        rest = line.text[ch[1].start_pos : code_end(line.text)] if len(ch) > 1 else ""
        if kind == "title":
            self.deck.title = rest
        elif kind == "hdl":
            if len(ch) < 2:
                hint = 'form: .hdl "file.va"'
                raise LineError(Diagnostic("error", "E118", ".hdl names no file", line.whole, hint))
            return Dot("hdl", _unquoted(rest.strip()), line.whole)
        elif kind in _OF_THE_CIRCUIT:
            hint = _OF_THE_CIRCUIT[kind]
            raise LineError(Diagnostic("error", "E113", f".{kind} is not supported", line.span(ch[0]), hint))
        elif kind in ("meas", "measure"):
            from .build_measure import measure

            return measure(line, ch[0].end_pos)
        elif kind in ("four", "fourier"):
            from .build_measure import fourier

            return fourier(line, ch[0].end_pos)
        elif kind == "fmu":
            from .build_fmu import fmu

            return fmu(line, ch[0].end_pos)
        elif is_analysis(kind):
            return Analysis(kind, self.words(kind, ch, line), set(), line.whole)
        elif kind == "step":
            return Dot("step", self.words(kind, ch, line, ","), line.whole)
        elif kind in _ANALYSES:
            return Analysis(kind, rest.split(), set(), line.whole)
        elif kind in _KEPT:
            return Dot(kind, rest.split(), line.whole)
        return None

    def words(self, kind: str, ch: list[Any], line: Line, between: str = "") -> list[Any]:
        """What stands behind a dot word, as an analysis takes it: numbers, names, signals; expressions in braces are still to
        be evaluated. `between` separates as blanks do."""
        import re

        found: list[Any] = []
        start, end = (ch[1].start_pos, code_end(line.text)) if len(ch) > 1 else (0, 0)
        for word in re.finditer(
            rf"\{{[^}}]*\}}|[^\s({between}]*\([^)]*\)|[^\s{between}]+", line.text[start:end]
        ):
            text = word[0]
            if text[0] == "{":
                first, last = start + word.start() + 1, start + word.end() - 1
                place = Line(line.file, line.number, line.col + first, line.start + first, line.start + last)
                found.append(expression(parse_line(place, "expression"), place))
            else:
                value = None if kind == "pz" else spice_number(text)  # nodes may be numbers
                found.append(text.lower() if value is None else value)
        return found

    def on_unknown(self, ch: list[Any], line: Line) -> Any:
        word = str(ch[0][1:].lower())
        if word == "fourier":
            from .build_measure import fourier

            return fourier(line, ch[0].end_pos)
        if is_analysis(word):
            return Analysis(word, self.words(word, ch, line), set(), line.whole)
        if word in ("prot", "unprot"):  # HSPICE's marks about what it does not list
            return None
        from .mistakes import unknown_dot

        raise LineError(unknown_dot(line, ch[0].lower()))

    # ---- what is asked for ----

    def on_print(self, ch: list[Any], line: Line) -> Print:
        kind = "tran"
        if ch and ch[0].__class__ is tuple and ch[0][0] == "print_kind":
            kind, ch = str(ch[0][1][0].lower()), ch[1:]
        elif len(ch) > 1 and ch[0].__class__ is not tuple and is_analysis(ch[0].lower()):
            kind, ch = str(ch[0].lower()), ch[1:]
        return Print(kind, [(p.text, p.ast) for p in self.probes(ch, line)], line.whole)

    def probes(self, ch: list[Any], line: Line) -> list[Probe]:
        out, name = [], ""
        for item in ch:
            if item.__class__ is tuple and item[0] == "format":
                key, _, value = line.text[slice(*extent(item))].partition("=")
                name = key.strip().lower() if value.strip().lower() == "par" else ""  # out=par('v(a)-v(b)')
                continue
            span = line.span_at(*extent(item))
            ast = expression(item, line)
            if isinstance(ast, Num):
                ast = Name(span.text.lower(), span)  # a node whose name is a number
            start, end = extent(item)
            text = " ".join(line.text[start:end].split())
            if isinstance(ast, Call) and ast.fn == "par" and len(ast.args) == 1:
                # ngspice's brackets about an expression
                ast, text = ast.args[0], text[text.index("(") + 1 : -1].strip()
            out.append(Probe(name or text, ast, span))
            name = ""
        return out

    def piece_by_piece(self, line: Line, word: str) -> Any:
        """A card that asks for signals, of which some cannot be read: those get a warning and are left out."""
        import re

        text = line.text[: code_end(line.text)]
        named = {m.end(): m for m in re.finditer(r"(?<![\w.$])([a-z_]\w*)\s*=\s*(?=par\s*\()", text, re.I)}
        pieces = _without_names(_pieces(text, len(word)), named)
        kind = "tran"
        if word == ".print" and pieces and line.text[slice(*pieces[0])].lower() in PRINT_KINDS:
            kind = line.text[slice(*pieces.pop(0))].lower()
        found = []
        for start, end in pieces:
            span = line.span_at(start, end)
            piece = Line(line.file, span.line, span.col, line.start + start, line.start + end)
            if word == ".probe" and (of := _of_terminals(span.text, span)) is not None:
                found.append(of)
                continue
            try:
                found += self.probes([parse_line(piece, "expression")], piece)
                if start in named:  # out=par('v(a)-v(b)')
                    found[-1].text = named[start][1].lower()
            except LineError:
                said = f"`{span.text}` is nothing that {word} can show, and is left out"
                self.sink.warning(
                    "W287", said, span, "signals stand with blanks between them: v(a) i(v1) {v(a)*2}"
                )
        if word != ".print":
            return Dot(word[1:], found, line.whole)
        return Print(kind, [(p.text, p.ast) for p in found], line.whole)

    def on_save(self, ch: list[Any], line: Line) -> Dot:
        return Dot("save", self.probes(ch, line), line.whole)

    def on_probe(self, ch: list[Any], line: Line) -> Dot:
        found = self.probes(ch, line) or [Probe("alli", Name("alli", line.whole), line.whole)]
        return Dot("probe", [_of_terminals(p.span.text, p.span) or p for p in found], line.whole)

    def on_ic(self, ch: list[Any], line: Line) -> Dot:
        return self.conditions("ic", ch, line)

    def on_nodeset(self, ch: list[Any], line: Line) -> Dot:
        return self.conditions("nodeset", ch, line)

    def conditions(self, kind: str, ch: list[Any], line: Line) -> Dot:
        items = []
        for _, (target, value) in ch:
            if target.__class__ is not tuple or target[0] != "voltage" or len(target[1]) != 3:
                hint = "an inductor, a capacitor or a joint starts with its own ic="
                raise self.fail("E119", f".{kind} sets node voltages: v(node)=value", line, target, hint)
            name = expression(target, line).args[0].id  # type: ignore[attr-defined]
            items.append((name, expression(value, line), line.span_at(*extent(target))))
        return Dot(kind, items, line.whole)

    # ---- names and values ----

    def on_param_card(self, ch: list[Any], line: Line) -> None:
        shared = line.text[:4].lower() == ".csp"
        for rule, parts in ch:
            if rule == "definition":
                self.body.append(self.definition(parts, line))
            else:
                name, value = parts[0], expression(parts[1], line)
                if shared:
                    self.deck.shared.append((str(name.lower()), value))
                    if name.lower() in names(value):
                        continue  # .csparam t = t: only commands see it under this name
                self.body.append(Param(name.lower(), value, line.span(name)))

    def on_func_card(self, ch: list[Any], line: Line) -> None:
        for _, parts in ch:
            self.body.append(self.definition(parts, line))

    def definition(self, parts: list[Any], line: Line) -> Func:
        names = [str(p.lower()) for p in parts[1:-1]]
        return Func(str(parts[0].lower()), names, expression(parts[-1], line), line.span(parts[0]))

    def row(self, leaf: Any, line: Line) -> list[Any]:
        """[{k} 1 {2*k}]: numbers, and what the level's parameters make of the rest."""
        import re

        found: list[Any] = []
        for piece in re.finditer(r"\{[^}]*\}|[^\s,\[\]{}]+", leaf):
            start = line.start + leaf.start_pos + piece.start()
            where = line.span_at(leaf.start_pos + piece.start(), leaf.start_pos + piece.end())
            place = Line(line.file, where.line, where.col, start, start + len(piece[0]))
            found.append(expression(parse_line(place, "expression"), place))
        return found

    def on_model(self, ch: list[Any], line: Line) -> Model:
        params: dict[str, Any] = {}
        spans = {}
        kind = str(ch[1].lower())
        alone = ""  # a name that a value may follow without an equals sign
        for item in ch[2:]:
            named, alone = alone, ""
            if item.__class__ is tuple and item[0] == "model_param":
                key, value = item[1]
                name = str(key.lower())
                params.pop(name, None)  # in the order in which they last stand
                if value.__class__ is not tuple and value.type == "BRACKETED":
                    params[name] = self.row(value, line) if "{" in value else str(value)
                elif value.__class__ is not tuple and value.type == "NAME_IN_QUOTES":
                    # a number, the name of a file, a table such as 01z1
                    inner = _inside(value)
                    params[name] = str(inner.lower()) if spice_leftover(inner) else self.word(inner, line)
                elif name == "version" and value.__class__ is not tuple and value.count(".") > 1:
                    params[name] = _version(value)
                elif kind in MOTOR_TYPES and value.__class__ is not tuple:
                    number = spice_number(value)  # its unit is judged by the MOTOR, as on the card
                    params[name] = str(value.lower()) if number is None else number
                else:
                    params[name] = self.value(value, line)
                spans[name] = line.span_at(*extent(item))
            elif (
                kind in MATRIX_TYPES
                and params
                and (item.__class__ is tuple or spice_number(item) is not None)
            ):
                before = params[name]
                params[name] = [*(before if isinstance(before, list) else [before]), self.value(item, line)]
            elif named and (item.__class__ is tuple or spice_number(item) is not None):
                params[named] = self.value(item, line)
            elif item.__class__ is tuple:
                raise self.fail("E102", "a value stands here without a name", line, item)
            else:
                alone = str(item.lower())
                params[alone] = 1.0
                spans[alone] = line.span(item)
        if line.file.dialect is not None:
            kind = line.file.dialect.model(kind, params)
        return Model(str(ch[0].lower()), kind, params, line.span(ch[0]), spans)

    def on_options(self, ch: list[Any], line: Line) -> Dot:
        items: list[tuple[str, Any, Any]] = []
        for item in ch:
            if item.__class__ is tuple:
                items.append((item[1][0].lower(), self.value(item[1][1], line), line.span_at(*extent(item))))
            elif items and items[-1][1] is True and spice_number(item) is not None:
                # .options reltol 1e-5: the value without its `=`
                items[-1] = (items[-1][0], self.value(item, line), items[-1][2])
            else:
                items.append((item.lower(), True, line.span(item)))
        return Dot("options", items, line.whole)

    def on_temp(self, ch: list[Any], line: Line) -> Dot:
        values = [self.number(item, line, "the temperature") for item in ch]
        if not values:
            raise LineError(
                Diagnostic(
                    "error", "E118", ".temp needs a temperature in Celsius", line.whole, "form: .temp 85"
                )
            )
        return Dot("temp", values, line.whole)

    def on_global(self, ch: list[Any], line: Line) -> Dot:
        return Dot("global", [str(n.lower()) for n in ch], line.whole)

    # ---- the machine as a whole ----

    def on_gravity(self, ch: list[Any], line: Line) -> Dot:
        values = [machine_value(item, line) for item in ch]
        if len(values) > 3 or any(isinstance(v, str) for v in values):
            raise LineError(
                Diagnostic(
                    "error", "E118", ".gravity takes g, or gx gy [gz]", line.whole, "form: .gravity 9.81"
                )
            )
        return Dot("gravity", values, line.whole)

    def on_view(self, ch: list[Any], line: Line) -> Dot:
        """`items`: (word, value, place); of a word without `=` the value is None."""
        items: list[tuple[str, Any, Any]] = []
        for c in ch:
            if c.__class__ is tuple:
                items.append((c[1][0].lower(), machine_value(c[1][1], line), line.span_at(*extent(c))))
            else:
                items.append((c.lower(), None, line.span(c)))
        return Dot("view", items, line.whole)

    # ---- structure ----

    def on_include(self, ch: list[Any], line: Line) -> Include:
        return Include(_unquoted(ch[0]), None, line.span(ch[0]))

    def on_lib(self, ch: list[Any], line: Line) -> Include | None:
        import re

        rest = re.sub(r"\s*(;|(^|\s)(\$|//)).*", "", ch[1], flags=re.DOTALL).rstrip() if len(ch) > 1 else ""
        dialect = line.file.dialect
        # LTspice and PSpice have no sections: the rest of the line is the path, with its blanks
        if rest and (re.search(r"[\s./\\]", rest) or (dialect is not None and not dialect.sections)):
            end = ch[1].start_pos + len(rest)
            return Include(line.text[ch[0].start_pos : end], None, line.span_at(ch[0].start_pos, end))
        if rest:
            return Include(_unquoted(ch[0]), rest.lower(), line.span(ch[0]))
        if self.deck.file.has_sections:
            section: list[Any] = []
            self.deck.sections[_unquoted(ch[0]).lower()] = section
            self.push("lib", section, line)
            return None
        return Include(_unquoted(ch[0]), None, line.span(ch[0]))

    def on_endl(self, ch: list[Any], line: Line) -> None:
        self.pop("lib", line)

    def on_subckt(self, ch: list[Any], line: Line) -> None:
        ports: list[str] = []
        params: dict[str, Any] = {}
        for item in ch[1:]:
            if item.__class__ is tuple:
                params[str(item[1][0].lower().removeprefix("params:"))] = expression(item[1][1], line)
            elif item.lower() == "?":  # a terminal that nobody uses
                ports.append(f"?{len(ports)}")
            elif item.lower() not in ("params:", "param:"):
                ports.append(node_name(item))
        subckt = Subckt(str(ch[0].lower()), ports, params, line.span(ch[0]), self.file)
        self.body.append(subckt)
        self.push("subckt", subckt.body, line)

    def on_ends(self, ch: list[Any], line: Line) -> None:
        self.pop("subckt", line)

    def on_if(self, ch: list[Any], line: Line) -> None:
        conditional = Conditional(line.whole)
        conditional.branches.append((expression(ch[0], line), []))
        self.body.append(conditional)
        self.push("if", conditional.branches[-1][1], line)
        self.stack[-1] = ("if", self.stack[-1][1], conditional)

    def on_elseif(self, ch: list[Any], line: Line) -> None:
        self.branch(expression(ch[0], line), line)

    def on_else(self, ch: list[Any], line: Line) -> None:
        self.branch(None, line)

    def branch(self, condition: Any, line: Line) -> None:
        if not self.stack or self.stack[-1][0] != "if":
            raise LineError(
                Diagnostic("error", "E106", f"`{first_word(line.text)}` stands in no .if", line.whole)
            )
        conditional = self.stack[-1][2]
        conditional.branches.append((condition, []))
        self.body = conditional.branches[-1][1]

    def on_endif(self, ch: list[Any], line: Line) -> None:
        self.pop("if", line)

    def on_end(self, ch: list[Any], line: Line) -> None:
        pass

    def push(self, kind: str, body: list[Any], line: Line) -> None:
        self.stack.append((kind, self.body, line))
        self.body = body

    def pop(self, kind: str, line: Line) -> None:
        if not self.stack or self.stack[-1][0] != kind:
            opener = self.stack[-1][0] if self.stack else None
            message = f"`{first_word(line.text)}` closes nothing" + (f"; .{opener} is open" if opener else "")
            raise LineError(Diagnostic("error", "E106", message, line.whole))
        self.body = self.stack.pop()[1]


def _short(time: float) -> str:
    """A time as people write it: 5u."""
    for scale, letter in ((1.0, ""), (1e-3, "m"), (1e-6, "u"), (1e-9, "n")):
        if time >= scale * (1.0 - 1e-9):
            return f"{time / scale:.6g}{letter}"
    return f"{time / 1e-12:.6g}p"


def _version(text: str) -> float | str:
    """4.8.1 is 4.81: cards write a version either way."""
    first, *others = text.split(".")
    digits = "".join(others)
    return float(f"{first}.{digits}") if (first + digits).isdigit() else text.lower()


def _inside(leaf: Leaf) -> Leaf:
    """A quoted leaf without its quotes, at its place."""
    inner = Leaf(leaf[1:-1])
    inner.type, inner.start_pos, inner.end_pos = "WORD", leaf.start_pos + 1, leaf.end_pos - 1
    return inner


def _pieces(text: str, start: int) -> Iterator[tuple[int, int]]:
    """Start and end of what stands between blanks and commas, brackets taken whole, from `start` on."""
    begin, depth = -1, 0
    for at in range(start, len(text) + 1):
        c = text[at] if at < len(text) else " "
        depth = max(0, depth + (c in "({[") - (c in ")}]"))
        if depth == 0 and (c.isspace() or c == "," or (c == "+" and text[:at].rstrip(" \t").endswith("\n"))):
            if begin >= 0:
                yield begin, at
            begin = -1
        elif begin < 0:
            begin = at
    if begin >= 0:
        yield begin, len(text)


def _without_names(pieces: Iterable[tuple[int, int]], named: dict[int, Any]) -> list[tuple[int, int]]:
    """Pieces without what stands before the end of a name, name =: `out=par(v(a))` begins at `par`."""
    found = []
    for start, end in pieces:
        inside = [at for at, m in named.items() if m.start() <= start < at]
        if inside and end <= inside[0]:
            continue
        found.append((inside[0] if inside else start, end))
    return found


def _of_terminals(text: str, span: Any) -> Probe | None:
    """vd(m1:d:s), i(m1:s), p(q1), i(x1) of .probe: a device with terminals, or two of them; None for any other signal."""
    import re

    found = re.fullmatch(r"(vd|p|i)\s*\(([^(){}]+)\)", text.strip().lower())
    if found is None:
        return None
    words = ["".join(word.split()) for word in found[2].split(",")]
    if found[1] == "i" and len(words) == 2 and ":" not in found[2]:
        words = [":".join(words)]  # i(m1, 3)
    plain = found[1] == "i" and ":" not in words[0] and not words[0].startswith("x")
    if plain or len(words) > 2 or not all(re.fullmatch(r"[^\s:]+(:[^\s:]+){0,2}", word) for word in words):
        return None
    return Probe(" ".join(text.split()), Call(found[1], [Name(word, span) for word in words]), span, True)


def is_analysis(word: str) -> bool:
    """Has a dot word its file in analyses/? The list of what there is stands above this module."""
    from os.path import dirname, isfile, join

    return word.isalnum() and word not in BESIDE and isfile(join(dirname(__file__), "analyses", word + ".py"))


def _unquoted(leaf: Any) -> str:
    text = str(leaf)
    return text[1:-1] if text[:1] in "\"'" else text

"""Expression trees become ASTs; numbers get their value by the rule of the card they stand on."""

from __future__ import annotations

from . import units
from .diagnostics import Diagnostic, Fix, Span
from .expr import PAST, TRANSFORM, Binary, Call, Cond, Name, Node, Num, Unary, rewritten, ticks_ago
from .source import Line
from .syntax import LineError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

_SEEN: dict[str, float] = {}  # numbers in expressions that need no remark, and their values
MAX_DEPTH = 150  # of the expression's tree
MAX_CHAIN = 100  # operators of one precedence in a row, sums and products apart


def extent(tree: Any) -> tuple[int, int]:
    """Start and end of a tree in its line."""
    first = last = tree
    while first.__class__ is tuple:
        first = first[1][0]
    while last.__class__ is tuple:
        last = last[1][-1]
    return first.start_pos, last.end_pos


def parts(children: list[Any]) -> list[Any]:
    """Children without brackets and commas, where a rule keeps them for its extent."""
    return [c for c in children if c.__class__ is tuple or c.type[0] != "_"]


def expression(tree: Any, line: Line, machine: bool = False, depth: int = 0) -> Node:
    """The AST of an expression's tree. On machine cards (`machine`) numbers obey the unit rule."""
    if tree.__class__ is not tuple:
        if tree.type == "NUMBER":
            return Num(_number_in_expression(tree, line, machine), (line, tree.start_pos, tree.end_pos))
        name, dialect = tree.lower(), line.file.dialect
        if dialect is not None:
            name = dialect.names.get(name, name)
        return Name(name, (line, tree.start_pos, tree.end_pos))
    rule, children = tree
    if rule in ("group", "quoted", "braced"):
        # brackets that only bracket do not count as depth of the expression
        return expression(children[1], line, machine, depth + 1)
    if depth > MAX_DEPTH:
        said, hint = (
            f"the expression is nested more than {MAX_DEPTH} deep",
            "give parts of it names with .param or .func",
        )
        raise LineError(Diagnostic("error", "E104", said, line.span_at(*extent(tree)), hint))
    if rule in CHAINS:
        return _chain(tree, line, machine, depth + 1)
    at, dialect = (line, *extent(tree)), line.file.dialect
    if rule == "unary":
        if dialect is not None and dialect.excludes:
            _check_either(tree, line)
        op = "!" if children[0].type == "NOT" else str(children[0])
        value = expression(children[1], line, machine, depth + 1)
        return Unary(op, value if dialect is None or op != "!" else dialect.truth(value), at)
    if rule == "cond":
        c, a, b = (expression(child, line, machine, depth + 1) for child in children)
        return Cond(c if dialect is None else dialect.truth(c), a, b, at)
    if rule == "call":
        fn = children[0].lower()
        args = [expression(child, line, machine, depth + 1) for child in children[2:-1:2]]
        if fn in ("vm", "vp", "vr", "vi", "vdb"):
            args = [Name(a.span.text, a.at) if isinstance(a, Num) and a.span else a for a in args]
        return Call(fn, args, at) if dialect is None else dialect.call(fn, args, at)
    if rule == "past":
        return Call(PAST, [Name(children[0].lower(), at), Num(_ticks_ago(children[1], line))], at)
    if rule not in ("voltage", "current"):
        text = line.span_at(*extent(tree)).text
        raise error_at(
            "E102", f"`{text}` does not fit here", line, tree, "a number or an expression stands here"
        )
    named: list[Node] = [Name(node_name(n), (line, n.start_pos, n.end_pos)) for n in children[1:-1:2]]
    if rule == "current" and len(named) == 2:  # of a winding: i(m1,2)
        if not children[3].isdecimal():
            raise error_at("E102", f"`{children[3]}` is no number of a winding", line, children[3], "i(m1,2)")
        named[1] = Num(float(children[3]), line.span(children[3]))
    return Call(rule[0] if rule == "voltage" else "i", named, at)


def _ticks_ago(leaf: Any, line: Line) -> float:
    ago = ticks_ago(leaf)
    if ago is None:
        said = f"`{leaf}` is no number of ticks"
        raise error_at("E102", said, line, leaf, "x[-1] is x as it was one tick before, x[-2] two")
    return float(ago)


def transform(tree: Any, line: Line) -> Node:
    """The AST of a transfer function, whose variable is `s`; in it `^` is a power in every dialect."""
    file = line.file
    dialect, file.dialect = file.dialect, None
    try:
        node = expression(tree, line)
    finally:
        file.dialect = dialect
    return renamed(node, "s", TRANSFORM)


def renamed(node: Node, name: str, to: str) -> Node:
    """With another name for each `name` in it."""
    return rewritten(node, lambda n: Name(to, n.at) if isinstance(n, Name) and n.id == name else None)


CHAINS = ("binary", "either", "both", "compared")
_OPS = {"^": "**", "<>": "!=", "=": "==", "|": "||", "&": "&&", "or": "||", "and": "&&"}


def _chain(tree: Any, line: Line, machine: bool, depth: int) -> Node:
    """a op b op c ..: left-associative, built without recursion along the chain."""
    links: list[tuple[str, Node, int]] = []
    start, dialect = extent(tree)[0], line.file.dialect
    if dialect is not None and dialect.excludes:
        _check_either(tree, line)
    while tree.__class__ is tuple and tree[0] in CHAINS:
        rule, children = tree
        op = children[1].lower() if len(children) == 3 else ("or" if rule == "either" else "and")
        end = extent(children[-1])[1]
        named = "^" if op == "^" and dialect is not None and dialect.excludes else _OPS.get(op, str(op))
        links.append((named, expression(children[-1], line, machine, depth), end))
        tree = children[0]
    out = expression(tree, line, machine, depth)
    links.reverse()
    if len(links) > MAX_CHAIN:
        ops = {op for op, _, _ in links}
        for plus, minus in (("+", "-"), ("*", "/")):
            if ops <= {plus, minus}:
                # a sum of hundreds of terms is halved again and again, so that its tree stays flat
                terms = [(plus, out), *((op, node) for op, node, _ in links)]
                return _halved(terms, plus, minus, line.span_at(start, links[-1][2]))
        raise error_at(
            "E104",
            f"more than {MAX_CHAIN} operators in a row",
            line,
            tree,
            "group them with brackets or .param",
        )
    for op, b, end in links:
        at = (line, start, end)
        if op == "\\":
            out = Call("int", [Binary("/", out, b, at)], at)
        elif op == "%":
            out = Call("mod", [out, b], at)
        elif dialect is None:
            out = Binary(op, out, b, at)
        else:
            out = dialect.either(out, b, at) if op == "^" else dialect.operation(op, out, b, at)
    return out


def _check_either(tree: Any, line: Line) -> None:
    """`^` that means "either" binds looser than what stands beside it, the grammar's binds tighter: only where brackets say
    what belongs together both are the same."""
    for child in tree[1]:
        if child.__class__ is tuple and child[0] == "binary":
            signs = [c for c in child[1] if c.__class__ is not tuple and c == "^"]
            if signs and not any(c.__class__ is not tuple and c == "^" for c in tree[1]):
                raise error_at(
                    "E113", "`^` is no power in this dialect: it is true where one side is, not both", line, signs[0],
                    "put each side in brackets, and all of it; a power is a ** b",
                )  # fmt: skip


def _halved(terms: list[tuple[str, Node]], plus: str, minus: str, span: Span) -> Node:
    """A long sum (or product) as a balanced tree; the first term of `terms` counts as `plus`."""
    if len(terms) == 1:
        return terms[0][1]
    middle = len(terms) // 2
    left, right = terms[:middle], terms[middle:]
    op = right[0][0]
    if op == minus:
        right = [(minus if o == plus else plus, node) for o, node in right]
    return Binary(op, _halved(left, plus, minus, span), _halved(right, plus, minus, span), span)


def _number_in_expression(leaf: Any, line: Line, machine: bool) -> float:
    if machine:
        return machine_float(leaf, line)
    value = _SEEN.get(leaf)
    if value is not None:
        return value
    value = units.spice_number(leaf)
    assert value is not None  # the grammar's NUMBER
    if value == float("inf"):
        raise error_at("E110", "the number is too large", line, leaf)
    letters = units.split_number(leaf)[1].lower()  # type: ignore[index]
    if letters in units.MISREAD_UNITS:
        raise_to = Diagnostic(
            "warning",
            "W112",
            f"`{leaf}` is {value:g} here: SPICE does not know the unit `{letters}`",
            line.span(leaf),
            "units are understood on machine cards only; write the SI value",
        )
        line.file.remarks.append(raise_to)
    elif leftover := units.spice_leftover(leaf):
        line.file.remarks.append(ignored_letters(leaf, value, leftover, line))
    elif len(_SEEN) < 100_000:
        _SEEN[str(leaf)] = value
    return value


def ignored_letters(leaf: Any, value: float, leftover: str, line: Line) -> Diagnostic:
    """W110: letters at the end of a number that SPICE ignores and that may have been meant."""
    hint = "a number has one dot, and its scale letter stands at its end: 1.5k"
    if leftover[:2] in (
        "\u00c2\u00b5",
        "\u00ce\u00bc",
    ):  # a micro sign in UTF-8 that was taken for Latin-1 and encoded again
        hint = f"this is a micro sign that was encoded twice: write `{leaf[: -len(leftover)]}u`"
    elif (meant := units.infix(leaf)) is not None:
        hint = f"write `{meant}`, if that is what it is; LTspice alone reads it so (--dialect ltspice)"
    elif units.scale_of(leftover)[1] and leftover.isalpha():
        hint = f"the scale is `{units.scale_of(leftover)[1]}` here, as in 1.5k; behind it only units stand: ohm F H V A s Hz"
    return Diagnostic(
        "warning", "W110", f"`{leaf}` is read as {value:g}: SPICE ignores `{leftover[len(units.scale_of(leftover)[1]):]}`",
        line.span(leaf), hint,
    )  # fmt: skip


def machine_float(leaf: Any, line: Line) -> float:
    value = units.machine_number(leaf)
    if value is None:
        message, hint, plain = units.machine_number_problem(leaf)
        fixes = [] if plain is None else [Fix(line.span(leaf), plain)]
        raise LineError(Diagnostic("error", "E111", message, line.span(leaf), hint, fixes=fixes))
    misread = units.MISREAD_SUFFIXES.get(leaf.lstrip("+-.0123456789"))
    if misread is not None:
        read_as, meant, advice = misread
        digits = leaf[:-1]
        line.file.remarks.append(
            Diagnostic(
                "warning",
                "W112",
                f"`{leaf}` is {digits} {read_as}, not {digits} {meant}",
                line.span(leaf),
                f"write `{digits}{advice}`"
                + (f" ({meant} is the unit of this value already)" * (not advice)),
                fixes=[Fix(line.span(leaf), f"{digits}{advice}")],
            )
        )
    return value


def node_name(leaf: Any) -> str:
    """A node as the deck knows it: in lower case, without the quotes that KiCad writes about some."""
    name: str = leaf.lower()
    if name[0] in "\"'":
        name = name[1:-1]
    return "0" if name == "gnd" else name


# ---- values on machine cards ----


def machine_value(item: Any, line: Line) -> Any:
    """float (SI), word, tuple, or AST; a shape such as rod(0.3) is a Call."""
    if item.__class__ is not tuple:
        return machine_float(item, line) if units.split_number(item) is not None else str(item.lower())
    rule, ch = item
    if rule == "braced":
        node = expression(item, line, machine=True)
        return node.value if isinstance(node, Num) else node
    if rule == "tuple":
        return tuple(machine_value(c, line) for c in parts(ch))
    assert rule == "call_value", rule
    args: list[Node] = []
    named = ch[0].lower() == "stl"
    for child in parts(ch[1][1]):
        if named and not args:
            # the path of a file: no number, and its letters as they stand
            start, end = extent(child)
            args.append(Name(line.text[start:end], (line, start, end)))
            continue
        value = machine_value(child, line)
        if not isinstance(value, float | Node):
            around = child if ch[0].lower() in ("rod", "box", "disc") else item
            raise error_at("E116", f"`{ch[0]}` takes numbers", line, child, braces_around(around, line))
        args.append(value if isinstance(value, Node) else Num(value, line.span_at(*extent(child))))
    return Call(str(ch[0].lower()), args, line.span_at(*extent(item)))


def braces_around(item: Any, line: Line) -> str:
    """The hint where a name or a calculation stands bare on a machine card."""
    start, end = extent(item)
    return f"a parameter or a calculation stands in braces: {{{line.text[start:end]}}}"


def error_at(code: str, message: str, line: Line, leaf: Any, hint: str | None = None) -> LineError:
    return LineError(Diagnostic("error", code, message, line.span_at(*extent(leaf)), hint))

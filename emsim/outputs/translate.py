"""Python to JavaScript, for what films and the page draw alike (glyphs/): a small part of Python, statement by statement.

Functions, assignments, if, for, while, return, continue, break; numbers, texts, lists; arithmetic, comparisons, `a if c else b`,
comprehensions of one `for`, f-strings of plain fields, `in` and `get` for keys of shapes, calls without keywords. Names that a
module imports are those of the modules beside it, or the page's own. Docstrings and annotations go. Truth is asked of
numbers, flags and texts alone: an empty list is true in JavaScript. Anything else raises Unknown.
"""

from __future__ import annotations

import ast

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

OPERATORS = {
    ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.Mod: "%", ast.Pow: "**", ast.Eq: "===", ast.NotEq: "!==",
    ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.And: "&&", ast.Or: "||", ast.Not: "!", ast.USub: "-",
    ast.UAdd: "+",
}  # fmt: skip
FUNCTIONS = {
    "abs": "Math.abs",
    "min": "Math.min",
    "max": "Math.max",
    "int": "Math.trunc",
    "float": "Number",
    "str": "String",
    "list": "Array.from",
}
CONSTANTS = {"pi": "Math.PI", "inf": "Infinity"}  # of the module math


class Unknown(Exception):
    """Python that is not translated, with its place."""


BUILT_IN = {*FUNCTIONS, "math", "range", "len", "isinstance", "list", "all", "any"}


def script(sources: Sequence[str], exports: str, outer: Sequence[str] = ()) -> str:
    """Modules as one JavaScript expression; its value, `exports`, is JavaScript. A name stands for one thing in all of them;
    those of `outer` are the page's. Raises Unknown."""
    found: list[str] = []
    named: set[str] = set()
    read: set[str] = set()
    own: set[str] = set()
    for source in sources:
        for node in ast.parse(source).body:
            text = _top(node)
            if text is None:
                continue
            for one in _parts(node):
                if isinstance(one, ast.Name):
                    (read if isinstance(one.ctx, ast.Load) else own).add(one.id)
                elif isinstance(one, ast.FunctionDef):
                    own |= {one.name, *(a.arg for a in one.args.args)}
            name = node.name if isinstance(node, ast.FunctionDef) else text.split()[1]
            if name in named or name in outer:
                raise Unknown(f"two things are called {name}")
            named.add(name)
            found.append(text)
    if unknown := read - own - BUILT_IN - set(outer):
        raise Unknown(f"nobody says what these are: {', '.join(sorted(unknown))}")
    return "(() => {\n" + "\n".join(found) + f"\nreturn {exports};\n}})()"


def _parts(node: ast.AST) -> Iterator[ast.AST]:
    """All within, without annotations."""
    yield node
    for field, value in ast.iter_fields(node):
        for one in value if isinstance(value, list) else [value]:
            if isinstance(one, ast.AST) and field not in ("annotation", "returns"):
                yield from _parts(one)


def _top(node: ast.stmt) -> str | None:
    if isinstance(node, ast.FunctionDef):
        return _function(node)
    if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
        name = node.targets[0].id
        # types and the flag that imports them are Python's alone
        if name == "TYPE_CHECKING" or isinstance(node.value, (ast.Name, ast.Subscript)):
            return None
        return f"const {name} = {_value(node.value)};"
    if isinstance(node, (ast.Import, ast.ImportFrom, ast.If)) or _is_docstring(node):
        return None
    raise _unknown(node)


def _function(node: ast.FunctionDef) -> str:
    first = len(node.args.args) - len(node.args.defaults)
    words = [
        a.arg if k < first else f"{a.arg} = {_value(node.args.defaults[k - first])}"
        for k, a in enumerate(node.args.args)
    ]
    if node.args.vararg or node.args.kwonlyargs or node.args.kwarg:
        raise _unknown(node)
    own: dict[str, None] = {}
    for inner in node.body:
        _assigned(inner, own)
    names = [n for n in own if n not in {a.arg for a in node.args.args}]
    let = f"let {', '.join(names)};\n" if names else ""
    return f"function {node.name}({', '.join(words)}) {{\n{let}{_block(node.body)}}}"


def _assigned(node: ast.stmt, found: dict[str, None]) -> None:
    """Names that a statement sets, of the function that it stands in."""
    if isinstance(node, ast.FunctionDef):
        return
    targets: list[ast.expr] = []
    if isinstance(node, ast.Assign):
        targets = node.targets
    elif isinstance(node, (ast.AugAssign, ast.AnnAssign, ast.For)):
        targets = [node.target]
    for target in targets:
        found.update(
            (n.id, None) for n in ast.walk(target) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)
        )
    for part in ("body", "orelse"):
        for inner in getattr(node, part, []):
            _assigned(inner, found)


def _block(body: Sequence[ast.stmt]) -> str:
    return "".join(_statement(node) + "\n" for node in body if not _is_docstring(node))


def _statement(node: ast.stmt) -> str:
    match node:
        case ast.FunctionDef():
            return _function(node)
        case ast.Return():
            return f"return {_value(node.value)};" if node.value is not None else "return;"
        case ast.Assign():
            # the last target is set first in neither language: all have one value
            chain = " = ".join(_target(t) for t in node.targets)
            return f"{'' if isinstance(node.targets[0], ast.Name) else ';'}{chain} = {_value(node.value)};"
        case ast.AnnAssign() if node.value is not None:
            return f"{_target(node.target)} = {_value(node.value)};"
        case ast.AugAssign():
            return f"{_target(node.target)} {OPERATORS[type(node.op)]}= {_value(node.value)};"
        case ast.If():
            otherwise = f" else {{\n{_block(node.orelse)}}}" if node.orelse else ""
            return f"if ({_value(node.test)}) {{\n{_block(node.body)}}}{otherwise}"
        case ast.For() if not node.orelse:
            return f"for ({_target(node.target)} of {_value(node.iter)}) {{\n{_block(node.body)}}}"
        case ast.While() if not node.orelse:
            return f"while ({_value(node.test)}) {{\n{_block(node.body)}}}"
        case ast.Expr():
            return f"{_value(node.value)};"
        case ast.Continue():
            return "continue;"
        case ast.Break():
            return "break;"
    raise _unknown(node)


def _target(node: ast.expr) -> str:
    if isinstance(node, (ast.Tuple, ast.List)):
        return f"[{', '.join(map(_target, node.elts))}]"
    return _value(node)


def _value(node: ast.expr) -> str:
    match node:
        case ast.Constant(value=None):
            return "null"
        case ast.Constant(value=bool(flag)):
            return "true" if flag else "false"
        case ast.Constant(value=(int() | float()) as number):
            return repr(number)
        case ast.Constant(value=str(text)):
            return _quoted(text)
        case ast.Name():
            return node.id
        case ast.List() | ast.Tuple():
            return f"[{', '.join(map(_value, node.elts))}]"
        case ast.Dict() if all(isinstance(k, ast.Constant) for k in node.keys):
            fields = (f"{_value(k)}: {_value(v)}" for k, v in zip(node.keys, node.values, strict=True) if k)
            return "{ " + ", ".join(fields) + " }"
        case ast.Starred():
            return f"...{_value(node.value)}"
        case ast.Attribute(value=ast.Name(id="math")):
            return CONSTANTS.get(node.attr, f"Math.{node.attr}")
        case ast.Attribute():
            return f"{_value(node.value)}.{node.attr}"
        case ast.Subscript(slice=ast.Slice(lower=low, upper=high, step=None)):
            ends = [_value(low) if low else "0", *([_value(high)] if high else [])]
            return f"{_value(node.value)}.slice({', '.join(ends)})"
        case ast.Subscript(slice=ast.UnaryOp(op=ast.USub())):
            return f"{_value(node.value)}.at({_value(node.slice)})"
        case ast.Subscript():
            return f"{_value(node.value)}[{_value(node.slice)}]"
        case ast.UnaryOp() if type(node.op) in OPERATORS:
            return f"({OPERATORS[type(node.op)]}{_value(node.operand)})"
        case ast.BinOp() if type(node.op) in OPERATORS:
            return f"({_value(node.left)} {OPERATORS[type(node.op)]} {_value(node.right)})"
        case ast.BoolOp():
            return f"({f' {OPERATORS[type(node.op)]} '.join(map(_value, node.values))})"
        case ast.Compare(ops=[operator], comparators=[other]):
            return _compared(node.left, operator, other)
        case ast.IfExp():
            return f"({_value(node.test)} ? {_value(node.body)} : {_value(node.orelse)})"
        case ast.ListComp(generators=[ast.comprehension(is_async=0) as one]):
            of = f"[...{_value(one.iter)}]"
            of += "".join(f".filter(({_target(one.target)}) => {_value(test)})" for test in one.ifs)
            return f"{of}.map(({_target(one.target)}) => {_value(node.elt)})"
        case ast.JoinedStr():
            return "`" + "".join(map(_field, node.values)) + "`"
        case ast.Call(keywords=[]):
            return _called(node)
    raise _unknown(node)


def _compared(left: ast.expr, operator: ast.cmpop, right: ast.expr) -> str:
    if isinstance(operator, (ast.Is, ast.IsNot)) and isinstance(right, ast.Constant) and right.value is None:
        return f"({_value(left)} {'==' if isinstance(operator, ast.Is) else '!='} null)"
    if isinstance(operator, ast.In):
        if isinstance(right, (ast.List, ast.Tuple)):
            return f"{_value(right)}.includes({_value(left)})"
        if isinstance(left, ast.Constant):
            return f"({_value(left)} in {_value(right)})"
        raise _unknown(left)  # is it a list or a shape?
    if type(operator) not in OPERATORS:
        raise _unknown(left)
    return f"({_value(left)} {OPERATORS[type(operator)]} {_value(right)})"


def _called(node: ast.Call) -> str:
    args = (
        ", ".join(map(_value, node.args))
        if not any(isinstance(a, ast.GeneratorExp) for a in node.args)
        else ""
    )
    match node.func:
        case ast.Name(id="range"):
            low, high = (["0", *map(_value, node.args)])[-2:]
            return f"Array.from({{ length: Math.max(0, {high} - {low}) }}, (_, k) => k + {low})"
        case ast.Name(id="len"):
            return f"{args}.length"
        case ast.Name(id="isinstance") if isinstance(node.args[1], ast.Name) and node.args[1].id == "list":
            return f"Array.isArray({_value(node.args[0])})"
        case ast.Name(id=name) if name in FUNCTIONS:
            return f"{FUNCTIONS[name]}({args})"
        case ast.Attribute(value=ast.Name(id="math"), attr="isfinite"):
            return f"Number.isFinite({args})"
        case ast.Name(id=("all" | "any") as name) if isinstance(node.args[0], ast.GeneratorExp):
            one = node.args[0].generators[0]
            if len(node.args[0].generators) > 1 or one.ifs:
                raise _unknown(node)
            how = "every" if name == "all" else "some"
            return f"{_value(one.iter)}.{how}(({_target(one.target)}) => {_value(node.args[0].elt)})"
        case ast.Attribute(attr="append"):
            return f"{_value(node.func.value)}.push({args})"
        case ast.Attribute(attr="get"):
            key, *default = map(_value, node.args)
            return f"({_value(node.func.value)}[{key}] ?? {default[0] if default else 'null'})"
    return f"{_value(node.func)}({args})"


def _field(node: ast.expr) -> str:
    if isinstance(node, ast.Constant):
        return str(node.value).replace("`", "\\`")
    if isinstance(node, ast.FormattedValue) and node.format_spec is None and node.conversion == -1:
        return "${" + _value(node.value) + "}"
    raise _unknown(node)


def _quoted(text: str) -> str:
    from json import dumps

    return dumps(text)


def _is_docstring(node: ast.stmt) -> bool:
    return (
        isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, str)
    )


def _unknown(node: ast.AST) -> Unknown:
    return Unknown(f"line {getattr(node, 'lineno', '?')}: {ast.unparse(node)[:80]}")

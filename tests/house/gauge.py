"""How simple the project is, by counting. Each count has a ceiling in ceilings.json beside this file, which may only fall.

    python tests/house/gauge.py            the table: counted, ceiling, goal
    python tests/house/gauge.py --write    ceilings come down to what is counted; none goes up

What is over its ceiling is either made smaller, or something else is: a number that a rule cannot do without costs one that it
replaces. Counted are the sources of the package; Rust's unit tests (`tests.rs`, `#[cfg(test)]`) are left out but for lines.
"""

from __future__ import annotations

import ast
import json
import re
import sys
from collections import Counter, defaultdict
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

HOUSE = Path(__file__).resolve().parent
ROOT = HOUSE.parents[1]
CEILINGS = HOUSE / "ceilings.json"

LONG = 80  # lines of a function that is read at a sitting
MANY = 8  # arguments that a caller cannot keep apart by place
FILE = 600  # lines of a file
# rooms of abilities that grow while the rest gets simpler: pages that compute, the playground, sweeps, runs led from Python,
# cards of rolling, of tyres and of relations among joints, robots, schematics, FMUs of others and for their solvers, gradients,
# environments, models that are added, shapes in space, domains beside circuit and mechanism, bodies that bend, loops that end by
# voltages, power grids, friction against rolling, coordinates of joints by name, what breaks and catches, like pairs, many that
# may touch.
# Counted apart
APART = (
    "emsim/assemble/hands.py", "emsim/cards/knife.py", "emsim/cards/ratio.py", "emsim/cards/roll.py",
    "emsim/engine/src/packed/", "emsim/engine/src/page.rs", "emsim/engine/src/py/instance.rs", "emsim/fmus/page.py",
    "emsim/fmus/session.py", "emsim/outputs/glyphs/knife.py", "emsim/outputs/glyphs/ratio.py", "emsim/sweeps/",
    "emsim/playground/", "emsim/cli/playground.py", "emsim/cli/gallery.py", "emsim/cards/magic.py", "emsim/cards/tyre.py",
    "emsim/cli/import.py", "emsim/readers/", "emsim/robots/", "emsim/sheets/", "emsim/schematic/given.py",
    "emsim/engine/foreign/src/", "emsim/engine/dae/src/devices/foreign.rs", "emsim/engine/src/py/foreign.rs",
    "emsim/build_unit.py", "emsim/environments/", "emsim/gradients/", "emsim/differentiable.py", "emsim/jax.py", "emsim/torch.py",
    "emsim/elements/added.py", "emsim/elements/public.py", "emsim/cli/models.py",
    "emsim/cards/cans.py", "emsim/cards/capsules.py", "emsim/cards/drums.py", "emsim/cards/eggs.py", "emsim/cards/facets.py",
    "emsim/cards/hulls.py", "emsim/cards/nearest.py", "emsim/cards/ovals.py", "emsim/cards/pairs.py",
    "emsim/cards/solids.py", "emsim/cards/supports.py", "emsim/outputs/glyphs/body.py", "emsim/engine/dae/src/tangent/",
    "emsim/assemble/domains.py", "emsim/cards/domains/", "emsim/cards/resisting.py",
    "emsim/engine/integrate/src/driver/outside.rs", "emsim/engine/integrate/src/session/exchange.rs",
    "emsim/cards/beam.py", "emsim/cards/rod.py", "emsim/cards/mode.py", "emsim/cards/flange.py",
    "emsim/engine/expr/src/repeat.rs", "emsim/engine/expr/src/graph/called.rs", "emsim/engine/expr/src/tape/native/loops.rs",
    "emsim/engine/expr/src/tape/native/cranelift/called.rs", "emsim/engine/expr/src/tape/loops.rs",
    "emsim/engine/veriloga/src/looped.rs", "emsim/engine/expr/src/interrupt/endless.rs", "emsim/engine/sparse/src/lu/kept.rs",
    "emsim/engine/integrate/src/auto/fills.rs", "emsim/engine/dae/src/newton/kept.rs",
    "emsim/cards/along.py", "emsim/cards/latch.py", "emsim/assemble/bonds.py", "emsim/engine/dae/src/modes/bonds.rs",
    "emsim/outputs/glyphs/latch.py", "emsim/engine/sparse/src/order/loose.rs", "emsim/engine/sparse/src/lu/loose.rs",
    "emsim/engine/dae/src/modes/lcp/islands.rs", "emsim/engine/dae/src/system/loose.rs",
    "emsim/engine/expr/src/alike.rs", "emsim/assemble/alike.py",
)  # fmt: skip
KNOT = 8  # modules that import each other in a circle and can still be read as one thing


class Count:
    """One row of the gauge. `who` are the places that make it up, largest first."""

    def __init__(self, name: str, value: int, who: list[str] | None = None) -> None:
        self.name, self.value, self.who = name, value, who or []


# ---- Rust -------------------------------------------------------------------------------------

CONSTANT = re.compile(
    r"^[ \t]*(?:pub(?:\([a-z]+\))? )?const ([A-Z_0-9]+): (f64|f32|usize|[ui]\d+|\[f64)[^\n]*", re.M
)
FUNCTION = re.compile(
    r'^([ \t]*)(?:pub(?:\([a-z]+\))? )?(?:const )?(?:unsafe )?(?:extern "C" )?fn (\w+)', re.M
)
RESULT = re.compile(r"(?:[^{;\[]|\[[^\]]*\])*")  # between arguments and body: [f64; 3] is a type
STRUCT = re.compile(r"^(?:pub(?:\([a-z]+\))? )?struct (\w+)[^{;]*\{(.*?)^\}", re.M | re.S)
FIELD = re.compile(r"^    (?:pub(?:\([a-z]+\))? )?\w+:", re.M)
UNIT_TESTS = re.compile(r"#\[cfg\(test\)\]\s*mod \w+ \{.*", re.S)


class Rust:
    """The engine's sources: text by path, without unit tests."""

    def __init__(self, root: Path) -> None:
        paths = sorted((root / "emsim" / "engine").rglob("*.rs"))
        self.texts = {str(p.relative_to(root)): p.read_text(encoding="utf-8") for p in paths}
        self.code = {p: UNIT_TESTS.sub("", text) for p, text in self.texts.items() if "tests" not in p}

    def constants(self) -> list[tuple[str, str, bool]]:
        """(place, type, has words of its own or shares those of the block that it stands in)"""
        found = []
        for path, text in self.code.items():
            lines = text.split("\n")
            for m in CONSTANT.finditer(text):
                number = text.count("\n", 0, m.start())
                found.append((f"{path} {m[1]}", m[2], "//" in m[0] or _said_above(lines, number)))
        return found

    def functions(self) -> list[tuple[str, int, int]]:
        """(place, lines, arguments without self)"""
        found = []
        for path, commented in self.code.items():
            text = re.sub(r"//[^\n]*", "", commented)
            for m in FUNCTION.finditer(text):
                inside, end = _brackets(text, text.index("(", m.end()))
                head = RESULT.match(text, end)
                opened = head.end() if head else len(text)
                has_body = text[opened : opened + 1] == "{"
                # rustfmt closes a body at the indentation of its head, or in its line
                over_lines = has_body and text[opened + 1 : text.find("\n", opened)].strip() == ""
                closed = text.find(f"\n{m[1]}}}", end) if over_lines else end
                lines = text.count("\n", m.start(), closed) + (closed > end) + 1 if closed >= 0 else 1
                arguments = [a for a in _split(inside) if not re.fullmatch(r"&?('\w+ )?(mut )?self", a)]
                found.append((f"{path} {m[2]}", lines, len(arguments)))
        return found

    def structs(self) -> list[tuple[str, int]]:
        return [
            (f"{path} {m[1]}", len(FIELD.findall(m[2])))
            for path, text in self.code.items()
            for m in STRUCT.finditer(text)
        ]


def _said_above(lines: list[str], number: int) -> bool:
    """Is there a comment above a constant, or above the unbroken block of constants in which it stands?"""
    while number > 0:
        number -= 1
        line = lines[number].strip()
        if line.startswith("//"):
            return True
        if not (line.startswith("#[") or CONSTANT.match(lines[number])):
            return False
    return False


def _brackets(text: str, at: int) -> tuple[str, int]:
    """What stands between a bracket and the one that closes it, and where that is."""
    depth = 0
    for m in re.compile(r"[()]").finditer(text, at):
        depth += 1 if m[0] == "(" else -1
        if depth == 0:
            return text[at + 1 : m.start()], m.end()
    return text[at + 1 :], len(text)


def _split(arguments: str) -> list[str]:
    """At the commas that stand in no bracket."""
    text = arguments.replace("->", "")
    depth, start, parts = 0, 0, []
    for m in re.compile(r"[(<\[{)>\]},]").finditer(text):
        if m[0] == ",":
            if depth == 0:
                parts.append(text[start : m.start()])
                start = m.end()
        else:
            depth += 1 if m[0] in "(<[{" else -1
    return [p.strip() for p in (*parts, text[start:]) if p.strip()]


# ---- Python -----------------------------------------------------------------------------------


class Python:
    """The package's modules: name to tree. Pages of the docs and templates are no part of it."""

    def __init__(self, root: Path) -> None:
        package = root / "emsim"
        self.texts: dict[str, str] = {}
        self.trees: dict[str, ast.Module] = {}
        self.paths: dict[str, Path] = {}
        for path in sorted(package.rglob("*.py")):
            parts = list(path.relative_to(root).with_suffix("").parts)
            name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
            self.texts[name] = path.read_text(encoding="utf-8")
            self.trees[name] = ast.parse(self.texts[name])
            self.paths[name] = path
        self.nodes = {name: list(_statements(tree)) for name, tree in self.trees.items()}

    def functions(self) -> list[tuple[str, int, int]]:
        """(place, lines, arguments without self)"""
        found = []
        for name, nodes in self.nodes.items():
            for node in nodes:
                if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
                    a = node.args
                    arguments = [x.arg for x in (*a.posonlyargs, *a.args, *a.kwonlyargs)]
                    count = len([x for x in arguments if x not in ("self", "cls")])
                    found.append((f"{name} {node.name}", (node.end_lineno or 0) - node.lineno + 1, count))
        return found

    def classes(self) -> list[tuple[str, int, int]]:
        """(place, attributes, methods). Attributes: what methods set on self, and what the class declares."""
        found = []
        for name, nodes in self.nodes.items():
            for node in nodes:
                if not isinstance(node, ast.ClassDef):
                    continue
                methods = [n for n in node.body if isinstance(n, (ast.FunctionDef, ast.AsyncFunctionDef))]
                attributes = {
                    n.target.id
                    for n in node.body
                    if isinstance(n, ast.AnnAssign) and isinstance(n.target, ast.Name)
                }
                for method in methods:
                    attributes.update(_set_on_self(method))
                found.append((f"{name} {node.name}", len(attributes), len(methods)))
        return found

    def numbers(self) -> list[str]:
        """Constants of modules that are a number."""
        return [
            f"{name} {target.id}"
            for name, tree in self.trees.items()
            for node in tree.body
            if isinstance(node, ast.Assign) and _is_number(node.value)
            for target in node.targets
            if isinstance(target, ast.Name) and target.id.lstrip("_").isupper()
        ]

    def imports(self) -> set[tuple[str, str]]:
        """(who, whom) within the package: at the top, inside functions, and for types alone."""
        found = set()
        for name, nodes in self.nodes.items():
            parts = name.split(".")
            package = parts if self.paths[name].name == "__init__.py" else parts[:-1]
            for node in nodes:
                if isinstance(node, ast.Import):
                    found.update((name, alias.name) for alias in node.names)
                elif isinstance(node, ast.ImportFrom):
                    base = package[: len(package) - node.level + 1] if node.level else []
                    whole = ".".join([*base, *(node.module.split(".") if node.module else [])])
                    for alias in node.names:
                        inner = f"{whole}.{alias.name}"
                        found.add((name, inner if inner in self.trees else whole))
            # an index names files that are imported when they are asked for: lazily too
            found.update((name, f"{name}.{module}") for module in _indexed(self.trees[name]))
        return {(a, b) for a, b in found if b in self.trees and a != b}


def _statements(node: ast.AST) -> Iterator[ast.AST]:
    """Those inside of a node, at every depth; expressions are passed over."""
    for field in ("body", "orelse", "finalbody", "handlers", "cases"):
        for inner in getattr(node, field, ()):
            yield inner
            yield from _statements(inner)


def _set_on_self(method: ast.AST) -> set[str]:
    found = set()
    for node in _statements(method):
        targets = [*getattr(node, "targets", ()), getattr(node, "target", None)]
        targets += [item.optional_vars for item in getattr(node, "items", ())]
        for target in targets:
            for part in ast.walk(target) if target is not None else ():
                if isinstance(part, ast.Attribute) and isinstance(part.ctx, ast.Store):
                    found.update([part.attr] if getattr(part.value, "id", "") == "self" else [])
    return found


def _indexed(tree: ast.Module) -> list[str]:
    """Modules that a registry's INDEX names: {"r": "r Resistor"}."""
    return [
        value.value.split()[0]
        for node in tree.body
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Dict)
        for target in node.targets
        if isinstance(target, ast.Name) and target.id == "INDEX"
        for value in node.value.values
        if isinstance(value, ast.Constant) and isinstance(value.value, str)
    ]


def _is_number(node: ast.expr) -> bool:
    if isinstance(node, ast.UnaryOp):
        return _is_number(node.operand)
    if isinstance(node, ast.BinOp):
        return _is_number(node.left) and _is_number(node.right)
    return isinstance(node, ast.Constant) and type(node.value) in (int, float)


def knots(edges: set[tuple[str, str]]) -> list[list[str]]:
    """Modules from each of which each other can be reached (Tarjan), largest first; those of one module are left out."""
    after: dict[str, list[str]] = defaultdict(list)
    for a, b in sorted(edges):
        after[a].append(b)
    index: dict[str, int] = {}
    low: dict[str, int] = {}
    path: list[str] = []
    on_path: set[str] = set()
    found: list[list[str]] = []

    def visit(v: str) -> None:
        index[v] = low[v] = len(index)
        path.append(v)
        on_path.add(v)
        for w in after[v]:
            if w not in index:
                visit(w)
                low[v] = min(low[v], low[w])
            elif w in on_path:
                low[v] = min(low[v], index[w])
        if low[v] == index[v]:
            at = path.index(v)
            knot = path[at:]
            del path[at:]
            on_path.difference_update(knot)
            if len(knot) > 1:
                found.append(sorted(knot))

    limit = sys.getrecursionlimit()
    sys.setrecursionlimit(10_000)
    try:
        for v in sorted(after):
            if v not in index:
                visit(v)
    finally:
        sys.setrecursionlimit(limit)
    return sorted(found, key=len, reverse=True)


# ---- the gauge --------------------------------------------------------------------------------


def counts(root: Path = ROOT) -> list[Count]:
    rust, python = Rust(root), Python(root)
    constants = rust.constants()
    scalars = [(place, said) for place, kind, said in constants if not kind.startswith("[")]
    tangled = knots(python.imports())
    wide = [k for k in tangled if len(k) > KNOT]
    return [
        Count("Rust lines", _lines(rust.texts)),
        Count(
            "Python lines",
            _lines({str(python.paths[n].relative_to(root)): t for n, t in python.texts.items()}),
        ),
        Count("Rust: named numbers", len(constants), _most_per_file(place for place, *_ in constants)),
        Count(
            "Rust: named numbers that are f64",
            sum(kind == "f64" for _, kind, _ in constants),
            _most_per_file(place for place, kind, _ in constants if kind == "f64"),
        ),
        Count(
            "Rust: named numbers without a word beside them",
            sum(not said for _, said in scalars),
            [place for place, said in scalars if not said],
        ),
        Count("Python: named numbers", len(python.numbers()), _most_per_file(python.numbers())),
        *_of_functions("Rust", rust.functions()),
        *_of_functions("Python", python.functions()),
        _largest("Rust: fields of the largest struct", rust.structs()),
        _largest("Python: attributes of the largest class", [(c, a) for c, a, _ in python.classes()]),
        _largest("Python: methods of the largest class", [(c, m) for c, _, m in python.classes()]),
        _files(
            {**rust.texts, **{str(python.paths[n].relative_to(root)): t for n, t in python.texts.items()}}
        ),
        Count("largest knot of imports", max(map(len, tangled), default=0), tangled[0] if tangled else []),
        Count(
            f"modules in knots of more than {KNOT}",
            sum(map(len, wide)),
            [f"{len(k)}: {', '.join(k[:4])} .." for k in wide],
        ),
    ]


def _lines(texts: dict[str, str]) -> int:
    return sum(text.count("\n") for path, text in texts.items() if not path.startswith(APART))


def _most_per_file(places: Iterable[str]) -> list[str]:
    files = Counter(place.split(" ")[0] for place in places)
    return [f"{n} in {path}" for path, n in files.most_common(12)]


def _of_functions(language: str, found: list[tuple[str, int, int]]) -> list[Count]:
    long = sorted(((n, place) for place, n, _ in found if n > LONG), reverse=True)
    many = sorted(((n, place) for place, _, n in found if n >= MANY), reverse=True)
    return [
        Count(f"{language}: functions above {LONG} lines", len(long), [f"{n} {p}" for n, p in long]),
        Count(
            f"{language}: functions of {MANY} and more arguments", len(many), [f"{n} {p}" for n, p in many]
        ),
    ]


def _largest(name: str, found: list[tuple[str, int]]) -> Count:
    ranked = sorted(((n, place) for place, n in found), reverse=True)
    return Count(name, ranked[0][0], [f"{n} {place}" for n, place in ranked[:8]])


def _files(texts: dict[str, str]) -> Count:
    long = sorted(((t.count("\n"), p) for p, t in texts.items() if t.count("\n") > FILE), reverse=True)
    return Count(f"files above {FILE} lines", len(long), [f"{n} {p}" for n, p in long])


def ceilings() -> dict[str, dict[str, int]]:
    """{"Rust lines": {"ceiling": .., "goal": ..}}"""
    found: dict[str, dict[str, int]] = json.loads(CEILINGS.read_text(encoding="utf-8"))
    return found


def table(found: list[Count]) -> str:
    known = ceilings()
    rows = [("", "counted", "ceiling", "goal")]
    for count in found:
        row = known.get(count.name, {})
        rows.append((count.name, str(count.value), str(row.get("ceiling", "-")), str(row.get("goal", "-"))))
    return "\n".join(f"{name:<52}" + "".join(f"{v:>9}" for v in values) for name, *values in rows)


def lowered(found: list[Count]) -> dict[str, dict[str, int]]:
    """The ceilings, down to what is counted."""
    known = ceilings()
    for count in found:
        known[count.name]["ceiling"] = min(known[count.name]["ceiling"], count.value)
    return known


def main() -> None:
    found = counts()
    if "--write" in sys.argv[1:]:
        rows = (f" {json.dumps(name)}: {json.dumps(row)}" for name, row in lowered(found).items())
        CEILINGS.write_text("{\n" + ",\n".join(rows) + "\n}\n", encoding="utf-8")
    print(table(found))
    for count in found:
        if count.value > ceilings()[count.name]["ceiling"]:
            print(f"\n{count.name}: {count.value} is over its ceiling\n  " + "\n  ".join(count.who[:20]))


if __name__ == "__main__":
    main()

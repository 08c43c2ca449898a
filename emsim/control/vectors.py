"""Expressions over vectors: trees of grammar/control.lark, evaluated.

Vectors of different lengths meet as in ngspice: the shorter goes on with its last value.
"""

from __future__ import annotations

import numpy as np

from ..build_expr import extent
from ..functions import MATH
from ..units import spice_number
from . import functions
from .errors import CommandError
from .plots import Plot, Vector

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from typing import Any

    from .session import Session

# vdb(out), vm(a,b): functions of voltages
VOLTAGES = {
    "vm": "mag", "vp": "ph", "vr": "re", "vi": "im", "vdb": "db", "vg": "group_delay", "gd": "group_delay",
}  # fmt: skip
OF_TWO: dict[str, Callable[[Any, Any], Any]] = {
    "min": lambda a, b: np.where(a.real < b.real, a, b), "max": lambda a, b: np.where(a.real > b.real, a, b),
    "atan2": np.arctan2, "hypot": np.hypot, "pow": np.power, "fmod": np.fmod,
}  # fmt: skip
COMPARE = {
    "eq": "=", "ne": "<>", "gt": ">", "lt": "<", "ge": ">=", "le": "<=", "==": "=", "!=": "<>", "><": "<>",
}  # fmt: skip


def _power(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    if not (np.iscomplexobj(a) or np.iscomplexobj(b)) and ((a < 0) & (b != np.rint(b))).any():
        return np.power(a.astype(complex), b)
    return np.power(a, b)


def _remainder(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Of whole numbers, as ngspice's %."""
    return np.fmod(np.floor(np.abs(a)), np.floor(np.abs(b)))


OPERATORS: dict[str, Callable[[Any, Any], Any]] = {
    "+": np.add, "-": np.subtract, "*": np.multiply, "/": np.divide, "^": _power, "**": _power, "%": _remainder,
    "=": lambda a, b: np.equal(a, b) * 1.0, "<>": lambda a, b: np.not_equal(a, b) * 1.0,
    "<": lambda a, b: np.less(a.real, b.real) * 1.0, "<=": lambda a, b: np.less_equal(a.real, b.real) * 1.0,
    ">": lambda a, b: np.greater(a.real, b.real) * 1.0, ">=": lambda a, b: np.greater_equal(a.real, b.real) * 1.0,
    "&": lambda a, b: np.logical_and(a, b) * 1.0, "|": lambda a, b: np.logical_or(a, b) * 1.0,
}  # fmt: skip


class Evaluator:
    """Evaluates the trees of one text; `text` names what is computed."""

    def __init__(self, session: Session, text: str) -> None:
        self.s, self.text = session, text

    def named(self, tree: Any) -> list[Vector]:
        """The vectors of one item of a list, under the words that it was asked for by; `all` is several."""
        if tree.__class__ is not tuple and tree.type == "VECTOR":
            word = tree.lower()
            if (several := self.several(word)) is not None:
                return several
        start, end = extent(tree)
        word = next((w for w in _words(tree) if self.several(w.lower()) is not None), None)
        if word is not None:  # db(allv): of each
            each = self.several(word.lower()) or []
            found = [self.value(tree, {word.lower(): v}) for v in each]
        else:
            found = [self.value(tree)]
        return [v.copied(self.text[start:end].strip().strip("\"'")) for v in found]

    def several(self, word: str) -> list[Vector] | None:
        """all, allv, alli, tran1.all."""
        head, _, rest = word.rpartition(".")
        plot = self.s.plots.current if not head else self.s.plots.named(head)
        if rest not in ("all", "allv", "alli", "ally") or plot is None or (not head and plot.find(rest)):
            return None
        found = plot.listed()
        if rest == "allv":
            found = [v for v in found if v.unit == "V"]
        elif rest == "alli":
            found = [v for v in found if v.unit == "A"]
        elif rest == "ally":
            found = [v for v in found if v is not plot.scale]
        if not found and (plot is self.s.plots.const or plot.failed):
            raise self.s.plots.missing(word)
        if not found:  # a deck of digital nodes has no voltages
            self.s.warn(f"`{word}`: {plot.name} has none of these, as ngspice tells too")
        return [v.copied(f"{head}.{v.shown}" if head else v.shown, plot) for v in found]

    # ---- trees ----

    def value(self, tree: Any, given: dict[str, Any] | None = None) -> Vector:
        if tree.__class__ is not tuple:
            return self.leaf(tree, given)
        rule, ch = tree
        return getattr(self, "on_" + rule)(ch, given)

    def leaf(self, leaf: Any, given: dict[str, Any] | None) -> Vector:
        kind = leaf.type
        if kind == "NUMBER":
            value = spice_number(leaf)
            if value is None:
                raise CommandError("E161", f"`{leaf}` is no number")
            # a node may be called 1; alone it is a number all the same
            return Vector(leaf, np.array([value]), "", None)
        name = str(leaf).strip('"')
        if given is not None and name.lower() in given:
            bound = given[name.lower()]
            return bound if isinstance(bound, Vector) else self.value(bound, None)
        return self.s.vector(name.removeprefix("."))

    def on_vector_group(self, ch: list[Any], given: Any) -> Vector:
        inner = [c for c in ch if c.__class__ is tuple or c.type not in ("_LPAR", "_RPAR", "_COMMA")]
        inner = [c for c in inner if c not in ("(", ")", ",")]
        return self.value(inner[0], given) if len(inner) == 1 else self.pair(inner, given)

    def on_vector_quoted(self, ch: list[Any], given: Any) -> Vector:
        return self.value(ch[1], given)

    def pair(self, parts: list[Any], given: Any) -> Vector:
        """(a, b) is a + i b."""
        a, b = (self.value(p, given) for p in parts[:2])
        return self.joined(a, b, lambda x, y: x + 1j * y, a.unit)

    def on_vector_voltage(self, ch: list[Any], given: Any) -> Vector:
        return self.voltage(ch[0].rstrip("( \t")[:-1], [c for c in ch[1:] if c not in (",", ")")], given)

    def voltage(self, prefix: str, nodes: list[Any], given: Any) -> Vector:
        words = []
        for node in nodes:
            word = str(node).strip('"').lower()
            if given is not None and word in given:
                start, end = extent(given[word])
                word = self.bound_text[start:end] if given[word].__class__ is tuple else str(given[word])
            words.append(word)
        found = [self.node(prefix, w) for w in words]
        if len(found) == 1:
            return found[0]
        return self.joined(found[0], found[1], np.subtract, "V")

    bound_text = ""

    def node(self, prefix: str, name: str) -> Vector:
        if name in ("0", "gnd"):
            return Vector("0", np.zeros(1), "V", None)
        return self.s.vector(f"{prefix}v({name})")

    def on_vector_current(self, ch: list[Any], given: Any) -> Vector:
        prefix = ch[0].rstrip("( \t")[:-1]
        name = str(ch[1])
        if given is not None and name.lower() in given:
            name = str(given[name.lower()])
        known = self.s.plots.known(f"{prefix}i({name})")
        if known is None and not prefix and self.s.plots.known(name) is not None:
            # i(v1) is a current, i of a vector ngspice does not know; im() is meant
            return functions.apply(self.s, "im", self.s.vector(name))
        return self.s.vector(f"{prefix}i({name})")

    def on_vector_call(self, ch: list[Any], given: Any) -> Vector:
        name = ch[0].lower()
        args = [c for c in ch[1:] if c not in ("(", ")", ",")]
        if (defined := self.s.functions.get((name, len(args)))) is not None:
            return self.defined(name, defined, args, given)
        if not given:
            start, end = extent(("call", ch))
            known = self.s.plots.known(self.text[start:end])
            if known is not None:  # angle(hinge), a column of the machine
                return known
        if name in VOLTAGES and all(a.__class__ is not tuple for a in args):
            return functions.apply(self.s, VOLTAGES[name], self.voltage("", args, given))
        if len(args) == 2 and name in OF_TWO:
            return self.joined(self.value(args[0], given), self.value(args[1], given), OF_TWO[name], "")
        if name in functions.EACH or name in functions.WHOLE:
            of = self.value(args[0], given) if len(args) == 1 else self.pair(args, given)
            return functions.apply(self.s, name, of)
        if (of_numbers := MATH.get(name)) is not None and of_numbers.least <= len(args) <= of_numbers.most:
            function = of_numbers.source
            values = [self.value(a, given) for a in args]
            longest = max(values, key=len)
            columns = [_stretched(v.values.real, len(longest)) for v in values]
            with np.errstate(all="ignore"):
                try:
                    found = np.array(
                        [float(function(*map(float, row))) for row in zip(*columns, strict=True)]
                    )
                except (ValueError, OverflowError, ZeroDivisionError):
                    raise CommandError("E164", f"{name}() has no value there") from None
            return Vector(name, found, "", longest.plot)
        raise self.unknown(name, len(args))

    def unknown(self, name: str, count: int) -> CommandError:
        from ..diagnostics import did_you_mean

        others = [n for n, c in self.s.functions if n == name and c != count]
        if others:
            wanted = next(c for n, c in self.s.functions if n == name)
            return CommandError("E161", f"the function `{name}` takes {wanted} arguments, not {count}")
        hint = did_you_mean(
            name,
            [*functions.names(), *VOLTAGES, *OF_TWO, *(n for n, _ in self.s.functions)],
            f"define {name}(x) .. makes one",
        )
        return CommandError("E162", f"there is no function `{name}`", hint)

    def defined(
        self, name: str, definition: tuple[list[str], Any, str], args: list[Any], given: Any
    ) -> Vector:
        params, body, text = definition
        self.s.budget.do()
        bound = {p: self.substituted(a, given) for p, a in zip(params, args, strict=True)}
        before = self.text, self.bound_text
        if not given:
            self.bound_text = self.text
        try:
            self.text = text
            with self.s.budget.within(f"{name}()"):
                return self.value(body, bound)
        finally:
            self.text, self.bound_text = before

    def substituted(self, tree: Any, given: dict[str, Any] | None) -> Any:
        """A tree with what the names of an outer function stand for."""
        if not given:
            return tree
        if tree.__class__ is not tuple:
            return given.get(tree.lower(), tree)
        return (tree[0], [self.substituted(c, given) for c in tree[1]])

    def on_cond(self, ch: list[Any], given: Any) -> Vector:
        return self.value(ch[1] if self.truth(self.value(ch[0], given)) else ch[2], given)

    @staticmethod
    def truth(v: Vector) -> bool:
        """A vector is true where one of its numbers is not 0."""
        return bool(np.any(v.values != 0))

    def on_either(self, ch: list[Any], given: Any) -> Vector:
        return self.joined(self.value(ch[0], given), self.value(ch[-1], given), OPERATORS["|"], "")

    def on_both(self, ch: list[Any], given: Any) -> Vector:
        return self.joined(self.value(ch[0], given), self.value(ch[-1], given), OPERATORS["&"], "")

    def on_binary(self, ch: list[Any], given: Any) -> Vector:
        op = ch[1].lower() if len(ch) == 3 else "="
        op = COMPARE.get(op, op)
        a, b = self.value(ch[0], given), self.value(ch[-1], given)
        return self.joined(a, b, OPERATORS[op], _unit(op, a, b))

    def on_unary(self, ch: list[Any], given: Any) -> Vector:
        of, op = self.value(ch[-1], given), ch[0] if len(ch) == 2 else "not"
        values = -of.values if op == "-" else of.values if op == "+" else (of.values == 0) * 1.0
        found = Vector("", values, of.unit if op in "+-" else "", of.plot)
        found.dims, found.scale, found.derived = of.dims, of.scale, True
        return found

    def joined(self, a: Vector, b: Vector, f: Callable[[Any, Any], Any], unit: str) -> Vector:
        n = max(len(a), len(b))
        if not len(a) or not len(b):
            raise CommandError("E164", "a vector has no numbers")
        with np.errstate(all="ignore"):
            values = np.asarray(f(_stretched(a.values, n), _stretched(b.values, n)))
        longer = a if len(a) >= len(b) and (a.plot is not None or b.plot is None) else b if len(b) == n else a
        plots = [v.plot for v in (a, b) if v.plot not in (None, self.s.plots.const)]
        found = Vector("", values, unit, plots[0] if plots else longer.plot)
        found.dims, found.scale, found.derived = longer.dims, longer.scale, True
        return found

    # ---- places ----

    def on_place(self, ch: list[Any], given: Any) -> Vector:
        of, (kind, parts) = self.value(ch[0], given), ch[1]
        ends = [self.value(p, given) for p in parts if p not in ("[", "]", ",")]
        if any(len(e) != 1 for e in ends):
            if len(ends) == 1 and kind == "range":  # v[w]: the places of a vector
                return self.part(of, [int(x) for x in ends[0].values.real])
            raise CommandError("E161", "a place is one number")
        numbers = [float(e.values[0].real) for e in ends]
        if len(ends) == 1 and ends[0].is_complex:
            numbers.append(float(ends[0].values[0].imag))
        if any(not np.isfinite(x) for x in numbers):
            raise CommandError("E161", "a place is a finite number")
        return (
            self.between(of, numbers)
            if kind == "span_of_scale"
            else self.part(of, [int(np.floor(x)) for x in numbers], True)
        )

    def between(self, of: Vector, ends: list[float]) -> Vector:
        """v[[low, high]]: where the scale lies between them."""
        x = functions.scale_of(self.s, of)
        if x is None:
            raise CommandError("E164", "`[[ ]]` needs a vector with a scale")
        low, high = (min(ends), max(ends)) if len(ends) == 2 else (ends[0], ends[0])
        inside = (x >= low) & (x <= high)
        if not inside.any():
            raise CommandError("E164", f"the scale has no point between {low:g} and {high:g}")
        found = Vector(of.name, of.values[inside], of.unit, of.plot)
        found.scale = Vector("scale", x[inside])
        return found

    def part(self, of: Vector, places: list[int], range: bool = False) -> Vector:
        """v[2], v[1,3] (backwards too); of several dimensions rows of the first one. Beyond the ends the last one counts."""
        rows = of.values.reshape(of.dims) if of.dims else of.values
        last = len(rows) - 1
        clipped = [min(max(p, 0), last) for p in places]
        if clipped != places:
            wrong = next(p for p, c in zip(places, clipped, strict=True) if p != c)
            self.s.warn(f"the vector has places 0 to {last}: {wrong} counts as {min(max(wrong, 0), last)}")
        if range and len(clipped) == 2:
            low, high = clipped
            chosen = rows[low : high + 1] if low <= high else rows[high : low + 1][::-1]
        elif len(clipped) == 1:
            chosen = rows[clipped[0] : clipped[0] + 1]
            if of.dims:
                chosen = chosen[0]
        else:
            chosen = rows[clipped]
        found = Vector(of.name, chosen.reshape(-1), of.unit, of.plot)
        found.dims = chosen.shape if chosen.ndim > 1 else ()
        x = None if of.dims else functions.scale_of(self.s, of)
        if x is not None and range and len(clipped) == 2:
            low, high = clipped
            found.scale = Vector("scale", x[low : high + 1] if low <= high else x[high : low + 1][::-1])
        return found


def _words(tree: Any) -> Iterator[Any]:
    """The names in a tree."""
    if tree.__class__ is tuple:
        for part in tree[1]:
            yield from _words(part)
    elif tree.type == "VECTOR":
        yield tree


def _stretched(values: np.ndarray, n: int) -> np.ndarray:
    if len(values) in (1, n):
        return values if len(values) == n else np.broadcast_to(values, (n,))
    return np.concatenate([values, np.full(n - len(values), values[-1])])


def _unit(op: str, a: Vector, b: Vector) -> str:
    if op in "+-":
        return a.unit or b.unit if not a.unit or not b.unit or a.unit == b.unit else ""
    if op == "*":
        if {a.unit, b.unit} == {"V", "A"}:
            return "W"
        return a.unit or b.unit if not a.unit or not b.unit else ""
    if op == "/":
        if (a.unit, b.unit) == ("V", "A"):
            return "Ohm"
        return a.unit if not b.unit else ""
    return ""


def plot_of(vectors: list[Vector], current: Plot) -> Plot:
    """The plot whose title and scale a list is shown with."""
    return next((v.plot for v in vectors if v.plot is not None and v.plot.name != "const"), current)

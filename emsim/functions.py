"""The functions of expressions: one table, which every part that knows functions reads.

A function is added by its line here. What reads it: parameters and folding (expr.py), B sources (assemble/behaviour.py), columns
of results, .print, .meas, --plot (signals.py), .control (control/), transfer functions of s (elements/transfer.py), the page
(outputs/html.py), formulas as LaTeX and MathML (reports/notation.py, algebra.py), help, hover, completion (editor/), the
reference, the colours of editors (`python -m emsim.editor.textmate`, whose file is kept).

What a function may say of itself, beside its name, its arguments as help shows them, and what it is:

    value     of numbers: the meaning in .param. It may raise ValueError, OverflowError, ZeroDivisionError
    source    of numbers in sources, where ngspice has another meaning there
    graph     of expressions of the engine, in sources: the name of the engine's own function, or f(compiler, *arguments).
              BY_TREE: the compiler has a method `_fn_<name>`, since it looks at how the arguments are written. None: no source
              knows it; a column of it follows from others
    column    of whole columns, real or complex: numpy's name of it, or f(numpy, *columns). None: `source`, row by row
    complex   of complex numbers, as in H(s): cmath's name of it, or f(cmath, *numbers). None: it has no complex value
    js        the page's, as the text of a JavaScript function of numbers
    latex     how it is set; a command of LaTeX where it begins with a backslash
    unit      of what it gives, SAME: that of its first argument
    also      other names of the same function
    odd, even, positive    f(-x) = -f(x); f(-x) = f(x); f(x) >= 0 for every x
"""

from __future__ import annotations

import math

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from typing import Any

    Numbers = Callable[..., float]

SAME = "same"
BY_TREE = "by tree"
MANY = 99  # arguments, where there is no bound
POINTS = 100_000  # arguments of a table of points


class Function:
    __slots__ = (
        "also", "args", "column", "complex", "even", "graph", "js", "latex", "least", "most", "name", "odd", "positive", "source",
        "unit", "value", "what",
    )  # fmt: skip

    def __init__(
        self, name: str, args: str, what: str, value: Numbers, *, js: str, source: Numbers | None = None,
        graph: str | Callable[..., Any] | None = None, column: str | Callable[..., Any] | None = None,
        complex: str | Callable[..., complex] | None = None, latex: str = "", unit: str = "", also: tuple[str, ...] = (),
        counts: tuple[int, int] | None = None, odd: bool = False, even: bool = False, positive: bool = False,
    ) -> None:  # fmt: skip
        self.name, self.args, self.what, self.js = name, args, what, js
        self.value, self.source = value, source or value
        self.graph, self.column, self.complex = graph, column, complex
        self.latex, self.unit, self.also = latex or name, unit, also
        self.least, self.most = counts or (args.count(",") + 1,) * 2
        self.odd, self.even, self.positive = odd, even, positive

    @property
    def form(self) -> str:
        return f"{self.name}({self.args})"

    def of_columns(self, np: Any) -> Callable[..., Any] | None:
        """The function of whole columns; None where it is one of numbers alone."""
        column = self.column
        if isinstance(column, str):
            found: Callable[..., Any] = getattr(np, column)
            return found
        return None if column is None else lambda *x: column(np, *x)

    def of_complex(self, cmath: Any) -> Callable[..., complex] | None:
        of = self.complex
        if isinstance(of, str):
            found: Callable[..., complex] = getattr(cmath, of)
            return found
        return None if of is None else lambda *z: of(cmath, *z)


# ---- what some of them are -----------------------------------------------------------------------


def _sign(x: float) -> float:
    return float((x > 0) - (x < 0))


def _nearest(x: float) -> float:
    return float(round(x))  # halves go to even, as C's nearbyint does


def power(x: float, y: float) -> float:
    """ngspice's ^ and **: |x|^y."""
    return math.pow(abs(x), y)


def _signed_power(x: float, y: float) -> float:
    return math.copysign(math.pow(abs(x), y), x) if x else math.pow(0.0, y)


def _table(x: float, *points: float) -> float:
    """Piecewise linear through (x, y) pairs, constant beyond the ends."""
    xs = points[0::2]
    return _pwl(min(max(x, xs[0]), xs[-1]), *points)


def _pwl(x: float, *points: float) -> float:
    """Piecewise linear through (x, y) pairs; beyond the ends the last segments go on, as in ngspice."""
    xs, ys = points[0::2], points[1::2]
    for x0, y0, x1, y1 in zip(xs, ys, xs[1:], ys[1:], strict=False):
        if x <= x1 or x1 == xs[-1]:
            return y1 if x1 == x0 else y0 + (y1 - y0) * (x - x0) / (x1 - x0)
    return ys[-1]


def _elementary(name: str, what: str, column: str = "", **more: Any) -> Function:
    """One that the engine, cmath and JavaScript have by this name, and numpy by that of the column."""
    value = getattr(math, name)
    return Function(
        name, "x", what, value, graph=name, column=column or name, complex=name, js=f"Math.{name}", **more
    )


def _complex_power(cmath: Any, x: complex, y: complex) -> complex:
    found: complex = x**y
    return found


def _zero_test(word: str, sign: str, op: str, value: Numbers, also: tuple[str, ...] = ()) -> Function:
    """1 or 0, by comparing with 0."""
    return Function(
        f"{word}0", "x", f"1 where x {sign} 0, else 0", value, graph=lambda c, x: c.compare(op, x, 0.0),
        js=f"(x) => +(x {op.replace('==', '===').replace('!=', '!==')} 0)", positive=True, also=also,
    )  # fmt: skip


def _of_size(name: str) -> Callable[..., Any]:
    """Of a column whose magnitude counts where it is negative, as in sources; complex numbers as they are."""
    return lambda np, x: getattr(np, name)(x if np.iscomplexobj(x) else np.abs(x))


def _phase(np: Any, z: Any) -> Any:
    """The angle of a complex number [rad]; of a real one 0, as in ngspice."""
    return np.angle(z) if np.iscomplexobj(z) else np.zeros(np.shape(z))


def _sgn_graph(c: Any, x: Any) -> Any:
    return c.ctx.flag(x) - c.ctx.flag(-x)


def _int_graph(c: Any, x: Any) -> Any:
    b = c.ctx.b
    sign = b.select(c.ctx.flag(x), b.const(1.0), b.const(-1.0))
    return sign * c.ctx.floor_(sign * x)


# a point's slope in the page's tables: the segment that x lies in, `at` its end
_JS_PWL = (
    "(x, ...p) => { let at = 2; while (x > p[at] && p[at] !== p[p.length - 2]) at += 2; const w = p[at] - p[at - 2]; "
    "return w ? p[at - 1] + (p[at + 1] - p[at - 1]) * (x - p[at - 2]) / w : p[at + 1]; }"
)
_JS_POWER = "(x, y) => Math.abs(x) ** y"
_JS_SIGNED_POWER = "(x, y) => (x < 0 ? -1 : 1) * Math.abs(x) ** y"

FUNCTIONS = (
    _elementary("sin", "sine, x in radians", latex=r"\sin", odd=True),
    _elementary("cos", "cosine, x in radians", latex=r"\cos", even=True),
    _elementary("tan", "tangent, x in radians", latex=r"\tan", odd=True),
    _elementary("asin", "arc sine, in radians", "arcsin", latex=r"\arcsin", odd=True),
    _elementary("acos", "arc cosine, in radians", "arccos", latex=r"\arccos", positive=True),
    _elementary("atan", "arc tangent, in radians", "arctan", latex=r"\arctan", odd=True, also=("arctan",)),
    Function("atan2", "y,x", "angle of the point (x,y), in radians", math.atan2, graph="atan2", column="arctan2",
             js="Math.atan2"),
    _elementary("sinh", "hyperbolic sine", latex=r"\sinh", odd=True),
    _elementary("cosh", "hyperbolic cosine", latex=r"\cosh", even=True, positive=True),
    _elementary("tanh", "hyperbolic tangent", latex=r"\tanh", odd=True),
    _elementary("asinh", "inverse hyperbolic sine", "arcsinh", odd=True),
    _elementary("acosh", "inverse hyperbolic cosine", "arccosh", positive=True),
    _elementary("atanh", "inverse hyperbolic tangent", "arctanh", odd=True),
    _elementary("exp", "e^x", latex=r"\exp", positive=True),
    Function("ln", "x", "natural logarithm of |x|", math.log, source=lambda x: math.log(abs(x)), graph=BY_TREE,
             column=_of_size("log"), complex="log", js="(x) => Math.log(Math.abs(x))", latex=r"\ln"),
    Function("log", "x", "natural logarithm of |x|, as in ngspice", math.log, source=lambda x: math.log(abs(x)), graph=BY_TREE,
             column=_of_size("log"), complex="log", js="(x) => Math.log(Math.abs(x))", latex=r"\ln"),
    Function("log10", "x", "decadic logarithm of |x|", math.log10, source=lambda x: math.log10(abs(x)), graph=BY_TREE,
             column=_of_size("log10"), complex="log10", js="(x) => Math.log10(Math.abs(x))"),
    Function("sqrt", "x", "square root of |x|", math.sqrt, source=lambda x: math.sqrt(abs(x)), graph=BY_TREE,
             column=_of_size("sqrt"), complex="sqrt", js="(x) => Math.sqrt(Math.abs(x))", positive=True),
    Function("hypot", "x,y", "sqrt(x^2 + y^2)", math.hypot, graph=lambda c, x, y: c.root(x * x + y * y), column="hypot",
             js="Math.hypot", positive=True),
    Function("abs", "x", "magnitude", abs, graph=lambda c, x: c.ctx.abs_(x), column="abs",
             complex=lambda cmath, z: complex(abs(z)), js="Math.abs", unit=SAME, even=True, positive=True),
    Function("sgn", "x", "-1, 0 or 1", _sign, graph=_sgn_graph, js="Math.sign", also=("sign",)),
    # in sources ngspice's pow() takes |x| and pwr() keeps the sign, in .param the other way round (ngspice 39, run)
    Function("pow", "x,y", "|x|^y, as x^y and x**y; of a machine's quantity an odd whole power keeps its sign", math.pow,
             source=power, graph=BY_TREE, complex=_complex_power, js=_JS_POWER, positive=True),
    Function("pwr", "x,y", "sgn(x) |x|^y", power, source=_signed_power, graph=BY_TREE, complex=_complex_power,
             js=_JS_SIGNED_POWER),
    Function("pwrs", "x,y", "sgn(x) |x|^y, in .param too", _signed_power, graph=BY_TREE, complex=_complex_power,
             js=_JS_SIGNED_POWER),
    Function("min", "x,y,..", "the least", lambda *x: min(x), counts=(1, MANY), graph=BY_TREE, js="Math.min",
             latex=r"\min", unit=SAME),
    Function("max", "x,y,..", "the greatest", lambda *x: max(x), counts=(1, MANY), graph=BY_TREE, js="Math.max",
             latex=r"\max", unit=SAME),
    Function("limit", "x,lo,hi", "x kept between lo and hi; limit(nominal,spread) draws one of nominal +- spread, once",
             lambda x, a, b: min(max(x, min(a, b)), max(a, b)), graph=BY_TREE,
             js="(x, a, b) => Math.min(Math.max(x, Math.min(a, b)), Math.max(a, b))", unit=SAME),
    Function("floor", "x", "the next whole number below", math.floor, graph=lambda c, x: c.ctx.floor_(x), js="Math.floor"),
    Function("ceil", "x", "the next whole number above", math.ceil, graph=lambda c, x: -c.ctx.floor_(-x), js="Math.ceil"),
    Function("nint", "x", "the nearest whole number", _nearest, graph=lambda c, x: c.ctx.floor_(x + 0.5, halves_to_even=True),
             js="(x) => { const r = Math.round(x); return r - x === 0.5 && r % 2 ? r - 1 : r; }", also=("round",)),
    Function("int", "x", "the whole part, towards zero", math.trunc, graph=_int_graph, js="Math.trunc"),
    Function("mod", "x,y", "what is left of x after whole multiples of y, as x % y; it has the sign of x", math.fmod,
             graph=BY_TREE, js="(x, y) => x % y", also=("fmod",)),
    Function("sqr", "x", "x^2", lambda x: x * x, graph=lambda c, x: x**2, complex=lambda cmath, z: z * z,
             js="(x) => x * x", even=True),
    Function("u", "x", "0 below zero, 1 above, 1/2 at zero", lambda x: 1.0 if x > 0 else 0.5 if x == 0 else 0.0,
             graph=lambda c, x: 0.5 + 0.5 * _sgn_graph(c, x), js="(x) => x > 0 ? 1 : x === 0 ? 0.5 : 0", positive=True),
    Function("u2", "x", "x kept between 0 and 1", lambda x: min(max(x, 0.0), 1.0), graph=lambda c, x: c.ctx.clamp(x, 0.0, 1.0),
             js="(x) => Math.min(Math.max(x, 0), 1)", positive=True),
    Function("uramp", "x", "x above zero, else 0", lambda x: max(x, 0.0), graph=lambda c, x: c.ctx.max_(x, c.ctx.b.const(0.0)),
             js="(x) => Math.max(x, 0)", positive=True),
    _zero_test("eq", "=", "==", lambda x: float(x == 0)),
    _zero_test("ne", "<>", "!=", lambda x: float(x != 0)),
    _zero_test("gt", ">", ">", lambda x: float(x > 0), also=("stp",)),
    _zero_test("lt", "<", "<", lambda x: float(x < 0)),
    _zero_test("ge", ">=", ">=", lambda x: float(x >= 0)),
    _zero_test("le", "<=", "<=", lambda x: float(x <= 0)),
    Function("pwl", "x,x0,y0,x1,y1,..", "straight lines between points; goes on along the first and the last one", _pwl,
             counts=(3, POINTS), graph=BY_TREE, js=_JS_PWL),
    Function("table", "x,x0,y0,x1,y1,..", "straight lines between points; stays at the first and last value", _table,
             counts=(3, POINTS), graph=BY_TREE,
             js="(x, ...p) => FUNCTIONS.pwl(Math.min(Math.max(x, p[0]), p[p.length - 2]), ...p)"),
    Function("deg", "x", "radians in degrees", math.degrees, graph=lambda c, x: (180.0 / math.pi) * x, column="degrees",
             js="(x) => x * 180 / Math.PI", unit="deg", odd=True),
    Function("rpm", "x", "rad/s in turns a minute", lambda x: x * 30.0 / math.pi, graph=lambda c, x: (30.0 / math.pi) * x,
             column=lambda np, x: np.asarray(x) * 30 / math.pi, js="(x) => x * 30 / Math.PI", unit="rpm", odd=True),
)  # fmt: skip

# functions of results, in .print, .meas, --plot, the page and Result[...]; no source knows them. js: of real columns
OF_ROWS = (
    Function("db", "z", "20 log10 |z|", lambda x: 20.0 * math.log10(abs(x)), column=lambda np, z: 20 * np.log10(np.abs(z)),
             js="(x) => 20 * Math.log10(Math.abs(x))", unit="dB"),
    Function("mag", "z", "magnitude of a complex signal", abs, column="abs", js="Math.abs", unit=SAME),
    Function("ph", "z", "phase of a complex signal [rad]", lambda x: 0.0, column=_phase, js="() => 0", unit="rad"),
    Function("phase", "z", "phase of a complex signal [rad], as ph", lambda x: 0.0, column=_phase, js="() => 0", unit="rad"),
    Function("re", "z", "real part", float, column="real", js="(x) => x", unit=SAME, also=("real",)),
    Function("im", "z", "imaginary part", lambda x: 0.0, column="imag", js="() => 0", unit=SAME, also=("imag",)),
    Function("conj", "z", "conjugate", float, column="conj", js="(x) => x", unit=SAME),
)  # fmt: skip


class Course:
    """A function of a whole course along its axis. What it is stands in signals.WHOLE; js: of the axis x and the values y, a
    number or a column."""

    __slots__ = ("also", "args", "js", "name", "what")

    def __init__(self, name: str, args: str, what: str, js: str, also: tuple[str, ...] = ()) -> None:
        self.name, self.args, self.what, self.js, self.also = name, args, what, js, also

    @property
    def form(self) -> str:
        return f"{self.name}({self.args})"


COURSES = (
    Course("cph", "z", "phase that goes on without jumps [rad]", "UNWRAPPED"),
    Course("cphase", "z", "phase of a complex signal without jumps [rad], as cph", "UNWRAPPED"),
    Course("avg", "x", "mean along the axis; as mean(x)", "MEAN", also=("mean",)),
    Course(
        "rms",
        "x",
        "root of the mean square along the axis",
        "(x, y) => Math.sqrt(MEAN(x, y.map((v) => v * v)))",
    ),
    Course(
        "pp",
        "x",
        "from the smallest to the largest value",
        "(x, y) => WHOLE.maximum(x, y) - WHOLE.minimum(x, y)",
    ),
    Course("maximum", "x", "the largest value of all rows", "(x, y) => y.reduce((a, b) => Math.max(a, b))"),
    Course("minimum", "x", "the smallest value of all rows", "(x, y) => y.reduce((a, b) => Math.min(a, b))"),
    Course("integ", "x", "integral along the axis, from its start", "INTEGRAL"),
    Course("deriv", "x", "slope along the axis; as ddt(x)", "SLOPE"),
)

# functions that follow time or choose a branch, and random ones (draws.py): the form and what they are
BRANCHES = {
    "if": ("if(c,a,b)", "a where c is not 0, else b; as c ? a : b"),
    "ternary_fcn": ("ternary_fcn(c,a,b)", "the same as if(c,a,b)"),
}
OF_TIME = {
    "ddt": ("ddt(x)", "time derivative"),
    "idt": ("idt(x[,start])", "time integral"),
    "sdt": ("sdt(x[,start])", "time integral"),
    "idtmod": (
        "idtmod(x[,start,m,low])",
        "time integral, less so many m that it lies between low and low + m",
    ),
    "delay": ("delay(x,t)", "x as it was the time t before"),
    "absdelay": ("absdelay(x,t)", "x as it was the time t before, as in Verilog-A"),
}
# of BLOCK alone: what they are in difference equations stands in assemble/clocked.py
OF_TICKS = {
    "past": ("past(x,k)", "x as it was k ticks before; as x[-k]"),
    "pre": ("pre(x)", "x as it was one tick before; as x[-1]"),
    "pid": ("pid(e,kp,ki,kd,lo,hi[,tf])", "PID controller, its integral stands while u is at lo or hi; tf [s] filters kd"),
    "average": ("average(x,n)", "mean of the last n values"),
    "ztf": ("ztf(x,b0,..,bn,a0,..,an)", "transfer function (b0 + .. + bn z^-n)/(a0 + .. + an z^-n)"),
    "slew": ("slew(x,down,up)", "x, but no faster than down and up [1/s]"),
    "quad": ("quad(a,b)", "counts of an encoder's two levels, a before b upwards: four a line, one at most a tick"),
    "next": ("next(s,from,when,to,..)", "state behind s: the first transition whose `from` is s and whose `when` is true"),
}  # fmt: skip
DRAWN = {
    "mc": ("mc(nominal,relative)", "drawn once, evenly distributed within nominal (1 +- relative), as in LTspice"),
    "flat": ("flat(spread)", "drawn once, evenly distributed within +- spread, as in LTspice"),
    "gauss": ("gauss(nominal,relative,sigmas)", "drawn once, normally distributed; relative spread at that many sigmas"),
    "agauss": ("agauss(nominal,absolute,sigmas)", "drawn once, normally distributed; absolute spread at that many sigmas"),
    "unif": ("unif(nominal,relative)", "drawn once, evenly distributed within nominal (1 +- relative)"),
    "aunif": ("aunif(nominal,absolute)", "drawn once, evenly distributed within nominal +- absolute"),
}  # fmt: skip


def _by_name(functions: tuple[Function, ...]) -> Iterator[tuple[str, Function]]:
    for function in functions:
        for name in (function.name, *function.also):
            yield name, function


# by every name: those of sources, of rows of results, both
IN_SOURCES = dict(_by_name(FUNCTIONS))
IN_ROWS = dict(_by_name(OF_ROWS))
MATH = {**IN_SOURCES, "db": IN_ROWS["db"]}  # of numbers: what .param knows
KNOWN = {**IN_SOURCES, **IN_ROWS}
ALIASES = {also: f.name for f in FUNCTIONS for also in f.also}
# which results alone know; `im` of a source is the size of a current as well
OF_COLUMNS = tuple(
    name for f in (*OF_ROWS, *COURSES) for name in (f.name, *f.also) if name != "db"
)  # fmt: skip


def script() -> str:
    """The page's functions: FUNCTIONS of numbers, WHOLE of courses. Random values are what they are in the deck."""
    of_numbers = {name: f.js for name, f in KNOWN.items()}
    of_numbers.update(dict.fromkeys(("gauss", "agauss", "unif", "aunif"), "(x) => x"))
    of_courses = {name: c.js for c in COURSES for name in (c.name, *c.also)}
    of_courses["ddt"] = of_courses["deriv"]
    return "\n".join(
        f"const {table} = {{\n" + "".join(f"{name}: {js},\n" for name, js in functions.items()) + "};"
        for table, functions in (("FUNCTIONS", of_numbers), ("WHOLE", of_courses))
    )

"""`.sens v(node[,node])|i(source) [ac dec|oct|lin n fstart fstop] [static]`: how an output changes with every parameter.

With F(x, p) = 0 at the operating point and a = G^-T dy/dx of the output y, dy/dp = -a . dF/dp; no operating point is sought
again. Over frequency, with (G + s C) X = b, it is -a . (dG/dp + s dC/dp) X; G and C change with the parameter itself and with
the operating point that it moves, dx/dp = -G^-1 dF/dp. What an element adds to F and Q is known as a function of its numbers
alone, so its derivatives are differences of sixth order of that one element, exact to some 1e-12.

Columns as ngspice names them: r1 of its value, r1_tc1 of a word of its line, d1:is of a word of its model, s1_k of a machine
card. What the machine stands still for at the operating point, its springs and masses, counts with `static` and
over frequency.
"""

from __future__ import annotations

import math

from ..diagnostics import Sink as Silent
from ..elements.o import ModelledLine
from ..elements.t import Line
from ..expr import Call
from .ac import excited, grid, linearised, singular
from .base import Analysis, Axis, Computed, Run, wrong
from .op import is_static
from .points import evenly
from .slopes import FORM, Slopes
from .tf import source_of

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from typing import Any, ClassVar, Self

    import numpy as np

    from .._engine import SmallSignal
    from ..assemble import Assembly, Context, Output
    from ..deck import Analysis as Card
    from ..deck import MachineCard, Probe
    from ..diagnostics import Sink
    from ..elements import Element
    from .base import Progress
    from .points import Points

    Derivative = Callable[[np.ndarray, np.ndarray | None, np.ndarray | None], list[complex]]

STEP = 3e-3  # of a parameter's value, or of 1 where that is 0
POINTS = ((1, 45.0), (2, -9.0), (3, 1.0))  # central difference of order 6: sum k (f(j h) - f(-j h))/(60 h)
ANCHOR = 1e-30  # S, from each node to ground: nothing, and no node floats
PLACES = (
    "ic",
    "guess",
    "x",
    "y",
    "angle",
    "vx",
    "vy",
    "omega",
)  # where the machine begins, not what its equations are
TIED = ("coordinate", "speed", "lambda", "mu")  # unknowns of the machine
MAIN = {"e": "gain", "f": "gain", "g": "gain", "h": "gain"}  # of the value of controlled sources
ALWAYS = ("m", "scale")  # words that count as given


class Sens(Analysis):
    word = "sens"
    form = ".sens v(node[,node])|i(source) [ac dec|oct|lin points fstart fstop], or " + FORM.removeprefix(
        ".sens "
    )
    meaning = "how an output changes with every parameter"
    plotname = "Sensitivity Analysis"
    names_itself = True
    shown: ClassVar[tuple[str, ...]] = ("sens",)
    axis: Axis | None = None

    def __init__(self, card: Card, output: Probe, frequencies: Points | None) -> None:
        self.card, self.output = card, output
        self.static = is_static(card)
        if frequencies is not None:
            self.frequencies = frequencies
            self.axis = Axis("frequency", "Hz", frequencies.law is not evenly)

    @classmethod
    def read(cls, card: Card, sink: Sink) -> Self | Slopes | None:
        from ..build import parse_signals

        args = [a.lower() if isinstance(a, str) else a for a in card.args if a != "static"]
        if "tran" in args:
            return Slopes.read(card, sink)
        at = next((k for k, a in enumerate(args) if a in ("ac", "dc")), len(args))
        asked = parse_signals(" ".join(map(str, args[:at])), ".sens") if at else []
        if len(asked) != 1 or (args[at:] and args[at] == "dc" and args[at + 1 :]):
            wrong(cls, card, sink, ".sens takes one signal, and for frequencies ac with dec, oct or lin")
            return None
        if not args[at:] or args[at] == "dc":
            return cls(card, asked[0], None)
        found = grid(cls, card, sink, args[at + 1 :])
        return None if found is None else cls(card, asked[0], found)

    def columns(self, ctx: Context) -> list[Output]:
        from ..assemble.outputs import column

        output = column(ctx, self.output.text, self.output.ast, self.card.span)
        ast = output.ast
        name = repr(ast.args[0]) if isinstance(ast, Call) and ast.fn == "i" and len(ast.args) == 1 else None
        source = None if name is None else source_of(ctx, name)
        if output.expr is None or (name is not None and (source is None or source.letter not in "Vv")):
            said = f".sens takes voltages, currents of voltage sources and joints, not `{self.output.text}`"
            wrong(type(self), self.card, ctx.sink, said)
            return []
        return [output]

    def run(self, assembly: Assembly, progress: Progress | None = None) -> Run:
        (output,) = assembly.outputs[self]
        assert output.expr is not None
        names: list[str] = []
        units: list[str] = []
        columns: list[list[complex]] = []
        linear, trouble = linearised(assembly, self, self.static, not self.static)
        over = None
        if linear is not None and self.axis is not None:
            over, trouble = linearised(assembly, self, self.static)
        if linear is not None and not trouble:
            try:
                for name, unit, column in self._all(assembly, linear, over):
                    names.append(name)
                    units.append(_ratio(output.unit, unit))
                    columns.append(column)
            except ValueError as error:
                trouble = [singular(assembly, self, error)]
        if self.axis is None:
            real = [[z.real for z in column] for column in columns]
            waves = Computed(real, status="failed" if trouble else "ok")
            return Run(self, names, units, waves, None, trouble=trouble)
        data = [[part for z in column for part in (z.real, z.imag)] for column in columns]
        waves = Computed(
            [self.frequencies, *data], [False] + [True] * len(data), "failed" if trouble else "ok"
        )
        return Run(self, ["frequency", *names], ["Hz", *units], waves, self.axis, trouble=trouble)

    def _all(
        self, assembly: Assembly, linear: SmallSignal, over: SmallSignal | None
    ) -> Iterator[tuple[str, str, list[complex]]]:
        """Name, unit and derivative by every parameter; over frequency, or the one number of the operating point."""
        import numpy as np

        from .pencil import dense

        ctx, system = assembly.ctx, assembly.system
        output = assembly.outputs[self][0].expr
        assert output is not None
        n, x = system.n, np.array(linear.x)
        held = np.array([not self.static and kind in TIED for kind in system.kinds])
        adjoint = np.array([z[0] for z in linear.adjoint((0.0, 0.0), output)])
        spectra = None
        if over is not None:
            s = [2j * math.pi * f for f in self.frequencies]
            pairs = [(z.real, z.imag) for z in s]
            whole = over.respond(pairs, [ctx.b.x(k) for k in range(n)], excited(ctx))
            answers = np.array([np.frombuffer(column, complex) for column in whole]).T
            adjoints = np.array([[complex(*z) for z in over.adjoint(p, output)] for p in pairs])
            spectra = s, answers, adjoints
            solve = np.linalg.inv(dense(linear)[0])

        def result(df: np.ndarray, dg: np.ndarray | None, dc: np.ndarray | None) -> list[complex]:
            df[held] = 0.0
            if spectra is None:
                return [complex(0.0 - adjoint @ df)]
            moved = -(solve @ df)
            if moved.any():
                more = _along(system, x, moved)
                dg, dc = (b if a is None else a + b for a, b in zip((dg, dc), more, strict=True))
            if dg is None or dc is None:
                return [0j] * len(spectra[0])
            return [0.0 - complex(a @ (dg @ v + s * (dc @ v))) for s, v, a in zip(*spectra, strict=True)]

        yield from self._by_elements(assembly, linear, over, result, spectra)
        yield from _by_cards(assembly, x, over is not None, result)

    def _by_elements(
        self,
        assembly: Assembly,
        linear: SmallSignal,
        over: SmallSignal | None,
        result: Derivative,
        spectra: Any,
    ) -> Iterator[tuple[str, str, list[complex]]]:
        """`result` makes derivatives of the change of F, G and C; `spectra` over frequency: places, answers, adjoints."""
        import numpy as np

        ctx, n, x = assembly.ctx, assembly.system.n, np.array(linear.x)
        for e in ctx.elements.values():
            if e.letter in "VvIi":
                yield from self._of_source(assembly, linear, over, e, result)
                continue
            if isinstance(e, Line):
                # its numbers turn phases, which no difference of G and C tells; at the operating point it is a wire
                if spectra is None:
                    yield from (
                        (f"{e.name}_{key}", e.instance[key].unit, [0j])
                        for key in e.turns(0.0, (0, 0), (0, 0))
                    )
                else:
                    yield from _of_line(ctx, e, *spectra)
                continue
            if isinstance(e, ModelledLine):
                for name, unit, value, write in _parameters(e):
                    if value:
                        moved, turned = _of_modelled(ctx, e, x, value, write, spectra)
                        direct = result(moved, None, None)
                        yield (
                            name,
                            unit,
                            direct
                            if turned is None
                            else [a + b for a, b in zip(direct, turned, strict=True)],
                        )
                continue
            for name, unit, value, write in _parameters(e):
                found = _changes(
                    n, value, over is not None, _of_element(assembly, e, x, over is not None, write)
                )
                if found is not None:
                    yield name, unit, result(*found)
                    if over is not None and e.letter in "Rr" and name == e.name and not e.params.get("ac"):
                        # by the resistance to small signals alone, which is the same here
                        yield f"{name}_ac", unit, result(np.zeros(n), *found[1:])

    def _of_source(
        self,
        assembly: Assembly,
        linear: SmallSignal,
        over: SmallSignal | None,
        e: Element,
        result: Callable[..., Any],
    ) -> Iterator[tuple[str, str, list[complex]]]:
        """The value of a source, how many of them are in parallel, and the magnitude and phase of its small signal."""
        import numpy as np

        ctx, output = assembly.ctx, assembly.outputs[self][0].expr
        assert output is not None
        one = [(ctx.wave(e), (1.0, 0.0))]
        unit = "A" if e.letter in "Ii" else "V"
        xs = [ctx.b.x(k) for k in range(assembly.system.n)]
        if over is None:
            (gain,) = linear.respond([(0.0, 0.0)], [output], one)
            by = complex(np.frombuffer(gain, complex)[0])
            yield e.name, unit, [by]
            if e.is_multiplied:
                yield f"{e.name}_m", "", [by * ctx.value_at_start(e) / e.number("m", 1.0)]
            return
        moved = np.array([np.frombuffer(c, complex)[0].real for c in linear.respond([(0.0, 0.0)], xs, one)])
        from .pencil import dense

        of_value = result(-(dense(linear)[0] @ moved), None, None)
        yield e.name, unit, of_value
        of_count = [by * ctx.value_at_start(e) for by in of_value]
        for k, z in e.excite(ctx):
            unit_phasor = z / abs(z)
            pairs = [(0.0, 2.0 * math.pi * f) for f in self.frequencies]
            found = over.respond(pairs, [output], [(k, (unit_phasor.real, unit_phasor.imag))])
            gains = np.frombuffer(found[0], complex)
            yield f"{e.name}_acmag", unit, list(gains)
            of_count = [by + abs(z) * complex(g) for by, g in zip(of_count, gains, strict=True)]
            if (e.extra.get("ac") or (0.0, 0.0))[1]:
                yield f"{e.name}_acphase", "deg", list(gains * abs(z) * 1j * math.pi / 180.0)
        if e.is_multiplied:
            yield f"{e.name}_m", "", [by / e.number("m", 1.0) for by in of_count]


def _of_line(
    ctx: Context, e: Line, frequencies: list[complex], answers: np.ndarray, adjoints: np.ndarray
) -> Iterator[tuple[str, str, list[complex]]]:
    """By what a lossless line is given, at every frequency s."""
    rows = [ctx.branches[f"{e.name}#i{k}"] for k in (1, 2)]
    ends = [(ctx.node(e.nodes[k]), ctx.node(e.nodes[k + 1])) for k in (0, 2)]
    found: dict[str, list[complex]] = {}
    for s, x, adjoint in zip(frequencies, answers, adjoints, strict=True):
        at = [0j if k < 0 else complex(x[k]) for pair in ends for k in pair]
        turns = e.turns(s, (at[0] - at[1], at[2] - at[3]), (complex(x[rows[0]]), complex(x[rows[1]])))
        for key, changes in turns.items():
            by = -sum(complex(adjoint[r]) * change for r, change in zip(rows, changes, strict=True))
            found.setdefault(key, []).append(by)
    yield from ((f"{e.name}_{key}", e.instance[key].unit, column) for key, column in found.items())


def _of_modelled(
    ctx: Context,
    e: ModelledLine,
    x: np.ndarray,
    value: float,
    write: Callable[[float], None],
    spectra: tuple[list[complex], np.ndarray, np.ndarray] | None,
) -> tuple[np.ndarray, list[complex] | None]:
    """Of a line that its admittances describe: what a parameter adds to F at the operating point x, and over frequency what it
    changes in the output by itself."""
    import numpy as np

    ports = [(ctx.node(node), ctx.node(against)) for *nodes, against in e.ends for node in nodes]

    slope = e.slope(value, write)

    def along(at: np.ndarray) -> np.ndarray:
        return np.array([(at[p] if p >= 0 else 0.0) - (at[q] if q >= 0 else 0.0) for p, q in ports])

    df = np.zeros(len(x))
    still = slope(0.0) @ along(x)
    for (p, q), i in zip(ports, still.real, strict=True):
        for row, sign in ((p, 1.0), (q, -1.0)):
            if row >= 0:
                df[row] += sign * i
    if spectra is None:
        return df, None
    return df, [
        -complex(along(adjoint) @ slope(s) @ along(at)) for s, at, adjoint in zip(*spectra, strict=True)
    ]


def _parameters(e: Element) -> Iterator[tuple[str, str, float, Callable[[float], None]]]:
    """Name, unit, value and how it is set, of everything that is a number of an element's line and model."""

    if isinstance(e.value, (int, float)) and e.letter not in "BbSsWw":
        word = MAIN.get(e.letter.lower())
        yield (
            f"{e.name}_{word}" if word else e.name,
            e.unit,
            float(e.value),
            _put_value(e),
        )
    for key, param in e.instance.items():
        value = e.params.get(
            key, param.default if key in ALWAYS or (e.model_types and key == "area") else None
        )
        if (
            param.meaning
            and isinstance(value, (int, float))
            and key not in (*e.flags, "ic", "noisy", "noise")
        ):
            yield f"{e.name}_{key}", param.unit, float(value), _put(e, key)
    if e.model is None:
        return
    model = e.model.params
    for words, unit, default, _ in e.model_table():
        key = next((w for w in words if w in model), words[0])
        value = model.get(key, default)
        if key == "level" or not isinstance(value, (int, float)) or not math.isfinite(value):
            continue
        if value or key in model:
            yield f"{e.name}:{key}", unit, float(value), _put_model(model, key)


def _put(e: Element, key: str) -> Callable[[float], None]:
    def put(value: float) -> None:
        e.params[key] = value

    return put


def _put_value(e: Element) -> Callable[[float], None]:
    def put(value: float) -> None:
        e.value = value

    return put


def _put_model(params: dict[str, Any], key: str) -> Callable[[float], None]:
    def put(value: float) -> None:
        params[key] = value

    return put


def _changes(
    n: int, value: float, matrices: bool, parts: Callable[[float], Sequence[np.ndarray] | None]
) -> tuple[np.ndarray, np.ndarray | None, np.ndarray | None] | None:
    """dF/dp, dG/dp, dC/dp of `parts`, what a parameter adds to F, G and C; None where there is no such derivative."""
    import numpy as np

    step = STEP * (abs(value) or 1.0)
    sums = [np.zeros(n), *([np.zeros((n, n)), np.zeros((n, n))] if matrices else [])]
    for j, weight in POINTS:
        for side in (1, -1):
            found = parts(value + side * j * step)
            if found is None:
                return None
            for total, part in zip(sums, found, strict=True):
                total += side * weight / (60.0 * step) * part
    return sums[0], sums[1] if matrices else None, sums[2] if matrices else None


def _by_cards(
    assembly: Assembly, x: np.ndarray, small: bool, result: Derivative
) -> Iterator[tuple[str, str, list[complex]]]:
    """By the numbers of machine cards."""
    from ..cards import CARDS

    for card in assembly.flat.machine:
        for key, number in card.params.items():
            spec = CARDS[card.kind].spec.params.get(key)
            if (
                spec is None
                or spec.kind not in ("number", "formula", "value", "vector")
                or not isinstance(number, float)
                or key in PLACES
            ):
                continue
            found = _changes(assembly.system.n, number, small, _of_card(assembly, card, key, x, small))
            if found is not None:
                yield f"{card.name}_{key}", spec.unit, result(*found)


def _of_element(
    assembly: Assembly, e: Element, x: np.ndarray, matrices: bool, write: Callable[[float], None]
) -> Callable[[float], Sequence[np.ndarray] | None]:
    """What an element adds, with another value of one of its parameters."""

    def parts(value: float) -> Sequence[np.ndarray] | None:
        before, params = e.value, e.params
        model = {} if e.model is None else dict(e.model.params)
        e.params = dict(params)
        try:
            write(value)
            return _own(assembly, e, x, matrices)
        finally:
            e.value, e.params = before, params
            if e.model is not None:
                e.model.params.clear()
                e.model.params.update(model)

    return parts


def _of_card(
    assembly: Assembly, card: MachineCard, key: str, x: np.ndarray, matrices: bool
) -> Callable[[float], Sequence[np.ndarray] | None]:
    """The whole of the equations, with another value of a parameter of a machine card."""
    import numpy as np

    from ..assemble import assemble
    from ..diagnostics import DeckError

    flat, at = assembly.flat, np.arange(len(x))

    def parts(value: float) -> Sequence[np.ndarray] | None:
        before, sink = card.params[key], flat.sink
        card.params[key], flat.sink = value, Silent()
        try:
            system = assemble(flat, dict(assembly.options), assembly.ctx.times).system
        except DeckError:
            return None
        finally:
            card.params[key], flat.sink = before, sink
        if system.names != assembly.system.names:
            return None
        found = [np.array(system.f(x.tolist(), 0.0))]
        if matrices:
            c, g = system.jac(x.tolist(), 0.0)
            found += [_whole(system, g, at, len(x)), _whole(system, c, at, len(x))]
        return found

    return parts


def _own(assembly: Assembly, e: Element, x: np.ndarray, matrices: bool) -> Sequence[np.ndarray] | None:
    """F, and G and C, of an element alone, in the rows of the whole; None where it cannot be what it is made."""
    import numpy as np

    still = _alone(assembly, e)
    if still is None:
        return None
    parts = [np.zeros(len(x))]
    system, at, is_another = still
    np.add.at(parts[0], at, system.f(x[at].tolist(), 0.0))
    if matrices:
        # it may be another one to small signals
        moving = _alone(assembly, e, True) if is_another else still
        if moving is None:
            return None
        system, at, _ = moving
        parts += [_whole(system, values, at, len(x)) for values in reversed(system.jac(x[at].tolist(), 0.0))]
    for node, root in system.sums:  # its own rows, not sums of them
        for part in parts:
            part[at[root]] -= part[at[node]]
    for node, root in assembly.system.sums:
        for part in parts:
            part[root] += part[node]
    return parts


def _alone(assembly: Assembly, e: Element, small: bool = False) -> tuple[Any, np.ndarray, bool] | None:
    """An element as a system of its own, the places of its unknowns in the whole, and whether it is another one to `small`
    signals; None where it cannot be what it is made."""
    import numpy as np

    from .._engine import Builder
    from ..assemble import Compiling, circuit
    from ..elements.rows import SMALL_SIGNALS

    names = {name: k for k, name in enumerate(assembly.system.names)}
    ctx = Compiling(Builder(), assembly.flat, assembly.options)
    ctx.sink, ctx.times, ctx.machine = Silent(), assembly.ctx.times, None
    if small:
        ctx.flags[SMALL_SIGNALS] = ctx.b.const(1.0)
    circuit.allocate(ctx)
    for row in ctx.nodes.values():
        ctx.b.g(row, row, ANCHOR)
    also = [
        k
        for k in ctx.elements.values()
        if k.letter in "Kk" and e.name in map(ctx.element_name, k.extra["inductors"])
    ]
    try:
        for one in (e, *also):
            one.contribute(ctx)
    except ValueError:
        return None
    if ctx.sink.error_count:
        return None
    system = ctx.b.compile()
    try:
        at = np.array([names[name] for name in system.names])
    except KeyError:
        return None
    return system, at, SMALL_SIGNALS in ctx.flags


def _whole(system: Any, values: list[float], at: np.ndarray, n: int) -> np.ndarray:
    """A matrix on a system's pattern, in the rows and columns `at` of one of n."""
    import numpy as np

    indptr, rows = system.pattern()
    columns = np.repeat(np.arange(system.n), np.diff(indptr))
    whole = np.zeros((n, n))
    np.add.at(whole, (at[np.array(rows, int)], at[columns]), values)
    return whole


def _along(system: Any, x: np.ndarray, direction: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives of G and C at x along a direction."""
    import numpy as np

    at = np.arange(system.n)
    scale = 1e-3 / np.abs(direction).max()
    sums = [np.zeros((system.n, system.n)), np.zeros((system.n, system.n))]
    for j, weight in POINTS:
        for side in (1, -1):
            c, g = system.jac((x + side * j * scale * direction).tolist(), 0.0)
            for total, values in zip(sums, (g, c), strict=True):
                total += side * weight / (60.0 * scale) * _whole(system, values, at, system.n)
    return sums[0], sums[1]


def _ratio(unit: str, by: str) -> str:
    """The unit of a quotient."""
    return f"{unit}/({by})" if set(by) & set(" /") else f"{unit}/{by}" if by else unit

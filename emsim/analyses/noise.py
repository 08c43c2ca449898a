"""`.noise v(out[,ref]) source dec|oct|lin n fstart fstop [k] [static]`: what the noise of all resistances and junctions comes to.

One solution of the transposed equations a frequency tells what every source of noise gives at the output. Spectra are square
roots of densities, onoise_spectrum at the output, inoise_spectrum so much at the source; totals are integrals over the
frequencies, by power laws from one to the next as ngspice takes them. With k every k-th frequency is kept, and there is a
column for every source of noise: onoise_r1, and onoise_r1_thermal and onoise_r1_1overf where it has several.
"""

from __future__ import annotations

import math

from ..elements.base import BOLTZMANN, ZERO_CELSIUS
from ..expr import Node
from .ac import OverFrequencies, grid, linearised, singular
from .base import Computed, Run, wrong
from .tf import source_of

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from typing import ClassVar, Self

    from .._engine import Expr, SmallSignal
    from ..assemble import Assembly, Context, Output
    from ..deck import Analysis as Card
    from ..deck import Probe
    from ..diagnostics import Sink
    from .base import Progress
    from .points import Points

    # element, word, rows with factors, power density at 1 Hz, exponent
    Source = tuple[str, str, list[tuple[int, float]], float, float]

LEAST = 1e-38  # of a density, before its logarithm is taken
FLAT = 1e-10  # an exponent of frequency that is none


class Noise(OverFrequencies):
    word = "noise"
    asks_as = "noise"
    form = ".noise v(node[,node]) source dec|oct|lin points fstart fstop [every]"
    meaning = "noise at an output and at a source, over frequency and in total"
    plotname = "Noise Spectral Density Curves"
    has_responses = True
    tables: ClassVar[tuple[str, ...]] = ("noise", "integrated noise")
    shown: ClassVar[tuple[str, ...]] = ("integrated noise",)
    names_itself = True

    def __init__(self, card: Card, output: Probe, source: str, frequencies: Points, every: int) -> None:
        super().__init__(card, frequencies)
        self.output, self.source, self.every = output, source, every

    @classmethod
    def read(cls, card: Card, sink: Sink) -> Self | None:
        from ..build import parse_signals

        args = [a for a in card.args if a != "static"]
        at = next(
            (k for k, a in enumerate(args) if isinstance(a, str) and a.lower() in ("dec", "oct", "lin")), 0
        )
        numbers = [float(a) for a in args[at + 1 :] if not isinstance(a, str)]
        strange = [a for a in args[at:] if isinstance(a, str)]
        if at < 2 or len(numbers) not in (3, 4):
            said = ".noise takes a signal, a source, dec, oct or lin, a number of points and two frequencies"
            wrong(cls, card, sink, said)
            return None
        asked = parse_signals(" ".join(map(str, args[: at - 1])), ".noise")
        if len(asked) != 1:
            wrong(cls, card, sink, f".noise takes one signal, there are {len(asked)}")
            return None
        found = grid(cls, card, sink, [*strange, *numbers[:3]])
        if found is None:
            return None
        if not found[0] > 0.0:
            wrong(cls, card, sink, ".noise begins above 0 Hz")
            return None
        every = int(numbers[3]) if numbers[3:] else 0
        return cls(card, asked[0], str(args[at - 1]).lower(), found, max(every, 0))

    def columns(self, ctx: Context) -> list[Output]:
        from ..assemble.outputs import column

        if source_of(ctx, self.source) is None:
            names = [x.name for x in ctx.elements.values() if x.letter in "VvIi"]
            said = f".noise reads `{self.source}`, which is no source of this deck"
            ctx.unknown("E309", said, self.source, names, self.card.span)
        output = column(ctx, self.output.text, self.output.ast, self.card.span)
        if output.expr is None:
            said = f".noise takes a signal, `{self.output.text}` is made of some"
            wrong(type(self), self.card, ctx.sink, said)
            return []
        return [output]

    def run(self, assembly: Assembly, progress: Progress | None = None) -> Run:
        ctx = assembly.ctx
        (output,) = assembly.outputs[self]
        source = source_of(ctx, self.source)
        assert output.expr is not None and source is not None
        linear, trouble = linearised(assembly, self, self.static)
        columns: list[bytes] = []
        sources: list[Source] = []
        colours: list[
            tuple[int, Callable[[float], float]]
        ] = []  # which of them, and its factor at a frequency
        if linear is not None:
            sources = list(_sources(assembly, linear))
            for k, (name, word, *_) in enumerate(sources):
                factor = getattr(ctx.elements.get(name), "noise_tables", {}).get(word)
                if factor is not None:
                    colours.append((k, factor))
            for e in ctx.elements.values():
                for word, rows, density in e.coloured(ctx):
                    colours.append((len(sources), density))
                    sources.append((e.name, word, rows, 1.0, 0.0))
            silent = [e.name for e in ctx.elements.values() if e.letter in "Rr" and isinstance(e.value, Node)]
            if silent:
                assembly.flat.sink.note(
                    "N296",
                    f"resistances that are expressions make no noise, as in ngspice: {', '.join(silent[:8])}",
                    self.card.span,
                    "a resistor of a number makes thermal noise",
                )
            try:
                columns = linear.noise(
                    list(self.frequencies), output.expr, ctx.wave(source), [s[2:] for s in sources]
                )
            except ValueError as error:
                trouble = [singular(assembly, self, error)]
        units = f"{output.unit}/sqrt(Hz)", f"{'A' if source.letter in 'Ii' else 'V'}/sqrt(Hz)"
        if not columns:
            failed = Computed([[], [], []], status="failed")
            names = ["frequency", "onoise_spectrum", "inoise_spectrum"]
            return Run(self, names, ["Hz", *units], failed, self.axis, trouble=trouble)
        gain = [max(g, LEAST) for g in memoryview(columns[0]).cast("d")]
        densities: list[Sequence[float]] = [memoryview(c).cast("d") for c in columns[1:]]
        for k, density in colours:
            densities[k] = [d * density(f) for d, f in zip(densities[k], self.frequencies, strict=True)]
        names, own = _named(sources)
        curves = [_sum(densities, members, len(gain)) for members in own]
        spectra = Run(
            self,
            ["frequency", *(f"onoise_{name}" for name in (names if self.every else ["spectrum"])), "inoise_spectrum"],
            ["Hz", *([units[0]] * (len(names) if self.every else 1)), units[1]],
            self._spectra(gain, curves if self.every else curves[-1:]),
            self.axis,
        )  # fmt: skip
        if len(self.frequencies) == 1:
            return spectra  # as in ngspice: of one frequency there is no integral
        frequencies = list(self.frequencies)
        totals = [_integrals(frequencies, d, gain) for d in densities]
        shown = range(len(names)) if self.every else [len(names) - 1]
        integrated: list[list[float]] = []
        columns_of: list[str] = []
        for k in shown:
            word = "" if k == len(names) - 1 else f"_{names[k]}"
            for side, letter in enumerate("oi"):
                columns_of.append(f"{letter}noise_total{word}")
                integrated.append([math.sqrt(sum(totals[j][side] for j in own[k]))])
        plain = [unit.partition("/sqrt")[0] for unit in units]
        whole, plain = Computed(integrated), plain * len(shown)
        totals_of = Run(
            self, columns_of, plain, whole, None, kind=self.tables[1], plotname="Integrated Noise"
        )
        spectra.beside.append(totals_of)
        return spectra

    def _spectra(self, gain: Sequence[float], curves: list[list[float]]) -> Computed:
        kept = slice(None, None, self.every or 1)
        at_source = [d / g for d, g in zip(curves[-1], gain, strict=True)]
        roots = [[math.sqrt(d) for d in c[kept]] for c in (*curves, at_source)]
        return Computed([list(self.frequencies)[kept], *roots])


def _named(sources: list[Source]) -> tuple[list[str], list[list[int]]]:
    """Columns behind `onoise_`, and the sources of each: those of an element by name, the element, and all."""
    found: dict[str, list[int]] = {}
    of: dict[str, list[int]] = {}
    for k, (name, *_) in enumerate(sources):
        of.setdefault(name, []).append(k)
    for name, members in of.items():
        for k in members:
            if word := sources[k][1]:
                found.setdefault(f"{name}_{word}", []).append(k)
        found[name] = members
    found["spectrum"] = list(range(len(sources)))
    return list(found), list(found.values())


def _sum(densities: list[Sequence[float]], members: Sequence[int], count: int) -> list[float]:
    total = [0.0] * count
    for k in members:
        total = [a + b for a, b in zip(total, densities[k], strict=True)]
    return total


def _integrals(f: Sequence[float], density: Sequence[float], gain: Sequence[float]) -> tuple[float, float]:
    """The integrals of a density over frequency, at the output and at the source."""
    if max(density) <= LEAST:
        return 0.0, 0.0
    seen = [max(d, LEAST) for d in density]
    return _integral(f, density, seen), _integral(
        f, density, [d / g for d, g in zip(seen, gain, strict=True)]
    )


def _integral(f: Sequence[float], density: Sequence[float], values: Sequence[float]) -> float:
    """Between two points a power of frequency; nothing where the density is none."""
    total, log = 0.0, math.log
    below, before, known = f[0], values[0], density[0]
    for at, here, own in zip(f[1:], values[1:], density[1:], strict=True):
        if known > LEAST or own > LEAST:
            step = log(at / below)
            exponent = log(here / before) / step
            if abs(exponent + 1.0) < FLAT:
                total += here * at * step
            else:
                total += (here * at - before * below) / (exponent + 1.0)
        below, before, known = at, here, own
    return total


def _sources(assembly: Assembly, linear: SmallSignal) -> Iterator[Source]:
    """Every source of noise of the deck at the operating point: of elements, of the engine's devices, of the machine."""
    ctx = assembly.ctx
    of_devices, series = linear.device_noise()
    devices: dict[str, list[Source]] = {}
    behind: dict[str, int] = {}
    for name, *_ in series:
        behind[name] = behind.get(name, 0) + 1
    for name, terminal, nodes, conductance in series:
        e = ctx.elements[name]
        power = 4.0 * BOLTZMANN * (e.temperature(ctx) + ZERO_CELSIUS) * conductance
        word = "rs" if behind[name] == 1 else f"r{e.terminals[terminal][0]}"
        devices.setdefault(name, []).append((name, word, _rows(nodes), power, 0.0))
    for name, word, nodes, power, exponent in of_devices:
        if word == "flicker" and ctx.elements[name].letter != "n":
            word = "1overf"  # ngspice's word for its own devices
        devices.setdefault(name, []).append((name, word, _rows(nodes), power, exponent))
    found: list[tuple[str, str, list[tuple[int, Expr | float]], Expr | float, float]] = []
    for e in ctx.elements.values():
        yield from devices.get(e.name, ())
        for word, density, exponent, *between in e.noise(ctx):
            nodes = between[0] if between else (ctx.node(e.nodes[0]), ctx.node(e.nodes[1]))
            found.append((e.name, word, [*_rows(nodes)], density, exponent))
    if assembly.machine is not None:
        found += assembly.machine.noise()
    # numbers that the point decides, all at once
    values = iter(
        linear.values([x for _, _, rows, power, _ in found for x in (*(k for _, k in rows), power)])
    )
    for name, word, rows, _, exponent in found:
        yield name, word, [(row, next(values)) for row, _ in rows], next(values), exponent


def _rows(nodes: Sequence[int]) -> list[tuple[int, float]]:
    return [(row, sign) for row, sign in zip(nodes, (1.0, -1.0), strict=True) if row >= 0]

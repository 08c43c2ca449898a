"""`.tf output source [static]`: the small-signal gain at the operating point, and the resistances seen there.

The machine stands still, as at the operating point; with `static` it is let go, and comes to rest.
"""

from __future__ import annotations

from ..expr import Call
from .ac import linearised, singular
from .base import Analysis, Computed, Run, wrong
from .op import is_static

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Self

    from ..assemble import Assembly, Context, Output
    from ..deck import Analysis as Card
    from ..deck import Probe
    from ..diagnostics import Sink
    from ..elements import Element
    from .base import Progress

    Injected = list[tuple[int, tuple[float, float]]]


class Tf(Analysis):
    word = "tf"
    form = ".tf v(node[,node]) source, .tf i(source) source"
    meaning = "gain from a source to a signal, resistances at both"
    plotname = "Transfer Function"
    has_responses = True
    names_itself = True

    def __init__(self, card: Card, output: Probe, source: str) -> None:
        self.card, self.output, self.source = card, output, source
        self.static = is_static(card)

    @classmethod
    def read(cls, card: Card, sink: Sink) -> Self | None:
        from ..build import parse_signals

        words = [str(a) for a in card.args if a != "static"]
        if len(words) < 2:
            wrong(cls, card, sink, ".tf takes a signal and a source")
            return None
        asked = parse_signals(" ".join(words[:-1]), ".tf")
        if len(asked) != 1:
            wrong(cls, card, sink, f".tf takes one signal, there are {len(asked)}")
            return None
        return cls(card, asked[0], words[-1].lower())

    def columns(self, ctx: Context) -> list[Output]:
        from ..assemble.outputs import column

        e = source_of(ctx, self.source)
        if e is None:
            names = [x.name for x in ctx.elements.values() if x.letter in "VvIi"]
            ctx.unknown(
                "E309", f".tf reads `{self.source}`, which is no source of this deck", self.source, names, self.card.span
            )  # fmt: skip
        output = column(ctx, self.output.text, self.output.ast, self.card.span)
        if output.expr is None:
            wrong(
                type(self), self.card, ctx.sink, f".tf takes a signal, `{self.output.text}` is made of some"
            )
            return []
        own = [output]
        if e is not None:
            across = ctx.v(e.nodes[1], e.nodes[0]) if e.letter in "Ii" else ctx.b.x(ctx.branches[e.name])
            own.append(type(output)(e.name, "", across))
        return own

    def run(self, assembly: Assembly, progress: Progress | None = None) -> Run:
        ctx = assembly.ctx
        source = source_of(ctx, self.source)
        output, at_source = assembly.outputs[self]
        assert source is not None and output.expr is not None and at_source.expr is not None
        drives = source.letter in "Ii"
        names = ["transfer_function", f"{source.name}#input_impedance"]
        gain = {("V", True): "Ohm", ("A", False): "S", ("V", False): "", ("A", True): ""}
        units = [gain.get((output.unit, drives), f"{output.unit}/{'A' if drives else 'V'}"), "Ohm"]
        probe = self._probe(ctx)
        if probe is not None:
            names.append(probe[0])
            units.append("Ohm")
        linear, trouble = linearised(assembly, self, self.static, not self.static)
        found: list[list[float]] = []
        if linear is not None:
            try:
                dc, one = [(0.0, 0.0)], (1.0, 0.0)
                both = linear.respond(dc, [output.expr, at_source.expr], [(ctx.wave(source), one)])
                gained, seen = map(_real, both)
                found = [[gained], [seen if drives else _inverse(-seen)]]
                if probe is not None:
                    _, sources, rows = probe
                    out = _real(linear.respond(dc, [output.expr], sources, rows)[0])
                    found.append([_inverse(-out) if sources else out])
            except ValueError as error:
                found, trouble = [], [singular(assembly, self, error)]
        waves = Computed(found or [[] for _ in names], status="ok" if found else "failed")
        return Run(self, names, units, waves, None, trouble=trouble)

    def _probe(self, ctx: Context) -> tuple[str, Injected, Injected] | None:
        """Name of the resistance at the output, and what is to be injected there: a volt into a source, or an ampere between
        two nodes. None where the output is neither a voltage nor the current of a source."""
        ast, one = self.output.ast, (1.0, 0.0)
        if isinstance(ast, Call) and ast.fn == "i" and len(ast.args) == 1:
            e = source_of(ctx, repr(ast.args[0]))
            if e is None or e.letter not in "Vv":
                return None
            return f"{e.name}#output_impedance", [(ctx.wave(e), one)], []
        nodes = [repr(a) for a in ast.args] if isinstance(ast, Call) and ast.fn == "v" else [repr(ast)]
        places = [ctx.nodes.get(name, -1) for name in nodes]
        signs = ((1.0, 0.0), (-1.0, 0.0))
        rows = [(k, sign) for k, sign in zip(places, signs, strict=False) if k >= 0]
        return (f"output_impedance_at_v({','.join(nodes)})", [], rows) if rows else None


def source_of(ctx: Context, name: str) -> Element | None:
    """The V or I element of a name."""
    e = ctx.elements.get(ctx.element_name(name))
    return e if e is not None and e.letter in "VvIi" else None


def _real(column: bytes) -> float:
    return memoryview(column).cast("d")[0]


def _inverse(x: float) -> float:
    return 1.0 / x if x else 1e20  # a resistance without end, as ngspice writes it

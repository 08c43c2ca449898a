"""`.pz in+ in- out+ out- cur|vol pol|zer|pz [static]`: poles and zeros of the small signals from an input to an output.

cur: a current into the input, v(out)/i(in); vol: a voltage across it, v(out)/v(in). Poles are the s at which the equations
with the input left open (cur) or shorted (vol) have a solution; zeros those at which they have one with the output 0 whatever
the input. A source across the input that is a voltage source already drives it. Machine included: poles of both worlds.
"""

from __future__ import annotations

from .ac import linearised, without_delays
from .base import Analysis, Computed, Run, wrong
from .op import is_static

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import ClassVar, Self

    import numpy as np

    from ..assemble import Assembly, Context, Output
    from ..deck import Analysis as Card
    from ..diagnostics import Diagnostic, Sink
    from .base import Progress

DRIVES, WANTED = ("cur", "vol"), ("pol", "zer", "pz")


class Pz(Analysis):
    word = "pz"
    asks_as = "ac"
    form = ".pz in+ in- out+ out- cur|vol pol|zer|pz"
    meaning = "poles and zeros from an input to an output"
    plotname = "Pole-Zero Analysis"
    names_itself = True
    shown: ClassVar[tuple[str, ...]] = ("pz",)
    complex = True

    def __init__(self, card: Card, nodes: list[str], drive: str, wanted: str) -> None:
        self.card, self.nodes, self.drive, self.wanted = card, nodes, drive, wanted
        self.static = is_static(card)

    @classmethod
    def read(cls, card: Card, sink: Sink) -> Self | None:
        words = [a.lower() if isinstance(a, str) else f"{a:g}" for a in card.args if a != "static"]
        if len(words) != 6 or words[4] not in DRIVES or words[5] not in WANTED:
            said = ".pz takes four nodes, cur or vol, and pol, zer or pz"
            wrong(cls, card, sink, said)
            return None
        nodes = words[:4]
        for what, (a, b) in (("input", nodes[:2]), ("output", nodes[2:])):
            if a == b:
                wrong(cls, card, sink, f"the {what} of .pz is one node, `{a}`")
                return None
        return cls(card, nodes, words[4], words[5])

    def columns(self, ctx: Context) -> list[Output]:
        without_delays(self, ctx)
        for name in self.nodes:
            if name not in ctx.nodes and name not in ("0", "gnd"):
                ctx.unknown(
                    "E309",
                    f".pz names `{name}`, which is no node of this deck",
                    name,
                    ctx.nodes,
                    self.card.span,
                )
        return []

    def run(self, assembly: Assembly, progress: Progress | None = None) -> Run:
        linear, trouble = linearised(assembly, self, self.static)
        names: list[str] = []
        columns: list[list[float]] = []
        if linear is not None:
            from .pencil import SingularPencil, dense, eigenvalues

            g, c = dense(linear)
            for word, which in (("pole", self._poles), ("zero", self._zeros)):
                if self.wanted not in (word[:3], "pz"):
                    continue
                try:
                    found = eigenvalues(*which(assembly, g, c))
                except SingularPencil:
                    trouble = [_no_answer(self, word)]
                    break
                for k, s in enumerate(found, 1):
                    names.append(f"{word}({k})")
                    columns.append([s.real, s.imag])
        waves = Computed(columns, [True] * len(columns), "failed" if trouble else "ok")
        return Run(self, names, ["1/s"] * len(names), waves, None, trouble=trouble)

    def _poles(self, assembly: Assembly, g: np.ndarray, c: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """As they are, or with the input shorted."""
        if self.drive == "cur" or self._source(assembly.ctx) is not None:
            return g, c
        across = self._across(assembly, self.nodes[:2])
        return _bordered(g, c, self._summed(assembly, across), across)

    def _zeros(self, assembly: Assembly, g: np.ndarray, c: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """With one unknown more, what drives the input, and one row more: the output is 0."""
        import numpy as np

        source = self._source(assembly.ctx) if self.drive == "vol" else None
        if source is None:
            drives = self._summed(assembly, self._across(assembly, self.nodes[:2]))
        else:
            drives = np.zeros(len(g))
            drives[source] = 1.0
        return _bordered(g, c, drives, self._across(assembly, self.nodes[2:]))

    def _source(self, ctx: Context) -> int | None:
        """The row of a voltage source across the input."""
        ends = {self._plain(n) for n in self.nodes[:2]}
        for e in ctx.elements.values():
            if e.letter in "Vv" and {self._plain(n) for n in e.nodes[:2]} == ends:
                return ctx.branches[e.name]
        return None

    @staticmethod
    def _plain(node: str) -> str:
        return "0" if node == "gnd" else node

    def _across(self, assembly: Assembly, nodes: list[str]) -> np.ndarray:
        """The voltage between two nodes, as factors of the unknowns."""
        import numpy as np

        row = np.zeros(assembly.system.n)
        for name, sign in zip(nodes, (1.0, -1.0), strict=True):
            if (k := assembly.ctx.nodes.get(name, -1)) >= 0:
                row[k] = sign
        return row

    @staticmethod
    def _summed(assembly: Assembly, injected: np.ndarray) -> np.ndarray:
        """A current between nodes in the rows of F, some of which are sums of nodes' rows."""
        injected = injected.copy()
        for node, root in assembly.system.sums:
            injected[root] += injected[node]
        return injected


def _bordered(
    g: np.ndarray, c: np.ndarray, column: np.ndarray, row: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    import numpy as np

    whole = np.block([[g, column[:, None]], [row[None, :], np.zeros((1, 1))]])
    return whole, np.pad(c, ((0, 1), (0, 1)))


def _no_answer(analysis: Pz, word: str) -> Diagnostic:
    from ..diagnostics import Diagnostic

    said = {
        "pole": "the poles are not determined: the equations have a solution at every frequency",
        "zero": "there are no zeros: nothing of the input arrives at the output",
    }[word]
    return Diagnostic(
        "error", "E411", said, analysis.card.span, "the input must not be shorted by a source that it drives"
    )

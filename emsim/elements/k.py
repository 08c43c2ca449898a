"""K: mutual inductance M = k sqrt(Li Lj) between every pair of the named inductors; with a .model CORE a magnetic core with
hysteresis, on which they are windings and their values numbers of turns (cores.py)."""

from __future__ import annotations

from ..build_expr import extent
from ..diagnostics import deck_error
from ..expr import Node
from ..units import spice_number
from .base import Element, Param, named
from .cores import SHAPES, Core, Material
from .l import Inductor

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from ..deck import Model
    from ..source import Line
    from .contract import Accounts, Cards, Circuit, Expr, Level
    from .net import Net

LAWS = ("ja", "play")


class Coupling(Element):
    __slots__ = ("_core",)
    accounted = "stored"
    letter = "k"
    what = "coupling"
    form = "Kname Lname Lname [Lname ..] coupling, or Kname Lname [Lname ..] coupling core-model [b0=]"
    law = "M = k sqrt(L1 L2), flux linkage L1 i1 + M i2; with a .model CORE: H l + B gap/mu0 = sum N i, v = N d/dt (area B)"
    terminals = ()
    behind = ("element", "element")
    instance = named(
        k=Param("coupling coefficient; of a core that of the flux in the air about it"),
        b0=Param("of a core: flux density before any current flows, remanence", "T", 0.0),
    )
    model_types = ("core",)
    model_words = named(
        law=Param("ja: Jiles and Atherton, play: friction of many parts; ja unless given", words=LAWS),
        shape=Param("of Man: froehlich x/(1+|x|), langevin coth x - 1/x; froehlich unless given", words=tuple(SHAPES)),
        ms=Param("saturation magnetisation", "A/m", 1e6), a=Param("field of the shape: Man = ms F(He/a)", "A/m", 1e3),
        k=Param("pinning: its mean field", "A/m", 500.0), c=Param("reversible part of the magnetisation", "", 0.2),
        alpha=Param("coupling of domains: He = H + alpha M", "", 0.0), cells=Param("of law=play", "", 8.0),
        area=Param("cross-section", "cm^2", 0.1), path=Param("mean length of the path", "cm", 1.0),
        gap=Param("length of the air gap", "cm", 0.0), pack=Param("part of the section that is core", "", 1.0),
    )  # fmt: skip

    def read(self, cards: Cards, rule: str, ch: list[Any], line: Line) -> None:
        rest = cards.params(ch[1:], line, self)
        if "k" in self.params:
            rest.append(ch[-1])
        # a number ends the names, or the last word is a parameter's name
        isnt_name = (k for k, r in enumerate(rest) if not isinstance(r, str) or spice_number(r) is not None)
        end = next(isnt_name, len(rest) - 1)
        value, *behind = rest[end:] or [None]
        if end < (1 if behind else 2):
            raise cards.fail("E109", f"{ch[0]} needs two inductors and a coupling", line, ch[0], self.hint)
        self.extra["inductors"] = [str(r.lower()) for r in rest[:end]]
        self.value_span = line.span_at(*extent(value))
        self.value = self.params.pop("k") if "k" in self.params else cards.number(value, line, "the coupling")
        if behind:
            if not isinstance(behind[0], str):
                raise cards.fail("E109", f"{ch[0]} needs the names of inductors here", line, value, self.hint)
            self.model_name, self.model_span = behind[0].lower(), line.span(behind[0])
        if len(behind) > 1:
            said = "the size of a core is not read: area=, path= of its .model say it"
            raise cards.fail("E102", said, line, behind[1], self.hint)

    def bind(self, level: Level) -> None:
        self.extra["inductors"] = [level.prefix + name for name in self.extra["inductors"]]

    def paths(self) -> tuple[()]:
        return ()

    # ---- a core ----

    @classmethod
    def model_hint(cls, of: str) -> str | None:
        return "a magnetic core is .model name CORE(ms= a= k= c= area= path= ..), emsim help K"

    @property
    def core(self) -> Core | None:
        return getattr(self, "_core", None)

    def check(self, ctx: Circuit) -> None:
        super().check(ctx)
        if self.model is None:
            if "b0" in self.params:
                ctx.sink.error(
                    "E284", f"b0= of `{self.name}`: without a .model CORE there is no core", self.span
                )
            return
        for name in map(ctx.element_name, self.extra["inductors"]):
            if name in ctx.wound:
                said = f"`{name}` is wound on the cores of `{ctx.wound[name]}` and of `{self.name}`"
                ctx.sink.error("E284", said, self.span, "a winding has one core; two in series make two")
            ctx.wound[name] = self.name

    def _wind(self, ctx: Circuit, model: Model, coils: list[Inductor], k: float) -> None:
        material = Material(model.params)
        if (wrong := material.wrong()) is not None:
            key, said = wrong
            at = model.param_spans.get(key, model.span)
            ctx.sink.error("E284", f"{key}= of .model `{model.name}`: {key} {said}", at)
            return
        start = material.at_rest(b0 := self.number("b0"))
        if start is None:
            said = f"b0={b0:g} of `{self.name}`: without a current the core keeps no such flux density"
            hint = f"at most {material.remanence():.3g} T; a gap leaves less"
            ctx.sink.error("E284", said, self.span, hint)
            return
        windings = []
        for coil in coils:
            for key in (key for key in coil.params if key != "tol"):
                said = f"{key}= of `{coil.name}` has no meaning: it is a winding, its value the number of its turns"
                remedy = f"b0= of `{self.name}` says how the core begins" if key == "ic" else None
                ctx.sink.error("E284", said, coil.span, remedy)
            turns = coil.value if isinstance(coil.value, (int, float)) else 0.0
            if not turns > 0.0:
                said = f"`{coil.name}` is a winding on a core, and its value, the number of its turns, is not above 0"
                ctx.sink.error("E284", said, coil.span, "to wind it the other way round, change its nodes")
            windings.append((ctx.branches[coil.name], float(turns)))
        self._core = Core(ctx, self.name, material, k, windings, start)

    # ---- rows ----

    def contribute(self, ctx: Circuit) -> None:
        k = self.value if isinstance(self.value, (int, float)) else 1.0
        if abs(k) > 1.0:
            ctx.sink.error(
                "E284", f"coupling `{self.name}` of {k:g} is more than complete", self.value_span or self.span,
                hint="the coefficient lies between -1 and 1",
            )  # fmt: skip
            return
        found: list[Inductor] = []
        for name in self.extra["inductors"]:
            coil = ctx.elements.get(ctx.element_name(name, "L"))
            if not isinstance(coil, Inductor):
                names = [x.name for x in ctx.elements.values() if isinstance(x, Inductor)]
                said = f"`{self.name}` couples `{name}`, which is no inductor of this deck"
                ctx.unknown("E285", said, name, names, self.span)
            elif isinstance(coil.value, Node):
                ctx.sink.error(
                    "E284", f"`{self.name}` couples `{coil.name}`, whose inductance is an expression", self.span,
                    hint="mutual inductance needs constant inductances",
                )  # fmt: skip
            elif self.model is None and coil.name in ctx.wound:
                said = (
                    f"`{self.name}` couples `{coil.name}`, a winding of {coil.value:g} turns on a core"
                    if isinstance(coil.value, float)
                    else f"`{self.name}` couples `{coil.name}`, a winding on a core"
                )
                hint = f"windings of one core stand in one line, that of `{ctx.wound[coil.name]}`"
                ctx.sink.error("E284", said, self.span, hint)
            else:
                found.append(coil)
        if len({coil.name for coil in found}) < len(found):
            ctx.sink.error("E284", f"`{self.name}` couples a coil with itself", self.span, "name two coils")
            return
        if self.model is not None:
            if len(found) == len(self.extra["inductors"]):
                self._wind(ctx, self.model, found, k)
            return
        coils = [(ctx.branches[coil.name], coil.quantity(ctx)) for coil in found]
        for i, (row, li) in enumerate(coils):
            for col, lj in coils[i + 1 :]:
                if li * lj < 0:
                    ctx.sink.error("E284", f"`{self.name}` couples inductances of opposite sign", self.span)
                    continue
                if li > 0:
                    ctx.coupled[row, col] = ctx.coupled.get((row, col), 0.0) + k
                m = k * (li * lj) ** 0.5
                ctx.b.c(row, col, m)
                ctx.b.c(col, row, m)

    def flow(self, ctx: Circuit) -> Expr:
        return ctx.b.const(0.0)

    def probe(self, ctx: Circuit, name: str) -> Expr | None:
        core = self.core
        if core is None:
            return None
        return {
            "h": lambda: core.h, "b": lambda: core.flux_density, "m": lambda: core.magnetisation,
            "flux": lambda: core.m.area * core.flux_density, "loss": core.loss, "energy": core.energy,
        }.get(name, lambda: None)()  # fmt: skip

    def probes(self, ctx: Circuit) -> dict[str, str]:
        return {"h": "A/m", "b": "T", "m": "A/m", "flux": "Wb", "loss": "W", "energy": "J"}

    def account(self, ctx: Circuit, book: Accounts) -> None:
        if self.core is not None:
            book.holds(self, self.core.energy())
            if book.engine and self.core.lost is not None:
                book.lost(self, self.core.lost)
            else:
                book.dissipates(self, self.core.loss())
            return
        if not isinstance(self.value, (int, float)):
            return
        names = [ctx.element_name(n, "L") for n in self.extra["inductors"]]
        coils = [coil for name in names if isinstance(coil := ctx.elements.get(name), Inductor)]
        for k, first in enumerate(coils):
            for second in coils[k + 1 :]:
                m = self.value * (first.quantity(ctx) * second.quantity(ctx)) ** 0.5
                book.holds(self, m * first.flow(ctx) * second.flow(ctx))

    def analogue(self, net: Net) -> str:
        if self.model is not None:
            said = f"`{self.name}` is a core with hysteresis, and ngspice has none that loses what it does"
            raise deck_error("E311", said, self.span, "an analogue without it: take a coil for the core")
        coils = [net.name_of(name) for name in self.extra["inductors"]]
        return f"{net.head(self)} {' '.join(coils)} {float(self.value)!r}"

"""D: the engine's junction diode; temperature scaling and the inner node of rs are its business."""

from __future__ import annotations

from .base import TEMPERATURE, Element, M, Param, ignored

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, ClassVar

    from ..assemble.accounts import Accounts
    from ..assemble.context import Context
    from ..build_elements import ElementCards
    from ..deck import Model
    from ..source import Line

# parameters of .model D that change a current in ngspice and not here
MISSING_CURRENTS = {
    "isr": "a recombination current", "jtun": "a tunnel current", "jtunsw": "a tunnel current of the sidewall",
}  # fmt: skip


# of other programs' ideal diode, in place of the exponential
IDEAL = frozenset("ron roff vfwd vrev rrev ilimit revilimit epsilon revepsilon".split())
# overlap of metal and poly, of level 3, which is refused
OVERLAP = frozenset("lm lp wm wp xom xoi xm xp xw cmetal cpoly".split())
# limits that only warn, what the missing currents and self-heating read, and who made it
HARMLESS = frozenset(
    """nlev fv_max bv_max id_max te_max pd_max rth0 cth0 nr ntun xtitun keg level mfg vendor type iave ipk ipeak vpk irms
    diss icrating vcrating""".split()
)


class Diode(Element):
    __slots__ = ()
    letter = "d"
    what = "diode"
    form = "Dname anode cathode model [area] [off] [ic=]"
    law = "i = is (exp(v/(n vt)) - 1), with breakdown, series resistance and charge from the .model"
    terminals = ("anode", "cathode")
    behind = ("model",)
    plain = ("diode", 4, False)
    positional = ("area",)
    flags = ("off",)
    instance: ClassVar[dict[str, Param]] = {
        **M, **TEMPERATURE, "area": Param("factor on the currents and charges of the model", default=1.0),
        "ic": Param(), "off": Param("off at the start"),
        "pj": Param("perimeter, in units of the model's", default=1.0), **ignored("l w lm lp wm wp"),
    }  # fmt: skip
    model_types = ("d",)
    is_metered = True
    current_name = "id"
    jumps = 10

    def read(self, cards: ElementCards, rule: str, ch: list[Any], line: Line) -> None:
        for item in ch[4:]:
            word = item[1][0] if item.__class__ is tuple and item[0] == "param" else item
            if word.__class__ is not tuple and word.lower() == "thermal":
                raise cards.fail(
                    "E113", "self-heating of a diode is not supported yet", line, word, self.hint
                )
        super().read(cards, rule, ch, line)

    def check(self, ctx: Context) -> None:
        super().check(ctx)
        if self.number("ic") and any("uic" in analysis.flags for analysis in ctx.flat.analyses):
            said, hint = (
                f"ic= of `{self.name}` (charge at the start) is not supported yet",
                ".ic v(node)=value sets its nodes",
            )
            ctx.sink.error("E297", said, self.span, hint)

    @classmethod
    def model_table(cls, of: str = "") -> list[tuple[list[str], str, float, str]]:
        from .._engine import device_parameters

        return device_parameters("d")

    @classmethod
    def model_names(cls) -> frozenset[str]:
        return (
            HARMLESS
            | OVERLAP
            | IDEAL
            | set(MISSING_CURRENTS)
            | {name for names, *_ in cls.model_table() for name in names}
        )

    def _check_model(self, ctx: Context, model: Model) -> None:
        super()._check_model(ctx, model)
        for name in sorted(IDEAL & model.params.keys()):
            said = f".model `{model.name}`: {name}= is not supported yet"
            hint = "take is= n= rs= and bv= of a junction"
            ctx.sink.error("E297", said, model.param_spans.get(name, model.span), hint)
        for name in MISSING_CURRENTS:
            if model.params.get(name):
                said = f".model `{model.name}`: {name}= ({MISSING_CURRENTS[name]}) is not supported yet"
                hint = "take is= and n= from a fit without it"
                ctx.sink.error("E297", said, model.param_spans.get(name, model.span), hint)

    @property
    def has_series(self) -> bool:
        rs = self.model.params.get("rs") if self.model is not None else None
        return isinstance(rs, (int, float)) and rs > 0

    def contribute(self, ctx: Context) -> None:
        assert self.model is not None
        model = {
            key: float(value) for key, value in self.model.params.items() if isinstance(value, (int, float))
        }
        instance: dict[str, float] = {
            key: self.number(key) for key in ("area", "m", "pj", "w", "l") if key in self.params
        }
        p, n = ctx.node(self.nodes[0]), ctx.node(self.nodes[1])
        br = ctx.branch(self.name)
        if br is not None:
            # its current is asked for: a 0 V branch stands before the anode
            inner = ctx.inner_node(self.name + "#anode")
            ctx.b.g(p, br, 1.0)
            ctx.b.g(inner, br, -1.0)
            ctx.b.g(br, p, 1.0)
            ctx.b.g(br, inner, -1.0)
            p = inner
        try:
            temp, tnom = self.temperature(ctx), model.get("tnom", ctx.tnom)
            for _, inner, conductance in ctx.b.device("d", self.name, (p, n), model, instance, temp, tnom):
                ctx.series[self.name] = (p, inner, conductance)
        except ValueError as trouble:
            span = self.model.param_spans.get(str(trouble).partition("=")[0], self.model.span)
            ctx.sink.error("E299", f"`{self.name}`, .model `{self.model.name}`: {trouble}", span)

    def account(self, ctx: Context, book: Accounts) -> None:
        """The engine keeps heat v i(v) and charge v dq of the junction; the series resistance is said here.
        At an instant: all that goes in."""
        if not book.engine:
            book.dissipates(self, self.between(ctx) * self.flow(ctx))
            return
        if self.name in ctx.series:
            p, inner, gs = ctx.series[self.name]
            drop = ctx.b.x(p) - ctx.b.x(inner) if p >= 0 else -ctx.b.x(inner)
            book.dissipates(self, gs * drop * drop)

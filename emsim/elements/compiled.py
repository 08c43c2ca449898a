"""What elements share whose law is a module of Verilog-A (Q J M Z N): the engine has the module's currents and charges."""

from __future__ import annotations

from bisect import bisect
from math import log

from ..diagnostics import Fix, Span, did_you_mean
from .base import TEMPERATURE, Element, M, Param, named, the_last_holds
from .modules import Module, shipped, where

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence
    from typing import Any, ClassVar

    from .._engine import Values
    from ..deck import Model
    from .base import Path
    from .contract import Accounts, Circuit, Expr

START = {"off": Param("off at the start"), "ic": Param()}
# of every .model, whatever its module knows
HARMLESS = frozenset(
    """level version mfg vendor type icrating vceo vds_max vgs_max vbs_max vbd_max vgb_max vgsr_max vgbr_max vbsr_max vbdr_max
    id_max ic_max ib_max pd_max te_max rth0 cth0 lmin lmax wmin wmax ron qg vds rthjc rthca cthj""".split()
)


# discipline of a terminal -> what its potential is on a joint, does the joint turn, units of potential and flow
MECHANICAL = {
    "rotational": ("q", True, "rad", "N m"),
    "rotational_omega": ("u", True, "rad/s", "N m"),
    "kinematic": ("q", False, "m", "N"),
    "kinematic_v": ("u", False, "m/s", "N"),
}


def _over_frequency(points: list[tuple[float, float]], by_log: bool) -> Callable[[float], float]:
    """A density [A^2/Hz] over frequency [Hz]: straight lines, of logarithms where `by_log`; beyond the ends constant."""
    places, values = [p for p, _ in points], [v for _, v in points]

    def density(frequency: float) -> float:
        k = bisect(places, frequency)
        if k in (0, len(places)):
            return values[min(k, len(places) - 1)]
        (x0, y0), (x1, y1) = points[k - 1], points[k]
        if by_log:
            return y0 * (y1 / y0) ** (log(frequency / x0) / log(x1 / x0))
        return y0 + (y1 - y0) * (frequency - x0) / (x1 - x0)

    return density


class Compiled(Element):
    """`sorts`: word of .model -> (module, its `type`); `levels`: level -> module of devices/, or the beginning of its name in
    .hdl. Other levels are those of public models (public.py)."""

    __slots__ = ("behaves", "module", "noise_tables", "shafts", "sign", "stimuli")
    behind = ("model",)
    flags: ClassVar[tuple[str, ...]] = ("off",)
    is_metered = True
    jumps = 10
    instance = named(**M, **TEMPERATURE, **START)
    sorts: ClassVar[dict[str, tuple[str, float]]] = {}
    levels: ClassVar[dict[int, str]] = {}
    currents: ClassVar[tuple[str, ...]] = ()  # of the terminals, as @name[..] has them
    aliases: ClassVar[dict[str, str]] = {}  # ngspice's name in @name[..] -> the module's, where they differ
    charging: ClassVar[
        dict[str, str]
    ] = {}  # ngspice's name of a current -> the module's charge that it changes
    harmless: ClassVar[frozenset[str]] = HARMLESS
    may_lack: ClassVar[int] = 0  # so many terminals of a module of devices/ may be left out, ...
    at_ground: ClassVar[bool] = False  # a substrate that is left out is ground

    module: Module | None
    shafts: dict[int, str]  # terminals that are joints
    sign: float
    behaves: bool  # it hangs on time, on the kind of analysis, or on events
    stimuli: list[tuple[int, complex]]  # of ac_stim
    noise_tables: dict[
        str, Callable[[float], float]
    ]  # source of noise -> factor of its density at a frequency

    @classmethod
    def shown(cls) -> list[Module]:
        """The modules that its tables tell of."""
        names = dict.fromkeys([*(m for m, _ in cls.sorts.values()), *cls.levels.values()])
        return [m for name in names if name and (m := shipped(name)) is not None]

    @classmethod
    def model_table(cls, of: str = "") -> list[tuple[list[str], str, float, str]]:
        rows: dict[str, tuple[list[str], str, float, str]] = {}
        for module in cls.shown():
            for row in module.rows():
                if row[0][0] != "type":
                    rows.setdefault(row[0][0], row)
        return list(rows.values())

    # ---- which module ----

    def find(self, ctx: Circuit) -> Module | None:
        """The module of its model, and what its .model's word makes of `type`; what is missing is reported."""
        assert self.model is not None
        kind = self.model.type
        loaded = ctx.flat.modules
        sort = self.sorts.get(kind)
        if sort is None:
            self.sign = 0.0
            module = loaded.get(kind) or shipped(kind) or ctx.flat.added.by_name(kind, self.model.span)
            if module is None:
                hint = did_you_mean(
                    kind,
                    [*loaded, *_all()],
                    'write .hdl "file.va" with the module in it, or once: emsim models add file.va',
                )
                ctx.sink.error("E297", f"no module is called `{kind}`", self.model.span, hint)
            return module
        name, self.sign = sort
        level = self.model.params.get("level")
        own = shipped(name)
        if level is None or level != level or (own is not None and name not in self.levels.values()):
            return self._of_text(ctx, name) or own or self._of_public(ctx, name)
        number = int(level) if isinstance(level, (int, float)) else 0
        if number in self.levels:
            name = self.levels[number]
            return self._of_text(ctx, name) or shipped(name)
        return self._of_level(ctx, number)

    def _of_text(self, ctx: Circuit, *heads: str) -> Module | None:
        """The module of .hdl whose name begins so."""
        return next((m for key, m in ctx.flat.modules.items() if key.lower().startswith(heads)), None)

    def _of_level(self, ctx: Circuit, level: int) -> Module | None:
        """The module of a level that is not among the devices here: of .hdl, or of what was added."""
        from . import public

        assert self.model is not None
        meant, at = public.of_level(self.letter, level), self._at("level")
        theirs = self._of_text(ctx, *(head for p in meant for head in p.heads)) if meant else None
        module = theirs or ctx.flat.added.by_level(self.letter, level, at)
        if module is None and (self.letter, level) not in ctx.flat.added.broken:
            said = f".model `{self.model.name}`: {self.what} level {level} is "
            if meant:
                self._missing(ctx, f"{said}{public.told(meant, level)}", at)
            else:
                there = ", ".join(f"{k}" for k, v in self.levels.items() if shipped(v) is not None)
                hint = f"known levels: {there}; emsim models add FILE.va --level {level} gives it a module"
                ctx.sink.error("E297", f"{said}not known", at, hint)
        return module

    def _of_public(self, ctx: Circuit, name: str) -> Module | None:
        """The module of a word of .model whose usual model is not among the devices here."""
        from . import public

        assert self.model is not None
        meant = [p for p in (public.of_module(name),) if p is not None]
        module = ctx.flat.added.by_model(meant, self.model.span)
        if module is None:
            of = public.told(meant, 0) or name
            self._missing(ctx, f".model `{self.model.name}`: {self.model.type} is {of}", self.model.span)
        return module

    def _missing(self, ctx: Circuit, said: str, at: Span) -> None:
        hint = (
            'with its public Verilog-A text, once: emsim models add FILE.va; or in the deck: .hdl "FILE.va"'
        )
        ctx.sink.error("E297", f"{said}, which is not among the devices here", at, hint)

    def _at(self, word: str) -> Span:
        assert self.model is not None
        return self.model.param_spans.get(word, self.model.span)

    # ---- its words ----

    def known(self) -> Iterable[str]:
        own = getattr(self, "module", None)
        words = dict.fromkeys(self.instance)
        if own is not None:
            words.update(own.of_lines)
        return words

    def check(self, ctx: Circuit) -> None:
        self.shafts, self.stimuli, self.behaves, self.noise_tables = {}, [], False, {}
        self.module = self.find(ctx) if self.model is not None else None
        if self.model is not None and self.module is None:
            return
        super().check(ctx)
        if self.params.get("ic") and any("uic" in analysis.flags for analysis in ctx.flat.analyses):
            said = f"ic= of `{self.name}` (charges at the start) is not supported yet"
            ctx.sink.error("E297", said, self.span, ".ic v(node)=value sets its nodes")
        module = self.module
        if module is None:
            return
        most = len(module.terminals)
        own = shipped(module.name) is module
        if not own:
            self._check_fit(ctx, module)
        least = max(1, most - self.may_lack) if own else 1
        if not least <= len(self.nodes) <= most:
            said = f"`{self.name}` has {len(self.nodes)} nodes, `{module.name}` {most} terminals"
            hint, fixes = f"they are: {' '.join(module.terminals)}", self._last_again(most)
            if fixes:
                hint += f"; {fixes[0].label}"
            ctx.sink.error("E109", said, self.span, hint, fixes=fixes)
            self.module = None
            return
        joints = {card.name for card in ctx.flat.machine if card.kind == "JOINT"}
        for k, (name, discipline) in enumerate(zip(self.nodes, module.disciplines, strict=False)):
            if discipline in MECHANICAL and name in joints:
                self.shafts[k] = name

    def _check_fit(self, ctx: Circuit, module: Module) -> None:
        """What a text of others does not know of the word of its .model and of the element's line."""
        assert self.model is not None
        known, params = module.parameters, self.model.params
        if self.sign * self.polarity() < 0.0 and not {"type", "devtype"} & known.keys():
            said = f"`{module.name}` has no parameter `type`: {self.model.type.upper()} cannot be told to it"
            ctx.sink.error("E297", said, self.model.span, "it is one kind of device, that of its text")
        if "tnom" in params and "tref" in known and "tnom" not in known:
            params["tref"] = params.pop("tnom")  # MEXTRAM's name of it
        for name in self.params:
            if name not in known and name not in (*M, *TEMPERATURE, *START, *self.flags):
                said = f"`{self.name}`: `{module.name}` takes no {name}=, it has no effect"
                ctx.sink.warning("W284", said, self.span)

    def _last_again(self, most: int) -> list[Fix]:
        """The bulk of a transistor is at its source, if it has none of its own."""
        span = self.model_span
        if (
            self.letter != "m"
            or (len(self.nodes), most) != (3, 4)
            or span is None
            or span.line != self.span.line
        ):
            return []
        words = span.file.text_line(span.line)[self.span.col - 1 : span.col - 1].split()
        if len(words) != 4:
            return []
        place = Span(span.file, span.line, span.col, span.col)
        return [
            Fix(
                place,
                f"{words[3]} ",
                f"the bulk at the source: write `{' '.join([*words, words[3], span.text])}`",
            )
        ]

    def wired(self) -> Sequence[str]:
        return [name for k, name in enumerate(self.nodes) if k not in self.shafts]

    def units(self) -> dict[str, str]:
        """Of the potential of its nodes that are no volts."""
        module = getattr(self, "module", None)
        if module is None:
            return {}
        pairs = zip(self.nodes, module.disciplines, strict=False)
        return {name: MECHANICAL[d][2] for name, d in pairs if d in MECHANICAL}

    def _check_model(self, ctx: Circuit, model: Model) -> None:
        module = self.module
        if module is None:
            return
        the_last_holds(model, [*module.rows(), *module.rows(instance=True)])
        for name, value in list(model.params.items()):
            at = model.param_spans.get(name, model.span)
            known = module.parameters.get(name)
            if (
                known is None
                and name not in self.harmless
                and not (value == 1.0 and name in self.words_of_model)
            ):
                ctx.sink.warning(
                    "W284", f".model `{model.name}`: `{module.name}` takes no {name}=, it has no effect",
                    at, hint=did_you_mean(name, module.parameters, form="{}="),
                )  # fmt: skip
            elif known is not None and isinstance(value, str) and not known["text"]:
                ctx.sink.error(
                    "E110", f"{name}= of .model `{model.name}` is no number: `{value}`", at,
                    "write a number, or the name of a .param",
                )  # fmt: skip
                del model.params[name]

    words_of_model: ClassVar[frozenset[str]] = frozenset()  # that stand in a .model without a value

    # ---- the circuit's graph ----

    def branches(self, is_read: bool) -> Sequence[tuple[str, float]]:
        """A 0 V branch before every terminal."""
        wired = [k for k in range(len(self.nodes)) if k not in self.shafts]
        return [(self._branch(k), 0.0) for k in wired] if is_read else ()

    def _branch(self, k: int) -> str:
        return f"{self.name}#{k}" if k else self.name

    def paths(self) -> Sequence[Path]:
        first, *others = [k for k in range(len(self.nodes)) if k not in self.shafts] or [0]
        return [(first, k, "conducts") for k in others]

    # ---- equation (1) ----

    def contribute(self, ctx: Circuit) -> None:
        module = getattr(self, "module", None)
        if module is None or self.model is None:
            return
        nodes = []
        for k, name in enumerate(self.nodes):
            if k in self.shafts:
                nodes.append(ctx.shafts[self.name, k][0] if (self.name, k) in ctx.shafts else -1)
                continue
            p, br = ctx.node(name), ctx.branch(self._branch(k))
            if br is not None:
                inner = ctx.inner_node(f"{self.name}#{module.terminals[k]}")
                ctx.b.g(p, br, 1.0)
                ctx.b.g(inner, br, -1.0)
                ctx.b.g(br, p, 1.0)
                ctx.b.g(br, inner, -1.0)
                p = inner
            nodes.append(p)
        for name in module.terminals[len(nodes) :]:
            ground = self.at_ground and name.startswith("s")
            nodes.append(-1 if ground else ctx.inner_node(f"{self.name}#{name}"))
        model = self._values(ctx, module, self.model)
        try:
            said, left_out, longest, behaviour, tables = ctx.b.module(
                module.texts, module.name, self.name, nodes, model, self.given(ctx), self.temperature(ctx),
                float(self.model.params.get("tnom", ctx.tnom)), self.number("m", 1.0), len(self.nodes),
                ctx.gmin,
            )  # fmt: skip
        except ValueError as trouble:
            self._told(ctx, trouble.args[0])
            self.module = None  # nothing to read there
            return
        self.noise_tables = {name: _over_frequency(points, by_log) for name, points, by_log in tables}
        if behaviour is not None:
            stimuli, late = behaviour
            self.behaves, self.stimuli = True, [(k, complex(*z)) for k, z in stimuli]
            ctx.delayed += late
        if self.params.get("off"):
            ctx.b.off(self.name)
        for text in said:
            ctx.remark("W288", f"`{module.name}` says: {text}", self.model.span)
        for text in left_out:
            ctx.remark("W288", f"`{module.name}` has {text}", self.model.span)
        if longest is not None:
            ctx.longest_step = min(ctx.longest_step, longest)

    def _values(self, ctx: Circuit, module: Module, card: Model) -> Values:
        """What the module takes of the .model, read once for all elements of this kind."""
        # BSIM-CMG counts its types 1 and 0
        word = "devtype" if "devtype" in module.parameters else "type"
        sign = self.sign * self.polarity() if self.sign and word in module.parameters else None
        key = (module, card.name, sign)
        if key not in ctx.values:
            from .._engine import Values

            model = {k: v for k, v in card.params.items() if k in module.parameters and k not in TEMPERATURE}
            if sign is not None:
                model[word] = max(sign, 0.0) if word == "devtype" else sign
                if shipped(module.name) is not module:
                    model.pop("level", None)  # it chose the module; some have a parameter of that name
            ctx.values[key] = Values(model)
        return ctx.values[key]

    def excite(self, ctx: Circuit) -> Sequence[tuple[int, complex]]:
        return self.stimuli

    def polarity(self) -> float:
        """What words of the .model turn about."""
        return 1.0

    def sense(self) -> float:
        """The sign of a terminal's current as @name[..] has it, beside that of what flows into the terminal."""
        return 1.0

    def given(self, ctx: Circuit) -> dict[str, Any]:
        """Parameters of the line that the module takes."""
        assert self.module is not None
        known = self.module.parameters
        return {
            key: float(value) for key, value in self.params.items()
            if key in known and key not in ("m", "temp", "dtemp", "off", "ic") and isinstance(value, (int, float))
        }  # fmt: skip

    def _told(self, ctx: Circuit, told: str | list[dict[str, Any]]) -> None:
        """What the module, or who puts it into the circuit, refused."""
        assert self.model is not None and self.module is not None
        head = f"`{self.name}`, .model `{self.model.name}`: "
        if isinstance(told, str):
            ctx.sink.error("E299", f"{head}{told}", self.model.span)
            return
        for message in told:
            words = message["text"].replace("`", " ").replace("=", " ").split()
            spans = self.model.param_spans
            at = next((spans[w] for w in words if w in spans), self.model.span)
            ctx.sink.error("E299", head + message["text"] + where(message), at, message["hint"] or None)

    def flow(self, ctx: Circuit) -> Expr:
        return self.current(ctx)

    def current(self, ctx: Circuit, terminal: int = 0) -> Expr:
        if terminal in self.shafts:
            return -ctx.b.x(ctx.shafts[self.name, terminal][1])
        return ctx.b.x(ctx.branches[self._branch(terminal)])

    def probe(self, ctx: Circuit, name: str) -> Expr | None:
        """Currents of terminals, what the module describes of its operating point, its power, and what stands on its line."""
        module = getattr(self, "module", None)
        if module is None:
            return ctx.b.const(0.0)
        if name in ("i", "current"):
            return self.current(ctx)
        if name in self.currents[: len(self.nodes)]:
            return self.current(ctx, self.currents.index(name)) * self.sense()
        if name in ("p", "power"):
            return self._power(ctx)
        if name in self.params and isinstance(self.params[name], (int, float)):
            return ctx.b.const(float(self.params[name]))
        charge = self.charging.get(name)
        try:
            read = ctx.b.module_output(self.name, charge or name, ctx.gmin)
            if read is None and name in self.aliases:
                read = ctx.b.module_output(self.name, self.aliases[name], ctx.gmin)
        except KeyError:
            return ctx.b.const(0.0)  # what it is made of was refused
        return read if charge is None or read is None else ctx.ddt(read, f"{self.name}#{name}")

    def probes(self, ctx: Circuit) -> dict[str, str]:
        module = getattr(self, "module", None)
        if module is None:
            return {}
        found = dict.fromkeys((*self.currents[: len(self.nodes)], "i"), "A") | {"p": "W"}
        try:
            told = ctx.b.module_outputs(self.name)
        except KeyError:
            told = []  # what it is made of was refused
        told_units = {name: unit for name, unit, _ in told}
        found = told_units | found
        found = {
            alias: told_units[name] for alias, name in self.aliases.items() if name in told_units
        } | found
        found |= {name: "A" for name, charge in self.charging.items() if charge in told_units}
        return found | {
            key: module.parameters[key]["unit"] for key in self.params if key in module.parameters
        }

    def _power(self, ctx: Circuit) -> Expr:
        total = ctx.b.const(0.0)
        for k, node in enumerate(self.nodes):
            across = ctx.b.x(ctx.shafts[self.name, k][0]) if k in self.shafts else ctx.v(node)
            total = total + across * self.current(ctx, k)
        return total

    def account(self, ctx: Circuit, book: Accounts) -> None:
        """The engine keeps heat and charges of all its currents. At an instant: all that goes in."""
        if self.behaves or any(unit in ("rad", "m") for unit in self.units().values()):
            book.open.append(self.name)  # potential times flow is no power there
        if not book.engine:
            book.dissipates(self, self._power(ctx))


def _all() -> list[str]:
    from .modules import names

    return names()

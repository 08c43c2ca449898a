"""CLOCK, BLOCK, PWM and FMUs for co-simulation as rules of the engine (engine/dae/src/clocked.rs).

A rule is an expression of what is just before a tick. Signals of the same clock are put into each other, so that one program
gives them all; x[-1] is a signal of its own that takes over x before x is computed. Signals are computed in the order of what
they read, whatever their clocks, and what reads itself without a tick in between is an error.

Conditions in rules are looked at when a tick comes: they are numbers there, no events. The functions of blocks are difference
equations (READY), whose own signals carry a `#` in their names.

An FMU shows what it has come to before any rule is computed. It takes its inputs behind the signals that these read, and
signals that read its outputs stand behind it; in a ring, a controller and its plant, it takes its inputs last.
"""

from __future__ import annotations

from ..build import parse_expression
from ..cards.block import Block
from ..cards.clock import Clock
from ..cards.fmu import Fmu
from ..cards.pwm import TIMES, Pwm
from ..expr import PAST, SIGNAL, Binary, Call, Cond, Name, Node, Num, rewritten
from ..functions import OF_TICKS, OF_TIME
from .behaviour import Compiler
from .context import Context
from .foreign import Exchanged, Foreign

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import Any

    from .._engine import Expr
    from ..deck import MachineCard
    from ..diagnostics import Span

MOST_TICKS = 10_000  # that x[-k] looks back: each is a signal
# analyses of small signals, and those that look for a periodic state
SMALL = ("ac", "noise", "tf", "pz", "sens", "disto", "modes", "sp")
PERIODIC = ("ss", "pss")

# function -> arguments with their defaults, signals that it computes, what it gives. `next`, `average` and `ztf` have any number
READY = {
    # the integral stands while it would drive the output further beyond its bounds (clamping)
    "pid": (
        "e kp ki kd lo hi tf=0",
        {
            "d": "(tf*d[-1] + kd*(e - e[-1]))/(tf + ts)",
            "j": "i[-1] + ki*ts*e",
            "w": "kp*e + d + j",
            "i": "(w > hi && j > i[-1]) || (w < lo && j < i[-1]) ? i[-1] : j",
        },
        "min(max(kp*e + d + i, lo), hi)",
    ),
    "slew": ("x down up", {"y": "min(max(x, y[-1] - down*ts), y[-1] + up*ts)"}, "y"),
    # two levels that are a quarter of a line apart: (a xor b before) - (a before xor b)
    "quad": (
        "a b",
        {"p": "a > 0.5", "q": "b > 0.5", "n": "n[-1] + (p != q[-1]) - (p[-1] != q)"},
        "n",
    ),
}  # fmt: skip


class Signal:
    """x of a block. `wave` is what rules read and `shown` what all others do; of constants and timers `number` is -1."""

    __slots__ = ("ast", "block", "clock", "number", "shown", "span", "starts", "value", "wave")

    def __init__(self, block: str, clock: int, ast: Any, starts: dict[int, float], span: Span) -> None:
        self.block, self.clock, self.ast, self.starts, self.span = block, clock, ast, starts, span
        self.number = -1
        self.wave: Any = None
        self.shown: Any = None
        self.value: Expr | None = None  # its rule

    def start(self, ago: int) -> float:
        """x[-ago] before the first tick: as given, or as the nearest one that is."""
        known = [k for k in self.starts if k <= ago]
        return self.starts[max(known)] if known else 0.0


class Unit:
    """An FMU: its clock, the numbers of its signals, the expressions of its inputs once they are compiled."""

    __slots__ = ("clock", "foreign", "inputs", "name", "outputs", "state", "step")

    def __init__(self, name: str, foreign: Foreign, clock: int, step: float, outputs: list[int]) -> None:
        self.name, self.foreign, self.clock, self.step, self.outputs = name, foreign, clock, step, outputs
        self.inputs: list[Expr] = []
        self.state = ""  # "open" while its inputs are compiled, then "done"


class Ring(Exception):
    """The inputs of an FMU need a signal that is being computed from its outputs."""


class Clocks:
    def __init__(self, ctx: Context) -> None:
        self.numbers: dict[str, int] = {}
        self.cards: dict[str, Clock] = {}
        self.periods: list[float] = []
        self.signals: dict[str, Signal] = {}
        self.past: dict[int, list[tuple[Signal, Signal]]] = {}  # of each clock: (x[-k], x[-k+1])
        self.timers: list[tuple[Pwm, int, Span]] = []
        self.units: dict[str, Unit] = {}
        self.exchanged: list[Exchanged] = []
        bound = [self._card(raw, ctx) for raw in ctx.flat.clocked]
        for card in bound:
            if isinstance(card, Clock):
                self._clock(ctx, card, [])
        for card in bound:
            if isinstance(card, (Block, Pwm)) and card.ok:
                self._block(ctx, card)
            elif isinstance(card, Fmu):
                self._unit(ctx, card)

    def _card(self, raw: MachineCard, ctx: Context) -> Clock | Block | Pwm | Fmu:
        kind: Any = {"CLOCK": Clock, "BLOCK": Block, "PWM": Pwm, "FMU": Fmu}[raw.kind]
        card: Any = kind(raw, ctx.sink)
        if isinstance(card, Block):
            card.check_starts(ctx.sink)
        elif isinstance(card, Clock):
            self.cards[card.name] = card
        made: Clock | Block | Pwm | Fmu = card
        return made

    # ---- what there is ----

    def _clock(self, ctx: Context, card: Clock, above: list[str]) -> tuple[float, float] | None:
        """Period and first tick of a clock [s]; None after an error."""
        if not card.ok:
            return None
        times: tuple[float, float] | None = (card.period or 1.0 / (card.freq or 1.0), card.offset)
        if card.of is not None:
            base = self._known(ctx, card.of, card.name, card.place("of"))
            if base is None:
                return None
            if base.name in [*above, card.name]:
                said = f"the clock `{card.name}` goes with itself"
                ctx.sink.error("E390", said, card.place("of"), "one of them needs freq= or period=")
                return None
            of = self._clock(ctx, base, [*above, card.name])
            times = None if of is None else (of[0] * (card.every or 1.0), of[1] + card.skip * of[0])
        if times is not None and card.name not in self.numbers:
            self.numbers[card.name] = ctx.b.clock(*times, card.delay)
            self.periods.append(times[0])
        return times

    def _known(self, ctx: Context, name: str, by: str, span: Span) -> Clock | None:
        """The clock of that name, at the level of who names it or above."""
        path = by.split(".")[:-1]
        for k in range(len(path), -1, -1):
            found = self.cards.get(".".join([*path[:k], name]))
            if found is not None:
                return found
        ctx.unknown("E390", f"no CLOCK is called `{name}`", name, self.cards, span, "CLOCK name freq=")
        return None

    def _block(self, ctx: Context, card: Block | Pwm) -> None:
        clock = self._known(ctx, card.clock, card.name, card.place("clock"))
        if clock is None or clock.name not in self.numbers:
            for key in card.raw.params:  # so that nobody misses them
                ctx.signals[f"{card.name}.{key}"] = ctx.b.const(0.0)
            return
        k = self.numbers[clock.name]
        self.add(ctx, f"{card.name}.ts", Signal(card.name, k, self.periods[k], {}, card.span))
        if isinstance(card, Block):
            for name, ast in card.equations.items():
                starts = card.starts.get(name, {})
                self.add(ctx, f"{card.name}.{name}", Signal(card.name, k, ast, starts, card.place(name)))
            return
        self.add(ctx, f"{card.name}.duty", Signal(card.name, k, card.duty, {}, card.place("duty")))
        times = []
        for name, text in zip(("on", "off"), TIMES[card.align], strict=True):
            ast = local(text, {"duty": f"{card.name}.duty", "ts": f"{card.name}.ts"})
            # a number is a signal here, too: timers read signals
            times.append(
                self.add(
                    ctx, f"{card.name}.#{name}", Signal(card.name, k, ast, {}, card.place("duty")), True
                ).number
            )
        for name, wave in zip(
            ("high", "low"), ctx.b.clocked_timer(k, times[0], times[1], card.dead), strict=True
        ):
            level = Signal(card.name, k, None, {}, card.span)
            level.value = level.wave = level.shown = ctx.b.wave_expr(wave)
            self.signals[f"{card.name}.{name}"] = level
            ctx.signals[f"{card.name}.{name}"] = level.shown

    def _unit(self, ctx: Context, card: Fmu) -> None:
        foreign = Foreign(ctx, card)
        if foreign.is_model:
            if foreign.ok:
                self.exchanged.append(Exchanged(ctx, foreign))
            return
        step = foreign.step(ctx)
        k = ctx.b.clock(step, 0.0, 0.0)
        self.periods.append(step)
        for name in card.lists["out"]:
            variable = foreign.outputs.get(name)
            start = 0.0 if variable is None else foreign.start(variable)
            place = card.place(f"out {name}")
            signal = self.add(ctx, f"{card.name}.{name}", Signal(card.name, k, None, {1: start}, place))
            signal.value = signal.wave
        if foreign.ok:
            outputs = [self.signals[f"{card.name}.{name}"].number for name in card.lists["out"]]
            self.units[card.name] = Unit(card.name, foreign, k, step, outputs)

    def add(self, ctx: Context, name: str, signal: Signal, always: bool = False) -> Signal:
        if isinstance(signal.ast, (int, float)) and not always and not signal.starts:
            signal.value = signal.wave = signal.shown = ctx.b.const(float(signal.ast))
        else:
            signal.number, wave, shown = ctx.b.clocked_signal(name, signal.clock, signal.start(1))
            signal.wave, signal.shown = ctx.b.wave_expr(wave), ctx.b.wave_expr(shown)
        self.signals[name] = signal
        ctx.signals[name] = signal.shown
        return signal

    def ago(self, ctx: Context, name: str, ticks: int) -> Signal:
        """x[-ticks], by as many signals."""
        newer = self.signals[name]
        for k in range(1, ticks + 1):
            named = f"{name}#{k}"
            older = self.signals.get(named)
            if older is None:
                older = Signal(
                    newer.block, newer.clock, None, {1: self.signals[name].start(k + 1)}, newer.span
                )
                self.add(ctx, named, older)
                older.value = older.wave
                self.past.setdefault(newer.clock, []).append((older, newer))
            newer = older
        return newer

    # ---- rules ----

    def contribute(self, ctx: Context) -> None:
        """All rules, once every name can be read."""
        compiler = AtTicks(ctx, self)
        for name in list(self.signals):
            compiler.value(name)
        for clock, pairs in self.past.items():
            ctx.b.clocked_rule(
                clock, [older.number for older, _ in pairs], [newer.wave for _, newer in pairs]
            )
        for unit in self.units.values():
            compiler.take(unit)
        for exchanged in self.exchanged:
            exchanged.contribute(ctx)
        group: list[Signal] = []
        for signal in [*compiler.order, None]:
            if group and (not isinstance(signal, Signal) or signal.clock != group[0].clock):
                values = [s.value for s in group if s.value is not None]
                ctx.b.clocked_rule(group[0].clock, [s.number for s in group], values)
                group = []
            if isinstance(signal, Unit):
                ctx.b.clocked_unit(
                    signal.clock, signal.foreign.spec(signal.step), signal.inputs, signal.outputs
                )
            elif signal is not None:
                group.append(signal)

    def tell(self, ctx: Context, analyses: Sequence[Any]) -> None:
        """What analyses do not do with clocks."""
        where = ctx.flat.clocked[0].span
        holds = bool(self.signals or self.units)  # (FMUs for model exchange are linearised)
        for a in analyses:
            if a.word in SMALL and holds:
                said = f"under .{a.word} blocks hold their values from before the first tick: loops through them are open"
                hint = "a .tran with a sine shows the response of a sampled loop"
                ctx.sink.warning("W390", said, where, hint)
            elif a.word in PERIODIC:
                said = f".{a.word} does not find the state of blocks: what they remember is no unknown"
                ctx.sink.error(
                    "E440", said, a.card.span, ".tran over many periods, with tstart near the end, shows it"
                )


def local(text: str, names: dict[str, str]) -> Node:
    """An equation of a template with signals in the place of its names."""
    known = lambda n: Name(SIGNAL + names[n.id]) if n.__class__ is Name and n.id in names else None  # noqa: E731
    return rewritten(_unplaced(parse_expression(text)), known)


def _unplaced(node: Node) -> Node:
    """Without places: what is wrong there is told of the block."""
    for part in (*getattr(node, "args", ()), *(getattr(node, key, None) for key in "cab")):
        if isinstance(part, Node):
            _unplaced(part)
    node.at = None
    return node


class Held(Context):
    """The same meeting room, where conditions are numbers that are looked at once."""

    def __init__(self, ctx: Context) -> None:
        self.__dict__ = ctx.__dict__

    def _flag(self, up: Expr, name: str, law: str) -> Expr:
        if up.value is not None:
            return self.b.const(1.0 if up.value > 0 else 0.0)
        sign = self.b.call("sgn", up)
        return 0.5 * sign * (1.0 + sign)

    def floor_(self, e: Expr, halves_to_even: bool = False) -> Expr:
        return self.b.call("round", e - 0.5) if halves_to_even else self.b.call("floor", e)

    def watch(self, e: Expr, text: str, where: Span | None) -> None:
        """A tick that has no value ends the run."""

    def divided(self, quotient: Expr, by: Expr, where: Span | None) -> None:
        """The same."""


class AtTicks(Compiler):
    """Equations of blocks. `order`: signals and FMUs, each behind those that it reads."""

    def __init__(self, ctx: Context, clocks: Clocks) -> None:
        super().__init__(Held(ctx))
        self.clocks, self.order = clocks, list[Signal | Unit]()
        self._outside: list[int] = []  # how many were open where inputs of FMUs began
        self._open: list[str] = []
        self._made = 0

    def value(self, name: str) -> Expr:
        """The rule of a signal."""
        signal = self.clocks.signals[name]
        unit = self.clocks.units.get(signal.block)
        if unit is not None and unit.state == "":
            self._before(unit)
        if self._outside and name in self._open[: self._outside[-1]]:
            raise Ring
        if signal.value is None and name in self._open:
            ring = [n for n in [*self._open[self._open.index(name) :], name] if "#" not in n]
            said = f"`{ring[0]}` needs itself at one tick"
            if len(set(ring)) > 1:
                said = f"the signals {' -> '.join(ring)} need each other at one tick"
            ask = f"what it was a tick before is {name.rpartition('.')[2]}[-1]"
            self.ctx.sink.error("E391", said, self._where or signal.span, ask)
            signal.value = self.ctx.b.const(0.0)
        if signal.value is None:
            self._open.append(name)
            found = (
                self.compile(signal.ast, signal.span)
                if isinstance(signal.ast, Node)
                else self.ctx.b.const(float(signal.ast))
            )
            self._open.pop()
            if signal.value is None:
                signal.value = found
                self.order.append(signal)
        return signal.value

    def _before(self, unit: Unit) -> None:
        """An FMU stands before what reads it, unless its inputs need that."""
        still = list(self._open)
        try:
            self.take(unit)
        except Ring:
            del self._open[:], self._outside[-1:]
            self._open += still
            unit.state = ""

    def take(self, unit: Unit) -> None:
        """The inputs of an FMU, in its place behind all that they read."""
        if unit.state:
            return
        unit.state = "open"
        self._outside.append(len(self._open))
        card = unit.foreign.card
        anchor = Signal(unit.name, unit.clock, None, {}, card.span)
        self.clocks.signals[anchored := f"{unit.name}.#in"] = anchor
        anchor.value = self.ctx.b.const(0.0)
        self._open.append(anchored)
        places = [(value, card.place(f"in {name}")) for name, value in card.lists["in"].items()]
        unit.inputs = [
            self.compile(value, place) if isinstance(value, Node) else self.ctx.b.const(float(value))
            for value, place in places
        ]
        self._open.pop()
        self._outside.pop()
        unit.state = "done"
        self.order.append(unit)

    @property
    def _block(self) -> Signal:
        """The signal at hand."""
        return self.clocks.signals[self._open[-1]]

    def _name(self, node: Name) -> Expr:
        name = node.id.removeprefix(SIGNAL)
        signal = self.clocks.signals.get(name)
        if signal is None:
            return super()._name(node)
        value = self.value(name)
        return value if signal.clock == self._block.clock or signal.number < 0 else signal.wave

    def _fn_limit(self, node: Call) -> Expr:
        """x kept between lo and hi: no line of ngspice could mean it otherwise."""
        if not self._expects(node, 3):
            return self.ctx.b.const(0.0)
        x, low, high = (self._node(a) for a in node.args)
        return self.ctx.min_(self.ctx.max_(x, low), high)

    def _divide(self, a: Expr, b: Expr, mechanical: bool, node: Binary) -> Expr:
        return super()._divide(a, b, mechanical, node) if b.value is not None else a / b

    def root(self, square: Expr) -> Expr:
        return self.ctx.b.call("sqrt", square)

    def _call(self, node: Call) -> Expr:
        if node.fn in OF_TIME:
            said = f"`{node.fn}` is of continuous time: between the ticks of a BLOCK there is none"
            return self._error(
                "E392", said, node, "the slope of a signal is (x - x[-1])/ts, its integral y={y[-1] + ts*x}"
            )
        if node.fn in ("pre", PAST):
            return self._past(node)
        if node.fn in OF_TICKS:
            made: Callable[[Call], Expr] = getattr(self, "_made_" + node.fn, self._ready)
            return made(node)
        return super()._call(node)

    # ---- functions of blocks ----

    def _past(self, node: Call) -> Expr:
        if not self._expects(node, 1 if node.fn == "pre" else 2):
            return self.ctx.b.const(0.0)
        of, ticks = node.args[0], 1.0
        if node.fn == PAST:
            ticks = getattr(node.args[1], "value", 0.0)
        name = of.id.removeprefix(SIGNAL) if isinstance(of, Name) else ""
        signal = self.clocks.signals.get(name)
        if signal is None:
            said = f"`{of!r}` is no signal of a block: only these have a past"
            return self._error("E390", said, node, "give it a name first: x={..}, and then x[-1]")
        if ticks != round(ticks) or not 1 <= ticks <= MOST_TICKS:
            return self._error("E390", f"x[-k] looks 1 to {MOST_TICKS} ticks back, not {ticks:g}", node)
        if signal.number < 0:
            return signal.wave if signal.ast is not None else self._unkept(node, name)
        return self.clocks.ago(self.ctx, name, int(ticks)).wave

    def _unkept(self, node: Call, name: str) -> Expr:
        said = f"`{name}` is the level of a timer, it has no ticks of its own"
        return self._error("E390", said, node, f"x={{{name}}}, and then x[-1]")

    def _signal(self, name: str, ast: Node) -> str:
        """A signal more of the block at hand; its full name."""
        at = self._block
        signal = Signal(at.block, at.clock, ast, {}, at.span)
        self.clocks.add(self.ctx, name, signal, True)
        return name

    def _template(self, node: Call, words: Sequence[str], equations: dict[str, str], gives: str) -> Expr:
        """The signals of a function with these arguments, and what it gives."""
        self._made += 1
        stem = f"{self._block.block}.{node.fn}#{self._made}"
        names = {name: f"{stem}.{name}" for name in (*words, *equations)}
        names["ts"] = f"{self._block.block}.ts"
        for word, ast in zip(words, node.args, strict=True):
            self._signal(names[word], ast)
        for word, text in equations.items():
            self._signal(names[word], local(text, names))
        for name in [*names.values()][:-1]:
            self.value(name)
        return self._node(local(gives, names))

    def _ready(self, node: Call) -> Expr:
        form, equations, gives = READY[node.fn]
        words = [word.partition("=")[0] for word in form.split()]
        defaults = [Num(float(word.partition("=")[2])) for word in form.split() if "=" in word]
        if not self._expects(node, *range(len(words) - len(defaults), len(words) + 1)):
            return self.ctx.b.const(0.0)
        missing = len(words) - len(node.args)
        whole = Call(node.fn, [*node.args, *defaults[len(defaults) - missing :]], node.at)
        return self._template(whole, words, equations, gives)

    def _made_average(self, node: Call) -> Expr:
        if not self._expects(node, 2):
            return self.ctx.b.const(0.0)
        n = self._node(node.args[1]).value
        if n is None or n != round(n) or not 1 <= n <= MOST_TICKS:
            return self._error("E390", f"`average` is of a number of values, 1 to {MOST_TICKS}", node.args[1])
        terms = ["x", *(f"x[-{k}]" for k in range(1, int(n)))]
        return self._template(
            Call(node.fn, node.args[:1], node.at), ["x"], {}, f"({'+'.join(terms)})/{int(n)}"
        )

    def _made_ztf(self, node: Call) -> Expr:
        count, odd = divmod(len(node.args) - 1, 2)
        if count < 1 or odd:
            said = "`ztf` takes x, then as many coefficients of the numerator as of the denominator, in powers of z^-1"
            return self._error("E123", said, node, "(z^-1)/(1 - 0.5 z^-1) is ztf(x, 0,1, 1,-0.5)")
        b, a = ([f"{letter}{k}" for k in range(count)] for letter in "ba")
        delayed = [
            *(f"{b[k]}*x[-{k}]" for k in range(1, count)),
            *(f"0-{a[k]}*y[-{k}]" for k in range(1, count)),
        ]
        y = "+".join(f"({term})" for term in ("b0*x", *delayed))
        return self._template(node, ["x", *b, *a], {"y": f"({y})/a0"}, "y")

    def _made_next(self, node: Call) -> Expr:
        count, odd = divmod(len(node.args) - 1, 3)
        if count < 1 or odd:
            said = "`next` takes a state, then from, when and to of each transition"
            return self._error("E123", said, node, "s={next(s[-1], 0, v(go)>1, 1,  1, v(stop)>1, 0)}")
        state, rest = node.args[0], node.args[1:]
        found = state
        for k in reversed(range(count)):
            start, when, to = rest[3 * k : 3 * k + 3]
            found = Cond(Binary("&&", Binary("==", state, start), when), to, found, node.at)
        return self._node(found)

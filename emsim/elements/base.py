"""What a SPICE element is: one class a letter, which says how its line reads, what it adds to equation (1), and its words.

The duties of an element, by who asks; `ctx` is contract.Circuit. A file in this folder and a line in `INDEX`
(__init__.py) make an element. Two-terminal elements need `flow` in place of 4. to 6.

 1. `letter what form law terminals instance model_types`   its words, for messages, `emsim help`, editors and the reference.
 2. `read(cards, rule, ch, line)`   what the words of its line mean. The default reads nodes, the model's name, positional
                        parameters, flags and key=value; with `bind(level)` names and values get their level's meaning.
 3. `check(ctx)`        rules between its parameters; reports through `ctx.sink`.
 4. `branches(is_read)` the currents that are unknowns of their own, with their initial values [A].
 5. `paths()`           what current may flow between which terminals, for the checks of the circuit's graph.
 6. `current(ctx, k)`   the current into terminal k, as an expression [A].
 7. `contribute(ctx)`   what it adds to d/dt Q(x) + F(x, t) = 0: row n+ gets +i, row n- gets -i.
 8. `probe(ctx, name)`  what @name[..] reads.
 9. `account(ctx, book)`  energies and powers, so that a deck audits itself.
10. `excite(ctx)`       the amplitudes of its waveforms in a small-signal analysis, from AC on its line.
11. `noise(ctx)`       its sources of noise at the operating point, those aside that a device of the engine has;
                        `coloured(ctx)` those whose density is any function of frequency.
12. `analogue(net)`     its line in an ngspice deck.

Linear elements are constant stamps (`b.g`, `b.c`, `b.f_wave`), which the engine sums once; anything else goes through the
expression graph. Defaults and temperature rules are ngspice 39's, checked against its runs (tests/unit/circuit).
"""

from __future__ import annotations

from ..diagnostics import did_you_mean, instead, suggest
from ..expr import Node, evaluate
from ..traced import number
from .words import NOTHING, TC, TEMPERATURE, M, Param, Written, ignored, named, the_last_holds

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import Any, ClassVar

    from ..deck import Model
    from ..diagnostics import Fix
    from .contract import Accounts, Circuit, Expr, Level
    from .net import Net

    Scalar = Expr | float
    Coloured = tuple[str, list[tuple[int, float]], Callable[[float], float]]

# from words.py too, so that a file of an element has one import
__all__ = ["NOTHING", "TC", "TEMPERATURE", "Element", "M", "Param", "ignored", "named", "the_last_holds"]

# two terminals and what may flow between them: "conducts", "voltage" (it holds one), "inductor", "blocks" (at DC),
# "drives" (a current that does not depend on the voltage)
Path = tuple[int, int, str]
CONDUCTS: tuple[Path, ...] = ((0, 1, "conducts"),)
VOLTAGE: tuple[Path, ...] = ((0, 1, "voltage"),)
DRIVES: tuple[Path, ...] = ((0, 1, "drives"),)

CURRENT_NAMES = ("i", "id", "current")  # of @name[..]
POWER_NAMES = ("p", "power")
# as the devices of the engine have them, and ngspice 39
BOLTZMANN = 1.38064852e-23  # J/K
ZERO_CELSIUS = 273.15  # K


class Element(Written):
    """One element of a deck: what it adds to the circuit. What its line says: words.Written."""

    __slots__ = ()

    law: ClassVar[str] = ""
    unit: ClassVar[str] = ""  # of its value
    accounted: ClassVar[str] = "dissipated"  # or stored, supplied: what its `account` is about
    is_metered: ClassVar[bool] = False  # its current becomes an unknown where something reads it
    current_name: ClassVar[str] = "i"  # of @name[..]; "" where the current is recorded as i(name) anyhow
    holds_voltage: ClassVar[bool] = False  # the row of its branch reads v+ - v- = value
    jumps: ClassVar[int] = 0  # how likely it is what made a node jump, for messages

    def chosen(self, read: set[str]) -> Element:
        """Itself, or the same line as an element of another law; `read`: what the deck reads of it, as gd of @d1[gd]."""
        return self

    def check(self, ctx: Circuit) -> None:
        """Unknown names among the parameters: an error on the line (as in ngspice), a warning in a .model."""
        known = list(self.known()) if self.params else []
        for name in self.params:
            if name not in known:
                near = suggest(name, known)
                own, fixes = self.meant(ctx, name)
                if own is None:
                    own = (
                        f"did you mean {near}=?"
                        if near
                        else f"it takes: {', '.join(known) or 'no parameters'}"
                    )
                    fixes = instead(self.span, name, near) if near else []
                ctx.sink.error("E307", f"a {self.what} takes no {name}=", self.span, own, fixes=fixes)
        if self.model is not None and (key := (type(self), self.model.name)) not in ctx.checked:
            ctx.checked.add(key)
            self._check_model(ctx, self.model)

    def meant(self, ctx: Circuit, name: str) -> tuple[str | None, list[Fix]]:
        """What to do instead of a parameter that an element of this kind has not."""
        return None, []

    def _check_model(self, ctx: Circuit, model: Model) -> None:
        words, at = self.model_names(), model.param_spans
        the_last_holds(model, self.model_table())
        numbers = {name for names, *_ in self.model_table() for name in names} | set(self.model_words)
        for name, choice in (
            (k, p.words) for k, p in self.model_words.items() if p.words and k in model.params
        ):
            numbers.discard(name)
            if (given := model.params[name]) not in choice:
                said = f"{name}= of .model `{model.name}` is none of {', '.join(choice)}: `{given}`"
                ctx.sink.error("E110", said, at.get(name, model.span))
                del model.params[name]
        for name in sorted(
            key for key, value in model.params.items() if isinstance(value, str) and key in numbers
        ):
            # who made the part, mfg=OnSemi, is nobody's business
            ctx.sink.error(
                "E110", f"{name}= of .model `{model.name}` is no number: `{model.params[name]}`",
                at.get(name, model.span), "write a number, or the name of a .param",
            )  # fmt: skip
            del model.params[name]
        for name in model.params if words is not None else ():
            if words is not None and name not in words and name != "level":
                ctx.sink.warning(
                    "W284", f".model `{model.name}`: a {self.what} takes no {name}=, it has no effect",
                    at.get(name, model.span), hint=did_you_mean(name, words, form="{}="),
                )  # fmt: skip

    def ic_unused(self, ctx: Circuit, instead: str) -> None:
        """ic= on the line counts under UIC alone, as in ngspice."""
        ctx.sink.warning(
            "W283", f"ic= of `{self.name}` has no effect: it counts only where .tran says uic", self.span,
            f"write uic behind .tran, or {instead}; without it the run starts from the operating point",
        )  # fmt: skip

    def temperature(self, ctx: Circuit) -> float:
        """The element's temperature [C]: its own `temp`, or the circuit's plus `dtemp`."""
        return self.number("temp") if "temp" in self.params else float(ctx.temp) + self.number("dtemp")

    def temperature_factor(self, ctx: Circuit) -> float:
        """1 + tc1 dT + tc2 dT^2, or 1.01^(tce dT); dT against the model's tnom."""
        if self.model is None and not self.params:
            return 1.0
        params: dict[str, Any] = self.model.params if self.model else {}
        pair = self.params.get("tc")
        pair = list(pair) if isinstance(pair, (tuple, list)) else [] if pair is None else [pair]

        def coefficient(key: str, place: int) -> float:
            if key in self.params:
                return self.number(key)
            if place < len(pair):
                return number(pair[place])
            return float(params.get(key, params.get(key + "r", 0.0)))  # tc1r: of resistors

        dt = self.temperature(ctx) - float(params.get("tnom", ctx.tnom))
        if "tce" in self.params or "tce" in params:
            return float(1.01 ** (coefficient("tce", 9) * dt))
        return 1.0 + dt * (coefficient("tc1", 0) + dt * coefficient("tc2", 1))

    # ---- the circuit's graph ----

    def branches(self, is_read: bool) -> Sequence[tuple[str, float]]:
        """Current unknowns of its own, as (name, initial value under UIC [A]); `is_read`: something reads its current."""
        return ((self.name, 0.0),) if self.is_metered and is_read else ()

    @property
    def has_series(self) -> bool:
        """Does its current follow from the voltage across a resistance of its own (`ctx.series`)?"""
        return False

    def paths(self) -> Sequence[Path]:
        return CONDUCTS

    def imposes(self, ctx: Circuit) -> bool:
        """Is what it holds or drives its own, and may it differ from zero at t = 0?"""
        return False

    def reads(self) -> list[str]:
        """Nodes that it only looks at."""
        return []

    # ---- equation (1) ----

    def contribute(self, ctx: Circuit) -> None:
        """The default of two terminals: `flow` from the first to the second."""
        self.inject(ctx, self.flow(ctx))

    def flow(self, ctx: Circuit) -> Expr:
        """Of two terminals: the current from the first through the element to the second [A]."""
        return ctx.b.x(ctx.branches[self.name])

    def current(self, ctx: Circuit, terminal: int = 0) -> Expr:
        """The current into a terminal [A]."""
        if terminal > 1:
            return ctx.b.const(0.0)  # of a node that is only read
        return -self.flow(ctx) if terminal else self.flow(ctx)

    def probe(self, ctx: Circuit, name: str) -> Expr | None:
        """@name[..]; None for what is not computed."""
        if name in CURRENT_NAMES:
            return self.current(ctx)
        if name in POWER_NAMES and len(self.nodes) > 1:
            return self.between(ctx) * self.current(ctx)
        return self.between(ctx) if name == "v" and len(self.nodes) > 1 else None

    def probes(self, ctx: Circuit) -> dict[str, str]:
        """What @name[..] reads, with its unit."""
        return dict.fromkeys(CURRENT_NAMES, "A") | dict.fromkeys(POWER_NAMES, "W") | {"v": "V"}

    def account(self, ctx: Circuit, book: Accounts) -> None:
        """Energies and powers. The default: it dissipates v i."""
        book.dissipates(self, self.between(ctx) * self.flow(ctx))

    def excite(self, ctx: Circuit) -> Sequence[tuple[int, complex]]:
        """(number of the waveform, complex amplitude) of what is its own and oscillates in a small-signal analysis."""
        return ()

    def noise(self, ctx: Circuit) -> Sequence[tuple[Any, ...]]:
        """Currents of noise from the first terminal to the second: (name behind that of the element, power density at 1 Hz
        [A^2/Hz], exponent of frequency with which it falls); from one unknown to another where a pair of these stands behind."""
        return ()

    def coloured(self, ctx: Circuit) -> Sequence[Coloured]:
        """Sources of noise whose density is no power of frequency: (name, rows of F with factors, density at a frequency
        [A^2/Hz])."""
        return ()

    def thermal(self, ctx: Circuit, conductance: Scalar) -> Scalar:
        """4 k T G, the power density of a conductance's current of noise [A^2/Hz]."""
        return 4.0 * BOLTZMANN * (self.temperature(ctx) + ZERO_CELSIUS) * conductance

    def quantity(self, ctx: Circuit) -> float | None:
        """Its value in SI units, of `unit`; None where it is no number."""
        return float(self.value) if isinstance(self.value, (int, float)) else None

    # ---- stamps that several share ----

    def between(self, ctx: Circuit) -> Expr:
        """The voltage from the first node to the second [V]."""
        return ctx.v(self.nodes[0], self.nodes[1])

    def inject(self, ctx: Circuit, i: Expr) -> None:
        """Current i from the first node through the element to the second."""
        p, n = ctx.node(self.nodes[0]), ctx.node(self.nodes[1])
        ctx.b.add_f(p, i)
        ctx.b.add_f(n, -i)

    def join(self, ctx: Circuit) -> tuple[int, int, int]:
        """The branch current in both nodes' rows; returns (branch row, n+, n-)."""
        p, n, br = ctx.node(self.nodes[0]), ctx.node(self.nodes[1]), ctx.branches[self.name]
        ctx.b.g(p, br, 1.0)
        ctx.b.g(n, br, -1.0)
        return br, p, n

    def join_voltage(self, ctx: Circuit) -> int:
        """A voltage-defined branch: row F = v+ - v- - (what the caller adds); returns the branch row."""
        br, p, n = self.join(ctx)
        ctx.b.g(br, p, 1.0)
        ctx.b.g(br, n, -1.0)
        return br

    def expression(self, ctx: Circuit, holds: Callable[[], frozenset[str]] | None = None) -> Expr:
        """A behavioural value, with its tc1, tc2; reciproctc=1: divided by what they make. `holds`: see Circuit.compile."""
        value = ctx.compile(self.value, self.value_span or self.span, holds)
        factor = self.temperature_factor(ctx)
        if factor and self.number("reciproctc"):
            factor = 1.0 / factor
        return value if factor == 1.0 else factor * value

    # ---- its line for ngspice ----

    @property
    def model_for_ngspice(self) -> Model | None:
        """The .model that its line there names."""
        return self.model

    def analogue(self, net: Net) -> str:
        """A line of an ngspice deck. The default: nodes, value or model, parameters."""
        words = [net.head(self), *([] if self.value is None else [repr(float(self.value))])]
        return " ".join([*words, *([self.model.name] if self.model else [])]) + net.parameters(self)


def number_at(value: Any, level: Level) -> float:
    """A value of a line that must be known before the run. Raises ExprError."""
    return evaluate(value, level.scope) if isinstance(value, Node) else number(value)

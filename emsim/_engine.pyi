"""Typed face of the native engine (Rust, `emsim/engine`).

A `Builder` collects the contributions of one deck to  d/dt Q(x, t) + F(x, t) = 0  and compiles them. Row i of the
equations belongs to unknown i; index -1 is ground and is ignored. All values are SI.
"""

from collections.abc import Callable, Iterator, Sequence
from typing import Any, final

__version__: str

_Place = tuple[int, int, int, int]
_Pair = tuple[int, int]

@final
class Panic(Exception):
    """A panic at any entry: an exception like every other fault."""

class Endless(ValueError):
    """What is computed has no end: a loop of a module."""

class Expr:
    """A node of the expression graph. Arithmetic builds new nodes, folded and shared; it has no truth value."""

    @property
    def value(self) -> float | None:
        """The value where the node is a constant."""
    @property
    def id(self) -> int: ...
    @property
    def node(self) -> tuple[str, float, list[Expr]]:
        """(operation, its number, operands): "const" v, "x" i, "time", "wave" k, "flag" k, "symbol" k, "neg" "add" "sub" "mul"
        "div" "pow" "powi" n "atan2" "select" "join", "result" k of a loop, or the name of a function of one argument."""
    def __add__(self, other: Expr | float) -> Expr: ...
    def __radd__(self, other: float) -> Expr: ...
    def __sub__(self, other: Expr | float) -> Expr: ...
    def __rsub__(self, other: float) -> Expr: ...
    def __mul__(self, other: Expr | float) -> Expr: ...
    def __rmul__(self, other: float) -> Expr: ...
    def __truediv__(self, other: Expr | float) -> Expr: ...
    def __rtruediv__(self, other: float) -> Expr: ...
    def __pow__(self, other: Expr | float) -> Expr: ...
    def __rpow__(self, other: float) -> Expr: ...
    def __neg__(self) -> Expr: ...
    def __pos__(self) -> Expr: ...

@final
class Builder:
    def __init__(self) -> None: ...
    def unknown(self, name: str, kind: str, unit: str, initial: float = 0.0) -> int:
        """A new unknown and its row. kind: node branch coordinate speed lambda mu derivative."""
    def set_initial(self, i: int, value: float) -> None: ...
    def x(self, i: int) -> Expr: ...
    def time(self) -> Expr: ...
    def const(self, v: float) -> Expr: ...
    def symbol(self) -> Expr:
        """A free symbol; it must be substituted away before compile()."""
    def call(self, function: str, *args: Expr | float) -> Expr:
        """sin cos tan asin acos atan sinh cosh tanh asinh acosh atanh exp log log10 sqrt abs sgn floor ceil round,
        pow(x, y) atan2(y, x) hypot(x, y); notless(x, y), for select to ask without an event. ValueError for an unknown one."""
    def is_logic(self, y: Expr | float) -> bool:
        """Is y made of flags and constants alone?"""
    def select(self, cond: Expr | float, a: Expr | float, b: Expr | float) -> Expr:
        """cond != 0 ? a : b; a NaN in the branch not taken does not leak, nor does it into derivatives."""
    def flag(
        self,
        up: Expr | float,
        down: Expr | float | None = None,
        name: str = "",
        initial: int = -1,
        rest: int = -1,
        law: str = "",
    ) -> Expr:
        """0/1, held between events: 1 when `up` rises above 0, 0 when `down` (default `up`) falls below 0. In between
        it starts as `initial` in a run from given values, as `rest` at the operating point (-1: as it comes). `law` says
        what holds exactly at a threshold: "" 0 there, "arrival" turns on arriving there from either side, "stays" as it
        was; "leg" does too, and small signals find it off; "memory" is no condition but the value of `up` at the last event.
        ValueError for another one."""
    def memory(self, name: str, past: bool = False) -> Expr:
        """What `keep` gives it, as it was just before the last event; 0 before the first. `past`: points of a sweep write it
        too, and no search for an operating point does."""
    def keep(self, memory: Expr, value: Expr | float) -> None:
        """What a memory keeps; it may read the memory itself. ValueError where there is none."""
    def law(
        self,
        form: str,
        row: int,
        *,
        flow: Expr,
        bound: Expr,
        stick: Expr,
        gap: Expr,
        restitution: float,
        flags: Sequence[Expr],
        normal: tuple[int, float, float] | None = None,
        way: Expr | None = None,
        across: int | None = None,
        feature: tuple[Expr, Expr] | None = None,
    ) -> None:
        """A law between the unknown `row` and a flow: form relay (flags of laws "mode" "kept" "kept": slides, share, mode),
        corner (closed, hits, impulse, energy lost), one way (closed). `normal`: the effort of an earlier law that bounds a
        relay, how much of it where it slides, and where it sticks. `way`: by what its bound is multiplied in its row where it
        slides, its share unless given. `across`: the effort of an earlier relay, the same law's in the other of two
        directions. `feature`: of a corner to one of several edges, a flag "kept" that has its number while it is closed, and
        which it is. ValueError for another one."""
    def grad(self, y: Expr, xs: Sequence[Expr]) -> list[Expr]:
        """dy/dx for each leaf x, by reverse mode."""
    def tangent(self, ys: Sequence[Expr], seed: Sequence[tuple[Expr, Expr | float]]) -> list[Expr]:
        """d ys/ds for d leaf/ds = tangent, by forward mode."""
    def substitute(
        self, ys: Sequence[Expr | float], map: Sequence[tuple[Expr, Expr | float]]
    ) -> list[Expr]: ...
    def outlined(self, groups: Sequence[Sequence[Expr]]) -> list[list[Expr] | None]: ...
    def depends(self, y: Expr, xs: Sequence[Expr]) -> list[bool]: ...
    def count(self, ys: Sequence[Expr]) -> int: ...
    def eval(self, ys: Sequence[Expr | float], x: Sequence[float], t: float = 0.0) -> list[float]: ...
    def wave(self, kind: str, args: Sequence[float], dc: float | None = None) -> int:
        """kind: dc pulse sin exp pwl pwlr sffm am, every argument given. ValueError when they do not fit."""
    def input(self, start: float) -> int:
        """A source whose value comes from outside (`System.pack`); `start` where nothing is said."""
    def note_places(self) -> None:
        """Before the first element: what is placed is noted, so that the compiled system can be packed."""
    def digital_node(self, name: str) -> tuple[int, int]:
        """A digital node: its number, and the wave that shows its level as 0, 1, or 1/2 where it is undefined."""
    def digital_senses(self, node: int, above: Expr, below: Expr) -> None:
        """Flags (or constants) decide that node: 0 where it is not above what is low, 1 where it is not below what is high,
        undefined between. ValueError for other expressions."""
    def digital_ramp(
        self, node: tuple[int, bool], values: tuple[float, float, float], times: tuple[float, float]
    ) -> int:
        """A wave that follows a digital node (number, inverted) in straight lines: values at 0, 1, undefined; times [s] of a
        whole rise and fall."""
    def digital_part(
        self,
        kind: str,
        name: str,
        ports: Sequence[Sequence[tuple[int, bool]]],
        values: dict[str, list[float]],
    ) -> None:
        """A digital part (`digital_parts`) between nodes: of each port (number, inverted) of its connections, none where it is
        open. ValueError: what is wrong, as a sentence."""
    def clock(self, period: float, offset: float, delay: float) -> int:
        """A clock that ticks at offset + k period [s]; what is computed at a tick is shown `delay` later."""
    def clocked_signal(self, name: str, clock: int, initial: float) -> tuple[int, int, int]:
        """A signal that its clock's rules set: its number, the wave that rules read, the wave that all others read."""
    def clocked_rule(self, clock: int, signals: Sequence[int], values: Sequence[Expr]) -> None:
        """What signals become at the ticks, by unknowns and sources as they are just before; rules are evaluated in the
        order in which they are given, each of them as a whole."""
    def clocked_unit(
        self, clock: int, spec: dict[str, Any], values: Sequence[Expr], signals: Sequence[int]
    ) -> None:
        """An FMU for co-simulation (assemble/foreign.py) at the ticks of a clock of its own: the values of its inputs, the
        signals that its outputs become. It stands among the rules. ValueError: a type that is none."""
    def exchange(self, spec: dict[str, Any], places: Sequence[Sequence[int]], flags: Sequence[Expr]) -> None:
        """An FMU for model exchange (assemble/foreign.py): unknowns that are its states, inputs, time, outputs, event
        indicators; flags that are the signs of the latter. ValueError: a type that is none."""
    @staticmethod
    def exchange_starts(spec: dict[str, Any]) -> list[float]:
        """States with which an FMU for model exchange begins: an instance is made, and goes. ValueError: why there is none."""
    def clocked_timer(self, clock: int, on: int, off: int, dead: float) -> tuple[int, int]:
        """A level that is 1 from one signal's value to the other's behind each tick [s], and its complement, as waves; both rise
        `dead` [s] later."""
    def wave_expr(self, k: int) -> Expr: ...
    def still(self) -> int:
        """The wave that is 1 until a run begins, 0 from then on."""
    def delay(self, row: int, of: Expr, by: float, initial: float) -> int:
        """A wave that is what an expression was a time `by` [s] ago, for that unknown's row; before a start from
        given values `initial`. ValueError for no positive time."""
    def response(self, row: int, col: int, of: Callable[[float, float], tuple[float, float]]) -> None:
        """A gain H(s) from the unknown `col` in the row of `row`, where equations are linearised: -H there, by real and
        imaginary part. Elsewhere the row has what is stamped."""
    def g(self, row: int, col: int, v: float) -> None: ...
    def c(self, row: int, col: int, v: float) -> None: ...
    def conductance(self, p: int, n: int, v: float) -> None:
        """The four stamps of g between two nodes."""
    def capacitance(self, p: int, n: int, v: float) -> None: ...
    def f_wave(self, row: int, wave: int, coefficient: float) -> None: ...
    def add_f(self, row: int, e: Expr | float) -> None: ...
    def add_q(self, row: int, e: Expr | float) -> None: ...
    def device(
        self,
        kind: str,
        name: str,
        nodes: Sequence[int],
        model: dict[str, float],
        instance: dict[str, float],
        temp_c: float = 27.0,
        tnom_c: float = 27.0,
    ) -> list[tuple[int, int, float]]:
        """An instance of a device (`devices()`) between its terminals. Gives its series resistances: number of the terminal,
        inner node, conductance [S]. ValueError: what is wrong with a parameter, as a sentence."""
    def module(
        self,
        modules: VerilogA,
        module: str,
        name: str,
        nodes: Sequence[int],
        model: Values,
        instance: dict[str, Any],
        temp_c: float = ...,
        tnom_c: float = ...,
        m: float = ...,
        connected: int = ...,
        gmin: float = ...,
    ) -> tuple[
        list[str],
        list[str],
        float | None,
        tuple[list[tuple[int, tuple[float, float]]], list[int]] | None,
        list[tuple[str, list[tuple[float, float]], bool]],
    ]:
        """An instance of a Verilog-A module between its terminals (-1: ground), m in parallel; `connected`: so many of them
        stand in the deck. Gives what the module says, what of it is not carried out, the longest step that it allows [s];
        and where it hangs on time, analyses or events: (wave, (re, im)) of its ac_stim, unknowns that are late;
        tables of its noise: name of the source, (frequency, density) ascending, whether logarithms are interpolated.
        ValueError: messages as VerilogA has them, or a sentence."""
    def off(self, name: str) -> None:
        """That instance of a device or a module carries no current in the first solution of an operating point."""
    def module_outputs(self, name: str) -> list[tuple[str, str, str]]:
        """(name, unit, meaning) of every operating-point value of a module's instance."""
    def module_output(self, name: str, output: str, gmin: float = ...) -> Expr | None:
        """An operating-point value of a module's instance as an expression of unknowns."""
    def device_branches(self, name: str) -> list[tuple[int, int, bool]]:
        """Of an instance: the nodes that each current goes from and to (-1: ground), and whether charge goes with it."""
    def force(self, row: int, value: float, kind: str) -> None:
        """Forces a node voltage: kind "ic" (until t = 0) or "nodeset" (a first guess)."""
    def start_current(self, row: int, value: float) -> None:
        """Holds a branch current while the start of a run is sought (not for .op), in place of the branch's own equation."""
    @staticmethod
    def wave_at(kind: str, args: Sequence[float], t: float) -> float:
        """What a waveform with complete arguments is just before a time. ValueError where there is none such."""
    def ic_charge(self, row: int, dq: float) -> None: ...
    def given(self, row: int, volts: float) -> None:
        """A node's voltage at a start with UIC, where capacitors say it [V]."""
    def rank(self, rows: Sequence[Sequence[float]], tol: float = 1e-9) -> tuple[int, list[int]]:
        """(rank, indices of a maximal set of independent rows, earlier ones first)."""
    def project(
        self,
        q: Sequence[int],
        h: Sequence[Expr],
        mass: Sequence[Expr | float],
        x: Sequence[float],
        held: Sequence[bool],
        t: float = 0.0,
        tol: float = 1e-12,
    ) -> tuple[bool, list[float], list[float]]:
        """Mass-weighted projection of the coordinates `q` onto h = 0: (found, values of q, residuals of h).
        mass: n*n expressions, row-major, evaluated at x; held coordinates stay."""
    def project_velocity(
        self,
        h: Sequence[Sequence[float]],
        mass: Sequence[float],
        u0: Sequence[float],
        held: Sequence[bool],
        rhs: Sequence[float],
    ) -> list[float]:
        """The mass-weighted smallest change of u0 with H u = rhs."""
    def constants(self) -> list[int]:
        """How many constants of F, of Q, of sources, and charges of a start with UIC there are so far."""
    def compile(self, kept: bool = False) -> System:
        """`kept`: for `System.again`."""

@final
class System:
    """The compiled equations; immutable."""

    def unevaluated(self) -> list[tuple[str, str]]:
        """Of FMUs for model exchange that could not be evaluated since this was asked: card and why."""
    def said(self) -> list[tuple[str, str]]:
        """What FMUs of the deck have said in runs since this was asked: card and message."""
    @property
    def n(self) -> int: ...
    @property
    def names(self) -> list[str]: ...
    @property
    def kinds(self) -> list[str]: ...
    @property
    def units(self) -> list[str]: ...
    @property
    def device_names(self) -> list[str]: ...
    @property
    def flag_names(self) -> list[str]: ...
    @property
    def flags(self) -> list[tuple[str, Expr, Expr]]:
        """Of every flag (name, up, down): 1 when `up` rises above 0, 0 when `down` falls below 0."""
    @property
    def differential_rows(self) -> list[bool]: ...
    @property
    def differential_unknowns(self) -> list[bool]: ...
    @property
    def linear(self) -> bool: ...
    @property
    def operations(self) -> tuple[int, int]: ...
    def lags(self, outputs: Sequence[Expr], /) -> list[bool]:
        """Of each expression: does it read an unknown of higher index (a multiplier, the current of a capacitor across a source),
        which methods know less well than the state?"""
    def again(
        self,
        numbers: Sequence[Sequence[tuple[int, float]]],
        waves: Sequence[tuple[int, str, Sequence[float], float | None]],
        /,
    ) -> System:
        """The system that the same builder would have made with other numbers: constants of F, of Q, of sources, and charges of
        a start with UIC, by place, and waves. It takes the expressions of this one. Raises
        ValueError where the builder was not told to keep what it made."""
    def paces(self, tstop: float, /) -> list[list[int]]:
        """Unknowns of circuits that nothing ties to each other, by the pace of their sources, slowest first, where a run of that
        length gains from giving each pace steps of its own; else none."""
    def two_paces(self, tstop: float, /) -> bool:
        """Do circuit and machine want a pace each (method multirate) in a run of that length? A guess from the deck."""
    def initial(self) -> list[float]: ...
    def q(self, x: Sequence[float], t: float) -> list[float]: ...
    def f(self, x: Sequence[float], t: float) -> list[float]: ...
    def pattern(self) -> tuple[list[int], list[int]]:
        """Compressed sparse columns common to C and G: (indptr, indices)."""
    def jac(self, x: Sequence[float], t: float) -> tuple[list[float], list[float]]:
        """Values of C = dQ/dx and G = dF/dx on the pattern."""
    def tolerances(self, options_: dict[str, Any] | None = None) -> list[float]: ...
    def quantities(
        self, options_: dict[str, Any] | None = None
    ) -> list[tuple[str, str, str, float, bool]]: ...  # name, unit, option, tolerance, given
    def start(
        self, options_: dict[str, Any] | None = None, uic: bool = False, tstep: float = 1e-6
    ) -> tuple[bool, list[float], dict[str, Any] | None]:
        """The consistent starting point of a transient analysis: (found, x, failure)."""
    def values(self, outputs: Sequence[Expr], x: Sequence[float], t: float) -> list[float]:
        """Values of expressions at (x, t). ValueError when x has another length than there are unknowns."""
    def op(
        self, outputs: Sequence[Expr], options_: dict[str, Any] | None = None, statics: bool = False
    ) -> Waveforms: ...
    def dc(
        self,
        outputs: Sequence[Expr],
        options_: dict[str, Any] | None = None,
        statics: bool = False,
        waves: Sequence[int] = (),
        points: Sequence[Sequence[float]] = (),
        near: tuple[list[float], list[float]] | None = None,
    ) -> Waveforms:
        """Operating points along a sweep, one row each, whose first column is the number of the point. points: values of the
        sources `waves`; near: unknowns and conditions to begin from, as `Waveforms.state` has them."""
    @property
    def sums(self) -> list[tuple[int, int]]:
        """(node, root) of nodes whose rows are part of the root's: what goes into one goes into the other."""
    def begin(self, analysis: str) -> None:
        """Which analysis asks from now on, in Verilog-A's words: dc, tran, ac, noise."""
    def small_signal(
        self,
        options_: dict[str, Any] | None = None,
        statics: bool = False,
        hold: bool = False,
        given: Sequence[tuple[int, float]] = (),
    ) -> tuple[SmallSignal | None, dict[str, Any] | None]:
        """The equations linearised about the operating point, or why there is none. hold: the machine does not move; given:
        values of sources, by their waves, in place of their own."""
    def pack(
        self,
        *,
        token: str,
        inputs: Sequence[tuple[int, str, float, str]],
        outputs: Sequence[tuple[Expr, str]],
        guards: Sequence[tuple[Expr, int]],
        options_: dict[str, Any] | None,
        times: tuple[float, float, float | None, float],
        uic: bool,
        codes: dict[str, str],
        conditions: Sequence[str],
        warnings: dict[int, str],
        accounts: tuple[Sequence[Expr], Sequence[Expr], Sequence[int]] | None,
        exchange: bool,
    ) -> tuple[
        bytes,
        list[tuple[str, str | None]],
        tuple[list[tuple[str, str, str, float]], int, bool] | None,
        str | None,
    ]:
        """The equations as bytes, for the engine in an FMU. Inputs: wave, name, value where nothing is said, and when it
        varies (continuous, tunable, fixed); outputs: expression (made before `compile`), name; guards: expression
        of inputs, its sign, which is to stay; times: tstep, tstop, tmax, tstart [s];
        codes: kind of failure -> the code under which it is explained; conditions: what flags are called; warnings: flag -> what
        is said when it turns to 1; accounts: as those of `tran`, with what works in impulses. And
        inputs that keep a hidden constraint from being differentiated, with an output that shows it. With `exchange`, where
        the deck
        is an explicit ODE: of each state the unknown that stores it, its kind and unit, the nominal value; how many event
        indicators
        there are; are slopes of everything known? Or why it is none. ValueError."""
    def tran(
        self,
        tstep: float,
        tstop: float,
        *,
        tstart: float = 0.0,
        tmax: float | None = None,
        uic: bool = False,
        outputs: Sequence[Expr] = (),
        options_: dict[str, Any] | None = None,
        progress: Callable[[float, float, int, int], bool | None] | None = None,
        accounts: tuple[Sequence[Expr], Sequence[Expr], bool] | None = None,
        drawn: bool = True,
        stream: tuple[str, bool, Any] | None = None,
        inside: tuple[Sequence[Expr], int] | None = None,
        closures: Sequence[Expr] = (),
        begin: tuple[Sequence[float], Sequence[float]] | None = None,
        tangent: tuple[Sequence[float], Sequence[tuple[int, float, float, System, Sequence[Expr]]]]
        | None = None,
        impulsive: Sequence[int] = (),
        apart: Sequence[Sequence[int]] = (),
        leg: tuple[float, float, Sequence[float] | None] | None = None,
        halts: Sequence[tuple[int, bool]] = (),
    ) -> Waveforms:
        """options: method (trap gear radau trbdf2 esdirk rk45 dop853) reltol abstol vntol trtol gmin
        itl1 itl4 maxord fixed_step projection.
        progress(t, h, steps, events) is called about 20 times a second; a true value stops the run.
        Not drawn: beside the ends of steps only the print grid has rows, however far apart they are.
        stream: (path, is there such a file already, head as write_raw has it): rows go there while the run goes on.
        inside: expressions that are kept within the steps as polynomials of that degree, see `Waveforms.inside`.
        closures: how far loops are open, for `Waveforms.gaps`.
        impulsive: those of the powers of accounts that work in impulses.
        apart: of `paces`, for a system whose builder noted its places: each of these with steps of its own. Not beside accounts,
        inside, begin and tangent.
        begin: unknowns and conditions in place of an operating point, as `Waveforms.state` of another run has them.
        leg: (from, until, charges): this part of the run alone, with Q of `begin` where that is of other equations.
        halts: (flag, both): flags that end the run when they turn to 1 (or are 1 at its start), or whenever they turn.
        tangent: sizes of parameters, and the equations with other values of them, for `Waveforms.tangent`: (which parameter,
        by how much it is moved, weight in the derivative, system, outputs)."""

@final
class SmallSignal:
    """(G + s C) X = b about a point; complex numbers are pairs (re, im)."""

    @property
    def hanging(self) -> tuple[int, float, float] | None:
        """(unknown, volts, amperes) where the point hangs on gmin."""
    @property
    def unstable(self) -> tuple[int, float, float, bool] | None: ...
    @property
    def x(self) -> list[float]: ...
    @property
    def residual(self) -> list[float]:
        """F at the point."""
    def respond(
        self,
        s: Sequence[tuple[float, float]],
        outputs: Sequence[Expr],
        sources: Sequence[tuple[int, tuple[float, float]]],
        rows: Sequence[tuple[int, tuple[float, float]]] = (),
    ) -> list[bytes]:
        """What expressions come to at each s, when sources (by their waves) have these amplitudes and so much goes into these
        rows: for each expression native complex128. ValueError ("singular: ...") where there is no solution."""
    def elsewhere(self, other: System, x: Sequence[float], hold: bool) -> SmallSignal:
        """Other equations of the same unknowns about a point of theirs, with the conditions of this one; nothing is solved.
        ValueError where they are of others."""
    def weigh(
        self,
        s: Sequence[tuple[float, float]],
        x: Sequence[Sequence[tuple[float, float]]],
        outputs: Sequence[Expr],
        sources: Sequence[tuple[int, tuple[float, float]]],
    ) -> tuple[list[list[tuple[float, float]]], list[list[tuple[float, float]]]]:
        """Where the unknowns are X at each s, be it the solution or not: what expressions come to with sources of these
        amplitudes; and what these put into the rows."""
    def values(self, outputs: Sequence[Expr | float]) -> list[float]:
        """Values of expressions at the point."""
    def device_noise(
        self,
    ) -> tuple[list[tuple[str, str, _Pair, float, float]], list[tuple[str, int, _Pair, float]]]:
        """Sources of noise of devices: (instance, source, rows from and to or -1, power density at 1 Hz [A^2/Hz], exponent with
        which it falls); and their series resistances: (instance, number of the terminal, rows, conductance [S])."""
    def noise(
        self,
        frequencies: Sequence[float],
        output: Expr,
        wave: int,
        sources: Sequence[tuple[Sequence[tuple[int, float]], float, float]],
    ) -> list[bytes]:
        """Columns of native float64 over frequencies [Hz]: the square of the gain from a source to the output, then for each
        source of noise (rows of F with factors, power density at 1 Hz, exponent) the density at the output. ValueError
        ("singular: ...") where there is no solution."""
    def adjoint(self, s: tuple[float, float], output: Expr) -> list[tuple[float, float]]:
        """For each row what 1 into it gives in the output."""
    def pencil(self) -> tuple[list[int], list[int], list[float], list[float]]:
        """(indptr, indices, G, C), compressed sparse columns."""

@final
class Waveforms:
    """What an analysis recorded: time is column 0."""

    @property
    def rows(self) -> int: ...
    @property
    def columns(self) -> int: ...
    @property
    def status(self) -> str:
        """ "ok", "failed" or "interrupted"; the rows recorded so far are kept in any case."""
    @property
    def failure(self) -> dict[str, Any] | None:
        """t, h, during, kind (singular, no convergence, not finite, unfit, memory), unknown_name, row_name, tried."""
    @property
    def hanging(self) -> tuple[int, int, float, float] | None:
        """(row, unknown, volts, amperes) of the first operating point that hangs on gmin."""
    @property
    def unstable(self) -> tuple[int, float, float, bool] | None:
        """Of an operating point, or the end of a transient that is at rest there: it does not stay. The node that moves most,
        and s of the fastest growing mode [1/s], real and imaginary part; 0 where nothing is stored. True: a
        transient starts there."""
    @property
    def substitute(self) -> tuple[int, bool] | None:
        """Where a transient starts: the condition that is not what it says, and how it is held. There is no operating point."""
    @property
    def events(self) -> list[tuple[float, int, int]]:
        """(time, flag, new value)"""
    @property
    def digital(self) -> list[tuple[float, str, str]]:
        """Changes of digital nodes: (time, node, state as it is written: 0s, 1r, Uz, 0u)."""
    @property
    def chattering(self) -> list[int]:
        """Flags that slid along their threshold: they were followed to 1e-4 of the span."""
    @property
    def short_steps(self) -> list[float]:
        """Times at which modes of laws were found by a step of Moreau's."""
    @property
    def jams(self) -> list[tuple[float, int]]:
        """(time, flag) of laws that no finite force kept sliding."""
    @property
    def broken(self) -> list[tuple[float, int]]:
        """(time, flag): flags that were not what their conditions say, each with its first time"""
    @property
    def unbalanced(self) -> list[tuple[int, float, float, float, float, bool]]:
        """(row, first time, worst time, what is left of it there, what the tolerances allow, is it charge?): algebraic rows of
        the equations that did not hold at a recorded row; nodes whose charge [C] came or went without a current"""
    @property
    def gaps(self) -> list[tuple[float, float]]:
        """(time, how wide) of each closure that tran() was given, where it was widest"""
    @property
    def accounts(self) -> dict[str, Any] | None:
        """powers, devices [(heat, charge energy)], first, last [J]; trace: float64 rows of time, powers, two a device,
        energies. None where tran() was given no accounts."""
    @property
    def watch(self) -> dict[str, Any]:
        """What the steps of a transient told about it. damped, late: the mode that lost most amplitude by the method, or
        fell behind most, as {unknown, period [s], steps (a period), loss (share of amplitude), late (periods), cycles};
        ringing: (unknown, t, share of its largest value);
        second: an unknown that is the second derivative of a source; open: (closure row, residual) without projection;
        stiff: share of the steps that stability limited."""
    @property
    def stats(self) -> dict[str, Any]: ...
    @property
    def state(self) -> tuple[list[float], list[float]] | None:
        """Unknowns and conditions where a sweep or a transient ended."""
    @property
    def ended(self) -> float:
        """When a transient ended [s]."""
    def tangent(self) -> tuple[int, bytes, bytes] | None:
        """(numbers in a row, rows of float64): time, then for each parameter the derivative of each of its outputs and of the
        time itself. Four rows for each part of a step: its start, Radau IIA's two inner stages, its end. Behind them rows of
        what may jump: the times before and behind it, and how it moves with each parameter. None where tran() was given no
        `tangent`."""
    @property
    def refused(self) -> dict[str, Any] | None:
        """Why the derivatives end: kind (memory impact touch corner other singular full), t, flag, parameter."""
    @property
    def corners(self) -> bytes:
        """Times of rows at which signals may bend or jump, as the bytes of native float64."""
    @property
    def steady(self) -> list[bool]:
        """Of every column: it is a state that no source fixes, and goes on smoothly where a source has a corner."""
    def column(self, k: int) -> bytes:
        """Column k as the bytes of native float64."""
    def inside(self, k: int, /) -> bytes:
        """Time (0) or an expression of tran(inside=...), float64 at Chebyshev's points of the second kind of every step, its
        ends among them; empty where they were too many to keep. IndexError where there are none."""
    def value(self, row: int, column: int) -> float: ...
    def write_raw(self, path: str, table: Any, ascii: bool = False, first: int = 0) -> None:
        """Puts the columns from `first` on behind what a raw file holds; table: their title, date, plotname, command, names
        and types (outputs/raw.py, Head). OSError."""
    def finish_stream(self) -> tuple[int, str | None] | None:
        """The last rows go to the file of tran(stream=...): its number of rows, and what went wrong; None where the run was too
        short to begin one."""

@final
class Trees:
    """Syntax trees by the tables of grammar/*.lark: (rule, [children]), leaves are made by `leaf`, a class of str
    with `type`, `start_pos` and `end_pos`. `plain`: rule -> (number of words, is the last one a number?) of the
    cards that come as words in place of a tree; `handed_back`: first words of lines that are not read."""

    def __init__(
        self, leaf: type[str], plain: dict[str, tuple[int, bool]], handed_back: list[str]
    ) -> None: ...
    def line(self, text: str, start: str) -> Any:
        """The tree of a line, or None where Lark has to say what is the matter. UnicodeEncodeError: a text that
        is no Unicode."""
    def cards(
        self, text: str, has_title: bool, skip_empty: bool
    ) -> tuple[
        _Place | None,
        list[_Place],
        _Place | None,
        _Place | None,
        list[_Place],
        Iterator[tuple[Any, Any, Any, Any, Any, int]],
    ]:
        """Title, stray continuation lines, the first .control, the lines of .control sections, and the cards: see
        source.Reading. A place is (line, column, start, end)."""

@final
class Values:
    """Parameters of a .model, read once for all of its instances."""

    def __init__(self, given: dict[str, Any]) -> None: ...
    @property
    def given(self) -> dict[str, Any]:
        """As they were given."""

@final
class VerilogA:
    """A Verilog-A text that was read, or what is wrong with it."""

    @property
    def messages(self) -> list[dict[str, Any]]:
        """What is wrong: text, file, line, column (from 1), length, source (the line), hint, through (macros, innermost first:
        name, file, line, column of its use). Empty where the text is right."""
    @property
    def modules(self) -> list[str]: ...
    @property
    def files(self) -> list[str]:
        """Every file that was read."""
    def describe(self, module: str) -> dict[str, Any]:
        """module, meaning, terminals, disciplines (one a terminal), parameters: dicts of names (aliases last), unit,
        meaning, default (None where it hangs on others), instance, integer, text. KeyError."""
    def evaluate(
        self,
        module: str,
        parameters: dict[str, float | str | list[float]] = {},
        *,
        temp: float = 27.0,
        voltages: dict[str, float] = {},
        gmin: float = 0.0,
        tnom: float = 27.0,
        instance: dict[str, float | str | list[float]] = {},
        connected: int | None = None,
        multiplier: float = 1.0,
        time: float = 0.0,
        symbols: dict[int, float] = {},
        slopes: bool = False,
    ) -> dict[str, Any]:
        """An instance at voltages of its unknowns (by name, 0 where none is given; [V], temperatures in Celsius): unknowns (name,
        kind), terminals, merged (name, name), ports (from, to, limit), flows (from, to, i, q), noise (from, to, name, power,
        exponent), outputs, bound_step, said, operations; with `slopes` those of i and q of every flow, a row of ports each,
        and operations_with_slopes.
        ValueError with messages where the module refuses, KeyError."""

def veriloga(text: str, name: str = "", folders: list[str] = [], defines: dict[str, str] = {}) -> VerilogA:
    """Reads a Verilog-A text: `name` is what messages call it, includes are looked for in its folder and in `folders`."""

def interpolated(x: bytes, y: bytes, at: bytes, corners: bytes) -> bytes:
    """y at places within x[0] .. x[-1], x ascending: the limited cubic of interpolate.py. Columns here and below are bytes of
    float64. ValueError for columns that are empty or of different lengths."""

def segments(x: bytes, n: int) -> bytes:
    """Chebyshev's n + 1 points between neighbours of an axis, segment by segment."""

def smooth(x: bytes, y: bytes, n: int, corners: bytes, logarithmic: bool) -> bytes:
    """y there, by the cubic; over the logarithm of a logarithmic axis. x goes up or down."""

def chebyshev(what: str, n: int, at: list[float] = []) -> list[list[float]]:
    """Matrices of Chebyshev's n + 1 points on 0 .. 1: "nodes", "areas" (one row), "slopes", "integrals", "resampling" to `at`.
    ValueError for another word."""

def table_text(columns: list[bytes], complex: list[bool], widths: list[int], first: int, digits: int) -> str:
    """Lines of a table, its rows numbered from `first`; a complex column holds pairs."""

@final
class Curve:
    """A signal over an axis: polynomials, one a segment, through n + 1 values at Chebyshev's points (engine/src/curve.rs). Places
    and values are in the units of the axis and the signal. ValueError for sizes that do not fit."""

    def __init__(self, x: bytes, y: bytes, n: int) -> None: ...
    @property
    def x(self) -> bytes: ...
    @property
    def y(self) -> bytes: ...
    @property
    def n(self) -> int: ...
    @property
    def first(self) -> float: ...
    @property
    def last(self) -> float: ...
    @property
    def start(self) -> float:
        """The first value."""
    @property
    def constant(self) -> float | None:
        """The value of a curve that does not change, to a billionth."""
    def value(self, t: float) -> float:
        """At t; behind a jump there."""
    def slope(self, t: float) -> float:
        """dy/dx at t; between two segments that of the one behind it; nan at a point."""
    def crossings(self, level: Curve, begin: float, end: float) -> list[tuple[float, int]]:
        """(place, 1 rising or -1 falling) of each time at which it comes to `level` from one side, in the axis' direction."""
    def touch(self, level: Curve, begin: float, end: float, direction: int) -> float | None:
        """Where it comes to a constant level and turns: its maximum (1), its minimum (-1), either (0)."""
    def cut(self, begin: float, end: float) -> Curve:
        """The part within begin .. end, in ascending order."""
    def integral(self, power: int = 1) -> float:
        """Of y or y^2 over all of x."""
    def extreme(self, sign: float) -> tuple[float, float]:
        """(value, place) of the largest value (sign 1) or the smallest one (-1); of several that are equal the first."""

def arrange_diagram(
    parts: list[list[tuple[int, list[tuple[int, int, int, int]], list[tuple[int, int, int, int]]]]],
    nets: list[list[tuple[int, int]]],
    wishes: list[tuple[str, int, int, int]],
    seed: int,
    rounds: int,
    moves: int,
    polish: int,
) -> tuple[list[tuple[int, int, int]], list[list[list[tuple[int, int]]]], list[int], int]:
    """Places the parts of a diagram and wires them. Parts are lists of variants (cost, rectangles [x0, y0, x1, y1], pins
    [x, y, dx, dy]), nets lists of (part, pin), wishes ("right" | "after" | "row" | "below" | "column", a, b, weight). Returns
    places (x, y, variant), wires of every net as lists of corners, nets that are not wired whole, cost. ValueError for what
    does not fit."""

def devices() -> list[tuple[str, list[str]]]:
    """(name, terminals) of every device; the name is the word of its .model."""

def methods() -> list[tuple[list[str], str, str, str]]:
    """(names, order, kind, what it is for) of every integrator, as its line in the engine's registry says; the first name is its
    own."""

def digital_parts() -> list[
    tuple[str, str, list[tuple[str, bool, bool, bool]], list[tuple[str, str, float, str]]]
]:
    """Of every digital part: name, what it is, ports (name, is it an output, a list, may it be open?), parameters (name, unit,
    default or nan, meaning)."""

def device_parameters(kind: str, of: str = "model") -> list[tuple[list[str], str, float, str]]:
    """(names, unit, default, meaning) of every parameter of a device's .model, or of "instance"; the default is nan where it
    depends on others."""

class State:
    """What an Instance is put back to."""

def lead(
    instances: Sequence[Instance],
    inputs: Sequence[int],
    values: Sequence[float],
    h: float,
    outputs: Sequence[int],
    threads: int,
) -> tuple[bytes, list[str | None]]:
    """One step of h [s] of many instances, in threads: inputs are set to their rows of values, outputs read. These, an
    instance a row, as
    bytes of float64, and of each instance what it said where it failed."""

class Instance:
    """A packed deck that is led from step to step. Value references: 0 is the time, then the inputs, then the outputs. What fails
    is a RuntimeError with a sentence."""

    def __init__(self, packed: bytes) -> None: ...
    def reset(self) -> None: ...
    def start(self) -> None: ...
    @property
    def time(self) -> float: ...
    def get(self, reference: int) -> float: ...
    def set(self, reference: int, value: float, slope: float) -> None: ...
    def step(self, h: float) -> list[str]: ...
    def may_move(self, coordinate: int, speed: int | None) -> None:
        """A coordinate that the start may have elsewhere, by its row and that of its speed."""
    def place(self, coordinate: int, value: float | None) -> None:
        """Where it is at the start, or as the deck has it; the run is then to be started."""
    def save(self) -> State: ...
    def restore(self, state: State) -> None: ...

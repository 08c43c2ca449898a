"""SPICE elements: one table, letter -> terminals, model types, and what the element adds to equation (1).

Every kind has three verbs, each with the same signature in all siblings:

    contribute(ctx, e)   stamps into d/dt Q(x) + F(x, t) = 0
    current(ctx, e)      the current into the first terminal, as an expression [A]
    branch               True where that current is an unknown of its own (a row F = v - e(t) or Q = L i)

Linear elements are constant stamps (`b.g`, `b.c`, `b.f_wave`), which the engine sums once; anything else goes
through the expression graph. Signs: current into the + terminal is positive, row n+ gets +i, row n- gets -i.
Defaults and temperature rules are ngspice 39's, checked against its runs (tests/unit/circuit).
"""

from __future__ import annotations

from .expr import Node

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    from ._engine import Expr
    from .deck import Element

    Ctx = Any  # assemble.context.Context, which stands above this module
    Contribute = Callable[[Ctx, Element], None]
    Current = Callable[[Ctx, Element], Expr]

LEAST_RESISTANCE = 1e-3  # what ngspice makes of 0 ohm [ohm]
TABLE_ROUNDING = 0.1  # ngspice hands TABLE to its XSPICE model `pwl` with input_domain=0.1
FILAMENT = 10e-6  # default width and length of R and C models [m]


class Kind:
    """One row of the table. `dc`: "conducts", "shorts" (holds a voltage), "blocks", or "drives" (a current)
    at the operating point; the topology checks read it. `terminals` counts the nodes that carry current,
    `nodes` all that stand on the line."""

    __slots__ = ("branch", "contribute", "current", "dc", "letter", "models", "nodes", "terminals", "what")

    def __init__(
        self, letter: str, what: str, contribute: Contribute, current: Current, *, nodes: int = 2,
        models: tuple[str, ...] = (), branch: bool = False, dc: str = "conducts",
    ) -> None:  # fmt: skip
        self.letter, self.what, self.contribute, self.current = letter, what, contribute, current
        self.terminals, self.nodes, self.models = (0 if nodes == 0 else 2), nodes, models
        self.branch, self.dc = branch, dc


# ---- values: temperature, geometry, multiplier -------------------------------------------------


def number(e: Element, key: str, default: float = 0.0) -> float:
    """An instance parameter; flags count as 1, lists by their first entry."""
    value = e.params.get(key, default)
    if isinstance(value, (tuple, list)):
        value = value[0] if value else default
    return float(value) if isinstance(value, (int, float)) else default


def temperature(ctx: Ctx, e: Element) -> float:
    """The element's temperature [C]: its own `temp`, or the circuit's plus `dtemp`."""
    return number(e, "temp") if "temp" in e.params else float(ctx.temp) + number(e, "dtemp")


def temperature_factor(ctx: Ctx, e: Element) -> float:
    """1 + tc1 dT + tc2 dT^2, or 1.01^(tce dT); dT against the model's tnom."""
    if e.model is None and not e.params:
        return 1.0
    params: dict[str, Any] = e.model.params if e.model else {}
    pair = e.params.get("tc")
    pair = list(pair) if isinstance(pair, (tuple, list)) else [] if pair is None else [pair]

    def coefficient(key: str, place: int) -> float:
        if key in e.params:
            return number(e, key)
        if place < len(pair):
            return float(pair[place])
        return float(params.get(key, params.get(key + "r", 0.0)))  # tc1r: of resistors

    dt = temperature(ctx, e) - float(params.get("tnom", ctx.tnom))
    if "tce" in e.params or "tce" in params:
        return float(1.01 ** (coefficient("tce", 9) * dt))
    return 1.0 + dt * (coefficient("tc1", 0) + dt * coefficient("tc2", 1))


def _number_or_model(
    ctx: Ctx, e: Element, from_model: Callable[[Element], float | None], quantity: str
) -> float:
    """The value on the line, or what the model makes of it; an error when there is neither."""
    if isinstance(e.value, (int, float)):
        return float(e.value)
    value = from_model(e)
    if value is None:
        ctx.sink.error(
            "E281", f"`{e.name}` has no {quantity}", e.span,
            hint="write a number after the nodes" + (f", or into .model `{e.model.name}`" if e.model else ""),
        )  # fmt: skip
        return 1.0
    return value


def resistance(ctx: Ctx, e: Element) -> float:
    """R [ohm] of a constant resistor, one of the `m` that stand in parallel: with m=0 none does."""

    def from_model(e: Element) -> float | None:
        p: dict[str, Any] = e.model.params if e.model else {}
        if p.get("rsh"):
            # sheet resistance times squares; both ends and both edges are over-etched
            length = number(e, "l", p.get("l", FILAMENT)) - 2 * p.get("short", p.get("dlr", 0.0))
            edge = p.get("narrow", p.get("dw", 0.0))
            width = number(e, "w", p.get("w", p.get("defw", FILAMENT))) - 2 * edge
            return float(p["rsh"] * length / width) if width else None
        return float(p.get("r", p.get("res", 0.0)))

    r = (
        _number_or_model(ctx, e, from_model, "resistance")
        * temperature_factor(ctx, e)
        * number(e, "scale", 1.0)
    )
    if r == 0.0:
        ctx.sink.warning(
            "W281", f"`{e.name}` has 0 ohm, taken as 1 mOhm as in ngspice", e.value_span or e.span,
            hint="use a voltage source of 0 V for an ideal connection",
        )  # fmt: skip
        r = LEAST_RESISTANCE
    return r


def capacitance(ctx: Ctx, e: Element) -> float:
    """C [F] of a constant capacitor, `m` included."""

    def from_model(e: Element) -> float | None:
        p: dict[str, Any] = e.model.params if e.model else {}
        if "l" in e.params and (p.get("cj") or p.get("cjsw")):
            length = number(e, "l") - p.get("short", 0.0)
            width = number(e, "w", p.get("defw", FILAMENT)) - p.get("narrow", 0.0)
            return float(p.get("cj", 0.0) * length * width + 2 * p.get("cjsw", 0.0) * (length + width))
        value = p.get("cap", p.get("c"))
        return None if value is None else float(value)

    c = _number_or_model(ctx, e, from_model, "capacitance")
    return c * temperature_factor(ctx, e) * number(e, "scale", 1.0) * number(e, "m", 1.0)


def inductance(ctx: Ctx, e: Element) -> float:
    """L [H] of a constant inductor, `m` included."""

    def from_model(e: Element) -> float | None:
        value = e.model.params.get("ind", e.model.params.get("l")) if e.model else None
        return None if value is None else float(value)

    h = _number_or_model(ctx, e, from_model, "inductance")
    return h * temperature_factor(ctx, e) * number(e, "scale", 1.0) / (number(e, "m", 1.0) or 1.0)


# ---- shared stamps -----------------------------------------------------------------------------


def inject(ctx: Ctx, e: Element, i: Expr) -> None:
    """Current i from the first node through the element to the second."""
    p, n = ctx.node(e.nodes[0]), ctx.node(e.nodes[1])
    ctx.b.add_f(p, i)
    ctx.b.add_f(n, -i)


def join(ctx: Ctx, e: Element) -> tuple[int, int, int]:
    """The branch current in both nodes' rows; returns (branch row, n+, n-)."""
    p, n, br = ctx.node(e.nodes[0]), ctx.node(e.nodes[1]), ctx.branch(e.name)
    ctx.b.g(p, br, 1.0)
    ctx.b.g(n, br, -1.0)
    return br, p, n


def join_voltage(ctx: Ctx, e: Element) -> int:
    """A voltage-defined branch: row F = v+ - v- - (what the caller adds); returns the branch row."""
    br, p, n = join(ctx, e)
    ctx.b.g(br, p, 1.0)
    ctx.b.g(br, n, -1.0)
    return br


def branch_current(ctx: Ctx, e: Element) -> Expr:
    return ctx.b.x(ctx.branch(e.name))


def between(ctx: Ctx, e: Element) -> Expr:
    return ctx.v(e.nodes[0], e.nodes[1])


def expression(ctx: Ctx, e: Element) -> Expr:
    """A behavioural value, with its tc1, tc2; reciproctc=1: divided by what they make."""
    value = ctx.compile(e.value, e.value_span or e.span)
    factor = temperature_factor(ctx, e)
    if factor and number(e, "reciproctc"):
        factor = 1.0 / factor
    return value if factor == 1.0 else factor * value


def multiplier(e: Element) -> float:
    """m of a behavioural source, 1/m with reciprocm=1."""
    m = number(e, "m", 1.0)
    return 1.0 / m if m and number(e, "reciprocm") else m


# ---- R, L, C, K --------------------------------------------------------------------------------


def resistor(ctx: Ctx, e: Element) -> None:
    """i = v / R(T)."""
    if isinstance(e.value, Node):
        inject(ctx, e, resistor_current(ctx, e))
        return
    # most elements of a big deck are a number between two nodes
    plain = e.value and not e.params and e.model is None
    g = 1.0 / e.value if plain else number(e, "m", 1.0) / resistance(ctx, e)
    ctx.b.conductance(ctx.node(e.nodes[0]), ctx.node(e.nodes[1]), g)


def resistor_current(ctx: Ctx, e: Element) -> Expr:
    if not isinstance(e.value, Node):
        return between(ctx, e) * (number(e, "m", 1.0) / resistance(ctx, e))
    r = expression(ctx, e)
    if r.value == 0.0:
        ctx.sink.warning(
            "W281", f"`{e.name}` has 0 ohm, taken as 1 mOhm as in ngspice", e.value_span or e.span
        )
        r = ctx.b.const(LEAST_RESISTANCE)
    return number(e, "m", 1.0) * between(ctx, e) / r


def _is_charge(e: Element) -> bool:
    """Q={..}: the charge itself; C={..} is the incremental capacitance, i = C dv/dt, as in ngspice."""
    return bool(e.extra.get("charge"))


def _charge(ctx: Ctx, e: Element) -> Expr:
    if isinstance(e.value, Node):
        return number(e, "m", 1.0) * expression(ctx, e)
    return capacitance(ctx, e) * between(ctx, e)


def capacitor(ctx: Ctx, e: Element) -> None:
    """q = C v in both nodes' charge rows."""
    p, n, b = ctx.node(e.nodes[0]), ctx.node(e.nodes[1]), ctx.b
    if isinstance(e.value, Node):
        if _is_charge(e):
            q = _charge(ctx, e)
            b.add_q(p, q)
            b.add_q(n, -q)
        else:
            inject(ctx, e, capacitor_current(ctx, e))
        return
    if e.value is not None and not e.params and e.model is None:
        b.capacitance(p, n, e.value)
        return
    c = capacitance(ctx, e)
    b.capacitance(p, n, c)
    if "ic" in e.params:
        # UIC: the charge that turns the nodes' initial voltages into the capacitor's own
        dq = c * (number(e, "ic") - (ctx.initial(e.nodes[0]) - ctx.initial(e.nodes[1])))
        b.ic_charge(p, dq)
        b.ic_charge(n, -dq)


def capacitor_current(ctx: Ctx, e: Element) -> Expr:
    if isinstance(e.value, Node) and not _is_charge(e):
        return number(e, "m", 1.0) * expression(ctx, e) * ctx.ddt(between(ctx, e), f"{e.name}#dv")
    return ctx.ddt(_charge(ctx, e), f"{e.name}#i")


def inductor(ctx: Ctx, e: Element) -> None:
    """Flux linkage L i in the branch row, minus the branch voltage. L={..} is incremental: v = L(x) di/dt."""
    br, p, n = join(ctx, e)
    b = ctx.b
    b.g(br, p, -1.0)
    b.g(br, n, 1.0)
    if isinstance(e.value, Node):
        if "flux" in e.params:
            b.add_q(br, expression(ctx, e))
        else:
            scale = 1.0 / (number(e, "m", 1.0) or 1.0)
            b.add_f(br, scale * expression(ctx, e) * ctx.ddt(b.x(br), f"{e.name}#di"))
        return
    b.c(br, br, inductance(ctx, e))


def coupling(ctx: Ctx, e: Element) -> None:
    """Mutual inductance M = k sqrt(Li Lj) between every pair of the named inductors."""
    k = e.value if isinstance(e.value, (int, float)) else 1.0
    if abs(k) > 1.0:
        ctx.sink.error(
            "E284", f"coupling `{e.name}` of {k:g} is more than complete", e.value_span or e.span,
            hint="the coefficient lies between -1 and 1",
        )  # fmt: skip
        return
    coils: list[tuple[int, float]] = []
    for name in e.extra["inductors"]:
        coil = ctx.elements.get(ctx.element_name(name, "L"))
        if coil is None or coil.letter.upper() != "L":
            names = [x.name for x in ctx.elements.values() if x.letter.upper() == "L"]
            ctx.unknown(
                "E285", f"`{e.name}` couples `{name}`, which is no inductor of this deck", name, names, e.span
            )
        elif isinstance(coil.value, Node):
            ctx.sink.error(
                "E284", f"`{e.name}` couples `{coil.name}`, whose inductance is an expression", e.span,
                hint="mutual inductance needs constant inductances",
            )  # fmt: skip
        else:
            coils.append((ctx.branch(coil.name), inductance(ctx, coil)))
    for i, (row, li) in enumerate(coils):
        for col, lj in coils[i + 1 :]:
            if col == row:
                ctx.sink.error("E284", f"`{e.name}` couples a coil with itself", e.span, "name two coils")
                continue
            if li * lj < 0:
                ctx.sink.error("E284", f"`{e.name}` couples inductances of opposite sign", e.span)
                continue
            if li > 0:
                ctx.coupled[row, col] = ctx.coupled.get((row, col), 0.0) + k
            m = k * (li * lj) ** 0.5
            ctx.b.c(row, col, m)
            ctx.b.c(col, row, m)


def no_current(ctx: Ctx, e: Element) -> Expr:
    return ctx.b.const(0.0)


# ---- V, I, controlled sources, B ---------------------------------------------------------------


def voltage_source(ctx: Ctx, e: Element) -> None:
    """Row v+ - v- - e(t)."""
    br = join_voltage(ctx, e)
    ctx.b.f_wave(br, ctx.wave(e), -1.0)


def current_source(ctx: Ctx, e: Element) -> None:
    """i(t) from n+ through the source to n-."""
    m, k = number(e, "m", 1.0), ctx.wave(e)
    ctx.b.f_wave(ctx.node(e.nodes[0]), k, m)
    ctx.b.f_wave(ctx.node(e.nodes[1]), k, -m)


def current_source_current(ctx: Ctx, e: Element) -> Expr:
    return number(e, "m", 1.0) * ctx.b.wave_expr(ctx.wave(e))


def controls(ctx: Ctx, e: Element) -> list[list[tuple[int, float]]]:
    """What controls, each as a sum of (unknown, factor): node pairs of E and G, currents of F, H, W."""
    if e.letter.upper() in "EG":
        pairs = e.extra.get("controls") or [tuple(e.nodes[2:4])]
        return [[(ctx.node(p), 1.0), (ctx.node(n), -1.0)] for p, n in pairs]
    found: list[list[tuple[int, float]]] = []
    for name in e.extra["controls"]:
        branch = ctx.branch(ctx.element_name(name))
        if branch is None:
            known = ctx.elements.get(ctx.element_name(name))
            if known is None:
                ctx.unknown(
                    "E285", f"`{e.name}` reads the current of `{name}`, which this deck does not have",
                    name, ctx.branches, e.span, "a current is measured with a voltage source of 0 V in its path",
                )  # fmt: skip
            else:
                ctx.sink.error(
                    "E285", f"`{e.name}` reads the current of `{name}`, and only voltage sources and inductors tell theirs",
                    e.span,
                    hint=f"put a voltage source of 0 V in series with `{known.name}` and name that one",
                )  # fmt: skip
            branch = -1
        found.append([(branch, 1.0)])
    return found


def nodes_read(e: Element) -> list[str]:
    """Nodes that the element only looks at."""
    if len(e.nodes) == 2 and e.letter not in "EGeg":
        return []
    pairs = e.extra.get("controls", ()) if e.letter.upper() in "EG" else ()
    return [*e.nodes[2:], *(node for pair in pairs for node in pair)]


def sum_of(ctx: Ctx, terms: list[tuple[int, float]]) -> Expr:
    total = ctx.b.const(0.0)
    for index, factor in terms:
        if index >= 0:
            total = total + factor * ctx.b.x(index)
    return total


def polynomial(ctx: Ctx, coeffs: list[float], xs: list[Expr]) -> Expr:
    """POLY: p0, then the products of degree 1, 2, ... in the order x1, x2, .., x1 x1, x1 x2, .., x2 x2, .."""
    from itertools import combinations_with_replacement

    total, at, degree = ctx.b.const(coeffs[0] if coeffs else 0.0), 1, 0
    while at < len(coeffs) and xs:
        degree += 1
        for factors in combinations_with_replacement(xs, degree):
            if at == len(coeffs):
                break
            if coeffs[at]:
                term = factors[0]
                for x in factors[1:]:
                    term = term * x
                total = total + coeffs[at] * term
            at += 1
    return total


def controlled_value(ctx: Ctx, e: Element) -> Expr:
    """What a source of any form delivers, as an expression [V or A]."""
    form = e.extra.get("form", "linear")
    if form == "expr":
        return expression(ctx, e)
    if form == "table":
        return ctx.table(
            ctx.compile(e.value, e.value_span or e.span), e.extra["table"], True, e.span, TABLE_ROUNDING
        )
    xs = [sum_of(ctx, terms) for terms in controls(ctx, e)]
    if form == "poly":
        return polynomial(ctx, [float(c) for c in e.extra["coeffs"]], xs)
    return float(e.value) * xs[0]


def linear_terms(ctx: Ctx, e: Element) -> list[tuple[int, float]] | None:
    """(unknown, gain) pairs when the source is a homogeneous linear one, else None."""
    form = e.extra.get("form", "linear")
    if form == "linear":
        gains = [float(e.value)]
    elif form == "poly":
        coeffs = [float(c) for c in e.extra["coeffs"]]
        if not coeffs or coeffs[0] or any(coeffs[1 + int(e.extra["dims"]) :]):
            return None
        gains = coeffs[1:]
    else:
        return None
    pairs = zip(controls(ctx, e), gains, strict=False)
    return [(index, gain * factor) for terms, gain in pairs for index, factor in terms]


def controlled_voltage(ctx: Ctx, e: Element) -> None:
    """E, H, B V=: row v+ - v- - value."""
    br = join_voltage(ctx, e)
    terms = linear_terms(ctx, e)
    if terms is None:
        # m= multiplies the voltage of an expression, as in ngspice
        m = multiplier(e) if e.extra.get("form") == "expr" else 1.0
        ctx.b.add_f(br, -m * controlled_value(ctx, e))
        return
    for index, gain in terms:
        ctx.b.g(br, index, -gain)


def controlled_current(ctx: Ctx, e: Element) -> None:
    """F, G, B I=: value from n+ through the source to n-, times m."""
    terms = linear_terms(ctx, e)
    if terms is None:
        inject(ctx, e, controlled_current_current(ctx, e))
        return
    p, n, m = ctx.node(e.nodes[0]), ctx.node(e.nodes[1]), number(e, "m", 1.0)
    for index, gain in terms:
        ctx.b.g(p, index, m * gain)
        ctx.b.g(n, index, -m * gain)


def controlled_current_current(ctx: Ctx, e: Element) -> Expr:
    return multiplier(e) * controlled_value(ctx, e)


def behavioural(ctx: Ctx, e: Element) -> None:
    e.extra.setdefault("form", "expr")
    (controlled_voltage if gives_voltage(e) else controlled_current)(ctx, e)


def behavioural_current(ctx: Ctx, e: Element) -> Expr:
    e.extra.setdefault("form", "expr")
    return branch_current(ctx, e) if gives_voltage(e) else controlled_current_current(ctx, e)


def gives_voltage(e: Element) -> bool:
    return e.letter.upper() != "B" or e.extra.get("output", "v") == "v"


# ---- D, S, W -----------------------------------------------------------------------------------


def diode(ctx: Ctx, e: Element) -> None:
    """The engine's junction diode kernel; temperature scaling and the inner node of rs are its business."""
    assert e.model is not None
    model = {key: float(value) for key, value in e.model.params.items() if isinstance(value, (int, float))}
    instance = {key: number(e, key) for key in ("area", "m", "pj", "w", "l") if key in e.params}
    p, n = ctx.node(e.nodes[0]), ctx.node(e.nodes[1])
    if e.name in ctx.metered:
        # its current is asked for: a 0 V branch stands before the anode
        br, inner = ctx.branch(e.name), ctx.inner_node(e.name + "#anode")
        ctx.b.g(p, br, 1.0)
        ctx.b.g(inner, br, -1.0)
        ctx.b.g(br, p, 1.0)
        ctx.b.g(br, inner, -1.0)
        p = inner
    try:
        series = ctx.b.diode(e.name, p, n, model, instance, temperature(ctx, e), model.get("tnom", ctx.tnom))
        if series is not None:
            ctx.series[e.name] = (p, *series)
    except ValueError as trouble:
        ctx.sink.error(
            "E299",
            f"`{e.name}`, .model `{e.model.name}`: {trouble}",
            e.model.param_spans.get(str(trouble).partition("=")[0], e.model.span),
        )


def switch(ctx: Ctx, e: Element) -> None:
    inject(ctx, e, switch_current(ctx, e))


def switch_current(ctx: Ctx, e: Element) -> Expr:
    """i = v/ron above threshold + |hysteresis|, v/roff below threshold - |hysteresis|, held in between."""
    assert e.model is not None
    voltage = e.letter.upper() == "S"
    p = {key: value for key, value in e.model.params.items() if isinstance(value, (int, float))}
    unit = "v" if voltage else "i"
    at, half = p.get(unit + "t", 0.0), abs(p.get(unit + "h", 0.0))
    if unit + "on" in p and unit + "off" in p:  # PSpice's spelling
        on_at, off_at = p[unit + "on"], p[unit + "off"]
        at, half = 0.5 * (on_at + off_at), 0.5 * abs(on_at - off_at)
    elif p.get(unit + "h", 0.0) < 0:
        ctx.remark(
            "W286",
            f".model `{e.model.name}`: {unit}h is negative, its magnitude is taken: on above {at + half:g}, "
            f"off below {at - half:g}",
            e.model.param_spans.get(unit + "h", e.model.span),
            f"ngspice makes it on already above {at - half:g} on the way up, off below {at + half:g} on the way down",
        )
    control = ctx.v(e.nodes[2], e.nodes[3]) if voltage else sum_of(ctx, controls(ctx, e)[0])
    if e.name not in ctx.flags:
        initial = {"on": 1, "off": 0}.get(e.extra.get("initial") or "", -1 if half == 0 else 0)
        down = control - (at - half) if half else None
        # of W's ON the operating point of ngspice knows nothing, only a start by UIC
        rest = -1 if half == 0 else int(voltage and initial == 1)
        ctx.flags[e.name] = ctx.b.flag(control - (at + half), down, e.name, initial, rest)
    on, off = 1.0 / (p.get("ron", 1.0) or LEAST_RESISTANCE), 1.0 / (p.get("roff", 0.0) or 1.0 / ctx.gmin)
    return ctx.b.select(ctx.flags[e.name], ctx.b.const(on), ctx.b.const(off)) * between(ctx, e)


# instance and model parameters that mean something, or that ngspice knows and nothing here depends on
_COMMON = "m temp dtemp tc1 tc2 tce scale noisy noise bv_max"
PARAMETERS = {
    "R": _COMMON + " ac l w r resistance",
    "C": _COMMON + " ic l w c cap capacitance",
    "L": _COMMON + " ic nt l ind inductance",
    "V": "m distof1 distof2 portnum z0 pwr freq phase",
    "I": "m distof1 distof2",
    "D": "m temp dtemp area pj ic off l w lm lp wm wp thermal",
    "S": "on off",
    "W": "on off",
    "K": "k",
    **dict.fromkeys("EFGHB", "m temp dtemp tc1 tc2 reciproctc reciprocm"),
}
LEFTOVERS = frozenset(("rser", "lser", "rpar", "cpar", "rlshunt", "noiseless"))  # of other SPICEs
MODEL_PARAMETERS = {
    "R": "r res rsh l w defw defl narrow dw short dlr tc1 tc2 tc1r tc2r tce tnom kf af wf lf ef bv_max",
    "C": "c cap cj cjsw l w defw defl narrow short tc1 tc2 tnom di thick bv_max",
    "L": "l ind tc1 tc2 tnom csect dia length nt mu",
    "S": "vt vh ron roff von voff",
    "W": "it ih ron roff ion ioff",
}

# parameters of .model D that change a current in ngspice and not here
MISSING_CURRENTS = {
    "isr": "a recombination current", "jtun": "a tunnel current", "jtunsw": "a tunnel current of the sidewall",
}  # fmt: skip

TABLE: dict[str, Kind] = {
    kind.letter: kind
    for kind in (
        Kind("R", "resistor", resistor, resistor_current, models=("r", "res")),
        Kind("C", "capacitor", capacitor, capacitor_current, models=("c", "cap"), dc="blocks"),
        Kind("L", "inductor", inductor, branch_current, models=("l", "ind"), branch=True, dc="shorts"),
        Kind("K", "mutual inductance", coupling, no_current, nodes=0),
        Kind("V", "voltage source", voltage_source, branch_current, branch=True, dc="shorts"),
        Kind("I", "current source", current_source, current_source_current, dc="drives"),
        Kind(
            "E",
            "voltage-controlled voltage source",
            controlled_voltage,
            branch_current,
            branch=True,
            dc="shorts",
        ),
        Kind(
            "F",
            "current-controlled current source",
            controlled_current,
            controlled_current_current,
            dc="drives",
        ),
        Kind(
            "G",
            "voltage-controlled current source",
            controlled_current,
            controlled_current_current,
            dc="drives",
        ),
        Kind(
            "H",
            "current-controlled voltage source",
            controlled_voltage,
            branch_current,
            branch=True,
            dc="shorts",
        ),
        Kind("B", "behavioural source", behavioural, behavioural_current, branch=True, dc="shorts"),
        Kind("S", "voltage-controlled switch", switch, switch_current, nodes=4, models=("sw", "vswitch")),
        Kind("W", "current-controlled switch", switch, switch_current, models=("csw", "iswitch")),
        Kind("D", "diode", diode, branch_current, models=("d",)),
    )
}


KINDS = {letter: kind for key, kind in TABLE.items() for letter in (key, key.lower())}


def dc_role(e: Element) -> str:
    """`dc` of the kind, or of the form a B source takes."""
    return KINDS[e.letter].dc if e.letter not in "Bb" or gives_voltage(e) else "drives"


def has_branch(e: Element) -> bool:
    return KINDS[e.letter].branch and (e.letter not in "Bb" or gives_voltage(e))

"""The cases of the stability atlas: a deck, what makes it hard, the criterion, and which methods must fail how.

`must` names methods that theory says cannot do the case, with the words that their failure may have (criteria.py). A
method not named there may pass or not; `auto` passes everywhere. METHODS are the columns: a name and its options.
"""

from __future__ import annotations

from .criteria import (
    DAMPED,
    DRIFTS,
    EXPLODES,
    RINGS,
    STOPS,
    agree,
    closed,
    ends,
    follows,
    horizon,
    kept,
    pendulum,
    refused,
    tank,
)

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from typing import Any

    import numpy as np

    from .criteria import Trial, Verdict

AUTO = "auto"
# `free` is the explicit method that lets closed loops go where they like
METHODS: dict[str, dict[str, Any]] = {
    "trap": {"method": "trap"},
    "gear": {"method": "gear", "maxord": 2},  # as in SPICE
    "radau": {"method": "radau"},
    "trbdf2": {"method": "trbdf2"},
    "esdirk": {"method": "esdirk"},
    "gauss": {"method": "gauss"},
    "rk45": {"method": "rk45"},
    "dop853": {"method": "dop853"},
    "free": {"method": "dop853", "projection": 0},
    AUTO: {"method": AUTO},
}
EXPLICIT = ("rk45", "dop853", "free")
SECOND = ("trap", "gear", "trbdf2")


class Case:
    """name    of the row
    deck     path below netlists/
    why      what makes it hard, in a line
    asked    the criterion in words
    judge    the criterion
    must     {method: words of the failure that theory asks for}
    defines, options   of the run; `options` hold for every method
    own      {method: options in place of those}
    steps    bound of a run
    slow     costs seconds
    """

    __slots__ = (
        "asked", "deck", "defines", "judge", "must", "name", "options", "own", "slow", "steps", "why",
    )  # fmt: skip

    def __init__(
        self, name: str, deck: str, why: str, asked: str, judge: Callable[[Trial], Verdict],
        must: Mapping[str, tuple[str, ...]], defines: Mapping[str, Any] | None = None, steps: int = 300_000,
        slow: bool = False, own: Mapping[str, Mapping[str, Any]] | None = None, **options: Any,
    ) -> None:  # fmt: skip
        self.name, self.deck, self.why, self.asked = name, deck, why, asked
        self.judge, self.must, self.defines = judge, dict(must), dict(defines or {})
        self.steps, self.slow, self.own, self.options = steps, slow, dict(own or {}), options


def fail(*words: str, by: tuple[str, ...]) -> dict[str, tuple[str, ...]]:
    return dict.fromkeys(by, words)


# ---- closed forms --------------------------------------------------------------------------------


def wave(amplitude: float, frequency: float, cosine: bool = False) -> Callable[[np.ndarray], np.ndarray]:
    def form(t: np.ndarray) -> np.ndarray:
        import numpy as np

        return amplitude * (np.cos if cosine else np.sin)(2 * np.pi * frequency * t)

    return form


def ramp_current(t: np.ndarray) -> np.ndarray:
    """-C dv/dt of ramp_capacitor."""
    import numpy as np

    return np.where((t > 1.0401e-3) & (t < 3.1401e-3), -1e-3, 0.0)


def low_pass(tau: float) -> Callable[[np.ndarray], np.ndarray]:
    """sin(pi t) behind a time constant, from rest."""

    def form(t: np.ndarray) -> np.ndarray:
        import numpy as np

        a = np.pi * tau
        return (np.sin(np.pi * t) - a * np.cos(np.pi * t) + a * np.exp(-t / tau)) / (1 + a * a)

    return form


def geared_speed(t: np.ndarray) -> np.ndarray:
    """omega(axle) of gear_ratio: L di/dt = V - R i - k w, J dw/dt = k i - b w with k = kt times the ratio."""
    import numpy as np

    v, r, el, k, j, b = 12.0, 2.0, 1e-6, 10e-3 * 1e4, 5 + 1e-7 * 1e8, 0.5
    a = np.array([[-r / el, -k / el], [k / j, -b / j]])
    rest = -np.linalg.solve(a, [v / el, 0.0])
    values, vectors = np.linalg.eig(a)
    weight = np.linalg.solve(vectors, -rest)
    return rest[1] + np.real(np.exp(np.outer(t, values)) @ (vectors[1] * weight))


def cutset_voltage(t: np.ndarray, l1: float = 1e-3, l2: float = 2e-3) -> np.ndarray:
    """v(a) of inductor_cutset."""
    one, two = wave(2e3 * 3.141592653589793, 1e3, True)(t), wave(2e3 * 3.141592653589793, 2e3, True)(t)
    return (l1 + l2) * one + l2 * two


def chopped(
    duty: float = 0.3, periods: int = 200, period: float = 50e-6, tau: float = 1e-3, v: float = 10.0
) -> float:
    """Inductor current of the PWM decks at the end of a period: exact maps between edges."""
    from math import exp

    i, on = 0.0, duty * period
    for _ in range(periods):
        i = v + (i - v) * exp(-on / tau)
        i *= exp(-(period - on) / tau)
    return i


PENDULUM = 2.367841947576237  # s, period of long_pendulum, by the elliptic integral
SWING = -0.498036362055429  # rad, angle(hinge) of vhf_beside_machine at 5 s: DOP853 at 1e-13
ROD = {
    "x": -0.4609449524562406,
    "y": -0.8874287299863094,
}  # m, rigid rod of 1 m from 0.5 rad at 5 s, the same

CASES = [
    Case(
        "ringing", "hard/ramp_capacitor.cir",
        "the current of a capacitor has no memory: the trapezoid's first error at a corner never leaves",
        "i(b1) = -C dv/dt within 1 % of its range",
        follows(0.01, ("i(b1)", ramp_current), behind=(0.0, 1.04e-3, 3.14e-3), settled=0.35e-3),
        {"trap": (RINGS,)} | fail(STOPS, by=EXPLICIT),
    ),
    *(
        Case(
            f"tank {label}", "paper/tank.cir",
            "BDF2 and SDIRK2 damp what does not decay, and every second-order method is late",
            "100 periods: amplitude within 1 %, phase within 0.01 period",
            kept(tank(f, c), 1 / f, 100),
            {"gear": (DAMPED,), "trap": (DRIFTS,), "trbdf2": (DAMPED, DRIFTS)},
            {"f": f, "cap": c}, reltol=1e-3,
        )
        for label, f, c in (("100 kHz", 1e5, 1e-8), ("400 kHz", 4e5, 1e-8), ("700 MHz", 7e8, 1e-12))
    ),
    Case(
        "pendulum", "hard/long_pendulum.cir",
        "the same for a swing of 90 degrees",
        "100 periods: amplitude within 1 %, phase within 0.01 period",
        kept(pendulum, PENDULUM, 100),
        {"gear": (DAMPED, DRIFTS), "trap": (DRIFTS,)}, reltol=1e-5,
    ),
    Case(
        "energy 1e5 periods", "hard/long_pendulum.cir",
        "a loss of 1e-7 a period is 1 % here; every method at 16 steps a period, auto at its own",
        "amplitude within 1 % after 100 000 periods",
        kept(pendulum, PENDULUM, 100_000, phase=float("inf")),
        fail(DAMPED, DRIFTS, by=("gear", "radau", "trbdf2", "esdirk", "rk45")), {"n": 100_000, "shown": 10},
        steps=3_000_000, slow=True, own={AUTO: {"reltol": 1e-6}}, fixed_step=PENDULUM / 16,
    ),
    Case(
        "1 ns beside 1 s", "hard/step_collapse.cir",
        "an explicit method resolves 1 ns for four seconds",
        "both low-passes within 0.1 % of the closed form",
        follows(1e-3, ("v(a)", low_pass(1e-9)), ("v(b)", low_pass(1.0))),
        fail(STOPS, by=EXPLICIT), reltol=1e-5,
    ),
    Case(
        "stiff Van der Pol", "hard/stiff_van_der_pol.cir",
        "stiffness comes and goes by 1e6 in one run",
        "y, y' at t = 2000 within 1e-3 (Test Set for IVP Solvers)",
        ends(1e-3, v_y=1.706167732170469, v_z=-8.928097010248e-4),
        fail(STOPS, by=EXPLICIT), reltol=1e-6,
    ),
    Case(
        "drift 1000 s", "hard/four_bar_1000s.cir",
        "a loop that is kept closed only in its second derivative opens as t^2",
        "closed to 1 um, energy within 0.1 %",
        closed(1e-6, 1e-3),
        {"free": (DRIFTS, EXPLODES)} | fail(DAMPED, DRIFTS, by=SECOND), reltol=1e-5, slow=True,
    ),
    Case(
        "change points", "hard/change_point.cir",
        "a parallelogram folds into a second branch where its bars are in line",
        "both cranks parallel within 1e-3 rad over a turn",
        agree(1e-3, "angle(a)", "angle(d)", 6.3),
        {"free": (DRIFTS, DAMPED, EXPLODES, STOPS)}, reltol=1e-7,
    ),
    Case(
        "2 windows", "mechanical/ref_n_four_bar.cir",
        "closure rows lose rank twice a turn, each window can fold its own way",
        "angle(p0) at 10 s within 1e-4 of 31.7506 (binary128)",
        ends(1e-4, angle_p0=-31.75059718698610182),
        {"free": (DRIFTS, EXPLODES, STOPS)}, reltol=1e-6,
    ),
    Case(
        "40 windows", "mechanical/ref_n_four_bar_40.cir",
        "the same with 81 bodies and 80 closure rows",
        "angle(p0) at 20 s within ten times the tolerance of 63.2553 (binary128)",
        ends(1e-2, angle_p0=-63.25529536819092804),
        {"free": (DRIFTS, EXPLODES, STOPS)} | fail(DRIFTS, by=("trap", "gear")), reltol=1e-3, slow=True,
    ),
    Case(
        "mass ratio 1e12", "hard/mass_ratio.cir",
        "a bead's mode of 2 MHz in the spring of a kilogram at 1 Hz",
        "x = cos(2 pi t) within 1 % over 10 s",
        follows(0.01, ("pos(jm)", wave(1, 1, True)), ("pos(jb)", wave(0.5, 1, True))),
        fail(STOPS, by=EXPLICIT), reltol=1e-5,
    ),
    Case(
        "gear 1e4, rotor 1e-7", "hard/gear_ratio.cir",
        "a winding of 0.5 us, an axle of 3 ms, a run of 2 s",
        "omega(axle) within 0.1 % of the matrix exponential",
        follows(1e-3, ("omega(axle)", geared_speed)),
        fail(STOPS, by=EXPLICIT), reltol=1e-5,
    ),
    Case(
        "chaos", "hard/chaos.cir",
        "errors grow e-fold in a few tenths of a second: the horizon is bought digit by digit",
        "predictable for 16 s at reltol 1e-8",
        horizon(16.0, 1e-10),
        fail(DRIFTS, STOPS, by=SECOND), reltol=1e-8, steps=1_000_000,
    ),
    Case(
        "capacitor loop", "hard/capacitor_loop.cir",
        "index 2: the source's current is a derivative",
        "v(b) within 0.1 %, i(b1) within 3 % of the closed form",
        follows(0.03, ("v(b)", wave(0.25, 1e3)), ("i(b1)", wave(-2.75e-6 * 2e3 * 3.141592653589793, 1e3, True)), settled=1e-4),
        fail(STOPS, by=EXPLICIT),
    ),
    Case(
        "inductor cutset", "hard/inductor_cutset.cir",
        "index 2: the voltage is a derivative",
        "v(a) within 3 % of the closed form",
        follows(0.03, ("v(a)", cutset_voltage), settled=1e-4),
        fail(STOPS, by=EXPLICIT),
    ),
    Case(
        "floating load", "hard/floating_load.cir",
        "a charge between two nodes drowns what they have in common: C/h against the leakage of diodes that are off",
        "v(p), v(n) and the coil's current at 49 ms within ten times the tolerance",
        ends(1e-5, v_p=-0.535508707927, v_n=-14.248928806111, i_l1=-0.980974170361),
        fail(STOPS, by=EXPLICIT), reltol=1e-6,
    ),
    *(
        Case(
            f"gain {label}", "hard/gain_loop.cir",
            "a controlled source takes the capacitor away: the time constant, then the state",
            "v(a) = v(in) within 0.1 %",
            follows(1e-3, ("v(a)", wave(1, 1e3)), settled=1e-5),
            fail(STOPS, by=EXPLICIT), {"g": g}, reltol=1e-3,
        )
        for label, g in (("1 - 1e-9", "0.999999999"), ("1", "1"))
    ),
    Case(
        "PWM, blind", "hard/pwm_blind.cir",
        "800 edges hidden in a tanh: found by rejected steps, or missed; pwm_known.cir has them as corners of a source",
        "i(l1) within 0.1 % of the maps between edges",
        ends(1e-3, i_l1=chopped()), {"trap": (DRIFTS,), "gear": (DRIFTS,)}, reltol=1e-4,
    ),
    Case(
        "700 MHz, decays", "hard/vhf_beside_machine.cir",
        "a tank rings down in a microsecond, a pendulum swings for five seconds",
        "angle(hinge) at 5 s within 1e-3",
        ends(1e-3, angle_hinge=SWING), fail(STOPS, by=EXPLICIT), {"r": 1}, reltol=1e-5,
    ),
    Case(
        "700 MHz, persists", "hard/vhf_beside_machine.cir",
        "without a loss it asks for 1e10 steps; who insists on a step of 1 ms damps it, rings or explodes",
        "refused, with an estimate of at least 1e9 steps (auto); it must not be damped",
        refused(1e9, "v(a)"),
        {"trap": (DAMPED, RINGS)} | fail(DAMPED, by=("gear", "radau", "trbdf2", "esdirk"))
        | fail(EXPLODES, STOPS, by=EXPLICIT),
        {"r": "1n"}, steps=10_000_000, own={AUTO: {}}, fixed_step=1e-3,
    ),
    Case(
        "diode overflow", "hard/diode_overflow.cir",
        "exp(v/0.026) of a guess a few volts off is beyond all numbers; while it conducts, its time constant is 1e-10 s",
        "v(b) at 3 ms within 1e-4 of the converged run",
        ends(1e-4, v_b=95.0888230), fail(STOPS, EXPLODES, by=EXPLICIT), reltol=1e-5,
    ),
    Case(
        "four-bar 1e-11", "mechanical/ref_four_bar.cir",
        "multipliers that are scaled badly stop a run at tight tolerances",
        "angle(a) at 5 s within 1e-9 (binary128)",
        ends(1e-9, angle_a=67.7827215012255971), fail(STOPS, DRIFTS, by=SECOND), reltol=1e-11,
    ),
    Case(
        "Andrews 1e-11", "mechanical/ref_andrews_squeezer.cir",
        "the same with seven bodies and three loops at one point",
        "angle(beta) at 30 ms within 1e-10 (binary128)",
        ends(1e-10, angle_beta=15.810771195153707097), fail(STOPS, DRIFTS, by=SECOND), reltol=1e-11,
    ),
    Case(
        "hard constraint", "hard/rod.cir",
        "a pendulum on a pin: no mode but its own; the second order pays for each digit all the same",
        "x, y at 5 s within ten times the tolerance",
        ends(1e-5, v_x=ROD["x"], v_y=ROD["y"]), fail(DRIFTS, by=("trap", "gear")), reltol=1e-6,
    ),
    *(
        Case(
            f"soft constraint {k}", "hard/stiff_rod.cir",
            "the pin's rod as a spring of this stiffness: a mode of no interest, faster than the step",
            "x, y at 5 s within 1e-4 of the pin's, in 50 000 steps",
            ends(1e-4, v_x=ROD["x"], v_y=ROD["y"]), fail(STOPS, by=EXPLICIT), {"k": k}, steps=50_000, reltol=1e-6,
        )
        for k in ("1e9", "1e12")
    ),
]  # fmt: skip

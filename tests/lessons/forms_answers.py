"""What the answers to the lessons' exercises must show. Formulas only; nothing here asks emsim."""

from __future__ import annotations

from collections.abc import Iterator
from math import acos, atan, cos, exp, log, log10, pi, radians, sqrt

import forms_control
import forms_couplings
import forms_numerics
import numpy as np
from forms_circuits import second_order
from pages import Figure, Runs, answers, crossing, peak
from scipy.linalg import expm
from scipy.optimize import brentq


def integral(run, values) -> float:
    """Over time, by straight lines between rows."""
    t = np.asarray(run.time)
    return float(np.sum((values[1:] + values[:-1]) / 2 * np.diff(t)))


def heat(run, name: str) -> float:
    return next(x.dissipated for x in run.energy.lines if x.name == name)


@answers("01_rc", step="10u")
def rc(runs: Runs) -> Iterator[Figure]:
    v, c, tau, stop = 5.0, 1e-6, 1e-3, 5e-3
    ramp = runs.edit(1)
    yield Figure("behind", v / stop * tau * (1 - exp(-stop / tau)), v - ramp["v(out)"][-1])
    # R i^2 with i = C V/T (1 - exp(-t/tau))
    x = stop / tau
    made = c * v**2 / x**2 * (x - 2 * (1 - exp(-x)) + (1 - exp(-2 * x)) / 2)
    yield Figure("heat_ramp", made, heat(ramp, "r1"))
    yield Figure("t_one", tau * log(5), crossing(runs.edit(2), "v(out)", 1.0))
    bode, ten = runs.edit(3), 10 / (2 * pi * tau)
    yield Figure("ten", ten)
    f = bode["frequency"]
    yield Figure("db_ten", -10 * log10(101), float(np.interp(ten, f, bode["vdb(out)"])), rel=2e-3)
    yield Figure("ph_ten", -atan(10), float(np.interp(ten, f, bode["vp(out)"])), rel=2e-3)


@answers("02_resonance", step="2u")
def resonance(runs: Runs) -> Iterator[Figure]:
    r, ind, c = 20.0, 10e-3, 1e-6
    wn, q = 1 / sqrt(ind * c), sqrt(ind / c) / r
    f0 = wn / (2 * pi)
    bode = runs.edit(1)
    f, size = bode["frequency"], np.abs(bode["i(l1)"])
    top, middle = int(np.argmax(size)), f0 * sqrt(1 + 1 / (4 * q * q))
    low = float(np.interp(sqrt(0.5) / r, size[:top], f[:top]))
    high = float(np.interp(-sqrt(0.5) / r, -size[top:], f[top:]))
    yield Figure("f_low", middle - f0 / (2 * q), low)
    yield Figure("f_high", middle + f0 / (2 * q), high)
    yield Figure("width", f0 / q, high - low)

    step = runs.edit(2)
    wd, _ = second_order(wn, 1 / (2 * q))
    first = peak(step, "v(b)")[1] - 1
    second = peak(step, "v(b)", 2 * pi / wd, 4 * pi / wd)[1] - 1
    delta = -log(second / first)
    yield Figure("q_seen", q, sqrt(4 * pi**2 + delta**2) / (2 * delta), rel=5e-3)

    twice = runs.edit(3)
    yield Figure("q_ten", 2 * q, peak(twice, "v(b)", 19e-3)[1], rel=2e-3)
    # what is missing of the swing's end shrinks with the envelope
    t1, t2 = (peak(twice, "v(b)", t, t + 0.7e-3) for t in (1e-3, 3e-3))
    yield Figure("t_env", 4 * ind / r, (t2[0] - t1[0]) / log((2 * q - t1[1]) / (2 * q - t2[1])), rel=0.02)


@answers("03_mass_spring", step="1m")
def mass_spring(runs: Runs) -> Iterator[Figure]:
    force, m, k, c = 1.0, 0.1, 40.0, 0.4
    five = m * (2 * pi * 5) ** 2
    yield Figure("k_five", five)
    wd, _ = second_order(2 * pi * 5, c / (2 * sqrt(five * m)))
    yield Figure("t_five", pi / wd, peak(runs.edit(1), "pos(rail)")[0])

    long = runs.edit(2)
    wn, zeta = sqrt(k / m), c / (2 * sqrt(k * m))
    wd, _ = second_order(wn, zeta)
    a, b = (peak(long, "pos(rail)", (n - 0.5) * pi / wd, (n + 0.5) * pi / wd) for n in (1, 9))
    rate = log((a[1] * k / force - 1) / (b[1] * k / force - 1)) / (b[0] - a[0])
    yield Figure("t_percent", 2 * m / c * log(100), log(100) / rate, rel=2e-3)
    yield Figure("work", force**2 / k, force * long["pos(rail)"][-1], rel=2e-3)
    yield Figure("heat", force**2 / (2 * k), heat(long, "d"), rel=2e-3)
    yield Figure("heat_strong", force**2 / (2 * k), heat(runs.edit(3), "d"), rel=2e-3)


@answers("04_motor", step="1m")
def motor(runs: Runs) -> Iterator[Figure]:
    v, k, r, j = 6.0, 0.05, 1.0, 1e-4
    t_m, run = r * j / k**2, runs.base
    power = run["torque(m1)"] * run["omega(shaft)"]
    at = int(np.argmax(power))
    yield Figure("half_speed", v / k / 2, float(run["omega(shaft)"][at]), rel=0.03)
    yield Figure("p_most", v**2 / (4 * r), float(power[at]))
    yield Figure("t_most", t_m * log(2), crossing(run, "omega(shaft)", v / k / 2))

    bode = runs.edit(1)
    f, db = bode["frequency"], bode["db(omega(shaft))"]
    yield Figure("flat", 20 * log10(1 / k), float(db[0]), rel=1e-3)
    yield Figure("corner", 1 / (2 * pi * t_m), float(np.interp(10 * log10(2), db[0] - db, f)), rel=5e-3)

    brake = runs.edit(2)
    yield Figure("t_brake", 2 * t_m, crossing(brake, "omega(shaft)", 120 * exp(-1)))
    yield Figure("angle", 120 * 2 * t_m, brake["angle(shaft)"][-1])


@answers("05_gear", step="5m")
def gear(runs: Runs) -> Iterator[Figure]:
    tau, jm, jl, n, weight = 0.02, 1e-4, 2.5e-3, 5.0, 0.05
    alpha = n * tau / (jl + n * n * jm)
    yield Figure("t_turn", sqrt(4 * pi / alpha), crossing(runs.base, "angle(slow)", 2 * pi))
    best = sqrt(jl / (4 * jm))
    yield Figure("n_heavy", best)
    yield Figure("alpha_heavy", best * tau / (jl + best**2 * 4 * jm), runs.edit(1)["omega(slow)"][-1])
    a = weight / tau
    yield Figure("n_least", a)
    best = a + sqrt(a * a + jl / jm)
    yield Figure("n_weight", best)
    yield Figure("alpha_weight", (best * tau - weight) / (jl + best**2 * jm), runs.edit(2)["omega(slow)"][-1])
    yield Figure("alpha_five", (n * tau - weight) / (jl + n * n * jm), runs.edit(3)["omega(slow)"][-1])


@answers("06_pot", step="5m")
def pot(runs: Runs) -> Iterator[Figure]:
    v, r, rl = 10.0, 10e3, 100e3
    a = np.linspace(0.0, 1.0, 100001)
    inner = a * (1 - a) * r
    up = (a + inner / rl) / (
        1 + inner / rl
    ) - a  # source and inner resistance (Thévenin), load to the upper end
    at, height = peak(runs.edit(1), "v(err)", sign=-1)
    k = int(np.argmax(up))
    yield Figure("most", float(up[k]), -height / 100)
    yield Figure("a_most", float(a[k]), runs.edit(1).at("v(a)", at), rel=0.01)
    both = a - (a + inner / rl) / (1 + 2 * inner / rl)
    two = runs.edit(2)
    yield Figure("middle", 0.0, abs(two.at("v(err)", (0.5 - 0.02) / 0.96)) / 100, off=1e-6)
    yield Figure("most_two", float(np.max(both)), peak(two, "v(err)")[1] / 100)
    below = 1 / (1 / 5e3 + 1 / 10e3)
    yield Figure("r_below", below)
    yield Figure("i_free", v / r)
    drawn = -runs.edit(3).at("i(vref)", (0.5 - 0.02) / 0.96)
    yield Figure("i_pot", v / (5e3 + below), drawn - v / r)


@answers("07_energy", step="5m")
def energy(runs: Runs) -> Iterator[Figure]:
    m, length, g, d, k, r = 0.5, 0.6, 9.81, 0.01, 0.3, 1.0
    j, start = m * length**2 / 3, m * g * length / 2
    load = r * sqrt(1 + k**2 / (d * r))
    share = load * (k / (r + load)) ** 2 / (d + k**2 / (r + load))
    best = runs.edit(1)
    yield Figure("r_best", load)
    yield Figure("heat_best", share * start, heat(best, "rload"), rel=2e-3)
    yield Figure("share_best", share, heat(best, "rload") / best.energy.dissipated)

    small = 2 * pi * sqrt(j / start)
    theta = brentq(lambda x: 1 / forms_couplings.agm(1.0, cos(x / 2)) - 1.01, 0.1, 1.0)
    yield Figure("theta", theta)
    free = runs.edit(2)
    first = crossing(free, "angle(hinge)", 0.0)
    later = crossing(free, "angle(hinge)", 0.0, first + 0.75 * small)
    yield Figure("period_one", 1.01 * small, later - first)

    top = runs.edit(3)
    yield Figure(
        "bottom_top",
        sqrt(3 * g / length * (1 - cos(radians(179)))),
        float(np.max(np.abs(top["omega(hinge)"]))),
    )
    # a quarter of the period from there
    quarter = small / 4 / forms_couplings.agm(1.0, cos(radians(179) / 2))
    yield Figure("t_bottom", quarter, crossing(top, "angle(hinge)", 0.0))


@answers("08_stiffness")
def stiffness(runs: Runs) -> Iterator[Figure]:
    yield Figure("steps", 1e-3 / (3.3066 * 10e-9), runs.edit(1).stats["steps"], rel=0.03)
    k, r, ind, j = 0.05, 1.0, 0.5e-3, 1e-4
    slow = -1 / max(np.linalg.eigvals(np.array([[-r / ind, -k / ind], [k / j, 0.0]])).real)
    yield Figure("slow", float(slow))
    yield Figure("ratio", float(slow) / 1e-9)


@answers("09_drift")
def drift(runs: Runs) -> Iterator[Figure]:
    n = sqrt(20 * 360 / 12) * 2 * pi
    yield Figure("n_trap", n)
    theta = 2 * pi / 154
    lag = 20 * 154 * (theta - 2 * atan(theta / 2))
    yield Figure("lag_one", lag, -forms_numerics.swing(runs.edit(1), 20.0)[1], rel=5e-3)
    theta = 2 * pi * 12.5e-3
    root = min(np.roots([1.5 - 1j * theta, -2.0, 0.5]), key=lambda z: abs(z - np.exp(1j * theta)))
    left, gear = abs(root) ** (19 / 12.5e-3), runs.edit(2)
    seen = forms_numerics.swing(gear, 20.0)[0] / forms_numerics.swing(gear, 1.0)[0]
    yield Figure("size_half", left, seen)
    yield Figure("loss_half", 1 - left, 1 - seen, rel=5e-3)


@answers("10_constraint")
def constraint(runs: Runs) -> Iterator[Figure]:
    h = (1.1**2 - 1) / 2 * (1 + 5) * exp(-5)
    yield Figure("off", sqrt(1 + 2 * h) - 1, runs.edit(1).at("v(h)", 0.5) / 1000, rel=5e-3)
    small = 2 * pi * sqrt(1 / 9.81)
    period = small / forms_couplings.agm(1.0, sqrt(0.5))
    run = runs.edit(2)
    # the state after ten whole periods is that of the start
    yield Figure("period", period, None)
    assert run.at("x(bob.com)", 10 * period) > 1 - 1e-3
    yield Figure("small", small)
    yield Figure("longer", period / small - 1)


@answers("11_linkage", step="1m")
def linkage(runs: Runs) -> Iterator[Figure]:
    n = forms_numerics
    yield Figure("a_longest", n.GROUND + n.ROCKER - n.COUPLER)
    long = runs.edit(1)
    ends = [
        acos((n.GROUND**2 + n.ROCKER**2 - d**2) / (2 * n.GROUND * n.ROCKER))
        for d in (n.COUPLER + 0.17, n.COUPLER - 0.17)
    ]
    yield Figure("swing_long", ends[0] - ends[1], float(np.ptp(long["angle(rocker)"])), rel=2e-3)

    w, g = 2 * pi, 9.81
    angles = np.linspace(0.0, 2 * pi, 2001)

    def height(q: float) -> float:
        """Of all bars, weighted with their masses."""
        coupler, rocker = n.pose(q)
        tip = n.CRANK * np.sin(q)
        parts = (
            (n.CRANK, tip / 2),
            (n.COUPLER, tip + n.COUPLER / 2 * np.sin(coupler)),
            (n.ROCKER, n.ROCKER / 2 * np.sin(rocker)),
        )
        return sum(n.MASSES[bar] * y for bar, y in parts)

    spin = np.gradient([n.inertia(q) for q in angles], angles) / 2
    lift = g * np.gradient([height(q) for q in angles], angles)
    up = runs.edit(2)
    yield Figure("torque_up", float(np.max(w**2 * spin + lift)), max(up["torque(turn)"]), rel=3e-3)
    yield Figure("torque_mean", 0.0, abs(integral(up, up["torque(turn)"])), off=1e-4)
    yield Figure("torque_twice", float(np.max(4 * w**2 * spin)), max(runs.edit(3)["torque(turn)"]), rel=3e-3)


@answers("12_position", step="10m")
def position(runs: Runs) -> Iterator[Figure]:
    c = forms_control
    kt, ke, r, ind, lc, d = c.KT, c.KE, c.R, c.L, c.CENTRE, 5e-3
    j, weight = 1 / 3 + 9e-6, c.G * lc

    def slow(kp: float, ind: float = ind, d: float = 0.0) -> complex:
        cubic = [ind * j, r * j + ind * d, ind * weight + kt * ke + r * d, r * weight + kt * kp * lc]
        return next(z for z in np.roots(cubic) if z.imag > 0)

    old = r * ke / (ind * lc)
    rubbed = ((r * j + ind * d) * (ind * weight + kt * ke + r * d) / (ind * j) - r * weight) / (kt * lc)
    yield Figure("limit_d", rubbed)
    yield c.left("left_d", runs.edit(1), slow(old, d=d).real)
    yield Figure("limit_l", 2 * old)
    yield c.left("left_l", runs.edit(2), slow(80.0, ind / 2).real)
    # kt V/r = W sin, V = kp (0.1 - lc sin)
    kp = 45.0
    sine = kt * kp * 0.1 / r / (weight + kt * kp * lc / r)
    rest = runs.edit(3)
    late = rest.time > 200 - 20 * 2 * pi / slow(kp).imag
    yield Figure("x_rest", lc * sine, float(np.mean(rest["x(arm.com)"][late])), rel=5e-3)


@answers("13_pwm", step="1u")
def pwm(runs: Runs) -> Iterator[Figure]:
    v, d, f, r, ind, mean = 12.0, 0.5, 2e3, 1.0, 1e-3, 2.0
    yield Figure("f_small", v * d * (1 - d) / (ind * 0.1))

    def ripple(f: float, ind: float) -> float:
        high, low = forms_control.pulsed(v, d, 1 / f, r, ind)
        return high - low

    yield Figure("ripple_small", ripple(30e3, ind), float(np.ptp(runs.edit(1)["i(m1)"])), rel=0.02)
    yield Figure("ripple_half", ripple(f, 2 * ind), float(np.ptp(runs.edit(2)["i(m1)"])), rel=0.01)
    saw, run = ripple(f, ind) ** 2 / 12, runs.base
    i, span = run["i(m1)"], run.time[-1] - run.time[0]
    square, middle = integral(run, i * i) / span, integral(run, i) / span
    yield Figure("heat_saw", saw, square - middle**2, rel=0.01)
    yield Figure("heat_mean", mean**2 * r)
    yield Figure("heat_share", saw / mean**2, (square - middle**2) / middle**2, rel=0.02)


@answers("14_cart_pole", step="10m")
def balance(runs: Runs) -> Iterator[Figure]:
    c = forms_control
    gains = c.placed([-2, -2, -3, -3])
    for key, gain, written in zip(
        ("kx", "kv", "ka", "kw"), gains, (0.4037, 2.673, -7.665, -1.3691), strict=True
    ):
        yield Figure(key, gain, written)
    start = np.array([0.0, 0.0, 2 * pi / 180, 0.0])

    def furthest(gains: tuple[float, ...]) -> float:
        matrix = c.cart_pole(*gains)
        return float(max(abs((expm(matrix * t) @ start)[0]) for t in np.arange(0.0, 6.0, 0.01)))

    yield Figure("x_most", furthest(gains), float(np.max(np.abs(runs.edit(1)["pos(rail)"]))), rel=0.01)
    yield Figure(
        "x_deck",
        furthest(c.placed([-3, -4, -5, -6])),
        float(np.max(np.abs(runs.base["pos(rail)"]))),
        rel=0.01,
    )
    values, vectors = np.linalg.eig(c.cart_pole(0, 0, 0, 0).T)
    k = int(np.argmax(values.real))
    grow, mode = values[k].real, vectors[:, k].real
    push = np.array([0.0, c.J_POLE, 0.0, c.MA]) * c.PER_VOLT / c.D
    yield Figure("lean", abs(mode @ push) * 1.0 / (grow * abs(mode[2])))
    yield Figure("falls", None, float(np.max(np.abs(runs.edit(2)["angle(hinge)"]))))

"""What lessons 12 to 14 must show: position control, pulse-width modulation, a balanced pole."""

from __future__ import annotations

from collections.abc import Iterator
from math import exp, pi

import numpy as np
from pages import Figure, Runs, crossing, lesson, peak
from scipy.linalg import expm

KT, KE, R, L, G = 0.124, 0.145, 1.86, 8.65e-3, 9.80665
CENTRE = 0.5  # of the rod of 1 m


def loop(kp: float, r: float = R, m: float = 1.0) -> tuple[complex, float]:
    """Roots of L J s^3 + R J s^2 + (L W + Kt Ke) s + R W + Kt Kp lc: the swinging one and the fast one."""
    j, weight = m / 3 + 9e-6, m * G * CENTRE
    roots = np.roots([L * j, r * j, L * weight + KT * KE, r * weight + KT * kp * CENTRE])
    return next(z for z in roots if z.imag > 0), next(z.real for z in roots if z.imag == 0)


def left(key: str, run, rate: float) -> Figure:
    """The last swing of 200 s, in parts of the 2 degrees of the start."""
    when, height = peak(run, "angle(hinge)", 198.0, 199.9)
    return Figure(key, exp(when * rate), height / (2 * pi / 180), rel=5e-3)


@lesson("12_position", step="10m")
def position(runs: Runs) -> Iterator[Figure]:
    limit = R * KE / (L * CENTRE)
    yield Figure("limit", limit)
    slow, fast = loop(45.0)
    run = runs.base
    first = crossing(run, "angle(hinge)", 0.0, rising=True)
    later = crossing(run, "angle(hinge)", 0.0, first + 9.5 * 2 * pi / slow.imag, rising=True)
    yield Figure("period", 2 * pi / slow.imag, (later - first) / 10)
    yield Figure("rate", slow.real)
    yield Figure("fast", fast)
    yield left("left", run, slow.real)
    assert any(d.code == "N401" for d in run.diagnostics)
    yield Figure("centre", CENTRE)

    above, _ = loop(80.0)
    yield Figure("rate_80", above.real)
    yield left("left_80", runs.edit(1), above.real)
    yield left("left_limit", runs.edit(2), loop(limit)[0].real)
    j, weight = 1 / 3 + 9e-6, G * CENTRE
    yield Figure("period_limit", 2 * pi / np.sqrt(weight / j + KT * KE / (L * j)))
    yield Figure("limit_r", 2 * limit)
    yield left("left_r", runs.edit(3), loop(80.0, r=2 * R)[0].real)
    yield left("left_m", runs.edit(4), loop(80.0, m=4.0)[0].real)
    yield Figure("t_e", L / R)


def pulsed(v: float, d: float, period: float, r: float, ind: float) -> tuple[float, float]:
    """Highest and lowest current of a winding on pulses, less what its mean back-EMF takes: periodic steady state."""
    on, off = exp(-d * period * r / ind), exp(-(1 - d) * period * r / ind)
    high = v / r * (1 - on) / (1 - on * off)
    return high, high * off


@lesson("13_pwm", step="2u")
def pwm(runs: Runs) -> Iterator[Figure]:
    v, d, f, k, r, ind, j, load = 12.0, 0.5, 2e3, 0.05, 1.0, 1e-3, 1e-4, 0.1
    i_mean = load / k
    w = (d * v - r * i_mean) / k

    def mean(run, name: str) -> float:
        t, y = run.time, run[name]
        return float(np.sum((y[1:] + y[:-1]) / 2 * np.diff(t)) / (t[-1] - t[0]))

    run = runs.base
    yield Figure("v_mean", d * v, mean(run, "v(a)"), rel=2e-3)
    yield Figure("i_mean", i_mean, mean(run, "i(m1)"), rel=5e-3)
    yield Figure("w", w, mean(run, "omega(shaft)"), rel=3e-3)
    high, low = pulsed(v, d, 1 / f, r, ind)
    ripple = high - low
    yield Figure("ripple", ripple, float(np.ptp(run["i(m1)"])), rel=5e-3)
    yield Figure("rule", v * d * (1 - d) / (f * ind))
    yield Figure("i_high", high - k * w / r, max(run["i(m1)"]), rel=5e-3)
    yield Figure("i_low", low - k * w / r, min(run["i(m1)"]), rel=0.01)
    # half a period of a triangle of torque, its surplus being ripple/2 high
    yield Figure("w_ripple", k * ripple / (8 * f * j), float(np.ptp(run["omega(shaft)"])), rel=0.03)
    yield Figure("t_e", ind / r)
    yield Figure("t_m", r * j / k**2)
    yield Figure("period", 1 / f)
    yield Figure("per_second", f)
    yield Figure("v_drop", r * i_mean)
    # the rotor of 40 ms against pulses of half a millisecond
    yield Figure("w_share", k * ripple / (8 * f * j) / w, float(np.ptp(run["omega(shaft)"])) / w, rel=0.03)

    more = runs.edit(1)
    yield Figure("w_more", (0.75 * v - r * i_mean) / k, mean(more, "omega(shaft)"), rel=3e-3)
    high, low = pulsed(v, 0.75, 1 / f, r, ind)
    yield Figure("ripple_more", high - low, float(np.ptp(more["i(m1)"])), rel=0.01)

    fast = runs.edit(2)
    high, low = pulsed(v, d, 0.1 / f, r, ind)
    yield Figure("ripple_fast", high - low, float(np.ptp(fast["i(m1)"])), rel=0.02)

    idle = runs.edit(3)
    yield Figure("i_idle", 0.0, mean(idle, "i(m1)"), off=0.02)
    yield Figure("i_back", None, -min(idle["i(m1)"]))
    yield Figure("w_idle", d * v / k, mean(idle, "omega(shaft)"), rel=5e-3)

    diode = runs.edit(4)
    yield Figure("w_diode", None, mean(diode, "omega(shaft)"))
    yield Figure("w_top", v / k)
    yield Figure("i_diode", 0.0, min(diode["i(m1)"]), off=1e-3)
    yield Figure("d_still", r * i_mean / v)


M_POLE, ARM, M_ALL, G_EARTH = 0.2, 0.3, 0.7, 9.81
J_POLE = M_POLE * 0.6**2 / 3
MA = M_POLE * ARM
D = M_ALL * J_POLE - MA**2
PER_VOLT = 0.03 / 0.015  # newton per volt of the motor at rest, and the volts a metre per second takes back


def cart_pole(kx: float, kv: float, ka: float, kw: float) -> np.ndarray:
    """x, v, angle, omega near upright: M v' - m a w' = F, J w' - m a v' = m g a angle, F = 2 (V - 2 v)."""
    gains = PER_VOLT * np.array([kx, kv - PER_VOLT, ka, kw])
    out = np.zeros((4, 4))
    out[0, 1] = out[2, 3] = 1.0
    out[1] = J_POLE * gains / D
    out[3] = MA * gains / D
    out[1, 2] += MA**2 * G_EARTH / D
    out[3, 2] += M_ALL * MA * G_EARTH / D
    return out


def placed(poles: list[float]) -> tuple[float, float, float, float]:
    """Gains that make the characteristic polynomial the one with these roots: coefficients compared."""
    _, b3, b2, b1, b0 = np.poly(poles)
    weight = MA * G_EARTH
    fx, fv = b0 * D / weight, b1 * D / weight
    fa = -(b2 * D + M_ALL * weight + J_POLE * fx) / MA
    fw = -(b3 * D + J_POLE * fv) / MA
    return fx / PER_VOLT, fv / PER_VOLT + PER_VOLT, fa / PER_VOLT, fw / PER_VOLT


@lesson("14_cart_pole", step="10m")
def balance(runs: Runs) -> Iterator[Figure]:
    gains = placed([-3, -4, -5, -6])
    for key, gain, written in zip(
        ("kx", "kv", "ka", "kw"), gains, (4.037, 5.835, -18.14, -3.514), strict=True
    ):
        yield Figure(key, gain, written)
    start = np.array([0.0, 0.0, 2 * pi / 180, 0.0])

    def linear(matrix: np.ndarray, dt: float = 5e-3) -> np.ndarray:
        """The states of the linear equations every dt for three seconds."""
        step, state, states = expm(matrix * dt), start, [start]
        for _ in range(round(3.0 / dt)):
            state = step @ state
            states.append(state)
        return np.array(states)

    run = runs.base
    yield Figure("v_start", gains[2] * start[2], run["v(drive)"][0])
    path = linear(cart_pole(*gains))
    yield Figure("travel", float(-min(path[:, 0])), -min(run["pos(rail)"]), rel=5e-3)
    yield Figure("beyond", float(-min(path[:, 2])), -min(run["angle(hinge)"]), rel=5e-3)
    yield Figure("angle_end", 0.0, run["angle(hinge)"][-1], off=4e-4)
    force = PER_VOLT * float(gains[2] * start[2])
    yield Figure("force", force, 2 * run["i(m1)"][0])
    # left alone: the one growing mode of the open loop, the motor's brake included
    values, vectors = np.linalg.eig(cart_pole(0, 0, 0, 0).T)
    k = int(np.argmax(values.real))
    grow, mode = values[k].real, vectors[:, k].real
    yield Figure("grow", grow)
    yield Figure("arm", ARM)
    yield Figure("m_all", M_ALL)
    yield Figure("j_pole", J_POLE)
    yield Figure("double", np.log(2) / grow)

    wander = runs.edit(1)
    end = linear(cart_pole(0.0, PER_VOLT, gains[2], gains[3]))[-1]
    yield Figure("x_wander", -end[0], -wander["pos(rail)"][-1], rel=5e-3)
    yield Figure("v_wander", -end[1], -wander["vel(rail)"][-1], rel=5e-3)
    yield Figure("angle_wander", 0.0, wander["angle(hinge)"][-1], off=4e-4)

    # b3 b2 b1 > b1^2 + b3^2 b0 of Hurwitz, with b2 the only one that ka moves
    b3, b1, b0 = 18.0, 342.0, 360.0
    b2 = (b1**2 + b3**2 * b0) / (b3 * b1)
    least = -(b2 * D + M_ALL * MA * G_EARTH + J_POLE * PER_VOLT * gains[0]) / MA / PER_VOLT
    yield Figure("ka_limit", least)
    yield Figure("falls", None, float(np.max(np.abs(runs.edit(2)["angle(hinge)"]))))

    # what the amplifier can still catch: |mode . start| grow < |mode . b| V
    push = np.array([0.0, J_POLE, 0.0, MA]) * PER_VOLT / D
    volts = abs(mode @ start) * grow / abs(mode @ push)
    yield Figure("v_least", volts)
    yield Figure("falls_weak", None, float(np.max(np.abs(runs.edit(3)["angle(hinge)"]))))
    yield Figure("stands", 0.0, runs.edit(4)["angle(hinge)"][-1], off=2e-3)
    yield Figure("stands_travel", None, -min(runs.edit(4)["pos(rail)"]))

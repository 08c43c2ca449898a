"""What lessons 4 to 7 must show: motor, gear, potentiometer, and where a pendulum's energy goes."""

from __future__ import annotations

from collections.abc import Iterator
from math import exp, pi, sqrt

import numpy as np
from forms_circuits import second_order
from pages import Figure, Runs, crossing, lesson, peak


@lesson("04_motor", step="1m")
def motor(runs: Runs) -> Iterator[Figure]:
    v, k, r, j = 6.0, 0.05, 1.0, 1e-4
    top, t_m = v / k, r * j / k**2
    run = runs.base
    yield Figure("i_start", v / r, run["i(m1)"][1], rel=2e-3)
    yield Figure("torque_start", k * v / r, run["torque(m1)"][1], rel=2e-3)
    yield Figure("speed", top, run["omega(shaft)"][-1])
    yield Figure("rpm", top, run["omega(shaft)"][-1])
    yield Figure("t_m", t_m, crossing(run, "omega(shaft)", top * (1 - exp(-1))))
    yield Figure("c", j / k**2)
    yield Figure("v_b", v, run["v(b)"][-1])
    apart = np.max(np.abs(run["v(b)"] - k * run["omega(shaft)"]))
    yield Figure("v_apart", 0.0, float(apart), off=1e-4)
    yield Figure("i_apart", 0.0, float(np.max(np.abs(run["i(m1)"] - run["i(rw)"]))), off=1e-4)
    # the energy of lesson 1: C V^2 supplied, half of it kinetic
    yield Figure("kinetic", j * top**2 / 2, 1e-4 / 2 * run["omega(shaft)"][-1] ** 2)

    loaded = runs.edit(1)
    yield Figure("i_load", 0.1 / k, loaded["i(m1)"][-1])
    yield Figure("speed_load", (v - r * 0.1 / k) / k, loaded["omega(shaft)"][-1])
    yield Figure("lost", r * 0.1 / k**2, top - loaded["omega(shaft)"][-1])
    yield Figure("v_load", v - r * 0.1 / k, loaded["v(b)"][-1])

    ind = 10e-3
    slow = runs.edit(2)
    when, height = peak(slow, "i(m1)")
    # critically damped: 4 L / r = r j / k^2
    yield Figure("i_peak", v / ind * (2 * ind / r) * exp(-1), height)
    yield Figure("i_peak_rw", v / ind * (2 * ind / r) * exp(-1), peak(slow, "i(rw)")[1])
    yield Figure("t_peak", 2 * ind / r, when)
    yield Figure("over", 0.0, max(slow["omega(shaft)"]) - top, off=0.01)

    sprung = runs.edit(3)
    ks = 0.1
    wd, over = second_order(sqrt(ks / j), k**2 / r / (2 * sqrt(ks * j)))
    yield Figure("l_spring", k**2 / ks)
    yield Figure("angle_end", k * v / r / ks, sprung["angle(shaft)"][-1], rel=2e-3)
    yield Figure("angle_top", k * v / r / ks * (1 + over), peak(sprung, "angle(shaft)")[1])
    yield Figure("f_spring", wd / (2 * pi), 0.5 / peak(sprung, "angle(shaft)")[0])
    yield Figure("i_spring", v / r, sprung["i(m1)"][-1], rel=2e-3)
    yield Figure("i_lb", v / r, sprung["i(lb)"][-1], rel=2e-3)


@lesson("05_gear", step="5m")
def gear(runs: Runs) -> Iterator[Figure]:
    tau, jm, jl = 0.02, 1e-4, 2.5e-3

    def alpha(n: float) -> float:
        return n * tau / (jl + n * n * jm)

    n = 5.0
    run = runs.base
    yield Figure("alpha", alpha(n), run["omega(slow)"][-1])
    yield Figure("alpha_direct", alpha(1.0))
    yield Figure("fast", n * alpha(n), run["omega(fast)"][-1])
    yield Figure("v2", alpha(n), run["v(w2)"][-1])
    yield Figure("v1", n * alpha(n), run["v(w1)"][-1])
    yield Figure("best", sqrt(jl / jm))
    yield Figure("ratio", jl / jm)
    yield Figure("weight", 0.05)
    yield Figure("square", 30.0**2)
    yield Figure("counts", 30.0**2 / 1000)
    yield Figure("seen_slow", jl + n * n * jm)
    yield Figure("seen_fast", jm + jl / n**2)
    # what is left of the motor's torque after its own rotor took its part
    yield Figure("through", tau - jm * n * alpha(n), abs(run["torque(g)"][len(run.time) // 2]))
    yield Figure("i_through", tau - jm * n * alpha(n), abs(run["i(vs)"][len(run.time) // 2]))
    yield Figure("ke_rotor", jm * (n * alpha(n)) ** 2 / 2, jm * run["omega(fast)"][-1] ** 2 / 2)
    yield Figure("ke_load", jl * alpha(n) ** 2 / 2, jl * run["omega(slow)"][-1] ** 2 / 2)

    yield Figure("alpha_10", alpha(10.0), runs.edit(1)["omega(slow)"][-1])
    yield Figure("fast_10", 10 * alpha(10.0), runs.edit(1)["omega(fast)"][-1])
    yield Figure("alpha_25", alpha(2.5), runs.edit(2)["omega(slow)"][-1])

    damped, c = runs.edit(3), 10e-3
    end, t = n * tau / c, (jl + n * n * jm) / c
    yield Figure("end", end, damped["omega(slow)"][-1], rel=3e-3)
    yield Figure("v_end", end, damped["v(w2)"][-1], rel=3e-3)
    yield Figure("t", t, crossing(damped, "omega(slow)", end * (1 - exp(-1))))
    yield Figure("c_seen", c / n**2)


@lesson("06_pot", step="5m")
def pot(runs: Runs) -> Iterator[Figure]:
    v, r, rl = 10.0, 10e3, 100e3

    def wiper(a: float, share: float) -> float:
        return v * a / (1 + a * (1 - a) * share)

    def when(a: float) -> float:
        return (a - 0.02) / 0.96

    grid = np.linspace(0.0, 1.0, 100001)

    def worst(share: float) -> tuple[float, float]:
        lost = v * grid - wiper(grid, share)
        k = int(np.argmax(lost))
        return float(grid[k]), float(lost[k]) / v

    run = runs.base
    yield Figure("v_free", v / 2, run.at("v(w1)", when(0.5)))
    yield Figure("v_half", wiper(0.5, r / rl), run.at("v(w2)", when(0.5)))
    yield Figure("err_half", (v / 2 - wiper(0.5, r / rl)) / v, run.at("v(err)", when(0.5)) / 100)
    a, most = worst(r / rl)
    at, height = peak(run, "v(err)")
    yield Figure("a_most", a, run.at("v(a)", at), rel=0.01)
    yield Figure("most", most, height / 100)
    yield Figure("rule", 4 / 27 * r / rl)
    yield Figure("r_half", r / 4)
    yield Figure("i_half", wiper(0.5, r / rl) / rl, run.at("v(w2)", when(0.5)) / rl)

    heavy = runs.edit(1)
    a, most = worst(1.0)
    at, height = peak(heavy, "v(err)")
    yield Figure("v_heavy", wiper(0.5, 1.0), heavy.at("v(w2)", when(0.5)))
    yield Figure("a_heavy", a, heavy.at("v(a)", at), rel=0.01)
    yield Figure("most_heavy", most, height / 100)

    buffered = runs.edit(2)
    yield Figure("buffered", 0.0, float(np.max(np.abs(buffered["v(err)"]))) / 100, off=1e-6)

    log = runs.edit(3)
    share = (81**0.5 - 1) / 80  # the taper of the POT card
    yield Figure("log_half", share)
    yield Figure("v_log", wiper(share, r / rl), log.at("v(w2)", when(0.5)), rel=3e-3)
    yield Figure("v_log_75", wiper((81**0.75 - 1) / 80, r / rl), log.at("v(w2)", when(0.75)), rel=3e-3)
    factor = 1 / (8 * 0.0025)
    yield Figure("factor", factor)
    yield Figure("answer", factor * r)
    yield Figure("way", 1.5 * pi, run["angle(shaft)"][-1] / 0.98)


def agm(a: float, b: float) -> float:
    while abs(a - b) > 1e-15 * a:
        a, b = (a + b) / 2, sqrt(a * b)
    return a


@lesson("07_energy", step="20m")
def energy(runs: Runs) -> Iterator[Figure]:
    m, length, g, d, k, r, load = 0.5, 0.6, 9.81, 0.01, 0.3, 1.0, 2.0
    j, start = m * length**2 / 3, m * g * length / 2
    run = runs.base
    yield Figure("start", start, run["energy()"][0] - run["energy()"][-1], rel=2e-3)

    def shares(load: float) -> dict[str, float]:
        parts = {"hinge": d, "gen": r * (k / (r + load)) ** 2, "rload": load * (k / (r + load)) ** 2}
        return {name: part / sum(parts.values()) for name, part in parts.items()}

    def heat(run, name: str) -> float:
        return next(x.dissipated for x in run.energy.lines if x.name == name)

    for name, share in shares(load).items():
        yield Figure(f"share_{name}", share, heat(run, name) / run.energy.dissipated)
        yield Figure(f"heat_{name}", share * start, heat(run, name), rel=2e-3)
    # unknown to the solver: it never balances energies, so what is left over measures its error
    yield Figure("unexplained", 0.0, run.energy.residual / start, off=1e-5)
    yield Figure("drop", length / 2)
    yield Figure("best_load", r * sqrt(1 + k**2 / (d * r)))
    yield Figure("brake", d + k**2 / (r + load))
    yield Figure("decay", (d + k**2 / (r + load)) / (2 * j))

    free = runs.edit(1)
    small = 2 * pi * sqrt(j / start)
    period = small / agm(1.0, sqrt(0.5))
    yield Figure("small", small)
    first = crossing(free, "angle(hinge)", 0.0)
    later = crossing(free, "angle(hinge)", 0.0, first + 0.75 * period)
    yield Figure("period", period, later - first)
    yield Figure("longer", period / small - 1, (later - first) / small - 1, rel=2e-3)
    yield Figure("bottom", sqrt(3 * g / length), float(np.max(np.abs(free["omega(hinge)"]))))
    kept = np.max(np.abs(free["energy()"] - free["energy()"][0]))
    yield Figure("kept", 0.0, float(kept) / start, off=1e-4)

    short, part = runs.edit(2), shares(0.01)
    for name in ("hinge", "gen", "rload"):
        yield Figure(f"short_{name}", part[name], heat(short, name) / short.energy.dissipated)

    opened, part = runs.edit(3), shares(1e6)
    yield Figure("open_hinge", part["hinge"], heat(opened, "hinge") / opened.energy.dissipated)
    yield Figure("open_kept", None, (opened["energy()"][-1] - run["energy()"][-1]) / start)

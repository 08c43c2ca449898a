"""What lessons 1 to 3 must show: RC, RLC at resonance, mass on a spring. Formulas only; nothing here asks emsim."""

from __future__ import annotations

from collections.abc import Iterator
from math import atan2, cos, exp, hypot, log, log10, pi, sin, sqrt

import numpy as np
from pages import Figure, Runs, crossing, lesson, peak


@lesson("01_rc", step="10u")
def rc(runs: Runs) -> Iterator[Figure]:
    v, r, c, stop = 5.0, 1e3, 1e-6, 5e-3
    tau = r * c
    run = runs.base
    yield Figure("tau", tau, crossing(run, "v(out)", v * (1 - exp(-1))))
    yield Figure("v_tau", v * (1 - exp(-1)), run.at("v(out)", tau))
    yield Figure("fraction", 1 - exp(-1), run.at("v(out)", tau) / v)
    yield Figure("half", tau * log(2), crossing(run, "v(out)", v / 2))
    yield Figure("i_start", v / r, -run.at("i(v1)", 1e-8))
    yield Figure("i_tau", v / r * exp(-1), -run.at("i(v1)", tau))
    yield Figure("missing", v * exp(-5), v - run["v(out)"][-1], off=1e-3)
    # supplied: V times the charge; stored: C v^2/2; the rest is heat
    end = v * (1 - exp(-stop / tau))
    yield Figure("supplied", c * v * end, run.energy.supplied)
    yield Figure("stored", c * end**2 / 2, run.energy.stored)
    yield Figure("lost", c * v * end - c * end**2 / 2, run.energy.dissipated)

    twice = runs.edit(1)
    yield Figure("tau_twice", 2 * tau, crossing(twice, "v(out)", v * (1 - exp(-1))))
    yield Figure("i_twice", v / (2 * r), -twice.at("i(v1)", 1e-8))
    end = v * (1 - exp(-10e-3 / (2 * tau)))
    yield Figure("lost_twice", c * v * end - c * end**2 / 2, twice.energy.dissipated)

    loaded = runs.edit(2)
    yield Figure("v_loaded", v / 2, loaded["v(out)"][-1], rel=1e-3)
    yield Figure("r_thevenin", r / 2)
    yield Figure("tau_loaded", tau / 2, crossing(loaded, "v(out)", v / 2 * (1 - exp(-1))))

    sine = runs.edit(3)
    corner = 1 / (2 * pi * tau)
    yield Figure("corner", corner)
    (top, height), (source, _) = (peak(sine, name, 30e-3, 36e-3) for name in ("v(out)", "v(in)"))
    yield Figure("gain", 1 / sqrt(2), height / v)
    yield Figure("lag", pi / 4, (top - source) * 2 * pi * corner, off=0.005)

    bode = runs.edit(4)
    f, db = bode["frequency"], bode["vdb(out)"]
    yield Figure("slope", 20.0, float(np.interp(1e4, f, db) - np.interp(1e5, f, db)), rel=1e-2)
    yield Figure("corner_db", 10 * log10(2), -float(np.interp(corner, f, db)), rel=5e-3)
    yield Figure("corner_ac", corner, float(np.interp(10 * log10(2), -db, f)), rel=5e-3)


def second_order(wn: float, zeta: float) -> tuple[float, float]:
    """Of x'' + 2 zeta wn x' + wn^2 x = wn^2: the damped frequency [rad/s] and the overshoot in parts of the end."""
    wd = wn * sqrt(1 - zeta**2)
    return wd, exp(-pi * zeta * wn / wd)


@lesson("02_resonance", step="2u")
def resonance(runs: Runs) -> Iterator[Figure]:
    r, ind, c = 20.0, 10e-3, 1e-6
    wn, zeta = 1 / sqrt(ind * c), r / 2 * sqrt(c / ind)
    q = 1 / (2 * zeta)
    wd, over = second_order(wn, zeta)
    f0 = wn / (2 * pi)
    run = runs.base
    yield Figure("wn", wn)
    yield Figure("f0", f0)
    yield Figure("z0", sqrt(ind / c))
    yield Figure("q", q, peak(run, "v(b)", 7e-3)[1], rel=2e-3)
    yield Figure("i_end", 1 / r, peak(run, "i(l1)", 7e-3)[1], rel=2e-3)
    yield Figure("t_env", 2 * ind / r)
    # v_C = -Q cos(wn t) + the ringing that makes it start at rest
    t = 1e-3
    a, b = q, q * zeta * wn / wd
    exact = -q * cos(wn * t) + exp(-zeta * wn * t) * (a * cos(wd * t) + b * sin(wd * t))
    yield Figure("v_1ms", exact, run.at("v(b)", t))
    # at resonance the current is in phase with the source: their peaks come together
    yield Figure(
        "phase",
        0.0,
        (peak(run, "i(l1)", 7e-3, 7.6e-3)[0] - peak(run, "v(in)", 7e-3, 7.6e-3)[0]) * wn,
        off=0.01,
    )

    half = runs.edit(1)
    yield Figure("v_half", 1 / hypot(1 - 0.25, 0.5 / q), peak(half, "v(b)", 6e-3)[1], rel=2e-3)
    yield Figure("f_half", f0 / 2)

    step = runs.edit(2)
    top, height = peak(step, "v(b)")
    yield Figure("over", over, height - 1)
    yield Figure("t_top", pi / wd, top, rel=2e-3)
    second = peak(step, "v(b)", 2 * pi / wd, 4 * pi / wd)[1] - 1
    yield Figure("next", exp(-2 * pi * zeta * wn / wd), second / (height - 1), rel=3e-3)
    yield Figure("fd", wd / (2 * pi), 1 / (peak(step, "v(b)", 2 * pi / wd, 4 * pi / wd)[0] - top), rel=2e-3)

    critical = runs.edit(3)
    yield Figure("r_critical", 2 * sqrt(ind / c))
    yield Figure("none", 0.0, max(critical["v(b)"]) - 1, off=1e-4)
    t = 2e-4
    yield Figure("t_critical", t)
    yield Figure("v_critical", 1 - (1 + wn * t) * exp(-wn * t), critical.at("v(b)", t))

    bode = runs.edit(4)
    f, db = bode["frequency"], bode["vdb(b)"]
    # the peak of |v_C| lies at f0 sqrt(1 - 2 zeta^2), Q/sqrt(1 - zeta^2) high
    yield Figure("peak_db", 20 * log10(q / sqrt(1 - zeta**2)), float(np.max(db)), rel=2e-3)
    yield Figure("slope", 40.0, float(np.interp(1e5, f, db) - np.interp(1e6, f, db)), rel=1e-3)
    yield Figure("quarter", pi / 2, -float(np.interp(f0, f, bode["vp(b)"])), rel=5e-3)
    yield Figure("half_power", sqrt(0.5))


@lesson("03_mass_spring", step="1m")
def mass_spring(runs: Runs) -> Iterator[Figure]:
    force, m, k, c = 1.0, 0.1, 40.0, 0.4
    wn, zeta = sqrt(k / m), c / (2 * sqrt(k * m))
    wd, over = second_order(wn, zeta)
    run = runs.base
    yield Figure("wn", wn)
    yield Figure("zeta", zeta)
    yield Figure("static", force / k)
    top, height = peak(run, "pos(rail)")
    yield Figure("top", force / k * (1 + over), height)
    yield Figure("t_top", pi / wd, top)
    fastest = peak(run, "vel(rail)")
    # velocity: F/(m wd) exp(-zeta wn t) sin(wd t), largest where tan(wd t) = wd/(zeta wn)
    t = atan2(wd, zeta * wn) / wd
    v_max = force / (m * wd) * exp(-zeta * wn * t) * sin(wd * t)
    yield Figure("v_max", v_max, fastest[1])
    for key, name in (("v_u", "v(u)"), ("i_lm", "i(lm)")):
        yield Figure(key, v_max, peak(run, name)[1])
        apart = np.max(np.abs(run[name] - run["vel(rail)"]))
        yield Figure(f"{key}_apart", 0.0, float(apart), off=1e-5)
    # the spring pulls back with k x: a current in one circuit, a voltage in the other
    yield Figure("f_top", force * (1 + over), -min(run["force(s)"]))
    yield Figure("i_ls", force * (1 + over), peak(run, "i(ls)")[1])
    yield Figure("v_h", force * (1 + over), peak(run, "v(h)")[1])
    yield Figure("l_m", 1 / k)
    yield Figure("r_m", 1 / c)
    yield Figure("c_i", 1 / k)

    heavy = runs.edit(1)
    wd4, over4 = second_order(wn / 2, zeta / 2)
    yield Figure("top_heavy", force / k * (1 + over4), peak(heavy, "pos(rail)")[1])
    yield Figure("t_heavy", pi / wd4, peak(heavy, "pos(rail)")[0])

    critical = runs.edit(2)
    yield Figure("c_critical", 2 * sqrt(k * m))
    yield Figure("none", 0.0, max(critical["pos(rail)"]) - force / k, off=1e-6)
    v_critical = force / (m * wn) * exp(-1)
    yield Figure("v_critical", v_critical, peak(critical, "v(u)")[1])

    sine = runs.edit(3)
    # -Q F/k cos(wn t), and what is left of the start at the end
    yield Figure("q", 1 / (2 * zeta))
    yield Figure("x_sine", force / k / (2 * zeta), peak(sine, "pos(rail)", 2.5)[1], rel=0.01)
    yield Figure("f_sine", wn / (2 * pi))

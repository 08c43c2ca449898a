"""What lessons 8 to 11 must show: stiffness, drift of methods, drift of constraints, a linkage."""

from __future__ import annotations

from collections.abc import Iterator
from math import acos, atan2, cos, exp, hypot, pi, sin, sqrt

import numpy as np
from pages import Figure, Runs, lesson

import emsim


def code(run, what: str) -> bool:
    return any(d.code == what for d in run.diagnostics)


def motor_step(v: float, k: float, r: float, ind: float, j: float, t: float) -> tuple[float, float]:
    """Current and speed of a motor that a step of v starts: eigenvectors of its two linear equations."""
    matrix = np.array([[-r / ind, -k / ind], [k / j, 0.0]])
    end = np.array([0.0, v / k])
    values, vectors = np.linalg.eig(matrix)
    parts = np.linalg.solve(vectors, -end.astype(complex))
    i, w = (end + vectors @ (np.exp(values * t) * parts)).real
    return float(i), float(w)


@lesson("08_stiffness")
def stiffness(runs: Runs) -> Iterator[Figure]:
    v, k, r, ind, j, fast = 12.0, 0.05, 1.0, 0.5e-3, 1e-4, 1e-9
    yield Figure("fast", fast)
    yield Figure("t_e", ind / r)
    yield Figure("t_m", r * j / k**2)
    run = runs.base
    i, w = motor_step(v, k, r, ind, j, 1e-3)
    yield Figure("i_end", i, run["i(m1)"][-1])
    yield Figure("w_end", w, run["omega(shaft)"][-1])
    assert run.stats["method"] not in ("rk45", "dop853")
    yield Figure("steps", None, run.stats["steps"])
    # |1 + z + z^2/2 + z^3/6 + z^4/24 + z^5/120 + z^6/600| = 1 on the negative axis: Dormand and Prince 1980
    polynomial = np.array([1 / 600, 1 / 120, 1 / 24, 1 / 6, 1 / 2, 1.0, 1.0])
    edges = np.concatenate([np.roots(polynomial - np.eye(7)[6]), np.roots(polynomial + np.eye(7)[6])])
    bound = min(-z.real for z in edges if abs(z.imag) < 1e-9 and z.real < -1.0)
    yield Figure("bound", bound)
    yield Figure("longest", bound * fast)

    explicit = runs.edit(1)
    assert code(explicit, "W414")
    yield Figure("steps_rk45", 1e-3 / (bound * fast), explicit.stats["steps"], rel=0.03)
    yield Figure("i_rk45", i, explicit["i(m1)"][-1])
    loose = runs.edit(2)
    yield Figure("steps_loose", 1e-3 / (bound * fast), loose.stats["steps"], rel=0.03)
    slow = runs.edit(3)
    yield Figure("fast_slow", 100 * fast)
    yield Figure("steps_slow", 1e-3 / (bound * 100 * fast), slow.stats["steps"], rel=0.03)
    long = runs.edit(4)
    yield Figure("steps_long", None, long.stats["steps"])
    yield Figure("steps_never", 0.2 / (bound * fast))
    yield Figure("w_long", motor_step(v, k, r, ind, j, 0.2)[1], long["omega(shaft)"][-1])
    yield Figure("ratio", r * j / k**2 / fast)
    yield Figure("blowup", 2.0**100)


def swing(run, t: float) -> tuple[float, float]:
    """Size and angle of the tank's swing: v + j i turns once a period."""
    v, i = run.at("v(a)", t), run.at("i(l1)", t)
    return hypot(v, i), atan2(i, v)


@lesson("09_drift")
def drift(runs: Runs) -> Iterator[Figure]:
    h, end = 25e-3, 20.0
    steps = round(end / h)
    theta = 2 * pi * h
    run = runs.base
    yield Figure("per_period", 1 / h)
    yield Figure("apart", 0.0, float(np.max(np.abs(run["v(a)"] - run["vel(rail)"]))), off=1e-9)
    size, angle = swing(run, end)
    yield Figure("size_trap", 1.0, size, rel=1e-5)
    # the trapezoid turns by 2 atan(theta/2) a step instead of theta
    lag = steps * (theta - 2 * np.arctan(theta / 2))
    yield Figure("lag_trap", lag, -angle, rel=2e-3)
    yield Figure("lag_share", lag / (2 * pi * end))
    yield Figure("rule", theta**2 / 12)
    yield Figure("v_trap", cos(lag), run.at("v(a)", end))

    # order 2 of gear: 3/2 z^2 - 2 z + 1/2 = i theta z^2; the root near exp(i theta)
    root = min(np.roots([1.5 - 1j * theta, -2.0, 0.5]), key=lambda z: abs(z - np.exp(1j * theta)))
    gear = runs.edit(1)
    yield Figure("size_gear", abs(root) ** (19 / h), swing(gear, end)[0] / swing(gear, 1.0)[0])
    yield Figure("energy_gear", abs(root) ** (2 * 19 / h), (swing(gear, end)[0] / swing(gear, 1.0)[0]) ** 2)
    yield Figure("loss_gear", 1 - abs(root))
    yield Figure("loss_rule", theta**4 / 4)

    # Radau IIA of order 5: the Pade approximation (2, 3) of exp(z)
    z = 1j * theta
    factor = (1 + 2 * z / 5 + z**2 / 20) / (1 - 3 * z / 5 + 3 * z**2 / 20 - z**3 / 60)
    radau = runs.edit(2)
    size, angle = swing(radau, end)
    yield Figure("missing_radau", 1 - abs(factor) ** steps, 1 - size, rel=0.02)
    yield Figure("lag_radau", steps * (theta - np.angle(factor)), -angle, off=2e-6)

    double = runs.edit(3)
    lag2 = steps / 2 * (2 * theta - 2 * np.arctan(theta))
    yield Figure("lag_double", lag2, -swing(double, end)[1], rel=5e-3)
    yield Figure("lag_times", lag2 / lag, swing(double, end)[1] / swing(run, end)[1], rel=5e-3)
    # question: 1 % over twenty periods by gear, (1 - theta^4/4)^(2 pi 20/theta)
    yield Figure("answer", 2 * pi / (0.01 * 4 / (2 * pi * 20)) ** (1 / 3))


def open_by(run, name: str, t: float = np.inf) -> float:
    """How far a pendulum of lesson 10 has been from its circle up to t [m]."""
    return float(np.max(np.abs(run[name][run.time <= t]))) / 1000


@lesson("10_constraint")
def constraint(runs: Runs) -> Iterator[Figure]:
    run = runs.base
    yield Figure("hand_6", None, open_by(run, "v(h)", 6.0))
    yield Figure("hand_24", None, open_by(run, "v(h)"))
    yield Figure("loop", 0.0, open_by(run, "v(l)"), off=1e-12)
    yield Figure("pin", 0.0, open_by(run, "v(p)"), off=1e-12)

    tight = runs.edit(1)
    yield Figure("tight_24", None, open_by(tight, "v(h)"))
    # a constant error in h'' gives h = e t^2/2: twice the time, four times the drift
    yield Figure("growth", 4.0, open_by(tight, "v(h)") / open_by(tight, "v(h)", 12.0), rel=0.15)

    pulled = runs.edit(2)
    yield Figure("pulled", None, open_by(pulled, "v(h)"))

    wrong, a, h0 = runs.edit(3), 5.0, (1.1**2 - 1) / 2
    for key, t in (("off_0", 0.0), ("off_1", 0.5), ("off_2", 1.0)):
        h = h0 * (1 + a * t) * exp(-a * t)  # of (x^2 + y^2 - 1)/2
        yield Figure(key, sqrt(1 + 2 * h) - 1, wrong.at("v(h)", t) / 1000, rel=5e-3)

    loose = runs.edit(4)
    assert code(loose, "W413")
    yield Figure("loose", None, open_by(loose, "v(l)"))
    projected = emsim.run(runs.page.deck, method="rk45")
    assert not code(projected, "W413")
    yield Figure("projected", 0.0, open_by(projected, "v(l)"), off=5e-5)


CRANK, COUPLER, ROCKER, GROUND = 0.10, 0.24, 0.20, 0.22
MASSES = {CRANK: 0.10, COUPLER: 0.24, ROCKER: 0.20}


def pose(q: float, crank: float = CRANK) -> tuple[float, float]:
    """Angles of coupler and rocker by two triangles: the one with the coupler above the diagonal."""
    dx, dy = GROUND - crank * cos(q), -crank * sin(q)
    d = hypot(dx, dy)
    coupler = atan2(dy, dx) + acos((COUPLER**2 + d**2 - ROCKER**2) / (2 * COUPLER * d))
    x, y = crank * cos(q) + COUPLER * cos(coupler), crank * sin(q) + COUPLER * sin(coupler)
    return coupler, atan2(y, x - GROUND)


def inertia(q: float) -> float:
    """What the crank feels: twice the kinetic energy at 1 rad/s, of three uniform rods."""

    def rate(function) -> float:
        e = 1e-5
        return (function(q + e) - function(q - e)) / (2 * e)

    coupler, rocker = rate(lambda s: pose(s)[0]), rate(lambda s: pose(s)[1])
    vx = rate(lambda s: CRANK * cos(s) + COUPLER / 2 * cos(pose(s)[0]))
    vy = rate(lambda s: CRANK * sin(s) + COUPLER / 2 * sin(pose(s)[0]))
    return (
        MASSES[CRANK] * CRANK**2 / 3
        + MASSES[COUPLER] * (vx**2 + vy**2 + COUPLER**2 / 12 * coupler**2)
        + MASSES[ROCKER] * ROCKER**2 / 3 * rocker**2
    )


def swing_end(d: float) -> float:
    """The rocker's angle where crank and coupler lie on one line of length d."""
    return pi - acos((GROUND**2 + ROCKER**2 - d**2) / (2 * GROUND * ROCKER))


@lesson("11_linkage", step="1m")
def linkage(runs: Runs) -> Iterator[Figure]:
    run, w = runs.base, 2 * pi
    yield Figure("g", 9.81)
    coupler, rocker = pose(w * 0.2)
    yield Figure("crank_at", w * 0.2, run.at("angle(a)", 0.2))
    yield Figure("coupler_at", coupler, run.at("angle(coupler)", 0.2))
    yield Figure("rocker_at", rocker, run.at("angle(rocker)", 0.2))
    low, high = swing_end(COUPLER + CRANK), swing_end(COUPLER - CRANK)
    low, high = min(low, high), max(low, high)
    yield Figure("low", low, min(run["angle(rocker)"]))
    yield Figure("high", high, max(run["angle(rocker)"]))
    yield Figure("swing", high - low, max(run["angle(rocker)"]) - min(run["angle(rocker)"]))
    yield Figure("sum_outer", CRANK + COUPLER)
    yield Figure("sum_inner", ROCKER + GROUND)
    sides = COUPLER**2 + ROCKER**2
    between = run["angle(rocker)"] - run["angle(coupler)"]
    least = acos((sides - (GROUND - CRANK) ** 2) / (2 * COUPLER * ROCKER))
    yield Figure("pressure", least, min(between))
    # at a constant speed the torque is w^2/2 dJ/dq
    angles = np.linspace(0.0, 2 * pi, 2001)
    torque = w**2 / 2 * np.gradient([inertia(q) for q in angles], angles)
    yield Figure("torque_max", float(max(torque)), max(run["torque(turn)"]), rel=3e-3)
    yield Figure("torque_min", float(min(torque)), min(run["torque(turn)"]), rel=3e-3)
    yield Figure("round", 0.0, run["energy()"][-1] - run["energy()"][0], off=1e-6)

    mirrored = runs.edit(1)
    yield Figure("mirror_at", -pose(-w * 0.2)[1], mirrored.at("angle(rocker)", 0.2))

    free = runs.edit(2)
    energy = inertia(0.0) * 10.0**2 / 2
    speeds = [sqrt(2 * energy / inertia(q)) for q in angles]
    yield Figure("energy", energy, free["energy()"][-1])
    yield Figure("kept", 0.0, float(np.ptp(free["energy()"])) / energy, off=1e-4)
    yield Figure("slowest", min(speeds), min(free["omega(a)"]))
    yield Figure("fastest", max(speeds), max(free["omega(a)"]), rel=2e-3)
    there = float(free["angle(a)"][np.argmax(free["omega(a)"])]) % (2 * pi)
    yield Figure("fastest_at", float(angles[np.argmax(speeds)]), there, rel=0.02)
    # where crank and coupler lie on one line, stretched: the rocker is as far out as it gets
    reach = COUPLER + CRANK
    turn = acos((reach**2 + GROUND**2 - ROCKER**2) / (2 * reach * GROUND))
    yield Figure("turn_at", turn, float(run["angle(a)"][np.argmin(run["angle(rocker)"])]), rel=0.02)

    stopped = runs.failure(3)
    assert "E410" in str(stopped) and "a mechanism locks" in str(stopped)
    # crank 0.19: the diagonal must be COUPLER - ROCKER at least
    crank = 0.19
    lock = acos((crank**2 + GROUND**2 - (COUPLER - ROCKER) ** 2) / (2 * crank * GROUND))
    yield Figure("sum_long", crank + COUPLER)
    yield Figure("sum_short", ROCKER + GROUND)
    yield Figure("lock", lock)
    yield Figure("t_lock", (2 * pi - lock - 1) / w, stopped.partial.time[-1])

"""Piles, chains with friction, ropes and beams beside MuJoCo and Exudyn, where these can say them alike.

    python tests/bench/against.py [chain pile rope beam]

A row a run: scene, size, program and setting, CPU seconds of the integration (thread time, the least of two), error by the
largest value. It is of the angles of first and last link against emsim at reltol 1e-8 (`chain`), of the load's fall against its
closed form (`rope`), of the free end against 24 elements of emsim (`beam`). Piles do not converge: the deepest overlap and the
mean height at the end stand in its place. MuJoCo's contacts and friction are soft, at their defaults or as stiff as a step
carries; its piles do not bounce.
"""

from __future__ import annotations

import random
import sys
from math import radians
from time import thread_time

import numpy as np
from peers.exudyn import rub, tree
from peers.exudyn import settings as exudyn_settings
from peers.machines import GRAVITY, rod_inertia
from peers.mujoco import stiffen

import emsim

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

CHAINS, PILES, BEAMS = (5, 10, 20, 40), (6, 9, 12, 15), (4, 8, 16)
GRID = np.linspace(0.1, 2.0, 20)


def row(scene: str, n: int | str, program: str, setting: str, seconds: float, said: str) -> None:
    print(f"{scene:<6} {n:>4}  {program:<8} {setting:<22} {seconds:9.4f} s  {said}", flush=True)


def least(run: Callable[[], Any]) -> tuple[float, Any]:
    """CPU seconds of the shorter of two runs, and what the last gave."""
    spent = []
    for _ in range(2):
        began = thread_time()
        found = run()
        spent.append(thread_time() - began)
        if spent[0] > 2.0:
            break
    return min(spent), found


def by_emsim(scene: str, n: int, text: str, read: Callable[[Any], np.ndarray]) -> np.ndarray:
    """Rows at three tolerances; the converged columns."""
    exact = read(emsim.run(text, reltol=1e-8))
    for reltol in (1e-3, 1e-5):
        runs = [emsim.run(text, reltol=reltol) for _ in range(2)]
        error = np.abs(read(runs[0]) - exact).max() / np.abs(exact).max()
        seconds = min(r.stats["solve_time"] for r in runs)
        row(
            scene, n, "emsim", f"reltol {reltol:g}", seconds, f"{error:.1e}, {runs[0].stats['events']} events"
        )
    return exact


# chains --------------------------------------------------------------------------------------------


def rods(n: int) -> tuple[float, float, list[float], list[float]]:
    """Length [m] and mass [kg] of each, friction [N m] and first angle [rad] of every joint."""
    return (
        3.0 / n,
        5.0 / n,
        [2.5 * (1 - k / n) for k in range(n)],
        [1.2, *(-0.6 / (n - 1) for _ in range(n - 1))],
    )


def chain_deck(n: int) -> str:
    """Rods of 3 m and 5 kg in all; friction falls from 2.5 N m at the wall to nothing at the end."""
    length, m, friction, start = rods(n)
    cards = []
    for k in range(n):
        at = "0" if k == 0 else f"l{k}({length!r},0)"
        zero = " zero=-90deg" if k == 0 else ""
        cards += [
            f"BODY l{k + 1} shape=rod({length!r}) m={m!r}",
            f"JOINT h{k + 1} {at} l{k + 1} pin{zero} ic={start[k]!r}",
            f"FRICTION f{k + 1} h{k + 1} fc={friction[k]!r}",
        ]
    return "\n".join(["chain", ".gravity 9.81", *cards, ".tran 10m 2", f".print tran angle(l1) angle(l{n})"])


def chain(n: int) -> None:
    length, m, friction, start = rods(n)
    text = chain_deck(n)
    turn = radians(-90)  # angles of bodies from the x axis
    exact = by_emsim(
        "chain", n, text, lambda r: np.array([r.at(f"angle({b})", GRID) - turn for b in ("l1", f"l{n}")])
    )
    _chain_mujoco(n, length, m, friction, start, exact)
    _chain_exudyn(n, length, m, friction, start, exact)


def _error(found: np.ndarray, exact: np.ndarray) -> str:
    return f"{np.abs(found - exact).max() / np.abs(exact).max():.1e}"


def _chain_mujoco(
    n: int, length: float, m: float, friction: list[float], start: list[float], exact: np.ndarray
) -> None:
    import mujoco
    from peers.mujoco import body, world

    inner = ""
    for k in range(n - 1, -1, -1):
        at = "0 0 0" if k == 0 else f"0 0 {-length}"
        inner = body(f"l{k}", at, m, f"0 0 {-length / 2}", rod_inertia(m, length), inner, friction[k])
    model = mujoco.MjModel.from_xml_string(world(inner))
    data = mujoco.MjData(model)
    for h in (1e-3, 1e-4):
        model.opt.timestep = h
        stiffen(model, h)

        def run(h: float = h) -> np.ndarray:
            mujoco.mj_resetData(model, data)
            data.qpos[:] = start
            found = []
            for _ in GRID:
                mujoco.mj_step(model, data, nstep=round(0.1 / h))
                found.append((data.qpos[0], data.qpos.sum()))
            return np.array(found).T

        seconds, found = least(run)
        row("chain", n, "MuJoCo", f"h {h:g}", seconds, _error(found, exact))


def _chain_exudyn(
    n: int, length: float, m: float, friction: list[float], start: list[float], exact: np.ndarray
) -> None:
    import exudyn as exu

    fits: list[Callable[[float], None]] = []
    carried = np.array(
        [[n - 1 - max(i, j) + (1 / 3 if i == j else 1 / 2) for j in range(n)] for i in range(n)]
    )
    sums = np.tril(np.ones((n, n)))
    ease = 1 / np.linalg.eigvalsh(m * length**2 * sums.T @ carried @ sums)[0]
    mbs, sensors = tree(
        [m] * n, length, length / 2, rod_inertia(m, length), start,
        lambda mbs, node: fits.append(rub(mbs, node, 0, friction, ease)),
    )  # fmt: skip
    for h in (1e-4, 1e-5):
        fits[0](h)

        def run(h: float = h) -> Any:
            solver = exu.DynamicSolverType.RK44
            try:
                return mbs.SolveDynamic(exudyn_settings(2.0, round(2.0 / h), 0.1), solverType=solver)
            except Exception:  # its own kind, which is no attribute of the module
                return False

        exu.config.suppressWarnings = True  # of a node that limit stops would need
        seconds, fine = least(run)
        q = mbs.GetSensorStoredData(sensors[0])
        said = "its solver gave up"
        if fine and len(q) >= len(GRID):
            angles = q[-len(GRID) :, 1:]
            said = _error(np.array([angles[:, 0], angles.sum(axis=1)]), exact)
        row("chain", n, "Exudyn", f"RK44, h {h:g}", seconds, said)
        if seconds > 0.5:  # a tenth of the step takes ten times as long
            break


# piles ---------------------------------------------------------------------------------------------


def places(n: int) -> list[tuple[float, float]]:
    rng = random.Random(0)
    return [(0.06 + 0.12 * (k % 3) + rng.uniform(-5e-3, 5e-3), 0.1 + 0.12 * (k // 3)) for k in range(n)]


def overlap(x: np.ndarray, y: np.ndarray) -> float:
    """The deepest of discs of 0.05 m in each other or in the walls, over all times [mm]."""
    gaps = [y - 0.05, x - 0.05, 0.33 - x]
    gaps += [np.hypot(x[i] - x[:i], y[i] - y[:i]) - 0.1 for i in range(1, len(x))]
    return -1e3 * min(float(gap.min()) for gap in gaps)


def pile_deck(n: int) -> str:
    """Discs of 0.05 m and 1 kg fall between two walls; e = 0.3, mu = 0.3."""
    cards = ["SHAPE floor 0 box(1,0.2) at=(0.19,-0.1)"]
    cards += [f"SHAPE w{k} 0 box(0.2,4) at=({x},1.9)" for k, x in enumerate((-0.1, 0.48))]
    cards += [f"BODY b{k} m=1 shape=disc(0.05) x={x:.4f} y={y:.4f}" for k, (x, y) in enumerate(places(n))]
    names = " ".join(f"x(b{k}) y(b{k})" for k in range(n))
    return "\n".join(
        [
            "pile",
            ".gravity 9.81",
            *cards,
            "CONTACT t all e=0.3 mu=0.3",
            ".tran 10m 0.8",
            f".print tran {names}",
        ]
    )


def pile(n: int) -> None:
    for reltol in (1e-3, 1e-5):
        r = emsim.run(pile_deck(n), reltol=reltol)
        x, y = (np.array([np.asarray(r[f"{word}(b{k})"]) for k in range(n)]) for word in "xy")
        said = f"overlap {overlap(x, y):.1e} mm, height {1e3 * y[:, -1].mean():.1f} mm, {r.stats['events']} events"
        row("pile", n, "emsim", f"reltol {reltol:g}", r.stats["solve_time"], said)
        if r.stats["solve_time"] > 5.0:
            break
    _pile_mujoco(n)


def _pile_mujoco(n: int) -> None:
    import mujoco

    walls = ('pos="0 0 0" zaxis="0 0 1"', 'pos="0 0 0" zaxis="1 0 0"', 'pos="0.38 0 0" zaxis="-1 0 0"')
    inner = "".join(f'<geom type="plane" size="0 0 1" friction="0.3 0 0" {wall}/>' for wall in walls)
    for x, y in places(n):
        joints = '<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/><joint type="hinge" axis="0 -1 0"/>'
        weight = '<inertial pos="0 0 0" mass="1" diaginertia="1.25e-3 1.25e-3 1.25e-3"/>'
        shape = '<geom type="sphere" size="0.05" friction="0.3 0 0"/>'
        inner += f'<body pos="{x:.4f} 0 {y:.4f}">{joints}{weight}{shape}</body>'
    xml = f'<mujoco><option gravity="0 0 {-GRAVITY}" cone="elliptic"/><worldbody>{inner}</worldbody></mujoco>'
    for h, stiff in ((2e-3, False), (1e-4, True)):
        model = mujoco.MjModel.from_xml_string(xml)
        data = mujoco.MjData(model)
        model.opt.timestep = h
        if stiff:
            stiffen(model, h)
        begin = np.array(places(n))

        def run(h: float = h, model: Any = model, data: Any = data, begin: np.ndarray = begin) -> np.ndarray:
            mujoco.mj_resetData(model, data)
            found = []
            for _ in range(80):
                mujoco.mj_step(model, data, nstep=round(0.01 / h))
                found.append(begin + data.qpos.reshape(n, 3)[:, :2])
            return np.array(found)

        seconds, found = least(run)
        x, y = found[:, :, 0].T, found[:, :, 1].T
        said = f"overlap {overlap(x, y):.1e} mm, height {1e3 * y[:, -1].mean():.1f} mm"
        row("pile", n, "MuJoCo", f"h {h:g}{', stiff' if stiff else ''}", seconds, said)


# ropes ---------------------------------------------------------------------------------------------


def rope(_: int) -> None:
    """block_and_tackle.cir: (M + 16 m) a = (4 m - M) g."""
    import mujoco

    fall = 0.5 * (4 * 9.9 - 40) * GRAVITY / (40 + 16 * 9.9) * GRID**2
    text = """block and tackle
BODY  load m=40 j=1
BODY  hand m=9.9
JOINT guide 0 load slide axis=(0,1)
JOINT fall  0(0.7,1.2) hand slide axis=(0,1)
ROPE  rope 0(-0.1,2) load 0(0.2,2) load(0.4,0) 0(0.6,2) hand r=(0,0.1,-0.1,0.1,-0.1,0) slack=0
.gravity 9.81
.tran 10m 2
.print tran pos(guide)
"""
    for reltol in (1e-3, 1e-6):
        r = emsim.run(text, reltol=reltol)
        row(
            "rope",
            4,
            "emsim",
            f"reltol {reltol:g}",
            r.stats["solve_time"],
            _error(r.at("pos(guide)", GRID), fall),
        )
    points = {"a": (-0.1, 2.0), "b": (0.2, 2.0), "c": (0.6, 2.0)}
    sites = "".join(f'<site name="{name}" pos="{x} 0 {y}"/>' for name, (x, y) in points.items())

    def body(name: str, at: str, m: float, marks: dict[str, str]) -> str:
        weight = f'<inertial pos="0 0 0" mass="{m}" diaginertia="1 1 1"/><joint type="slide" axis="0 0 1"/>'
        sites = "".join(f"<site name={k!r} pos={v!r}/>" for k, v in marks.items())
        return f'<body name="{name}" pos="{at}">{weight}{sites}</body>'

    # parts hang straight: points stand in the place of pulleys, whose arcs stay as long as they are
    load = body("load", "0 0 0", 40, {"p": "-0.1 0 0", "q": "0.2 0 0", "s": "0.6 0 0", "u": "0.2 0 0"})
    hand = body("hand", "0.7 0 1.2", 9.9, {"e": "-0.1 0 0"})
    way = ("a", "p", "u", "b", "q", "s", "c", "e")
    path = "".join(f'<site site="{name}"/>' for name in way)
    xml = (
        f'<mujoco><option gravity="0 0 {-GRAVITY}"><flag contact="disable"/></option><worldbody>{sites}{load}{hand}'
        f'</worldbody><tendon><spatial name="rope">{path}</spatial></tendon>'
        '<equality><tendon tendon1="rope"/></equality></mujoco>'
    )
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    for h in (1e-3, 1e-4):
        model.opt.timestep = h
        stiffen(model, h)

        def run(h: float = h) -> np.ndarray:
            mujoco.mj_resetData(model, data)
            found = []
            for _ in GRID:
                mujoco.mj_step(model, data, nstep=round(0.1 / h))
                found.append(data.qpos[0])
            return np.array(found)

        seconds, found = least(run)
        row("rope", 4, "MuJoCo", f"h {h:g}", seconds, _error(found, fall))


# beams ---------------------------------------------------------------------------------------------


FINE: dict[str, np.ndarray] = {}


def _fine_beam(text: str, read: Callable[[Any], np.ndarray]) -> np.ndarray:
    if text not in FINE:
        FINE[text] = read(emsim.run(text, reltol=1e-5))
    return FINE[text]


def beam(n: int) -> None:
    """flexible_pendulum.cir without its damping: a strip of rubber on a pin, let go from the horizontal, half a second."""
    e, rho, w, h = 5e6, 1100.0, 0.02, 0.005
    area, second = w * h, w * h**3 / 12
    card = f"BEAM strip l=1 n={n} ei={e * second!r} ea={e * area!r} rhoa={rho * area!r}"
    text = f"strip\n{card}\nJOINT hook 0 strip.a pin\n.gravity 9.81\n.tran 10m 0.5\n.print tran x(strip.b) y(strip.b)\n"
    times = GRID[GRID <= 0.5]

    def read(r: Any) -> np.ndarray:
        return np.array([r.at(f"{word}(strip.b)", times) for word in "xy"])

    fine = _fine_beam(text.replace(f"n={n}", "n=24"), read)
    for reltol in (1e-3, 1e-5):
        r = emsim.run(text, reltol=reltol)
        row("beam", n, "emsim", f"reltol {reltol:g}", r.stats["solve_time"], _error(read(r), fine))
    import exudyn as exu
    from exudyn.beams import GenerateStraightLineANCFCable2D
    from exudyn.utilities import Cable2D, SensorNode

    for step in (1e-3, 1e-4):
        mbs = exu.SystemContainer().AddSystem()
        cable = Cable2D(
            physicsMassPerLength=rho * area,
            physicsBendingStiffness=e * second,
            physicsAxialStiffness=e * area,
        )
        made = GenerateStraightLineANCFCable2D(
            mbs, [0, 0, 0], [1, 0, 0], n, cable, massProportionalLoad=[0, -GRAVITY, 0],
            fixedConstraintsNode0=[1, 1, 0, 0],
        )  # fmt: skip
        kind = exu.OutputVariableType.Position
        sensor = mbs.AddSensor(
            SensorNode(nodeNumber=made[0][-1], storeInternal=True, outputVariableType=kind)
        )
        mbs.Assemble()
        given = exudyn_settings(0.5, round(0.5 / step), 0.1)
        began = thread_time()
        mbs.SolveDynamic(given, solverType=exu.DynamicSolverType.GeneralizedAlpha)
        seconds = thread_time() - began
        found = mbs.GetSensorStoredData(sensor)[-len(times) :, 1:3].T
        row("beam", n, "Exudyn", f"ANCF, h {step:g}", seconds, _error(found, fine))


SCENES: dict[str, tuple[Callable[[int], None], tuple[int, ...]]] = {
    "chain": (chain, CHAINS), "pile": (pile, PILES), "rope": (rope, (4,)), "beam": (beam, BEAMS),
}  # fmt: skip


def main(asked: list[str]) -> None:
    for name in asked or list(SCENES):
        run, sizes = SCENES[name]
        for n in sizes:
            run(n)


if __name__ == "__main__":
    main(sys.argv[1:])

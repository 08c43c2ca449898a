"""MuJoCo: generalised coordinates, recursive dynamics, fixed steps; a loop is closed by a soft equality constraint.

RK4 over a ladder of steps; implicitfast, which is what its users run by default, of order 1, beside it. The loop constraint
gets solref = 2h and an impedance near 1, the stiffest that a step h carries; so does friction of joints, which keeps
creeping. A contact or stop that gives speed back is a spring and a damper for as many steps as it takes to see them.
"""

from __future__ import annotations

from math import cos, degrees, sin
from time import thread_time
from typing import Any

from . import answer, question
from .machines import (
    ARM,
    BOUNCE,
    CHAIN,
    DOUBLE,
    FOUR_BAR,
    GRAVITY,
    PENDULUM,
    SLED,
    STOP,
    rod_inertia,
    touch,
)  # fmt: skip

STEPS = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000)  # in an interval of the common times
INTEGRATORS = {"RK4": "mjINT_RK4", "implicitfast": "mjINT_IMPLICITFAST"}
POINT = 1e-12  # inertia of a point mass: MuJoCo wants one


def body(
    name: str,
    at: str,
    mass: float,
    com: str,
    inertia: float,
    inner: str = "",
    friction: float = 0.0,
    more: str = "",
) -> str:
    """A body that turns about y: the plane is x-z here, gravity along -z, and axis -y makes angles counter-clockwise."""
    j = f'<inertial pos="{com}" mass="{mass!r}" diaginertia="{POINT} {inertia!r} {inertia!r}"/>'
    joint = f'<joint name="{name}" type="hinge" axis="0 -1 0" frictionloss="{friction!r}"{more}/>'
    return f'<body name="{name}" pos="{at}">{joint}{j}{inner}</body>'


def world(inner: str, more: str = "", touches: bool = False) -> str:
    flags = f'<flag contact="{"enable" if touches else "disable"}"/>'
    if touches:
        inner = f'<geom type="plane" size="0 0 1" friction="0 0 0"/>{inner}'
    return f'<mujoco><option gravity="0 0 {-GRAVITY}">{flags}</option><worldbody>{inner}</worldbody>{more}</mujoco>'


def pendulum() -> tuple[str, list[float], list[float], dict[str, Any]]:
    m, length = PENDULUM["m"], PENDULUM["l"]
    inner = body("p", "0 0 0", m, f"0 0 {-length}", POINT)
    columns = {"angle(hinge)": lambda d: d.qpos[0], "omega(hinge)": lambda d: d.qvel[0]}
    return world(inner), [PENDULUM["start"]], [0.0], columns


def double() -> tuple[str, list[float], list[float], dict[str, Any]]:
    m, length = DOUBLE["m"], DOUBLE["l"]
    second = body("p2", f"0 0 {-length}", m, f"0 0 {-length}", POINT)
    inner = body("p1", "0 0 0", m, f"0 0 {-length}", POINT, second)
    columns = {
        "angle(p1)": lambda d: d.qpos[0], "omega(p1)": lambda d: d.qvel[0],
        "angle(p2)": lambda d: d.qpos[1], "omega(p2)": lambda d: d.qvel[1],
    }  # fmt: skip
    return world(inner), list(DOUBLE["start"]), [0.0, 0.0], columns


def chain() -> tuple[str, list[float], list[float], dict[str, Any]]:
    n, m, length = CHAIN["n"], CHAIN["m"], CHAIN["l"]
    inner = ""
    for k in range(n, 0, -1):
        at = "0 0 0" if k == 1 else f"0 0 {-length}"
        inner = body(f"j{k}", at, m, f"0 0 {-length / 2}", rod_inertia(m, length), inner)
    # from the angles: what MuJoCo keeps of positions belongs to the state before its last step
    columns = {
        "x(b20(50m,0))": lambda d: length * sum(sin(q) for q in d.qpos.cumsum()),
        "y(b20(50m,0))": lambda d: -length * sum(cos(q) for q in d.qpos.cumsum()),
        "angle(j1)": lambda d: d.qpos[0],
    }
    return world(inner), [CHAIN["start"]] + [0.0] * (n - 1), [0.0] * n, columns


def four_bar() -> tuple[str, list[float], list[float], dict[str, Any]]:
    (a, b, c), (ma, mb, mc) = FOUR_BAR["lengths"], FOUR_BAR["masses"]
    tb, tc = FOUR_BAR["angles"]
    wb, wc = FOUR_BAR["speeds"]
    w, d = FOUR_BAR["speed"], FOUR_BAR["ground"]
    # bodies are drawn at joint angle 0, along x; the loop is closed where the two ends meet
    ends = [f'<site name="{name}" pos="{length} 0 0"/>' for name, length in (("end1", b), ("end2", c))]
    coupler = body("b", f"{a} 0 0", mb, f"{b / 2} 0 0", rod_inertia(mb, b), ends[0])
    crank = body("a", "0 0 0", ma, f"{a / 2} 0 0", rod_inertia(ma, a), coupler)
    rocker = body("d", f"{d} 0 0", mc, f"{c / 2} 0 0", rod_inertia(mc, c), ends[1])
    close = '<equality><connect name="close" site1="end1" site2="end2"/></equality>'
    columns = {"angle(a)": lambda d: d.qpos[0], "omega(a)": lambda d: d.qvel[0]}
    return world(crank + rocker, close), [0.0, tb, tc], [w, wb - w, wc], columns


def arm() -> tuple[str, list[float], list[float], dict[str, Any]]:
    n, m, length = ARM["n"], ARM["m"], ARM["l"]
    inner = ""
    for k in range(n, 0, -1):
        at = "0 0 0" if k == 1 else f"0 0 {-length}"
        com, inertia, friction = f"0 0 {-length / 2}", rod_inertia(m, length), ARM["friction"][k - 1]
        inner = body(f"l{k}", at, m, com, inertia, inner, friction)
    columns: dict[str, Any] = {f"angle(l{k})": lambda d, k=k: sum(d.qpos[:k]) for k in range(1, n + 1)}
    columns |= {"omega(h1)": lambda d: d.qvel[0], "omega(l10)": lambda d: sum(d.qvel)}
    return world(inner), list(ARM["start"]), [0.0] * n, columns


def bounce() -> tuple[str, list[float], list[float], dict[str, Any]]:
    r = 0.1  # of no consequence
    j = f'<inertial pos="0 0 0" mass="{BOUNCE["m"]!r}" diaginertia="1e-3 1e-3 1e-3"/>'
    ball = f'<body pos="0 0 {r}"><joint type="slide" axis="0 0 1"/>{j}<geom type="sphere" size="{r}" friction="0 0 0"/></body>'
    columns = {"pos(up)": lambda d: d.qpos[0]}
    return world(ball, touches=True), [BOUNCE["height"]], [0.0], columns


def stop() -> tuple[str, list[float], list[float], dict[str, Any]]:
    least = f' limited="true" range="{degrees(STOP["stop"])!r} 720"'
    inner = body("hinge", "0 0 0", STOP["m"], f"0 0 {-STOP['l']}", POINT, more=least)
    columns = {"angle(hinge)": lambda d: d.qpos[0], "omega(hinge)": lambda d: d.qvel[0]}
    return world(inner), [STOP["start"]], [0.0], columns


def sled() -> tuple[str, list[float], list[float], dict[str, Any]]:
    def slide(name: str, mass: float, more: str, inner: str = "") -> str:
        j = f'<inertial pos="0 0 0" mass="{mass!r}" diaginertia="1e-3 1e-3 1e-3"/>'
        joint = f'<joint name="{name}" type="slide" axis="1 0 0" {more}/>'
        return f'<body name="{name}">{joint}{j}{inner}</body>'

    block = slide("bed", SLED["block"], f'frictionloss="{SLED["friction"]!r}"')
    columns = {"pos(rail)": lambda d: d.qpos[0], "pos(bed)": lambda d: d.qpos[1]}
    inner = slide("rail", SLED["sled"], f'stiffness="{SLED["k"]!r}"', block)
    return world(inner), [0.0, 0.0], [SLED["speed"], 0.0], columns


def stiffen(model: Any, h: float) -> None:
    """Loops, friction and contacts as stiff as steps h carry."""
    model.opt.tolerance = 1e-14
    for reference, impedance in ((model.eq_solref, model.eq_solimp), (model.dof_solref, model.dof_solimp)):
        reference[:] = (2 * h, 1.0)
        impedance[:] = (0.99999, 0.99999, 1e-3, 0.5, 2.0)
    model.geom_solref[:], model.geom_solimp[:] = (2 * h, 1.0), (0.99999, 0.99999, 1e-3, 0.5, 2.0)
    model.jnt_solimp[:] = (0.99999, 0.99999, 1e-3, 0.5, 2.0)


def rebound(model: Any, h: float, e: float) -> None:
    """Stops and contacts as a damped spring, which gives back e of the speed."""
    stiffen(model, h)
    model.geom_solref[:] = model.jnt_solref[:] = [-v for v in touch(e, h, pulls=False)]


MACHINES = {
    "ref_fric_arm10": arm, "bouncing_ball": bounce, "sled": sled, "ref_stop_pendulum": stop,
    "ref_simple_pendulum": pendulum, "ref_double_pendulum": double, "ref_chain20": chain, "ref_four_bar": four_bar,
}  # fmt: skip


# what gives back a share of its speed
REBOUNDS = {"bouncing_ball": BOUNCE["e"], "ref_stop_pendulum": STOP["e"]}


def main() -> None:
    import mujoco

    machine, times, limit, rounds = question()
    xml, position, speed, columns = MACHINES[machine]()
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    for name, integrator in INTEGRATORS.items():
        model.opt.integrator = getattr(mujoco.mjtIntegrator, integrator)
        for steps in STEPS:
            h = times[0] / steps
            model.opt.timestep = h
            if machine in REBOUNDS:
                rebound(model, h, REBOUNDS[machine])
            elif model.neq or model.dof_frictionloss.any():
                stiffen(model, h)
            spent: list[float] = []
            while len(spent) < (rounds if not spent or spent[0] < 0.3 else 1):
                mujoco.mj_resetData(model, data)
                data.qpos[:], data.qvel[:] = position, speed
                states = []
                began = thread_time()
                for _ in times:
                    mujoco.mj_step(model, data, nstep=steps)
                    states.append((data.qpos.copy(), data.qvel.copy()))
                    if thread_time() - began > limit:
                        break
                spent.append(thread_time() - began)
                if len(states) < len(times):
                    break
            tool, setting = f"MuJoCo {name}", f"h = {h:.3g}"
            count = (4 if name == "RK4" else 1) * steps * len(states)
            if len(states) < len(times):
                answer(tool, setting, min(spent), reason=f"over {limit:g} s", evaluations=count)
                break
            values: dict[str, list[float]] = {column: [] for column in columns}
            for data.qpos[:], data.qvel[:] in states:
                for column, read in columns.items():
                    values[column].append(read(data))
            answer(tool, setting, min(spent), values, evaluations=count)
            if min(spent) > 0.5 * limit:
                break


if __name__ == "__main__":
    main()

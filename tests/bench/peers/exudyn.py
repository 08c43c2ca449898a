"""Exudyn: open chains as a kinematic tree (relative angles, explicit Runge-Kutta), loops of rigid bodies with joints
(absolute coordinates, generalised alpha and the trapezoidal rule of index 2).

Fixed-step methods over a ladder of steps that hit the common times, where sensors read them. DOPRI5, which chooses its
steps, over a ladder of tolerances; angle, speed and acceleration of every step are kept and the common times read with
the quintic that these determine at both ends (its error is of higher order than the method's).

Friction is its regularised law, as steep as explicit steps h bear: it creeps where the real one holds. Stops and contacts
are its limit stops, spring and damper for as many steps as it takes to see them. Its bristles converged to no lesser error.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import cos, sin
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

STEPS = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10000)  # in an interval of the common times
TREE_METHODS = ("RK44", "RK67")
LOOP_METHODS = ("GeneralizedAlpha", "TrapezoidalIndex2")
TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11)

Columns = dict[str, Callable[[Any, Any], float]]  # of (angles or coordinates, speeds)


class Model:
    """A system ready to run, its sensors' numbers, and the deck's columns as functions of what they read; `fit(h)` gives
    what is regularised the parameters for steps h."""

    def __init__(
        self, mbs: Any, sensors: Sequence[int], columns: Columns, methods: Sequence[str],
        fit: Callable[[float], None] | None = None,
    ) -> None:  # fmt: skip
        self.mbs, self.sensors, self.columns, self.methods, self.fit = mbs, sensors, columns, methods, fit


def tree(
    masses: Sequence[float], length: float, com: float, inertia: float, start: Sequence[float],
    add: Callable[[Any, int], object] = lambda mbs, node: None,
) -> tuple[Any, Any]:  # fmt: skip
    """Links that hang from each other on pins about z; (system, sensors of angles, speeds, accelerations). `add` puts more
    on the node of the angles."""
    import exudyn as exu
    import numpy as np
    from exudyn.utilities import NodeGenericODE2, ObjectKinematicTree

    n = len(masses)
    mbs = exu.SystemContainer().AddSystem()
    node = mbs.AddNode(
        NodeGenericODE2(
            referenceCoordinates=[0.0] * n, initialCoordinates=list(start), initialCoordinates_t=[0.0] * n,
            numberOfODE2Coordinates=n,
        )
    )  # fmt: skip
    offsets, centres = exu.Vector3DList(), exu.Vector3DList()
    frames, inertias = exu.Matrix3DList(), exu.Matrix3DList()
    for k in range(n):
        offsets.Append([0, 0, 0] if k == 0 else [0, -length, 0])
        centres.Append([0, -com, 0])
        frames.Append(np.eye(3))
        inertias.Append(np.diag([0.0, 0.0, inertia]))
    mbs.AddObject(
        ObjectKinematicTree(
            nodeNumber=node, jointTypes=[exu.JointType.RevoluteZ] * n, linkParents=list(range(-1, n - 1)),
            jointTransformations=frames, jointOffsets=offsets, linkInertiasCOM=inertias, linkCOMs=centres,
            linkMasses=list(masses), gravity=[0, -GRAVITY, 0],
        )
    )  # fmt: skip
    add(mbs, node)
    return mbs, sense(mbs, node)


def sense(mbs: Any, node: int) -> list[int]:
    """Sensors of a node's coordinates, speeds and accelerations; the system is assembled."""
    import exudyn as exu
    from exudyn.utilities import SensorNode

    kinds = exu.OutputVariableType
    sensors = [
        mbs.AddSensor(SensorNode(nodeNumber=node, storeInternal=True, outputVariableType=kind))
        for kind in (kinds.Coordinates, kinds.Coordinates_t, kinds.Coordinates_tt)
    ]
    mbs.Assemble()
    return sensors


def slides(
    mass: Sequence[Sequence[float]], stiffness: Sequence[Sequence[float]], force: Sequence[float],
    start: Sequence[float], speed: Sequence[float],
) -> tuple[Any, int]:  # fmt: skip
    """(system, node) of coordinates with constant matrices."""
    import exudyn as exu
    import numpy as np
    from exudyn.utilities import NodeGenericODE2, ObjectGenericODE2

    n = len(start)
    mbs = exu.SystemContainer().AddSystem()
    node = mbs.AddNode(
        NodeGenericODE2(
            referenceCoordinates=[0.0] * n, initialCoordinates=list(start), initialCoordinates_t=list(speed),
            numberOfODE2Coordinates=n,
        )
    )  # fmt: skip
    mbs.AddObject(
        ObjectGenericODE2(
            nodeNumbers=[node], massMatrix=np.array(mass), stiffnessMatrix=np.array(stiffness),
            forceVector=list(force),
        )
    )  # fmt: skip
    return mbs, node


def between(mbs: Any, node: int, coordinate: int, **law: Any) -> int:
    """A connector with friction or limit stops on one coordinate."""
    from exudyn.utilities import (
        CoordinateSpringDamperExt,
        MarkerNodeCoordinate,
        NodeGenericData,
        NodePointGround,
    )

    ends = [
        mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=mbs.AddNode(NodePointGround()), coordinate=0)),
        mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate)),
    ]
    data = mbs.AddNode(NodeGenericData(initialCoordinates=[0.0] * 3, numberOfDataCoordinates=3))
    return int(mbs.AddObject(CoordinateSpringDamperExt(markerNumbers=ends, nodeNumber=data, **law)))


def rub(mbs: Any, node: int, first: int, bounds: Sequence[float], ease: float) -> Callable[[float], None]:
    """Friction of so many coordinates from `first` on; its fit to steps: `ease` is the largest eigenvalue of the inverse of
    their mass matrix, of which an explicit step h bears dampers up to 1/(h ease)."""
    made = [
        between(mbs, node, first + k, dynamicFrictionForce=bound, frictionProportionalZone=1.0)
        for k, bound in enumerate(bounds)
    ]

    def fit(h: float) -> None:
        for number, bound in zip(made, bounds, strict=True):
            mbs.SetObjectParameter(number, "frictionProportionalZone", bound * h * ease)

    return fit


def halt(mbs: Any, node: int, least: float, mass: float, e: float) -> Callable[[float], None]:
    """A stop at `least` of coordinate 0 that gives back e of the speed; its fit to steps."""
    far = 1e6
    stop = between(mbs, node, 0, useLimitStops=True, limitStopsLower=least, limitStopsUpper=far)

    def fit(h: float) -> None:
        k, c = touch(e, h, pulls=True)
        mbs.SetObjectParameter(stop, "limitStopsStiffness", mass * k)
        mbs.SetObjectParameter(stop, "limitStopsDamping", mass * c)

    return fit


def pendulum() -> Model:
    mbs, sensors = tree([PENDULUM["m"]], 0.0, PENDULUM["l"], 0.0, [PENDULUM["start"]])
    columns: Columns = {"angle(hinge)": lambda q, u: q[0], "omega(hinge)": lambda q, u: u[0]}
    return Model(mbs, sensors, columns, TREE_METHODS)


def double() -> Model:
    mbs, sensors = tree([DOUBLE["m"]] * 2, DOUBLE["l"], DOUBLE["l"], 0.0, DOUBLE["start"])
    columns: Columns = {
        "angle(p1)": lambda q, u: q[0], "omega(p1)": lambda q, u: u[0],
        "angle(p2)": lambda q, u: q[1], "omega(p2)": lambda q, u: u[1],
    }  # fmt: skip
    return Model(mbs, sensors, columns, TREE_METHODS)


def chain() -> Model:
    n, m, length = CHAIN["n"], CHAIN["m"], CHAIN["l"]
    start = [CHAIN["start"]] + [0.0] * (n - 1)
    mbs, sensors = tree([m] * n, length, length / 2, rod_inertia(m, length), start)
    columns: Columns = {
        "x(b20(50m,0))": lambda q, u: length * sum(sin(a) for a in q.cumsum()),
        "y(b20(50m,0))": lambda q, u: -length * sum(cos(a) for a in q.cumsum()),
        "angle(j1)": lambda q, u: q[0],
    }
    return Model(mbs, sensors, columns, TREE_METHODS)


def arm() -> Model:
    import numpy as np

    n, m, length = ARM["n"], ARM["m"], ARM["l"]
    fits: list[Callable[[float], None]] = []
    # of the stretched arm, by absolute angles: rods of which each carries those after it
    carried = np.array(
        [[n - 1 - max(i, j) + (1 / 3 if i == j else 1 / 2) for j in range(n)] for i in range(n)]
    )
    sums = np.tril(np.ones((n, n)))
    ease = 1 / np.linalg.eigvalsh(m * length**2 * sums.T @ carried @ sums)[0]
    mbs, sensors = tree(
        [m] * n, length, length / 2, rod_inertia(m, length), list(ARM["start"]),
        lambda mbs, node: fits.append(rub(mbs, node, 0, ARM["friction"], ease)),
    )  # fmt: skip
    columns: Columns = {f"angle(l{k})": lambda q, u, k=k: q[:k].sum() for k in range(1, n + 1)}  # type: ignore[misc]
    columns |= {"omega(h1)": lambda q, u: u[0], "omega(l10)": lambda q, u: u.sum()}
    return Model(mbs, sensors, columns, TREE_METHODS, fits[0])


def sled() -> Model:
    import numpy as np

    sled, block = SLED["sled"], SLED["block"]
    mass = [[sled + block, block], [block, block]]
    mbs, node = slides(mass, [[SLED["k"], 0.0], [0.0, 0.0]], [0.0, 0.0], [0.0, 0.0], [SLED["speed"], 0.0])
    fit = rub(mbs, node, 1, [SLED["friction"]], float(np.linalg.inv(mass)[1, 1]))
    columns: Columns = {"pos(rail)": lambda q, u: q[0], "pos(bed)": lambda q, u: q[1]}
    return Model(mbs, sense(mbs, node), columns, TREE_METHODS, fit)


def bounce() -> Model:
    m = BOUNCE["m"]
    mbs, node = slides([[m]], [[0.0]], [-m * GRAVITY], [BOUNCE["height"]], [0.0])
    fit = halt(mbs, node, 0.0, m, BOUNCE["e"])
    columns: Columns = {"pos(up)": lambda q, u: q[0]}
    return Model(mbs, sense(mbs, node), columns, TREE_METHODS, fit)


def stop() -> Model:
    m, length = STOP["m"], STOP["l"]
    fits: list[Callable[[float], None]] = []
    mbs, sensors = tree(
        [m], 0.0, length, 0.0, [STOP["start"]],
        lambda mbs, node: fits.append(halt(mbs, node, STOP["stop"], m * length**2, STOP["e"])),
    )  # fmt: skip
    columns: Columns = {"angle(hinge)": lambda q, u: q[0], "omega(hinge)": lambda q, u: u[0]}
    return Model(mbs, sensors, columns, TREE_METHODS, fits[0])


def four_bar() -> Model:
    import exudyn as exu
    from exudyn.utilities import (
        Force,
        MarkerBodyPosition,
        MarkerBodyRigid,
        NodeRigidBody2D,
        ObjectGround,
        ObjectJointRevolute2D,
        ObjectRigidBody2D,
    )  # fmt: skip

    lengths, masses = FOUR_BAR["lengths"], FOUR_BAR["masses"]
    angles, speeds = (0.0, *FOUR_BAR["angles"]), (FOUR_BAR["speed"], *FOUR_BAR["speeds"])
    feet = [(0.0, 0.0), (lengths[0], 0.0), (FOUR_BAR["ground"], 0.0)]
    foot_speeds = [(0.0, 0.0), (0.0, lengths[0] * speeds[0]), (0.0, 0.0)]
    mbs = exu.SystemContainer().AddSystem()
    bodies, nodes = [], []
    for (x, y), (vx, vy), half, m, a, w in zip(
        feet, foot_speeds, [0.5 * v for v in lengths], masses, angles, speeds, strict=True
    ):
        c, s = cos(a), sin(a)
        node = mbs.AddNode(
            NodeRigidBody2D(
                referenceCoordinates=[x + half * c, y + half * s, a],
                initialVelocities=[vx - half * s * w, vy + half * c * w, w],
            )
        )
        body = mbs.AddObject(
            ObjectRigidBody2D(physicsMass=m, physicsInertia=rod_inertia(m, 2 * half), nodeNumber=node)
        )
        mbs.AddLoad(
            Force(
                markerNumber=mbs.AddMarker(MarkerBodyPosition(bodyNumber=body)),
                loadVector=[0, -m * GRAVITY, 0],
            )
        )
        bodies.append(body)
        nodes.append(node)
    ground = mbs.AddObject(ObjectGround())
    halves = [0.5 * v for v in lengths]

    def pin(a: int, xa: float, b: int, xb: float) -> None:
        ends = [
            mbs.AddMarker(MarkerBodyRigid(bodyNumber=k, localPosition=[x, 0, 0]))
            for k, x in ((a, xa), (b, xb))
        ]
        mbs.AddObject(ObjectJointRevolute2D(markerNumbers=ends))

    pin(ground, 0.0, bodies[0], -halves[0])
    pin(bodies[0], halves[0], bodies[1], -halves[1])
    pin(bodies[1], halves[1], bodies[2], halves[2])
    pin(ground, FOUR_BAR["ground"], bodies[2], -halves[2])
    sensors = sense(mbs, nodes[0])
    columns: Columns = {"angle(a)": lambda q, u: q[2], "omega(a)": lambda q, u: u[2]}
    return Model(mbs, sensors, columns, LOOP_METHODS)


MACHINES = {
    "ref_simple_pendulum": pendulum, "ref_double_pendulum": double, "ref_chain20": chain, "ref_four_bar": four_bar,
    "ref_fric_arm10": arm, "sled": sled, "bouncing_ball": bounce, "ref_stop_pendulum": stop,
}  # fmt: skip


def settings(stop: float, steps: int, period: float) -> Any:
    import exudyn as exu

    s: Any = exu.SimulationSettings()
    s.timeIntegration.endTime, s.timeIntegration.numberOfSteps = stop, steps
    s.timeIntegration.verboseMode = 0
    s.timeIntegration.newton.useModifiedNewton = True
    s.timeIntegration.newton.relativeTolerance = 1e-10
    s.timeIntegration.generalizedAlpha.spectralRadius = 0.9
    s.timeIntegration.generalizedAlpha.computeInitialAccelerations = True
    s.solutionSettings.writeSolutionToFile = False
    s.solutionSettings.sensorsWritePeriod = period
    s.linearSolverSettings.ignoreSingularJacobian = False
    s.parallel.numberOfThreads = 1
    return s


def quintic(t: Any, q: Any, u: Any, a: Any, times: Any) -> tuple[Any, Any]:
    """Angles and speeds at `times` from those at the steps and their accelerations: Hermite's quintic."""
    import numpy as np
    from scipy.interpolate import BPoly

    poly = BPoly.from_derivatives(t, np.stack([q, u, a], axis=1))
    return poly(times), poly.derivative()(times)


def run(
    model: Model, times: Sequence[float], method: str, steps: int, tolerance: float | None
) -> tuple[float, Any]:
    """(CPU seconds, columns) of one run: `steps` in an interval, or steps of its own to a tolerance."""
    import exudyn as exu
    import numpy as np

    interval, stop = times[0], times[-1]
    s = settings(stop, steps * len(times), interval if tolerance is None else 0.0)
    if tolerance is not None:
        t = s.timeIntegration
        t.automaticStepSize, t.relativeTolerance, t.absoluteTolerance = True, tolerance, tolerance
        t.initialStepSize, t.numberOfSteps = 1e-2 * interval, len(times)
    began = thread_time()
    try:
        fine = model.mbs.SolveDynamic(s, solverType=getattr(exu.DynamicSolverType, method), showHints=False)
    except Exception:  # its own kind, which is no attribute of the module
        fine = False
    seconds = thread_time() - began
    if not fine:
        return seconds, None
    q, u, a = (model.mbs.GetSensorStoredData(k) for k in model.sensors)
    grid = np.array(times)
    if tolerance is None:
        rows = np.searchsorted(q[:, 0], grid - 1e-6 * interval)
        if rows.max() >= len(q) or abs(q[rows, 0] - grid).max() > 1e-6 * interval:
            return seconds, None
        angle, speed = q[rows, 1:], u[rows, 1:]
    else:
        keep = np.append(True, np.diff(q[:, 0]) > 0)
        angle, speed = quintic(q[keep, 0], q[keep, 1:], u[keep, 1:], a[keep, 1:], grid)
    return seconds, {
        name: [float(read(x, v)) for x, v in zip(angle, speed, strict=True)]
        for name, read in model.columns.items()
    }


def main() -> None:
    machine, times, limit, rounds = question()
    model = MACHINES[machine]()
    ladders: list[tuple[str, list[tuple[int, float | None]]]] = [
        (method, [(steps, None) for steps in STEPS]) for method in model.methods
    ]
    if model.methods is TREE_METHODS and model.fit is None:
        ladders.append(("DOPRI5", [(1, tolerance) for tolerance in TOLERANCES]))
    for method, ladder in ladders:
        last = 0.0
        for steps, tolerance in ladder:
            setting = f"h = {times[0] / steps:.3g}" if tolerance is None else f"tolerance {tolerance:g}"
            tool = f"Exudyn {method}"
            # it cannot be stopped half way: what would take too long by the last step count is not begun
            if last > 0.5 * limit:
                answer(tool, setting, last, reason=f"not tried: {last:.2g} s at the setting before")
                break
            if model.fit:
                model.fit(times[0] / steps)
            spent: list[float] = []
            values: Any = None
            while len(spent) < (rounds if not spent or spent[0] < 0.3 else 1):
                seconds, values = run(model, times, method, steps, tolerance)
                spent.append(seconds)
                if values is None:
                    break
            last = min(spent)
            answer(tool, setting, last, values, reason="its solver gave up")


if __name__ == "__main__":
    main()

"""Drake: MultibodyPlant in relative coordinates (recursive dynamics), error-controlled integrators of its Simulator.

A ladder of accuracies for each integrator; the simulator is advanced to each common time in turn. Loops are left out: in
continuous time Drake closes them by a compliant bushing only, which is another machine. So are joints that rub and given
coefficients of restitution. Friction is that of its contacts, regularised below a speed that falls with the accuracy.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import cos, sin
from time import thread_time
from typing import Any

from . import answer, question
from .machines import CHAIN, DOUBLE, GRAVITY, PENDULUM, SLED, rod_inertia

INTEGRATORS = ("runge_kutta5", "runge_kutta3", "radau3")
ACCURACIES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11)

Columns = dict[str, Callable[[Any, Any], float]]  # of (angles, speeds)
# system to simulate, plant in it, coordinates and speeds at the start, columns of the deck
Machine = tuple[Any, Any, Sequence[float], Sequence[float], Columns]


def tree(masses: Sequence[float], length: float, com: float, inertia: float) -> Any:
    """Links that hang from each other on pins about z, gravity along -y; a finished plant."""
    import numpy as np
    from pydrake.math import RigidTransform
    from pydrake.multibody.plant import MultibodyPlant
    from pydrake.multibody.tree import FixedOffsetFrame, RevoluteJoint, SpatialInertia, UnitInertia

    plant: Any = MultibodyPlant(time_step=0.0)
    plant.mutable_gravity_field().set_gravity_vector([0.0, -GRAVITY, 0.0])
    frame: Any = plant.world_frame()
    axis: Any = np.array([0.0, 0.0, 1.0])
    for k, m in enumerate(masses):
        # about the joint; no planar machine asks for the moments about x and y
        about = com**2 + inertia / m
        unit = UnitInertia(about, 0.0, about)
        centre: Any = np.array([0.0, -com, 0.0])
        body = plant.AddRigidBody(f"b{k}", SpatialInertia(m, centre, unit, skip_validity_check=True))
        plant.AddJoint(RevoluteJoint(f"j{k}", frame, body.body_frame(), axis))
        end = RigidTransform(np.array([0.0, -length, 0.0]))
        frame = plant.AddFrame(FixedOffsetFrame(f"end{k}", body.body_frame(), end))
    plant.Finalize()
    return plant


def pendulum() -> Machine:
    columns: Columns = {"angle(hinge)": lambda q, u: q[0], "omega(hinge)": lambda q, u: u[0]}
    plant = tree([PENDULUM["m"]], 0.0, PENDULUM["l"], 0.0)
    return plant, plant, [PENDULUM["start"]], [0.0], columns


def double() -> Machine:
    columns: Columns = {
        "angle(p1)": lambda q, u: q[0], "omega(p1)": lambda q, u: u[0],
        "angle(p2)": lambda q, u: q[1], "omega(p2)": lambda q, u: u[1],
    }  # fmt: skip
    plant = tree([DOUBLE["m"]] * 2, DOUBLE["l"], DOUBLE["l"], 0.0)
    return plant, plant, DOUBLE["start"], [0.0] * 2, columns


def chain() -> Machine:
    n, m, length = CHAIN["n"], CHAIN["m"], CHAIN["l"]
    columns: Columns = {
        "x(b20(50m,0))": lambda q, u: length * sum(sin(a) for a in q.cumsum()),
        "y(b20(50m,0))": lambda q, u: -length * sum(cos(a) for a in q.cumsum()),
        "angle(j1)": lambda q, u: q[0],
    }
    start = [CHAIN["start"]] + [0.0] * (n - 1)
    plant = tree([m] * n, length, length / 2, rod_inertia(m, length))
    return plant, plant, start, [0.0] * n, columns


def sled() -> Machine:
    """The block is a ball on a stiff bed, held to the plane of x and y; its weight makes the friction what it is."""
    import numpy as np
    from pydrake.geometry import (
        AddContactMaterial,
        HalfSpace,
        ProximityProperties,
        SceneGraph,
        Sphere,
    )  # fmt: skip
    from pydrake.math import RigidTransform
    from pydrake.multibody.plant import ContactModel, CoulombFriction, MultibodyPlant
    from pydrake.multibody.tree import PrismaticJoint, PrismaticSpring, SpatialInertia, UnitInertia
    from pydrake.systems.framework import DiagramBuilder

    m, r = SLED["block"], 0.1
    builder: Any = DiagramBuilder()
    plant: Any = builder.AddSystem(MultibodyPlant(time_step=0.0))
    scene: Any = builder.AddSystem(SceneGraph())
    plant.RegisterAsSourceForSceneGraph(scene)
    plant.set_contact_model(ContactModel.kPoint)
    plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, -GRAVITY])
    x: Any = np.array([1.0, 0.0, 0.0])
    z: Any = np.array([0.0, 0.0, 1.0])
    nowhere: Any = np.zeros(3)
    unit = UnitInertia(1e-2, 1e-2, 1e-2)
    bed = plant.AddRigidBody("sled", SpatialInertia(SLED["sled"], nowhere, unit))
    rider = plant.AddRigidBody("rider", SpatialInertia(0.0, nowhere, UnitInertia(0, 0, 0)))
    block = plant.AddRigidBody("block", SpatialInertia(m, nowhere, unit))
    rail = plant.AddJoint(PrismaticJoint("rail", plant.world_frame(), bed.body_frame(), x))
    plant.AddJoint(PrismaticJoint("bed", bed.body_frame(), rider.body_frame(), x))
    plant.AddJoint(PrismaticJoint("up", rider.body_frame(), block.body_frame(), z))
    plant.AddForceElement(PrismaticSpring(rail, 0.0, SLED["k"]))
    stiffness, mu = 1e5, SLED["friction"] / (m * GRAVITY)
    for body, shape in ((bed, HalfSpace()), (block, Sphere(r))):
        material: Any = ProximityProperties()
        # two in a row make half the stiffness
        AddContactMaterial(1.0, 2 * stiffness, CoulombFriction(mu, mu), material)
        plant.RegisterCollisionGeometry(body, RigidTransform(), shape, body.name(), material)
    builder.Connect(plant.get_geometry_pose_output_port(), scene.get_source_pose_port(plant.get_source_id()))
    builder.Connect(scene.get_query_output_port(), plant.get_geometry_query_input_port())
    plant.Finalize()
    columns: Columns = {"pos(rail)": lambda q, u: q[0], "pos(bed)": lambda q, u: q[1]}
    start, speed = [0.0, 0.0, r - m * GRAVITY / stiffness], [SLED["speed"], 0.0, 0.0]
    return builder.Build(), plant, start, speed, columns


MACHINES = {
    "ref_simple_pendulum": pendulum,
    "ref_double_pendulum": double,
    "ref_chain20": chain,
    "sled": sled,
}


def run(
    machine: Machine, times: Sequence[float], scheme: str, accuracy: float, limit: float
) -> tuple[float, list[tuple[Any, Any]], int]:
    """(CPU seconds, (angles, speeds) at the times that were reached, derivative evaluations)."""
    from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator

    system, plant, start, speed, _ = machine
    plant.set_stiction_tolerance(accuracy)
    simulator = Simulator(system)
    ResetIntegratorFromFlags(simulator, scheme, times[0])
    integrator = simulator.get_mutable_integrator()
    integrator.set_fixed_step_mode(False)
    integrator.set_target_accuracy(accuracy)
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    plant.SetPositions(context, list(start))
    plant.SetVelocities(context, list(speed))
    simulator.Initialize()
    states = []
    began = thread_time()
    for t in times:
        simulator.AdvanceTo(t)
        states.append((plant.GetPositions(context).copy(), plant.GetVelocities(context).copy()))
        if thread_time() - began > limit:
            break
    return thread_time() - began, states, integrator.get_num_derivative_evaluations()


def main() -> None:
    machine, times, limit, rounds = question()
    if machine not in MACHINES:
        return
    built = MACHINES[machine]()
    for scheme in INTEGRATORS:
        last = 0.0
        for accuracy in ACCURACIES:
            tool, setting = f"Drake {scheme}", f"accuracy {accuracy:g}"
            if last > 0.5 * limit:
                answer(tool, setting, last, reason=f"not tried: {last:.2g} s at the setting before")
                break
            spent: list[float] = []
            states: list[tuple[Any, Any]] = []
            count, why = 0, f"over {limit:g} s"
            while len(spent) < (rounds if not spent or spent[0] < 0.3 else 1):
                try:
                    seconds, states, count = run(built, times, scheme, accuracy, limit)
                except RuntimeError as error:
                    seconds, states, why = 0.0, [], str(error)[:120]
                spent.append(seconds)
                if len(states) < len(times):
                    break
            last = min(spent)
            whole = len(states) == len(times)
            values = (
                {name: [read(q, u) for q, u in states] for name, read in built[-1].items()} if whole else None
            )
            answer(tool, setting, last, values, reason=why, evaluations=count)
            if not whole:
                break


if __name__ == "__main__":
    main()

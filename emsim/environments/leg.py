"""emsim/Leg-v0: a leg of a quadruped hops forward on a boom, by the voltages of its two motors.

action        voltages of hip and knee, -1 .. 1 for -24 V .. 24 V, held for 20 ms
observation   height of the trunk [m], its speed up and forward [m/s], angles of hip and knee [rad], their speeds
[rad/s], force
              of the ground on the foot [N]
reward        0.2 + speed forward [m/s] - 1e-4 of the motors' power that heats them [W] at the end of each step
terminated    the trunk below 0.15 m, or a joint more than 2.6 rad from where it is straight
truncated     after 10 s
start         hip and knee 0.1 rad about the deck's pose, evenly drawn, at rest, the foot above the ground
"""

from __future__ import annotations

from os.path import dirname, join

from .environment import Environment, Task

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .vector import Vector

DECK = join(dirname(__file__), "leg.cir")
SEEN = (
    "pos(lift)", "vel(lift)", "vel(along)", "angle(hip)", "angle(knee)", "omega(hip)", "omega(knee)", "force(foot)",
)  # fmt: skip


def task(deck: str = DECK, **changed: Any) -> Task:
    """The task, with another deck or other arguments of `Task`."""
    given: dict[str, Any] = {
        "actions": {"vhip": (-24.0, 24.0), "vknee": (-24.0, 24.0)},
        "observations": list(SEEN),
        "reward": "0.2+vel(along)-1e-4*0.3*(i(mhip)^2+i(mknee)^2)",
        "ends": ["0.15-pos(lift)", "abs(angle(hip))-2.6", "abs(angle(knee))-2.6"],
        "start": {"angle(hip)": (-0.80, -0.60), "angle(knee)": (1.30, 1.50)},
        "dt": 0.02,
        "duration": 10.0,
    }
    return Task(deck, **(given | changed))


def make(render_mode: str | None = None, **changed: Any) -> Environment:
    return Environment(task(**changed), render_mode)


def make_vec(num_envs: int = 1, threads: int | None = None, **changed: Any) -> Vector:
    from .vector import Vector

    return Vector(task(**changed), num_envs, threads)

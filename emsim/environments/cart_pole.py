"""emsim/CartPole-v0: a pole is kept upright on a cart by the voltage of the cart's motor.

action        the motor's voltage, -1 .. 1 for -12 V .. 12 V, held for 20 ms
observation   pos(rail) [m], vel(rail) [m/s], angle(hinge) [rad, 0 upright], omega(hinge) [rad/s], i(m1) [A]
reward        1 - (angle / 0.25)^2 - 0.1 (pos / 1 m)^2 at the end of each step
terminated    beyond 1 m of the middle, or 0.25 rad from upright
truncated     after 10 s
start         0.05 m and 0.05 rad to either side, evenly drawn, at rest
"""

from __future__ import annotations

from os.path import dirname, join

from .environment import Environment, Task

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .vector import Vector

DECK = join(dirname(__file__), "cart_pole.cir")


def task(deck: str = DECK, **changed: Any) -> Task:
    """The task, with another deck or other arguments of `Task`."""
    given: dict[str, Any] = {
        "actions": {"vdrive": (-12.0, 12.0)},
        "observations": ["pos(rail)", "vel(rail)", "angle(hinge)", "omega(hinge)", "i(m1)"],
        "reward": "1-(angle(hinge)/0.25)^2-0.1*pos(rail)^2",
        "ends": ["abs(pos(rail))-1", "abs(angle(hinge))-0.25"],
        "start": {"pos(rail)": (-0.05, 0.05), "angle(hinge)": (-0.05, 0.05)},
        "dt": 0.02,
        "duration": 10.0,
    }
    return Task(deck, **(given | changed))


def make(render_mode: str | None = None, **changed: Any) -> Environment:
    return Environment(task(**changed), render_mode)


def make_vec(num_envs: int = 1, threads: int | None = None, **changed: Any) -> Vector:
    from .vector import Vector

    return Vector(task(**changed), num_envs, threads)

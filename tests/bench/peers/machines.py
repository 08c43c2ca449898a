"""The machines that other engines build too: the parameters of their decks, once for all engines.

Angles are counted from straight down, positive counter-clockwise about the axis out of the plane of x and y (gravity along
-y), as in the decks. Exact values at some times stand in tests/physics/test_exact.py.
"""

from math import log, pi, sin, tan
from typing import Any

GRAVITY = 9.81
QUARTER = 1.5707963267948966  # pi/2

# netlists/mechanical/ref_simple_pendulum.cir: point mass m at distance l
PENDULUM: dict[str, Any] = {"m": 1.0, "l": 1.0, "start": QUARTER}
# netlists/mechanical/ref_double_pendulum.cir: two of them; the second angle is relative
DOUBLE: dict[str, Any] = {"m": 1.0, "l": 1.0, "start": (QUARTER, 0.0)}
# netlists/mechanical/ref_chain20.cir: uniform rods
CHAIN: dict[str, Any] = {"n": 20, "m": 0.05, "l": 0.05, "start": QUARTER}
# netlists/mechanical/ref_four_bar.cir: uniform rods; crank from +x, angle 0 and speed 10 rad/s at the start
FOUR_BAR: dict[str, Any] = {
    "lengths": (0.10, 0.24, 0.20), "masses": (0.10, 0.24, 0.20), "ground": 0.22, "speed": 10.0,
    # absolute angles of coupler and rocker from +x at the start, and their speeds
    "angles": (0.981765356578622737, 1.50408017838467136), "speeds": (-25 / 3, -25 / 3),
}  # fmt: skip
# netlists/mechanical/ref_fric_arm10.cir: rods whose joints rub [N m]; the first angle is absolute, the others are relative
ARM: dict[str, Any] = {
    "n": 10, "m": 0.5, "l": 0.3, "start": (1.2, *(-0.6 / 9 for _ in range(9))),
    "friction": tuple(2.5 - 0.25 * k for k in range(10)),
}  # fmt: skip
# netlists/bench/sled.cir: sled on a spring, block that rubs on it [N]; speed of both at the start
SLED: dict[str, Any] = {"sled": 1.0, "block": 0.5, "k": 10.0, "friction": 1.0, "speed": 3.0}
# netlists/mechanical/ref_stop_pendulum.cir: point mass against a stop, with a coefficient of restitution
STOP: dict[str, Any] = {
    "m": 1.0,
    "l": 1.0,
    "start": 1.0471975511965976,
    "stop": 0.17453292519943295,
    "e": 0.7,
}
# netlists/mechanical/bouncing_ball.cir: from a height, with a coefficient of restitution
BOUNCE: dict[str, Any] = {"m": 1.0, "height": 1.0, "e": 0.8}


TOUCH = 20  # steps that a touch takes which gives speed back


def touch(e: float, h: float, pulls: bool) -> tuple[float, float]:
    """Spring and damper of a unit mass that give back e of the speed in TOUCH steps h [1/s^2, 1/s].

    x = exp(-d t) sin(w t) with d = w cot(p), p = arccos of the damping ratio. One that pulls lets go at w t = pi, where x
    is 0 and the speed exp(-pi cot(p)) of what it was; one that does not at w t = 2 p, where the force is 0, and gives back
    exp(-2 p cot(p)), at least exp(-2).
    """
    lost, low, high = -log(e), 1e-6, pi / 2
    for _ in range(60):
        p = 0.5 * (low + high)
        low, high = (p, high) if (pi if pulls else 2 * p) / tan(p) > lost else (low, p)
    w = (pi if pulls else 2 * p) / (TOUCH * h)
    return (w / sin(p)) ** 2, 2 * w / tan(p)


def rod_inertia(m: float, length: float) -> float:
    """About the centre, axis across [kg m^2]."""
    return m * length**2 / 12

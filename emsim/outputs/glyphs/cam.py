"""CAM: its profile with the follower's stem on it, red while it presses; a Geneva wheel with its crank; else a disc."""

from __future__ import annotations

import math

from .marks import THIN, bar, framed, polar

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .contract import Pen, Scene, Shape


def cam(m: Scene, pen: Pen, s: Shape) -> None:
    a, b = m.place(s["first"]["b"]), m.place(s["second"]["a"])
    share, r = abs(m.share(s["effort"])), 18 * pen.unit
    colour, width = "force" if share > 0.01 else "edge", 1.5 + 2.5 * share
    turn = m.poses[int(s["second"]["a"][0])].angle + m.value(s["second"]["q"]) + s["second"]["zero"]
    if "slots" in s:
        geneva(m, pen, s, turn)
    elif "base" in s:
        lobe(m, pen, s, [colour, width])
    else:
        pen.circle(polar(b, 0.45 * r, -turn), r, None, colour, width)
        pen.line([a, b], "soft", 1.5, 5)
    pen.label(b, 29, 18, s["name"], "soft")


def lobe(m: Scene, pen: Pen, s: Shape, look: list[Any]) -> None:
    """Its radius is base + lift in the follower's direction: lift at an angle q stands off that direction by -q on the cam."""
    at, angle, lift = m.place(s["second"]["a"]), m.axis_angle(s["first"]), s["lift"]
    q, n = m.value(s["second"]["q"]), len(lift) - 1
    points = [polar(at, (s["base"] + lift[k]) * m.scale, angle - q + 2 * math.pi * k / n) for k in range(n)]
    pen.polygon(points, "body", look[0], look[1])
    pen.line([at, points[0]], "edge", 0.7)
    tip = polar(at, (s["base"] + m.value(s["first"]["q"])) * m.scale, angle)
    bar(pen, [polar(tip, 3 * pen.unit, angle), m.place(s["first"]["b"])], 5)
    pen.circle(polar(tip, 4 * pen.unit, angle), 4 * pen.unit, "panel", "edge", THIN)


def geneva(m: Scene, pen: Pen, s: Shape, turn: float) -> None:
    """The wheel, and above it the crank with its pin, d sin(pi/n) from its middle where the shafts stand d apart, and its
    round part that holds the wheel between two turns."""
    a, b, n = m.place(s["first"]["a"]), m.place(s["second"]["a"]), s["slots"]
    far, line = math.hypot(b[0] - a[0], b[1] - a[1]), math.atan2(a[1] - b[1], b[0] - a[0])
    crank, lift, count = far * math.sin(math.pi / n), s["lift"], len(s["lift"]) - 1
    # as the pin stands between the shafts a slot does too: that far is the wheel turned then
    meets = int(
        count * ((line + math.pi) / (2 * math.pi) - math.floor((line + math.pi) / (2 * math.pi))) + 0.5
    )
    wheel_turn = m.poses[int(s["first"]["b"][0])].angle
    slot = wheel_turn + line - lift[meets]
    large, deep, wide, held = far * math.cos(math.pi / n), far - crank - 0.06 * far, 0.07 * crank, 0.8 * crank
    points = []
    for k in range(n):
        way = slot + 2 * math.pi * k / n
        for x, y in [[large, -wide], [deep, -wide], [deep, wide], [large, wide]]:
            points.append(framed(a, -way, x, -y))
        hollow = way + math.pi / n
        # the part of the crank's round that lies within the wheel
        reach = math.acos(max(-1.0, min(1.0, (far * far + held * held - large * large) / (2 * far * held))))
        for j in range(9):
            t = reach * (j / 4 - 1)
            points.append(framed(a, -hollow, far - held * math.cos(t), -held * math.sin(t)))
    pen.polygon(points, "body", "edge", THIN)
    pen.line([a, framed(a, -slot, 0.6 * deep, 0)], "edge", 0.7)
    open_way = math.pi / 2 - math.pi / n + 0.35
    round_part = [
        polar(b, 0.94 * held, -(turn + open_way + (2 * math.pi - 2 * open_way) * k / 24)) for k in range(25)
    ]
    pen.polygon([*round_part, polar(b, 0.25 * held, -turn)], "body", "edge", THIN)
    tip = polar(b, crank, -turn)
    bar(pen, [b, tip], 0.2 * crank)
    pen.circle(tip, 0.8 * wide, "panel", "edge", THIN)

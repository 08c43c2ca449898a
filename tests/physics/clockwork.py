"""A clock by itself: pins of a wheel on two pallets of an anchor, from face to corner to face, by scipy. Nothing of the program
is used."""

from __future__ import annotations

from math import cos, pi, sin, tan

import numpy as np
from scipy.integrate import solve_ivp

G = 9.81
N, RO, PIN, HALF, W, H = 12, 0.02, 0.4e-3, 7 * pi / 24, 4e-3, 6e-3
PIVOT, REACH = RO / cos(HALF), RO * tan(HALF)
UNLOCK, LIFT = pi / 180, pi / 72
L, M, DAMP, LOAD, DRUM = 0.25, 0.2, 0.8e-3, 12e-3, 5e-3
ANCHOR, WHEEL = 20e-6 + M * L * L, 2e-6 + LOAD * DRUM**2
INVERSE = np.array([1 / ANCHOR, 1 / WHEEL])
STEP = 2 * pi / N


def turned(a):
    return np.array([[cos(a), -sin(a)], [sin(a), cos(a)]])


QUARTER = turned(pi / 2)


def seen(tooth, y):
    """Middle of a pin in axes of the anchor, its slopes by both angles, and what their rates add to its acceleration."""
    swing, wheel, ds, dw = y
    back = turned(-swing)
    at = back @ turned(wheel + tooth * STEP) @ np.array([0.0, RO])
    away = at - back @ np.array([0.0, PIVOT])
    slopes = np.array([-QUARTER @ away, QUARTER @ at])
    return away, slopes, -away * ds * ds + 2 * at * ds * dw - at * dw * dw


class Pallet:
    """A convex outline in axes of the anchor, of which faces and corners are touched in turn; its outside to the right."""

    def __init__(self, corners) -> None:
        self.corners = [np.array(c) for c in corners]
        self.ways = [
            (q - p) / np.hypot(*(q - p)) for p, q in zip(self.corners, self.corners[1:], strict=False)
        ]

    def part(self, tooth, y):
        """What of it is next to a pin: 2 k the k-th face, 2 k + 1 the corner at its end."""
        away = seen(tooth, y)[0]
        for k, way in enumerate(self.ways):
            if way @ (away - self.corners[k + 1]) < 0.0:
                return 2 * k
            if k + 1 == len(self.ways) or self.ways[k + 1] @ (away - self.corners[k + 1]) < 0.0:
                return 2 * k + 1
        raise AssertionError

    def gap(self, part, tooth, y):
        """Distance, its slopes by both angles, and what their rates add to its second rate."""
        away, slopes, turns = seen(tooth, y)
        k = part // 2
        if part % 2 == 0:
            normal = -QUARTER @ self.ways[k]
            return normal @ (away - self.corners[k]) - PIN, slopes @ normal, normal @ turns
        off = away - self.corners[k + 1]
        size = np.hypot(*off)
        normal, rate = off / size, y[2:] @ slopes
        bend = (rate @ rate - (normal @ rate) ** 2) / size
        return size - PIN, slopes @ normal, normal @ turns + bend

    def end(self, part, tooth, y):
        """Below 0 while it is that part: how far the pin is past it."""
        away, k = seen(tooth, y)[0] - self.corners[part // 2 + 1], part // 2
        if part % 2 == 0:
            return self.ways[k] @ away
        return self.ways[k + 1] @ away if k + 1 < len(self.ways) else -1.0


def pallets():
    """Of entry and exit: lock, push, the face behind; outside to the right of the way."""
    a, sag = -REACH * UNLOCK, W**2 / (2 * RO) - PIN
    b1, b2 = ((REACH + side * W) * LIFT + sag for side in (-1, 1))
    lock1, lock2 = REACH - PIN, REACH + PIN
    entry = [(lock1, -H), (lock1, a), (lock1 - W, b1)]
    leave = [(lock2, H), (lock2, -a), (lock2 + W, -b2)]
    return Pallet([turned(HALF - pi) @ c for c in entry]), Pallet([turned(-HALF) @ c for c in leave])


def pushes(y):
    return np.array([-M * G * L * sin(y[0]) - DAMP * y[2], -LOAD * G * DRUM])


def pressing(pallet, part, tooth, y):
    """The force of a pin on a pallet, and the accelerations."""
    _, slopes, turns = pallet.gap(part, tooth, y)
    acts = INVERSE * pushes(y)
    load = -(slopes @ acts + turns) / (slopes @ (INVERSE * slopes))
    return load, acts + INVERSE * slopes * load


class Clock:
    """Runs on: `t`, `y` (angles of anchor and wheel, their rates), `lost` [J] in the impacts at `impacts`."""

    def __init__(self, swing, wheel) -> None:
        self.t, self.y, self.lost = 0.0, np.array([swing, wheel, 0.0, 0.0]), 0.0
        self.parts, self.impacts = [], []

    def go(self, accelerations, events, until, longest=0.01):
        """To the first event, its number; None at the end."""
        for event in events:
            event.terminal = True
        r = solve_ivp(
            lambda _, y: [y[2], y[3], *accelerations(y)], (self.t, until), self.y, method="DOP853", rtol=1e-12,
            atol=1e-15, events=events, max_step=longest, dense_output=True,
        )  # fmt: skip
        self.parts.append((self.t, r.t[-1], r.sol))
        self.t, self.y = r.t[-1], r.y[:, -1]
        return next((k for k, times in enumerate(r.t_events) if len(times)), None)

    def fly(self, meets, until):
        """Until a pin meets one of the pallets; which one."""
        events = []
        for pallet, tooth in meets:
            event = lambda _, y, p=pallet, k=tooth: p.gap(p.part(k, y), k, y)[0]  # noqa: E731
            event.direction = -1
            events.append(event)
        which = self.go(lambda y: INVERSE * pushes(y), events, until, 2e-4)
        if which is not None:
            pallet, tooth = meets[which]
            _, slopes, _ = pallet.gap(pallet.part(tooth, self.y), tooth, self.y)
            closing, free = slopes @ self.y[2:], slopes @ (INVERSE * slopes)
            self.lost += 0.5 * closing**2 / free
            self.y = self.y - np.array([0.0, 0.0, *(INVERSE * slopes * closing / free)])
            self.impacts.append(self.t)
        return which

    def press(self, pallet, tooth, until):
        """Until the pin no longer presses."""
        part = pallet.part(tooth, self.y)
        while True:
            past = lambda _, y, part=part: pallet.end(part, tooth, y)  # noqa: E731
            eased = lambda _, y, part=part: pressing(pallet, part, tooth, y)[0]  # noqa: E731
            past.direction, eased.direction = 1, -1
            if eased(0.0, self.y) <= 0.0:
                return True
            which = self.go(lambda y, part=part: pressing(pallet, part, tooth, y)[1], [past, eased], until)
            if which is None:
                return False
            if which == 1:
                assert pallet.part(tooth, self.y) == part
                return True
            part += 1

    def run(self, until):
        """From before a pin on the entry pallet."""
        entry, leave = pallets()
        meets = [(entry, 2)]
        while (which := self.fly(meets, until)) is not None:
            pallet, tooth = meets[which]
            if not self.press(pallet, tooth, until):
                break
            # the same once more, or the other pallet with the pin that is next to it
            meets = [(pallet, tooth), (leave, tooth - 3) if pallet is entry else (entry, tooth + 4)]
        return self

    def at(self, t):
        return next(sol(t) for begin, end, sol in self.parts if begin <= t <= end)

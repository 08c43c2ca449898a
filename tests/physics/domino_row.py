"""A row of dominoes hinged at their lower front edges, without friction, by scipy. Nothing of the program is used.

Angles count forwards. The front corner of a domino at a slides on the back of the next one at b: h sin(a - b) = s cos b - d.
All that lean on each other have one freedom, the angle of the foremost. They come to be parallel all at once, at s cos a = d.
"""

from __future__ import annotations

from math import acos, asin, atan2, cos, hypot, pi, sin, sqrt

import numpy as np
from scipy.integrate import quad, solve_ivp

G = 9.81


class Row:
    """`strikes` and what each has `lost`, `parallel` and what that has lost, when the last one is `down` [s, J]."""

    def __init__(self, n: int, h: float, d: float, s: float, m: float, push: float) -> None:
        self.h, self.d, self.s, self.weight = h, d, s, m * G * hypot(h, d) / 2
        self.inertia, self.back, self.meets = m * (h * h + d * d) / 3, atan2(d, h), asin((s - d) / h)
        self.strikes, self.lost, self.parts = [], [], []
        t, rate = 0.0, push
        for k in range(1, n):
            t, rate = self.fall(k, t, rate, 0.0, self.meets)
            # the strike is plastic: of the motion there remains what the train with the struck one can have
            (a, old, _), new = self.train(k, self.meets), self.train(k + 1, 0.0)[1]
            after = rate * (old @ new[:-1]) / (new @ new)
            stopped = self.inertia * (old * rate - new[:-1] * after)
            assert min(self.pressed([*a, 0.0], stopped)) > 0.0
            self.strikes.append(t)
            self.lost.append(0.5 * self.inertia * (rate**2 * (old @ old) - after**2 * (new @ new)))
            rate = after
        flat = acos(d / s)
        self.parallel, rate = self.fall(n, t, rate, 0.0, flat)
        # there each is stopped by the lower back edge of the next, which moves along its face: the last one goes on alone
        self.stopped = 0.5 * self.inertia * rate**2 * (self.train(n, flat)[1][:-1] ** 2).sum()
        self.down, _ = self.fall(1, self.parallel, rate, flat, pi / 2)

    def train(self, k, q):
        """Angles of the first k, and their first and second slopes by that of the k-th."""
        found = [(q, 1.0, 0.0)]
        for _ in range(k - 1):
            b, once, twice = found[0]
            y, slope, bend = np.array([self.s * cos(b) - self.d, -self.s * sin(b), -self.s * cos(b)]) / self.h
            root = sqrt(1 - y * y)
            by, bent = 1 + slope / root, bend / root + y * slope**2 / root**3
            found.insert(0, (b + asin(y), by * once, bent * once**2 + by * twice))
        return np.array(found).T

    def rates(self, k, y):
        """Of the foremost one's angle and rate; angles of all, and the moment that each gives away to its neighbours."""
        a, once, twice = self.train(k, y[0])
        torque = self.weight * np.sin(a - self.back)
        bend = (torque @ once / self.inertia - y[1] ** 2 * (once @ twice)) / (once @ once)
        return [y[1], bend], a, torque - self.inertia * (once * bend + twice * y[1] ** 2)

    def pressed(self, a, given):
        """The force, or impulse, of each on the next: about its own edge it is what is `given` and what it got from behind."""
        loads, got = [], 0.0
        for behind, ahead, own in zip(a, a[1:], given, strict=False):
            arm = self.h * cos(behind - ahead)
            loads.append((own + got) / arm)
            got = loads[-1] * (arm - self.s * sin(ahead))
        return np.array(loads)

    def fall(self, k, t, rate, begin, end):
        """The foremost of k from an angle to another one: when it is there, and at what rate."""
        there = lambda _, y: y[0] - end  # noqa: E731
        there.terminal = True
        r = solve_ivp(
            lambda _, y: self.rates(k, y)[0], (t, t + 1.0), [begin, rate], method="DOP853", rtol=1e-12, atol=1e-14,
            events=there, dense_output=True,
        )  # fmt: skip
        assert r.status == 1
        self.parts.append((k, t, r.t[-1], r.sol))
        return r.t[-1], r.y[1, -1]

    def by_energy(self, k):
        """How long the k-th takes to its strike, by a quadrature: J S(q) q'^2/2 + V(q) is kept."""
        _, begin, _, sol = self.parts[k - 1]
        stands = lambda q: self.weight * np.cos(self.train(k, q)[0] - self.back).sum()  # noqa: E731
        moves = lambda q: 0.5 * self.inertia * (self.train(k, q)[1] ** 2).sum()  # noqa: E731
        energy = moves(0.0) * sol(begin)[1] ** 2 + stands(0.0)
        return quad(lambda q: sqrt(moves(q) / (energy - stands(q))), 0.0, self.meets, epsabs=1e-13)[0]

    def at(self, t):
        """Until they are parallel: angles of those that move, and the force of each on the next [N]."""
        k, sol = next((k, sol) for k, begin, end, sol in self.parts if begin <= t <= end)
        _, a, given = self.rates(k, sol(t))
        return a, self.pressed(a, given)

    def rest(self, n):
        """Angles in the end: the last one flat, each other one on the lower back edge of the next."""
        found = [pi / 2]
        for _ in range(n - 1):
            found.insert(0, atan2(self.s - self.d * cos(found[0]), self.d * sin(found[0])))
        return np.array(found)

"""Ellipsoids and balls on a plane by themselves: equations of motion of one rigid body with its point of touch, by scipy.
Nothing of the program is used."""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

G = 9.81
TIGHT = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-14, "dense_output": True}


def quaternion_rate(q, w):
    """Of x, y, z, s for body rates w."""
    x, y, z, s = q
    return 0.5 * np.array(
        [
            s * w[0] + y * w[2] - z * w[1],
            s * w[1] + z * w[0] - x * w[2],
            s * w[2] + x * w[1] - y * w[0],
            -x * w[0] - y * w[1] - z * w[2],
        ]
    )


class RollingStone:
    """An ellipsoid that rolls on z = 0, its middle `high` above its centre of mass along its own z. In its own axes, with k the
    normal, a the arm from the centre of mass to where it touches and v = -w x a:
        J w' + w x J w = a x F,   F = m (v' + w x v + g k),   k' = k x w."""

    def __init__(self, semi, high, m, j, rot, w) -> None:
        self.squares, self.middle = np.array(semi) ** 2, np.array([0.0, 0.0, high])
        self.m, self.j, self.w = m, np.array(j), np.array(w, dtype=float)
        self.turned = Rotation.from_rotvec(rot)
        k = self.turned.as_matrix()[2]
        arm = self.arm(k)[0]
        self.height = float(-arm @ k)
        self.velocity = [float(v) for v in self.turned.as_matrix() @ -np.cross(self.w, arm)]

    def arm(self, k, rate=(0.0, 0.0, 0.0)):
        """It, and its rate for that of k."""
        rate = np.asarray(rate)
        size = np.sqrt(self.squares @ k**2)
        moved = self.squares * rate / size - self.squares * k * ((self.squares * k) @ rate) / size**3
        return self.middle - self.squares * k / size, -moved

    def rates(self, _, y):
        q, w = y[:4] / np.linalg.norm(y[:4]), y[4:7]
        turned = Rotation.from_quat(q).as_matrix()
        k = turned[2]
        a, moved = self.arm(k, np.cross(k, w))
        v = -np.cross(w, a)
        skew = np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])
        push = -np.cross(w, moved) + np.cross(w, v) + G * k
        turns = np.linalg.solve(
            self.j - self.m * skew @ skew, self.m * np.cross(a, push) - np.cross(w, self.j @ w)
        )
        return [*quaternion_rate(q, w), *turns, *(turned @ v)]

    def run(self, until, t):
        start = [*self.turned.as_quat(), *self.w, 0.0, 0.0, self.height]
        return solve_ivp(self.rates, (0.0, until), start, **TIGHT).sol(t)


class SlidingTop:
    """A ball that slides on z = 0 with Coulomb friction, its middle `high` above its centre of mass along its axis."""

    def __init__(self, r, high, m, j, mu, lean, spin) -> None:
        self.r, self.high, self.m, self.mu = r, high, m, mu
        self.j = np.diag(j)
        self.turned = Rotation.from_rotvec([lean, 0.0, 0.0])
        self.w = self.turned.as_matrix().T @ np.array([0.0, 0.0, spin])
        self.height = float(r - high * np.cos(lean))

    def rates(self, _, y):
        q, v, w = y[3:7] / np.linalg.norm(y[3:7]), y[7:10], y[10:13]
        turned = Rotation.from_quat(q).as_matrix()
        axis, spin = turned[:, 2], turned @ w
        arm = self.high * axis - np.array([0.0, 0.0, self.r])
        slip = v + np.cross(spin, arm)
        slip[2] = 0.0
        force = np.array([0.0, 0.0, 1.0]) - self.mu * slip / np.linalg.norm(slip)
        j = turned @ self.j @ turned.T
        own = -np.linalg.solve(j, np.cross(spin, j @ spin))
        by_load = np.linalg.solve(j, np.cross(arm, force))
        # its middle stays at the height r
        falls = np.cross(own, axis) + np.cross(spin, np.cross(spin, axis))
        load = (G - self.high * falls[2]) / (1.0 / self.m + self.high * np.cross(by_load, axis)[2])
        speeds = load * force / self.m - np.array([0.0, 0.0, G])
        return [*v, *quaternion_rate(q, w), *speeds, *(turned.T @ (own + load * by_load))]

    def run(self, until, t):
        start = [0.0, 0.0, self.height, *self.turned.as_quat(), 0.0, 0.0, 0.0, *self.w]
        return solve_ivp(self.rates, (0.0, until), start, **TIGHT).sol(t)


class RollingDisc:
    """A thin disc that rolls on z = 0 without slip, against a moment `rolling` N along its turning in the plane, N the load.
    In world axes, with e its axle, k the normal, a the arm to where it touches and v = -w x a:
        J w' + w x J w = a x F - rolling N t,   F = m (v' + g k),   N = k F,   e' = w x e."""

    def __init__(self, r, m, rolling, axle, w) -> None:
        self.r, self.m, self.rolling = r, m, rolling
        self.axle, self.w = np.array(axle, dtype=float), np.array(w, dtype=float)

    def arm(self, e, rate=(0.0, 0.0, 0.0)):
        """It, and its rate for that of e."""
        k, rate = np.array([0.0, 0.0, 1.0]), np.asarray(rate)
        up = k - e[2] * e
        size = np.linalg.norm(up)
        moved = -rate[2] * e - e[2] * rate
        return -self.r * up / size, -self.r * (moved / size - up * (up @ moved) / size**3)

    def rates(self, _, y):
        e, w, m = y[:3] / np.linalg.norm(y[:3]), y[3:6], self.m
        k = np.array([0.0, 0.0, 1.0])
        j = 0.25 * m * self.r**2 * (np.eye(3) + np.outer(e, e))
        a, moved = self.arm(e, np.cross(w, e))
        skew = np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])
        push = m * (G * k - np.cross(w, moved))
        along = np.array([w[0], w[1], 0.0]) / np.hypot(w[0], w[1])
        lever = skew - self.rolling * np.outer(along, k)  # of F: its moment about the centre
        turns = np.linalg.solve(j - m * lever @ skew, lever @ push - np.cross(w, j @ w))
        return [*np.cross(w, e), *turns, *-np.cross(w, a)[:2]]

    def run(self, until, t):
        """Axle, turning and place at the times t."""
        return solve_ivp(self.rates, (0.0, until), [*self.axle, *self.w, 0.0, 0.0], **TIGHT).sol(t)

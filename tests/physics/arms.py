"""Open chains and trees of rigid bodies by numpy alone: M(q) from the Jacobians of the centres of mass, derivatives by complex
steps, M q" + M' q' - d/dq (q'.M q'/2) + dV/dq = tau. Shares nothing with the engine, which differentiates energies.

Everything is computed of many q at once, (count, n): the steps in all directions are one call.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp

STEP = 1e-30  # of a complex step: nothing is subtracted, so it may be as small as it likes


def about(axis, angle):
    """The rotation about a unit vector; of complex angles too, (count,) or one."""
    x, y, z = axis
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = np.asarray(angle)[..., None, None]
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * (k @ k)


class Part:
    """A link on its joint. `parent`: its number, -1 the ground; `r`, `p`: where the joint is in the parent; mass, centre and
    tensor about the centre in the axes of the link. `rotor`: inertia and gear of a motor that sits on the parent."""

    def __init__(self, parent, r, p, axis, m, c, j, slides=False, rotor=(0.0, 1.0)):
        self.parent, self.r, self.slides, self.m, self.rotor = parent, r, slides, m, rotor
        self.p, self.axis, self.c, self.j = (np.asarray(v, float) for v in (p, axis, c, j))


class Arm:
    def __init__(self, parts, gravity=(0.0, 0.0, -9.81)):
        self.parts, self.g = parts, np.asarray(gravity, float)

    def _walk(self, q):
        """Of every link: rotation, origin, and columns of the Jacobians of its origin and its turn, for every q."""
        count, n = q.shape
        ground = (
            np.broadcast_to(np.eye(3), (count, 3, 3)),
            np.zeros((count, 3)),
            *np.zeros((2, count, n, 3)),
        )
        found = []
        for k, part in enumerate(self.parts):
            r, p, jv, jw = ground if part.parent < 0 else found[part.parent]
            arm = r @ part.p
            jv = jv + np.cross(jw, arm[:, None])
            p, r = p + arm, r @ part.r
            axis = r @ part.axis
            one = np.eye(n)[k][None, :, None] * axis[:, None]
            if part.slides:
                way = axis * q[:, k : k + 1]
                jv = jv + np.cross(jw, way[:, None]) + one
                p = p + way
            else:
                jw = jw + one
                r = r @ about(part.axis, q[:, k])
            found.append((r, p, jv, jw))
        return found

    def _matrices(self, q):
        walk, (count, n) = self._walk(q), q.shape
        found = np.zeros((count, n, n), q.dtype)
        for k, (part, (r, _, jv, jw)) in enumerate(zip(self.parts, walk, strict=True)):
            v, w = jv + np.cross(jw, (r @ part.c)[:, None]), jw @ r
            found = found + part.m * v @ v.transpose(0, 2, 1) + w @ part.j @ w.transpose(0, 2, 1)
            inertia, gear = part.rotor
            if inertia:
                row = gear * np.eye(n)[k] + np.zeros((count, n))
                if part.parent >= 0:
                    base, _, _, carried = walk[part.parent]
                    row = row + (carried @ (base @ part.r @ part.axis)[:, :, None])[:, :, 0]
                found = found + inertia * row[:, :, None] * row[:, None]
        height = sum(part.m * (p + r @ part.c) for part, (r, p, _, _) in zip(self.parts, walk, strict=True))
        return found, -height @ self.g

    def _slopes(self, q):
        n = len(q)
        matrices, heights = self._matrices(np.asarray(q) + 1j * STEP * np.eye(n))
        return matrices[0].real, matrices.imag / STEP, heights.imag / STEP

    def mass_matrix(self, q):
        return self._slopes(q)[0]

    def gravity_load(self, q):
        """dV/dq: what holds the arm still."""
        return self._slopes(q)[2]

    def acceleration(self, q, u, tau):
        matrix, slopes, load = self._slopes(q)
        moving = np.einsum("kij,k,j->i", slopes, u, u) - 0.5 * np.einsum("kij,i,j->k", slopes, u, u)
        return np.linalg.solve(matrix, tau - moving - load)

    def run(self, q, u, tau, times, rtol=1e-10):
        """Coordinates and speeds at `times`, (2n, len(times)). `tau(t, q, u)`"""
        n = len(self.parts)

        def slope(t, x):
            return np.concatenate([x[n:], self.acceleration(x[:n], x[n:], tau(t, x[:n], x[n:]))])

        found = solve_ivp(
            slope, (0.0, times[-1]), np.concatenate([q, u]), "DOP853", t_eval=times, rtol=rtol, atol=1e-12
        )
        return found.y

"""Outlines in the plane, by themselves: how deep convex polygons and discs are in each other (separating axes). Nothing of the
program is used."""

from __future__ import annotations

import numpy as np


def placed(corners, x, y, angle):
    """Corners [n, 2] of a body's shape at every time [t, n, 2]."""
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    p = np.asarray(corners, float)
    px, py = p[:, 0][None, :], p[:, 1][None, :]
    return np.stack([x[:, None] + c * px - s * py, y[:, None] + s * px + c * py], axis=2)


def box(w, h, x=0.0, y=0.0):
    return [(x - w / 2, y - h / 2), (x + w / 2, y - h / 2), (x + w / 2, y + h / 2), (x - w / 2, y + h / 2)]


def _along(a, b):
    """Distance of b beyond each edge of a, the largest [t]."""
    side = np.roll(a, -1, axis=1) - a
    n = np.stack([side[:, :, 1], -side[:, :, 0]], axis=2)
    n /= np.linalg.norm(n, axis=2, keepdims=True)
    d = np.einsum("tej,tej->te", n, a)
    return (np.einsum("tej,tkj->tek", n, b).min(axis=2) - d).max(axis=1)


def apart(a, b):
    """Between two polygons at every time [m]; below 0 they are in each other."""
    return np.maximum(_along(a, b), _along(b, a))


def apart_disc(a, centre, r):
    """Between a polygon and a disc."""
    q = np.roll(a, -1, axis=1)
    side = q - a
    length = np.linalg.norm(side, axis=2)
    t = side / length[:, :, None]
    n = np.stack([t[:, :, 1], -t[:, :, 0]], axis=2)
    away = centre[:, None, :] - a
    inside = np.einsum("tej,tej->te", n, away).max(axis=1)
    foot = np.clip(np.einsum("tej,tej->te", t, away), 0.0, length)
    outside = np.linalg.norm(away - foot[:, :, None] * t, axis=2).min(axis=1)
    return np.where(inside < 0.0, inside, outside) - r

"""The Magic Formula by numpy: written from H. B. Pacejka, Tire and Vehicle Dynamics (2nd ed. 2006), equations 4.E9 to 4.E67
without camber; nothing of emsim's is used."""

from __future__ import annotations

import numpy as np

# Table A3.1: a passenger car's tyre, 205/60R15 91V at 2.2 bar
TABLE = {
    "fnomin": 4000, "r0": 0.313,
    "pcx1": 1.685, "pdx1": 1.210, "pdx2": -0.037, "pex1": 0.344, "pex2": 0.095, "pex3": -0.020, "pex4": 0.0,
    "pkx1": 21.51, "pkx2": -0.163, "pkx3": 0.245, "phx1": -0.002, "phx2": 0.002, "pvx1": 0.0, "pvx2": 0.0,
    "rbx1": 12.35, "rbx2": -10.77, "rcx1": 1.092, "rhx1": 0.007,
    "pcy1": 1.193, "pdy1": -0.990, "pdy2": 0.145, "pey1": -1.003, "pey2": -0.537, "pey3": -0.083,
    "pky1": -14.95, "pky2": 2.130, "phy1": 0.003, "phy2": -0.001, "pvy1": 0.045, "pvy2": -0.024,
    "rby1": 6.461, "rby2": 4.196, "rby3": -0.015, "rcy1": 1.081, "rhy1": 0.009,
    "rvy1": 0.053, "rvy2": -0.073, "rvy4": 35.44, "rvy5": 1.9, "rvy6": -10.71,
}  # fmt: skip


def magic(x, b, c, d, e):
    return d * np.sin(c * np.arctan(b * x - e * (b * x - np.arctan(b * x))))


def fitted(p, kappa, alpha, fz):
    """Fx, Fy [N] of PAC2002's coefficients."""
    g = lambda key: p.get(key, 0.0)  # noqa: E731
    fz0 = g("fnomin")
    df = (fz - fz0) / fz0
    x = kappa + g("phx1") + g("phx2") * df
    c, d = g("pcx1"), (g("pdx1") + g("pdx2") * df) * fz
    e = (g("pex1") + g("pex2") * df + g("pex3") * df**2) * (1 - g("pex4") * np.sign(x))
    k = fz * (g("pkx1") + g("pkx2") * df) * np.exp(g("pkx3") * df)
    fx = magic(x, k / (c * d), c, d, e) + fz * (g("pvx1") + g("pvx2") * df)
    y = alpha + g("phy1") + g("phy2") * df
    c, mu = g("pcy1"), g("pdy1") + g("pdy2") * df
    e = (g("pey1") + g("pey2") * df) * (1 - g("pey3") * np.sign(y))
    k = g("pky1") * fz0 * np.sin(2 * np.arctan(fz / (g("pky2") * fz0)))
    fy = magic(y, k / (c * mu * fz), c, mu * fz, e) + fz * (g("pvy1") + g("pvy2") * df)
    if g("rcx1"):
        b = g("rbx1") * np.cos(np.arctan(g("rbx2") * kappa))
        e = g("rex1") + g("rex2") * df
        fx *= magic_cos(alpha + g("rhx1"), b, g("rcx1"), e) / magic_cos(g("rhx1"), b, g("rcx1"), e)
    if g("rcy1"):
        b = g("rby1") * np.cos(np.arctan(g("rby2") * (alpha - g("rby3"))))
        e, shift = g("rey1") + g("rey2") * df, g("rhy1") + g("rhy2") * df
        fy *= magic_cos(kappa + shift, b, g("rcy1"), e) / magic_cos(shift, b, g("rcy1"), e)
        size = mu * fz * (g("rvy1") + g("rvy2") * df) * np.cos(np.arctan(g("rvy4") * alpha))
        fy += size * np.sin(g("rvy5") * np.arctan(g("rvy6") * kappa))
    return fx, fy


def magic_cos(x, b, c, e):
    return np.cos(c * np.arctan(b * x - e * (b * x - np.arctan(b * x))))


def plain(b, c, d, e, kappa, t, fz):
    """Fx, Fy by B C D E and both slips as one."""
    rho = np.hypot(kappa, t)
    if rho == 0.0:
        return 0.0, 0.0
    return (
        kappa / rho * magic(rho, b[0], c[0], d[0] * fz, e[0]),
        -t / rho * magic(rho, b[1], c[1], d[1] * fz, e[1]),
    )

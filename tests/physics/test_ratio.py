"""RATIO: a linear relation among the coordinates of n joints."""

from __future__ import annotations

import numpy as np
import pytest

import emsim
from emsim import pipeline

G = 9.81


@pytest.mark.parametrize("formulation", ["joint", "absolute"])
@pytest.mark.parametrize(
    "options", ["reltol=1e-3", "reltol=1e-6", "reltol=1e-9", "method=radau", "method=gauss4"]
)
def test_the_cage_of_a_differential_turns_at_the_mean_of_the_wheels(formulation, options):
    """Torque on the cage: half to each wheel, whatever their inertias; phases are those of the start."""
    r = pipeline.run(
        f"""differential of a car
BODY left j=1m m=1
BODY right j=3m m=1
BODY cage j=2m m=1
JOINT jl 0 left pin ic=(0.3,1)
JOINT jr 0 right pin ic=(0,3)
JOINT jc 0 cage pin
RATIO d jl jr jc coef=(1,1,-2)
TORQUE t jc tau=0.1
.options formulation={formulation} {options}
.tran 10m 1
.print tran angle(jl) angle(jr) angle(jc) omega(jc) torque(d) torque(d,2) torque(d,3)
.end
""",
        energy=True,
    )
    # f = lambda on each wheel, -2 lambda on the cage: 2 (0.1 - 2 f)/2m = f/1m + f/3m
    f = 0.1 / 2e-3 / (2.0 / 2e-3 + 0.5 / 1e-3 + 0.5 / 3e-3)
    t = np.asarray(r["time"])
    np.testing.assert_allclose(r["angle(jl)"], 0.3 + t + 0.5 * f / 1e-3 * t * t, atol=1e-8)
    np.testing.assert_allclose(r["angle(jr)"], 3.0 * t + 0.5 * f / 3e-3 * t * t, atol=1e-8)
    np.testing.assert_allclose(r["angle(jc)"], 2.0 * t + 0.5 * (0.1 - 2.0 * f) / 2e-3 * t * t, atol=1e-8)
    for name, share in (("torque(d)", 1), ("torque(d,2)", 1), ("torque(d,3)", -2)):
        np.testing.assert_allclose(r[name], share * f, rtol=1e-6)
    assert abs(r.energy.share) < 1e-10


@pytest.mark.parametrize("formulation", ["joint", "absolute"])
def test_a_movable_pulley_halves_the_force(formulation):
    """A mass on a rope, another on the block that the rope carries twice: y1 + 2 y2 stays; y2'' = g (2 m1 - m2)/(m2 + 4 m1)."""
    m1, m2 = 1.0, 3.0
    r = emsim.run(
        f"""block and tackle
BODY one m={m1}
BODY two m={m2}
JOINT s1 0 one slide axis=(0,1) ic=0.5
JOINT s2 0(1,0) two slide axis=(0,1)
RATIO rope s1 s2 coef=(1,2)
.gravity {G}
.options formulation={formulation}
.tran 10m 1
.print tran pos(s1) pos(s2) force(rope)
.end
"""
    )
    a = G * (2.0 * m1 - m2) / (m2 + 4.0 * m1)
    t = np.asarray(r["time"])
    np.testing.assert_allclose(r["pos(s2)"], 0.5 * a * t * t, atol=1e-9)
    np.testing.assert_allclose(r["pos(s1)"], 0.5 - a * t * t, atol=1e-9)
    np.testing.assert_allclose(r["force(rope)"], m1 * (G - 2.0 * a), rtol=1e-7)


def test_a_planetary_gear_shares_its_torques_by_its_teeth():
    """Willis: zs ws + zr wr = (zs + zr) wc. The ring held, the carrier turns zs/(zs + zr) as fast as the sun."""
    zs, zr = 20, 60
    r = emsim.run(
        f"""planetary gear by the angles of sun, ring and carrier
BODY sun j=1m m=0.1
BODY ring j=5m m=0.1
BODY carrier j=4m m=0.1
JOINT js 0 sun pin
JOINT jr 0 ring pin
JOINT jc 0 carrier pin
RATIO gear js jr jc coef=({zs},{zr},{-zs - zr})
DRIVE hold jr q={{0*time}}
TORQUE in js tau=1
.tran 1m 0.1
.print tran omega(js) omega(jc) torque(gear) torque(gear,2) torque(gear,3)
.end
"""
    )
    np.testing.assert_allclose(r["omega(jc)"], np.asarray(r["omega(js)"]) * zs / (zs + zr), atol=1e-9)
    inertia = 1e-3 + 4e-3 * (zs / (zs + zr)) ** 2
    assert r["omega(js)"][-1] == pytest.approx(0.1 / inertia, rel=1e-9)
    load = np.asarray(r["torque(gear)"])
    np.testing.assert_allclose(load, 1e-3 / inertia - 1.0, rtol=1e-7)
    np.testing.assert_allclose(r["torque(gear,2)"], load * zr / zs, rtol=1e-9)
    np.testing.assert_allclose(r["torque(gear,3)"], -load * (zs + zr) / zs, rtol=1e-9)


def test_a_relation_holds_at_rest_and_in_modes():
    """Two masses on springs and a rope over a block: x1 + 2 x2 stays where ic= has put it."""
    r = emsim.run(
        f"""rest
BODY one m=1
BODY two m=2
JOINT s1 0 one slide axis=(0,1) ic=0.2
JOINT s2 0(1,0) two slide axis=(0,1)
RATIO rope s1 s2 coef=(1,2)
SPRING k1 s1 k=100
SPRING k2 s2 k=300
.gravity {G}
.op static
.modes static
.print op pos(s1) pos(s2)
.end
"""
    )
    op, modes = r.table("op"), r.table("modes")
    # x1 = 0.2 - 2 x2; least of 50 x1^2 + 150 x2^2 + g (x1 + 2 x2), whose last part stays
    assert op["pos(s2)"][0] == pytest.approx(40.0 / 700.0, rel=1e-6)
    assert op["pos(s1)"][0] == pytest.approx(0.2 - 80.0 / 700.0, rel=1e-6)
    assert max(modes["frequency"]) == pytest.approx((700.0 / 6.0) ** 0.5 / (2.0 * np.pi), rel=1e-9)


def test_a_gear_of_three_joints_names_ratio():
    bodies = "\n".join(f"BODY b{k} m=1 j=1\nJOINT j{k} 0 b{k} pin" for k in (1, 2, 3))
    with pytest.raises(emsim.DeckError) as error:
        emsim.run(f"t\n{bodies}\nGEAR g j1 j2 j3 ratio=2\n.tran 1m 10m\n.end\n")
    (said,) = error.value.diagnostics
    assert said.code == "E233" and "RATIO" in (said.hint or "")

"""Impacts in machines that rub by their own load: what impulses take is in the ledger, to the tolerance."""

from __future__ import annotations

import random

import pytest

from emsim import pipeline

STOPPED = """arm falls on its end, its pin rubs by its own load
.gravity 9.81
BODY arm m=1 shape=rod(0.5)
JOINT a 0 arm pin ic=(0.5,0)
FRICTION g a mu=0.3 radius=30m
{end}
.options reltol={reltol:g}
.tran 5m 2
.meas tran first when hits({of})=0.5 rise=1
.meas tran second when hits({of})=1.5 rise=1
.end
"""
ENDS = {"e": "STOP e a min=-1 e=0.5", "w": "CONTACT w arm(0.5,0) 0(0,-0.3) line=(0,1) e=0.5"}


@pytest.mark.parametrize("of", ENDS)
@pytest.mark.parametrize("reltol", [1e-3, 1e-6, 1e-9])
def test_what_impulses_take_by_load_is_accounted_for(of, reltol):
    """0.2 to 1 % of what was turned over before, at every tolerance."""
    ledger = pipeline.run(STOPPED.format(end=ENDS[of], of=of, reltol=reltol), energy=True).energy
    assert ledger.share < 0.3 * reltol
    rubbed = next(line for line in ledger.lines if line.name == "g")
    assert rubbed.dissipated > 0.0


def test_an_arm_on_its_end_strikes_when_its_own_integration_says():
    """Event-driven integration of (m l^2/3) w' = -m g l/2 cos q - mu r N sgn w, N from the motion, e = 0.5."""
    r = pipeline.run(STOPPED.format(end=ENDS["e"], of="e", reltol=1e-9))
    assert r.measures["first"] == pytest.approx(0.335825516, abs=1e-7)
    assert r.measures["second"] == pytest.approx(0.717157121, abs=1e-7)


def chain(rng: random.Random) -> str:
    """Rods on a pin or a slide, each joint rubs by its load, with ends and a wall."""
    count, first = rng.choice([1, 2, 3]), rng.choice(["pin", "slide"])
    cards, length = [".gravity 9.81"], 0.0
    for k in range(count):
        at = "0" if k == 0 else f"b{k - 1}({length},0)"
        length = round(rng.uniform(0.2, 0.6), 3)
        cards.append(f"BODY b{k} m={rng.uniform(0.3, 2):.3f} shape=rod({length})")
        slides = k == 0 and first == "slide"
        start = (
            (rng.uniform(-0.2, 0.2), rng.uniform(-2, 2))
            if slides
            else (rng.uniform(-1, 1), rng.uniform(-3, 3))
        )
        kind = "slide axis=(1,0)" if slides else "pin"
        cards.append(f"JOINT j{k} {at} b{k} {kind} ic=({start[0]:.3f},{start[1]:.3f})")
        radius = "" if slides else f"radius={rng.uniform(0.005, 0.04):.4f}"
        cards.append(f"FRICTION f{k} j{k} mu={rng.uniform(0.05, 0.5):.3f} {radius}")
        ends = "min=-0.3 max=0.3" if slides else "min=-1.2 max=1.3"
        cards.append(f"STOP s{k} j{k} {ends} e={rng.choice([0, 0.3, 0.7, 1])}")
    return "\n".join(cards)


def pair(rng: random.Random) -> str:
    """Two bodies in space on pins that lie askew."""
    return "\n".join(
        [
            ".gravity 0 0 -9.81",
            f"BODY a m={rng.uniform(0.5, 2):.3f} com=(0.1,0,-0.2) j=(0.01,0.012,0.005)",
            f"JOINT p 0 a pin axis=({rng.uniform(-1, 1):.2f},1,{rng.uniform(-0.3, 0.3):.2f}) "
            f"ic=({rng.uniform(0.3, 1):.3f},{rng.uniform(-2, 2):.3f})",
            "BODY b m=0.5 com=(0,0.05,-0.1) j=(0.002,0.003,0.001)",
            f"JOINT q a(0.1,0,-0.4) b pin axis=(0.2,1,{rng.uniform(-0.5, 0.5):.2f}) "
            f"ic=({rng.uniform(-0.5, 0.5):.3f},{rng.uniform(-2, 2):.3f})",
            f"FRICTION fp p mu={rng.uniform(0.05, 0.5):.3f} radius=20m",
            f"FRICTION fq q mu={rng.uniform(0.05, 0.5):.3f} radius=10m",
            f"STOP sp p min=-0.5 max=1.5 e={rng.choice([0, 0.5, 0.8])}",
            f"STOP sq q min=-0.8 max=0.8 e={rng.choice([0, 0.5, 0.8])}",
        ]
    )


@pytest.mark.parametrize("scene", [chain, pair])
@pytest.mark.parametrize("seed", [3, 11, 29, 41, 57, 83])
def test_energy_closes_in_random_scenes_that_rub_by_load_and_strike(scene, seed):
    deck = f"t\n{scene(random.Random(seed))}\n.options reltol=1e-6\n.tran 5m 1\n.end\n"
    ledger = pipeline.run(deck, energy=True).energy
    assert ledger.share < 1e-4

"""Electromechanical elements in Verilog-A: rotational and kinematic terminals of a module are joints of the machine."""

from __future__ import annotations

from math import exp, pi, sqrt
from pathlib import Path

import numpy as np
import pytest

import emsim
from emsim.diagnostics import DeckError

MODULES = """
`include "disciplines.vams"

module dcm(p, n, shaft);
  inout p, n, shaft;
  electrical p, n;
  rotational_omega shaft;
  parameter real kt = 0.05 from (0:inf);
  parameter real r = 1 from (0:inf);
  parameter real l = 1m from [0:inf);
  parameter real j = 0 from [0:inf);
  analog begin
    V(p, n) <+ r * I(p, n) + l * ddt(I(p, n)) + kt * Omega(shaft);
    Tau(shaft) <+ j * ddt(Omega(shaft)) - kt * I(p, n);
  end
endmodule

module twist(shaft);
  inout shaft;
  rotational shaft;
  parameter real k = 1;
  analog Tau(shaft) <+ k * Theta(shaft);
endmodule

module oil(rod);
  inout rod;
  kinematic_v rod;
  parameter real b = 1;
  parameter real m = 0;
  analog F(rod) <+ b * Vel(rod) + m * ddt(Vel(rod));
endmodule

module bearing(shaft);
  inout shaft;
  rotational_omega shaft;
  parameter real b = 1m;
  parameter real j = 1m;
  analog Tau(shaft) <+ b * Omega(shaft) + j * ddt(Omega(shaft));
endmodule
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "machines.va").write_text(MODULES)
    return tmp_path


def run(folder: Path, *cards: str) -> emsim.Result:
    path = folder / "deck.cir"
    path.write_text("\n".join(["modules on joints", '.hdl "machines.va"', *cards, ".end", ""]))
    return emsim.run(path)


WHEEL = "BODY wheel m=1 j=2e-5\nJOINT shaft 0 wheel pin"
TIGHT = ".options reltol=1e-9"
STEP = "V1 a 0 PULSE(0 3 1m 10u 10u 1)"
DCM = ".model mm dcm(kt=50m r=1 l=1m)"


@pytest.mark.parametrize("formulation", ["joint", "absolute"])
def test_a_motor_as_a_module_is_the_motor_card(folder: Path, formulation: str):
    around = (
        f"{TIGHT} formulation={formulation}",
        STEP,
        WHEEL,
        ".tran 1m 60m",
        ".print tran omega(shaft) i(v1)",
    )
    card = run(folder, *around, "MOTOR mo a 0 shaft kt=50m r=1 l=1m")
    module = run(folder, *around, "N1 a 0 shaft mm", DCM)
    times = np.linspace(0.0, 60e-3, 61)
    for name in ("omega(shaft)", "i(v1)"):
        a, b = card.at(name, times), module.at(name, times)
        assert np.max(np.abs(a - b)) < 1e-7 * np.max(np.abs(a)), name
    # it nears the speed at which its voltage is that of the source: one time constant is J r / kt^2 = 8 ms
    assert module["omega(shaft)"][-1] == pytest.approx(3 / 0.05 * (1 - exp(-59 / 8)), rel=1e-2)


def test_inertia_of_a_module_turns_with_the_joint(folder: Path):
    """T = (j + J) a: a constant torque of 1 mN m on 2e-5 and 8e-5 kg m^2."""
    r = run(
        folder,
        TIGHT,
        WHEEL,
        "TORQUE t shaft tau=1m",
        "N1 shaft mm",
        ".model mm bearing(b=0 j=8e-5)",
        ".tran 10m 0.1",
    )
    assert r["omega(shaft)"][-1] == pytest.approx(1e-3 / 1e-4 * 0.1, rel=1e-9)


def test_a_spring_reads_the_angle(folder: Path):
    """J q'' = -k q: after a quarter of its period it passes through zero, after a whole one it is back."""
    period = 2 * pi * sqrt(2e-5 / 2e-3)
    body = "BODY wheel m=1 j=2e-5\nJOINT shaft 0 wheel pin ic=0.5rad"
    r = run(folder, TIGHT, body, "N1 shaft mm", ".model mm twist(k=2m)", f".tran {period / 40} {period}")
    angles = r.at("angle(shaft)", np.array([period / 4, period / 2, period]))
    assert np.max(np.abs(angles - [0.0, -0.5, 0.5])) < 1e-7
    # an angle times a torque is no power: no balance is claimed
    assert r.energy is None or r.energy.open == ["n1"]


def test_a_damper_on_a_slide(folder: Path):
    """(m + M) v' = -b v."""
    body = "BODY rod m=2\nJOINT way 0 rod slide ic=(0,3)"
    r = run(folder, TIGHT, body, "N1 way mm", ".model mm oil(b=4 m=1)", ".tran 10m 1")
    assert r["vel(way)"][-1] == pytest.approx(3 * exp(-4 / 3), rel=1e-8)


def test_the_ledger_counts_what_a_module_passes_on(folder: Path):
    r = run(folder, ".options reltol=1e-7", STEP, WHEEL, "N1 a 0 shaft mm", DCM, ".tran 1m 60m")
    ledger = r.energy
    assert not ledger.open
    assert abs(ledger.residual) < 1e-5 * ledger.turnover
    assert ledger.stored == pytest.approx(0.5 * 2e-5 * r["omega(shaft)"][-1] ** 2, rel=1e-2)
    assert ledger.supplied == pytest.approx(ledger.stored + ledger.dissipated, rel=1e-4)


def test_modules_share_a_shaft_that_is_no_joint(folder: Path):
    """kt i = b w and V = r i + kt w, at the end of the run-up."""
    r = run(folder, "V1 a 0 3", "N1 a 0 s mm", DCM, "N2 s bb", ".model bb bearing(b=1m j=1u)", ".tran 1m 50m")
    assert r["v(s)"][-1] == pytest.approx(3 * 0.05 / (0.05**2 + 1e-3), rel=1e-3)


@pytest.mark.parametrize(("joint", "said"), [("way", "is a slide"), ("centre", "is a ball")])
def test_a_joint_that_does_not_fit_is_named(folder: Path, joint: str, said: str):
    bodies = "BODY rod m=2\nJOINT way 0 rod slide\nBODY top m=1 j=(1,1,1)\nJOINT centre 0 top ball"
    with pytest.raises(DeckError) as caught:
        run(folder, STEP, bodies, f"N1 a 0 {joint} mm", DCM, ".tran 1m 5m")
    said_of = [d.message for d in caught.value.diagnostics if d.code == "E299"]
    assert any(said in message and "rotational_omega" in message for message in said_of)


def test_a_shaft_that_nothing_is_at_is_told(folder: Path):
    """A slip of the pen: the brake turns by itself, and the wheel is not braked."""
    cards = (".options formulation=absolute", WHEEL, ".model bb bearing(b=1m)", ".tran 1m 5m")
    said = [d for d in run(folder, *cards, "N1 shft bb").diagnostics if d.code == "W289"]
    assert len(said) == 1 and "shft" in said[0].message and "`shaft`" in (said[0].hint or "")
    assert not [d for d in run(folder, *cards, "N1 shaft bb").diagnostics if d.code == "W289"]
    assert not [d for d in run(folder, *cards, "N1 s bb", "N2 s bb").diagnostics if d.code == "W289"]

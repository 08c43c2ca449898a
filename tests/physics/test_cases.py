"""Decks against reference trajectories (tests/physics/refs/*.csv, each with its source and licence).

Claims: as the deck stands, within 1e-3 of each signal's range at every reference time; with method radau and
reltol 1e-8 within `tight` (1e-5 unless the deck differs from the stated equations, then why is said); and the
error falls from the looser to the tighter run.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest
from support import deck, reference, run, values_at

Column = str | Callable[[Callable[[str], np.ndarray]], np.ndarray]


@dataclass(frozen=True)
class Case:
    deck: str
    ref: str
    signals: dict[str, Column]
    tight: float = 1e-5
    default: float = 1e-3
    slow: bool = False


CASES = [
    Case("coupled/ref_ctms_motor_speed", "ctms_dc_motor_speed", {"w": "omega(shaft)", "i": "i(m1)"}),
    Case(
        "coupled/ref_ctms_motor_position",
        "ctms_dc_motor_position",
        {"theta": "angle(shaft)", "w": "omega(shaft)", "i": "i(m1)"},
    ),
    Case(
        "coupled/ref_comb_drive", "comb_drive_resonator", {"x": "pos(beam)", "v": "vel(beam)", "i": "i(comb)"}
    ),
    Case(
        "coupled/ref_es_pullin_below",
        "es_pullin_below",
        {
            "v_plate": "v(p)",
            "x": "pos(flex)",
            "v": "vel(flex)",
            "q": lambda v: 8.8541878128e-12 * 40e-9 / (2e-6 - v("pos(flex)")) * v("v(p)"),
        },
    ),
    Case(
        "coupled/ref_linear_pot", "linear_pot_readout", {"x": "pos(rail)", "v": "vel(rail)", "vc": "v(wip)"}
    ),
    Case(
        "coupled/ref_msl_dcpm_start",
        "msl_dcpm_start",
        {"dcpm.la.i": "i(m1)", "loadInertia.phi": "angle(shaft)", "loadInertia.w": "omega(shaft)"},
    ),
    Case("mechanical/ref_msl_pendulum", "msl_mb_pendulum", {"rev.phi": "angle(rev)", "rev.w": "omega(rev)"}),
    Case(
        "mechanical/ref_msl_planar_fourbar",
        "msl_mb_planar_fourbar",
        {"revolute1.phi": "angle(rev1)", "revolute1.w": "omega(rev1)"},
    ),
    Case(
        "mechanical/ref_msl_rot_first",
        "msl_rot_first",
        {
            "damper.phi_rel": lambda v: -v("angle(j2)"),
            "damper.w_rel": lambda v: -v("omega(j2)"),
            "inertia3.phi": "angle(load)",
            "inertia3.w": "omega(load)",
        },
    ),
    Case("electrical/ref_msl_hbridge_rl", "msl_hbridge_rl", {"inductor.i": "i(l1)"}),
    Case(
        "electrical/ref_msl_cauer",
        "msl_cauer_lowpass",
        {"C1.v": "v(n1)", "C3.v": "v(n2)", "C5.v": "v(n3)", "L1.i": "i(l1)", "L2.i": "i(l2)"},
    ),
    Case(
        "electrical/ref_msl_saturating_inductor",
        "msl_saturating_inductor",
        {"Inductance1.i": "i(l1)", "SaturatingInductance1.Psi": "v(psi)"},
    ),
    Case(
        "paper/paper_fig1_topology_A",
        "paper_fig1_topology_A",
        {"iL1": "i(l1)", "vC1": "v(n)", "iL2": "i(l2)"},
    ),
    Case(
        "paper/paper_fig1_topology_B",
        "paper_fig1_topology_B",
        {"iL1": "i(l1)", "vC1": "v(b)", "iL2": "i(l2)"},
    ),
    Case(
        "paper/motor_pendulum_kp30",
        "paper_motor_pendulum_kp30",
        {"i": "i(m1)", "theta": "angle(hinge)", "w": "omega(hinge)", "x_cm": "x(arm.com)", "V": "v(drive)"},
    ),
    Case(
        "paper/motor_pendulum_kp1000",
        "paper_motor_pendulum_kp1000",
        {"i": "i(m1)", "theta": "angle(hinge)", "w": "omega(hinge)", "x_cm": "x(arm.com)", "V": "v(drive)"},
    ),
]


@cache
def errors(name: str, options: str) -> dict[str, float]:
    """Largest error of each signal over the reference times, divided by the reference's range."""
    case = next(c for c in CASES if c.ref == name)
    ref = reference(case.ref)
    result = run(deck(case.deck), options)
    found = {}
    for signal, how in case.signals.items():
        at = lambda name: values_at(result, name, ref["time"])  # noqa: E731
        value = at(how) if isinstance(how, str) else how(at)
        found[signal] = float(np.abs(value - ref[signal]).max() / np.ptp(ref[signal]))
    return found


CASE_PARAMS = [pytest.param(c, id=c.ref, marks=[pytest.mark.slow] if c.slow else []) for c in CASES]


@pytest.mark.parametrize("case", CASE_PARAMS)
def test_default_tolerance_is_within_1e3_of_range(case):
    found = errors(case.ref, "")
    assert max(found.values()) <= case.default, found


@pytest.mark.parametrize("case", CASE_PARAMS)
def test_tight_tolerance_meets_the_anchor(case):
    found = errors(case.ref, "method=radau reltol=1e-8")
    assert max(found.values()) <= case.tight, found


@pytest.mark.parametrize("case", CASE_PARAMS)
def test_error_falls_with_the_tolerance(case):
    loose, middle, tight = (
        max(errors(case.ref, f"method=radau reltol={r}").values()) for r in ("1e-3", "1e-5", "1e-8")
    )
    floor = max(1e-7, 0.1 * case.tight)  # ten digits in the tables, nine after the division by the range
    assert middle <= max(loose, floor), (loose, middle, tight)
    assert tight <= max(0.1 * loose, floor), (loose, middle, tight)

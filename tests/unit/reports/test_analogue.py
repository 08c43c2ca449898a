"""The electrical analogue of a machine gives the same waveforms in ngspice."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from emsim import DeckError, pipeline
from emsim.interop import ngspice
from emsim.reports import analogue

ROOT = Path(__file__).resolve().parents[3]
TIGHT = ".options reltol=1e-5 abstol=1e-13 vntol=1e-9 trtol=1 method=trap\n.end\n"


def written(deck: str) -> str:
    assembly, planned = pipeline.prepare(pipeline.read(deck), {"reltol": 1e-7})
    return analogue.deck(assembly, planned)


def in_ngspice(text: str, points: int = 10_000) -> ngspice.Table:
    """The analogue as written, but with short steps: what is compared is the circuit, not ngspice's step control."""
    stop = float(re.search(r"\.tran \S+ (\S+)", text).group(1))
    text = re.sub(r"(\.tran \S+ \S+ \S+) \S+", rf"\1 {stop / points}", text)
    return ngspice.run(text.replace(".end\n", TIGHT)).main


def distance(run, name: str, theirs, column: str) -> float:
    """Largest difference over the range of ours, at our points: between them a cubic knows too little of a step of
    high order, while theirs lie close enough for straight lines."""
    inside = (run.time >= theirs.time[0]) & (run.time <= theirs.time[-1])
    ours, others = run[name][inside], np.interp(run.time[inside], theirs.time, theirs[column])
    return float(np.max(np.abs(ours - others)) / np.ptp(ours))


@pytest.mark.ngspice
@pytest.mark.parametrize(
    ("deck", "compared"),
    [
        (
            "coupled/pendulum_servo.cir",
            {"angle(hinge)": "v(q_hinge)", "v(wip)": "v(wip)", "i(m1)": "i(vs_m1)"},
        ),
        ("coupled/ref_ctms_motor_position.cir", {"angle(shaft)": "v(q_shaft)"}),
        ("coupled/ref_dc_motor_step.cir", {"angle(shaft)": "v(q_shaft)", "omega(shaft)": "v(w_rotor)"}),
        ("coupled/ref_linear_pot.cir", {"pos(rail)": "v(q_rail)", "v(wip)": "v(wip)"}),
        ("coupled/ref_msl_dcpm_start.cir", {"angle(shaft)": "v(q_shaft)"}),
        ("coupled/voice_coil.cir", {"pos(x)": "v(q_x)"}),
        ("mechanical/lead_screw.cir", {"angle(axle)": "v(q_axle)", "pos(lift)": "v(q_lift)"}),
        ("mechanical/ref_msl_rot_first.cir", {"angle(j2)": "v(q_j2)", "omega(j2)": "v(w_hub)"}),
        ("mechanical/ref_simple_pendulum.cir", {"angle(hinge)": "v(q_hinge)"}),
        ("paper/motor_pendulum_kp30.cir", {"angle(hinge)": "v(q_hinge)", "v(drive)": "v(drive)"}),
    ],
)
def test_same_waveforms_in_ngspice(deck: str, compared: dict[str, str]) -> None:
    path = str(ROOT / "netlists" / deck)
    run = pipeline.run(path, reltol=1e-7, options={"method": "radau"})
    theirs = in_ngspice(written(path))
    for ours, column in compared.items():
        assert distance(run, ours, theirs, column) < 1e-3, ours


MIXED = """controlled sources, models, waves
.param k=2
V1 in 0 DC 1 SIN(1 2 50 1m)
R1 in a {k*1k}
C1 a 0 1u ic=0.5
E1 b 0 a 0 {k}
G1 0 c b 0 1m
Rc c 0 500
F1 0 d V1 0.1
Rd d 0 1k
H1 e 0 V1 100
Re e 0 1k
E2 f 0 POLY(2) a 0 c 0 0 1 0.5
Rf f 0 1k
E3 g 0 VALUE={v(a)*v(c)}
Rg g 0 1k
L1 in h 10m
L2 m 0 40m
K1 L1 L2 0.5
Rh h 0 100
Rm m 0 100
D1 a n dd
.model dd d(is=1n n=1.5)
Rn n 0 3k
I1 0 n PULSE(0 1m 5m 1m 1m 5m 20m)
Xs a o half
.subckt half p q
R1 p q 1k
R2 q 0 1k
.ends
.tran 0.1m 40m
.end
"""


@pytest.mark.ngspice
def test_circuit_is_carried_over_whole() -> None:
    run = pipeline.run(MIXED, reltol=1e-7, options={"method": "radau"})
    theirs = in_ngspice(written(MIXED))
    for node in "acdefghmno":
        assert distance(run, f"v({node})", theirs, f"v({node})") < 1e-3, node


def test_every_card_is_one_line_of_its_kind() -> None:
    text = written(
        "rotor, spring, damper\nBODY a m=1 j=2\nJOINT s 0 a pin damp=4\nSPRING k s k=8\nDAMPER d s c=0.5\n.tran 1m 1\n.end\n"
    )
    found = {
        line.split()[0]: line.split()[3] for line in text.splitlines() if re.match(r"[CLR]\w+ w_a 0 ", line)
    }
    assert {key: float(value) for key, value in found.items()} == {
        "C_w_a": 2.0, "Rd_s": 0.25, "Lk_k": 0.125, "Rc_d": 2.0,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("deck", "names"),
    [
        ("coupled/cart_pole.cir", "JOINT hinge"),
        ("mechanical/ref_four_bar.cir", "JOINT close"),
        ("mechanical/thrown_disc.cir", "is free"),
        ("coupled/comb_drive.cir", "TRANSDUCER cd"),
    ],
)
def test_more_dimensions_are_refused_by_name(deck: str, names: str) -> None:
    with pytest.raises(DeckError, match=names) as caught:
        written(str(ROOT / "netlists" / deck))
    assert caught.value.diagnostics[0].code == "E311"

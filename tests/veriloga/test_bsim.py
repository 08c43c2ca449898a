"""BSIM3 and BSIM4 (devices/bsim3.va, devices/bsim4.va) against ngspice 39.3: currents, slopes, charges and noise of 13 cards,
which between them take each law of mobility, charge, temperature, junctions, tunnelling, resistances and noise.

`bsim_points.json` says what was run. Not in it is what ngspice has otherwise: slopes by the bulk of its version 4.5 (differences
of its own currents agree with ours), capacitances of BSIM3 with capmod=0 for the same reason, and charges of BSIM3, which it
gives with those of the gate's edges.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import emsim

POINTS = json.loads((Path(__file__).parent / "bsim_points.json").read_text())
NAMES = [f"{r['level']}-{r['version']}-{r['type']}-{r['modes'].split(' at=')[0]}" for r in POINTS["rows"]]


def deck(of: str, row: dict[str, Any]) -> str:
    sign = 1 if row["type"] == "nmos" else -1
    is_bsim4 = row["level"] in (14, 54)
    card = POINTS["bsim4" if is_bsim4 else "bsim3"].replace("@", "" if sign > 0 else "-")
    size = f"w=1u l={'0.1u' if is_bsim4 else '0.18u'} ad=0.2p as=0.25p pd=1.4u ps=1.5u nrd=0.2 nrs=0.3"
    return POINTS[of].format(
        level=row["level"],
        version=row["version"],
        type=row["type"],
        card=f"+ {card}\n+ {row['modes']}",
        inst=size + (" nf=2" if is_bsim4 and row["version"] != "4.5" else ""),
        outputs=" ".join(f"@m1[{name}]" for name in row["op"]),
        s=sign, vb=-0.3 * sign, temp=60, vd=0.9 * sign, vg=0.8 * sign,
        lo=-0.3 * sign, hi=1.2 * sign, step=0.3 * sign, dlo=-0.3 * sign, dstep=0.5 * sign,
    )  # fmt: skip


@pytest.mark.parametrize("row", POINTS["rows"], ids=NAMES)
def test_currents_at_every_bias(row: dict[str, Any]) -> None:
    r = emsim.run(deck("iv", row))
    for name, right in row["iv"].items():
        range_of = max(abs(v) for v in right)
        assert np.max(np.abs(np.asarray(r[name]) - right)) <= 2e-8 * range_of + 1e-18, name


@pytest.mark.parametrize("row", POINTS["rows"], ids=NAMES)
def test_slopes_and_charges_of_two_in_parallel(row: dict[str, Any]) -> None:
    r = emsim.run(deck("op", row))
    for name, right in row["op"].items():
        assert np.asarray(r[f"@m1[{name}]"])[0] == pytest.approx(right, rel=2e-6), name


@pytest.mark.parametrize("row", POINTS["rows"], ids=NAMES)
def test_noise_from_1_khz_to_1_ghz(row: dict[str, Any]) -> None:
    r = emsim.run(deck("noise", row))
    assert np.asarray(r["onoise_spectrum"]) == pytest.approx(row["noise"], rel=1e-6)


INVERTER = """an inverter by level alone, as in courses
vdd vdd 0 1.2
vin in 0 pulse(0 1.2 0.2n 20p 20p 1n 2n)
mp out in vdd vdd pm w=2u l=0.1u
mn out in 0 0 nm w=1u l=0.1u
cl out 0 5f
.model nm nmos level=54 version=4.8.1 vth0=0.35
.model pm pmos level=54 version=4.8.1 vth0=-0.35
.tran 5p 4n
.end
"""


def test_charge_comes_back_over_a_cycle() -> None:
    """What goes into a gate comes out again: BSIM's charges are of terminals, not Meyer's capacitances."""
    r = emsim.run(INVERTER, options={"reltol": 1e-6})
    t, i = np.asarray(r.time), np.asarray(r["i(vin)"])
    inside = (t >= 1.9e-9) & (t <= 3.9e-9)
    swung = np.trapezoid(np.abs(i[inside]), t[inside])
    assert abs(np.trapezoid(i[inside], t[inside])) < 1e-4 * swung


BINS = """bins are in metres, l and w of the line in micrometres
vd d 0 1
vg g 0 2
m1 d g 0 0 mn w=10 l={l}
.model mn.0 nmos level=54 version=4.8 vth0=0.5 lmin=0.5u lmax=2u wmin=1u wmax=20u
.model mn.1 nmos level=54 version=4.8 vth0=0.6 lmin=2u lmax=20u wmin=1u wmax=20u
.op
.option scale=1e-6
.end
"""


@pytest.mark.parametrize(("length", "current"), [(1, 2.771994e-3), (2, 1.55508708e-3), (3, 9.46628064e-4)])
def test_the_bin_is_chosen_after_scale(length: float, current: float) -> None:
    """A length at the edge of two bins is of the first. Currents: ngspice 39.3, print i(vd)."""
    r = emsim.run(BINS.format(l=length))
    assert -np.asarray(r["i(vd)"])[0] == pytest.approx(current, rel=1e-6)


def test_a_law_that_is_not_there_is_refused_by_name() -> None:
    with pytest.raises(emsim.DeckError, match="trnqsmod"):
        emsim.run(INVERTER.replace("vth0=0.35", "vth0=0.35 trnqsmod=1"))
    with pytest.raises(emsim.DeckError, match="acm"):
        emsim.run(INVERTER.replace("level=54 version=4.8.1", "level=49 version=3.3 acm=2"))


LIBRARY = """* parts
include "others.pm3"
.subckt unused a b
sky_res a b something r = {q}
.ends
.subckt used a b l=2
.param q='2*l' dev/gauss='0.1*l'
r1 a b {q}
.ends
"""


def test_a_broken_part_of_a_library_is_told_where_it_is_used(tmp_path: Path) -> None:
    (tmp_path / "parts.inc").write_text(LIBRARY)
    path = tmp_path / "deck.cir"
    path.write_text("of a library\n.include parts.inc\nv1 a 0 1\nx1 a 0 used\n.op\n.end\n")
    assert np.asarray(emsim.run(path)["i(v1)"])[0] == pytest.approx(-0.25)
    path.write_text("of a library\n.include parts.inc\nv1 a 0 1\nx1 a 0 unused\n.op\n.end\n")
    with pytest.raises(emsim.DeckError, match="does not fit here"):
        emsim.run(path)

"""Transistors by closed forms: currents of the textbook, mirrored polarities, bins, m and area, energy, explicit methods."""

from __future__ import annotations

import numpy as np
import pytest
from support import deck

import emsim
from emsim import pipeline

GMIN = 2e-11  # what gmin lets through across a few volts [A]
VT = 1.38064852e-23 * 300.15 / 1.6021766208e-19


def op(*lines: str) -> emsim.Table:
    return emsim.run("\n".join(["deck", *lines, ".op", ".end", ""])).table("op")


def test_a_mirror_of_gain_bf_loses_two_base_currents():
    table = op(
        "VCC vcc 0 5", "I1 vcc ref 1m", "Q1 ref ref 0 n", "Q2 o ref 0 n", "VO o 0 0.7",
        ".model n npn(is=1e-16 bf=50 br=1)", ".save v(ref) i(vo)",
    )  # fmt: skip
    assert -table["i(vo)"][0] == pytest.approx(1e-3 / (1 + 2 / 50), rel=1e-6)
    # and its voltage is that of the exponential
    assert table["v(ref)"][0] == pytest.approx(VT * np.log(1e-3 / (1 + 2 / 50) / 1e-16), rel=1e-6)


def test_a_transistor_of_p_type_is_the_other_one_upside_down():
    n = op(
        "V1 c 0 3",
        "V2 b 0 0.65",
        "Q1 c b 0 m",
        ".model m npn(is=1e-15 bf=80 vaf=60 rb=100 ise=1e-15)",
        ".save i(v1) i(v2)",
    )
    p = op(
        "V1 c 0 -3",
        "V2 b 0 -0.65",
        "Q1 c b 0 m",
        ".model m pnp(is=1e-15 bf=80 vaf=60 rb=100 ise=1e-15)",
        ".save i(v1) i(v2)",
    )
    for name in ("i(v1)", "i(v2)"):
        assert p[name][0] == pytest.approx(-n[name][0], rel=1e-6, abs=GMIN)


@pytest.mark.parametrize(("vds", "factor"), [(3.0, 0.5), (0.5, (1.5 - 0.25) * 0.5 / 1.5**2)])
def test_the_square_law_of_level_1(vds, factor):
    table = op(
        f"V1 d 0 {vds}", "V2 g 0 2.5", "M1 d g 0 0 m l=2u w=10u", ".model m nmos(vto=1 kp=40u)", ".save i(v1)"
    )
    assert -table["i(v1)"][0] == pytest.approx(40e-6 * 5 * 1.5**2 * factor, rel=1e-9, abs=GMIN)


@pytest.mark.parametrize(("length", "vto"), [("0.7u", 0.6), ("1.5u", 0.7)])
def test_the_bin_of_its_size_is_taken(length, vto):
    table = op(
        "V1 d 0 3", "V2 g 0 2", f"M1 d g 0 0 nch l={length} w=10u",
        ".model nch.1 nmos(lmin=0.5u lmax=1u wmin=1u wmax=100u vto=0.6 kp=40u)",
        ".model nch.2 nmos(lmin=1u lmax=2u wmin=1u wmax=100u vto=0.7 kp=40u)", ".save i(v1)",
    )  # fmt: skip
    size = {"0.7u": 10 / 0.7, "1.5u": 10 / 1.5}[length]
    assert -table["i(v1)"][0] == pytest.approx(20e-6 * size * (2 - vto) ** 2, rel=1e-9, abs=GMIN)


@pytest.mark.parametrize("words", ["m=3", "3"])
def test_three_in_parallel_and_three_times_the_area_carry_three_times_the_current(words):
    model = ".model m npn(is=1e-15 bf=80)"
    one = op("V1 c 0 3", "V2 b 0 0.65", "Q1 c b 0 m", model, ".save i(v1)")["i(v1)"][0]
    three = op("V1 c 0 3", "V2 b 0 0.65", f"Q1 c b 0 m {words}", model, ".save i(v1)")["i(v1)"][0]
    assert three == pytest.approx(3 * one, rel=1e-9, abs=GMIN)


def test_slopes_at_the_operating_point_are_those_of_the_currents():
    lines = ("VC c 0 3", "M1 d g 0 0 m l=1u w=10u", "VD d 0 2", ".model m nmos(vto=0.8 kp=50u lambda=0.02)")
    told = op(*lines, "VG g 0 2", ".save @m1[gm] @m1[gds] @m1[id]")
    up, down = (op(*lines, f"VG g 0 {v}", ".save @m1[id]")["@m1[id]"][0] for v in (2.001, 1.999))
    assert told["@m1[gm]"][0] == pytest.approx((up - down) / 0.002, rel=1e-6)
    assert told.unit("@m1[gm]") == "S" and told.unit("@m1[id]") == "A"


AMPLIFIER = """amplifier
VCC vcc 0 12
VIN in 0 SIN(0 10m 10k)
C1 in b 1u
R1 vcc b 47k
R2 b 0 10k
RC vcc c 4.7k
RE e 0 1k
CE e 0 10u
Q1 c b e n
.model n npn(is=1e-14 bf=200 vaf=100 rb=20 cje=10p cjc=4p tf=0.4n tr=20n)
.tran 1u 200u
.end
"""


@pytest.mark.parametrize("method", ["auto", "radau", "trap"])
def test_the_books_of_an_amplifier_balance(method, tmp_path):
    path = tmp_path / "amplifier.cir"
    path.write_text(AMPLIFIER, encoding="utf-8")
    found = pipeline.run(str(path), reltol=1e-6, method=method, energy=True)
    assert found.energy.balanced and found.energy.share < 1e-6
    words = {line.name: line.word for line in found.energy.lines}
    assert words["q1"] == "Q"


def test_a_transistor_that_floats_elsewhere_leaves_a_circuit_as_it_is():
    alone = emsim.run("rc\nV1 in 0 1\nR1 in out 1k\nC1 out 0 1u\n.tran 10u 1m uic\n.end\n")
    beside = emsim.run(
        "rc\nV1 in 0 1\nR1 in out 1k\nC1 out 0 1u\nV9 x 0 3\nR9 x y 1k\nM1 y x 0 0 m\n"
        ".model m nmos(vto=1 kp=40u tox=20n)\n.tran 10u 1m uic\n.end\n"
    )
    for t in (1e-4, 5e-4, 1e-3):
        assert beside.at("v(out)", t) == pytest.approx(alone.at("v(out)", t), abs=2e-3)


def test_equal_decks_give_equal_bits():
    """Instances of one form share a program, in whatever order their parameters stand: an oscillator magnifies any other bit."""
    text = deck("electrical/cmos_ring")
    turned = text.replace("vto=0.8 kp=60u", "kp=60u vto=0.8").replace("l=2u w=5u", "w=5u l=2u")
    assert turned != text
    runs = [emsim.run(given) for given in (text, text, turned)]
    for r in runs[1:]:
        assert r.time.tobytes() == runs[0].time.tobytes()
        assert r["v(a)"].tobytes() == runs[0]["v(a)"].tobytes()

"""Diodes and power MOSFETs that their own heat warms: a fixed point of power and temperature, the same as a device at that
temperature, its time constant; the diode as in ngspice."""

from __future__ import annotations

import re
import subprocess

import numpy as np
import pytest

import emsim
from emsim.interop import ngspice

DIODE = ".model dm d(is=1e-14 n=1.1 rs=10m bv=20 rth0=20 cth0=1m xti=3 cjo=10p tt=1n trs1=2m)"
MOSFET = (
    ".model mm vdmos {}chan(vto={}4 kp=5.9 lambda=.001 theta=0.015 ksubthres=.27 rd=61m rs=18m rg=3 rds=1e7 is=60p n=1.1 rb=14m "
    "tcvth=0.0065 mu=-1.27 texp0=1.5 mtriode=0.8 rthjc=0.2 rthca=2 cthj=1m)"
)


def point(*lines: str, temp: float = 27.0) -> emsim.Table:
    return emsim.run("\n".join(["t", *lines, f".options temp={temp}", ".op", ".end", ""])).table("op")


@pytest.mark.parametrize("volts", [0.8, 0.85, -20.1])
def test_a_diode_is_at_the_temperature_that_its_power_makes(volts):
    hot = point("D1 a 0 tj dm thermal", f"V1 a 0 {volts}", DIODE)
    rise, i = float(hot["v(tj)"][0]), -float(hot["i(v1)"][0])
    assert rise == pytest.approx(20.0 * volts * i, rel=1e-6) and rise > 0.2
    same = point("D1 a 0 dm", f"V1 a 0 {volts}", DIODE, temp=27.0 + rise)
    assert i == pytest.approx(-float(same["i(v1)"][0]), rel=1e-6)
    # its junction may be nobody's node
    inside = point("D1 a 0 dm thermal", f"V1 a 0 {volts}", DIODE)
    assert -float(inside["i(v1)"][0]) == pytest.approx(i, rel=1e-9)


@pytest.mark.parametrize("channel", ["n", "p"])
@pytest.mark.parametrize("volts", [2.0, 20.0, -1.2])
def test_a_mosfet_is_at_the_temperature_that_its_power_makes(channel, volts):
    sign = 1.0 if channel == "n" else -1.0
    gate = 8.0 if volts == 2.0 else 4.2 if volts > 0 else 0.0
    lines = (
        f"VG g 0 {sign * gate}",
        f"VD d 0 {sign * volts}",
        MOSFET.format(channel, "" if channel == "n" else "-"),
    )
    hot = point("M1 d g 0 tj tc mm thermal", *lines)
    junction, case, i = (float(hot[name][0]) for name in ("v(tj)", "v(tc)", "i(vd)"))
    power = abs(volts * i)
    assert (
        case == pytest.approx(2.0 * power, rel=1e-6)
        and junction == pytest.approx(2.2 * power, rel=1e-6)
        and junction > 3
    )
    same = point("M1 d g 0 mm", *lines, temp=27.0 + junction)
    assert i == pytest.approx(float(same["i(vd)"][0]), rel=1e-6)
    inside = point("M1 d g 0 mm thermal", *lines)
    assert float(inside["i(vd)"][0]) == pytest.approx(i, rel=1e-9)


def test_what_hangs_at_the_case_cools():
    lines = ("VG g 0 8", "VD d 0 2", MOSFET.format("n", ""))
    cooled = point("M1 d g 0 tj tc mm thermal", "Rsink tc 0 0.5", *lines)
    power = 2.0 * abs(float(cooled["i(vd)"][0]))
    assert float(cooled["v(tc)"][0]) == pytest.approx(power * (0.5 * 2.0 / 2.5), rel=1e-6)


def test_the_warming_has_its_time_constant():
    """Of a power that hardly changes: a small rise."""
    deck = (
        "t\nI1 0 a PULSE(0 10m 0 1n 1n 1 2)\nD1 a 0 tj dm thermal\n"
        ".model dm d(is=1e-14 rth0=20 cth0=1m)\n.tran 1m 100m\n.options reltol=1e-7\n.end\n"
    )
    result = emsim.run(deck)
    t, rise, volts = (np.asarray(result[name]) for name in ("time", "v(tj)", "v(a)"))
    of = t > 1e-4
    wanted = 20.0 * 10e-3 * volts[-1] * (1.0 - np.exp(-t / 20e-3))
    assert np.abs(rise - wanted)[of].max() < 2e-3 * wanted[-1]


def test_a_current_that_feeds_itself_runs_away_where_nothing_holds_it():
    with pytest.raises(emsim.ConvergenceError):
        point("V1 a 0 1", "D1 a 0 tj dm thermal", ".model dm d(is=1e-12 rth0=1000 xti=3)")


def test_without_anything_that_cools_it_is_told():
    with pytest.raises(emsim.DeckError, match="nothing cools it"):
        point("V1 a 0 1", "D1 a 0 dm thermal", ".model dm d")
    with pytest.raises(emsim.DeckError, match="a VDMOS alone"):
        point("V1 a 0 1", "M1 a a 0 0 mm thermal", ".model mm nmos")


@pytest.mark.skipif(not ngspice.find(), reason="ngspice is not installed")
def test_the_diode_is_as_warm_as_in_ngspice(tmp_path):
    lines = ["t", "D1 a 0 tj dm thermal", "V1 a 0 0.8", "I3 0 c 1", "D3 c 0 tk dm thermal"]
    lines.append(".model dm d(is=1e-14 rs=10m rth0=20 cth0=1m xti=3)")
    own = point(*lines[1:])
    asked = ("v(tj)", "i(v1)", "v(c)", "v(tk)")
    (tmp_path / "d.cir").write_text(
        "\n".join([*lines, ".control", "op", f"print {' '.join(asked)}", ".endc", ".end", ""])
    )
    done = subprocess.run(
        [str(ngspice.find()), "-b", str(tmp_path / "d.cir")],
        capture_output=True,
        text=True,
        timeout=60,
        cwd=tmp_path,
    )
    for name in asked:
        theirs = float(re.search(rf"^{re.escape(name)} = (\S+)", done.stdout, re.M).group(1))
        assert float(own[name][0]) == pytest.approx(theirs, rel=1e-4), name

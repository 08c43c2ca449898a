"""`.sp`: scattering parameters, admittances and impedances against ngspice and against closed forms."""

from __future__ import annotations

import subprocess

import numpy as np
import pytest
from support import needs_ngspice

import emsim
from emsim.interop.ngspice import named_alike
from emsim.outputs import raw

TWO = "v1 in 0 dc 0 ac 1 portnum 1 z0 50\nv2 out 0 dc 0 ac 0 portnum 2 z0 75\n"
DECKS = {
    "a T of three": TWO + "r1 in a 20\nl1 a out 100n\nc1 a 0 5p",
    "an amplifier": TWO + "r1 in b 200\ng1 out 0 b 0 20m\nr2 out b 1k\nc1 b 0 1p\nc2 out 0 2p\nr3 b 0 2k",
    "three ports": TWO + "v3 x 0 dc 0 ac 0 portnum 3 z0 100\nr1 in m 10\nr2 out m 20\nl3 x m 30n\nc1 m 0 3p\nr4 m 0 500",
    "a junction": TWO + "l1 in a 1u\nd1 a 0 dm\nr1 a out 100\ni1 0 a 1m\n.model dm d is=1e-14 cjo=2p",
}  # fmt: skip


@needs_ngspice
@pytest.mark.ngspice
@pytest.mark.parametrize("name", DECKS)
def test_as_ngspice(tmp_path, name):
    text = f"ports\n{DECKS[name]}\n.sp dec 5 10meg 1g\n.options reltol=1e-9\n.end\n"
    (tmp_path / "deck.cir").write_text(text)
    command = ["ngspice", "-b", "-r", "out.raw", "deck.cir"]
    subprocess.run(command, cwd=tmp_path, capture_output=True, timeout=60, stdin=subprocess.DEVNULL)
    theirs = named_alike(raw.read(str(tmp_path / "out.raw"))).plots[0]
    ours = emsim.run(text).table("sp")
    shared = [n for n in theirs.names if n.lower() in ours.names]
    assert len(shared) == len(ours.names) and ours.plotname == theirs.plotname
    for n in shared:
        a, b = ours.column(n.lower()), theirs.column(n)
        assert np.abs(a - b).max() <= 1e-6 * np.abs(b).max(), n


def test_a_matched_line_turns_the_phase():
    r = emsim.run(
        "line\nv1 a 0 portnum 1 z0 50\nv2 b 0 portnum 2 z0 50\nt1 a 0 b 0 z0=50 td=1n\n.sp lin 50 10meg 400meg\n.end\n"
    ).table("sp")
    w = 2 * np.pi * r["frequency"].real
    np.testing.assert_allclose(r["s_2_1"], np.exp(-1j * w * 1e-9), atol=1e-12)
    np.testing.assert_allclose(r["s_1_1"], 0, atol=1e-12)


def test_an_element_in_series_has_admittances_and_no_impedances():
    r = emsim.run(
        "r\nv1 a 0 portnum 1 z0 50\nv2 b 0 portnum 2 z0 50\nr1 a b 100\n.sp lin 2 1k 2k\n.end\n"
    ).table("sp")
    assert r["y_2_1"][0] == pytest.approx(-0.01, rel=1e-12) and r.unit("y_2_1") == "S"
    assert r["s_1_1"][0] == pytest.approx(0.5, rel=1e-12)
    assert "z_1_1" not in r


@pytest.mark.parametrize(
    ("ports", "card"),
    [
        ("v1 a 0 1", ".sp lin 2 1k 2k"),
        ("v1 a 0 1 portnum 2 z0 50", ".sp lin 2 1k 2k"),
        ("v1 a 0 1 portnum 1 z0 50\nv2 a 0 portnum 1 z0 50", ".sp lin 2 1k 2k"),
        ("v1 a 0 1 portnum 1 z0 50", ".sp lin 2 1k 2k 1"),
        ("v1 a 0 1 portnum 1 z0 50", ".sp 2 1k 2k"),
    ],
)
def test_what_is_refused(ports, card):
    with pytest.raises(emsim.DeckError, match="E305"):
        emsim.run(f"x\n{ports}\nr1 a 0 50\n{card}\n.end\n")


def test_print():
    from emsim.outputs.text import lines

    deck = f"x\n{DECKS['a T of three']}\n.sp lin 2 100meg 200meg\n.print sp S_2_1 db(s_1_1)\n.end\n"
    text = "\n".join(lines(emsim.run(deck)))
    assert "s_2_1" in text.lower() and "db(s_1_1)" in text

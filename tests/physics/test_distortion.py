"""`.disto` against closed forms, fine transients and ngspice, where that is right (it leaves out B, E and G with expressions)."""

from __future__ import annotations

import subprocess

import numpy as np
import pytest
from support import needs_ngspice

import emsim
from emsim.outputs import raw

CUBIC = "cubic\nV1 in 0 dc 0.5 distof1 0.1 distof2 0.2\nB1 out 0 v=v(in)+0.3*v(in)^2+0.2*v(in)^3\nR1 out 0 1k"


def tables(deck: str, card: str) -> dict[str, emsim.Table]:
    return {t.kind: t for t in emsim.run(f"{deck}\n{card}\n.end\n").plots}


def test_a_polynomial_has_its_closed_form():
    # about 0.5: second derivative 1.2, third 1.2
    found = tables(CUBIC, ".disto dec 2 100 1k")
    np.testing.assert_allclose(found["2f1 disto"]["v(out)"], 1.2 * 0.1**2 / 4, rtol=1e-9)
    np.testing.assert_allclose(found["3f1 disto"]["v(out)"], 1.2 * 0.1**3 / 24, rtol=1e-7)
    found = tables(CUBIC, ".disto dec 2 100 1k 0.9")
    np.testing.assert_allclose(found["f1+f2 disto"]["v(out)"], 1.2 * 0.1 * 0.2 / 2, rtol=1e-9)
    np.testing.assert_allclose(found["f1-f2 disto"]["v(out)"], 1.2 * 0.1 * 0.2 / 2, rtol=1e-9)
    np.testing.assert_allclose(found["2f1-f2 disto"]["v(out)"], 1.2 * 0.1**2 * 0.2 / 8, rtol=1e-7)


def test_a_square_behind_a_filter_and_before_one():
    """Phases: the square doubles the one of its input, the filter behind it sees twice the frequency."""
    deck = "memory\nV1 in 0 0 distof1 1 30\nR1 in a 1k\nC1 a 0 100n\nB1 b 0 v=0.1*v(a)*v(a)\nR2 b c 2k\nC2 c 0 50n\n"
    found = tables(deck, ".disto dec 3 100 10k")["2f1 disto"]
    w = 2 * np.pi * found["frequency"].real
    x = np.exp(1j * np.pi / 6) / (1 + 1j * w * 1e-4)
    np.testing.assert_allclose(found["v(c)"], 0.1 * x**2 / 2 / (1 + 2j * w * 1e-4), rtol=1e-9)


def test_a_charge_that_bends():
    """C(v) = C0 (1 + a v) driven by a current: v2 follows from the charge, 1/2 a C0 v^2."""
    deck = "charge\nI1 0 out 0 distof1 1m\nC1 out 0 q='1u*v(out)*(1+0.05*v(out))'\nR1 out 0 1k"
    found = tables(deck, ".disto dec 2 100 1k")["2f1 disto"]
    w = 2 * np.pi * found["frequency"].real
    x = 1e-3 / (1e-3 + 1j * w * 1e-6)
    np.testing.assert_allclose(
        found["v(out)"], -(2j * w * 0.1e-6 * x**2 / 4) / (1e-3 + 2j * w * 1e-6), rtol=1e-7
    )


AMPLIFIER = """amplifier
Vcc vcc 0 12
V1 in 0 {drive}
C1 in b 1u
R1 vcc b 82k
R2 b 0 18k
Rc vcc c 3.9k
Re e 0 1k
Ce e 0 100u
Q1 c b e QN
.model QN NPN(IS=1e-14 BF=200 VAF=80 CJE=5p CJC=3p TF=0.4n RB=50)"""


def test_a_transistor_at_small_amplitude_is_as_its_transient():
    small = 1e-3
    found = tables(AMPLIFIER.replace("{drive}", f"0 distof1 {small}"), ".disto lin 1 5k 5k")
    deck = AMPLIFIER.replace("{drive}", f"SIN(0 {small} 5k)")
    options = {"reltol": 1e-9, "vntol": 1e-12, "abstol": 1e-15}
    result = emsim.run(f"{deck}\n.ss 1u 0.2m\n.four 5k v(c)\n.end\n", options=options)
    (told,) = result.spectra
    for k, kind in ((2, "2f1 disto"), (3, "3f1 disto")):
        assert told.harmonics[k].magnitude == pytest.approx(abs(found[kind]["v(c)"][0]), rel=3e-3)


MIXER = """mixer
V1 in 0 dc 0.65 distof1 0.01 distof2 0.02 45
Q1 c in 0 QN
D1 in x DM
R2 x 0 1k
M1 d in 0 0 NM W=10u L=1u
RD vc d 10k
V2 vc 0 5
Rc vc c 100
C1 c 0 10n
.model QN NPN(IS=1e-14 BF=100 CJE=10p CJC=5p TF=1n)
.model DM D(IS=1e-12 CJO=10p)
.model NM NMOS(VTO=0.3 KP=100u LAMBDA=0.02)"""


@needs_ngspice
@pytest.mark.ngspice
@pytest.mark.parametrize("card", ["disto dec 2 1k 100k", "disto dec 2 1k 100k 0.8"])
def test_semiconductors_are_as_in_ngspice(card, tmp_path):
    ours = list(tables(MIXER, f".{card}").values())
    dump = "set appendwrite\nforeach p $plots\nsetplot $p\nwrite all.raw\nend"
    (tmp_path / "d.cir").write_text(f"{MIXER}\n.control\n{card}\n{dump}\n.endc\n.end\n")
    subprocess.run(["ngspice", "-b", "d.cir"], cwd=tmp_path, capture_output=True, timeout=60, check=False)
    theirs = {p.plotname: p for p in raw.read(str(tmp_path / "all.raw")).plots}
    compared = 0
    for table in ours:
        for name in ("v(c)", "v(x)", "v(d)"):
            if name == "v(d)" and table.kind == "2f1-f2 disto":
                continue  # ngspice's is not that of its third harmonic, see below
            other = theirs[table.plotname][name]
            np.testing.assert_allclose(table[name], other, rtol=2e-4, atol=1e-4 * np.abs(other).max())
            compared += 1
    assert compared >= 3 * len(ours) - 1


def test_without_memory_all_orders_follow_from_one_another():
    """2 f1 - f2 is three times the third harmonic, times Y*/X*; f1 + f2 twice the second one."""
    one, two = tables(MIXER, ".disto lin 1 1 1"), tables(MIXER, ".disto lin 1 1 1 0.8")
    x, y = 0.01, 0.02 * np.exp(1j * np.pi / 4)
    for name in ("v(c)", "v(x)", "v(d)"):
        third = one["3f1 disto"][name][0]
        assert two["2f1-f2 disto"][name][0] == pytest.approx(3 * third * np.conj(y) / x, rel=1e-3)
        assert two["f1+f2 disto"][name][0] == pytest.approx(2 * one["2f1 disto"][name][0] * y / x, rel=1e-3)


def test_a_control_section_has_the_plots_of_ngspice():
    said = emsim.run(
        f"{CUBIC}\n.control\ndisto dec 1 100 1k\nsetplot\nsetplot disto1\nprint v(out)\n.endc\n.end\n"
    ).output
    assert "disto1" in said and "disto2" in said and "3.000000e-03" in said


@pytest.mark.parametrize(
    ("lines", "code"),
    [
        (
            "V1 a 0 0 distof1 1\nS1 a b c 0 sw\nVc c 0 2\nR1 b 0 1\n.model sw sw(vt=1)\nD1 b 0 dm\n.model dm d",
            None,
        ),
        ("V1 a 0 0 distof1 1\nT1 a 0 b 0 z0=50 td=1n\nR1 b 0 50", "E305"),
        ("V1 a 0 0 ac 1\nR1 a 0 50", "W305"),
    ],
)
def test_what_it_cannot_do_is_told(lines, code):
    try:
        result = emsim.run(f"x\n{lines}\n.disto lin 1 1k 1k\n.end\n")
        told = [d.code for d in result.diagnostics]
    except (emsim.DeckError, emsim.ConvergenceError) as error:
        told = [d.code for d in error.diagnostics]
    assert code is None or code in told


@pytest.mark.parametrize("card", [".disto dec 1 100 1k 1.5", ".disto oct 1 100", ".disto fast 1 2 3"])
def test_cards_out_of_form(card):
    with pytest.raises(emsim.DeckError, match="E305"):
        emsim.run(f"{CUBIC}\n{card}\n.end\n")

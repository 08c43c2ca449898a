"""Dialects: the same text is another circuit to LTspice, PSpice and ngspice. Each reading stands beside what it comes to."""

from __future__ import annotations

import math
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support import ROOT

import emsim
from emsim.dialects import DIALECTS

PAGE = (ROOT / "emsim" / "docs" / "pages" / "guide" / "dialects.md").read_text(encoding="utf-8")


def run(cards: str, dialect: str | None = None) -> emsim.Result:
    return emsim.run(f"deck\n{cards}\n.end\n", options={} if dialect is None else {"dialect": dialect})


def refused(cards: str, dialect: str | None = None) -> list[tuple[str, str]]:
    with pytest.raises(emsim.DeckError) as error:
        run(cards, dialect)
    return [(d.code, f"{d.message}; {d.hint}") for d in error.value.diagnostics]


# (dialect, cards, the same as ngspice has it)
SAME = {
    "letter_as_dot": (
        "ltspice",
        "V1 a 0 1\nR1 a b 4k7\nR2 b 0 1Meg5\n.op",
        "V1 a 0 1\nR1 a b 4.7k\nR2 b 0 1.5Meg\n.op",
    ),
    "stop_time_alone": (
        "ltspice",
        "V1 a 0 SIN(0 1 1k)\nR1 a b 1k\n.tran 2m",
        "V1 a 0 SIN(0 1 1k)\nR1 a b 1k\n.tran 2u 2m",
    ),
    "stop_time_of_a_parameter": (
        "ltspice",
        ".param t=2m\nV1 b 0 SIN(0 1 1k)\n.tran {t}",
        "V1 b 0 SIN(0 1 1k)\n.tran 2u 2m",
    ),
    "step_of_zero": (
        "pspice",
        "V1 a 0 SIN(0 1 1k)\nR1 a b 1k\n.tran 0 2m 0 1u",
        "V1 a 0 SIN(0 1 1k)\nR1 a b 1k\n.tran 2u 2m 0 1u",
    ),
    "skipbp": (
        "pspice",
        "C1 b 0 1u ic=2\nR1 b 0 1k\n.tran 1u 1m skipbp",
        "C1 b 0 1u ic=2\nR1 b 0 1k\n.tran 1u 1m uic",
    ),
    "pwl_from_the_point_before": (
        "ltspice",
        "V1 b 0 PWL(0 0 +1m 5 +2m 5 +3m 0)\nR1 b 0 1k\n.tran 1u 5m",
        "V1 b 0 PWL(0 0 1m 5 3m 5 6m 0)\nR1 b 0 1k\n.tran 1u 5m",
    ),
    "pwl_of_pspice": (
        "pspice",
        "V1 b 0 PWL(0 0 +1m 5 +2m 5 +3m 0)\nR1 b 0 1k\n.tran 1u 5m",
        "V1 b 0 PWL(0 0 1m 5 3m 5 6m 0)\nR1 b 0 1k\n.tran 1u 5m",
    ),
    "pwl_of_ngspice": (
        "ngspice",
        "V1 b 0 PWL(0 0 +1m 5 +2m 5 +3m 0)\nR1 b 0 1k\n.tran 1u 2.5m",
        "V1 b 0 PWL(0 0 1m 5 2m 5 3m 0)\nR1 b 0 1k\n.tran 1u 2.5m",
    ),
    "coil": (
        "ltspice",
        "V1 a 0 1\nL1 a b 1m\nR1 b 0 1m\n.op",
        "V1 a 0 1\nL1 c b 1m\nR9 a c 1m\nR1 b 0 1m\n.op",
    ),
    "coil_in_a_subcircuit": (
        "ltspice",
        ".subckt s a b\nL1 a b 1m\n.ends\nV1 a 0 1\nX1 a b s\nR1 b 0 1m\n.op",
        "V1 a 0 1\nL1 c b 1m\nR9 a c 1m\nR1 b 0 1m\n.op",
    ),
    "coil_under_a_condition": (
        "ltspice",
        ".param p=1\nV1 a 0 1\n.if (p==1)\nL1 a b 1m\n.else\nR7 a b 9\n.endif\nR1 b 0 1m\n.op",
        "V1 a 0 1\nR9 a b 1m\nR1 b 0 1m\n.op",
    ),
    "coil_without": (
        "ltspice",
        "V1 a 0 1\nL1 a b 1m Rser=0\nR1 b 0 1m\n.op",
        "V1 a 0 1\nL1 a b 1m\nR1 b 0 1m\n.op",
    ),
    "coil_with_its_own": (
        "ltspice",
        "V1 a 0 1\nL1 a b 1m Rser=3m\nR1 b 0 1m\n.op",
        "V1 a 0 1\nL1 c b 1m\nR9 a c 3m\nR1 b 0 1m\n.op",
    ),
    "coupled_coils": (
        "ltspice",
        "V1 a 0 1\nL1 a b 1m\nL2 c 0 1m\nR2 c 0 1\nK1 L1 L2 1\nR1 b 0 1m\n.op",
        "V1 a 0 1\nL1 a b 1m\nL2 c 0 1m\nR2 c 0 1\nK1 L1 L2 1\nR1 b 0 1m\n.op",
    ),
    "coil_of_pspice": (
        "pspice",
        "V1 a 0 1\nL1 a b 1m\nR1 b 0 1m\n.op",
        "V1 a 0 1\nL1 a b 1m\nR1 b 0 1m\n.op",
    ),
    "negative_hysteresis": (
        "ltspice",
        "VC c 0 0.05\nV1 a 0 3\nR1 a b 1k\nS1 b 0 c 0 s\n.model s SW(vt=0.1 vh=-0.1 ron=1 roff=1meg)\n.op",
        "VC c 0 0.05\nV1 a 0 3\nR1 a b 1k\nS1 b 0 c 0 s\n.model s VSWITCH(von=0.2 voff=0 ron=1 roff=1meg)\n.op",
    ),
    "multiplier": (
        "pspice",
        "V1 a 0 3\nR1 a b m 1k\nR2 b 0 1k\n.model m RES(R=2 TC1=1m)\n.op",
        "V1 a 0 3\nR1 a b 2k\nR2 b 0 1k\n.op",
    ),
    "multiplier_of_c": (
        "pspice",
        "V1 a 0 1\nR1 a b 1k\nC1 b 0 m 1u\n.model m CAP(C=2)\n.tran 1u 1m uic",
        "V1 a 0 1\nR1 a b 1k\nC1 b 0 2u\n.tran 1u 1m uic",
    ),
    "breakdown": (
        "pspice",
        "I1 0 b 1m\nD1 0 b d\n.model d D(bv=5)\n.op",
        "I1 0 b 1m\nD1 0 b d\n.model d D(bv=5 ibv=1e-10)\n.op",
    ),
    "substrate_of_pnp": (
        "pspice",
        "V1 a 0 -5\nQ1 a b 0 s q\nR1 a b 1meg\nR2 s 0 1k\n.model q PNP(bf=50 iss=1f)\n.op",
        "V1 a 0 -5\nQ1 a b 0 s q\nR1 a b 1meg\nR2 s 0 1k\n.model q PNP(bf=50 iss=1f subs=1)\n.op",
    ),
}


@pytest.mark.parametrize("name", SAME)
def test_a_reading_is_the_circuit_written_out(name):
    dialect, cards, written_out = SAME[name]
    ours, plain = run(cards, dialect), run(written_out, "ngspice")
    a, b = ours["v(b)"], plain["v(b)"]
    if len(a) == len(b) == 1:
        assert float(a[0]) == pytest.approx(float(b[0]), rel=1e-12)
        return
    times = np.linspace(float(plain["time"][0]), float(plain["time"][-1]), 500)
    size = float(np.abs(b).max())
    assert np.abs(np.interp(times, ours["time"], a) - np.interp(times, plain["time"], b)).max() < 2e-3 * size


# dialect, expression at v(a) = x, its value
VALUES = [
    ("ltspice", -2.0, "v(a)**3", -8.0),
    ("ltspice", -2.0, "pow(v(a),2)", 4.0),
    ("ltspice", -2.0, "v(a)**1.5", 2**1.5 * math.cos(1.5 * math.pi)),
    ("ltspice", -2.0, "v(a)**0.25", 2**0.25 * math.cos(0.25 * math.pi)),
    ("ltspice", -2.0, "pwr(v(a),3)", 8.0),
    ("ltspice", -2.0, "pwrs(v(a),3)", -8.0),
    ("pspice", -2.0, "pwr(v(a),3)", 8.0),
    ("pspice", -2.0, "v(a)**3", 8.0),
    ("pspice", -2.0, "pwrs(v(a),2)", -4.0),
    (None, -2.0, "pwr(v(a),3)", -8.0),
    (None, -2.0, "v(a)^3", 8.0),
    ("ltspice", 3.0, "(v(a)>1)^(v(a)>2)", 0.0),
    ("ltspice", 3.0, "(v(a)>1)^(v(a)>4)", 1.0),
    ("pspice", 3.0, "if((v(a)>1)^(v(a)>4),7,8)", 7.0),
    ("ltspice", 0.3, "if(v(a),7,8)", 8.0),
    ("pspice", 0.3, "if(v(a),7,8)", 7.0),
    (None, 0.3, "if(v(a),7,8)", 7.0),
    ("ltspice", 0.3, "!v(a)", 1.0),
    ("ltspice", 0.3, "(v(a)|0.7)+2*(v(a)&1)", 1.0),
    ("ltspice", 0.3, "v(a) ? 7 : 8", 8.0),
    ("ltspice", 0.3, "buf(v(a))+2*inv(v(a))", 2.0),
    ("ltspice", 0.3, "square(v(a))+cbrt(-8)", -1.91),
    ("ltspice", -4.0, "sqrt(v(a))", 0.0),
    ("ltspice", 5.0, "arcsin(v(a))+acos(v(a))", math.pi / 2),
    ("ltspice", 5.0, "limit(v(a),3,-1)", 3.0),
    ("pspice", 5.0, "limit(v(a),-1,3)", 3.0),
    ("ltspice", 0.0, "temp", 27.0),
    ("pspice", 0.0, "temp", 27.0),
]


@pytest.mark.parametrize(("dialect", "x", "expression", "value"), VALUES)
def test_an_expression_means_what_it_means_there(dialect, x, expression, value):
    found = run(f"V1 a 0 {x}\nB1 b 0 V={expression}\n.op", dialect)
    assert float(found["v(b)"][0]) == pytest.approx(value, rel=1e-9, abs=1e-12)
    assert dialect is None or not found.diagnostics


@pytest.mark.parametrize(
    ("dialect", "x", "expression", "value"), [v for v in VALUES if "temp" not in v[2] and v[0] is not None]
)
def test_a_parameter_has_the_same_meaning_as_a_source(dialect, x, expression, value):
    found = run(f".param q={x}\nV1 b 0 {{{expression.replace('v(a)', 'q')}}}\n.op", dialect)
    assert float(found["v(b)"][0]) == pytest.approx(value, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("expression", ["1+v(a)^2", "v(a)^2>1", "2*(v(a))^2", "-v(a)^2"])
def test_a_sign_that_binds_in_another_way_is_refused(expression):
    assert [code for code, _ in refused(f"V1 a 0 3\nB1 b 0 V={expression}\n.op", "ltspice")] == ["E113"]


def test_what_the_model_says_of_temperature_holds_for_its_parts():
    cards = "V1 a 0 3\nR1 a b 1k\nD1 b 0 d\n.model d D(T_ABS=127 T_MEASURED=30)\n.op"
    plain = "V1 a 0 3\nR1 a b 1k\nD1 b 0 d temp=127\n.model d D(tnom=30)\n.op"
    assert float(run(cards)["v(b)"][0]) == float(run(plain)["v(b)"][0])
    relative = run("V1 a 0 3\nR1 a b r 1k\nR2 b 0 1k\n.model r R(tc1=1m t_rel_global=100)\n.op")
    assert float(relative["v(b)"][0]) == pytest.approx(3 / 2.1)
    of_the_line = run("V1 a 0 3\nR1 a b r 1k dtemp=10\nR2 b 0 1k\n.model r R(tc1=1m t_rel_global=100)\n.op")
    assert float(of_the_line["v(b)"][0]) == pytest.approx(3 / 2.01)


def test_the_deck_says_it_wherever_that_stands_and_the_caller_stands_above(tmp_path):
    deck = "V1 b 0 PWL(0 0 +1m 5 +1m 0)\nR1 b 0 1k\n.tran 1u 1.5m\n.options\n+ dialect=ltspice"
    assert float(run(deck)["v(b)"][-1]) == pytest.approx(2.5)
    assert float(run(deck, "ngspice")["v(b)"][-1]) != pytest.approx(2.5)
    (tmp_path / "own.lib").write_text(".options dialect=ngspice\nB2 d 0 V=2^3\n", encoding="utf-8")
    (tmp_path / "its.lib").write_text("B3 e 0 V=(2>1)^(3>4)\n", encoding="utf-8")
    path = tmp_path / "deck.cir"
    path.write_text(
        "deck\nV1 b 0 1\n.include own.lib\n.include its.lib\n.options dialect=ltspice\n.op\n.end\n",
        encoding="utf-8",
    )
    found = emsim.run(path)
    assert float(found["v(d)"][0]) == 8.0 and float(found["v(e)"][0]) == 1.0


def test_emsims_own_library_is_read_as_it_was_written(tmp_path):
    path = tmp_path / "deck.cir"
    path.write_text(
        "deck\nV1 b 0 1\n.include servo.lib\n.options dialect=ltspice\n.op\n.end\n", encoding="utf-8"
    )
    assert float(emsim.run(path)["v(b)"][0]) == 1.0


@pytest.mark.parametrize("how", ["deck", "python"])
def test_an_unknown_dialect_is_an_error_with_a_name_that_is_near(how):
    cards = "V1 b 0 1\nR1 b 0 1\n.op"
    found = refused(cards + "\n.options dialect=ltspise") if how == "deck" else refused(cards, "ltspise")
    assert found == [("E294", "there is no dialect `ltspise`; did you mean ltspice?")]


def test_the_command_line_has_it(tmp_path):
    path = tmp_path / "deck.cir"
    path.write_text("deck\nV1 b 0 SIN(0 1 1k)\nR1 b 0 1k\n.tran 1m\n.end\n", encoding="utf-8")

    def command(*words: str) -> subprocess.CompletedProcess[str]:
        line = [sys.executable, "-m", "emsim", "run", "--no-files", *words, str(path)]
        return subprocess.run(line, capture_output=True, text=True, timeout=60, stdin=subprocess.DEVNULL)

    assert command("--dialect", "ltspice").returncode == 0
    assert command().returncode == 1
    wrong = command("--dialect", "spectre")
    assert wrong.returncode == 2 and "there are ngspice, ltspice, pspice" in wrong.stderr


def test_cycles_of_a_sine_are_not_passed_over():
    assert refused("V1 b 0 SINE(0 1 1k 0 0 0 2)\nR1 b 0 1\n.tran 1u 4m")[0][0] == "E292"


def test_the_page_has_every_difference():
    for dialect in DIALECTS:
        for row in dialect.differences:
            assert "| `{}` | {} |".format(*(text.replace("|", "\\|") for text in row)) in PAGE


# ---- LTspice's parasitics: each beside its circuit ----

DRIVE = "V1 a 0 PULSE(0 1 0 1u 1u 1m 2m)\nR9 a b 10\n"
# name -> (line, written out)
PARASITIC = {
    "L Rser": ("L1 b 0 1m Rser=2", "L1 c 0 1m\nR1 b c 2"),
    "L Rpar": ("L1 b 0 1m Rpar=20", "L1 b 0 1m\nR1 b 0 20"),
    "L Cpar": ("L1 b 0 1m Cpar=1u", "L1 b 0 1m\nC1 b 0 1u"),
    "L all": ("L1 b 0 1m Rser=2 Rpar=20 Cpar=1u", "L1 c 0 1m\nR1 b c 2\nR2 b 0 20\nC1 b 0 1u"),
    "L IC": ("L1 b 0 1m Rser=2 ic=50m", "L1 c 0 1m ic=50m\nR1 b c 2"),
    "L m": ("L1 b 0 1m Rser=2 Cpar=1u m=2", "L1 c 0 0.5m\nR1 b c 1\nC1 b 0 2u"),
    "C Rser": ("C1 b 0 1u Rser=5", "C1 c 0 1u\nR1 b c 5"),
    "C Lser": ("C1 b 0 1u Lser=1u", "C1 c 0 1u\nL1 b c 1u"),
    "C Rpar": ("C1 b 0 1u Rpar=20", "C1 b 0 1u\nR1 b 0 20"),
    "C Cpar": ("C1 b 0 1u Rser=5 Cpar=1u", "C1 c 0 1u\nR1 b c 5\nC2 b 0 1u"),
    "C RLshunt": ("C1 b 0 1u Lser=1m RLshunt=3", "C1 c 0 1u\nL1 b c 1m\nR1 b c 3"),
    "C all": ("C1 b 0 1u Rser=5 Lser=1u Rpar=20 Cpar=10n RLshunt=3",
              "C1 d 0 1u\nR1 b c 5\nL1 c d 1u\nR2 c d 3\nR3 b 0 20\nC2 b 0 10n"),
    "C IC": ("C1 b 0 1u Rser=5 ic=0.5", "C1 c 0 1u ic=0.5\nR1 b c 5"),
    "V Rser": ("V2 b 0 SIN(0 1 1k) Rser=5", "V2 c 0 SIN(0 1 1k)\nR1 b c 5"),
    "V Cpar": ("V2 b 0 SIN(0 1 1k) Rser=5 Cpar=10u", "V2 c 0 SIN(0 1 1k)\nR1 b c 5\nC1 b 0 10u"),
    "B": ("B2 0 b I=time*10 Rpar=20 Cpar=1u", "B2 0 b I=time*10\nR1 b 0 20\nC1 b 0 1u"),
    "zeros": ("C1 b 0 1u Rser=0 Lser=0", "C1 b 0 1u"),
    "parameters": ("L1 b 0 1m Rser={1+1}", "L1 c 0 1m\nR1 b c 2"),
}  # fmt: skip


@pytest.mark.parametrize("name", PARASITIC)
def test_a_parasitic_is_the_element_that_it_stands_for(name):
    line, written_out = PARASITIC[name]
    uic = " uic" if "IC" in name else ""
    tight = {"reltol": 1e-7}
    ours, plain = (
        emsim.run(f"deck\n{DRIVE}{cards}\n.tran 1u 2m{uic}\n.end\n", options=tight)
        for cards in (line, written_out)
    )
    times = np.linspace(1e-6, 2e-3, 400)
    a, b = (np.interp(times, r["time"], r["v(b)"]) for r in (ours, plain))
    assert np.abs(a - b).max() < 1e-5 * max(1e-3, float(np.abs(b).max()))
    assert not [d for d in ours.diagnostics if d.code == "W281"]
    small = [
        emsim.run(f"deck\nV1 a 0 0 AC 1\nR9 a b 10\n{cards}\n.ac dec 5 10 1meg\n.end\n")["v(b)"]
        for cards in (line, written_out)
    ]
    assert np.abs(small[0] - small[1]).max() < 1e-9


def test_tref_of_a_model_is_tnom():
    """LTspice's and HSPICE's word for the temperature of the parameters: of a diode and a transistor."""
    cards = "V1 a 0 0.6\nD1 a 0 dm\nV2 b 0 0.65\nQ1 a b 0 qm\n.model dm D(is=1e-14 {0})\n.model qm NPN(is=1e-15 {0})\n.op"
    found = [run(cards.format(word)).op["i(v1)"] for word in ("tref=77", "tnom=77", "tnom=27")]
    assert found[0] == found[1]
    assert abs(found[0]) < 0.01 * abs(found[2])


def test_a_small_vj_that_the_heat_takes_below_zero_names_tlevc():
    """A published Schottky card at 85 degrees; ngspice 39 has 28.1605879 mA."""
    card = "IS=2.117E-07 N=1.016 RS=2.637 CJO=1.114E-11 VJ=0.2013 M=0.3868 EG=0.69 XTI=2"
    cards = "V1 a 0 0.3\nD1 a 0 d\n.model d D({})\n.temp 85\n.op"
    assert any(code == "E299" and "tlevc=1" in said for code, said in refused(cards.format(card)))
    assert run(cards.format(f"{card} tlevc=1")).op["i(v1)"] == pytest.approx(-0.0281605879, rel=1e-6)


def test_nodes_of_pspice_schematics_are_no_comments() -> None:
    r = run("V_V1 $N_0001 0 3 $ a comment\nR_R1 $N_0001 $N_0002 1k $N is one too\nR_R2 $N_0002 0 2k\n.op")
    assert r["v($n_0002)"][-1] == pytest.approx(2.0)


@pytest.mark.parametrize("dialect", [None, "ltspice", "pspice"])
def test_the_rest_of_a_lib_line_is_a_path_with_its_blanks(dialect: str | None, tmp_path: Path) -> None:
    folder = tmp_path / "My Parts (x86)"
    folder.mkdir()
    (folder / "resistors of mine.lib").write_text(".model rr r(r=2k)\n")
    deck = tmp_path / "deck.cir"
    deck.write_text(
        "deck\n.lib My Parts (x86)\\resistors of mine.lib ; theirs\nV1 a 0 1\nR1 a 0 rr\n.op\n.end\n"
    )
    r = emsim.run(deck, options={} if dialect is None else {"dialect": dialect})
    assert r["i(v1)"][-1] == pytest.approx(-0.5e-3)


def test_a_missing_library_with_blanks_is_told_by_its_whole_name() -> None:
    path = "C:\\Program Files (x86)\\LTC\\LTspiceIV\\lib\\cmp\\parts.bjt"
    with pytest.raises(emsim.OutsideError, match=re.escape(f"there is no file {path}")):
        run(f"V1 a 0 1\nR1 a 0 1k\n.lib {path}\n.op", "ltspice")


def test_what_a_part_stands_says_nothing_to_the_run() -> None:
    r = run(
        "V1 a 0 1\nR1 a b 1k tol=1 pwr=0.1\nL1 b c 1m Ipk=2 pn=74437\n"
        'C1 c 0 1u V=50 Irms=0 mfg="KEMET" type="X7R" Rser=1m Lser=0\nR2 c 0 1k\n.op',
        "ltspice",
    )
    assert r["v(c)"][-1] == pytest.approx(0.5, rel=1e-5)

"""What decks as people have them ask of .control, against what ngspice prints and writes: blocks by other names, output that
goes to files, names of nodes, vectors of several dimensions, functions of all vectors, cutout, fft(), wrs2p."""

from __future__ import annotations

import re

import numpy as np
import pytest
from control_runs import agree, deck, here, lines, same, there
from support import needs_ngspice

import emsim

VALUE = re.compile(r"^(\S+) = (\S+)$", re.M)
RC = "V1 1 0 DC 1 AC 1 SIN(0 1 1k)\nR1 1 11 1k\nR2 11 2 1k\nR3 2 x10 1k\nR4 x10 x9 1k\nR5 x9 a/b 1k\nR6 a/b 0 1k\nC1 x9 0 10n"

SECTIONS = {
    "blocks by other names": (
        "begin\nop\nif 0\necho no\nelse\necho yes\nendif\nend\nlet k = 0\nwhile k < 2\nlet k = k + 1\nendwhile\nprint k\n"
        "foreach w a b\necho $w\nendforeach\nrepeat 2\necho x\nendrepeat"
    ),
    "numbers in names by their size": "op\nprint all\nprint allv",
    "nodes called by numbers": "op\ndisplay\nprint 1 2 v(1)",
    "columns of nodes called by numbers": "dc v1 0 1 1\nprint all",
    "unequal": "op\nif v(1) >< v(2)\necho other\nend\nif v(1) >< v(1)\necho other\nend",
    "names that let makes": (
        "op\nlet v(2) = 7\nprint v(2)\nlet v(/22) = 3\nprint v(/22)\nlet v(a/b) = v(1)\nprint v(a/b)-v(x9)"
    ),
    "several dimensions": (
        "let a = vector(24)\nreshape a [2][3][4]\nlet a[1][2][3] = 99\nlet k = 1\nlet a[0][k][2] = a[1][k][2]\nprint a[1][2]\n"
        "print a[0][1]\nprint a"
    ),
    "dimensions by variables": (
        "let a = vector(6)\nlet n = 2\nset nn = $&n\nset three = 3\nreshape a [$nn][$three]\nprint a[1][2]\n"
        "let b = vector(4)\nreshape b [2,2]\nprint b[1][1]"
    ),
    "quotes about an expression": "op\nprint '2*v(1)'",
    "cutout": (
        "tran 10u 3m 0 1u\nlet cut-tstart = 1m\nlet cut-tstop = 2m\ncutout\nsetplot\nlet top = vecmax(v(1))\n"
        "let low = vecmin(v(1))\nprint top low"
    ),
    "cutout of named vectors": "tran 10u 3m 0 1u\nlet cut-tstop = 2m\ncutout v(1)\nlet low = vecmin(v(1))\nprint low",
    "differences": "let a = vector(5)^2\nprint vecd(a)",
    "plots by names that variables make": (
        "setplot new\nset there = $curplot\nop\nset k = 3\nset dt = $curplot\nsetplot $there\nlet out{$k} = {$dt}.v(2)\n"
        "print {$there}.out3\nprint 2*{$there}.allv"
    ),
}


@needs_ngspice
@pytest.mark.ngspice
@pytest.mark.parametrize("name", SECTIONS)
def test_a_section_prints_what_ngspice_prints(name, tmp_path):
    agree(RC, SECTIONS[name], tmp_path)


@needs_ngspice
@pytest.mark.ngspice
def test_what_commands_show_goes_to_files_as_in_ngspice(tmp_path):
    text = deck(
        RC,
        "op\nprint v(1) v(2) > a.txt\necho first > b.txt\necho second >> b.txt\necho third >> b.txt\nprint v(2)",
    )
    theirs = there(text, tmp_path / "ngspice")
    (tmp_path / "emsim").mkdir()
    (tmp_path / "emsim" / "deck.cir").write_text(text)
    ours = run_in(tmp_path / "emsim")
    assert same(ours, theirs) is None, ours
    for name in ("a.txt", "b.txt"):
        a, b = ((tmp_path / who / name).read_text() for who in ("emsim", "ngspice"))
        assert same(a, b) is None, (a, b)
        assert lines(a)


def run_in(folder) -> str:
    """What emsim prints, with the files that the deck writes."""
    import subprocess
    import sys

    done = subprocess.run(
        [sys.executable, "-m", "emsim", "-q", "deck.cir"],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=60,
    )
    return done.stdout


def test_a_comparison_is_no_file_and_a_file_outside_is_refused(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert here(deck(RC, "op\nprint v(1) > 0.5"), tmp_path / "a")[0].startswith("v(1) > 0.5 = 1.0")
    found = emsim.run(deck(RC, "op\necho x > ../outside.txt"))
    assert [d.code for d in found.diagnostics if d.severity == "error"] == ["E163"]
    assert not (tmp_path.parent / "outside.txt").exists()


@needs_ngspice
@pytest.mark.ngspice
def test_scattering_parameters_as_a_touchstone_file(tmp_path):
    ports = (
        "V1 in 0 DC 0 AC 1 portnum 1 z0 50\nL1 in out 100n\nC1 out 0 30p\nV2 out 0 DC 0 AC 0 portnum 2 z0 50"
    )
    text = deck(ports, "sp lin 5 1meg 200meg\nlet Rbase = 50\nwrs2p lowpass.s2p")
    there(text, tmp_path / "ngspice")
    (tmp_path / "emsim").mkdir()
    (tmp_path / "emsim" / "deck.cir").write_text(text)
    run_in(tmp_path / "emsim")
    ours, theirs = ((tmp_path / who / "lowpass.s2p").read_text() for who in ("emsim", "ngspice"))
    of = [[line for line in t.splitlines() if not line.startswith("!Generated")] for t in (ours, theirs)]
    assert [a for a in of[0] if a[0] in "!#"] == [b for b in of[1] if b[0] in "!#"]
    a, b = (np.array([line.split() for line in t if line[0] not in "!#"], float) for t in of)
    assert a.shape == (5, 9) and np.allclose(a, b, rtol=1e-5, atol=1e-9)


@needs_ngspice
@pytest.mark.ngspice
def test_a_spectrum_within_an_expression(tmp_path):
    """A sine over a whole period: one line; and back again, the first half of what it was."""
    commands = "let x = 3*sin(2*pi*vector(16)/16)\nlet y = fft(x)\nprint mag(y)[1] mag(y)[0] length(y)\nprint fft_scale[2]"
    text = deck(RC, commands)
    theirs = [line for line in there(text, tmp_path / "a").splitlines() if " = " in line]
    ours = [line for line in here(text, tmp_path / "b")[0].splitlines() if " = " in line]
    assert len(ours) == 4 and same("\n".join(ours), "\n".join(theirs)) is None
    found = emsim.run(deck(RC, "let x = vector(7)\nprint real(ifft(fft(x+j(0))))[5]")).output
    assert found.split("=")[1].strip() == "5.000000e+00"


def test_vectors_of_another_length_stand_aside_of_a_table():
    found = emsim.run(
        deck(RC, "tran 10u 1m\ndc v1 0 1 0.5\nlet three = vecmax(v(1))*3\nlet other = tran1.v(1)")
    )
    table = found.plots[-1]
    assert table["three"].tolist() == [3.0] and len(table["other"]) == len(found.plots[0])


def test_one_equals_sign_compares_in_a_condition():
    body = (
        ".param k=2\n.if (k = 1)\nR1 a 0 1\n.elseif (k = 2)\nR1 a 0 2\n.else\nR1 a 0 3\n.endif\nI1 0 a 1\n.op"
    )
    assert emsim.run(f"t\n{body}\n.end\n")["v(a)"][0] == pytest.approx(2.0)


PROBED = """V1 d 0 2
VG g 0 2
M1 d g s 0 mm
RS s 0 100
Q1 d g e qm
RE e 0 1k
X1 d s halves
C1 d s 1p
.subckt halves a b
R1 a c 1k
R2 c b 1k
.ends
.model mm nmos(level=1)
.model qm npn
.probe vd(rs) vd(m1:d:s) vd(m1:1:0) p(q1) p(x1) p(m1) i(rs) i(m1:s) i(x1) i(x1:2) vd(x1:1:2) p(rs) vd(q1:b:e) i(q1:b) p(v1)
.op"""


@needs_ngspice
@pytest.mark.ngspice
def test_probes_of_terminals(tmp_path):
    names = "m1:power m1:s#branch q1:b#branch q1:power rs:power v1:power vd_m1:d:0 vd_m1:d:s vd_q1:b:e vd_rs vd_x1:a:b x1#branch"
    text = deck(PROBED, "run\nprint all")
    found = [
        dict(VALUE.findall(said)) for said in (there(text, tmp_path / "a"), here(text, tmp_path / "b")[0])
    ]
    there_, here_ = ({k: float(v) for k, v in f.items()} for f in found)
    for name in (*names.split(), "x1:b#branch", "x1:power"):
        assert here_[name] == pytest.approx(there_[name], rel=1e-4, abs=1e-12), name


def test_probes_of_what_is_not_there_are_left_out():
    said = emsim.run("t\nV1 a 0 1\nR1 a 0 1\n.probe vd(r2) i(r1:3) p(r1)\n.op\n.end\n")
    assert [d.code for d in said.diagnostics] == ["W287", "W287"] and said["r1:power"][0] == pytest.approx(
        1.0
    )


ALTERED = """V1 1 0 1
X1 1 0 pair a=7 b=9
.subckt pair in out b=6
.param a=5
.param c=8
R0 in out {a}
R1 in out {b}
R2 in out {c}
.ends"""


@needs_ngspice
@pytest.mark.ngspice
def test_parameters_within_a_subcircuit_are_altered_as_in_ngspice(tmp_path):
    commands = "op\nprint v1#branch\nalterparam pair a = 13\nalterparam pair b = 15\n"
    commands += "alterparam pair c = 17\nreset\nop\nprint v1#branch"
    agree(ALTERED, commands, tmp_path)
    assert not emsim.run(deck(ALTERED, "op")).diagnostics


@needs_ngspice
@pytest.mark.ngspice
def test_voltages_beside_scattering_parameters(tmp_path):
    ports = "V1 in 0 DC 0 AC 1 portnum 1 z0 50\nL1 in 2 99n\nC1 2 0 30p\nV2 2 0 DC 0 AC 0 portnum 2 z0 75"
    commands = "sp lin 5 1meg 200meg\nlet one = v(in)[2]\nlet two = v(2)[3]\nlet three = i(v2)[4]\nlet four = i(l1)[1]"
    agree(ports, commands + "\nprint one two three four", tmp_path)


def test_the_resistance_to_small_signals_counts_for_them_alone():
    """1k, 2k to small signals, above 2k: .tf and .sens at the operating point know the 1k, .sens over frequency the 2k."""
    body = "V1 a 0 DC 3 AC 2\nR1 a b 1k ac=2k\nR2 b 0 2k"
    found = emsim.run(f"t\n{body}\n.tf v(b) v1\n.end\n")
    assert found["transfer_function"][0] == pytest.approx(2 / 3, rel=1e-9)
    still = emsim.run(f"t\n{body}\n.sens v(b)\n.end\n")
    assert still["r1"][0] == pytest.approx(-3 * 2e3 / 3e3**2, rel=1e-6)
    assert still["r2"][0] == pytest.approx(3 * 1e3 / 3e3**2, rel=1e-6)
    moving = emsim.run(f"t\n{body}\n.sens v(b) ac lin 1 1k 1k\n.end\n")
    assert moving["r1_ac"][0] == pytest.approx(-2 * 2e3 / 4e3**2, rel=1e-6)
    assert moving["r2_ac"][0] == pytest.approx(2 * 2e3 / 4e3**2, rel=1e-6)
    assert abs(moving["r1"][0]) < 1e-12


@needs_ngspice
@pytest.mark.ngspice
def test_slopes_by_what_counts_current_sources(tmp_path):
    body = "V1 a 0 DC 3 AC 2\nI1 0 b DC 1m AC 1 30 m=2\nR1 a b 1k\nR2 b 0 2k\nC1 b 0 1n"
    (tmp_path / "still").mkdir()
    agree(body, "sens v(b)\nprint i1 i1_m v1", tmp_path / "still")
    (tmp_path / "moving").mkdir()
    commands = "sens v(b) ac lin 1 100k 100k\nprint i1_m i1_acmag i1_acphase r1_ac r2_ac"
    agree(body, commands, tmp_path / "moving")

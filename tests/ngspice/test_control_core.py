"""The commands of .control against what ngspice 39 prints: runs, vectors, printing, blocks, changes of the deck, files."""

from __future__ import annotations

import numpy as np
import pytest
from control_runs import agree, deck, here, there
from support import needs_ngspice

pytestmark = [needs_ngspice, pytest.mark.ngspice]

RC = "V1 in 0 DC 1 AC 1\nR1 in out 1k\nR2 out 0 3k\nC1 out 0 1u"

SECTIONS = {
    "op and print": "op\nprint all\nprint v(out) v(in)-v(out)\nprint -v(out)\nprint out in v1#branch i(v1) v(in,out)",
    "commas": "op\nlet b = vector(5)\nprint v(in),v(out)\nprint in, out v(in,out),(1,2)*2\nprint b[1,3], max(b[0],b[4]),pi",
    "columns": "op\nlet a = 3\nlet b = vector(5)\nprint a b\nprint b\nprint b[2] b[1,3] b[3,1]\nprint line b",
    "complex": "op\nlet c = (1,2)*3\nprint c\nlet d = vector(3)+j(vector(3))\nprint d mag(d) re(d) im(d)\nprint line d",
    "ac": "ac dec 2 10 1k\nprint v(out)\nprint db(v(out)) ph(v(out))\nprint line v(out)\ndisplay",
    "dc": "dc v1 0 1 0.25\nprint v(out)\ndisplay\nprint v-sweep".replace("\nprint v-sweep", ""),
    "echo": (
        "op\nlet a = 1/3\nlet b = vector(3)*1.5\necho $&a $&b\n"
        "echo \"a  'b'  c\" done\necho -n abc\necho def\necho $curplot"
    ),
    "variables": 'set list = ( 3 4 five )\necho $list $list[2] $#list $?list $?none\nset y = "hello there"\necho $y',
    "numbers as words": "set z=1e-12\necho $z\nset x = 0.123456789\necho $x\nlet v = 1e-12*1.2345678\necho $&v",
    "while": "let k = 0\nwhile k < 3\n echo k = $&k\n let k = k + 1\nend\nprint k",
    "dowhile": "let k = 0\ndowhile k < 3\n let k = k + 1\nend\nprint k",
    "repeat": "repeat 3\n echo again\nend",
    "foreach": "op\nforeach v 1 2 3\n let z = $v*2\n print z\nend\nset l = ( a b )\nforeach w $l\n echo $w\nend",
    "if": (
        "let k = 2\nif k > 3\n echo big\nelse\n echo small\nend\n"
        "if k = 2 and 1\n echo two\nend\nif k <> 2\n echo other\nend"
    ),
    "elseif": "let k = 2\nif k = 1\necho one\nelse\nif k = 2\necho two\nend\nend",
    "break": "let k = 0\nwhile 1\n let k = k + 1\n if k = 2\n continue\n end\n echo $&k\n if k > 3\n break\n end\nend",
    "break of two": "foreach a 1 2\nforeach b 1 2\necho $a $b\nbreak 2\nend\nend\necho done",
    "goto": "let k = 0\nlabel again\nlet k = k + 1\nif k < 3\ngoto again\nend\nprint k",
    "nested": "foreach a 1 2\nforeach b x y\nif $a = 2\nif 0\necho no\nelse\necho $a $b\nend\nend\nend\nend",
    "plots": "op\nac dec 1 10 100\nop\nsetplot\nsetplot op1\nprint v(out)\nprint ac1.v(out)\nsetplot ac1\ndisplay",
    "vectors of other plots": "op\nlet a = v(out)*2\nop\nprint op1.a op1.v(out)\nprint v(out) op1.a",
    "let of a place": "let b = vector(4)\nlet b[2] = 100\nprint b",
    "unlet": "op\nlet a = 1\nunlet a\ndisplay",
    "define": "define f(x,y) x*y+1\nprint f(2,3)\nop\nprint f(v(out),2)\ndefine g(x) f(x,x)\nprint g(3)",
    "constants": "print pi e c boltz echarge kelvin i yes no true false",
    "alter": "op\nprint v(out)\nalter r2 = 1k\nop\nprint v(out)\nalter v1 dc = 4\nop\nprint v(out)\nreset\nop\nprint v(out)",
    "alter @": "alter @r2[resistance] = 1k\nalter @v1[dc]=2\nop\nprint v(out) @r2[resistance] @v1[dc]",
    "alter by a vector": "let r = 500\nalter r2 = r*2\nop\nprint v(out)\nlet r = 2k\nalter r2 = $&r\nop\nprint v(out)",
    "alter in a loop": "foreach r 1k 2k 3k\nalter r2 = $r\nop\nprint v(out)\nend",
    "option": "option temp=50\nop\nprint v(out)",
    "settype": "op\nlet a = v(out)\nsettype voltage a\nlet b = 3\nsettype time b\ndisplay",
    "destroy": "op\nop\nop\ndestroy op2\nsetplot\ndestroy all\nop\nsetplot",
    "numdgt": "op\nset numdgt=10\nprint v(out) 1/3\nprint vector(3)/7",
    "width": "op\nset width=120\nprint vector(3) vector(3)*2 vector(3)*3 vector(3)*4 vector(3)*5 vector(3)*6",
    "height": "let x = vector(80)\nset height=30\nprint x",
    "tables side by side": "print vector(3) vector(3)*2 vector(3)*3 vector(3)*4 vector(3)*5 vector(3)*6",
    "device": "op\nprint @r1[i] @r1[resistance] @c1[capacitance] @v1[acmag]",
    "strcmp": "strcmp q abc abd\necho $q\nstrcmp q abc abc\necho $q",
    "comments": "op; print v(out)\nlet a = 2 $ a comment\nprint a // another\necho x ; y",
    "shift": "set argv = ( 1 2 3 )\nshift\necho $argv",
}


@pytest.mark.parametrize("name", SECTIONS)
def test_a_section_prints_what_ngspice_prints(name, tmp_path):
    agree(RC, SECTIONS[name], tmp_path)


DOTS = "V1 in 0 DC 1 AC 1 SIN(0 1 1k)\nR1 in out {r}\nC1 out 0 1u\n.param r=1k\n.ac lin 3 10 1k"


@pytest.mark.parametrize(
    "commands",
    [
        "run\nsetplot\nprint v(out)",
        "run\nsetplot ac1\nprint v(out)",
        "alterparam r = 2k\nreset\nop\nprint @r1[resistance] v(out)\nac lin 3 10 100\nprint v(out)",
        "foreach x 1k 3k\nalterparam r = $x\nreset\nac lin 3 10 100\nprint v(out)\nend",
        "alter @v1[sin] = [ 0 2 1k ]\nalter v1 acmag = 2\nac lin 3 10 100\nprint v(out)",
    ],
)
def test_the_deck_s_own_analyses(commands, tmp_path):
    agree(DOTS, commands, tmp_path)


MODEL = "V1 in 0 1\nR1 in a 1k\nD1 a 0 dm\n.model dm d(is=1e-14 n=1.5)"


@pytest.mark.parametrize(
    "commands",
    ["altermod dm is = 1e-10\nop\nprint v(a)", "altermod @dm[n] = 1\nop\nprint v(a)\nreset\nop\nprint v(a)"],
)
def test_models_are_altered(commands, tmp_path):
    agree(MODEL, commands, tmp_path)


FILES = {
    "wrdata": "ac lin 3 10 1k\nwrdata x.txt v(out) v(in)",
    "wrdata of one scale": "set wr_singlescale\nset wr_vecnames\ndc v1 0 1 0.5\nwrdata x.txt v(out) v(in)*2",
    "wrdata appended": "op\nset appendwrite\nwrdata x.txt v(out)\nwrdata x.txt v(in)",
    "wrdata digits": "set numdgt=4\ndc v1 0 1 0.5\nwrdata x.txt v(out)",
}


@pytest.mark.parametrize(
    "words", ["print v(out)>x.txt", "print v(out)> x.txt\necho more>>x.txt\nprint v(in,out) >>x.txt"]
)
def test_what_is_said_goes_to_a_file_with_blanks_or_without(words, tmp_path):
    text = deck(RC, f"op\n{words}\nprint v(in)")
    said = there(text, tmp_path / "a"), here(text, tmp_path / "b")[0]
    assert all("v(in) = 1.0" in one and "v(out)" not in one for one in said)
    theirs, ours = ((tmp_path / f / "x.txt").read_text() for f in "ab")
    assert ours == theirs


@pytest.mark.parametrize("name", FILES)
def test_columns_of_text_are_those_of_ngspice(name, tmp_path):
    text = deck(RC, FILES[name])
    there(text, tmp_path / "a"), here(text, tmp_path / "b")
    theirs, ours = ((tmp_path / f / "x.txt").read_text() for f in "ab")
    assert [len(line) for line in ours.split("\n")] == [len(line) for line in theirs.split("\n")]
    words = [[w for w in text.split() if w[0].isalpha()] for text in (ours, theirs)]
    assert words[0] == words[1]
    numbers = [[float(w) for w in text.split() if not w[0].isalpha()] for text in (ours, theirs)]
    assert numbers[0] == pytest.approx(numbers[1], rel=1e-4, abs=1e-9)


@pytest.mark.parametrize(
    "commands",
    [
        "ac lin 3 10 1k\nwrite x.raw",
        "op\nlet a = 2*v(out)\nwrite x.raw a v(out)",
        "dc v1 0 1 0.5\nop\nwrite x.raw\nset appendwrite\nac lin 3 1 10\nwrite x.raw v(out)",
    ],
)
def test_raw_files_hold_the_same_plots(commands, tmp_path):
    from emsim.outputs import raw

    text = deck(RC, commands)
    there(text, tmp_path / "a"), here(text, tmp_path / "b")
    theirs, ours = (raw.read(str(tmp_path / f / "x.raw")) for f in "ab")
    assert [p.plotname for p in ours.plots] == [p.plotname for p in theirs.plots]
    for p, q in zip(ours.plots, theirs.plots, strict=True):
        assert sorted(p.names) == sorted(q.names)
        for name in p.names:
            assert np.allclose(p[name], q[name], rtol=1e-4, atol=1e-9)


def test_quit_gives_the_exit_code(tmp_path):
    for code in (0, 3):
        assert here(deck(RC, f"op\nquit {code}"), tmp_path)[1].returncode == code

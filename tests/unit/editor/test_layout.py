"""`emsim fmt`: only blanks change, the deck's tree does not, and doing it again changes nothing."""

from __future__ import annotations

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import ROOT, daily

from emsim.cli import main
from emsim.editor.layout import BLANKS, formatted, meaning
from emsim.source import decode

DECKS = sorted(
    path
    for folder in ("netlists", "tests", "emsim/templates")
    for path in (ROOT / folder).rglob("*.cir")
    if decode(path.read_bytes()) is not None
)


def solid(text: str) -> list[str]:
    return [
        line for line in ("".join(c for c in line if c not in BLANKS) for line in text.split("\n")) if line
    ]


def holds(text: str) -> str:
    new = formatted(text)
    assert meaning(new) == meaning(text)
    assert formatted(new) == new
    # line breaks stay, but for empty lines
    # nothing but blanks changed, and no line break but those of empty lines
    assert solid(new) == solid(text)
    return new


@pytest.mark.parametrize("path", DECKS, ids=lambda p: str(p.relative_to(ROOT)))
def test_every_deck(path):
    holds(decode(path.read_bytes()) or "")


@pytest.mark.parametrize("name", ["dots", "elements", "machine"])
def test_lines_that_the_grammar_refuses(name):
    holds("title\n" + (ROOT / "grammar" / "errors" / f"{name}.txt").read_text())


@pytest.mark.parametrize("seed", daily(range(60), 3))
def test_decks_with_blanks_put_in_and_taken_out(seed):
    """Where a blank is, there may be more; around `=` and brackets there may be some; words may be anything."""
    rng = random.Random(seed)
    text = decode(rng.choice(DECKS).read_bytes()) or ""
    out = []
    for c in text:
        roll = rng.random()
        if c == " " and roll < 0.2:
            c = rng.choice(
                ["   ", "\t", " \t ", "  ", "\n+ ", "\n* note\n+", " ; why\n+ ", "\xa0", "\n;x\n +"]
            )
        elif c in "=(){},;" and roll < 0.3:
            c = rng.choice([" " + c, c + " ", f" {c} ", c, ""])
        elif c == "\n" and roll < 0.1:
            c = rng.choice(
                [
                    "\n\n\n",
                    " \n",
                    "\n  ",
                    " ; x\n",
                    "\n+",
                    "\n*\n",
                    " $ y\n",
                    "\n.control\n",
                    "\n.endc\n",
                    "\n.if (1)\n",
                ]
            )
        elif roll < 0.01:
            c = rng.choice("'\"{}()=;$*/+ \n.") + c
        out.append(c)
    holds("".join(out))


@settings(max_examples=150, deadline=None)
@given(
    st.text(alphabet="R1ab=0 \t\n+*;$/(){}'\".\xa0\fé,", max_size=120),
    st.sampled_from(["t\n", "", "t\n.subckt a b\n"]),
)
def test_any_text(text, head):
    holds(head + text)


@pytest.mark.parametrize("line", ["a;\xe9", "R1 a 0 1k;\xe9", "q1;x\xe9 a b"])
def test_a_comment_that_follows_without_a_blank(line):
    """Whatever its letters are, it is laid out as one."""
    assert "  ;" in holds(f"t\n{line}\n")


def test_how_it_looks():
    text = """ the title   stays
BODY arm shape = rod(0.3)   m=0.2 ; a  rod
JOINT hinge 0 arm pin zero=-90deg;bent
POINT arm.tip 0.3   0
  * a remark
.param   r = 1k  c=1n


.subckt Filter in out
Rs in out {r  *  2} $ two  of them
+ tc = 1m ; more
Clong_name out 0 1n
.if (r==1)
  * inside
X1 a   b c
.else
Rverylongname_that_does_not_fit_the_column a b 1
R2 a b 1
.endif
.ends
.meas  tran  x  find v(a)  at=1
.control
  plot   v(a)
.endc
Vin in 0 PULSE(0 1   0 1n)
.end
what   ever
"""
    assert (
        formatted(text)
        == """ the title   stays
BODY  arm     shape=rod(0.3) m=0.2   ; a  rod
JOINT hinge   0 arm pin zero=-90deg  ;bent
POINT arm.tip 0.3 0
* a remark
.param r=1k c=1n

.subckt Filter in out
  Rs         in  out {r  *  2}  $ two  of them
  + tc=1m                       ; more
  Clong_name out 0   1n
  .if (r==1)
    * inside
    X1 a b c
  .else
    Rverylongname_that_does_not_fit_the_column a b 1
    R2 a b 1
  .endif
.ends
.meas  tran  x  find v(a)  at=1
.control
  plot   v(a)
.endc
Vin in 0 PULSE(0 1   0 1n)
.end
what   ever
"""
    )


def test_the_command(scratch, capsys, monkeypatch):
    good, bad = "t\nR1  a 0 1k\nR10 a 0 2k\n.end\n", "t\nR1 a 0 1k\nR10 a 0 2k\n.end\n"
    (scratch / "good.cir").write_text(good)
    (scratch / "bad.cir").write_text(bad)
    assert main(["fmt", "--check", "good.cir"]) == 0
    assert main(["fmt", "--check", "good.cir", "bad.cir"]) == 1
    said = capsys.readouterr()
    assert "bad.cir: would change" in said.err and "good.cir" not in said.err and not said.out
    assert (scratch / "bad.cir").read_text() == bad
    assert main(["fmt", "bad.cir"]) == 0 and (scratch / "bad.cir").read_text() == good
    assert main(["fmt"]) == 2 and main(["fmt", "none.cir"]) == 5
    (scratch / "binary.cir").write_bytes(b"\0\1\2")
    assert main(["fmt", "binary.cir"]) == 5 and (scratch / "binary.cir").read_bytes() == b"\0\1\2"
    import io

    monkeypatch.setattr("sys.stdin", io.StringIO(bad))
    capsys.readouterr()
    assert main(["fmt", "-"]) == 0 and capsys.readouterr().out == good


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "latin-1", "utf-16"])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_encoding_and_line_ends_stay(encoding, end, scratch):
    text = "t\u00e4\nR1 a 0 1k ; \u00fcber\nR10 a 0 2k\n"
    (scratch / "x.cir").write_bytes(text.replace("\n", end).encode(encoding))
    assert main(["fmt", "x.cir"]) == 0
    wanted = "t\u00e4\nR1  a 0 1k  ; \u00fcber\nR10 a 0 2k\n".replace("\n", end)
    assert (scratch / "x.cir").read_bytes().decode(encoding) == wanted

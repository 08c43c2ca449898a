"""Decks in the spellings that people use, against what ngspice makes of them (dialects.txt); and what other SPICEs say in
words that ngspice does not have: read where the meaning is plain, else refused with a sentence that says what to write."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest
from support import needs_ngspice

import emsim

TABLE = Path(__file__).resolve().parent / "dialects.txt"


def table() -> dict[str, tuple[dict[str, float], str]]:
    """name -> (last values of signals, cards)."""
    found = {}
    for part in TABLE.read_text(encoding="utf-8").split("\n== ")[1:]:
        head, _, cards = part.partition("\n")
        name, *values = head.split()
        found[name] = (
            {k: float(v) for k, _, v in (word.rpartition("=") for word in values)},
            cards.rstrip("\n"),
        )
    return found


DECKS = table()


def test_the_table_is_whole():
    assert len(DECKS) > 200 and all(values and cards for values, cards in DECKS.values())


@pytest.mark.parametrize("name", DECKS)
def test_a_spelling_of_the_field_means_what_it_means_to_ngspice(name):
    values, cards = DECKS[name]
    result = emsim.run(f"deck\n{cards}\n.end\n")
    for signal, value in values.items():
        assert float(result[signal][-1]) == pytest.approx(value, rel=1e-3, abs=1e-6), signal


@needs_ngspice
@pytest.mark.ngspice
@pytest.mark.parametrize("name", [*DECKS][::6])
def test_ngspice_gives_these_values(name, tmp_path):
    values, cards = DECKS[name]
    last = "" if re.search(r"(?im)^\.op", cards) else "[length({})-1]"
    shown = [f"print {signal}{last.format(signal)}" for signal in values]
    control = [".control", "set numdgt=9", "run", *shown, "quit", ".endc", ".end", ""]
    (tmp_path / "deck.cir").write_text("\n".join(["deck", cards, *control]), encoding="utf-8")
    done = subprocess.run(
        ["ngspice", "-b", "deck.cir"],
        cwd=tmp_path,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=30,
    )
    found = re.findall(r"^(?:[^=\n]*) = (\S+)$", done.stdout, re.MULTILINE)
    assert [float(x) for x in found[-len(values) :]] == pytest.approx([*values.values()], rel=1e-6, abs=1e-9)


# what ngspice does not read, or reads as something else, and whose meaning is plain
PLAIN = {
    "V1 a 0 5D+0\nR1 a b 1D-3\nR2 b 0 1d-3\n.op": 2.5,
    ".param x=2d3 y={1d3*2}\nV1 a 0 5\nR1 a b {x}\nR2 b 0 {y}\n.op": 2.5,
    'V1 Net-(R1-Pad1) 0 12\nR1 Net-(R1-Pad1) "Net-(R2-Pad1)" 1k\nR2 "Net-(R2-Pad1)" 0 2k\nE1 b 0 "Net-(R2-Pad1)" 0 1\n.op': 8.0,
    'V1 "Net-(U1-+)" 0 12\nB1 b 0 V={v("Net-(U1-+)")/2+v(Net-(U1-+))}\n.op': 18.0,
    "V1 d[1] 0 12\nR1 d[1] b 1k\nR2 b 0 2k\n.op": 8.0,
    ".param a=1k, b=2k\nV1 a 0 3\nR1 a b {a}\nR2 b 0 {b}\n.op": 2.0,
    "V1 a 0 3\nR1 a b 1k tc=1m,1u\nR2 b 0 1k\n.temp 127\n.op": 1.4218009479,
    "V1 a 0 1\nR1 a b 1k\nR2 b 0 1k\n.options plotwinsize=0 numdgt=7\n.backanno\n.op": 0.5,
    "V1 a 0 3\nB1 b 0 V=table(v(a), 0, 0, 5, 10)\n.op": 6.0,
    ".subckt s a b params:r=1k\nR1 a b {r}\n.ends\nV1 a 0 3\nX1 a b s params:r=2k\nR2 b 0 1k\n.op": 1.0,
    ".subckt s a b r=1k q=1k\nR1 a b {r+q}\n.ends\nV1 a 0 3\nX1 a b s r=2k, q=1k\nR2 b 0 1k\n.op": 0.75,
    "V1 a 0 1\nL1 a b 1m Rser=1k\nR1 b 0 1k\n.op": 0.5,
    "V1 a 0 1 Rser=1k\nR1 a b 1\nR2 b 0 1k\n.op": 1000 / 2001,
    "V1 a 0 1\nR1 a b 1k noiseless\nR2 b 0 1k\n.op": 0.5,
}


@pytest.mark.parametrize("cards", PLAIN)
def test_other_spellings_whose_meaning_is_plain_are_read(cards):
    assert float(emsim.run(f"deck\n{cards}\n.end\n")["v(b)"][-1]) == pytest.approx(PLAIN[cards], rel=1e-6)


# code and what the message or its hint says
TOLD = {
    "V1 a 0 PWL(0 0 10m 0 +1u 1 +10m 1 +1u 0)\nR1 a 0 1k\n.tran 10u 30m": (
        "E113",
        "PWL(0 0 0.01 0 0.010001 1 0.020001 1 0.020002 0)",
    ),
    "V1 a 0 PWL(0 0 +1m 5 +2m 5 +3m 0)\nR1 a 0 1k\n.tran 10u 8m": (
        "E113",
        "PWL(0 0 0.001 5 0.003 5 0.006 0)",
    ),
    "V1 a 0 1\nR1 a 0 1k\n.tran 5m": ("E118", "write .tran 5u 5m"),
    "V1 a 0 1\nR1 a 0 1k\n.tran 0 5m 0 1u": ("E305", ".tran 5e-06 0.005"),
    "V1 a 0 1\nR1 a b 1k\nR2 c 0 1k\nR3 b 0 1k\n.connect b c\n.op": ("E113", "one name"),
    "V1 a 0 1\nR1 a 0 1k\n.alter\nR1 a 0 2k\n.op": ("E113", ".alter is not supported"),
    'V1 a 0 1\nR1 a 0 1k\n.hdl "x.va"\n.op': ("E501", "cannot read x.va"),
    "V1 a 0 1\nR1 a 0 1k\nB1 b 0 V=uplim(v(a),1,0.1)\n.op": ("E122", "min(x, limit)"),
    "V1 a 0 1\nR1 a 0 1k\nC1 a 0 1\u00c2\u00b5\n.op": ("W110", "write `1u`"),
    "V1 a 0 1\nR1 a 0 1Farad\n.op": ("W110", "`arad`"),
}


@pytest.mark.parametrize("cards", TOLD)
def test_what_is_not_read_is_told_with_what_to_write(cards):
    code, words = TOLD[cards]
    try:
        found = emsim.run(f"deck\n{cards}\n.end\n").diagnostics
        assert code[0] == "W"
    except (emsim.DeckError, emsim.OutsideError) as error:
        found = error.diagnostics
    assert any(d.code == code and words in f"{d.message} {d.hint}" for d in found), found

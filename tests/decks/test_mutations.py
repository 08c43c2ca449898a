"""Mutated decks: whatever a slip of the keyboard makes of a deck, it is checked, or refused with diagnostics.

Seeded, so the same decks every time. Anything but DeckError and OutsideError is a fault of the program.
"""

from __future__ import annotations

import random

import pytest
from support import NETLISTS

import emsim
from emsim.diagnostics import render_text

DECKS = [p.read_text() for p in sorted(NETLISTS.glob("*/*.cir"))]
TOKENS = [
    *"(){}=,*+-^?:\"';.\t", "\0", "é", "1e999", "nan", "v(", "i(", "pos(", "0", "-1", ".end", ".subckt a b", ".ends",
    "PULSE(", "BODY x m=1", "JOINT", "1k", "10meg", "PIN", ".if", ".param a=", "V=", "poly(2)", "table", "ic=", "uic",
]  # fmt: skip


def mutated(r: random.Random) -> str:
    lines = r.choice(DECKS).split("\n")
    for _ in range(r.randint(1, 3)):
        k = r.randrange(len(lines))
        line, words = lines[k], lines[k].split()
        match r.randint(0, 7):
            case 0 if line:
                i = r.randrange(len(line))
                lines[k] = line[:i] + line[i + 1 :]
            case 1:
                i = r.randint(0, len(line))
                lines[k] = line[:i] + r.choice(TOKENS) + line[i:]
            case 2:
                lines[k] = " ".join(w for w in words if r.random() > 0.2)
            case 3:
                lines.insert(k, r.choice(r.choice(DECKS).split("\n")))
            case 4 if len(lines) > 1:
                del lines[k]
            case 5:
                r.shuffle(words)
                lines[k] = " ".join(words)
            case 6:
                lines[k] = line.replace("=", " ", 1)
            case 7 if words:
                words[r.randrange(len(words))] = r.choice(TOKENS)
                lines[k] = " ".join(words)
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("seed", range(20))
def test_mutations_are_understood_or_refused(seed, scratch):
    r = random.Random(seed)
    for _ in range(60):
        text = mutated(r)
        try:
            emsim.check(text)
        except (emsim.DeckError, emsim.OutsideError) as error:
            assert error.diagnostics and len(render_text(error.diagnostics)) > 10
        except Exception as error:
            pytest.fail(f"{error!r} on\n{text}")

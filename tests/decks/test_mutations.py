"""Mutated decks: whatever a slip of the keyboard makes of a deck, it is checked, or refused with diagnostics.

Seeded, so the same decks every time. Anything but DeckError and OutsideError is a fault of the program.
"""

from __future__ import annotations

import random
import re
import time

import pytest
from support import NETLISTS, daily

import emsim
from emsim import pipeline
from emsim.diagnostics import DiagnosticError, render_text
from emsim.editor.layout import formatted, meaning
from emsim.reports import explained

DECKS = [p.read_text() for p in sorted(NETLISTS.glob("*/*.cir"))]
TOKENS = [
    *"(){}=,*+-^?:\"';.\t", "\0", "é", "1e999", "nan", "v(", "i(", "pos(", "0", "-1", ".end", ".subckt a b", ".ends",
    "PULSE(", "BODY x m=1", "JOINT", "1k", "10meg", "PIN", ".if", ".param a=", "V=", "poly(2)", "table", "ic=", "uic",
    # values that are none, and what is known only while a run goes on
    "{0/0}", "{time}", "{v(a)}", "{1/x}", "{ln(0)}", "{sqrt(-1)}", "inf", "1e-308", "1e308", "W1", "reltol=1e-6", "brake",
    "universal", "ball", "guess=", "zero=", "cut=yes", "EXP(0 1 1u -1u 2u)", "SIN(0 1 0)", "PWL(0 0 0 1)", "m=0", "j=0", "k=0",
    "tc=1,2", "ako:", "npn", "(1,0,0)", "shape=rod(0)", "shape=rod(-1)", "if(", "ddt(", "idt(", "\n+ ", "\n* x\n", "$", "\\",
]  # fmt: skip
NUMBERS = ["0", "1", "-1", "1e-300", "1e300", "1k", "1u", "-5", "{0}", "{-1}", "3e-9", "nan", "1g", "1t"]
METHODS = ["trap", "gear", "radau", "trbdf2", "esdirk", "gauss", "rk45", "dop853", "multirate"]
NUMBER = re.compile(r"(?<![\w.])-?\d[\d.]*(?:e-?\d+)?[a-z]*")


def mutated(r: random.Random) -> str:
    lines = r.choice(DECKS).split("\n")
    for _ in range(r.randint(1, 3)):
        k = r.randrange(len(lines))
        line, words = lines[k], lines[k].split()
        match r.randint(0, 12):
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
            case 8 if found := list(NUMBER.finditer(line)):
                number = r.choice(found)
                lines[k] = line[: number.start()] + r.choice(NUMBERS) + line[number.end() :]
            case 9:
                lines.insert(k, card(r))
            case 10:
                lines[k] = f"{line} {r.choice(TOKENS)}"
            case 11:
                j = r.randrange(len(lines))
                lines[k], lines[j] = lines[j], lines[k]
            case 12 if words:
                words[r.randrange(len(words))] = r.choice(r.choice(DECKS).split())
                lines[k] = " ".join(words)
    return "\n".join(lines) + "\n"


def card(r: random.Random) -> str:
    """A dot card that changes how all others are taken."""
    option = r.choice("reltol abstol gmin maxord itl1 itl4 trtol fixed_step".split())
    return r.choice(
        [
            ".options formulation=absolute",
            f".options method={r.choice(METHODS)}",
            f".options {option}={r.choice(NUMBERS)}",
            ".op",
            f".temp {r.choice(NUMBERS)}",
            ".tran 1u 10u",
            f".gravity {r.choice(NUMBERS)}",
            f".ic v(a)={r.choice(NUMBERS)}",
        ]
    )


def checked(text: str) -> None:
    emsim.check(text)


def run(text: str) -> None:
    """For a tenth of a second."""
    end = time.process_time() + 0.1
    emsim.run(text, progress=lambda *_: time.process_time() > end)


def told(text: str) -> None:
    explained.sheets(pipeline.explain(text))


def laid_out(text: str) -> None:
    assert meaning(formatted(text)) == meaning(text)


@pytest.mark.parametrize("seed", daily(range(20), 3))
def test_mutations_are_understood_or_refused(seed, scratch):
    r = random.Random(seed)
    for _ in range(60):
        text = mutated(r)
        # every deck is checked, every fourth also run, explained or laid out
        for act in (checked, r.choice([run, told, laid_out])) if r.random() < 0.25 else (checked,):
            try:
                act(text)
            except DiagnosticError as error:
                assert error.diagnostics and len(render_text(error.diagnostics)) > 10
            except Exception as error:
                pytest.fail(f"{act.__name__}: {error!r} on\n{text}")

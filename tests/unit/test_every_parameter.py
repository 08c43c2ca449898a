"""Every parameter that a card lists changes something in the equations: nothing is accepted and ignored.

Two decks that differ in one parameter are compiled, and Q, F, C, G and the starting point compared at seeded points. What is
taken and has no effect stands in NOT_IN_THE_EQUATIONS with its reason, or this fails; so does a new parameter without a deck.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from support import daily

import emsim
from emsim.cards import CARDS
from emsim.cards.magic import KEYS, SCALES
from emsim.cards.motors import MODELS
from emsim.elements import LETTERS
from emsim.elements.compiled import Compiled
from emsim.elements.modules import names, shipped

NOT_IN_THE_EQUATIONS = {
    "R noisy", "R noise", "R model kf", "R model af", "R model wf", "R model lf", "R model ef",  # .noise reads them
    "D model kf", "D model af", "DAMPER noisy", "BEAM noisy", "MODE noisy",
    "BODY look",  # changes the picture alone: tests/unit/outputs/test_looks.py
    "R ac",  # of small signals: tests/ngspice/test_operating_values.py
    "V distof1", "V distof2", "I distof1", "I distof2",  # .disto reads them
    "R bv_max", "C bv_max", "L bv_max", "R model bv_max", "C model bv_max",  # limits that ngspice only warns of
    *(f"{letter} {word}" for letter in "RCL" for word in ("pwr", "v", "irms", "ipk")),  # LTspice's ratings, for people
    "R tol", "C tol", "L tol",  # drawn by emsim sweep: tests/sweeps
    "C model defl",  # without l= on the line ngspice has no capacitance of a model either
    "L nt", "L model csect", "L model dia", "L model length", "L model nt", "L model mu",  # the inductance is given beside them
    # what ticks do: tests/cards/test_clocked.py
    *(f"CLOCK {word}" for word in "freq period offset of every skip delay".split()),
    *(f"PWM {word}" for word in "clock duty align dead level".split()), "BLOCK clock",
    *(f"FMU {word}" for word in "step kind log".split()),  # tests/fmus/test_units_coupled.py
    "CONTACT mus",  # asked where modes are decided: tests/physics/test_rubbing.py
    *(f"LATCH {word}" for word in "catch release force torque".split()),  # the same: tests/physics/test_latches.py
    "MOTOR tstall",  # compared with what the others say
    "D off",  # where Newton's method begins
    "D ic",  # without uic; with it the deck is refused
    # what ngspice's convolution is told
    *(f"O model {w}" for w in "rel abs nocontrol steplimit nosteplimit lininterp quadinterp mixedinterp truncnr".split()),
    "O model truncdontcut", "O model compactrel", "O model compactabs",
    "V portnum",  # a number; that it is given makes z0= count
    "S off", "W off",  # what holds without a word too
    *(f"{letter} off" for letter in "QJMZN"),  # where Newton's method begins
    *(f"{letter} ic" for letter in "QJMZN"),  # without uic; with it the deck is refused
    "M nrd", "M nrs",  # beside rsh: below, as parameters of the module
    "N temp", "N dtemp", "Z temp", "Z dtemp",  # nothing in those modules reads the temperature (Z: as in ngspice)
}  # fmt: skip

# tested below
ELSEWHERE = {
    "D model level", "T z0", "T zo", "T td", "T f", "T nl", "T ic",  # of lines: tests/ngspice/test_lines.py
    "V pwr", "V freq", "V phase",  # refused in a transient: below
    "U model isperl", "U model rsperl",  # refused, and nothing without it
    # tests/ngspice/test_lossy_lines.py
    "O model l", "Y len", "Y length", "P len", "P length", "P dimension",
    *(f"{letter} model {word}" for letter in "YP" for word in ("r", "l", "g", "c", "len", "length")),
}  # fmt: skip

# decks with @ in place of a parameter with its value, and the two values where 1.3 and 2.1 do not fit
DRIVEN = "V1 a 0 SIN(1 1 1k)\nR2 a b 1k\n"
RLC = {"R": DRIVEN + "R1 b 0 1k {}\n", "C": DRIVEN + "C1 b 0 1u {}\n", "L": DRIVEN + "L1 b 0 1m {}\n"}
OF_MODEL = {
    "R": DRIVEN + "R1 b 0 m l=100u w=50u\n.model m r(rsh=100 tnom=25 tc1=1m @)\n",
    "C": DRIVEN + "C1 b 0 m l=100u w=50u\n.model m c(cj=1m cjsw=1n tnom=25 tc1=1m @)\n",
    "L": DRIVEN + "L1 b 0 m\n.model m l(ind=1m tnom=25 tc1=1m @)\n",
    "S": DRIVEN + "S1 b 0 a 0 m\n.model m sw(vt=1 vh=0.1 ron=2 roff=1meg @)\n",
    "W": DRIVEN + "W1 b 0 V1 m\n.model m csw(it=1 ih=0.1 ron=2 roff=1meg @)\n",
    "U": DRIVEN + "U1 b 0 0 m l=1\n.model m urc(k=2 fmax=1meg rperl=1k cperl=1n @)\n",
    "O": DRIVEN + "O1 b 0 c 0 m\nR3 c 0 1k\n.model m ltra(r=1k g=1m c=1n len=1 @)\n",
    "K": DRIVEN
    + "L1 b 0 100\nK1 L1 1 m\n.model m core(law=ja ms=1meg a=20 k=40 c=0.1 alpha=1u area=2 path=3 gap=0.01 pack=0.9 @)\n",
    "D": "V1 a 0 SIN(0 3 1k)\nR1 a b 10\nD1 b 0 m\n.model m d(is=1e-12 n=1.1 rs=1 cjo=10p vj=0.8 m=0.4 jsw=1e-13 cjp=5p php=0.9 "
    "mjsw=0.3 tt=5n bv=5 ibv=1m ikf=10m ikr=20m nbv=1.2 pj=2 tnom=25 @)\n",
}
BIASED = "V1 a 0 SIN(0 3 1k)\nV2 c 0 5\nR1 a b 10\n"
OF_MODEL |= {
    "Q": BIASED + "Q1 c b 0 m\n.model m npn(is=1e-14 cje=1p cjc=1p cjs=1p rb=100 @)\n",
    "J": BIASED + "J1 c b 0 m\n.model m njf(vto=-2 beta=1m cgs=1p @)\n",
    "Z": BIASED + "Z1 c b 0 m\n.model m nmf(vto=-2 beta=1m cgs=1p @)\n",
    "M": BIASED
    + "R3 s 0 10\nM1 c b s 0 m\n.model m nmos(vto=1 kp=1m tox=20n js=1 cj=1m cjsw=1n ad=1p as=1p pd=1u ps=1u @)\n",
    "N": BIASED + "N1 c b 0 m\n.model m mesfet(vto=-2 beta=1m cgs=1p @)\n",
}
SOURCE = DRIVEN + "R3 c 0 1k\n"
CONTROLLED = {
    "E": "E1 c 0 value={v(b)*2} ",
    "G": "G1 c 0 value={v(b)*2} ",
    "B": "B1 c 0 i={v(b)*2} ",
    "F": "F1 c 0 V1 2 ",
}
GEOMETRY = "V1 a 0 SIN(0 3 1k)\nR1 a b 10\nD1 b 0 m {}\n.model m d(level=3 is=1e-6 cj=1m jsw=1n {})\n"
SIZES_3 = {key: f"{key}=20u" for key in "l w lm wm lp wp".split()}
DECKS = {
    "D thermal": DRIVEN + "D1 b 0 m @\n.model m d(rth0=20)\n", "M thermal": DRIVEN + "M1 b a 0 m @\n.model m vdmos(rthjc=2)\n",
    **{f"D {key}": GEOMETRY.format(" ".join(v for k, v in SIZES_3.items() if k != key) + " @", "") for key in SIZES_3},
    **{
        f"D model {key}": GEOMETRY.format(" ".join(SIZES_3.values()), "@") for key in ("xom", "xoi", "xm", "xp")
    },
    "R l": DRIVEN + "R1 b 0 m w=50u @\n.model m r(rsh=100)\n", "R w": DRIVEN + "R1 b 0 m l=50u @\n.model m r(rsh=100)\n",
    "C l": DRIVEN + "C1 b 0 m w=50u @\n.model m c(cj=1m)\n", "C w": DRIVEN + "C1 b 0 m l=50u @\n.model m c(cj=1m)\n",
    "R model l": DRIVEN + "R1 b 0 m\n.model m r(rsh=100 @)\n", "R model w": DRIVEN + "R1 b 0 m\n.model m r(rsh=100 @)\n",
    "R model defw": DRIVEN + "R1 b 0 m l=50u\n.model m r(rsh=100 @)\n",
    "C model defw": DRIVEN + "C1 b 0 m l=50u\n.model m c(cj=1m @)\n",
    "R model r": DRIVEN + "R1 b 0 m\n.model m r(@)\n", "R model res": DRIVEN + "R1 b 0 m\n.model m r(@)\n",
    "R model resistance": DRIVEN + "R1 b 0 m\n.model m r(@)\n",
    "C model c": DRIVEN + "C1 b 0 m\n.model m c(@)\n", "C model cap": DRIVEN + "C1 b 0 m\n.model m c(@)\n",
    "L model l": DRIVEN + "L1 b 0 m\n.model m l(@)\n",
    "R model tc1r": DRIVEN + "R1 b 0 m\n.model m r(r=1k @)\n", "R model tc2r": DRIVEN + "R1 b 0 m\n.model m r(r=1k @)\n",
    "C model thick": DRIVEN + "C1 b 0 m l=100u w=50u\n.model m c(@)\n",
    "C model di": DRIVEN + "C1 b 0 m l=100u w=50u\n.model m c(thick=1u @)\n",
    "U l": DRIVEN + "U1 b 0 0 m @\n.model m urc(rperl=1k cperl=1n)\n",
    "U n": DRIVEN + "U1 b 0 0 m l=1 @\n.model m urc(rperl=1k cperl=1n)\n",
    "V z0": "V1 a 0 1 portnum=1 @\nR1 a 0 1k\n", "V portnum": "V1 a 0 1 z0=50 @\nR1 a 0 1k\n",
    "K b0": DRIVEN + "L1 b 0 100\nK1 L1 1 m @\n.model m core\n",
    "K model law": DRIVEN + "L1 b 0 100\nK1 L1 1 m\n.model m core(a=20 @)\n",
    "K model cells": DRIVEN + "L1 b 0 100\nK1 L1 1 m\n.model m core(law=play a=20 k=40 c=0.1 @)\n",
    "K k": DRIVEN + "L1 b 0 1m\nL2 c 0 1m\nR3 c 0 1\nK1 L1 L2 @\n",
    "S model von": DRIVEN + "S1 b 0 a 0 m\n.model m vswitch(voff=0.1 @)\n",
    "S model voff": DRIVEN + "S1 b 0 a 0 m\n.model m vswitch(von=6 @)\n",
    "W model ioff": DRIVEN + "W1 b 0 V1 m\n.model m iswitch(ion=6 @)\n",
    "W model ion": DRIVEN + "W1 b 0 V1 m\n.model m iswitch(ioff=0.1 @)\n",
}  # fmt: skip
# what else stands on the line or in the model, so that the parameter counts
BESIDE = {
    "temp": "tc1=1m", "dtemp": "tc1=1m", "reciproctc": "tc1=1m", "reciprocm": "m=2",
    **{f"{letter} {word}": "" for letter in "DQJMZN" for word in ("temp", "dtemp")},
    **dict.fromkeys(("D model nr",), "isr=1e-9"), **dict.fromkeys(("D model ntun", "D model xtitun", "D model keg"), "jtun=1e-9"),
    **dict.fromkeys(("D model ilimit", "D model epsilon", "D model roff"), "ron=0.1"),
    **dict.fromkeys(("D model vfwd", "D model vrev", "D model ron"), "roff=1k"),
    **dict.fromkeys(("D model rrev", "D model revilimit", "D model revepsilon"), "ron=0.1 vrev=0.5"),
    "D model tlev": "tcv=1m", "D model tlevc": "tpb=1m cta=1m",
    **dict.fromkeys(("D model tpb", "D model tphp", "D model cta", "D model ctp"), "tlevc=1"),
}  # fmt: skip
VALUES = {
    "K model law": "ja play", "K model shape": "froehlich langevin", "K model cells": "4 6", "K model ms": "1meg 2meg",
    "K model a": "10 20", "K model k": "20 40", "K model c": "0.1 0.3", "K model alpha": "1u 10u", "K model gap": "0.01 0.02",
    "K model pack": "0.7 0.9", "K b0": "0.1 0.2",
    "U n": "3 5", "U model k": "1.3 2.1", "U model fmax": "10meg 1g",
    "temp": "60 90", "m": "2 3",
    "reciproctc": "0 1", "reciprocm": "0 1", "tnom": "20 35", "k": "0.5 0.7", "von": "1 5", "ion": "1 5",
    "voff": "0.1 5", "ioff": "0.1 5", "vt": "0.3 2", "it": "0.3 2", "vh": "0.1 0.9", "ih": "0.1 0.9", "D model m": "0.3 0.6",
    "D model fc": "0.4 0.6", "D model fcs": "0.4 0.6", "D model mjsw": "0.3 0.6", "D model bv": "4 6", "D model xti": "2 4",
    "D model eg": "1 1.2", "D model vfwd": "0.2 0.4",
    "D model tlev": "0 1", "D model tlevc": "0 1", "cj": "1m 2m", "cjsw": "1n 2n",
    **dict.fromkeys("xom xoi".split(), "1k 2k"),
    **dict.fromkeys("l w lm wm lp wp xm xp narrow short dw dlr defw thick".split(), "10u 20u"),
    **dict.fromkeys([f"D model {w}" for w in "tm1 tm2 tcv tpb tphp cta ctp trs1 trs2 ttt1 ttt2".split()], "1m 2m"),
}  # fmt: skip


def fingerprint(cards: str, tran: str) -> list[np.ndarray]:
    """The equations at seeded points, and their start."""
    system = emsim.compile(f"deck\n.options temp=47\n{cards}{tran}.end\n")
    rng, is_node = np.random.default_rng(3), np.array([kind == "node" for kind in system.kinds])
    names = np.frombuffer(" ".join(system.names).encode(), dtype=np.uint8).astype(float)
    out = [names, np.asarray(system.x0, dtype=float)]
    for k in range(40):
        t, x = 0.05e-3 * (k % 8), rng.uniform(-1.0, 1.0, system.n) * (0.05, 0.8, 3.0, 8.0)[k % 4]
        if "D1 " in cards:  # forward voltages that do not overflow
            x = np.where(is_node, np.minimum(x, 0.9), x)
        out += [
            np.asarray(system.Q(x, t)),
            np.asarray(system.F(x, t)),
            system.C(x, t).toarray(),
            system.G(x, t).toarray(),
        ]
    return out


def differ(cards: str, one: str, other: str, tran: str = ".tran 1u 1m\n") -> bool:
    a, b = (fingerprint(cards.replace("@", x), tran) for x in (one, other))
    return any(
        x.shape != y.shape or not np.allclose(x, y, rtol=1e-9, atol=0.0, equal_nan=True)
        for x, y in zip(a, b, strict=True)
    )


def deck_of(name: str) -> str:
    """The deck in which an element's parameter counts, with @ in its place."""
    letter, *_, word = name.split()
    if name in DECKS:
        return DECKS[name]
    beside = BESIDE.get(name, BESIDE.get(word, ""))
    if " model " in name:
        # without the parameter's own value among the others
        return re.sub(rf"(?<=[ (]){word}=\S+ ", "", OF_MODEL[letter]).replace("@", f"{beside} @")
    if letter in RLC:
        return RLC[letter].format(f"{beside} @")
    if letter in CONTROLLED:
        return f"{SOURCE}{CONTROLLED[letter]}{beside} @\n"
    if letter in "VI":
        return f"{letter}1 a 0 1 @\nR1 a 0 1k\n"
    return OF_MODEL[letter].replace("@", "").replace(" m\n", f" m {beside} @\n").replace("1meg )", "1meg)")


def element_words() -> list[str]:
    out = []
    for letter, kind in ((letter.upper(), kind) for letter, kind in LETTERS.items() if letter != "x"):
        words = [name for names, *_ in kind.model_table() for name in names[:1]]
        if issubclass(kind, Compiled):
            words = []  # those of modules: test_a_parameter_of_a_module_is_not_ignored
        out += [f"{letter} {word}" for word in kind.instance]
        out += [f"{letter} model {word}" for word in dict.fromkeys([*words, *kind.model_words])]
    return [name for name in out if name not in ELSEWHERE]


@pytest.mark.parametrize("name", element_words())
def test_a_parameter_of_an_element_is_not_ignored(name):
    word = name.split()[-1]
    one, other = (f"{word}={x}" for x in VALUES.get(name, VALUES.get(word, "1.3 2.1")).split())
    if word in ("on", "off", "thermal"):
        one, other = word, ""
    uic = " uic" if word in ("on", "off") or (word == "ic" and name[0] not in "DQJMZN") else ""
    changed = differ(deck_of(name), one, other, f".tran 1u 1m{uic}\n")
    assert changed != (name in NOT_IN_THE_EQUATIONS), f"{name} has {'an' if changed else 'no'} effect"


# of modules: what the others are, so that a parameter counts (one set after the other), and values to try
RICH = {
    "bjt": {
        "is": 1e-14, "vaf": 50.0, "var": 20.0, "ikf": 1e-2, "ikr": 1e-2, "ise": 1e-13, "isc": 1e-13, "rb": 100.0, "rbm": 10.0,
        "irb": 1e-4, "re": 1.0, "rc": 10.0, "cje": 1e-12, "cjc": 1e-12, "cjs": 1e-12, "xcjc": 0.5, "tf": 1e-9, "xtf": 2.0,
        "vtf": 3.0, "itf": 1e-2, "tr": 1e-8, "iss": 1e-15, "mjs": 0.3, "kf": 1e-12, "ptf": 10.0, "rco": 20.0, "qco": 1e-12,
    },
    "jfet": {"beta": 1e-3, "cgs": 1e-12, "cgd": 1e-12, "rd": 1.0, "rs": 1.0, "lambda": 0.01, "kf": 1e-12},
    "jfet2": {
        "beta": 1e-3, "cgs": 1e-12, "cgd": 1e-12, "rd": 1.0, "rs": 1.0, "lambda": 0.01, "kf": 1e-12, "ibd": 1e-9, "vst": 0.1,
        "xi": 1.0, "lfgam": 0.05, "hfgam": 0.1, "taug": 1e-6, "delta": 0.1, "taud": 1e-6,
    },
    "mesfet": {"beta": 1e-3, "cgs": 1e-12, "cgd": 1e-12, "rd": 1.0, "rs": 1.0, "kf": 1e-12},
    "diode": {
        "is": 1e-14, "jsw": 1e-15, "ns": 1.2, "rs": 1.0, "cjo": 1e-12, "cjp": 1e-12, "tt": 1e-9, "bv": 3.0, "ikf": 1e-2,
        "ikr": 1e-3,
        "isr": 1e-10, "jtun": 1e-10, "jtunsw": 1e-10, "kf": 1e-12, "pj": 2.0, "lm": 1e-5, "wm": 1e-5, "lp": 1e-5, "wp": 1e-5,
        "xom": 1e3, "xoi": 1e3, "l": 1e-5, "w": 1e-5, "tcv": 1e-3,
    },
    "vbic": {
        "rcx": 10.0, "rci": 60.0, "vo": 2.0, "gamm": 2e-11, "hrcf": 2.0, "rbx": 10.0, "rbi": 40.0, "re": 1.0, "rs": 20.0,
        "rbp": 40.0, "is": 1e-16, "vef": 10.0, "ver": 4.0, "ikf": 2e-3, "ikr": 2e-4, "ikp": 2e-4, "cje": 1e-13, "cjc": 2e-14,
        "qco": 1e-12, "cjep": 1e-13, "cjcp": 4e-13, "wbe": 0.9, "iben": 5e-15, "ibcn": 5e-15, "avc1": 2.0, "avc2": 15.0,
        "vbbe": 5.0, "isp": 1e-15, "wsp": 0.9, "ibeip": 1e-17, "ibenp": 1e-15, "ibcip": 1e-17, "ibcnp": 1e-15, "tf": 1e-11,
        "qtf": 0.1, "xtf": 20.0, "vtf": 1.0, "itf": 0.08, "tr": 1e-10, "td": 2e-11, "kfn": 1e-12,
    },
    "lines_diode": {"ron": 0.1, "roff": 1e3, "vfwd": 0.3, "vrev": 2.0, "rrev": 0.5},
    "vdmos": {
        "kp": 1.0, "rd": 0.1, "rs": 0.1, "rg": 1.0, "rds": 1e6, "cgs": 1e-9, "cgdmax": 1e-9, "cgdmin": 1e-10, "cjo": 1e-9,
        "is": 1e-12, "bv": 30.0, "tt": 1e-8, "rb": 0.1, "theta": 0.1, "lambda": 0.01, "kf": 1e-12, "rq": 0.5, "vq": 5.0,
    },
}  # fmt: skip
MOS = {
    "tox": 2e-8,
    "js": 1e-3,
    "cj": 1e-4,
    "cjsw": 1e-10,
    "rsh": 10.0,
    "lambda": 0.02,
    "kf": 1e-26,
    "gamma": 0.4,
    "phi": 0.6,
}
# a card of each BSIM in which most laws count, from the figures beside ngspice
BSIM = json.loads((Path(__file__).parent.parent / "veriloga" / "bsim_points.json").read_text())
for of in ("bsim3", "bsim4"):
    words = BSIM[of].replace("@", "").replace("+", " ").split()
    RICH[of] = {key: float(value) for key, value in (word.split("=") for word in words)}
RICH["bsim3"] |= {
    "lw": 1e-16,
    "wl": 1e-16,
    "ww": 1e-16,
    "lwl": 1e-22,
    "wwl": 1e-22,
    "llc": 1e-16,
    "lwc": 1e-16,
    "lwlc": 1e-22,
    "wlc": 1e-16,
    "wwc": 1e-16,
    "wwlc": 1e-22,
    "pscbe1": 4e8,
}
RICH["bsim4"] |= {
    "ll": 1e-16, "wl": 1e-16, "lwl": 1e-22, "wwl": 1e-22, "llc": 1e-16, "lwc": 1e-16, "lwlc": 1e-22, "wlc": 1e-16, "wwc": 1e-16,
    "wwlc": 1e-22, "up": 0.1, "ku0": 1e-8, "lku0": 1e-8, "wku0": 1e-8, "llodku0": 1.0, "wlodku0": 1.0, "lkvth0": 1e-8,
    "wkvth0": 1e-8, "llodvth": 1.0, "wlodvth": 1.0, "kvth0we": 0.1, "k2we": 0.01, "ku0we": 0.01,
    "toxref": 2e-9, "kgidl": 0.1, "kgisl": 0.1, "vfbsdoff": 0.02,
}  # fmt: skip
SIZES = {"l": 2e-6, "w": 1e-5, "ad": 1e-11, "as": 1e-11, "pd": 1e-5, "ps": 1e-5, "nrd": 1.0, "nrs": 1.0}
SMALL = {"w": 1e-6, "ad": 2e-13, "as": 2.5e-13, "pd": 2.4e-6, "ps": 2.5e-6, "nrd": 0.2, "nrs": 0.3}
SIZES_OF = {
    "bsim3": SMALL | {"l": 1.8e-7},
    "bsim4": SMALL
    | {"l": 1e-7, "nf": 2.0, "sa": 1e-6, "sb": 1.2e-6, "sd": 2e-7, "sca": 2.0, "scb": 0.2, "scc": 0.01},
}
TRIED = (
    (1.3, 2.1),
    (0.3, 0.6),
    (1e-3, 2e-3),
    (1.0, 0.0),
    (1.0, 3.0),
    (2.0, 3.0),
    (1.0, -1.0),
    (1e-8, 3e-8),
    (1e16, 3e16),
    (20.0, 60.0),
    (3.1, 3.3),
    (4.5, 4.8),
    (1e-15, 3e-15),
    (1e-21, 3e-21),
)


# what else is given so that a parameter counts; None: without what stands in place of it
SWITCHES = (
    {},
    {"tlev": 1.0, "tlevc": 1.0},
    {"tlev": 3.0},
    {"nsub": 1e16, "vmax": 1e5},
    {"ibe": 1e-14, "ibc": 1e-14},
    {"nsub": 1e16, "nfs": 1e11, "xj": 1e-7, "ld": 1e-7},
    {"quasimod": 1.0},
    {"tlev": 2.0},
    {"level": 3.0},
    {"js": None},
    {"gamma": None, "phi": None},
    {"lambda": None, "lambda0": 0.02},
    {"lambda": None, "nsub": 1e16, "vmax": 1e5},
    {"uexp": 0.2, "nsub": 1e16},
)
SWITCHES_OF = {
    "bsim3": (
        {},
        {"noimod": 2.0},
        {"noimod": 1.0, "kf": 1e-25},
        {"capmod": 0.0},
        {"vth0": None, "k1": None, "k2": None},
    ),
    "bsim4": (
        {"igcmod": 1.0, "igbmod": 1.0, "rdsmod": 1.0, "rgatemod": 1.0, "rbodymod": 1.0, "gidlmod": 1.0, "wpemod": 1.0,
         "dvtp2": 0.1, "dvtp3": 0.1, "dvtp4": 0.1, "vtl": 2e5, "xn": 3.0, "web": 0.1, "wec": 0.1},
        # drawn diffusions, and the bulk by its five resistances
        {"rbodymod": 2.0, "rgeomod": 1.0, "geomod": 4.0, "igcmod": 1.0, "mobmod": 2.0, "cvchargemod": 1.0,
         "fnoimod": 0.0, "kf": 1e-25,
         **dict.fromkeys("toxp aigsd bigsd cigsd nrd nrs ad as pd ps".split()),
         **dict.fromkeys("rbps0 rbpd0 rbpbx0 rbpby0 rbsbx0 rbsby0 rbdbx0 rbdby0".split(), 50.0)},
        {"vth0": None, "k1": None, "k2": None, "capmod": 0.0, "diomod": 2.0},
        {"tnoimod": 1.0, "version": 4.5},
        {"mtrlmod": 1.0, "toxp": None, "toxe": None, "tnoimod": 2.0, "diomod": 0.0},
        {"mobmod": 3.0, "ud": 1e14, "tempmod": 2.0, "at": 1e-4, "ua1": 1e-3, "ub1": -1e-3, "uc1": 1e-3,
         "prt": 1e-3, "wpemod": 1.0, "sc": 1e-6, "gidlmod": 1.0, "gidlclamp": -20.0,
         **dict.fromkeys("sca scb scc".split())},
    ),
}  # fmt: skip
BIASES = (
    {"c": 2.0, "ci": 1.9, "cx": 1.95, "b": 0.75, "bi": 0.7, "e": 0.02, "ei": 0.01, "s": -1.0, "d": 3.0, "di": 2.9, "g": 2.5,
     "gi": 2.4, "si": 0.05, "a": 0.7, "ai": 0.65, "slow_s": 2.3, "slow_d": -0.6, "heat": 0.01, "j": 0.66,
     "tj": 10.0, "tc": 3.0, "bx": 0.73, "bp": 0.3, "lag": 0.01, "delayed": 0.02},
    {"c": 0.1, "ci": 0.12, "b": 0.8, "bi": 0.78, "s": 0.3, "d": -0.7, "di": -0.65, "g": -0.4, "gi": -0.35, "a": -7.0,
     "ai": -6.9, "an": -0.5, "j": -6.8},
    {"d": 40.0, "di": 39.0, "g": 1.0, "gi": 0.9, "b": -1.0, "bi": -1.1, "c": -0.6, "ci": -0.5, "a": -4.0, "ai": -3.9,
     "j": 0.9},
    {"d": 0.6, "di": 0.5, "g": -2.5, "gi": -2.5, "b": -12.0, "bi": -12.0},
)  # fmt: skip
KNOWN: dict[str, set[str]] = {}  # unknowns of a module, as it was asked last


def numbers(module, given: dict[str, float], inst: dict[str, float], at: dict[str, float]) -> str | None:
    """Everything that an instance computes at these voltages; None where the values are refused."""
    known = KNOWN.get(module.name, set())
    while True:
        voltages = {name: v for name, v in at.items() if name in known}
        try:
            found = module.texts.evaluate(
                module.name, given, temp=60.0, voltages=voltages, gmin=1e-12, instance=inst
            )
        except ValueError:
            return None
        except KeyError:  # one of them is none in these values
            known = set()
            continue
        names = {name for name, _ in found["unknowns"]}
        if names == known:
            return repr([found[key] for key in ("unknowns", "flows", "noise", "outputs", "merged")])
        known = KNOWN[module.name] = names


def binned(name: str) -> list[str]:
    """The lines of a BSIM that make a parameter and its three by the sizes, each in one."""
    path = Path(emsim.__file__).parent / "devices" / f"{name}_binned.vams"
    return re.findall(r"^`BINNED(?:_AS)?\(([^\n]*)", path.read_text(), re.M)


@pytest.mark.parametrize("name", ["bsim3", "bsim4"])
def test_a_parameter_by_sizes_bears_the_name_of_its_own(name):
    """So what a number hangs on hangs on all four."""
    lines = binned(name)
    assert len(lines) > 50
    for line in lines:
        word, *by_size = line.split(", ")[:4]
        assert by_size == [letter + word for letter in "lwp"]


def module_words() -> list[str]:
    by_size = {
        f"bsim{k} {word}" for k in "34" for line in binned(f"bsim{k}") for word in line.split(", ")[1:4]
    }
    words = [f"{name} {p['names'][0]}" for name in names() for p in shipped(name).about["parameters"]]
    return [name for name in words if name not in by_size or name.endswith(" lvth0")]


def tried(name: str) -> Iterator[tuple[dict[str, float | None], tuple[float, float]]]:
    """What else is given, and two values. What is likely to count comes first: near the card's own, with every switch."""
    module, word = shipped(name.split()[0]), name.split()[1]
    rich = RICH.get(module.name.removeprefix("thermal_"), MOS)
    sizes = SIZES_OF.get(module.name, SIZES if module.name.startswith("mos") else {})
    cards = [
        {k: v for k, v in {**rich, **sizes, **switch}.items() if k in module.parameters}
        for switch in SWITCHES_OF.get(module.name, SWITCHES)
    ]
    if name in IDLE_IN_MODULES:  # as a switch, as a number: what it may come to mean is seen by one of them
        pairs = [(1.0, 0.0), (1.3, 2.1)]
    else:
        near = ((card, card.get(word)) for card in cards)
        yield from ((card, (1.1 * x, 1.3 * x)) for card, x in near if x)
        pairs = list(TRIED)
    yield from ((card, pair) for pair in pairs for card in cards)


@pytest.mark.parametrize("name", daily(module_words(), 3))
def test_a_parameter_of_a_module_is_not_ignored(name):
    module, word = shipped(name.split()[0]), name.split()[1]
    is_instance = module.parameters[word.lower()]["instance"]
    for card, pair in tried(name):
        values = {k: v for k, v in card.items() if v is not None and k != word}
        inst = {k: v for k, v in values.items() if module.parameters[k]["instance"]}
        given = {k: v for k, v in values.items() if k not in inst}
        for at in BIASES:
            found = [
                numbers(
                    module,
                    given | ({} if is_instance else {word: v}),
                    inst | ({word: v} if is_instance else {}),
                    at,
                )
                for v in pair
            ]
            if None not in found and found[0] != found[1]:
                assert name not in IDLE_IN_MODULES, f"{name} has an effect"
                return
    assert name in IDLE_IN_MODULES, f"{name} has no effect"


# parameters of modules that no number hangs on
IDLE_IN_MODULES = {
    "jfet gdsnoi",  # with nlev=3 alone
    "jfet2 ver",  # as in ngspice
    "mesfet fc",  # as in ngspice
    "bsim3 paramchk", "bsim4 paramchk",  # checks alone, as in ngspice
    "bsim3 nqsmod", "bsim3 acnqsmod", "bsim3 acm", "bsim4 trnqsmod", "bsim4 acnqsmod",  # another value than 0 is refused
    "bsim3 elm",  # with nqsmod alone
    "bsim3 geo",  # with acm alone
    "bsim4 tnoic", "bsim4 rnoic",  # of correlated noise: refused or told in the guide
    "mos2 utra", "mos6 nvth",  # as in ngspice
    "vdmos phi", "thermal_vdmos phi",  # taken, since cards have it
}  # fmt: skip


REFUSED = {
    "L1 b 0 m nt=3\n.model m l(ind=1m)": "E281",  # turns of a coil of known size
    "D1 b 0 m ic=0.3\n.model m d": "E297",
    "D1 b 0 m thermal\n.model m d": "E299",
    "M1 b b 0 0 m thermal\n.model m nmos": "E307",
    "V2 b 0 1 m=2": "E307",
    **dict.fromkeys((f"V2 b 0 1 portnum=1 {word}=1" for word in ("pwr", "freq", "phase")), "E113"),
    "E1 b 0 a 0 2 m=2": "E307",
    "H1 b 0 V1 2 m=2": "E307",
    "E1 b 0 table {v(a)} = (0,0) (1,1) tc1=1m": "E102",
}


@pytest.mark.parametrize("line", REFUSED)
def test_what_would_have_no_effect_is_refused(line):
    with pytest.raises(emsim.DeckError) as error:
        emsim.compile(f"deck\n{DRIVEN}{line}\n.tran 1u 1m uic\n.end\n")
    assert {d.code for d in error.value.diagnostics if d.severity == "error"} == {REFUSED[line]}


ARM = ".gravity 9.81\nBODY arm m=1 shape=rod(1)\nJOINT h 0 arm pin ic=30deg\n"
DISC = "BODY b m=1 shape=disc(0.2)\n"
ROTOR = "BODY rotor m=1 j=0.01\nJOINT h 0 rotor pin ic=(0.3,2)\n"
SLED = "BODY sled m=1 j=0.1\nJOINT h 0 sled slide axis=(1,0) ic=(0.3,2)\n"
FREE = "BODY b m=1 j=0.1 @\nSPRING s b 0 k=3\n"
TUMBLES = "BODY b m=1 j=(1,2,3) @\nSPRING s b(0.1,0.2,0.3) 0 k=3\n"
TYRE = "BODY b m=1 j=1 vx=3 vy=1\nBODY w m=0 j=1\nJOINT s 0 w pin ic=(0,2)\nTYRE e b 0 s r=0.3 fz=9 "
PAC = "fnomin=8 r0=0.3 " + " ".join(f"{key}=0.6" for key in KEYS[2:] if key not in SCALES)
COIN = ".gravity 0 0 -9.81\nBODY coin m=1 j=(2.5m,2.5m,5m) z=0.0932 rot=(1.2,0,0)\n"
SPATIAL = "BODY a m=1 j=(1,2,3)\n"
BAR = "BODY a m=1 shape=rod(1)\nBODY b m=1 shape=rod(1.5)\nBODY c m=1 shape=rod(1)\nJOINT p1 0 a pin guess=60deg\n"
LOOP = (
    BAR
    + "JOINT p2 a(1,0) b pin {}\nJOINT p3 0(1.5,0) c pin {}\nJOINT p4 b(1.5,0) c(1,0) pin {}\n.gravity 9.81\n"
)
CLOSED = LOOP.format("guess=-60deg", "guess=60deg", "")
WHEEL = ROTOR + "BODY w m=1 j=1\nJOINT g 0 w "
BELT = ("r1=0.1", "r2=0.2", "k=100")
WARM, IRON, OIL = "HEAT a x c=1\n", "MAGNETIC a x 0 ", "HYDRAULIC a x vol=1 bulk=3\n"
WAY = ("len=1", "area=1m", "mur=20")
PULLEYS = WHEEL + "pin\nBELT e h g @"
CAM = WHEEL + "slide axis=(1,0) ic=-0.01\nCAM e g h lift={0.01*sin(angle(h))} @"
RAILS = "BODY a m=1 j=1\nBODY b m=1 j=1\nJOINT h 0 a slide axis=(1,0)\nJOINT g 0 b slide axis=(0,1)\n"
MOTOR = ROTOR + "V1 a 0 5\nMOTOR m1 a 0 h @"
SHEET = ("vnom=9", "n0=1", "i0=0.1", "istall=5")
POT = ROTOR + "V1 a 0 5\nR1 w 0 1k\nPOT p a w 0 h @"
COIL = SLED + "V1 a 0 5\nR1 a b 1\nTRANSDUCER t b 0 h @\n"
# card: parameter: deck, and what stands for its @ once and the other time
MACHINES = {
    "BODY": {
        "m": (ARM.replace("m=1", "@"), "m=1", "m=2"), "shape": (ARM.replace("rod(1)", "@"), "rod(1)", "rod(2)"),
        "j": (ARM.replace("shape=rod(1)", "com=(0.1,0) @"), "j=1", "j=2"),
        "com": (ARM.replace("shape=rod(1)", "j=1 @"), "com=(0.1,0)", "com=(0.2,0)"),
        "fixed": ("BODY b m=1 j=1\nBODY c m=1 j=1 @\nJOINT h c b pin\n", "fixed=yes", "fixed=no"),
        **{key: (FREE, f"{key}=0.3", f"{key}=0.5") for key in ("x", "y", "angle", "vx", "vy", "omega")},
        **{key: (TUMBLES, f"{key}=0.3", f"{key}=0.5") for key in ("z", "vz")},
        "rot": (TUMBLES, "rot=(0.3,0,0)", "rot=(0.5,0,0)"),
    },
    "POINT": {"at": (ARM + "POINT arm.t @ 0\nSPRING s arm.t 0(1,1) k=3\n", "0.3", "0.5")},
    "JOINT": {
        "axis": (SLED.replace("(1,0)", "@") + ".gravity 9.81\n", "(1,0)", "(1,1)"),
        "zero": (ARM.replace("ic=30deg", "@"), "zero=0.2", "zero=0.3"), "ic": (ROTOR.replace("0.3", "@"), "0.3", "0.4"),
        "guess": (LOOP.format("@", "", ""), "guess=-60deg", "guess=60deg"),
        "cut": (LOOP.format("guess=-60deg @ ", "guess=60deg", ""), "cut=yes", ""),
        "damp": (ROTOR.replace("pin", "pin @"), "damp=1", "damp=2"), "l": (RAILS + "JOINT r a b rod @\n", "l=1", "l=2"),
        "lead": (SPATIAL + ".gravity 0 0 -9\nJOINT h 0 a screw @\n", "lead=0.1", "lead=0.2"),
        "axis2": (SPATIAL + "JOINT h 0 a universal axis=(1,0,0) ic=(0.3,0.2) @\n", "axis2=(0,1,0)", "axis2=(0,0,1)"),
    },
    "MOTOR": {
        **{key: (MOTOR + " kt=1 r=1\n", f"{key}=1", f"{key}=2") for key in ("ke", "l", "j", "b", "tc", "gear")},
        **{
            key: (MOTOR + "".join(f" {other}" for other in SHEET if key not in other) + "\n", f"{key}={a}", f"{key}={b}")
            for key, a, b in (("vnom", 9, 12), ("n0", 1, 2), ("i0", 0.1, 0.2), ("istall", 5, 6))
        },
        **{
            key: (MOTOR + f" kt=1 r=1 heat=x {beside}\nHEAT a x c=1\n", f"{key}={a}", f"{key}={b}")
            for key, beside, a, b in (("tc1", "", 1, 2), ("tcm", "", 1, 2), ("tref", "tc1=1", 200, 300))
        },
        **{
            key: (MOTOR + f" kt=1 r=1 tcm=1 {rest}\nHEAT a x c=1\nHEAT b y c=1\n", f"{key}=x", f"{key}=y")
            for key, rest in (("heat", ""), ("magnets", "heat=x"))
        },
        "loss": (MOTOR + " vnom=9 n0=1 i0=0.1 istall=5\n", "loss=coulomb", "loss=viscous"),
        "kt": (MOTOR + " r=1\n", "kt=1", "kt=2"), "kv": (MOTOR + " r=1\n", "kv=100", "kv=200"),
        "r": (MOTOR + " kt=1\n", "r=1", "r=2"),
        "radius": (MOTOR.replace(ROTOR, SLED) + " kt=1 r=1\n", "radius=0.1", "radius=0.2"),
        "model": (MOTOR + " r=1\n.model x dcmotor(kt=1)\n.model y dcmotor(kt=2)\n", "model=x", "model=y"),
    },
    "POT": {
        "r": (POT + " range=(-1,1)\n", "r=1k", "r=2k"), "range": (POT + " r=1k\n", "range=(-1,1)", "range=(-2,1)"),
        "taper": (POT + " r=1k range=(-1,1)\n", "taper=lin", "taper=log"), "rw": (POT + " r=1k range=(-1,1)\n", "rw=10", "rw=20"),
    },
    "SPRING": {
        **{key: (ROTOR + "SPRING s h @ k=1\n", f"{key}=1", f"{key}=2") for key in ("q0", "f0")},
        "k": (ROTOR + "SPRING s h @\n", "k=1", "k=2"), "l0": (ARM + "SPRING s arm(1,0) 0(2,2) k=1 @\n", "l0=1", "l0=2"),
    },
    "DAMPER": {"c": (ROTOR + "DAMPER s h @\n", "c=1", "c=2"), "c2": (ROTOR + "DAMPER s h c=1 @\n", "c2=1", "c2=2")},
    "GEAR": {
        "ratio": (WHEEL + "pin\nGEAR e h g @\n", "ratio=2", "ratio=3"),
        "lead": (WHEEL + "slide axis=(1,0)\nGEAR e h g @\n", "lead=2", "lead=3"),
        "eta": (WHEEL + "pin\nGEAR e h g ratio=2 @\n", "eta=0.5", "eta=0.6"),
        "backlash": (WHEEL + "pin\nGEAR e h g ratio=2 k=1 @\n", "backlash=0.1", "backlash=0.2"),
        **{
            key: (WHEEL + f"pin\nGEAR e h g ratio=2 backlash=0.1 {'' if key == 'k' else 'k=1'} @\n", f"{key}={a}", f"{key}={b}")
            for key, a, b in (("k", 1, 2), ("c", 0.1, 0.2), ("e", 0.1, 0.2), ("n", 1, 2))
        },
    },
    "BELT": {
        **{
            key: (PULLEYS + " ".join(x for x in ("", *BELT) if key not in x) + "\n", f"{key}={a}", f"{key}={b}")
            for key, a, b in (("r1", 1, 2), ("r2", 1, 3), ("k", 10, 20), ("c", 1, 2), ("f0", 5, 9), ("cross", "yes", "no"))
        },
    },
    "BEAM": {
        **{
            key: (
                f"BEAM b {'' if key == 'l' else 'l=1 '}n=2 e=1k rho=1 section=rect(0.1,0.2) @\nJOINT h 0 b.a pin\n",
                f"{key}={a}",
                f"{key}={b}",
            )
            for key, a, b in (("l", 1, 2), ("d", 1, 2))
        },
        **{
            key: (f"BEAM b l=1 n=2 {rest} @\nJOINT h 0 b.a pin\n", f"{key}={a}", f"{key}={b}")
            for key, rest, a, b in (
                ("e", "rho=1 section=round(0.1)", 1, 2), ("rho", "e=1 section=round(0.1)", 1, 2),
                ("section", "e=1 rho=1", "round(1)", "tube(1,0.1)"),
                ("ei", "ea=1 rhoa=1", 1, 2), ("ea", "ei=1 rhoa=1", 1, 2), ("rhoa", "ei=1 ea=1", 1, 2),
            )
        },
        "n": ("BEAM b l=1 ei=1 ea=1 rhoa=1 @\n", "n=1", "n=2"),
        **{
            key: ("BEAM b l=1 n=1 ei=1 ea=1 rhoa=1 @\n", f"{key}=1", f"{key}=2")
            for key in ("x", "y", "angle", "vx", "vy", "omega")
        },
        "arc": ("BEAM b l=1 n=3 ei=1 ea=1 rhoa=1 @\n", "arc=1", "arc=2"),
        "g": ("BEAM b l=1 n=1 e=1 rho=1 section=round(0.1) omega=(1,2,3) @\n", "g=1", "g=2"),
        **{
            key: (f"BEAM b l=1 n=1 ei=1 ea=1 rhoa=1 {'gj=1' * (key != 'gj')} @ omega=(1,2,3)\n", f"{key}={a}", f"{key}={b}")
            for key, a, b in (("eiy", 1, 2), ("gj", 1, 2), ("z", 1, 2), ("vz", 1, 2), ("rot", "(1,0,0)", "(0,1,0)"))
        },
    },
    "MODE": {
        key: (
            "BODY a m=9 j=9 x=1\n" + " ".join(["MODE v a", *(w for w in ("f=1", "p=(0,1)", "h=0") if w[0] != key), "@\n"]),
            f"{key}={a}",
            f"{key}={b}",
        )
        for key, a, b in (
            ("f", 1, 2), ("m", 1, 2), ("zeta", 0, 1), ("p", "(0,1)", "(0,2)"), ("h", 0, 1), ("ic", "(0,1)", "(1,1)"),
        )
    },
    "FLANGE": {
        "shape": (
            "BODY a m=9 j=9\nMODE v a f=1 p=(0,1) h=0 ic=(0.1,0)\nFLANGE t a(1,0) v.q @\nBODY w m=1 j=1\nJOINT k t.at w weld\n",
            "shape=(0,1,0)",
            "shape=(0,2,0)",
        )
    },
    "ROPE": {
        **{
            key: (ARM + "ROPE t arm(1,0) 0(0,2) k=3 @\n", f"{key}={a}", f"{key}={b}")
            for key, a, b in (("slack", 0.1, 0.2), ("length", 0.5, 0.7))
        },
        "r": (ARM + "ROPE t arm(1,0) 0(0,2) 0(2,2) k=3 length=1 @\n", "r=(0,-0.1,0)", "r=(0,-0.2,0)"),
        "grip": (ARM + "BODY w m=1 j=1\nJOINT v 0(0,2) w pin\nROPE t arm(1,0) w 0(2,2) k=3 slack=0 r=(0,-1,0) @\n", "", "grip=2"),
        "axis": (SPATIAL + "JOINT h 0 a ball\nROPE t a(1,0.2,0) 0(0,2,2) 0(2,2,2) r=(0,0.1,0) k=3 slack=0 @\n",
                 "axis=(0,1,0)", "axis=(0,1,1)"),
        "pay": (ARM + "ROPE t arm(1,0) 0(0,2) k=3 length=0.5 @\n", "pay={0.1*angle(h)}", "pay={0.2*angle(h)}"),
        **{
            key: (ARM + f"ROPE t arm(1,0) 0(0,2) {'' if key == 'k' else 'k=3'} length=0.5 @\n", f"{key}={a}", f"{key}={b}")
            for key, a, b in (("k", 1, 2), ("c", 0.1, 0.2), ("e", 0.1, 0.2), ("n", 1, 2))
        },
    },
    "RATIO": {"coef": (WHEEL + "pin\nRATIO e h g @\n", "coef=(1,2)", "coef=(1,3)")},
    "ROLL": {
        "line": (FREE.replace("@", "y=0.2 vx=1") + "ROLL e b 0 r=0.2 @\n", "line=(0,1)", "line=(0.1,1)"),
        "r": (FREE.replace("@", "vx=1") + "ROLL e b 0 line=(0,1) @\n", "r=0.2", "r=0.3"),
        "axis": (TUMBLES.replace("@", "z=1 omega=(1,2,0)") + "ROLL e b 0 line=(0,0,1) r=1 @\n", "axis=(0,1,0)", "axis=(1,0,0)"),
        "rq": (FREE.replace("@", "y=0.5 vx=1") + "ROLL e b 0 r=0.2 @\n", "rq=0.3", "rq=0.4"),
    },
    "KNIFE": {
        "along": (FREE.replace("@", "vx=1 omega=1") + "KNIFE e b 0 @\n", "along=(1,0)", "along=(1,1)"),
        "normal": (TUMBLES.replace("@", "omega=(1,1,1)") + "KNIFE e b 0 along=(1,0) @\n", "normal=(0,0,1)", "normal=(0,1,1)"),
    },
    "TYRE": {
        "along": (TYRE + "b=8 c=1.3 d=1 sigma=0.3 @\n", "along=(1,0)", "along=(1,1)"),
        "normal": (
            TUMBLES.replace("@", "omega=(1,1,1)") + "TYRE e b 0 fz=9 b=8 c=1.3 d=1 sigma=1 @\n",
            "normal=(0,0,1)",
            "normal=(0,1,1)",
        ),
        "r": (TYRE.replace("r=0.3", "") + "b=8 c=1.3 d=1 sigma=0.3 @\n", "r=0.3", "r=0.4"),
        "fz": (TYRE.replace("fz=9", "") + "b=8 c=1.3 d=1 sigma=0.3 @\n", "fz=9", "fz=8"),
        "sigma": (TYRE + "b=8 c=1.3 d=1 @\n", "sigma=0.3", "sigma=(0.3,0.4)"),
        "e": (TYRE + "b=8 c=1.3 d=1 sigma=0.3 @\n", "e=0.3", "e=(0.3,0.4)"),
        **{
            key: (TYRE + " ".join(f"{k}=1.3" for k in "bcd" if k != key) + " sigma=0.3 @\n", f"{key}=1.3", f"{key}=(1.3,1.4)")
            for key in "bcd"
        },
        "model": (
            TYRE + "@ " + PAC.replace("pex1=0.6 ", "") + "\n.model one tyre pex1=0.2\n.model two tyre pex1=0.3\n",
            "model=one",
            "model=two",
        ),
        **{
            key: (TYRE + " ".join(x for x in PAC.split() if not x.startswith(f"{key}=")) + " @\n", f"{key}=0.7", f"{key}=0.8")
            for key in KEYS
        },
    },
    "CAM": {
        "lift": (WHEEL + "slide axis=(1,0)\nCAM e g h @\n", "lift={0.01*sin(angle(h))}", "lift={0.02*sin(angle(h))}"),
        **{
            key: (CAM + ("" if key == "k" else " k=1k") + "\n", f"{key}={a}", f"{key}={b}")
            for key, a, b in (("k", 1, 2), ("c", 0.1, 0.2), ("e", 0.1, 0.2), ("n", 1, 2))
        },
    },
    "FREEWHEEL": {"dir": (ROTOR + "FREEWHEEL f h @\n", "dir=1", "dir=-1")},
    "LATCH": {
        "held": (ROTOR.replace("2)", "0)") + "TORQUE t h tau=1\nLATCH l h catch={time>0.5} @\n", "held=no", "held=yes"),
        "hold": (FREE.replace("@", "x=1 y=1 vx=1 omega=1") + "LATCH l b 0 catch={time>0.05} @\n", "hold=point", "hold=distance"),
    },
    "FRICTION": {
        "fc": (ROTOR + "FRICTION f h @\n", "fc=1", "fc=2"),
        "fs": (ROTOR + "FRICTION f h fc=1 vs=1 @\n", "fs=1.5", "fs=2"),
        "vs": (ROTOR + "FRICTION f h fc=1 fs=2 @\n", "vs=1", "vs=2"),
        "b": (ROTOR + "FRICTION f h fc=1 @\n", "b=1", "b=2"),
        "mu": (ROTOR + "FRICTION f h radius=1m @\n", "mu=0.1", "mu=0.2"),
        "mus": (ROTOR + "FRICTION f h radius=1m mu=0.1 vs=1 @\n", "mus=0.2", "mus=0.3"),
        "radius": (ROTOR + "FRICTION f h mu=0.1 @\n", "radius=1m", "radius=2m"),
        "model": (ROTOR + "FRICTION f h fc=1 vs=1 @\n", "fs=2", "model=smooth"),
    },
    "STOP": {
        "min": (ROTOR + "STOP s h k=1 @\n", "min=-1", "min=0.3"), "max": (ROTOR + "STOP s h k=1 @\n", "max=1", "max=0.3"),
        "k": (ROTOR + "STOP s h min=0.4 max=0.6 @\n", "k=1", "k=2"),
        "c": (ROTOR + "STOP s h min=0.4 max=0.6 k=1 @\n", "c=0.1", "c=0.2"),
        "e": (ROTOR + "STOP s h min=0.4 max=0.6 k=1 @\n", "e=0.1", "e=0.2"),
        "n": (ROTOR + "STOP s h min=0.4 max=0.6 k=1 @\n", "n=1", "n=2"),
    },
    "CONTACT": {
        "line": (ARM + "CONTACT t arm(1,0) 0(0,1) k=1 @\n", "line=(0,1)", "line=(1,1)"),
        "r": (ARM + "CONTACT t arm(1,0) 0(0,1) k=1 line=(0,1) @\n", "r=0.5", "r=1"),
        "axis": (COIN + "CONTACT t coin 0 line=(0,0,1) k=1k r=0.1 @\n", "axis=(0,0,1)", "axis=(0,1,0)"),
        "rq": (ARM + "CONTACT t arm(1,0) 0(0,1) k=1 @\n", "rq=2", "rq=3"),
        **{
            key: (ARM + f"CONTACT t arm(1,0) 0(0,1) {'' if key == 'k' else 'k=1'} rq=2 @\n", f"{key}={a}", f"{key}={b}")
            for key, a, b in (("k", 1, 2), ("c", 0.1, 0.2), ("e", 0.1, 0.2), ("n", 1, 2))
        },
        "mu": (ARM + "CONTACT t arm(1,0) 0(0,1) k=1 rq=2 @\n", "mu=0.2", "mu=0.3"),
        "rolling": (ARM + "CONTACT t arm(1,0) 0(0,1) k=1 rq=2 @\n", "rolling=0.2", "rolling=0.3"),
        "drilling": (COIN + "CONTACT t coin 0 line=(0,0,1) k=1k r=0.1 @\n", "drilling=0.2", "drilling=0.3"),
    },
    "SHAPE": {
        "at": (DISC + "SHAPE f 0 box(1,0.1) @\nCONTACT c b f k=1\n", "at=(0,-0.15)", "at=(0,-0.2)"),
        "angle": (DISC + "SHAPE f 0 box(1,0.1) at=(0,-0.15) @\nCONTACT c b f k=1\n", "angle=0.1", "angle=0.3"),
        "rot": (
            "BODY b m=1 y=0.3 shape=ball(0.1)\nSHAPE f 0 plane(0,1,0) @\nCONTACT c b f k=1\n.gravity 0 -9.81 0\n",
            "rot=(0,0,0.1)",
            "rot=(0,0,0.3)",
        ),
    },
    "FORCE": {
        "dir": (ARM + "FORCE f arm(1,0) @ 2\n", "dir=(1,0)", "dir=(0,1)"),
        "value": (ARM + "FORCE f arm(1,0) dir=(1,0) @\n", "2", "3"),
        **{key: (ARM + "FORCE f arm(1,0) @\n", f"{key}=2", f"{key}=3") for key in ("fx", "fy")},
        "fz": (SPATIAL + "JOINT h 0 a slide axis=(0,0,1)\nFORCE f a @\n", "fz=2", "fz=3"),
    },
    "TORQUE": {
        "tau": (ROTOR + "TORQUE t h @\n", "tau=1", "tau=2"),
        "axis": (SPATIAL + "JOINT h 0 a pin axis=(1,0,0)\nTORQUE t a tau=1 @\n", "axis=(1,0,0)", "axis=(1,1,0)"),
    },
    "DRIVE": {
        "q": (CLOSED + "DRIVE d p1 @\n", "q={1.05+time}", "q={1.05+2*time}"),
        "qd": (CLOSED + "DRIVE d p1 @\n", "qd={1}", "qd={2}"),
    },
    "TRANSDUCER": {
        "c": (COIL, "c={1u/(1+pos(h))}", "c={2u/(1+pos(h))}"), "l": (COIL, "l={1m/(1+pos(h))}", "l={2m/(1+pos(h))}"),
        "k": (COIL, "k={3}", "k={4}"), "w": (COIL, "w={1m*i(t)^2/(1+pos(h))}", "w={2m*i(t)^2/(1+pos(h))}"),
    },
    "HEAT": {
        **{key: (WARM + "HEAT b x 0 @\n", f"{key}=1", f"{key}=2") for key in "r"},
        **{key: (WARM + "HEAT b x 0 @ area=1\n", f"{key}={a}", f"{key}={b}") for key, a, b in (("h", 1, 2), ("eps", 0.3, 0.6))},
        "area": (WARM + "HEAT b x 0 h=3 @\n", "area=1", "area=2"),
        **{key: (WARM + "HEAT b x @\n", f"{key}=1", f"{key}=2") for key in "cpt"},
        "ic": (WARM.replace("c=1", "c=1 @"), "ic=310", "ic=320"),
        "of": (WARM + "R1 n 0 1\nR2 n 0 2\nV1 n 0 3\nHEAT b x @\n", "of=r1", "of=r2"),
    },
    "MAGNETIC": {
        "r": (SLED + "MAGNETIC g x 0 h @\n", "r={1meg+pos(h)}", "r={1meg+3meg*pos(h)}"),
        "gap": (SLED + "MAGNETIC g x 0 h area=1m @\n", "gap={1m+pos(h)}", "gap={1m+3*pos(h)}"),
        **{
            key: (IRON + " ".join(w for w in WAY if not w.startswith(key)) + " @\n", f"{key}=3", f"{key}=4")
            for key in ("len", "area", "mur", "bsat", "br")
        },
        "turns": (IRON + "len=1 area=1m mur=20\nMAGNETIC w x 0 n 0 @\nR1 n 0 1\n", "turns=3", "turns=4"),
        "mmf": (IRON + "len=1 area=1m mur=20\nMAGNETIC w x y @\nMAGNETIC t y 0 r=3\n", "mmf=3", "mmf=4"),
    },
    "HYDRAULIC": {
        "r": (OIL + "HYDRAULIC b x 0 @\n", "r=1", "r=2"),
        **{
            key: (OIL + "HYDRAULIC b x 0 " + " ".join(w for w in ("len=1", "d=1", "mu=1") if w.split("=")[0] != key) + " @\n",
                  f"{key}=2", f"{key}=3")
            for key in ("len", "d", "mu")
        },
        **{
            key: (OIL + "HYDRAULIC b x 0 " + " ".join(w for w in ("area=1", "rho=1") if not w.startswith(key)) + " @\n",
                  f"{key}=2", f"{key}=3")
            for key in ("area", "rho", "cd", "plam")
        },
        "crack": (OIL + "HYDRAULIC b x 0 r=1 @\n", "crack=-9", "crack=-5"),
        "inertia": (OIL + "HYDRAULIC b x 0 @\n", "inertia=1", "inertia=2"),
        "vol": (OIL.replace("vol=1", "@"), "vol=1", "vol=2"), "bulk": (OIL.replace("bulk=3", "@"), "bulk=1", "bulk=2"),
        "ic": (OIL.replace("bulk=3", "bulk=3 @"), "ic=1", "ic=2"),
        "tank": (OIL + ".gravity 9\nHYDRAULIC b x rho=1 @\n", "tank=1", "tank=2"),
        "level": (".gravity 9\nHYDRAULIC b x tank=1 rho=1 @\n", "level=1", "level=2"),
        "disp": (OIL + ROTOR + "HYDRAULIC b x 0 h @\n", "disp=1", "disp=2"),
        "q": (OIL + "HYDRAULIC b x @\n", "q=1", "q=2"), "p": (OIL + "HYDRAULIC b x @\n", "p=1", "p=2"),
    },
}  # fmt: skip


# type of a .model of MOTOR: its nodes, and parameters whose values change one at a time
OF_MOTOR = {
    "dcwound": (
        "a 0 b 0",
        {"ra": 1, "la": 0.1, "rf": 2, "lf": 0.2, "laf": 0.3, "rs": 0.4, "ls": 0.05, "lafs": 0.1},
    ),
    "pmsm": ("a b c 0", {"p": 2, "rs": 1, "ld": 0.1, "lq": 0.2, "psi": 0.3, "l0": 0.05, "isat": 0.5}),
    "bldc": ("a b c 0", {"p": 2, "ke": 0.1, "r": 1, "l": 0.1}),
    "stepper": ("a 0 b 0", {"nr": 5, "km": 0.3, "r": 1, "l": 0.1, "td": 0.2, "isat": 0.5}),
    "induction": (
        "a b c 0",
        {"p": 2, "rs": 1, "rr": 0.5, "lm": 0.3, "lss": 0.02, "lsr": 0.03, "l0": 0.01, "isat": 0.5},
    ),
}
WARMTH = ("tc1", "tcm", "tref")
SHAFT = {"j": 0.1, "b": 0.2, "tc": 0.3, "gear": 2}
INSTEAD = {
    "pmsm ke": "psi", "bldc kt": "ke", "bldc rtt": "r", "bldc ltt": "l", "stepper step": "nr", "stepper hold": "km",
    "stepper inom": "km", "stepper tcm": "isat",
}  # fmt: skip


@pytest.mark.parametrize(
    ("kind", "key"),
    [
        (kind, key)
        for kind, machine in MODELS.items()
        if kind != "dcmotor"
        for key in machine.spec.params
        if key not in ("model", "heat", "magnets")
    ],
)
def test_a_parameter_of_a_kind_of_motor_is_not_ignored(kind, key):
    nodes, own = OF_MOTOR[kind]
    values = {**own, **SHAFT}
    if (other := INSTEAD.get(f"{kind} {key}")) is not None:
        del values[other]
    values |= {"tc1": 0.3} if key == "tref" else {}
    values |= {"hold": 1, "inom": 2} if key in ("hold", "inom") else {key: values.get(key, 0.11)}
    body = SLED if key == "radius" else ROTOR
    sources = "V1 a 0 5\nV2 b 0 SIN(0 3 1)\nV3 c 0 1\nR1 c 0 1\n"

    def deck(value: float) -> str:
        told = " ".join(f"{k}={value if k == key else v}" for k, v in values.items())
        heat = " heat=x\nHEAT x1 x c=1" if key in WARMTH else ""
        return f"{body}{sources}MOTOR m1 {nodes} h model=m{heat}\n.model m {kind}({told})\n"

    assert differ("@", deck(values[key]), deck(1.7 * values[key])), f"{key}= of .model {kind} has no effect"


@pytest.mark.parametrize(
    ("word", "key"),
    [
        (word, key)
        for word, card in CARDS.items()
        for key in card.spec.params
        if f"{word} {key}" not in NOT_IN_THE_EQUATIONS
    ],
)
def test_a_parameter_of_a_machine_card_is_not_ignored(word, key):
    assert differ(*MACHINES[word][key]), f"{key}= of {word} has no effect"

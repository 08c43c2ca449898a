"""What @q1[vbe], @m1[gbd] and the like read, each beside ngspice's own: at an operating point, and as a current of charge."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest
from support import needs_ngspice

import emsim

# .model, bias, what is read; `currents of charges` are zero at rest and are looked at under a ramp below
Q = """
q1 c b 0 s qq
.model qq npn is=1e-15 bf=80 vaf=60 ikf=20m rb=30 rc=2 re=0.5 cje=2p cjc=1p cjs=3p iss=1e-15 tf=0.3n tr=5n xcjc=0.6
v1 c 0 3
v2 b 0 0.72
v3 s 0 0.2
"""
PNP = """
q1 c b 0 qq
.model qq pnp is=1e-15 bf=60 vaf=40 rb=30 cje=2p cjc=1p tf=0.3n
v1 c 0 -3
v2 b 0 -0.7
"""
D = """
d1 a 0 dd
.model dd d is=1e-14 rs=2 cjo=3p tt=2n bv=40 n=1.1
v1 a 0 0.68
"""
J = """
j1 d g 0 jj
.model jj njf vto=-2 beta=1m lambda=0.02 rd=10 rs=5 cgs=3p cgd=2p
v1 d 0 4
v2 g 0 -0.5
"""
MOS = """
m1 d g 0 b mm w=20u l=2u ad=100p as=80p pd=40u ps=36u nrd=2 nrs=1
.model mm nmos level={level} vto=0.8 kp=40u gamma=0.5 phi=0.65 cj=3e-4 cjsw=2e-10 mj=0.5 mjsw=0.33 rsh=10 tox=40n
v1 d 0 3
v2 g 0 2
v3 b 0 -1
"""
BSIM = """
m1 d g 0 b mm w=20u l=2u ad=100p as=80p pd=40u ps=36u
.model mm {kind} level={level} cgso=1e-10 cgdo=2e-10 cgbo=1e-10
v1 d 0 {sign}3
v2 g 0 {sign}2.4
v3 b 0 {sign}-1
"""
OF_BSIM = """gm gds gmbs vdsat vth ibd ibs gbd gbs capbd capbs cgg cgd cgs cdg cdd cds cbg cbd cbs qg qd qb""".split()
VDMOS = """
m1 d g 0 mm
.model mm vdmos vto=2 kp=2 rd=0.1 rs=.05 cgs=1n cgdmin=10p cgdmax=1n cjo=1n
v1 d 0 3
v2 g 0 4
"""
OF_MOS = """id is ig ib ibd ibs vgs vds vbs vbd von vdsat gm gds gmbs gbd gbs cbd cbs cbd0 cbdsw0 cbs0 cbssw0 sourcevcrit
    drainvcrit rs rd sourceconductance drainconductance cqbd cqbs l w ad as pd ps nrd nrs""".split()
PMOS = re.sub(r"^(v\d \w 0) (-?)(?=\d)", r"\1 -\2", MOS, flags=re.MULTILINE).replace("--", "")
PMOS = PMOS.replace("nmos", "pmos").replace("vto=0.8", "vto=-0.8")
OF_Q = (
    "ic ib ie vbe vbc gm gpi gmu gx go cpi cmu cbx csub gdsub cqbe cqbc cqsub cqbx qbe qbc qsub qbx".split()
)
CASES = {
    "q": (Q, "q1", [*OF_Q, "is"]),
    "pnp": (PNP, "q1", OF_Q),
    "d": (D, "d1", "vd id gd cd charge".split()),
    "j": (J, "j1", "id ig is vgs vgd igd gm gds ggs ggd".split()),
    **{f"mos{k}": (MOS.replace("{level}", str(k)), "m1", OF_MOS) for k in (1, 2, 3)},
    **{f"pmos{k}": (PMOS.replace("{level}", str(k)), "m1", OF_MOS) for k in (1, 2, 3)},
    **{
        f"{kind}{k}": (BSIM.format(kind=kind, level=k, sign=sign).replace("--", ""), "m1", OF_BSIM)
        for k in (8, 14)
        for kind, sign in (("nmos", ""), ("pmos", "-"))
    },
    "vdmos": (VDMOS, "m1", "id is ig vgs vds cgd gm gds von".split()),
}
CASES |= {  # three devices in parallel: currents, conductances, capacitances, charges are of all of them
    f"{name}, m=3": (
        re.sub(rf"^({device} .*)$", r"\1 m=3", body, flags=re.MULTILINE),
        device,
        [n for n in names if n[:2] != "cq"],
    )
    for name, (body, device, names) in CASES.items()
}


def theirs(text: str, words: list[str], folder: Path) -> dict[str, float]:
    """ngspice's values at the operating point."""
    deck = folder / "deck.cir"
    prints = "\n".join(f"print {word}" for word in words)
    deck.write_text(f"title\n{text}\n.control\nop\n{prints}\n.endc\n.end\n")
    done = subprocess.run(["ngspice", "-b", deck], capture_output=True, text=True, timeout=60, check=False)
    pairs = (line.split(" = ") for line in done.stdout.splitlines() if line.startswith("@"))
    return {name.strip(): float(value) for name, value in pairs}


@needs_ngspice
@pytest.mark.parametrize("case", CASES)
def test_a_device_has_the_operating_values_of_ngspice(case: str, tmp_path: Path) -> None:
    body, device, names = CASES[case]
    text = f"{body}\n.options reltol=1e-9 abstol=1e-18 vntol=1e-12"
    words = [f"@{device}[{name}]" for name in names]
    right = theirs(text, words, tmp_path)
    got = emsim.run(f"title\n{text}\n.op\n.print op {' '.join(words)}\n.end\n")
    pairs = {word: (float(got[word][-1]), right[word]) for word in words}
    bad = {
        word: pair
        for word, pair in pairs.items()
        if abs(pair[0] - pair[1]) > 1e-4 * abs(pair[1]) + floor(word)
    }
    assert not bad


# under a ramp; at rest ngspice's capcur, qgs and qgd hold a capacitance
MOVING = {
    "q": (Q.replace("v2 b 0 0.72", "v2 b 0 pwl(0 0.5 1u 0.7)"), "q1", "cqbe cqbc cqbx qbe qbc".split()),
    "d": (D.replace("0.68", "pwl(0 -1 1u 0.6)"), "d1", "charge capcur".split()),
    "j": (J.replace("-0.5", "pwl(0 -1 1u -0.2)"), "j1", "qgs qgd cqgs cqgd".split()),
    "mos1": (
        MOS.replace("{level}", "1").replace("v1 d 0 3", "v1 d 0 pwl(0 1 1u 3)"),
        "m1",
        "cqbd qbd qbs".split(),
    ),
}


@needs_ngspice
@pytest.mark.parametrize("case", MOVING)
def test_currents_of_charges_are_those_of_ngspice(case: str, tmp_path: Path) -> None:
    body, device, names = MOVING[case]
    words = [f"@{device}[{name}]" for name in names]
    file = tmp_path / "deck.cir"
    found = "\n".join(f"meas tran m{k} find {word} at=0.8u" for k, word in enumerate(words))
    options = ".options reltol=1e-6 abstol=1e-15 chgtol=1e-18"
    file.write_text(
        f"title\n{body}\n{options}\n.control\nsave all {' '.join(words)}\ntran 1n 1u 0 1n\n{found}\n.endc\n.end\n"
    )
    done = subprocess.run(["ngspice", "-b", file], capture_output=True, text=True, timeout=60, check=False)
    right = {
        words[int(k)]: float(v) for k, v in re.findall(r"^m(\d+)\s+=\s+(\S+)", done.stdout, re.MULTILINE)
    }
    got = emsim.run(f"title\n{body}\n{options}\n.tran 1n 1u\n.save {' '.join(words)}\n.end\n")
    pairs = {word: (float(got.at(word, 0.8e-6)), right[word]) for word in words}
    assert not {word: pair for word, pair in pairs.items() if abs(pair[0] - pair[1]) > 2e-3 * abs(pair[1])}


def floor(word: str) -> float:
    """What gmin makes of a current or a conductance; nothing of a charge or a capacitance."""
    name = word.partition("[")[2]
    return 1e-20 if name[0] in "cq" and name[:2] != "cq" else 2e-11

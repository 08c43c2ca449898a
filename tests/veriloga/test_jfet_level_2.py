"""J of level 2 (Parker and Skellern) against ngspice: biases, small signals over frequency, transients through traps and heat."""

from __future__ import annotations

import random
import re
import subprocess

import numpy as np
import pytest
from support import needs_ngspice

import emsim
from emsim.interop.ngspice import named_alike
from emsim.outputs import raw

pytestmark = [needs_ngspice, pytest.mark.ngspice]

DRAW = random.Random(3)
POINTS = [(round(DRAW.uniform(-3, 5), 3), round(DRAW.uniform(-3, 0.6), 3)) for _ in range(14)]
TIGHT = ".options reltol=1e-9 abstol=1e-18 vntol=1e-12"

SETS = {
    "plain": "vto=-1.5",
    "below threshold": "vto=-1.5 vst=0.1 mvst=0.1 lambda=0.02",
    "powers and saturation": "vto=-1.5 p=2.5 q=1.8 xi=0.6 mxi=0.2 z=0.5",
    "feedback of the drain": "vto=-1.5 p=1.6 q=2.3 lfgam=0.05 lfg1=0.01 lfg2=-0.005 hfgam=0.1 vst=0.05",
    "heat and resistances": "vto=-1.5 delta=5 beta=1e-2 rd=10 rs=5",
    "junctions that break down": "vto=-1.5 ibd=1e-9 vbd=1.5 n=1.3 is=1e-13 vbi=0.8 beta=2e-3 xi=1",
}


def in_ngspice(tmp_path, text: str) -> str:
    (tmp_path / "deck.cir").write_text(text)
    command = ["ngspice", "-b", "-r", "out.raw", "deck.cir"]
    return subprocess.run(
        command, cwd=tmp_path, capture_output=True, text=True, timeout=60, stdin=subprocess.DEVNULL
    ).stdout


@pytest.mark.parametrize("temp", [27, 90])
@pytest.mark.parametrize("type_", ["njf", "pjf"])
@pytest.mark.parametrize("name", SETS)
def test_currents(tmp_path, name, type_, temp):
    sign = 1 if type_ == "njf" else -1
    lines = f"j1 d g 0 x area=1.5 temp={temp}\n.model x {type_}(level=2 {SETS[name]})\n{TIGHT}"
    points = "\n".join(f"alter vd {sign * d}\nalter vg {sign * g}\nop\nprint i(vd) i(vg)" for d, g in POINTS)
    said = in_ngspice(
        tmp_path,
        f"points\n{lines}\nvd d 0 0\nvg g 0 0\n.control\nset numdgt=12\n{points}\nquit\n.endc\n.end\n",
    )
    theirs = [[float(v) for v in re.findall(rf"i\({s}\) = ([-\d.e+]+)", said)] for s in ("vd", "vg")]
    assert len(theirs[0]) == len(POINTS)
    for k, (d, g) in enumerate(POINTS):
        point = emsim.run(f"point\n{lines}\nvd d 0 {sign * d}\nvg g 0 {sign * g}\n.op\n.end\n").op
        for source, wanted in zip(("vd", "vg"), theirs, strict=True):
            # ngspice is nothing below ten vst; what tails there is less than the floor
            assert float(point[f"i({source})"][0]) == pytest.approx(wanted[k], rel=1e-6, abs=1e-12)


STAGES = {
    "capacitances": "cgs=1p cgd=0.3p cds=0.1p",
    "of a gate that pinches off": "cgs=1p cgd=0.3p xc=0.3 acgam=0.1 xi=1 vst=0.05 lambda=0.03",
    "slow traps": "cgs=1p cgd=0.3p taug=1u lfgam=0.05 hfgam=0.12 hfeta=0.04 vst=0.05",
    "slow heat": "delta=0.5 taud=1u cgs=1p lambda=0.02",
    "both": "delta=0.5 taud=3u taug=0.3u lfgam=0.05 hfgam=0.12 lfg1=0.01 lfg2=-0.005 hfg1=0.01 hfe1=0.02 hfeta=0.03",
}


@pytest.mark.parametrize("analysis", ["ac", "tran", "noise"])
@pytest.mark.parametrize("name", STAGES)
def test_an_amplifier(tmp_path, name, analysis):
    card = {"ac": ".ac dec 4 1k 3g", "tran": ".tran 1n 4u 0 1n", "noise": ".noise v(d) vg dec 3 10 1meg"}[
        analysis
    ]
    source = "sin(-0.6 0.5 1meg)" if analysis == "tran" else ""
    text = f"""amplifier
vd dd 0 5
rd dd d 300
vg gg 0 dc -0.6 ac 1 {source}
rg gg g 100
j1 d g s x area=2
rs s 0 20
cs s 0 1u
.model x njf(level=2 vto=-1.5 beta=5m kf=1e-14 {STAGES[name]})
.options reltol=1e-6 abstol=1e-13 vntol=1e-9
{card}
.end
"""
    in_ngspice(tmp_path, text)
    ours = emsim.run(text).table(analysis)
    theirs = next(
        p for p in named_alike(raw.read(str(tmp_path / "out.raw"))).plots if p.plotname == ours.plotname
    )
    if analysis == "tran":
        t = theirs["time"][10:-3:5]
        # of traps and heat ngspice takes a filter of fourth power in each step
        assert np.abs(ours.at("v(d)", t) - theirs["v(d)"][10:-3:5]).max() <= 3e-4 * np.ptp(theirs["v(d)"])
    elif analysis == "ac":
        np.testing.assert_allclose(ours.column("v(d)"), theirs.column("v(d)"), rtol=1e-9)
    else:
        # its noise has the slow transconductance, ours the fast one
        exact = 1e-8 if "tau" not in STAGES[name] else 2e-2
        np.testing.assert_allclose(ours["onoise_spectrum"], theirs["onoise_spectrum"], rtol=exact)


def test_a_threshold_above_the_gate_is_told():
    with pytest.raises(emsim.DeckError, match="below the potential"):
        emsim.run("one\nvd d 0 1\nj1 d 0 0 x\n.model x njf(level=2 vto=2)\n.op\n.end\n")

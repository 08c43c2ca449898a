"""VBIC, levels 4 and 9 of Q, beside ngspice 39 at its own temperature, and its laws of temperature by themselves.

ngspice 39 has the exponents of a device without self-heating at tnom, whatever its temperature is, and leaves cbeo and cbco out
of .ac. A resistance of 0 is about a milliohm there, and the noise of rbp is between other nodes. So what is compared is at 27 C,
with resistances, without cbeo and cbco, and noise with a large rbp."""

from __future__ import annotations

import subprocess
from math import exp
from pathlib import Path

import numpy as np
import pytest
from support import needs_ngspice

import emsim

CARD = {
    "is": 1e-16, "rcx": 10, "rci": 60, "vo": 2, "gamm": 2e-11, "hrcf": 2, "rbx": 10, "rbi": 40, "re": 2, "rs": 20, "rbp": 40,
    "fc": 0.9, "cje": 1e-13, "pe": 0.75, "me": 0.33, "aje": -0.5, "cjc": 2e-14, "qco": 1e-12, "cjep": 1e-13, "pc": 0.75,
    "mc": 0.33, "ajc": -0.5, "cjcp": 4e-13, "ps": 0.75, "ms": 0.33, "ajs": -0.5, "ibei": 1e-18, "wbe": 0.95, "iben": 5e-15,
    "ibci": 2e-17, "ibcn": 5e-15, "avc1": 2, "avc2": 15, "isp": 1e-15, "wsp": 0.9, "ibeip": 1e-18, "ibenp": 1e-15, "vef": 10,
    "ver": 4, "ikf": 2e-3, "ikr": 2e-4, "ikp": 2e-4, "tf": 1e-11, "qtf": 0.1, "xtf": 20, "vtf": 2, "itf": 8e-2, "tr": 1e-10,
    "kfn": 1e-12,
}  # fmt: skip
SERIES = ("rcx", "rci", "rbx", "rbi", "re", "rs", "rbp")
VARIANTS: dict[str, dict[str, float]] = {
    "all of it": {},
    "smoothed": {"aje": 0.1, "ajc": 0.2, "ajs": 0.3},
    "base charge as SPICE's": {"qbm": 1, "nkf": 0.4},
    "no quasi-saturation": {"vo": 0, "gamm": 0, "hrcf": 0, "qco": 0},
    "defaults but for resistances": {**dict.fromkeys(CARD), **dict.fromkeys(SERIES, 5)},  # type: ignore[dict-item]
}
TIGHT = ".options reltol=1e-7 abstol=1e-18 vntol=1e-10 gmin=1e-15\n"


def card(variant: dict[str, float | None], sort: str, level: int) -> str:
    values = {**CARD, **variant}
    return (
        f".model q {sort} level={level} "
        + " ".join(f"{k}={v}" for k, v in values.items() if v is not None)
        + "\n"
    )


def both(tmp_path: Path, body: str, names: list[str]) -> tuple[np.ndarray, emsim.Result]:
    """ngspice's table (numbers as wrdata writes them) and our run."""
    (tmp_path / "ours.cir").write_text("vbic\n" + TIGHT + body + ".end\n")
    wanted = f"set wr_singlescale\nset numdgt=12\nrun\nwrdata out.txt {' '.join(names)}"
    if ".noise" in body:
        wanted = "set wr_singlescale\nset numdgt=12\nrun\nsetplot noise1\nwrdata out.txt onoise_spectrum"
    (tmp_path / "theirs.cir").write_text("vbic\n" + TIGHT + body + f".control\n{wanted}\nquit\n.endc\n.end\n")
    subprocess.run(["ngspice", "-b", "theirs.cir"], cwd=tmp_path, capture_output=True, timeout=60)
    return np.loadtxt(tmp_path / "out.txt"), emsim.run(tmp_path / "ours.cir")


NAMES = ["i(vc)", "i(vb)", "i(vs)"]


@needs_ngspice
@pytest.mark.ngspice
@pytest.mark.parametrize("sort", ["npn", "pnp"])
@pytest.mark.parametrize("variant", VARIANTS)
def test_currents(variant: str, sort: str, tmp_path: Path) -> None:
    sign = 1 if sort == "npn" else -1
    level = 4 if sort == "npn" else 9
    for sweep in (
        f".dc vb {0.3 * sign} {1.1 * sign} {0.05 * sign}",
        f".dc vc {-0.5 * sign} {5 * sign} {0.25 * sign}",
    ):
        body = f"vb b 0 {0.8 * sign}\nvc c 0 {2 * sign}\nvs s 0 {-sign}\nq1 c b 0 s q\n{sweep}\n"
        theirs, ours = both(tmp_path, card(VARIANTS[variant], sort, level) + body, NAMES)
        for k, name in enumerate(NAMES):
            scale = np.max(np.abs(theirs[:, 1 + k]))
            assert np.max(np.abs(np.asarray(ours[name]) - theirs[:, 1 + k])) <= 1e-7 * scale + 2e-14
        # far below what flows: relative, but for ngspice's own iterations
        small = np.abs(theirs[:, 1]) > 1e-12
        assert np.asarray(ours["i(vc)"])[small] == pytest.approx(theirs[small, 1], rel=2e-6)


@needs_ngspice
@pytest.mark.ngspice
@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("bias", [(0.7, 1.0), (0.9, 0.3), (0.85, 4.0)])
def test_small_signals(variant: str, bias: tuple[float, float], tmp_path: Path) -> None:
    vb, vc = bias
    body = f"vb b 0 dc {vb} ac 1\nvc c 0 {vc}\nvs s 0 -1\nq1 c b 0 s q\n.ac dec 2 1k 100g\n"
    theirs, ours = both(tmp_path, card(VARIANTS[variant], "npn", 4) + body, NAMES)
    for k, name in enumerate(NAMES):
        found = theirs[:, 1 + 2 * k] + 1j * theirs[:, 2 + 2 * k]
        assert np.max(np.abs(np.asarray(ours[name]) - found)) <= 1e-7 * np.max(np.abs(found)) + 1e-18


@needs_ngspice
@pytest.mark.ngspice
def test_noise(tmp_path: Path) -> None:
    body = "vcc s1 0 3\nvb b1 0 dc 0.8 ac 1\nrb b1 b 100\nrc s1 c 1k\nvs s 0 0\nq1 c b 0 s q\n.noise v(c) vb dec 2 10 100meg\n"
    theirs, ours = both(tmp_path, card({"rbp": 1e8}, "npn", 4) + body, [])
    assert np.asarray(ours["onoise_spectrum"]) == pytest.approx(theirs[:, 1], rel=1e-5)


@needs_ngspice
@pytest.mark.ngspice
def test_a_switched_stage(tmp_path: Path) -> None:
    body = (
        "vcc s1 0 3\nvb b1 0 pulse(0.6 0.95 1n 0.1n 0.1n 3n 8n)\nrb b1 b 200\nrc s1 c 500\nq1 c b 0 0 q\n"
        ".options chgtol=1e-18\n.tran 10p 8n 0 10p\n"
    )
    theirs, ours = both(tmp_path, card({}, "npn", 4) + body, ["v(c)"])
    at = np.asarray([ours.at("v(c)", t) for t in theirs[::20, 0]])
    assert at == pytest.approx(theirs[::20, 1], abs=4e-3)


@pytest.mark.parametrize("temp", [-40, 27, 110])
def test_the_exponents_follow_the_temperature(temp: float, tmp_path: Path) -> None:
    """ic = is(t) exp(v/vt), is(t) = is (t/tn)^xis exp(-ea (1 - t/tn)/vt): McAndrew 1996, its equations of temperature."""
    (tmp_path / "q.cir").write_text(
        f"hot\n.temp {temp}\n.options gmin=1e-20 abstol=1e-20\nvb b 0 0.5\nvc c 0 0.5\nq1 c b 0 q\n"
        ".model q npn level=4\n.op\n.end\n"
    )
    found = -emsim.run(tmp_path / "q.cir")["i(vc)"][-1]
    t, tn = temp + 273.15, 300.15
    vt = 1.380662e-23 / 1.602189e-19 * t
    current = 1e-16 * (t / tn) ** 3 * exp(-1.12 * (1 - t / tn) / vt)
    assert found == pytest.approx(current * exp(0.5 / vt), rel=1e-6)


def test_resistances_of_nothing(tmp_path: Path) -> None:
    """0 ohm, where two nodes are one, is the limit of little."""
    found = []
    for r in (0.0, 1e-9):
        text = card(dict.fromkeys(SERIES, r), "npn", 4)
        body = "vb b 0 0.85\nvc c 0 2\nvs s 0 -1\nq1 c b 0 s q\n.dc vb 0.3 0.9 0.1\n.end\n"
        (tmp_path / "q.cir").write_text("x\n" + TIGHT + text + body)
        found.append(np.asarray(emsim.run(tmp_path / "q.cir")["i(vc)"]))
    assert found[0] == pytest.approx(found[1], rel=1e-6)


def test_what_it_lacks_is_told(tmp_path: Path) -> None:
    """Self-heating: a resistance to ambience has no effect, and a fifth node is an error."""
    text = "x\nvb b 0 0.7\nvc c 0 1\nq1 c b 0 0 {}q\n.model q npn level=4 vrt=3\n.op\n.end\n"
    (tmp_path / "q.cir").write_text(text.format(""))
    run = emsim.run(tmp_path / "q.cir")
    assert any("takes no vrt=" in str(d) for d in run.diagnostics)
    (tmp_path / "q.cir").write_text(text.format("t "))
    with pytest.raises(emsim.DeckError, match="`q1` has 5 nodes, `vbic` 4 terminals"):
        emsim.run(tmp_path / "q.cir")

"""MOS levels 6 and 9 against ngspice, bias by bias: 6 is a text of its own; 9 is ngspice's rewritten level 3 and the same law."""

from __future__ import annotations

import random
import re
import subprocess

import numpy as np
import pytest
from support import needs_ngspice
from test_device_points import Device

import emsim

pytestmark = [needs_ngspice, pytest.mark.ngspice]

DRAW = random.Random(1)
POINTS = [[round(DRAW.uniform(*r), 3) for r in ((-0.5, 5), (-1, 5), (-3, 0.2))] for _ in range(15)]
SIZE = {"l": 2e-6, "w": 1e-5}


def words(values: dict) -> str:
    return " ".join(f"{k}={v}" for k, v in values.items())


def currents(tmp_path, model: str, line: str, sign: float) -> np.ndarray:
    """ngspice's drain currents at POINTS."""
    points = [
        f"alter vd {sign * d}\nalter vg {sign * g}\nalter vb {sign * b}\nop\nprint i(vd)"
        for d, g, b in POINTS
    ]
    text = "\n".join([
        "points", f"m1 d g 0 b x {line}", f".model x {model}", "vd d 0 0", "vg g 0 0", "vb b 0 0",
        ".options reltol=1e-9 abstol=1e-18 vntol=1e-12", ".control", "set numdgt=12", *points, "quit", ".endc", ".end",
    ])  # fmt: skip
    (tmp_path / "points.cir").write_text(text)
    done = subprocess.run(
        ["ngspice", "-b", "points.cir"], cwd=tmp_path, capture_output=True, text=True, timeout=60
    )
    return -np.array([float(v) for v in re.findall(r"i\(vd\) = ([-\d.e+]+)", done.stdout)])


@pytest.mark.parametrize("type_", ["nmos", "pmos"])
@pytest.mark.parametrize(
    "model",
    [
        {"nv": 0.7, "nc": 1.3, "kv": 1.5, "kc": 3e-5},
        {"gamma": 0.4, "gamma1": 0.02, "sigma": 0.03, "lambda": 0.05},
        {"lambda0": 0.05, "lambda1": 0.01, "ld": 1e-7},
        {"tox": 2.5e-8},
        {"tox": 2.5e-8, "nsub": 1e16, "u0": 500},
    ],
    ids=words,
)
@pytest.mark.parametrize("temp", [27, 80])
def test_level_6(tmp_path, type_, model, temp):
    sign = 1 if type_ == "nmos" else -1
    model = {"vto": sign * 0.8, **model}
    line = {**SIZE, "temp": temp}
    theirs = currents(tmp_path, f"{type_}(level=6 {words(model)})", words(line), sign)
    it = Device("mos6", {"model": model, "instance": line, "temp": 27, "tnom": 27, "type": type_})
    ours = [it.at(it.solve([sign * d, sign * g, 0.0, sign * b]))[0][0] for d, g, b in POINTS]
    assert len(theirs) == len(POINTS)
    assert np.all(np.abs(ours - theirs) <= 1e-6 * np.abs(theirs) + 1e-12)


def test_level_9_is_level_3(tmp_path):
    model = "vto=0.8 nsub=1.5e16 tox=25n vmax=1.2e5 xj=0.3u theta=0.05 ld=0.1u eta=0.04 kappa=0.7 nfs=3e11 delta=0.8"
    theirs = currents(tmp_path, f"nmos(level=9 {model})", words(SIZE), 1.0)
    for (d, g, b), wanted in zip(POINTS, theirs, strict=True):
        bias = f"vd d 0 {d}\nvg g 0 {g}\nvb b 0 {b}"
        r = emsim.run(
            f"one point\nm1 d g 0 b x {words(SIZE)}\n.model x nmos(level=9 {model})\n{bias}\n.op\n.end\n"
        )
        assert -float(r["i(vd)"][0]) == pytest.approx(wanted, rel=1e-6, abs=1e-11)

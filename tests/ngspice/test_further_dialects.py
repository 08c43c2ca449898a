"""LTspice's soft limits, delays and integrals in behaviour; transfer functions beside ngspice's s_xfer; random sources beside
ngspice's by their statistics."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import numpy as np
import pytest

import emsim
from emsim.interop import ngspice

needs_ngspice = pytest.mark.skipif(not ngspice.find(), reason="ngspice is not installed")


def at_six(expression: str, dialect: str = "ltspice") -> np.ndarray:
    """V(x) goes from -3 to 3 in 6 s."""
    text = f"t\nV1 x 0 PWL(0 -3 6 3)\nR1 x 0 1k\nB1 a 0 V={expression}\n.tran 6\n.end\n"
    result = emsim.run(text, options={"dialect": dialect})
    return np.asarray(result["time"]), np.asarray(result["v(x)"]), np.asarray(result["v(a)"])


def test_soft_limits():
    _, x, found = at_six("uplim(V(x),1,0.5)")
    s = np.clip(x - 0.5, 0.0, 1.0)
    assert np.abs(found - np.minimum(x, 0.5) - 0.5 * (1.0 - (1.0 - s) ** 2)).max() < 1e-12
    _, x, low = at_six("dnlim(V(x),-1,0.5)")
    s = np.clip(-x - 0.5, 0.0, 1.0)
    assert np.abs(-low - np.minimum(-x, 0.5) - 0.5 * (1.0 - (1.0 - s) ** 2)).max() < 1e-12


def test_delay_and_integral_with_modulus():
    t, _, found = at_six("delay(V(x),0.5)")
    assert np.abs(found - (np.maximum(t - 0.5, 0.0) - 3.0)).max() < 1e-9
    t, _, found = at_six("idtmod(1,0.1,0.7,-0.2)")
    inside = np.abs((t + 0.3) / 0.7 - np.round((t + 0.3) / 0.7)) > 1e-3
    assert np.abs(found - ((t + 0.1 + 0.2) % 0.7 - 0.2))[inside].max() < 1e-9


def run_ngspice(text: str, folder: Path) -> str:
    deck = folder / "deck.cir"
    deck.write_text(text)
    done = subprocess.run(
        [str(ngspice.find()), "-b", str(deck)], capture_output=True, text=True, timeout=60, cwd=folder
    )
    return done.stdout + done.stderr


@needs_ngspice
def test_a_transfer_function_is_that_of_s_xfer(tmp_path):
    head = "t\nV1 in 0 SIN(0 1 100)\nR1 out 0 1k\n"
    tail = ".options reltol=1e-6\n.tran 10u 20m 0 2u\n.meas tran a FIND v(out) AT=7m\n.meas tran b FIND v(out) AT=16.3m\n.end\n"
    theirs = run_ngspice(
        head
        + "A1 in out m\n.model m s_xfer(gain=3 num_coeff=[1e-3 1] den_coeff=[4e-7 4e-4 1] int_ic=[0 0])\n"
        + tail,
        tmp_path,
    )
    found = [float(re.search(rf"^{name}\s*=\s*(\S+)", theirs, re.M).group(1)) for name in "ab"]
    own = emsim.run(head + "E1 out 0 LAPLACE {V(in)} {3*(1+1m*s)/(1+0.4m*s+0.4u*s*s)}\n" + tail).measures
    assert [own["a"], own["b"]] == pytest.approx(found, rel=1e-3)  # their steps are of first order there


@needs_ngspice
@pytest.mark.parametrize(
    "source", ["TRNOISE(0.5 1u 0 0)", "TRNOISE(0 1u 1 0.1)", "TRRANDOM(1 10u 0 3 1)", "TRRANDOM(3 10u 0 2 1)",
     "TRRANDOM(4 10u 0 3 1)"]
)  # fmt: skip
def test_random_sources_have_the_deviation_that_they_have_in_ngspice(source, tmp_path):
    head = f"t\nV1 a 0 DC 1 {source}\nR1 a 0 1\n.tran 1u 20m\n"
    run_ngspice(head + ".control\nrun\nlinearize v(a)\nwrdata out.txt v(a)\n.endc\n.end\n", tmp_path)
    theirs = np.loadtxt(next(tmp_path.glob("out*")))[:, 1]
    result = emsim.run(head + ".end\n")
    own = np.interp(np.arange(0, 20e-3, 1e-6), result["time"], result["v(a)"])
    # 1/f noise wanders: its mean is nobody's
    of = (lambda x: np.std(np.diff(x))) if "0.1" in source else np.std
    assert of(own) == pytest.approx(of(theirs), rel=0.08)
    if "0.1" not in source:
        assert own.mean() == pytest.approx(theirs.mean(), abs=0.15)

"""`emsim new`: every template runs without a word from emsim, and does what its comments say."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

import emsim
from emsim.cli import main
from emsim.cli import new as verb


def made(name: str) -> emsim.Result:
    assert main(["new", "mine", "-t", name, "-q"]) == 0
    result = emsim.run("mine.cir")
    assert result.title.startswith("mine: ") and result.diagnostics == []
    assert main(["mine.cir", "-q", "--csv", "mine.csv"]) == 0
    return result


@pytest.mark.parametrize("name", verb.templates())
def test_templates_run_and_their_machines_conserve_energy(name, scratch):
    result = made(name)
    assert result.status == "ok" and len(result) > 100
    if result.energy is not None:
        assert abs(result.energy.share) < 1e-5


@pytest.mark.parametrize("name", verb.templates())
def test_the_help_text_names_it(name):
    assert f"{name} (" in " ".join((verb.__doc__ or "").split())


@pytest.mark.parametrize("name", verb.templates())
def test_templates_are_laid_out(name, scratch):
    made(name)
    assert main(["fmt", "--check", "mine.cir"]) == 0


def test_circuit(scratch):
    r = made("circuit")
    t = np.linspace(1e-5, 9e-4, 50)
    np.testing.assert_allclose(r.at("v(out)", t), 5 * (1 - np.exp(-(t - 0.5e-6) / 1e-4)), atol=5e-3)


def test_rectifier(scratch):
    r = made("rectifier")
    late = r["v(out)"][r.time > 0.15]
    # the rule of thumb leaves out the time of charging
    ripple = late.mean() / (2 * 50 * 470 * 470e-6)
    assert 0.7 * ripple < late.max() - late.min() < ripple


def test_motor(scratch):
    r = made("motor")
    kt, volts, ohm, b, j = 30e-3, 12, 1.5, 10e-6, 50e-6
    final, tau = kt * volts / (kt**2 + ohm * b), ohm * j / (kt**2 + ohm * b)
    assert final == pytest.approx(393.4, abs=0.1) and tau == pytest.approx(82e-3, abs=1e-3)
    # the winding's 0.33 ms delays the start a little
    np.testing.assert_allclose(
        r.at("omega(shaft)", [0.1, 0.3, 0.5]),
        final * (1 - np.exp(-np.array([0.1, 0.3, 0.5]) / tau)),
        rtol=5e-3,
    )


def test_pendulum(scratch):
    assert np.degrees(made("pendulum")["angle(hinge)"][-1]) == pytest.approx(43.4, abs=0.1)


def test_linkage(scratch):
    r = made("linkage")
    # the crank goes round and the rocker swings: 0.1 + 0.3 < 0.25 + 0.3 is Grashof's condition
    assert r["angle(a)"][-1] > 4 * np.pi and np.ptp(r["angle(c)"]) < np.pi


def test_spring(scratch):
    r = made("spring")
    t, x = r.time, r["pos(rail)"]
    zeros = t[1:][(x[:-1] < 0) & (x[1:] >= 0)]
    assert 2 * np.pi / np.diff(zeros).mean() == pytest.approx(9.99, abs=0.01)
    peaks = [x[(t >= a) & (t < b)].max() for a, b in pairwise(zeros)]
    assert np.log(peaks[0] / peaks[-1]) / (zeros[-2] - zeros[0]) == pytest.approx(0.4, abs=0.01)


def test_what_exists_stays(scratch, capsys):
    (scratch / "a.cir").write_text("mine\n")
    assert main(["new", "a"]) == 5
    assert "exists already" in capsys.readouterr().err and (scratch / "a.cir").read_text() == "mine\n"


def test_it_says_what_to_type(scratch, capsys):
    assert main(["new", "servo.net"]) == 0
    said = capsys.readouterr().out
    assert "emsim servo.net" in said and "emsim view servo.net" in said
    assert (scratch / "servo.net").read_text().startswith("servo: an RC low-pass")


@pytest.mark.parametrize(
    ("args", "code", "says"),
    [([], 2, "takes one name"), (["a", "b"], 2, "takes one name"), (["a", "-t", "motr"], 2, "did you mean motor?"),
     (["a", "-t", "xyzzy"], 2, "there is circuit, encoder"), (["no/where/a"], 5, "there is no folder")],
)  # fmt: skip
def test_mistakes(args, code, says, scratch, capsys):
    assert main(["new", *args]) == code
    assert says in capsys.readouterr().err

"""Lossless lines: what a step, a ramp and a sine make of them in closed form, in every method; small signals; ngspice."""

from __future__ import annotations

import math
import subprocess

import numpy as np
import pytest
from support import needs_ngspice

import emsim
from emsim.interop.ngspice import named_alike
from emsim.outputs import raw

METHODS = ["auto", "trap", "gear", "radau", "trbdf2", "esdirk"]
TD, RISE = 2e-9, 0.1e-9


def ramp(t):
    return np.clip((t - 1e-9) / RISE, 0.0, 1.0)


def arrives(t, source: float, load: float, z0: float = 50.0):
    """Voltages at both ends of a line behind `source` ohm and before `load`: the ramp, sent to and fro."""
    at_source, at_load = ((r - z0) / (r + z0) if math.isfinite(r) else 1.0 for r in (source, load))
    a = b = np.zeros_like(t)
    wave, late = z0 / (z0 + source), 0.0
    for _ in range(40):
        a = a + wave * ramp(t - late)
        b = b + wave * (1 + at_load) * ramp(t - late - TD)
        a = a + wave * at_load * ramp(t - late - 2 * TD)
        wave, late = wave * at_load * at_source, late + 2 * TD
    return a, b


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("source", "load"), [(50, 50), (50, math.inf), (10, math.inf), (25, 1e-6), (10, 150), (200, 20)]
)
def test_reflections_of_a_step(source, load, method):
    end = "r2 b 0 1e15" if math.isinf(load) else f"r2 b 0 {load}"
    r = emsim.run(
        f"line\nv1 in 0 pulse(0 1 1n {RISE} {RISE} 1 2)\nr1 in a {source}\nt1 a 0 b 0 z0=50 td={TD}\n{end}\n"
        f".options method={method} reltol=1e-6\n.tran 0.05n 30n\n.end\n"
    )
    a, b = arrives(r.time, source, load)
    np.testing.assert_allclose(r["v(a)"], a, atol=2e-9)
    np.testing.assert_allclose(r["v(b)"], b, atol=2e-9)


def test_a_line_given_by_a_frequency_is_a_quarter_of_a_wave():
    deck = (
        "line\nv1 in 0 pulse(0 1 1n 0.1n)\nr1 in a 50\nt1 a 0 b 0 z0=50 {}\nr2 b 0 50\n.tran 0.1n 10n\n.end\n"
    )
    one, other = (emsim.run(deck.format(words)) for words in ("td=2n", "f=125meg"))
    half = emsim.run(deck.format("f=250meg nl=0.5"))
    for t in (2.9e-9, 3.05e-9, 3.2e-9):
        assert one.at("v(b)", t) == pytest.approx(other.at("v(b)", t), abs=1e-9)
        assert one.at("v(b)", t) == pytest.approx(half.at("v(b)", t), abs=1e-9)


@pytest.mark.parametrize("method", ["auto", "trap", "radau"])
def test_a_sine_arrives_late(method):
    r = emsim.run(
        f"line\nv1 in 0 sin(0 1 100meg)\nr1 in a 50\nt1 a 0 b 0 z0=50 td=3.3n\nr2 b 0 50\n.options method={method} reltol=1e-6\n"
        ".tran 0.2n 60n 0 0.1n\n.end\n"
    )
    late = np.maximum(r.time - 3.3e-9, 0.0)
    # between its points trap has straight lines
    within = (2 * np.pi * 1e8 * 0.1e-9) ** 2 / 8 if method == "trap" else 2e-6
    np.testing.assert_allclose(r["v(b)"], 0.5 * np.sin(2 * np.pi * 1e8 * late), atol=within)


def test_small_signals_of_a_line():
    """Into a line of impedance z0 with a load: Z = z0 (zl + j z0 tan)/(z0 + j zl tan)."""
    r = emsim.run(
        "line\nv1 in 0 ac 1\nr1 in a 75\nt1 a 0 b 0 z0=50 td=2n\nr2 b 0 120\nc2 b 0 3p\n.ac lin 200 1meg 900meg\n.end\n"
    ).table("ac")
    w = 2 * np.pi * r["frequency"].real
    load = 1 / (1 / 120 + 1j * w * 3e-12)
    tan = np.tan(w * 2e-9)
    z = 50 * (load + 50j * tan) / (50 + 1j * load * tan)
    np.testing.assert_allclose(r["v(a)"], z / (z + 75), rtol=1e-10)
    voltage = z / (z + 75) * (np.cos(w * 2e-9) - 1j * np.sin(w * 2e-9) * 50 / z)
    np.testing.assert_allclose(r["v(b)"], voltage, rtol=1e-9)


def test_the_operating_point_is_that_of_a_wire():
    r = emsim.run(
        "line\nv1 in 0 6\nr1 in a 50\nt1 a 0 b 0 z0=75 td=2n\nr2 b 0 100\n.op\n.dc v1 0 3 1\n.end\n"
    )
    assert r.table("op")["v(a)"][0] == r.table("op")["v(b)"][0] == pytest.approx(4.0, rel=1e-12)
    np.testing.assert_allclose(r.table("dc")["v(b)"], [0, 2 / 3, 4 / 3, 2], rtol=1e-12)


def test_a_start_from_the_operating_point_is_at_rest():
    r = emsim.run("line\nv1 in 0 6\nr1 in a 50\nt1 a 0 b 0 z0=75 td=2n\nr2 b 0 100\n.tran 1n 20n\n.end\n")
    np.testing.assert_allclose(r["v(b)"], 4.0, rtol=1e-12)


def test_noise_goes_through_a_line():
    r = emsim.run(
        "line\nv1 in 0 ac 1\nr1 in a 50\nt1 a 0 b 0 z0=50 td=2n\nr2 b 0 50\n.noise v(b) v1 lin 3 1meg 300meg\n.end\n"
    )
    expected = math.sqrt(4 * 1.38064852e-23 * 300.15 * 25)
    np.testing.assert_allclose(r.table("noise")["onoise_spectrum"], expected, rtol=1e-9)


DECKS = {
    "two lines and a diode": """v1 in 0 pulse(0 3 1n 0.5n 0.5n 8n 20n)
r1 in a 30
t1 a 0 b 0 z0=50 td=1.7n
d1 b 0 dm
c1 b 0 1p
t2 b 0 c 0 z0=70 td=2.3n
r2 c 0 200
.model dm d is=1e-14 rs=2""",
    "a line with its end off the ground": """v1 in 0 sin(0 1 80meg)
r1 in a 50
t1 a 0 b c z0=50 td=1n
r2 b 0 20
r3 c 0 30
c3 c 0 5p""",
    "from given values": """v1 in 0 1
r1 in a 50
t1 a 0 b 0 z0=50 td=3n ic=0.5,2m,0.2,1m
r2 b 0 20""",
}  # fmt: skip


@needs_ngspice
@pytest.mark.ngspice
@pytest.mark.parametrize("name", DECKS)
def test_as_ngspice(tmp_path, name):
    uic = "uic" if "ic=" in DECKS[name] else ""
    text = f"lines\n{DECKS[name]}\n.options reltol=1e-6 abstol=1e-15 vntol=1e-9\n.tran 0.01n 40n 0 0.005n {uic}\n.end\n"
    (tmp_path / "deck.cir").write_text(text)
    subprocess.run(
        ["ngspice", "-b", "-r", "out.raw", "deck.cir"], cwd=tmp_path, capture_output=True, timeout=60, stdin=subprocess.DEVNULL
    )  # fmt: skip
    theirs = named_alike(raw.read(str(tmp_path / "out.raw"))).plots[0]
    ours = emsim.run(text).table("tran")
    t = theirs["time"][(theirs["time"] > 1e-12) & (theirs["time"] < 39.9e-9)][::40]
    for name in ("v(a)", "v(b)"):
        a, b = ours.at(name, t), np.interp(t, theirs["time"], theirs[name])
        assert np.abs(a - b).max() <= 5e-3 * np.abs(b).max(), name


@pytest.mark.parametrize("card", [".pz a 0 b 0 vol pz", ".modes"])
def test_poles_of_a_line_are_without_number(card):
    with pytest.raises(emsim.DeckError, match="E305"):
        emsim.run(f"line\nr1 a 0 50\nt1 a 0 b 0 z0=50 td=2n\nr2 b 0 120\n{card}\n.end\n")


@pytest.mark.parametrize("words", ["td=1n", "z0=50", "z0=50 td=0", "z0=-50 td=1n"])
def test_what_is_no_line(words):
    with pytest.raises(emsim.DeckError, match="E281"):
        emsim.run(f"line\nv1 a 0 1\nt1 a 0 b 0 {words}\nr2 b 0 120\n.op\n.end\n")


@pytest.mark.parametrize("method", ["rk45", "dop853"])
def test_methods_that_cannot_say_so(method):
    with pytest.raises(emsim.ConvergenceError, match="E413"):
        emsim.run(
            f"line\nv1 a 0 1\nt1 a 0 b 0 z0=50 td=1n\nr2 b 0 120\n.options method={method}\n.tran 1n 10n\n.end\n"
        )


RC_LINES = {
    "three lumps": "u1 a b 0 um l=50u\n.model um urc k=1.8 fmax=2g rperl=20meg cperl=2p",
    "as many as are asked for": "u1 a b 0 um l=50u n=5\n.model um urc k=1.5 rperl=20meg cperl=20n",
    "as many as fmax wants": "u1 a b 0 um l=5\n.model um urc k=2 fmax=1meg rperl=1k cperl=1n",
    "with its own ground": "u1 a b g um l=5\nrg g 0 200\n.model um urc k=2 fmax=100k rperl=1k cperl=1n",
}


@needs_ngspice
@pytest.mark.ngspice
@pytest.mark.parametrize("name", RC_LINES)
def test_rc_lines_as_ngspice(tmp_path, name):
    text = f"urc\nv1 in 0 dc 1 ac 1\nr1 in a 100\n{RC_LINES[name]}\nr2 b 0 10k\n.ac dec 4 1k 1g\n"
    text += ".noise v(b) v1 dec 4 1k 1meg\n.end\n"
    (tmp_path / "deck.cir").write_text(text)
    subprocess.run(
        ["ngspice", "-b", "-r", "out.raw", "deck.cir"], cwd=tmp_path, capture_output=True, timeout=60, stdin=subprocess.DEVNULL
    )  # fmt: skip
    theirs = {t.plotname: t for t in named_alike(raw.read(str(tmp_path / "out.raw"))).plots}
    ours = emsim.run(text)
    for kind, column in (("ac", "v(b)"), ("noise", "onoise_spectrum"), ("integrated noise", "onoise_total")):
        a = ours.table(kind)
        b = theirs[a.plotname]
        assert np.abs(a.column(column) - b.column(column)).max() <= 1e-5 * np.abs(b.column(column)).max(), (
            kind
        )


def test_lines_have_no_equations_for_other_integrators():
    with pytest.raises(emsim.DeckError, match="E413"):
        emsim.compile("line\nv1 a 0 1\nt1 a 0 b 0 z0=50 td=1n\nr2 b 0 120\n.tran 1n 10n\n.end\n")


def test_the_equations_of_a_line_can_be_read():
    from emsim import pipeline
    from emsim.reports import explained

    deck = "line\nr1 in a 50\nt1 a 0 b 0 z0=50 td=2n\nr2 b 0 150\nv1 in 0 sin(0 1 1meg)\n.tran 1n 20n\n.end\n"
    text = "\n".join(explained.page(pipeline.explain(deck)))
    assert "DELAY(by=2e-09)" in text and "SIN(" in text and "source2" not in text

"""Spectra of transients: amplitudes under every window, expressions with fft() in pictures."""

import numpy as np
import pytest

import emsim
from emsim.cli import main
from emsim.diagnostics import DeckError
from emsim.outputs.panels import panels
from emsim.spectrum import WINDOWS, amplitudes

DECK = "t\nV1 a 0 SIN(0.5 2 1k)\nR1 a b 1k\nV2 c 0 SIN(0 0.1 3k)\nR2 c b 1k\n.tran 5u 8m\n.options reltol=1e-7\n.end\n"


@pytest.mark.parametrize("window", WINDOWS)
@pytest.mark.parametrize("n", [256, 255])
def test_a_sine_on_a_line_has_its_amplitude_under_every_window(window, n):
    k = np.arange(n)
    f, z = amplitudes(0.25 + 3 * np.cos(2 * np.pi * 16 * k / n + 0.4), 1.0, window)
    assert abs(z[0]) == pytest.approx(0.25) and z[16] == pytest.approx(3 * np.exp(0.4j))
    assert f[16] == pytest.approx(16 / n) and len(f) == len(z) == n // 2 + 1
    assert abs(z[30:]).max() < 1e-12


def test_the_last_line_of_an_even_number_of_samples():
    _, z = amplitudes(np.array([1.0, -1.0] * 8), 1.0, "none")
    assert z[-1] == pytest.approx(1.0)


def test_the_spectrum_of_a_run():
    result = emsim.run(DECK)
    s = result.fft("v(b)", "v(a)-v(c)", window="none")
    assert s.names == ["frequency", "fft(v(b))", "fft(v(a)-v(c))"] and s.units == ["Hz", "V", "V"]
    size = np.abs(s["fft(v(b))"])
    assert s["frequency"][8] == pytest.approx(1e3)
    assert (
        size[[0, 8, 24]] == pytest.approx([0.25, 1.0, 0.05], abs=1e-4)
        and np.delete(size, [0, 8, 24]).max() < 1e-4
    )
    assert s["db(fft(v(b)))"][8] == pytest.approx(0, abs=1e-3)
    assert len(result.fft(points=64, stop=4e-3)) == 33


def test_what_has_no_spectrum_says_so():
    result = emsim.run("t\nV1 a 0 ac 1\nR1 a 0 1k\n.ac dec 5 1 1k\n.end\n")
    with pytest.raises(ValueError, match="not one course"):
        result.fft("v(a)")
    with pytest.raises(ValueError, match="no window"):
        emsim.run(DECK).fft("v(a)", window="round")
    with pytest.raises(DeckError, match="no spectrum"):
        panels(result.main, ["fft(v(a))"])


def test_pictures_of_spectra(tmp_path, monkeypatch, capsys):
    result = emsim.run(DECK)
    db, size = panels(result.main, ["v(b) fft(v(b)) mag(fft(v(b)))"])[1:]
    assert (db.unit, db.x, db.log, db.curves[0].name) == ("dB", "frequency", True, "db(fft(v(b)))")
    assert size.unit == "V" and size.curves[0].y.max() == pytest.approx(1.0, rel=1e-3)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "d.cir").write_text(DECK.replace(".end", ".save v(a)\n.end"))
    assert main(["d.cir", "-q", "--plot", "fft(v(b))"]) == 0
    assert "fft(v(b))" in capsys.readouterr().out

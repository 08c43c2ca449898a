"""meas, fourier, fft, psd, spec, linearize and what else works on a transient, against ngspice's at tight tolerances."""

from __future__ import annotations

import pytest
from control_runs import agree
from support import needs_ngspice

import emsim

pytestmark = [needs_ngspice, pytest.mark.ngspice]

# two tones and a level; steps so short that both programs' points say the same
TONES = "V1 a 0 SIN(0.2 1 1k)\nV2 b a SIN(0 0.3 3k)\nR1 b 0 1k\nR2 b c 1k\nC1 c 0 50n\n.options reltol=1e-6\n.tran 5u 4m 0 2u"

# 1024 points: ngspice without FFTW puts zeros behind others
EVEN = "let lin-tstep = 4m/1023\nlet lin-tstop = 4m"

SECTIONS = {
    "linearize": "run\nlinearize v(b)\nprint length(time) v(b)[100] v(b)[400]\ndisplay",
    "linearize all": "run\nlinearize\nsetplot\nprint v(c)[200] v1#branch[200]",
    "linearize to other steps": (
        "run\nlet lin-tstep = 20u\nlet lin-tstart = 1m\n"
        "let lin-tstop = 3m\nlinearize v(b)\nprint length(time) time[0] v(b)[50]"
    ),
    "fft": (
        f"run\n{EVEN}\nlinearize v(b)\n"
        f"set specwindow=none\nfft v(b)\nprint mag(v(b))[4] mag(v(b))[12] frequency[4] length(v(b))"
    ),
    "spec": "run\nlinearize v(b)\nspec 0 5k 250 v(b)\nprint mag(v(b))[4] mag(v(b))[12] frequency[4] length(v(b))",
    "meas max": "run\nmeas tran top max v(b) from=0 to=1m\nprint top",
    "meas when": (
        "run\nmeas tran cross when v(c)=0.5 rise=2\n"
        "meas tran val find v(b) at=1.1m\nmeas tran mean avg v(b) from=0 to=4m"
    ),
    "meas trig": "run\nmeas tran delay trig v(b) val=0.5 rise=1 targ v(c) val=0.5 rise=1",
    "meas in a loop": "foreach r 1k 2k\nalter r2 = $r\nrun\nmeas tran top max v(c) from=0 to=1m\nend",
    "meas of what let made": "run\nlet p = v(b)*v(c)\nmeas tran top max p from=1m to=2m",
    "integ": "run\nlet q = integ(v(b))\nprint q[length(q)-1]",
    "deriv": "run\nlinearize v(b)\nlet d = deriv(v(b))\nprint d[300] d[500]",
}
WINDOWS = [
    "rectangular",
    "hanning",
    "cosine",
    "hamming",
    "blackman",
    "flattop",
    "triangle",
    "bartlet",
    "gaussian",
]


@pytest.mark.parametrize("name", SECTIONS)
def test_a_section_on_a_transient(name, tmp_path):
    agree(TONES, SECTIONS[name], tmp_path, within=3e-3, small=1e-5)


@pytest.mark.parametrize("window", WINDOWS)
def test_a_window_of_the_spectrum(window, tmp_path):
    shown = "print mag(v(b))[1] mag(v(b))[3] mag(v(b))[4] mag(v(b))[5] mag(v(b))[12]"
    agree(
        TONES,
        f"run\n{EVEN}\nlinearize v(b)\nset specwindow={window}\nfft v(b)\n{shown}",
        tmp_path,
        within=3e-3,
        small=1e-4,
    )


def test_power_over_frequency(tmp_path):
    shown = "print mag(v(b))[4] mag(v(b))[12] mag(v(b))[30]"
    agree(TONES, f"run\n{EVEN}\nlinearize v(b)\npsd 1 v(b)\n{shown}", tmp_path, within=1e-2, small=1e-6)


# every harmonic of a pulse of 30 % is there
PULSE = "V1 a 0 PULSE(0 1 0 10u 10u 290u 1m)\nR1 a b 1k\nC1 b 0 50n\n.options reltol=1e-6\n.tran 2u 3m 0 1u"


@pytest.mark.parametrize(
    "commands",
    ["fourier 1k v(a)", "set nfreqs=5\nfourier 1k v(a) v(b)", "set fourgridsize=400\nfourier 1k v(b)"],
)
def test_harmonics(commands, tmp_path):
    agree(PULSE, f"run\n{commands}", tmp_path, within=1e-2, small=1e-3)


def test_the_level_of_a_spectrum_is_the_mean(tmp_path):
    """ngspice shows twice of it."""
    result = emsim.run(
        f"t\n{TONES}\n.control\nrun\nlinearize v(b)\nset specwindow=none\nfft v(b)\n.endc\n.end\n"
    )
    assert abs(result.table("sp")["v(b)"][0]) == pytest.approx(0.2, rel=2e-3)

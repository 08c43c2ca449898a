"""The functions and operators of vectors against what ngspice 39 prints, each of them."""

from __future__ import annotations

import pytest
from control_runs import agree
from support import needs_ngspice

pytestmark = [needs_ngspice, pytest.mark.ngspice]

RC = "V1 in 0 DC 1 AC 1\nR1 in out 1k\nR2 out 0 3k\nC1 out 0 1u"
SWEEP = "dc v1 -1 2 0.5\nlet y = v(out)*v(out) + 0.3*v(in)\nlet z = y + j(v(in))\n"
AC = "ac dec 3 10 10k\nlet h = v(out)/v(in)\n"

ONE_NUMBER_EACH = "mag magnitude ph phase cph cphase unwrap j real re pos exp abs sin cos atan sinh cosh tanh floor ceil nint"
WHOLE = "length mean avg stddev vecmin minimum vecmax maximum norm sortorder integ deriv"


OF_POSITIVE = "log ln log10 sqrt db tan"
OF_COMPLEX = "mag ph cph re im real imag db exp log abs length mean sin cos norm"
OVER_FREQUENCY = "mag db ph cph group_delay re im length mean"

# one run of both programs for each: (what is set up, what is printed)
GROUPS = {
    "real": (SWEEP, [f"{name}(y)" for name in f"{ONE_NUMBER_EACH} {WHOLE}".split()]),
    "positive": (SWEEP, [f"{name}(mag(y)+0.1)" for name in OF_POSITIVE.split()]),
    "complex": (SWEEP, [f"{name}(z+2)" for name in OF_COMPLEX.split()]),
    "over frequency": (AC, [f"{name}(h)" for name in OVER_FREQUENCY.split()]),
    "of voltages": (AC, [f"{name}(out)" for name in ("vdb", "vm", "vp", "vr", "vi")]),
    "phases in degrees": (AC + "set units=degrees\n", ["ph(h)", "cph(h)"]),
    "degrees": (SWEEP + "set units=degrees\n", [f"{name}(y)" for name in ("sin", "cos", "atan")]),
    "made": ("op\n", ["vector(4)", "unitvec(3)", "vector(1)", "length(vector(7))", "floor(vector(3)*0.7)"]),
}


@pytest.mark.parametrize("name", GROUPS)
def test_functions(name, tmp_path):
    first, texts = GROUPS[name]
    agree(RC, first + "\n".join(f"print {text}" for text in texts), tmp_path)


OPERATORS = [
    "y+1", "y-v(in)", "y*y", "y/2", "y^2", "2^3^2", "-2^2", "7%3", "7.9%3.2", "-y", "y=0",
    "y gt 0", "y lt 0", "y ge 0", "y le 0", "y eq 0", "y ne 0", "y and 1", "y or 0", "y & 1", "y | 0", "not y", "(1,2)",
    "(1,2)*(3,4)",    "(1,2)/(3,4)", "y[1]", "y[1,3]", "y[3,1]", "y[1+1]", "y[length(y)-1]", "v(in)[2]",
    "v(out)[0,1]", "1k+1meg", "3u*2", "1e-3",
    "v(in,out)", "v(out)-v(in) ", "max(y,0.5)", "min(y,0.5)", "(y+1)*(y-1)", "y*(1,1)", "mag(y*(0,1))", "2*v(out)+3*v(in)",
]  # fmt: skip


@pytest.mark.parametrize("third", range(3))
def test_operators(third, tmp_path):
    shown = "\n".join(f"let q{k} = {text}\nprint q{k}" for k, text in enumerate(OPERATORS[third::3]))
    agree(RC, SWEEP + shown, tmp_path)


def test_a_range_of_the_scale(tmp_path):
    agree(RC, f"{SWEEP}let q = y[[0,1.2]]\nprint length(q) mean(q)", tmp_path)


def test_interpolate_puts_a_vector_on_the_current_scale(tmp_path):
    agree(RC, "dc v1 0 2 1\ndc v1 0 2 0.25\nlet q = interpolate(dc1.v(out))\nprint q", tmp_path)


def test_random_vectors_have_the_length_and_the_spread_that_ngspice_s_have(tmp_path):
    """Numbers differ; their mean over many does not."""
    names = ["sgauss", "sunif", "rnd", "poisson", "exponential"]
    commands = [
        f"let n = {f}(5 + 0*vector(20000))\nlet m = mean(n)\nlet s = stddev(n)\nprint length(n) m s"
        for f in names
    ]
    agree(RC, "\n".join(commands), tmp_path, within=0.05, small=0.06)

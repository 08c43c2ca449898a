"""Ctrl-C ends whatever goes on, within a fifth of a second of computing time, and what was recorded is kept.

A timer of computing time stands for the key: its signal comes at the same places however busy the machine is.
"""

from __future__ import annotations

import gc
import signal
import time

import pytest

import emsim
from emsim import _engine

pytestmark = pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="no timer of computing time")
MOMENTS = [0.002 * 1.5**k for k in range(10)]  # s of computing
LATE = 0.2
METHODS = ("auto", "trap", "gear", "trbdf2", "esdirk", "radau", "gauss", "rk45", "dop853")

TANK = """a tank and a pendulum
.options {options}
.gravity 100
BODY  arm   m=1 com=(1,0) j=0
JOINT hinge 0 arm pin zero=-90deg ic=30deg
L1 a b 51.7n
R1 b 0 1p
C1 a 0 1p IC=1
.tran 20m 1e5 uic
.end
"""
PENDULUM = """a pendulum
.options {options}
BODY  arm   m=1 com=(1,0) j=0
JOINT hinge 0 arm pin zero=-90deg ic=30deg
.tran 10m 1e5
.end
"""
CHAIN = "\n".join([
    "a chain in coordinates of bodies", ".options formulation=absolute", ".gravity 9.81",
    "BODY b0 m=1 com=(1,0)", "JOINT j0 0 b0 pin ic=0.1",
    *(f"BODY b{k} m=1 com=(1,0)\nJOINT j{k} b{k - 1}(1,0) b{k} pin ic=0.1" for k in range(1, 40)), ".tran 1 1e4", ".end", "",
])  # fmt: skip
MANY = "\n".join(["a grid of diodes", "V1 n0 0 SIN(0 5 1k)", *(
    f"R{k} n{k} n{k + 1} 1k\nD{k} n{k + 1} 0 d\nC{k} n{k} 0 1n" for k in range(300)
), ".model d D(is=1f rs=1 cjo=1p)", "{analysis}", ".end", ""])  # fmt: skip
LOOP = """`include "disciplines.vams"
module m(p, n); inout p, n; electrical p, n; real x; integer i;
  analog begin
    x = 0;
    for (i = 0; i < 100000; i = i + 1) x = x + sin(x + V(p, n));
    I(p, n) <+ x / 1k;
  end
endmodule
"""
CASES = {
    **{f"pendulum, {m}": PENDULUM.format(options=f"method={m}") for m in METHODS},

    "multirate": TANK.format(options="method=multirate reltol=1e-4"),
    "chain, absolute": CHAIN,
    "transient of many": MANY.format(analysis=".tran 1 1e4\n.options maxsteps=1e12"),
    "sweep of many": MANY.format(analysis=".dc V1 0 5 1u"),
    "small signals of many": MANY.format(analysis=".ac lin 400000 1 1meg\n.save v(n1)"),
    "a loop of Verilog-A": 't\n.hdl "loop.va"\nV1 a 0 1\nN1 a 0 mm\n.model mm m\n.op\n.end\n',
}  # fmt: skip


class Key:
    """Ctrl-C after so much computing. Python drops what a handler raises within a callback of its garbage collector (hypothesis
    sets one), so nothing is collected meanwhile; and a run that did not hear would end before memory does."""

    def __init__(self, seconds: float) -> None:
        self.due = time.process_time() + seconds
        self.seconds = seconds

    def __enter__(self) -> Key:
        gc.disable()
        self.before = signal.signal(signal.SIGPROF, signal.default_int_handler)
        signal.setitimer(signal.ITIMER_PROF, self.seconds)
        return self

    def __exit__(self, *_: object) -> None:
        self.late = time.process_time() - self.due
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, self.before)
        gc.enable()


@pytest.mark.parametrize("case", CASES)
def test_ctrl_c_at_ten_moments(case, scratch):
    (scratch / "loop.va").write_text(LOOP)
    for moment in MOMENTS:
        key = Key(moment)
        with pytest.raises(KeyboardInterrupt), key:
            emsim.run(CASES[case])
        assert key.late < LATE, f"{key.late:.2f} s after {moment:.3f} s"


def test_what_was_computed_before_is_kept():
    with pytest.raises(emsim.Interrupted) as caught, Key(0.4):
        emsim.run(CASES["multirate"])
    result = caught.value.partial
    assert result.status == "interrupted" and len(result.main) > 100


def test_what_runs_next_is_not_ended():
    with pytest.raises(KeyboardInterrupt), Key(0.05):
        emsim.run(CASES["pendulum, auto"])
    assert emsim.run(PENDULUM.format(options="").replace("1e5", "1")).status == "ok"


def test_a_panic_is_an_exception_like_others():
    """It was none: a net of `except Exception` let it through."""
    b = _engine.Builder()
    with pytest.raises(Exception) as caught:
        b.eval([b.wave_expr(999)], [], 0.0)
    assert isinstance(caught.value, _engine.Panic)


@pytest.mark.parametrize(
    "entry", [emsim.run, emsim.check, emsim.compile, lambda text: emsim.Deck(text).run()]
)
def test_a_panic_in_the_engine_is_told_with_a_diagnostic(entry, monkeypatch):
    from emsim import pipeline
    from emsim.diagnostics import InternalError

    def panics(*_: object, **__: object) -> None:
        b = _engine.Builder()
        b.eval([b.wave_expr(999)], [], 0.0)

    for name in ("flatten", "prepare"):
        monkeypatch.setattr(pipeline, name, panics)
    with pytest.raises(InternalError) as caught:
        entry("t\nV1 a 0 1\nR1 a 0 1k\n.op\n.end\n")
    assert [d.code for d in caught.value.diagnostics] == ["E499"]

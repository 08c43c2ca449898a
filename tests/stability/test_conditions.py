"""Conditions and switches: what their text says at every instant, thresholds that are met exactly included.

The right values of the named decks are closed forms or ngspice 39's; the random networks are compared with an evaluation of
their own text (conditional_networks.py).
"""

from __future__ import annotations

import math
import subprocess

import numpy as np
import pytest
from conditional_networks import GRID, ROWS, SPAN, network
from support import needs_ngspice, run

import emsim

METHODS = ["auto", "trap", "gear", "radau", "trbdf2", "esdirk", "dop853"]


def sampled(text: str, name: str, times: list[float], method: str) -> list[float]:
    r = run(text, f"method={method}")
    assert not [d for d in r.diagnostics if d.code in ("W404", "W405")], r.diagnostics
    return [float(r.at(name, t)) for t in times]


PULSE = "Vd d 0 PULSE(0 1 2m 1u 1u 2m 5m)\n"
RETURNS = [1e-3, 2.5e-3, 4.5e-3, 7.5e-3, 9.5e-3]  # low, high, low, high, low
LH = [-5, 5, -5, 5, -5]
HL = [5, -5, 5, -5, 5]

# a gate on PULSE(0 1), which returns to exactly its threshold
GATES = {
    "above": ("B1 o 0 V=v(d)>0 ? 5 : -5", LH),
    "not above": ("B1 o 0 V=!(v(d)>0) ? 5 : -5", HL),
    "at most": ("B1 o 0 V=v(d)<=0 ? 5 : -5", HL),
    "equal": ("B1 o 0 V=v(d)==0 ? 5 : -5", HL),
    "not equal": ("B1 o 0 V=v(d)!=0 ? 5 : -5", LH),
    "bare": ("B1 o 0 V=v(d) ? 5 : -5", LH),
    "not bare": ("B1 o 0 V=!v(d) ? 5 : -5", HL),
    "reaches its plateau": ("B1 o 0 V=v(d)>=1 ? 5 : -5", LH),
    "equals its plateau": ("B1 o 0 V=v(d)==1 ? 5 : -5", LH),
    "never above its plateau": ("B1 o 0 V=v(d)>1 ? 5 : -5", [-5] * 5),
    "below its plateau": ("B1 o 0 V=v(d)<1 ? 5 : -5", HL),
    "if()": ("B1 o 0 V=if(v(d)>0, 5, -5)", LH),
    "u()": ("B1 o 0 V=10*u(v(d)-1e-9)-5", LH),
    "sgn()": ("B1 o 0 V=10*sgn(v(d))-5", LH),
    "E": ("E1 o 0 vol='v(d)>0 ? 5 : -5'", LH),
    "G": ("G1 0 o cur='v(d)>0 ? 5m : -5m'", LH),
    "R": ("Vp p 0 10\nVm m 0 -10\nRa p o R={v(d)>0 ? 1k : 3k}\nRb o m R={v(d)>0 ? 3k : 1k}\n.model x d", LH),
    ".func": (".func g(x)={x>0 ? 5 : -5}\nB1 o 0 V={g(v(d))}", LH),
    "subcircuit": (".subckt g i o\nB1 o 0 V=v(i)>0 ? 5 : -5\n.ends\nX1 d o g", LH),
    "of a sum": ("B1 o 0 V=v(d)+2.5>2.5 ? 5 : -5", LH),
    "of a difference": ("Ve e 0 PULSE(3 4 2m 1u 1u 2m 5m)\nB1 o 0 V=v(e)-v(d)==3 ? 5 : -5", [5] * 5),
    "through another source": ("B0 q 0 V=v(d)>0 ? 1 : 0\nB1 o 0 V=v(q) ? 5 : -5", LH),
    "of 0 and 1": ("B0 q 0 V=v(d)>0\nB1 o 0 V=v(q)==1 ? 5 : -5", LH),
    "of a divider": ("Ra d q 1k\nRb q 0 1k\nB1 o 0 V=v(q)>=0.5 ? 5 : -5", LH),
    "of a bridge": (
        "Vm m 0 PULSE(0 -1 2m 1u 1u 2m 5m)\nVt t 0 PULSE(0 3 2m 1u 1u 2m 5m)\nVu u 0 PULSE(0 -3 2m 1u 1u 2m 5m)\n"
        "Ra t q 3k\nRb q u 3k\nB1 o 0 V=v(q)==0 && v(d)+v(m)==0 ? (v(d)>0 ? 5 : -5) : 0", LH,
    ),
}  # fmt: skip


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("gate", GATES)
def test_a_condition_ends_where_its_operand_arrives_at_the_threshold(gate, method):
    """v(d)>0 stayed true for ever behind a pulse that returns to exactly 0: only a change of sign was an event."""
    lines, right = GATES[gate]
    load = "Ro o 0 1k" if gate != "R" else ""
    text = f"{gate}\n{PULSE}{lines}\n{load}\n.tran 50u 10m\n.end\n"
    assert sampled(text, "v(o)", RETURNS, method) == pytest.approx(right, abs=1e-6)


@pytest.mark.parametrize("method", METHODS)
def test_a_capacitance_and_a_force_follow_conditions_at_their_threshold(method):
    """i = C dv/dt of a ramp tells C; the rate of a slider tells FORCE."""
    text = f"C\n{PULSE}V1 a 0 PWL(0 0 10m 10)\nC1 a 0 C={{v(d)>0 ? 2u : 1u}}\n.tran 50u 10m\n.end\n"
    assert sampled(text, "i(v1)", RETURNS, method) == pytest.approx(
        [-1e-3, -2e-3, -1e-3, -2e-3, -1e-3], rel=1e-3
    )


def test_a_force_ends_where_its_condition_arrives_at_the_threshold():
    """2 m/s^2 while the pulse is up, twice 2 ms."""
    machine = "BODY b m=1\nJOINT s 0 b slide axis=(1,0)\nFORCE f b(0,0) fx={v(d)>0 ? 2 : 0} fy=0\n"
    text = f"F\n{PULSE}R1 d 0 1k\n{machine}.tran 50u 10m\n.end\n"
    r = run(text)
    assert float(r.at("vel(s)", 10e-3)) == pytest.approx(2 * 4.002e-3, rel=1e-3)


@pytest.mark.parametrize("method", METHODS)
def test_a_phase_detector_sees_its_clock_go_down(method):
    """0.2141 V by ngspice; the chopper stayed at one side of the sine."""
    text = """chopper
Vclk clk 0 PULSE(0 1 0 10n 10n 0.49u 1u)
Vs s 0 SIN(0 0.5 1meg 0 0 45)
Bx x 0 V={v(clk)>0 ? v(s) : -v(s)}
R1 x y 10k
C1 y 0 1n
.tran 10n 100u
.end
"""
    assert sampled(text, "v(y)", [99e-6], method)[0] == pytest.approx(0.2141, abs=2e-3)


# -- conditions of conditions ------------------------------------------------------------------------

SINE = "V1 a 0 SIN(0 2 100)\n"
THIRTY = math.asin(0.5) / (2 * math.pi * 100)  # s: 2 sin reaches 1


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    "condition", ["!(v(a)>1)", "v(a)<=1", "!(!(!(v(a)>1)))", "~(v(a)>1)", "(v(a)>1)==0", "(v(a)>1)<1", "if(v(a)>1,0,1)",
                  "!(v(a)>1 && v(a)>0)", "(v(a)>1)+(v(a)>0)<2", "!((v(a)>1) & 1)", "(v(a)<=1) | 0", "(v(a)>1)!=1"],
)  # fmt: skip
def test_a_condition_of_a_condition_is_what_its_text_says(condition, method):
    """!(v(a)>1) was a flag of its own that got stuck after the first change."""
    text = f"t\n{SINE}B1 o 0 V={{{condition} ? 5 : -5}}\nR1 o 0 1k\n.tran 10u 20m\n.end\n"
    r = run(text, f"method={method}")
    t, v, a = (np.asarray(r[n]) for n in ("time", "v(o)", "v(a)"))
    edges = np.array([THIRTY, 5e-3 - THIRTY, 10e-3 + THIRTY, 15e-3 - THIRTY])
    clear = np.abs(t[:, None] - edges).min(axis=1) > 2e-6
    assert v[clear] == pytest.approx(np.where(a[clear] > 1, -5.0, 5.0), abs=1e-9) and clear.sum() > 100


@pytest.mark.parametrize("method", METHODS)
def test_exclusive_or_by_not_equal(method):
    text = """xor
v1 a 0 pulse(0 5 10u 1n 1n 10u 40u)
v2 b 0 pulse(0 5 15u 1n 1n 20u 80u)
b1 x 0 v={((v(a)>2.5) != (v(b)>2.5)) ? 5 : 0}
b2 y 0 v={((v(a)>2.5) == (v(b)>2.5)) ? 5 : 0}
b3 z 0 v={(v(a)>2.5) + (v(b)>2.5) == 1 ? 5 : 0}
b4 p 0 v={v(a)>2.5}
b5 q 0 v={v(b)>2.5}
b6 w 0 v={v(p) != v(q) ? 5 : 0}
r1 x 0 1k
r2 y 0 1k
r3 z 0 1k
r4 p 0 1k
r5 q 0 1k
r6 w 0 1k
.tran 1u 80u
.end
"""
    times = [5e-6, 12e-6, 17e-6, 22e-6, 40e-6, 55e-6, 70e-6]
    r = run(text, f"method={method}")
    for name, right in (("v(x)", 5), ("v(y)", 0), ("v(z)", 5), ("v(w)", 5)):
        expected = [right if k % 2 else 5 - right for k in range(7)]
        assert [float(r.at(name, t)) for t in times] == pytest.approx(expected, abs=1e-6), name


@pytest.mark.parametrize("method", METHODS)
def test_a_latch_of_crossed_gates_holds(method):
    """Two NOR gates that read each other, set at 10 us, reset at 50 us, and both asked at 70 us: let go together, one wins."""
    text = """latch
vs s 0 pulse(0 5 10u 1u 1u 5u 60u)
vr r 0 pulse(0 5 50u 1u 1u 5u 20u)
b1 q 0 v={(v(r)>2.5 || v(p)>2.5) ? 0 : 5}
b2 p 0 v={(v(s)>2.5 || v(q)>2.5) ? 0 : 5}
r1 q 0 1k
r2 p 0 1k
.tran 1u 90u
.end
"""
    r = run(text, f"method={method}")
    assert [float(r.at("v(q)", t)) for t in (20e-6, 45e-6, 60e-6, 73e-6)] == pytest.approx(
        [5, 5, 0, 0], abs=1e-6
    )
    q, p = float(r.at("v(q)", 85e-6)), float(r.at("v(p)", 85e-6))
    assert sorted((q, p)) == pytest.approx([0, 5], abs=1e-6)


HOLDS = {
    "its output through a resistor": "bq n 0 v={ v(r)>2 ? 0 : v(s)>2 ? 5 : v(q) }\nrq n q 1k",
    "its own node": "bq q 0 v={ v(r)>2 ? 0 : v(s)>2 ? 5 : v(q) }",
    "its output behind an RC": "bq n 0 v={ v(r)>2 ? 0 : v(s)>2 ? 5 : v(q) }\nrq n q 1k\ncq q 0 100p",
    "by if()": "bq q 0 v={ if(v(r)>2, 0, if(v(s)>2, 5, v(q))) }\nrq q 0 1k",
    "two stages": "bp p 0 v={ v(r)>2 ? 0 : v(s)>2 ? 5 : v(p) }\nbq q 0 v={ v(p)>2 ? 5 : 0 }",
    "E": "eq q 0 vol='v(r)>2 ? 0 : v(s)>2 ? 5 : v(q)'",
}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("how", HOLDS)
def test_a_latch_holds_its_own_output(how, method):
    """v(q) = v(q) says nothing: the run ended at its start, for nothing determined the current of `bq`."""
    sources = "vs s 0 pulse(0 5 10u 1u 1u 5u 100u)\nvr r 0 pulse(0 5 50u 1u 1u 5u 100u)\n"
    text = f"latch\n{sources}{HOLDS[how]}\n.tran 1u 150u\n.end\n"
    values = sampled(text, "v(q)", [5e-6, 14e-6, 30e-6, 49e-6, 60e-6, 105e-6, 130e-6], method)
    assert values == pytest.approx([0, 5, 5, 5, 0, 0, 5], abs=1e-3)


def test_conditions_that_contradict_each_other_are_an_error_and_no_hang():
    from emsim.diagnostics import ConvergenceError

    text = "t\nV1 a 0 PULSE(0 1 1m 1u 1u 5m 10m)\nB1 x 0 V={v(a)>0.5 && v(x)<0.5 ? 1 : 0}\nR1 x 0 1k\n.tran 10u 2m\n.end\n"
    with pytest.raises(ConvergenceError, match="E418"):
        run(text)


def test_what_slides_along_its_threshold_is_followed_and_said():
    """An oscillator without hysteresis has no period: its capacitor stays at the threshold."""
    oscillator = "B1 x 0 V={v(a)>0.5 && v(y)<0.5 ? 1 : 0}\nR1 x y 1k\nC1 y 0 100n\n"
    text = f"t\nV1 a 0 PULSE(0 1 1m 1u 1u 5m 10m)\n{oscillator}.tran 10u 2m\n.end\n"
    for method in METHODS:
        r = run(text, f"method={method}")
        assert float(r.at("v(y)", 1.9e-3)) == pytest.approx(0.5, abs=0.01), method
        assert [d.code for d in r.diagnostics] == ["W405"], method


def test_a_limit_holds_that_turns_again_and_again():
    """An amplifier with positive feedback between 0 and its rising supply swings a dozen times a microsecond. Its limits were
    held as they stood for 4 us of a run of 40 ms, which took v(o) to 2.7e97 V behind min(.., 0.3 mV), and E412."""
    session = emsim.Session(
        "limits\nVdd vdd 0 PULSE(0 3 0 20m 0 1 2)\nE1 o 0 VALUE={max(min(2000*(v(p)-v(m)),v(vdd)),0)}\nRo o g 1k\n"
        "Co g 0 100p\nR1 g m 100k\nR2 g p 100k\nQ1 0 0 m qp 1\nR3 p x 10k\nQ2 0 0 x qp 8\nRs vdd g 5meg\n"
        ".model qp PNP(is=1e-16 bf=50 cje=1p cjc=1p)\n.tran 0.1u 40m\n.end\n",
        outputs=["v(o)", "v(vdd)"],
    )
    for k in range(1, 201):
        session.run(k * 1e-7)
        assert -1e-5 < session["v(o)"] <= session["v(vdd)"] + 1e-5
    assert session.time == pytest.approx(2e-5)


def test_thirty_gates_in_a_row_settle_at_one_time():
    """More gates than rounds of flips were allowed at one event."""
    gates = "".join(f"B{k} n{k} 0 V={{v(n{k - 1})>0.5 ? 0 : 1}}\nR{k} n{k} 0 1k\n" for k in range(1, 31))
    text = f"chain\nV0 n0 0 PULSE(0 1 1u 1n 1n 1u 2u)\n{gates}.tran 10n 4u\n.end\n"
    assert sampled(text, "v(n30)", [0.5e-6, 1.5e-6, 2.5e-6, 3.5e-6], "auto") == pytest.approx(
        [0, 1, 0, 1], abs=1e-9
    )


# -- switches ----------------------------------------------------------------------------------------

SWITCHES = {  # control, model, instance; on at RETURNS; all as ngspice 39 has them
    "vt=0 on PULSE(0 1)": ("PULSE(0 1 2m 1u 1u 2m 5m)", "", "", [1, 1, 0, 1, 0]),
    "vt=0 on PULSE(1 0)": ("PULSE(1 0 2m 1u 1u 2m 5m)", "", "", [1, 0, 1, 0, 1]),
    "vt=0 on PULSE(0 -1)": ("PULSE(0 -1 2m 1u 1u 2m 5m)", "", "", [1, 0, 1, 0, 1]),
    "vt=5 on PULSE(0 5)": ("PULSE(0 5 2m 1u 1u 2m 5m)", "vt=5", "", [0, 1, 0, 1, 0]),
    "vt=5 vh=1 on PULSE(0 6)": ("PULSE(0 6 2m 1u 1u 2m 5m)", "vt=5 vh=1", "", [0, 0, 0, 0, 0]),
    "off": ("PULSE(0 1 2m 1u 1u 2m 5m)", "", "off", [1, 1, 0, 1, 0]),
    "from both sides": (
        "PWL(0 0 1.5m 5 2m 5 3m 6 4m 5 5m 5 6m 0 7m 5 8m 5 9m 0)",
        "vt=5",
        "",
        [0, 1, 0, 1, 0],
    ),
}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("letter", ["S", "W"])
@pytest.mark.parametrize("case", SWITCHES)
def test_a_switch_turns_where_its_control_arrives_at_its_threshold(case, letter, method):
    """On for ever after PULSE(0 1), never on at PULSE(0 5)."""
    wave, model, instance, right = SWITCHES[case]
    control, kind = ("d 0", "sw") if letter == "S" else ("vd", "csw")
    model = model.replace("v", "i") if letter == "W" else model
    drive = f"Vd d 0 {wave}\n" if letter == "S" else f"Id 0 d {wave}\nVd d 0 0\n"
    text = f"t\n{drive}V1 a 0 5\nR1 a o 1k\n{letter}1 o 0 {control} m {instance}\n.model m {kind}({model} ron=1 roff=1meg)\n"
    on, off = 5 * 1 / 1001, 5 * 1e6 / 1.001e6
    values = sampled(text + ".tran 50u 10m\n.end\n", "v(o)", RETURNS, method)
    assert values == pytest.approx([on if r else off for r in right], rel=1e-6)


def test_a_switch_at_its_threshold_begins_a_run_from_given_values_as_its_card_says():
    for word, right in (("", [0, 1, 0, 1, 0]), ("on", [1, 1, 0, 1, 0])):
        text = f"t\n{PULSE}V1 a 0 5\nR1 a o 1k\nS1 o 0 d 0 m {word}\n.model m sw(ron=1 roff=1meg)\n.tran 50u 10m uic\n.end\n"
        values = sampled(text, "v(o)", RETURNS, "auto")
        assert [round(v) for v in values] == [0 if r else 5 for r in right]


# -- sources of time alone ---------------------------------------------------------------------------

CHARGE = 1e-3 * 20e-6 * math.sqrt(math.pi)  # A s, of 1 mA exp(-(t/20us)^2)
BELLS = {
    "B": ("B1 0 a I={1m*exp(-((time-3.3m)/20u)^2)}", 1.0),
    "narrow": ("B1 0 a I={20*exp(-((time-3.3m)/1n)^2)}", 1.0),
    "small beside large": ("B1 0 a I={1m*exp(-((time-3.3m)/20u)^2)+10u*exp(-((time-7.7m)/1u)^2)}", 1.0005),
    "of a ramp": ("Vt t 0 PWL(0 0 10m 10m)\nB1 0 a I={1m*exp(-((v(t)-3.3m)/20u)^2)}", 1.0),
    "a resistance": ("Vp p 0 1k\nRp p a R={1meg+1t*(1-exp(-((time-3.3m)/20u)^2))}\n.tran 10u 10m", None),
    "a condition": (f"B1 0 a I={{exp(-((time-3.3m)/20u)^2)>0.9 ? {math.sqrt(math.pi / -math.log(0.9)) / 2:.15g}*1m : 0}}", 1.0),
    "a burst": ("B1 0 a I={1m*exp(-((time-3.3m)/20u)^2)*(1+sin(2*pi*1meg*(time-3.3m)))}", 1.0),
    "cosh": ("B1 0 a I={1m*sqrt(pi)/2/cosh((time-3.3m)/20u)^2}", 1.0),
}  # fmt: skip


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("bell", [b for b in BELLS if BELLS[b][1] is not None])
def test_a_pulse_of_time_alone_is_not_stepped_over(bell, method):
    """35.449 V: charge over capacitance. Every method with long steps ended at 0 V."""
    lines, share = BELLS[bell]
    r = run(f"bell\n{lines}\nC1 a 0 1n\nR1 a 0 1t\n.tran 10u 10m\n.end\n", f"method={method} reltol=1e-4")
    assert float(r["v(a)"][-1]) == pytest.approx(CHARGE / 1e-9 * share, rel=2e-3)


@pytest.mark.parametrize("method", METHODS)
def test_a_resistance_of_time_alone_is_not_stepped_over(method):
    """1 V over 1 kohm at the top of the bell, 1 Gohm beside it, into a capacitor: the charge by a sum."""
    t = np.linspace(-400e-6, 400e-6, 800001)
    charge = np.trapezoid(1 / (1e3 + 1e9 * (1 - np.exp(-((t / 20e-6) ** 2)))), t) + (10e-3 - 800e-6) / 1e9
    text = "t\nV1 a 0 1\nR1 a b R={1k+1g*(1-exp(-((time-3.3m)/20u)^2))}\nC1 b 0 1u\n.tran 10u 10m uic\n.end\n"
    right = 1e6 * charge  # far below 1 V
    assert float(run(text, f"method={method} reltol=1e-5")["v(b)"][-1]) == pytest.approx(right, rel=1e-2)


# -- every flag is checked ---------------------------------------------------------------------------


STUCK = {
    "a pulse": f"t\n{PULSE}B1 o 0 V={{v(d)>0.5 ? 5 : -5}}\nR1 o 0 1k\n.tran 50u 10m\n.end\n",
    "a switch": "t\nV1 d 0 SIN(0 1 1k)\nS1 d o d 0 m\nR1 o 0 1k\n.model m sw(vt=0.5)\n.tran 10u 2m\n.end\n",
    "at its threshold": f"t\n{PULSE}B1 o 0 V={{v(d)>0 ? 5 : -5}}\nR1 o 0 1k\nB2 p 0 V={{v(o)>0}}\n.tran 50u 10m\n.end\n",
}


@pytest.mark.parametrize("deck", STUCK.values(), ids=STUCK)
@pytest.mark.parametrize("method", METHODS)
def test_a_flag_that_does_not_turn_is_told(deck, method, monkeypatch):
    """A flag that is kept from turning, on purpose: the check of every flag at every row names its condition."""
    import emsim.assemble.options as options

    honest = run(deck, f"method={method}")
    assert not [d for d in honest.diagnostics if d.code == "W404"]
    resolve = options.resolve
    monkeypatch.setattr(options, "resolve", lambda *a, **k: {**resolve(*a, **k), "stuck_flag": 0})
    told = [d for d in run(deck, f"method={method}").diagnostics if d.code == "W404"]
    assert told and told[0].span is not None


# -- random networks ---------------------------------------------------------------------------------

NETWORKS = 60
# found among the first thousand: a plateau that a run stood a few roundings before, a switch that starts at a threshold below 0,
# a comparison whose other side jumps as it turns, a touch between two plateaus
FOUND = [151, 208, 215, 218, 238, 296, 346, 392, 466, 568, 668, 686, 719, 842, 859, 894, 961]


@pytest.mark.parametrize("seed", [*range(NETWORKS), *FOUND])
def test_random_networks_of_conditions_are_what_their_text_says(seed, record_property):
    net = network(seed)
    rows = net.quiet_rows()
    if not len(rows):
        return
    times, right = net.reference
    at = {name: np.interp(rows * GRID, times, v) for name, v in right.items()}
    scale = max(np.ptp(right["lp"]), 0.1)
    wrong = []
    for method in METHODS:
        r = run(net.deck(), f"method={method}")
        told = [d for d in r.diagnostics if d.code in ("W404", "W405")]
        assert not told, (method, told, net.deck())
        for name in net.columns():
            values = np.asarray(r.at(f"v({name})", rows * GRID))
            tolerance = max(0.02 * scale, 0.01) if name == "lp" else 1e-4
            off = np.abs(values - at[name])
            if off.max() > tolerance:
                k = int(off.argmax())
                wrong.append(
                    f"{method}: v({name}) {values[k]:.5g}, not {at[name][k]:.5g} at {rows[k] * GRID:g} s"
                )
    record_property("values", len(rows) * len(net.columns()) * len(METHODS))
    assert not wrong, "\n".join([*wrong, net.deck()])


@needs_ngspice
@pytest.mark.parametrize("seed", range(0, NETWORKS, 5))
def test_ngspice_agrees_with_the_reference(seed, tmp_path):
    """The reference is no opinion of ours: the same networks under ngspice."""
    net = network(seed)
    rows = net.quiet_rows()
    if not len(rows):
        return
    times, right = net.reference
    names = net.columns()
    control = (
        f".control\nrun\nset wr_singlescale\nwrdata out.txt {' '.join(f'v({n})' for n in names)}\n.endc\n"
    )
    (tmp_path / "deck.cir").write_text(net.deck().replace(".end\n", control + ".end\n"))
    subprocess.run(["ngspice", "-b", "deck.cir"], cwd=tmp_path, capture_output=True, timeout=60, check=False)
    table = np.loadtxt(tmp_path / "out.txt")
    for k, name in enumerate(names, 1):
        values = np.interp(rows * GRID, table[:, 0], table[:, k])
        expected = np.interp(rows * GRID, times, right[name])
        assert np.abs(values - expected).max() < (0.05 * 5 if name == "lp" else 1e-3), name


def test_the_random_networks_meet_their_thresholds():
    """What is compared: how many networks, rows, and plateaus on a threshold."""
    met = compared = 0
    for seed in range(NETWORKS):
        net = network(seed)
        compared += len(net.quiet_rows()) * len(net.columns())
        met += sum(f"{v:g}" in net.deck() for s in net.sources for v in s.values)
    print(
        f"{NETWORKS} networks, {compared} values for each of {len(METHODS)} methods; span {SPAN:g} s, {ROWS} rows"
    )
    assert compared > 5000 and met > 100

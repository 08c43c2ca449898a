"""emsim.Session: a run that Python leads from step to step, beside closed forms and runs of the whole deck."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from math import exp, pi, sin

import numpy as np
import pytest

import emsim

RC = "an RC\nV1 a 0 1\nR1 a b 1k\nC1 b 0 1u\n.options reltol=1e-8\n.tran 1u 10m uic\n.end\n"
CART = """a pole on a cart
.gravity 9.81
BODY cart m=1
JOINT rail 0 cart slide axis=(1,0)
BODY pole m=0.1 com=(0,0.5)
JOINT hinge cart pole pin ic=3deg
FORCE push cart dir=(1,0) {push}
.options reltol=1e-9
.tran 1m 10
.print tran angle(hinge) omega(hinge) pos(rail) vel(rail)
.end
"""
SHOWN = ["angle(hinge)", "omega(hinge)", "pos(rail)", "vel(rail)"]


def feedback(angle, omega, pos, vel):
    return -40.0 * angle - 8.0 * omega + pos + 2.0 * vel


def test_inputs_jump_and_run_along_lines_and_parts_change():
    s = emsim.Session(RC, "v1", ["v(b)", "i(r1)"], tunables="r1")
    assert s.inputs == ("v1", "r1") and s.outputs == ("v(b)", "i(r1)") and s.units["v(b)"] == "V"
    assert s.time == 0.0 and s["v(b)"] == pytest.approx(0.0, abs=1e-12) and s["R1"] == 1e3
    s.step(1e-3)
    assert s["v(b)"] == pytest.approx(first := 1.0 - exp(-1.0), rel=1e-7)
    s["r1"] = 2e3
    s.step(1e-3)
    assert s["v(b)"] == pytest.approx(second := 1.0 - (1.0 - first) * exp(-0.5), rel=1e-7)
    s.set("v1", 1.0, slope=1e3)  # 1 V/ms: behind it lags by tau times the slope
    s.run(3e-3)
    lag = 2e-3 * 1e3
    assert s["v(b)"] == pytest.approx(2.0 - lag + (second - 1.0 + lag) * exp(-0.5), rel=1e-7)
    assert s["v1"] == pytest.approx(2.0) and s.time == pytest.approx(3e-3)
    assert s.values() == {name: s[name] for name in s.outputs}


def test_conditions_of_an_input_turn_where_its_line_crosses():
    deck = "t\nV1 in 0 0\nB1 out 0 V={v(in)>0.5 ? 1 : 0}\nR1 out c 1k\nC1 c 0 1u\n.options reltol=1e-6\n.tran 10u 20m\n.end\n"
    s = emsim.Session(deck, "v1", ["v(c)", "v(out)"])
    value = 0.0
    # where it is set, how fast it goes on [1/s], and for how many of the 1 ms the output is on, at the end or before it
    for at, slope, on, late in (
        (0.0, 1e3, 0.5, True),
        (0.2, 0.0, 0.0, True),
        (0.7, 0.0, 1.0, True),
        (0.7, -400.0, 0.5, False),
    ):
        s.set("v1", at, slope)
        s.step(1e-3)
        charged = 1.0 - exp(-on)
        value = value * exp(-1.0) + (charged if late else charged * exp(on - 1.0))
        assert s["v(c)"] == pytest.approx(value, rel=1e-6)


def test_a_controller_in_python_is_the_controller_of_the_deck():
    """Held over steps of 0.1 ms it is off by its delay, half a step."""
    gains = "{-40*angle(hinge)-8*omega(hinge)+pos(rail)+2*vel(rail)}"
    deck = emsim.run(CART.format(push=gains))
    s = emsim.Session(CART.format(push="0"), "push", SHOWN)
    angles = [s["angle(hinge)"]]
    for _ in range(20_000):
        s["push"] = feedback(*(s[name] for name in SHOWN))
        s.step(1e-4)
        angles.append(s["angle(hinge)"])
    times = np.arange(len(angles)) * 1e-4
    off = np.abs(np.array(angles) - deck.main.at("angle(hinge)", times)).max()
    assert off < 5e-5 and max(angles) > 0.05 and abs(angles[-1]) < 0.01


def test_steps_lead_where_a_whole_run_does():
    whole = emsim.run(CART.format(push="SIN(0 2 1.5)"))
    s = emsim.Session(CART.format(push="SIN(0 2 1.5)"), outputs=SHOWN)
    for k in range(1, 21):
        s.run(0.05 * k)
        for name in SHOWN:
            assert s[name] == pytest.approx(whole.main.at(name, s.time), rel=1e-6, abs=1e-8)


def test_a_state_is_gone_back_to():
    s = emsim.Session(CART.format(push="0"), "push", SHOWN)
    s.run(0.3)
    state, before = s.save(), s.values()
    found = []
    for push in (1.0, -1.0, 1.0):
        s.restore(state)
        assert s.time == 0.3 and s.values() == before and s["push"] == 0.0
        s["push"] = push
        s.step(0.2)
        found.append(s.values())
    assert found[0] == pytest.approx(found[2], rel=1e-9) and found[0]["pos(rail)"] > found[1]["pos(rail)"]


def test_reset_begins_anew_with_other_inputs():
    s = emsim.Session(RC, "v1", "v(b)", tunables=["c1"])
    s["v1"] = 5.0
    s.step(1e-3)
    first = s["v(b)"]
    s.reset()
    assert s.time == 0.0 and s["v1"] == 1.0
    s.step(1e-3)
    assert s["v(b)"] == pytest.approx(first / 5.0, rel=1e-7)
    s.reset(v1=2.0, c1=2e-6)
    s.step(1e-3)
    assert s["v(b)"] == pytest.approx(2.0 * (1.0 - exp(-0.5)), rel=1e-7)


def test_a_state_is_of_its_own_session():
    one, other = emsim.Session(RC, "v1", "v(b)"), emsim.Session(CART.format(push="0"), "push", SHOWN)
    with pytest.raises(ValueError, match="another session"):
        one.restore(other.save())


def test_many_run_at_once_in_threads():
    def swing(phase):
        s = emsim.Session(CART.format(push="0"), "push", SHOWN)
        for k in range(100):
            s["push"] = sin(phase + 0.02 * pi * k)
            s.step(0.01)
        return s.values()

    phases = [0.1 * k for k in range(8)]
    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(swing, phases)) == [swing(phase) for phase in phases]


@pytest.mark.parametrize(
    ("what", "kind", "said"),
    [
        (lambda s: s["v2"], KeyError, "did you mean 'v1'"),
        (lambda s: s.step(-1.0), ValueError, "a step goes forward, not by -1.0 s"),
        (lambda s: s.step(float("nan")), ValueError, "a step goes forward"),
        (lambda s: s.set("v(b)", 1.0), ValueError, "`v(b)` is an output"),
        (lambda s: s.set("v1", float("inf")), ValueError, "a finite number"),
        (lambda s: s.reset(v9=1.0), KeyError, "'v9'"),
    ],
)
def test_what_cannot_be_is_said(what, kind, said):
    s = emsim.Session(RC, "v1", "v(b)")
    with pytest.raises(kind) as caught:
        what(s)
    assert said in str(caught.value)
    s.step(1e-3)  # it goes on
    assert s["v(b)"] == pytest.approx(1.0 - exp(-1.0), rel=1e-7)


def test_a_run_that_fails_says_why_in_the_words_of_the_deck():
    """v' = v^2 from 1 is 1/(1 - t)."""
    s = emsim.Session("t\nB1 0 a I={v(a)*v(a)}\nC1 a 0 1\n.ic v(a)=1\n.tran 1m 2 uic\n.end\n", outputs="v(a)")
    s.step(0.5)
    assert s["v(a)"] == pytest.approx(2.0, rel=1e-3)
    with pytest.raises(emsim.ConvergenceError) as caught:
        s.step(1.0)
    s.reset()  # and can begin again
    s.step(0.5)
    assert s.time == 0.5 and s["v(a)"] == pytest.approx(2.0, rel=1e-3)
    (said,) = caught.value.diagnostics
    assert said.code[:2] == "E4" and "at `a`" in said.message and "t = 1.00000" in said.message


def test_what_a_run_has_to_say_is_told():
    s = emsim.Session("t\nB1 a 0 V={sqrt(1-time)}\nR1 a 0 1\n.tran 1m 2\n.end\n", outputs="v(a)")
    s.step(0.5)
    assert not s.diagnostics
    s.step(1.0)
    assert [d.code for d in s.diagnostics] == ["W402"] and "t = 1.0000" in s.diagnostics[0].message


def test_decks_that_cannot_be_led():
    for deck, code in ((RC.replace(".tran 1u 10m uic", ".op"), "E383"), (RC, "E381")):
        with pytest.raises(emsim.DeckError) as caught:
            emsim.Session(deck, "v1" if code == "E383" else "v7", "v(b)")
        assert [d.code for d in caught.value.diagnostics] == [code]

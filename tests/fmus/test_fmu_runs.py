"""FMUs beside the runs of their decks, by FMPy: equal to 1e-6 of the signal, with what drives them from outside."""

from __future__ import annotations

import ctypes
import gc
import mmap
import sys
import threading
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.validation import validate_fmu
from support import deck, values_at

import emsim
from emsim.fmus import export

NEAR = 1e-6
VERSIONS = pytest.mark.parametrize("version", [2, 3])

RC = """an RC, driven
V1 in 0 {source}
R1 in out 1k
C1 out 0 1u
.tran 10u 5m
.options reltol=1e-9
.fmu in=v1 out=v(out),i(v1)
.end
"""
RECTIFIER = """a half-wave rectifier with its load
V1 in 0 {source}
D1 in out dm
.model dm d(is=1n n=1.6 rs=0.1 cjo=10p)
C1 out 0 10u
R1 out 0 2k
.tran 50u 40m
.options reltol=1e-9
.fmu in=v1 out=v(out),v(in)-v(out)
.end
"""
SWITCHED = """a comparator turns a switch: events inside the steps
V1 in 0 {source}
R1 in out 1k
C1 out 0 1u
S1 out 0 out 0 sm
.model sm sw(vt=0.6 vh=0.3 ron=50 roff=1meg)
.tran 10u 10m
.options reltol=1e-9
.fmu in=v1 out=v(out)
.end
"""
SERVO = """an arm on a motor, held where a voltage says
.gravity 9.81
BODY   arm    shape=rod(0.30) m=0.20
JOINT  hinge  0 arm pin  zero=-90deg damp=2m
MOTOR  m1     drive 0 hinge  kt=20m r=2 l=1m j=2u gear=30
POT    p1     vp wip vn hinge  r=10k range=(-150deg,150deg)
TORQUE load   hinge tau={torque}
Vp     vp  0  5
Vn     vn  0  -5
Rload  wip 0  100k
Vset   set 0  {source}
Bamp   drive 0 V={{min(max(8*(v(set)-v(wip)), -12), 12)}}
.tran  1m 1
.options reltol=1e-9
.fmu in=vset,load out=angle(hinge),omega(hinge),i(m1),v(wip)
.end
"""


def written(folder: Path, text: str, version: int, **more: object) -> str:
    path = str(folder / f"model{version}.fmu")
    export(text, path, version, **more)  # type: ignore[arg-type]
    return path


def staircase(times: np.ndarray, values: np.ndarray) -> str:
    """PWL that holds each value until the next time: what a held input is."""
    points = [(times[0], values[0])]
    for t, before, after in zip(times[1:], values, values[1:], strict=False):
        points += [(t, before), (t, after)]
    return "PWL(" + " ".join(f"{t!r} {v!r}" for t, v in np.array(points).tolist()) + ")"


def lines(times: np.ndarray, values: np.ndarray) -> str:
    return "PWL(" + " ".join(f"{t!r} {v!r}" for t, v in np.column_stack([times, values]).tolist()) + ")"


def signals(times: np.ndarray, **columns: np.ndarray) -> np.ndarray:
    return np.rec.fromarrays([times, *columns.values()], names=["time", *columns])


def by_fmpy(path: str, given: np.ndarray | None, step: float, stop: float, **more: object) -> np.ndarray:
    return fmpy.simulate_fmu(
        path, stop_time=stop, output_interval=step, input=given, fmi_type="CoSimulation", **more
    )


def agree(found: np.ndarray, result: emsim.Result, names: list[str], near: float = NEAR) -> None:
    times = found["time"]
    for name in names:
        expected = values_at(result, name, times)
        size = np.abs(expected).max()
        assert size > 0
        assert np.abs(found[name] - expected).max() < near * size, name


@VERSIONS
def test_description_is_valid(tmp_path: Path, version: int) -> None:
    path = written(tmp_path, RC.format(source="1"), version)
    assert validate_fmu(path) == []
    model = fmpy.read_model_description(path)
    assert [(v.name, v.causality) for v in model.modelVariables] == [
        ("time", "independent"), ("v1", "input"), ("v(out)", "output"), ("i(v1)", "output"),
        ("stored(v(out))", "local"), ("der(stored(v(out)))", "local"),
    ]  # fmt: skip
    assert float(model.modelVariables[1].start) == 1.0
    assert model.defaultExperiment.stopTime == "0.005"
    units = {u.name: u.baseUnit for u in model.unitDefinitions}
    assert (units["V"].kg, units["V"].m, units["V"].s, units["V"].A) == (1, 2, -3, -1)


@VERSIONS
def test_rc_steps_as_its_deck(tmp_path: Path, version: int) -> None:
    """A jump at 1 ms, between two of the internal steps."""
    path = written(tmp_path, RC.format(source="0"), version)
    times = np.arange(0, 5.05e-3, 1e-4)
    values = np.where(times > 0.95e-3, 5.0, 0.0)
    found = by_fmpy(path, signals(times, v1=values), 1e-4, 5e-3)
    result = emsim.run(RC.format(source=staircase(times, values)))
    agree(found, result, ["v(out)"])
    # behind the jump in closed form: the input that FMPy interpolates is held from each point on
    t = found["time"]
    start = t[np.argmax(found["v(out)"] > 1e-9)] - 1e-4
    after = t > start
    exact = 5.0 * (1 - np.exp(-(t[after] - start) / 1e-3))
    assert np.abs(found["v(out)"][after] - exact).max() < 5 * NEAR


@VERSIONS
@pytest.mark.parametrize("text", [RC, RECTIFIER, SWITCHED], ids=["rc", "rectifier", "switch"])
def test_held_sine_as_its_deck(tmp_path: Path, version: int, text: str) -> None:
    stop = {RC: 5e-3, RECTIFIER: 40e-3, SWITCHED: 10e-3}[text]
    path = written(tmp_path, text.format(source="0"), version)
    times = np.linspace(0, stop, 201)
    values = 3.0 * np.sin(2 * np.pi * 2 / stop * times)
    found = by_fmpy(path, signals(times, v1=values), stop / 200, stop)
    result = emsim.run(text.format(source=staircase(times, values)))
    agree(found, result, ["v(out)"])


@VERSIONS
def test_servo_as_its_deck(tmp_path: Path, version: int) -> None:
    """Circuit and machine, a voltage and a torque from outside."""
    path = written(tmp_path, SERVO.format(source="0", torque="0"), version)
    times = np.linspace(0, 1, 101)
    volts, torque = np.where(times > 0.095, 1.0, 0.0), 0.2 * np.sin(2 * np.pi * 2 * times)
    found = by_fmpy(path, signals(times, vset=volts, load=torque), 0.01, 1.0)
    text = SERVO.format(source=staircase(times, volts), torque=staircase(times, torque))
    agree(found, emsim.run(text), ["angle(hinge)", "omega(hinge)", "v(wip)"])


@VERSIONS
def test_own_sources_run_on(tmp_path: Path, version: int) -> None:
    """What is not driven from outside keeps its waveform: edges, jumps and events of the deck's own."""
    text = deck("coupled/pendulum_servo")
    path = written(tmp_path, text, version, outputs="angle(hinge) i(m1) torque(m1)", options={"reltol": 1e-9})
    found = by_fmpy(path, None, 0.012, 1.5)
    agree(found, emsim.run(text, reltol=1e-9), ["angle(hinge)", "i(m1)", "torque(m1)"])


def test_a_parameter_is_set_before_the_run(tmp_path: Path) -> None:
    path = written(tmp_path, RC.format(source="1").replace("in=v1", "param=v1"), 3)
    found = by_fmpy(path, None, 1e-4, 5e-3, start_values={"v1": 4.0})
    assert found["v(out)"] == pytest.approx(4.0)  # it begins at rest


PARAMETERS = """parameters of every kind of reading
.param r=1k c={1m/r} gain=2 tq=0.1
.func half(x) {x/2}
.subckt part a b rr=1
R1 a b {rr}
.ends
V1 in 0 PULSE(0 1 0 1u 1u 1 2)
X1 in out part rr={half(2*r)}
C1 out 0 {c}
B1 amp 0 V={gain*v(out)}
L1 amp o2 {1m*gain}
R2 o2 0 10
BODY rotor m=1 j=1m
JOINT shaft 0 rotor pin
TORQUE t1 shaft tau={tq*gain}
.tran 10u 4m
.options reltol=1e-9
.fmu param=r,gain in=tq out=v(out),i(l1),omega(shaft)
.end
"""


@VERSIONS
def test_parameters_of_the_deck_as_by_define(tmp_path: Path, version: int) -> None:
    """.param values, by way of other parameters, functions and subcircuits, in R, C, L, B and a machine card: as with -D."""
    path = written(tmp_path, PARAMETERS, version)
    names = ["v(out)", "i(l1)", "omega(shaft)"]
    for given in ({}, {"r": 3e3, "gain": 5.0, "tq": -0.2}):
        found = by_fmpy(path, None, 4e-5, 4e-3, start_values=given)
        assert found["time"][-1] == pytest.approx(4e-3)
        text = PARAMETERS.replace(".fmu", "*").replace(".end\n", "")
        agree(found, emsim.run(text + ".print tran v(out) i(l1) omega(shaft)\n.end", defines=given), names)


def test_a_resistance_that_changes_while_the_model_runs(tmp_path: Path) -> None:
    text = RC.format(source="1").replace("10u 5m", "10u 5m uic")
    path = written(tmp_path, text, 3, inputs="r1")
    one = Slave(tmp_path, path)
    one.begin()
    one.step(0.0, 1e-3)
    one.set("r1", 2e3)
    one.step(1e-3, 2e-3)
    assert one.get("v(out)") == pytest.approx(1 - np.exp(-2), rel=1e-6)
    one.end()


TUNED = """everything that can be tuned, and a source that drives it
.param gain=2
V1 in 0 5
R1 in out 1k
C1 out 0 1u
Iset 0 coil 0.1
L1 coil 0 2m
R2 coil 0 10
B1 amp 0 V={gain*v(out)}
BODY rotor m=1 j=1m
JOINT shaft 0 rotor pin
TORQUE t1 shaft tau=0.1
.tran 10u 2m uic
.options reltol=1e-9
.fmu tune=gain,r1,c1,l1,t1 out=v(out),v(amp),i(l1),omega(shaft)
.end
"""


@VERSIONS
def test_tunable_parameters_change_between_steps(tmp_path: Path, version: int) -> None:
    """Closed forms behind the change: an RC of another time constant, its voltage as it was; a coil, its current; a torque."""
    path = written(tmp_path, TUNED, version)
    assert validate_fmu(path) == []
    model = fmpy.read_model_description(path)
    tunable = [v.name for v in model.modelVariables if v.variability == "tunable"]
    assert tunable == ["gain", "r1", "c1", "l1", "t1"]
    one = Slave(tmp_path, path)
    one.begin()
    one.step(0.0, 1e-3)
    v, i = 5 * (1 - np.exp(-1)), 0.1 * (1 - np.exp(-5))
    assert one.get("v(out)") == pytest.approx(v, rel=NEAR)
    assert one.get("i(l1)") == pytest.approx(i, rel=NEAR)
    for name, value in {"gain": -3.0, "r1": 500.0, "c1": 2e-6, "l1": 4e-3, "t1": -0.3}.items():
        one.set(name, value)
        assert one.get(name) == value
    one.step(1e-3, 1e-3)
    v, i = 5 + (v - 5) * np.exp(-1), 0.1 + (i - 0.1) * np.exp(-2.5)
    assert one.get("v(out)") == pytest.approx(v, rel=NEAR)
    assert one.get("v(amp)") == pytest.approx(-3 * v, rel=NEAR)
    assert one.get("i(l1)") == pytest.approx(i, rel=NEAR)
    assert one.get("omega(shaft)") == pytest.approx((0.1 - 0.3) * 1e-3 / 1e-3, rel=NEAR)
    if one.two:  # a slope is an input's
        slope = one.fmu.setRealInputDerivatives
        one.refuses(
            slope, [one.at["r1"]], [1], [1.0], match="`r1` takes no such derivative: it is a parameter"
        )
    one.end()


@VERSIONS
def test_tunable_parameters_before_the_run_are_those_of_the_deck(tmp_path: Path, version: int) -> None:
    path = written(tmp_path, TUNED, version)
    given = {"gain": 7.0, "r1": 300.0, "c1": 3e-6, "l1": 1e-3, "t1": 0.2}
    found = by_fmpy(path, None, 2e-5, 2e-3, start_values=given)
    names = ["v(out)", "v(amp)", "i(l1)", "omega(shaft)"]
    text = TUNED.replace(".fmu tune=gain,r1,c1,l1,t1 out=v(out),v(amp)", ".print tran v(out) v(amp)").replace(
        ",", " "
    )
    for card, value in (
        ("R1 in out ", "1k"),
        ("C1 out 0 ", "1u"),
        ("L1 coil 0 ", "2m"),
        ("t1 shaft tau=", "0.1"),
    ):
        assert card + value in text
        text = text.replace(card + value, card + str(given[card.lower()[:2]]))
    agree(found, emsim.run(text, defines={"gain": "7"}), names)


MACHINE = """numbers of machine cards from outside
.param kt=20m
V1 in 0 3
BODY arm shape=rod(0.3) m=0.2
JOINT hinge 0 arm pin zero=-90deg damp=2m
MOTOR m1 in 0 hinge kt={kt} r=2 l=1m j=2u gear=30
.gravity 9.81
.tran 1m 0.5
.options reltol=1e-8
.fmu param=kt,arm(m),hinge(damp),m1(r),m1(gear) out=angle(hinge),i(m1)
.end
"""


def test_numbers_of_machine_cards_come_from_outside(tmp_path: Path) -> None:
    path = written(tmp_path, MACHINE, 3)
    given = {"kt": 0.03, "arm(m)": 0.35, "hinge(damp)": 5e-3, "m1(r)": 1.5, "m1(gear)": 20.0}
    found = by_fmpy(path, None, 5e-3, 0.5, start_values=given)
    text = MACHINE.replace(
        ".fmu param=kt,arm(m),hinge(damp),m1(r),m1(gear) out=angle(hinge),i(m1)",
        ".print tran angle(hinge) i(m1)",
    )
    for was, value in (
        ("m=0.2", "m=0.35"),
        ("damp=2m", "damp=5m"),
        ("r=2 ", "r=1.5 "),
        ("gear=30", "gear=20"),
    ):
        assert was in text
        text = text.replace(was, value)
    agree(found, emsim.run(text, defines={"kt": "0.03"}), ["angle(hinge)", "i(m1)"])


def test_a_value_with_other_equations_is_refused(tmp_path: Path) -> None:
    """A motor without resistance is another circuit than one with: the card has decided by the value that the deck states."""
    one = Slave(tmp_path, written(tmp_path, MACHINE, 3))
    one.set("m1(r)", -2.0)
    with pytest.raises(Exception, match=r"."):
        one.begin()
    assert any("the deck has other equations" in text for text in one.said)


@pytest.mark.parametrize("name", ["hinge(zero)", "arm(shape)"])
def test_what_a_card_needs_before_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(emsim.DeckError, match="E381"):
        written(tmp_path, MACHINE.replace("param=kt,", f"param={name},"), 3)


@VERSIONS
def test_a_fixed_parameter_is_refused_between_steps(tmp_path: Path, version: int) -> None:
    one = Slave(tmp_path, written(tmp_path, TUNED.replace("tune=", "param="), version))
    one.begin()
    one.step(0.0, 1e-4)
    one.refuses(one.set, "r1", 500.0, match="`r1` is fixed: it is set before the model runs")
    one.end()


def test_values_of_defines(tmp_path: Path) -> None:
    text = RC.format(source="1").replace("1k", "{r}").replace("V1 in", ".param r=1k\nV1 in")
    path = written(tmp_path, text, 3, defines={"r": "2k"})
    times = np.array([0.0, 5e-3])
    found = by_fmpy(path, signals(times, v1=np.array([3.0, 3.0])), 1e-4, 5e-3, start_values={"v1": 0.0})
    assert found["v(out)"][0] == pytest.approx(3.0)


# ---- the interface, call by call -----------------------------------------------------------------


class Slave:
    """An instance, and what it said."""

    def __init__(self, folder: Path, path: str, name: str = "one") -> None:
        self.model = fmpy.read_model_description(path)
        self.at = {v.name: v.valueReference for v in self.model.modelVariables}
        self.said: list[str] = []
        unzipped = folder / f"unzipped{self.model.fmiVersion}"
        if not unzipped.exists():
            fmpy.extract(path, unzipdir=str(unzipped))
        of = {
            "guid": self.model.guid or self.model.instantiationToken,
            "unzipDirectory": str(unzipped),
            "modelIdentifier": self.model.coSimulation.modelIdentifier,
            "instanceName": name,
        }
        self.two = self.model.fmiVersion == "2.0"
        if self.two:
            from fmpy.fmi2 import FMU2Slave, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE

            self.fmu = FMU2Slave(**of)
            self._kept = fmi2CallbackLoggerTYPE(lambda *a: self.said.append(a[4].decode()))
            self._functions = fmi2CallbackFunctions()
            self._functions.logger = self._kept
            self.fmu.instantiate(callbacks=self._functions)
        else:
            from fmpy.fmi3 import FMU3Slave

            self.fmu = FMU3Slave(**of)
            self.fmu.instantiate(logMessage=lambda *a: self.said.append(a[3].decode()))

    def begin(self, start: float = 0.0, stop: float | None = None, **inputs: float) -> None:
        if self.two:
            self.fmu.setupExperiment(startTime=start, stopTime=stop)
            self.fmu.enterInitializationMode()
        else:
            self.fmu.enterInitializationMode(startTime=start, stopTime=stop)
        for name, value in inputs.items():
            self.set(name, value)
        self.fmu.exitInitializationMode()

    def set(self, name: str, value: float) -> None:
        (self.fmu.setReal if self.two else self.fmu.setFloat64)([self.at[name]], [value])

    def get(self, name: str) -> float:
        return (self.fmu.getReal if self.two else self.fmu.getFloat64)([self.at[name]])[0]

    def step(self, t: float, h: float) -> None:
        self.fmu.doStep(t, h)

    def end(self) -> None:
        self.fmu.freeInstance()

    def refuses(self, call: object, *args: object, match: str) -> None:
        with pytest.raises(fmpy.fmi1.FMICallException):
            call(*args)  # type: ignore[operator]
        assert match in self.said[-1], self.said


@VERSIONS
def test_wrong_calls_are_told(tmp_path: Path, version: int) -> None:
    one = Slave(tmp_path, written(tmp_path, RC.format(source="0"), version))
    one.refuses(one.get, "v(out)", match="`v(out)` has no value before the model is initialised")
    one.refuses(one.set, "v(out)", 1.0, match="`v(out)` is an output: it cannot be set")
    one.refuses(one.set, "v1", float("nan"), match="`v1` is set to NaN")
    one.refuses(one.step, 0.0, 1e-3, match="it is instantiated, and not initialised and cannot go on")
    one.begin(stop=1e-3, v1=1.0)
    assert one.get("v1") == 1.0
    assert one.get("time") == 0.0
    one.refuses(one.step, 5e-4, 1e-4, match="the step begins at t = 0.0005 s, the model stands at 0 s")
    one.refuses(one.step, 0.0, -1e-4, match="a step goes forward")
    one.refuses(one.step, 0.0, 2e-3, match="behind the end that was said, 0.001 s")
    one.at["nothing"] = 99
    one.refuses(one.get, "nothing", match="there is no variable with the value reference 99")
    one.step(0.0, 1e-3)  # it goes on all the same
    assert one.get("time") == 1e-3
    one.end()


@VERSIONS
def test_start_time_is_refused(tmp_path: Path, version: int) -> None:
    one = Slave(tmp_path, written(tmp_path, RC.format(source="0"), version))
    one.refuses(one.begin, 1.0, match="a deck begins at t = 0, the experiment at 1 s")
    one.end()


@VERSIONS
def test_no_convergence_is_told(tmp_path: Path, version: int) -> None:
    """1/v in a loop: no solution from some input on. The instance says so, and takes no further step."""
    text = "none\nV1 in 0 1\nR1 in a 1\nB1 a 0 I={1/v(a)}\n.tran 1m 1\n.fmu in=v1 out=v(a)\n.end"
    one = Slave(tmp_path, written(tmp_path, text, version))
    one.begin(v1=3.0)
    one.step(0.0, 0.1)
    one.set("v1", 1.0)  # v = (u + sqrt(u^2 - 4))/2
    one.refuses(one.step, 0.1, 0.1, match="[E410] no convergence at t = 0.1")
    one.refuses(one.step, 0.2, 0.1, match="it is stopped by an error and cannot go on")
    one.fmu.reset()
    one.begin(v1=3.0)
    one.step(0.0, 0.1)
    assert one.get("v(a)") == pytest.approx((3 + 5**0.5) / 2, rel=1e-6)
    one.end()


@VERSIONS
def test_warnings_of_the_run_are_told_once(tmp_path: Path, version: int) -> None:
    """A root of what becomes negative: what the deck's own run says behind its end."""
    text = "a root\nV1 in 0 1\nB1 out 0 V={sqrt(v(in))}\nR1 out 0 1k\n.tran 1m 1\n.fmu in=v1 out=v(out)\n.end"
    one = Slave(tmp_path, written(tmp_path, text, version))
    one.begin()
    one.step(0.0, 0.1)
    assert one.said == []
    for k, u in enumerate((-1.0, 1.0, -1.0), 1):
        one.set("v1", u)
        one.step(0.1 * k, 0.1)
    assert len(one.said) == 1 and one.said[0].startswith("[W402] ") and "first at t = 0.1" in one.said[0]
    one.end()


@VERSIONS
def test_reset_begins_anew(tmp_path: Path, version: int) -> None:
    one = Slave(tmp_path, written(tmp_path, RC.format(source="0"), version))
    ends = []
    for _ in range(2):
        one.begin(v1=0.0)
        one.set("v1", 2.0)
        for k in range(10):
            one.step(k * 1e-4, 1e-4)
        ends.append(one.get("v(out)"))
        one.fmu.terminate()
        one.fmu.reset()
    assert ends[0] == ends[1] == pytest.approx(2 * (1 - np.exp(-1)), rel=1e-6)
    one.end()


@VERSIONS
@pytest.mark.parametrize("text", [SWITCHED, RECTIFIER], ids=["switch", "rectifier"])
def test_state_is_kept_and_put_back(tmp_path: Path, version: int, text: str) -> None:
    """Step, go back, take another input, go back again: the first way again to 1e-6."""
    one = Slave(tmp_path, written(tmp_path, text.format(source="0"), version))
    one.begin(v1=0.0)
    get, put = (
        (one.fmu.getFMUstate, one.fmu.setFMUstate) if one.two else (one.fmu.getFMUState, one.fmu.setFMUState)
    )

    def on(u: float) -> list[float]:
        one.set("v1", u)
        found = []
        for k in range(20):
            one.step(2e-3 + k * 1e-4, 1e-4)
            found.append(one.get("v(out)"))
        return found

    one.set("v1", 1.0)
    for k in range(20):
        one.step(k * 1e-4, 1e-4)
    state = get()
    first = on(2.0)
    put(state)
    other = on(0.5)
    put(state)
    assert one.get("time") == pytest.approx(2e-3)
    assert on(2.0) == pytest.approx(first, rel=NEAR)
    assert np.abs(np.array(other) - first).max() > 1e-2
    (one.fmu.freeFMUstate if one.two else one.fmu.freeFMUState)(state)
    one.end()


@VERSIONS
def test_goes_on_beyond_the_end_of_the_deck(tmp_path: Path, version: int) -> None:
    """No stop time is said: the deck's .tran is only where it begins to count."""
    one = Slave(tmp_path, written(tmp_path, RC.format(source="SIN(0 1 200)").replace("in=v1 ", ""), version))
    one.begin()
    for k in range(30):
        one.step(k * 1e-3, 1e-3)
    w = 2 * np.pi * 200 * 1e-3
    t = 30e-3
    exact = (np.sin(2 * np.pi * 200 * t) - w * np.cos(2 * np.pi * 200 * t)) / (1 + w * w)
    assert one.get("v(out)") == pytest.approx(exact, abs=1e-6)
    one.end()


@pytest.mark.parametrize("text", [RC, RECTIFIER, SWITCHED], ids=["rc", "rectifier", "switch"])
def test_interpolated_sine_as_its_deck(tmp_path: Path, text: str) -> None:
    """FMI 2 hands derivatives over: the input is a chain of straight lines."""
    from ctypes import c_double, c_int, c_uint

    stop = {RC: 5e-3, RECTIFIER: 40e-3, SWITCHED: 10e-3}[text]
    one = Slave(tmp_path, written(tmp_path, text.format(source="0"), 2))
    times = np.linspace(0, stop, 201)
    values = 3.0 * np.sin(2 * np.pi * 2 / stop * times)
    one.begin(stop=stop)
    reference, order, found = (c_uint * 1)(one.at["v1"]), (c_int * 1)(1), [one.get("v(out)")]
    for k, h in enumerate(np.diff(times)):
        one.set("v1", values[k])
        slope = (c_double * 1)((values[k + 1] - values[k]) / h)
        one.fmu.fmi2SetRealInputDerivatives(one.fmu.component, reference, 1, order, slope)
        one.step(times[k], h)
        found.append(one.get("v(out)"))
    one.end()
    table = np.rec.fromarrays([times, np.array(found)], names=["time", "v(out)"])
    agree(table, emsim.run(text.format(source=lines(times, values))), ["v(out)"])


def test_instances_side_by_side(tmp_path: Path) -> None:
    """Eight in one process, each led by a thread of its own."""
    path = written(tmp_path, SWITCHED.format(source="0"), 3)
    found: dict[int, float] = {}

    def lead(slave: Slave, k: int) -> None:
        slave.begin(v1=0.0)
        slave.set("v1", 0.1 * k)
        for n in range(50):
            slave.step(n * 1e-4, 1e-4)
        found[k] = slave.get("v(out)")

    slaves = [Slave(tmp_path, path, f"i{k}") for k in range(1, 9)]
    threads = [threading.Thread(target=lead, args=(s, k)) for k, s in enumerate(slaves[:5], 1)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    # below the threshold of the switch: an RC with what the open switch takes
    for k in range(1, 6):
        full = 0.1 * k / (1 + 1e-3)
        assert found[k] == pytest.approx(full * (1 - np.exp(-5e-3 * (1 + 1e-3) / 1e-3)), rel=1e-6)
    for slave in slaves:
        slave.end()


class Mallinfo(ctypes.Structure):
    """struct mallinfo2 of malloc.h."""

    _fields_ = [
        (name, ctypes.c_size_t)
        for name in "arena ordblks smblks hblks hblkhd usmblks fsmblks uordblks fordblks keepcost".split()
    ]


def left_behind(folder: Path, path: str, phases: list[tuple[int, int, bool]]) -> list[tuple[float, float]]:
    """Bytes that an instance leaves behind, phase by phase: allocated, and resident in memory. For a process of its own.

    A phase: so many instances; bytes kept of each on purpose; whether it is freed. Allocated is what malloc has handed out
    and not got back: it does not depend on how the heap is cut up. Resident is all, pages of machine code too, to some pages.
    """
    c = ctypes.CDLL(None)
    c.malloc.restype, c.mallinfo2.restype = ctypes.c_void_p, Mallinfo

    def held() -> np.ndarray:
        gc.collect()
        c.malloc_trim(0)
        of = c.mallinfo2()
        pages = int(Path("/proc/self/statm").read_text().split()[1])
        return np.array([of.uordblks + of.hblkhd, pages * mmap.PAGESIZE])

    found = []
    for count, kept, freed in phases:
        before = held()
        for k in range(count):
            if k % 50 == 0:
                gc.collect()  # FMPy's instances are cycles
            one = Slave(folder, path, f"i{k}")
            one.begin(v1=1.0)
            one.step(0.0, 1e-4)
            if kept:
                ctypes.memset(c.malloc(kept), 1, kept)
            if freed:
                one.end()
        found.append(tuple((held() - before) / count))
    return found


@pytest.mark.skipif(sys.platform != "linux", reason="counts by the GNU library's malloc")
@VERSIONS
def test_memory_of_instances_is_freed(tmp_path: Path, version: int) -> None:
    """Instances made, run and freed leave nothing: 256 bytes that each would leave are seen, and so is one that is not freed."""
    path = written(tmp_path, RECTIFIER.format(source="0"), version)
    # pools of the interpreter and of the libraries fill in the first hundreds
    phases = [(400, 0, True), (150, 0, True), (50, 256, True), (20, 0, False)]
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        _warm, clean, more, unfreed = pool.submit(left_behind, tmp_path, path, phases).result()
    assert clean[0] < 128
    assert clean[1] < 4096  # a page
    assert more[0] > 200
    assert min(unfreed) > 20_000


# ---- everything that a deck may hold ------------------------------------------------------------

HELD = {
    # transistors by Verilog-A, whose inner nodes are unknowns
    "bipolar": """an emitter follower
V1 in 0 SIN(2 1 1k)
Vcc vcc 0 10
Q1 vcc in e q
.model q npn(bf=100 vaf=80 cje=2p tf=0.3n rb=50 re=1)
R1 e 0 1k
C1 e 0 100n
.tran 10u 3m
.fmu out=v(e),i(vcc)
.end""",
    "mosfet": """an inverter
V1 in 0 PULSE(0 5 10n 2n 2n 40n 100n)
Vdd d 0 5
M1 o in 0 0 n w=10u l=1u
M2 o in d d p w=20u l=1u
.model n nmos(level=1 vto=1 kp=50u lambda=0.02)
.model p pmos(level=1 vto=-1 kp=20u lambda=0.02)
C1 o 0 50f
.tran 1n 300n
.fmu out=v(o)
.end""",
    "line": """a line: what was a time ago
V1 in 0 PULSE(0 1 1n 1n 1n 20n 40n)
R1 in a 50
T1 a 0 b 0 z0=50 td=3n
R2 b 0 75
C2 b 0 2p
.tran 0.1n 80n
.fmu out=v(a),v(b)
.end""",
    "digital": """a gate between bridges
V1 in 0 SIN(0.5 1 100k)
A1 [in] [d] adc
A2 d q inv
A3 [q] [o] dac
.model adc adc_bridge(in_low=0.3 in_high=0.7)
.model inv d_inverter(rise_delay=1u fall_delay=1u)
.model dac dac_bridge(out_low=0 out_high=3 t_rise=0.1u t_fall=0.1u)
R1 o f 1k
C1 f 0 1n
.tran 0.1u 40u
.fmu out=v(f),v(q)
.end""",
    "friction": """a sled that sticks and slides
BODY sled m=1
JOINT way 0 sled slide
SPRING s1 way k=100
FRICTION f1 way fc=2
FORCE push sled.com dir=(1,0) SIN(0 5 1)
.tran 1m 2
.fmu out=pos(way),force(f1)
.end""",
    "stop": """an arm between stops
.gravity 9.81
BODY arm shape=rod(0.3) m=0.2
JOINT hinge 0 arm pin ic=1
STOP s1 hinge max=1.2 e=0.6
.tran 1m 1
.fmu out=angle(hinge),omega(hinge)
.end""",
    "loop": """a four-bar linkage
.gravity 9.81
BODY a shape=rod(0.1) m=0.1
BODY b shape=rod(0.25) m=0.2
BODY c shape=rod(0.2) m=0.2
JOINT j1 0 a pin ic=0.9
JOINT j2 a(0.1,0) b pin guess=-0.5
JOINT j3 0(0.25,0) c pin guess=1.2
JOINT j4 b(0.25,0) c(0.2,0) pin
TORQUE t1 j1 tau=SIN(0 0.05 2)
.tran 1m 1
.fmu out=angle(j1),fx(j4)
.end""",
}


@VERSIONS
@pytest.mark.parametrize("name", HELD)
def test_what_a_deck_holds_runs_on(tmp_path: Path, version: int, name: str) -> None:
    text = HELD[name].replace("\n.end", "\n.options reltol=1e-9\n.end")
    path = written(tmp_path, text, version)
    model = fmpy.read_model_description(path)
    stop, step = float(model.defaultExperiment.stopTime), float(model.defaultExperiment.stepSize)
    # at points of the print grid, where the deck's run is known as well as it knows itself
    found = by_fmpy(path, None, 7 * step, stop)
    names = [v.name for v in model.modelVariables if v.causality == "output"]
    agree(found, emsim.run(text.replace(".fmu out=", ".print tran ").replace(",", " ")), names)

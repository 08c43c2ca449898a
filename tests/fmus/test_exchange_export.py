"""Decks as FMUs for model exchange: by FMPy's CVode and by emsim's own card, beside the runs of the decks, to 1e-6 at every
row."""

from __future__ import annotations

import ctypes
import os
import sys
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.fmi2 import FMU2Model
from fmpy.fmi3 import FMU3Model
from fmpy.validation import validate_fmu
from support import deck, values_at

import emsim
from emsim import _engine
from emsim.diagnostics import DeckError
from emsim.fmus import export, library

NEAR = 1e-6
pytestmark = pytest.mark.skipif(
    sys.platform != "linux" or os.uname().machine != "x86_64",
    reason="the engine is an FMU's library on Linux",
)
VERSIONS = pytest.mark.parametrize("version", [2, 3])
TIGHT = 1e-10

RC = """an RC, pulsed by a source of its own
V1 in 0 PULSE(0 1 1m 10u 10u 1m 3m)
R1 in out 1k
C1 out 0 1u
.tran 20u 6m
.end
"""
RLC = """a series RLC
V1 in 0 SIN(0 1 1k)
R1 in a 10
L1 a out 1m
C1 out 0 1u
.tran 10u 3m
.end
"""
RECTIFIER = """a half-wave rectifier
V1 in 0 SIN(0 5 50)
D1 in out dm
.model dm d(is=1n n=1.6 rs=0.1 cjo=10p)
C1 out 0 10u
R1 out 0 2k
.tran 50u 40m
.end
"""
BALL = """a ball that bounces on a rigid floor
.gravity 9.81
BODY  ball m=1 j=1m
JOINT up 0 ball slide axis=(0,1) ic=1
CONTACT floor ball 0 line=(0,1) e=0.8
.tran 5m 2.5
.end
"""
PENDULUM = """a double pendulum
.gravity 9.81
BODY  upper shape=rod(0.3) m=0.2
JOINT hinge 0 upper pin ic=0.3
BODY  lower shape=rod(0.3) m=0.2
JOINT elbow upper(0.3,0) lower pin ic=0.5
.tran 2m 1
.end
"""
COMPARATOR = """an oscillator of a comparator with hysteresis
Bc out 0 V={v(p)>v(m) ? 5 : 0}
R1 out p 10k
R2 p 0 10k
Vr r 0 2.5
R4 r p 10k
R3 out m 10k
C1 m 0 10n ic=0
.tran 2u 1m uic
.end
"""
SWITCH = """a step-down converter, switched by a pulse
Vcc cc 0 12
Vg g 0 PULSE(0 5 0 1u 1u 20u 50u)
S1 cc sw g 0 sm
.model sm sw(vt=2.5 ron=10m roff=1meg)
D1 0 sw dm
.model dm d(is=1n rs=10m)
L1 sw out 470u
C1 out 0 10u
R1 out 0 5
.tran 1u 500u
.end
"""
SLIDER = """a block that sticks and slides
BODY b m=1
JOINT s 0 b slide
FRICTION f s fc=1 fs=1.2
FORCE push b dir=(1,0) SIN(0 2 1)
.tran 5m 2
.end
"""

# deck, outputs, output interval and stop of FMPy [s]
CASES = {
    "rc": (RC, "v(out) i(v1)", 20e-6, 6e-3),
    "rlc": (RLC, "v(out) i(l1)", 10e-6, 3e-3),
    "rectifier": (RECTIFIER, "v(out)", 50e-6, 40e-3),
    "ball": (BALL, "pos(up)", 5e-3, 2.5),
    "pendulum": (PENDULUM, "angle(hinge) angle(elbow)", 2e-3, 1.0),
    "servo": (deck("coupled/pendulum_servo"), "angle(hinge) i(m1)", 2e-3, 1.0),
    "comparator": (COMPARATOR, "v(m)", 2e-6, 1e-3),
    "switch": (SWITCH, "v(out) i(l1)", 1e-6, 500e-6),
    "slider": (SLIDER, "pos(s)", 5e-3, 2.0),
}


def tight(text: str) -> str:
    return text.replace("\n", "\n.options reltol=1e-9\n", 1)


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The library, once for all FMUs of this file: what is in them lies in folders, as importers unpack it."""
    path = tmp_path_factory.mktemp("shared") / "engine.so"
    path.write_bytes(library.without_python(Path(str(_engine.__file__)).read_bytes()))
    return path


@pytest.fixture(autouse=True)
def folders(shared: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def write(path: str, files: dict[str, bytes]) -> None:
        for name, data in files.items():
            place = Path(path) / name
            place.parent.mkdir(parents=True, exist_ok=True)
            if name.startswith("binaries"):
                place.symlink_to(shared)
            else:
                place.write_bytes(data)

    names = {2: ("linux64", ".so", b""), 3: ("x86_64-linux", ".so", b"")}
    monkeypatch.setattr(library, "binaries", lambda _, version: [names[version]])
    monkeypatch.setattr(sys.modules["emsim.fmus.export"], "write", write)


def written(folder: Path, text: str, version: int, outputs: str, **more: object) -> str:
    path = str(folder / f"model{version}")
    made = export(text, path, version, outputs=outputs, **more)  # type: ignore[arg-type]
    assert "model" in made.kinds, made.diagnostics
    return path


def by_cvode(path: str, step: float, stop: float, **more: object) -> np.ndarray:
    return fmpy.simulate_fmu(
        path, stop_time=stop, output_interval=step, fmi_type="ModelExchange", relative_tolerance=TIGHT,
        record_events=False, **more,
    )  # fmt: skip


def agree(times: np.ndarray, found: np.ndarray, result: emsim.Result, name: str) -> None:
    expected = values_at(result, name, times)
    size = np.ptp(result[name])
    assert size > 0
    worst = np.abs(found - expected).argmax()
    assert np.abs(found - expected)[worst] < NEAR * size, (name, times[worst], found[worst], expected[worst])


@VERSIONS
@pytest.mark.parametrize("case", CASES)
def test_by_cvode_as_its_deck(tmp_path: Path, case: str, version: int) -> None:
    text, outputs, step, stop = CASES[case]
    text = tight(text)
    path = written(tmp_path, text, version, outputs)
    assert validate_fmu(path) == []
    found = by_cvode(path, step, stop)
    result = emsim.run(text)
    for name in outputs.split():
        if name != "i(v1)":  # jumps at corners, where a row has one side of it
            agree(found["time"], found[name], result, name)


@pytest.mark.parametrize("case", ["rc", "rlc", "rectifier", "ball", "pendulum", "comparator", "slider"])
def test_by_the_card_as_its_deck(tmp_path: Path, case: str) -> None:
    """Exported, and part of another deck, whose own methods integrate it."""
    text, outputs, step, stop = CASES[case]
    text, name = tight(text), outputs.split()[0]
    folder = Path(written(tmp_path, text, 3, name, kind="model"))
    with zipfile.ZipFile(tmp_path / "part.fmu", "w") as archive:
        for file in folder.rglob("*"):
            if file.is_file():
                archive.write(file, file.relative_to(folder))
    around = f"""a part
FMU f part.fmu out=(y='{name}') kind=model
Bo o 0 V={{f.y}}
Ro o 0 1
.options reltol=1e-9
.tran {step} {stop}
.print tran f.y
.end
"""
    (tmp_path / "around.cir").write_text(around)
    result = emsim.run(str(tmp_path / "around.cir"))
    times = np.arange(0.0, stop, step)
    agree(times, values_at(result, "f.y", times), emsim.run(text), name)


DRIVEN = """a rectifier with a coil, driven, and a motor with its load
Vin in 0 1
R1 in a {r}
L1 a b 1m
D1 b out dm
.model dm d(is=1n n=1.6 rs=0.1 cjo=10p)
C1 out 0 10u
R2 out 0 2k
C2 out c 1u
R3 c 0 50
BODY arm shape=rod(0.3) m=0.2
JOINT hinge 0 arm pin ic=0.2
MOTOR m1 out 0 hinge kt=20m r=20 l=1m j=2u gear=3
TORQUE load hinge tau=0
.param r=10
.gravity 9.81
.options reltol=1e-9
.tran 10u 5m
.fmu in=vin,load tune=r out=v(c),i(m1)*v(out),load2
B9 load2 0 V={0.5*angle(hinge)+v(in)*i(l1)}
R9 load2 0 1
.end
"""


STEP = 1e-13  # [s] a tenth of what the diode's resistance and capacitance allow an explicit step


class Led:
    """An instance in continuous-time mode, by FMI 2."""

    def __init__(self, path: str) -> None:
        self.model = fmpy.read_model_description(path)
        of = self.model.modelExchange
        self.fmu = FMU2Model(
            guid=self.model.guid, unzipDirectory=path, modelIdentifier=of.modelIdentifier, instanceName="one"
        )
        self.fmu.instantiate()
        self.fmu.setupExperiment()
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()
        self.fmu.newDiscreteStates()
        self.fmu.enterContinuousTimeMode()
        self.n = self.model.numberOfContinuousStates
        self.at = {v.name: v.valueReference for v in self.model.modelVariables}
        self.states = [v.valueReference for v in self.model.modelVariables if v.name.startswith("stored(")]
        self.rates = [v.valueReference for v in self.model.modelVariables if v.name.startswith("der(")]

    def get(self) -> np.ndarray:
        x = (ctypes.c_double * self.n)()
        self.fmu.getContinuousStates(x, self.n)
        return np.array(x)

    def put(self, t: float, x: np.ndarray) -> None:
        self.fmu.setTime(t)
        self.fmu.setContinuousStates((ctypes.c_double * self.n)(*x), self.n)

    def derivatives(self) -> np.ndarray:
        dx = (ctypes.c_double * self.n)()
        self.fmu.getDerivatives(dx, self.n)
        return np.array(dx)

    def euler(self, t: float, h: float) -> None:
        x, dx = self.get(), self.derivatives()
        self.put(t + h, x + h * dx)
        self.fmu.completedIntegratorStep()

    def end(self) -> None:
        self.fmu.terminate()
        self.fmu.freeInstance()


def test_slopes_along_a_direction_are_those_of_the_rates(tmp_path: Path) -> None:
    """By central differences of rates and outputs, of every state and every input; a diode, coupled capacitors, a motor."""
    led = Led(written(tmp_path, DRIVEN, 2, ()))
    assert led.model.modelExchange.providesDirectionalDerivative
    nominal = (ctypes.c_double * led.n)()
    led.fmu.getNominalsOfContinuousStates(nominal, led.n)
    outputs = [
        led.at[name] for name in ("v(c)", "i(m1)*v(out)", "v(load2)" if "v(load2)" in led.at else "load2")
    ]
    asked = led.rates + outputs
    x = led.get()

    def values(known: int, by: float) -> np.ndarray:
        if known in led.states:
            led.put(0.0, x + by * (np.array(led.states) == known))
            found = np.array([*led.derivatives(), *led.fmu.getReal(outputs)])
            led.put(0.0, x)
            return found
        own = led.fmu.getReal([known])[0]
        led.fmu.setReal([known], [own + by])
        found = np.array([*led.derivatives(), *led.fmu.getReal(outputs)])
        led.fmu.setReal([known], [own])
        return found

    for known, size in [
        *zip(led.states, nominal, strict=True),
        (led.at["vin"], 1.0),
        (led.at["load"], 0.1),
        (led.at["r"], 1.0),
    ]:
        exact = np.array(led.fmu.getDirectionalDerivative(asked, [known], [1.0]))
        h = 1e-5 * size
        near = (values(known, h) - values(known, -h)) / (2.0 * h)
        scale = np.abs(near) + 1e-6 * np.abs(near).max()
        assert (np.abs(exact - near) < 1e-4 * scale + 1e-12 * np.abs(values(known, 0.0)) / h).all(), known
    led.end()


def test_a_kept_state_comes_back_with_all_bits(tmp_path: Path) -> None:
    led = Led(written(tmp_path, DRIVEN, 2, ()))
    for k in range(20):
        led.euler(STEP * k, STEP)
    kept = led.fmu.getFMUState()
    before = [led.get().tobytes(), led.derivatives().tobytes()]

    def on() -> list[bytes]:
        found = []
        for k in range(20, 40):
            led.euler(STEP * k, STEP)
            found.append(led.get().tobytes())
        return found

    first = on()
    led.fmu.setReal([led.at["vin"]], [3.0])
    led.euler(40 * STEP, STEP)
    led.fmu.setFMUState(kept)
    assert [led.get().tobytes(), led.derivatives().tobytes()] == before
    assert led.fmu.getReal([led.at["vin"]]) == [1.0] and on() == first
    led.fmu.freeFMUState(kept)
    led.end()


def test_rates_are_a_function_of_states_and_time(tmp_path: Path) -> None:
    """Where Newton's method came from does not show, not in one bit."""
    led = Led(written(tmp_path, DRIVEN, 2, ()))
    x = led.get()
    led.put(1e-6, x)
    first = led.derivatives().tobytes()
    led.put(2e-6, x + 1e-9)
    led.derivatives()
    led.put(1e-6, x)
    assert led.derivatives().tobytes() == first
    led.end()


def test_an_impact_sets_the_momentum_anew(tmp_path: Path) -> None:
    """From 1 m it comes down with sqrt(2 g) and goes up with 0.8 of that."""
    led = Led(written(tmp_path, tight(BALL), 2, "pos(up) vel(up)"))
    v, t = np.sqrt(2 * 9.81), np.sqrt(2 / 9.81)
    indicators = (ctypes.c_double * led.model.numberOfEventIndicators)()

    def beyond(x: np.ndarray, at: float) -> float:
        led.put(at, x)
        led.fmu.getEventIndicators(indicators, len(indicators))
        return max(indicators)

    position = led.model.modelVariables[led.states[0]].name == "stored(pos(up))"
    order = (lambda q, p: np.array([q, p])) if position else (lambda q, p: np.array([p, q]))
    assert beyond(order(1e-3, -v), t - 1e-4) < 0.0 < beyond(order(-1e-9, -v), t)
    led.fmu.completedIntegratorStep()
    led.fmu.enterEventMode()
    _, _, _, jumped, _, _ = led.fmu.newDiscreteStates()
    led.fmu.enterContinuousTimeMode()
    assert jumped and sorted(led.get()) == pytest.approx([0.0, 0.8 * v], abs=1e-6)
    up = order(0.8e-4 * v, 0.8 * v)
    assert beyond(up, t + 1e-4) < 0.0
    led.fmu.completedIntegratorStep()
    led.fmu.enterEventMode()
    assert not led.fmu.newDiscreteStates()[3] and (led.get() == up).all()
    led.end()


def test_corners_and_edges_are_time_events(tmp_path: Path) -> None:
    led = Led(written(tmp_path, RC, 2, "v(out)"))
    led.end()
    by_fmi3 = fmpy.read_model_description(written(tmp_path, RC, 3, "v(out)"))
    model = FMU3Model(
        guid=by_fmi3.instantiationToken, unzipDirectory=str(tmp_path / "model3"),
        modelIdentifier=by_fmi3.modelExchange.modelIdentifier, instanceName="three",
    )  # fmt: skip
    model.instantiate()
    model.enterInitializationMode()
    model.exitInitializationMode()
    times = []
    for _ in range(4):
        *_, has_next, after = model.updateDiscreteStates()
        assert has_next
        times.append(after)
        model.enterContinuousTimeMode()
        model.setTime(after)
        model.enterEventMode()
    assert times == pytest.approx([1e-3, 1.01e-3, 2.01e-3, 2.02e-3], rel=1e-12)
    model.terminate()
    model.freeInstance()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a line\nV1 a 0 1\nR1 a b 50\nT1 b 0 c 0 z0=50 td=1n\nR2 c 0 50\n.tran 1n 10n\n.end\n", "a time ago"),
        ("a clock\nV1 a 0 1\nCLOCK k freq=1k\nBLOCK b clock=k e={v(a)} v(c)={e}\nR2 c 0 1\n.tran 1m 10m\n.end\n", "clocks"),
    ],
)  # fmt: skip
def test_what_is_no_ode_is_refused_by_name(tmp_path: Path, text: str, said: str) -> None:
    made = export(text, str(tmp_path / "both"), outputs="v(c)")
    assert made.kinds == ("cosim",) and said in next(d for d in made.diagnostics if d.code == "N383").message
    assert fmpy.read_model_description(made.path).modelExchange is None
    with pytest.raises(DeckError, match="E383") as caught:
        export(text, str(tmp_path / "model"), outputs="v(c)", kind="model")
    assert said in str(caught.value)
    assert not export(text, str(tmp_path / "cosim"), outputs="v(c)", kind="cosim").diagnostics


def test_states_are_shown_in_co_simulation_too(tmp_path: Path) -> None:
    """Charge and current of a capacitor."""
    text = tight(RC.replace("PULSE(0 1 1m 10u 10u 1m 3m)", "PULSE(0 1 0 1n 1n 1 2)"))
    path = written(tmp_path, text, 3, "v(out)")
    found = fmpy.simulate_fmu(
        path, fmi_type="CoSimulation", stop_time=1e-3, output_interval=1e-4,
        output=["v(out)", "stored(v(out))", "der(stored(v(out)))"],
    )  # fmt: skip
    assert found["stored(v(out))"] == pytest.approx(1e-6 * found["v(out)"], rel=1e-9)
    assert found["der(stored(v(out)))"][1:] == pytest.approx((1.0 - found["v(out)"][1:]) / 1e3, rel=1e-6)

"""FMUs for co-simulation as parts of a deck: against Euler's steps done here and runs of the whole deck; failures by name."""

from __future__ import annotations

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest
from parts import part
from support import values_at

import emsim
from emsim.diagnostics import ConvergenceError, DeckError, OutsideError
from emsim.fmus import export

VERSIONS = pytest.mark.parametrize("version", [2, 3])
ALONE = """the part by itself
R1 a 0 1k
FMU f {file} kind=cosim step=10m {more} out=(x v)
.tran 10m 1
.end
"""


def behind_ticks(result: emsim.Result, name: str, step: float, count: int) -> np.ndarray:
    """What is shown from each of the first ticks on."""
    times = np.asarray(result["time"])
    at = np.searchsorted(times, (np.arange(count) + 0.01) * step)
    return np.asarray(result[name])[at]


def moved(x: float, v: float, a: float, h: float = 1e-3) -> tuple[float, float]:
    """One step, with the bounce."""
    x, v = x + h * v, v + h * a
    return (0.0, -0.8 * v) if x <= 0 and v < 0 else (x, v)


def euler(steps: int, k: float, d: float, u: np.ndarray | None = None, h: float = 1e-3) -> np.ndarray:
    """x and v behind every tenth of Euler's steps; u of each tenth."""
    x, v = 1.0, 0.0
    found = [(x, v)]
    for n in range(steps):
        x, v = moved(x, v, -k * x - d * v + (0.0 if u is None else u[n // 10]), h)
        if (n + 1) % 10 == 0:
            found.append((x, v))
    return np.array(found)


@VERSIONS
def test_steps_are_those_of_the_part(tmp_path: Path, version: int) -> None:
    """Numbers, a number in braces and a text before the start; bit for bit."""
    more = "p=(k=9 d={0.1+0.4} word='a b')"
    result = emsim.run(ALONE.format(file=part(tmp_path, version), more=more))
    expected = euler(990, 9.0, 0.5)
    for name, column in (("f.x", 0), ("f.v", 1)):
        found = behind_ticks(result, name, 10e-3, 99)
        assert np.abs(found - expected[:99, column]).max() < 1e-12


@VERSIONS
def test_inputs_are_those_of_the_tick_before(tmp_path: Path, version: int) -> None:
    """u is a voltage, held from tick to tick; an output becomes a voltage, of which a resistor's current follows."""
    text = f"""driven
V1 s 0 SIN(0 3 2)
FMU f {part(tmp_path, version)} kind=cosim step=10m in=(u=2*v(s)) out=(x v v(o)=x)
R1 o 0 2
.tran 10m 1
.print tran f.x f.v v(o) i(r1)
.end
"""
    result = emsim.run(text)
    u = 6.0 * np.sin(2 * np.pi * 2 * np.arange(100) * 10e-3)
    expected = euler(990, 4.0, 0.0, u)
    found = behind_ticks(result, "f.x", 10e-3, 99)
    assert np.abs(found - expected[:99, 0]).max() < 1e-9
    shown = np.asarray(result["v(o)"])
    assert np.abs(shown - np.asarray(result["f.x"])).max() < 1e-12
    assert np.abs(np.asarray(result["i(r1)"]) - shown / 2).max() < 1e-12


def test_controller_and_plant_exchange_at_their_ticks(tmp_path: Path) -> None:
    """Two instances of one file in a ring, one of the other version beside them: at a tick each sees what others have come to."""
    three, two = part(tmp_path, 3), part(tmp_path, 2)
    text = f"""two oscillators, tied
R1 a 0 1k
FMU a {three} kind=cosim step=10m in=(u=b.x) out=(x)
FMU b {three} kind=cosim step=10m in=(u=a.x) out=(x) p=(x=0.5)
FMU c {two} kind=cosim step=10m in=(u=a.x) out=(x) p=(x=0.5)
.tran 10m 1
.print tran a.x b.x c.x
.end
"""
    result = emsim.run(text)
    state = {"a": [1.0, 0.0], "b": [0.5, 0.0]}
    expected = [(1.0, 0.5)]
    for _ in range(98):
        given = {"a": state["b"][0], "b": state["a"][0]}
        for name, s in state.items():
            for _ in range(10):
                s[0], s[1] = moved(s[0], s[1], -4.0 * s[0] + given[name])
        expected.append((state["a"][0], state["b"][0]))
    for column, name in enumerate(("a.x", "b.x")):
        found = behind_ticks(result, name, 10e-3, 99)
        assert np.abs(found - np.array(expected)[:, column]).max() < 1e-9, name
    assert np.abs(np.asarray(result["c.x"]) - np.asarray(result["b.x"])).max() < 1e-12


def test_a_block_reads_and_drives_at_one_tick(tmp_path: Path) -> None:
    """A sampled controller: the block sees what the plant has come to, the plant takes what the block makes of it."""
    text = f"""held by a block
R1 a 0 1k
CLOCK clk period=10m
BLOCK c clock=clk u={{-20*p.x - 3*p.v}}
FMU p {part(tmp_path, 3)} kind=cosim step=10m in=(u=c.u) out=(x v)
.tran 10m 1
.print tran p.x c.u
.end
"""
    result = emsim.run(text)
    x, v, expected = 1.0, 0.0, []
    for _ in range(99):
        u = -20 * x - 3 * v
        expected.append((x, u))
        for _ in range(10):
            x, v = moved(x, v, -4 * x + u)
    for column, name in enumerate(("p.x", "c.u")):
        found = behind_ticks(result, name, 10e-3, 99)
        assert np.abs(found - np.array(expected)[:, column]).max() < 1e-9, name


PLANT = """an arm on a motor
.gravity 9.81
BODY   arm    shape=rod(0.30) m=0.20
JOINT  hinge  0 arm pin  zero=-90deg damp=2m
MOTOR  m1     drive 0 hinge  kt=20m r=2 l=1m j=2u gear=30
Vdrive drive  0 {source}
.tran  1m 1
.options reltol=1e-9
.fmu in=vdrive out=angle(hinge),i(m1)
.end
"""


@VERSIONS
def test_what_emsim_wrote_it_reads(tmp_path: Path, version: int) -> None:
    """A plant exported and read again, driven by a pulse whose edges are at ticks: as the deck itself."""
    export(PLANT.format(source="0"), str(tmp_path / "plant.fmu"), version)
    pulse = "PULSE(0 3 0.1 1n 1n 0.2 2)"
    text = f"""driven
Vs s 0 {pulse}
R1 s 0 1k
FMU arm {tmp_path}/plant.fmu in=(vdrive=v(s)) out=(q='angle(hinge)' v(cur)='i(m1)') step=1m
.tran 1m 1
.print tran arm.q v(cur)
.end
"""
    found, whole = emsim.run(text), emsim.run(PLANT.format(source="PULSE(0 3 0.101 1n 1n 0.2 2)"))
    times = (np.arange(5, 99) + 0.01) * 10e-3
    at = np.searchsorted(np.asarray(found["time"]), times)
    shown = np.asarray(found["arm.q"])[at]
    expected = values_at(whole, "angle(hinge)", times - 0.01 * 10e-3)
    assert np.abs(expected).max() > 0.1
    assert np.abs(shown - expected).max() < 1e-6 * np.abs(expected).max()


FAULTS = {
    1: "gives Error: the part is broken at t =",
    2: "discards the step",
    3: "gives Fatal: the part is beyond repair at t =",
    7: "ends the simulation",
    8: "gives Error: it does not begin at t = 0 (42)",
}


@VERSIONS
@pytest.mark.parametrize("fault", FAULTS)
def test_a_failure_is_told_and_what_was_computed_is_kept(tmp_path: Path, version: int, fault: int) -> None:
    text = ALONE.format(file=part(tmp_path, version), more=f"p=(fault={fault})")
    with pytest.raises(ConvergenceError, match="E516") as caught:
        emsim.run(text)
    assert FAULTS[fault] in str(caught.value) and "the FMU f (" in str(caught.value)
    kept = caught.value.partial
    if fault != 8:
        assert 0.4 < kept["time"][-1] < 0.51


@VERSIONS
def test_a_warning_is_told_once(tmp_path: Path, version: int) -> None:
    text = ALONE.format(file=part(tmp_path, version), more="p=(fault=6)")
    result = emsim.run(text)
    told = [d for d in result.diagnostics if d.code == "W386"]
    assert len(told) == 1 and "the part is warm at t = 0.49 (42)" in told[0].message
    assert abs(result["time"][-1] - 1) < 1e-9
    noted = emsim.run(ALONE.format(file=part(tmp_path, version), more="p=(fault=6) log=yes"))
    assert [d.code for d in noted.diagnostics] == ["N386"]


@pytest.mark.skipif(os.name == "nt", reason="Windows ends the process by itself")
@VERSIONS
@pytest.mark.parametrize(("fault", "said"), [(4, "crashes in"), (5, "ends the program in")])
def test_a_crash_is_no_silent_end(tmp_path: Path, version: int, fault: int, said: str) -> None:
    """The process ends with the exit code of the outside world, says whose fault it was, and leaves no folder behind."""
    deck = tmp_path / "crash.cir"
    deck.write_text(ALONE.format(file=part(tmp_path, version), more=f"p=(fault={fault})"))
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    run = subprocess.run(
        [sys.executable, "-m", "emsim", str(deck)],
        capture_output=True, text=True, cwd=tmp_path, env={**os.environ, "TMPDIR": str(scratch)},
    )  # fmt: skip
    assert run.returncode == 5
    assert f"error[E516]: the FMU f ({tmp_path}/part{version}.fmu) {said} fmi{version}DoStep" in run.stderr
    assert list(scratch.iterdir()) == []


def test_exit_codes_and_folders(tmp_path: Path) -> None:
    """As a command: 0 and 5, and nothing left in the folder for temporary files."""
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    for more, code in (("", 0), ("p=(fault=1)", 5)):
        deck = tmp_path / "deck.cir"
        deck.write_text(ALONE.format(file="part3.fmu", more=more))
        part(tmp_path, 3)
        run = subprocess.run(
            [sys.executable, "-m", "emsim", str(deck)],
            capture_output=True, text=True, cwd=tmp_path, env={**os.environ, "TMPDIR": str(scratch)},
        )  # fmt: skip
        assert run.returncode == code, run.stderr
        assert list(scratch.iterdir()) == []


def refusal(text: str, kind: type[Exception] = OutsideError) -> str:
    with pytest.raises(kind) as caught:
        emsim.run(text)
    return str(caught.value)


def test_files_that_cannot_be_used(tmp_path: Path) -> None:
    (tmp_path / "none.fmu").write_text("no archive")
    assert "E515" in refusal(ALONE.format(file=tmp_path / "none.fmu", more=""))
    assert "E501" in refusal(ALONE.format(file=tmp_path / "missing.fmu", more=""))
    elsewhere = ALONE.format(file=part(tmp_path, 3, platform="riscv64-linux"), more="")
    assert "no library for this platform" in refusal(elsewhere) and "riscv64-linux" in refusal(elsewhere)
    other = ALONE.format(file=part(tmp_path, 3, kinds="ModelExchange"), more="")
    assert "is no FMU for co-simulation" in refusal(other)
    clocks = ALONE.format(file=part(tmp_path, 3, kinds="ScheduledExecution"), more="").replace(
        "kind=cosim", ""
    )
    assert "scheduled execution" in refusal(clocks)
    once = ALONE.format(file=part(tmp_path, 3, can='canBeInstantiatedOnlyOncePerProcess="true"'), more="")
    assert abs(emsim.run(once)["time"][-1] - 1) < 1e-9
    card = once.split("\n")[2]
    assert "can be there once" in refusal(once.replace(card, f"{card}\n{card.replace(' f ', ' g ')}"))
    tool = ALONE.format(file=part(tmp_path, 3, can='needsExecutionTool="true"'), more="")
    assert "needs the program that made it" in refusal(tool)


def changed(file: str, old: str, new: str) -> str:
    """The file with another description, as the card of a deck."""
    with zipfile.ZipFile(file) as archive:
        inside = {name: archive.read(name) for name in archive.namelist()}
    text = inside["modelDescription.xml"].decode()
    assert old in text
    inside["modelDescription.xml"] = text.replace(old, new).encode()
    with zipfile.ZipFile(file, "w") as archive:
        for name, content in inside.items():
            archive.writestr(name, content)
    return f"t\nR1 a 0 1k\nFMU f {file} kind=model out=(x)\n.tran 1m 10m\n.end\n"


def test_descriptions_that_cannot_be_read(tmp_path: Path) -> None:
    wrong = changed(part(tmp_path, 2), '<Unknown index="3"/>', '<Unknown index="0"/>')
    assert "E515" in refusal(wrong) and "cannot be read" in refusal(wrong)
    wrong = changed(
        part(tmp_path, 3), '<EventIndicator valueReference="1"/>', '<EventIndicator valueReference="one"/>'
    )
    assert "E515" in refusal(wrong) and "cannot be read" in refusal(wrong)
    array = changed(part(tmp_path, 3), 'derivative="1"/>', 'derivative="1"><Dimension start="2"/></Float64>')
    assert "`der(x)` of" in refusal(array) and "is an array" in refusal(array)


def test_a_file_that_is_spoilt(tmp_path: Path) -> None:
    file = Path(part(tmp_path, 3))
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("modelDescription.xml", "<fmiModelDescription/>" * 100)
        start = archive.infolist()[0].header_offset
    content = bytearray(file.read_bytes())
    place = start + 30 + len("modelDescription.xml")
    content[place : place + 8] = b"\xff" * 8
    file.write_bytes(content)
    assert "E515" in refusal(ALONE.format(file=file, more=""))


@pytest.mark.parametrize(
    ("card", "said"),
    [
        ("in=(w=1) out=(x)", "has no input `w`"),
        ("in=(k=1) out=(x)", "`k` of"),
        ("out=(y)", "has no output `y`"),
        ("out=(x) p=(u=v(a))", "has to be known before the run"),
        ("out=(word)", "`word` of"),
        ("out=(x) p=(word=1)", "of the type String"),
        ("out=(x) p=(x='one')", "of the type Float64"),
        ("in=(u) out=(x)", "is given no value"),
        ("in=(u=1 u=2) out=(x)", "given twice"),
        ("out=(x", "never closed"),
        ("out=('der(x)')", "is no name that expressions could read"),
        ("out=(x) step=1m colour=red", "colour"),
    ],
)  # fmt: skip
def test_a_card_that_does_not_fit(tmp_path: Path, card: str, said: str) -> None:
    text = f"t\nR1 a 0 1k\nFMU f {part(tmp_path, 3)} kind=cosim {card}\n.tran 1m 10m\n.end\n"
    assert said in refusal(text, DeckError)


def test_a_step_is_needed(tmp_path: Path) -> None:
    text = f"t\nR1 a 0 1k\nFMU f {part(tmp_path, 3)} kind=cosim out=(x)\n.tran 1m 10m\n.end\n"
    assert "needs a step" in refusal(text, DeckError)


def test_in_a_subcircuit(tmp_path: Path) -> None:
    """Its nodes and names are those of its level."""
    text = f"""two parts
.subckt osc out k=4
FMU f {part(tmp_path, 3)} kind=cosim step=10m out=(x v(out)=x) p=(k=k)
R1 out 0 1k
.ends
X1 a osc
X2 b osc k=9
.tran 10m 1
.print tran v(a) v(b) x1.f.x
.end
"""
    result = emsim.run(text)
    for name, k in (("v(a)", 4.0), ("v(b)", 9.0)):
        assert np.abs(behind_ticks(result, name, 10e-3, 99) - euler(990, k, 0.0)[:99, 0]).max() < 1e-9


def test_workers_of_a_sweep_leave_nothing(tmp_path: Path) -> None:
    """Values of a sweep reach the FMU, and folders of workers go with them."""
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    part(tmp_path, 3)
    deck = tmp_path / "swept.cir"
    deck.write_text(
        ".title swept\n.param k=4\nR1 a 0 1k\nFMU f part3.fmu kind=cosim step=10m out=(x) p=(k=k)\n.tran 10m 0.5\n"
        ".meas tran last find f.x at=0.495\n.end\n"
    )
    run = subprocess.run(
        [sys.executable, "-m", "emsim", "sweep", str(deck), "-D", "k=4,5,6,7", "-j", "2", "-o", "swept.csv"],
        capture_output=True, text=True, cwd=tmp_path, env={**os.environ, "TMPDIR": str(scratch)},
    )  # fmt: skip
    assert run.returncode == 0, run.stderr
    found = np.genfromtxt(tmp_path / "swept.csv", delimiter=",", names=True)
    expected = [euler(490, k, 0.0)[49, 0] for k in (4.0, 5.0, 6.0, 7.0)]
    assert np.abs(found["last"] - expected).max() < 1e-9
    assert not list(scratch.glob("emsim-fmu-*"))

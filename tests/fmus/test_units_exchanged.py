"""FMUs for model exchange as states of the deck: against closed forms, under every method, with state and time events."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from parts import part

import emsim
from emsim.diagnostics import ConvergenceError, DeckError
from emsim.fmus import export

VERSIONS = pytest.mark.parametrize("version", [2, 3])
IMPLICIT = ["auto", "trap", "gear", "radau", "trbdf2", "esdirk", "gauss"]
# what a method holds at reltol 1e-6: its errors go with a power of it (N402 for trap)
HELD = {"trap": 3e-3, "gear": 1e-3, "trbdf2": 1e-3}


def ran(
    file: str,
    card: str,
    lines: str = "",
    tran: str = "10m 2",
    options: str = "reltol=1e-7",
    shown: str = "f.x f.v",
) -> emsim.Result:
    text = f"""t
R1 a 0 1k
FMU f {file} kind=model {card}
{lines}
.tran {tran}
.options {options}
.print tran {shown}
.end
"""
    return emsim.run(text)


@VERSIONS
@pytest.mark.parametrize("can", [None, ""], ids=["directional", "differences"])
def test_an_oscillator(tmp_path: Path, version: int, can: str | None) -> None:
    """x = 2 - cos 3t; an output that is a function of the states; g keeps it above the floor."""
    result = ran(part(tmp_path, version, can), "out=(x v e='the energy') p=(k=9 g=18)", shown="f.x f.v f.e")
    t = np.asarray(result["time"])
    x = 2.0 - np.cos(3 * t)
    assert np.abs(np.asarray(result["f.x"]) - x).max() < 1e-5
    energy = 0.5 * (np.asarray(result["f.v"]) ** 2 + 9 * np.asarray(result["f.x"]) ** 2)
    assert np.abs(np.asarray(result["f.e"]) - energy).max() < 1e-4


@pytest.mark.parametrize("method", IMPLICIT)
def test_every_implicit_method(tmp_path: Path, method: str) -> None:
    result = ran(part(tmp_path, 3), "out=(x v) p=(k=9 g=18)", options=f"reltol=1e-6 method={method}")
    t = np.asarray(result["time"])
    assert np.abs(np.asarray(result["f.x"]) - (2.0 - np.cos(3 * t))).max() < HELD.get(method, 1e-4)


@pytest.mark.parametrize("method", ["rk45", "dop853"])
def test_explicit_methods_refuse_it(tmp_path: Path, method: str) -> None:
    with pytest.raises(ConvergenceError, match="E413") as caught:
        ran(part(tmp_path, 3), "out=(x v)", options=f"method={method}")
    assert "an FMU for model exchange is no formula" in str(caught.value)


@VERSIONS
@pytest.mark.parametrize("can", [None, ""], ids=["directional", "differences"])
def test_in_a_loop_with_a_circuit(tmp_path: Path, version: int, can: str | None) -> None:
    """Force u = -c v(o) with v(o) low-pass of x: three states, one in the circuit; eigenvalues in closed form."""
    result = ran(
        part(tmp_path, version, can), "in=(u=-2*v(o)) out=(x v v(p)=x) p=(g=10 k=4)", "R2 p o 1k\nC2 o 0 1m",
        shown="f.x f.v v(o)", options="reltol=1e-8",
    )  # fmt: skip
    a = np.array([[0.0, 1.0, 0.0], [-4.0, 0.0, -2.0], [1.0, 0.0, -1.0]])
    rest = np.linalg.solve(a, -np.array([0.0, 10.0, 0.0]))
    start = np.array([1.0, 0.0, 1.0]) - rest
    values, vectors = np.linalg.eig(a)
    t = np.asarray(result["time"])
    modes = np.linalg.solve(vectors, start.astype(complex))
    expected = rest + np.real((vectors * modes) @ np.exp(values[:, None] * t)).T
    for column, name in enumerate(("f.x", "f.v", "v(o)")):
        assert np.abs(np.asarray(result[name]) - expected[:, column]).max() < 1e-5, name


def bounces(t: np.ndarray, g: float, e: float) -> tuple[np.ndarray, np.ndarray]:
    """Height and number of bounces of a ball that falls from 1."""
    height, count = np.zeros_like(t), np.zeros_like(t)
    for k, now in enumerate(t):
        start, speed, x, hits = 0.0, 0.0, 1.0, 0
        flight = np.sqrt(2 / g)
        while now - start > flight:
            landing = np.sqrt(2 * g) if hits == 0 else speed
            start, speed, x, hits = start + flight, e * landing, 0.0, hits + 1
            flight = 2 * speed / g
        s = now - start
        height[k], count[k] = x + speed * s - 0.5 * g * s * s, hits
    return height, count


@VERSIONS
@pytest.mark.parametrize("method", ["radau", "trap", "gear"])
def test_a_ball_bounces(tmp_path: Path, version: int, method: str) -> None:
    """State events: speeds that jump, a number that counts them."""
    result = ran(
        part(tmp_path, version), "out=(x v hits) p=(k=0 g=-9.81 e=0.7)", tran="5m 2", shown="f.x f.hits",
        options=f"reltol=1e-6 method={method}",
    )  # fmt: skip
    t = np.asarray(result["time"])
    height, count = bounces(t, 9.81, 0.7)
    assert count[-1] == 4
    assert np.abs(np.asarray(result["f.x"]) - height).max() < (1e-4 if method == "radau" else 5e-3)
    # but for rows at the bounces themselves
    assert np.mean(np.abs(np.asarray(result["f.hits"]) - count) > 1e-6) < 0.05


@VERSIONS
def test_time_events(tmp_path: Path, version: int) -> None:
    """A force that grows by 1 at every tenth of a second."""
    result = ran(
        part(tmp_path, version), "out=(x v s) p=(k=0 rise=1 every=0.1)", tran="10m 1.05", shown="f.v f.s"
    )
    t = np.asarray(result["time"])
    n = np.floor(t / 0.1 + 1e-9)
    speed = 0.1 * n * (n - 1) / 2 + n * (t - 0.1 * n)
    assert np.abs(np.asarray(result["f.v"]) - speed).max() < 1e-6
    assert np.asarray(result["f.s"])[-1] == 10


@VERSIONS
def test_events_behind_every_step(tmp_path: Path, version: int) -> None:
    """Steps do not shrink by them, and the run ends where it is to."""
    result = ran(part(tmp_path, version), "out=(x) p=(k=9 g=18 fault=10)", options="reltol=1e-5", shown="f.x")
    t = np.asarray(result["time"])
    assert np.abs(np.asarray(result["f.x"]) - (2.0 - np.cos(3 * t))).max() < 1e-3
    assert t[-1] == 2.0


@VERSIONS
def test_states_that_jump_as_it_begins(tmp_path: Path, version: int) -> None:
    """x = 2 + cos 3t from x = 3, which it takes in its first event."""
    result = ran(part(tmp_path, version), "out=(x v) p=(k=9 g=18 fault=11)")
    t, x = np.asarray(result["time"]), np.asarray(result["f.x"])
    assert np.abs(x - (2.0 + np.cos(3 * t)))[t > 0].max() < 1e-5


@VERSIONS
def test_what_is_no_output_is_read_too(tmp_path: Path, version: int) -> None:
    """Its derivatives are differences: a source drives an input by what is local."""
    result = ran(
        part(tmp_path, version), "in=(u=-0.5*f.a) out=(x a='der(v)' t=time) p=(k=9 g=18)", shown="f.x f.a f.t"
    )
    t = np.asarray(result["time"])
    x = 2.0 - np.cos(np.sqrt(6.0) * t)
    assert np.abs(np.asarray(result["f.x"]) - x).max() < 1e-5
    assert np.abs(np.asarray(result["f.a"]) - 6.0 * (2.0 - x)).max() < 1e-4
    assert np.abs(np.asarray(result["f.t"]) - t).max() < 1e-9


def test_two_of_one_file_and_one_for_co_simulation(tmp_path: Path) -> None:
    file = part(tmp_path, 3)
    text = f"""three
FMU a {file} kind=model out=(x) p=(g=4)
FMU b {file} kind=model out=(x) p=(g=8)
FMU c {file} kind=cosim step=1m in=(u=b.x) out=(x) p=(k=0)
.tran 10m 1
.options reltol=1e-7
.print tran a.x b.x c.x
.end
"""
    result = emsim.run(text)
    t = np.asarray(result["time"])
    assert np.abs(np.asarray(result["a.x"]) - 1.0).max() < 1e-6
    assert np.abs(np.asarray(result["b.x"]) - (2 - np.cos(2 * t))).max() < 1e-5
    assert np.abs(np.asarray(result["c.x"]) - (1 + t**2 + (np.cos(2 * t) - 1) / 4)).max() < 5e-3


def test_a_second_run_begins_anew(tmp_path: Path) -> None:
    """.op behind .tran, .step: each begins with a fresh instance."""
    text = f"""twice
R1 a 0 1k
FMU f {part(tmp_path, 3)} kind=model out=(x v(o)=hits) p=(k=0 g=-9.81)
R2 o 0 1k
.tran 10m 1
.op
.tran 10m 1
.end
"""
    result = emsim.run(text)
    first, last = [table for table in result.plots if table.kind == "tran"]
    assert abs(np.asarray(first["v(o)"])[-1] - 1) < 1e-9
    assert list(first["v(o)"]) == list(last["v(o)"])


@VERSIONS
@pytest.mark.parametrize(
    ("fault", "said"),
    [
        (1, "gives Error: the part is broken"),
        (7, "ends the simulation"),
        (8, "does not begin"),
        (9, "its next event at a time that has passed"),
    ],
)
def test_failures_are_told(tmp_path: Path, version: int, fault: int, said: str) -> None:
    with pytest.raises(ConvergenceError, match="E516") as caught:
        ran(part(tmp_path, version), f"out=(x v) p=(g=4 fault={fault})")
    assert said in str(caught.value)


@pytest.mark.skipif(os.name == "nt", reason="Windows ends the process by itself")
def test_a_crash_in_a_derivative(tmp_path: Path) -> None:
    deck = tmp_path / "crash.cir"
    deck.write_text(
        f"t\nR1 a 0 1k\nFMU f {part(tmp_path, 3)} kind=model out=(x) p=(g=4 fault=4)\n.tran 10m 1\n.end\n"
    )
    run = subprocess.run(
        [sys.executable, "-m", "emsim", str(deck)], capture_output=True, text=True, cwd=tmp_path
    )
    assert run.returncode == 5
    assert "crashes in fmi3GetContinuousStateDerivatives" in run.stderr


def test_small_signals_go_through(tmp_path: Path) -> None:
    """.ac from a voltage to x: 1 / (k - w^2 + j w d), and no warning that loops are open."""
    text = f"""small signals
V1 in 0 0 ac 1
FMU f {part(tmp_path, 3)} kind=model in=(u=v(in)) out=(v(o)=x) p=(g=4 d=0.5)
R1 o 0 1k
.ac lin 40 0.1 2
.end
"""
    result = emsim.run(text)
    w = 2 * np.pi * np.abs(np.asarray(result["frequency"]))
    expected = 1 / (4 - w**2 + 0.5j * w)
    assert np.abs(np.asarray(result["v(o)"]) - expected).max() < 1e-6
    assert not [d for d in result.diagnostics if d.severity == "warning"]


def test_what_cannot_hold_one_says_so(tmp_path: Path) -> None:
    """An FMU, a session: engines without Python have no libraries of others."""
    text = f"t\nV1 a 0 0\nFMU f {part(tmp_path, 3)} kind=model in=(u=v(a)) out=(x)\n.tran 1m 1\n.fmu in=v1 out=v(a)\n.end\n"
    with pytest.raises(DeckError, match="E383"):
        export(text, str(tmp_path / "outer.fmu"), 3)

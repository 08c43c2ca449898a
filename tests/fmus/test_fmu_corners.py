"""What jumps where a source bends (tests/stability/test_behind_a_corner.py), of FMUs and of pages: they integrated the equations
as they stand, the command line those whose hidden constraints are differentiated."""

from __future__ import annotations

import struct
from pathlib import Path

import fmpy
import numpy as np
import pytest
from support import values_at

import emsim
from emsim.fmus import export
from emsim.fmus.page import computing

TRAPEZOID = "PULSE(0 1 1m 1m 1m 2m)"
# parts that nothing ties together
DECK = f"""\
* a capacitor across a pulse, beside RC; the capacitance from outside
V1 a1 0 {TRAPEZOID}
C1 a1 0 1u
R1 a1 b1 1k
C2 b1 0 1u
* a coil on a ramp and a sine
V3 a3 0 SIN(0 1 400)
R3 a3 b3 2
L3 b3 c3 5m
I3 0 c3 {TRAPEZOID}
* a capacitor between two sources
V4 a4 0 {TRAPEZOID}
C4 a4 b4 1u
V5 b4 0 SIN(0 1 400)
R4 a4 b4 1k
* the inductance from outside
I6 0 a6 {TRAPEZOID}
R6 a6 b6 2
L6 b6 0 5m
* in series with a source that is a parameter
V7 a7 x7 {TRAPEZOID}
V8 x7 0 1
C7 a7 0 1u
R7 a7 0 1k
* a law with a constant
V9 a9 0 {TRAPEZOID}
R9 a9 0 1k
B9 b9 0 V={{1-2*v(a9)}}
C9 b9 0 1u
* a short cutset
V10 a10 0 SIN(0 1 400)
R10 a10 b10 1k
L10 b10 c10 0.7m
I10 0 c10 PWL(0 -1m 2.5m -1.5m)
R11 b10 0 1k
.tran 10u 6m
"""
SHOWN = ("i(v1)", "v(b1)", "v(c3)", "i(v4)", "v(a6)", "i(v7)", "i(b9)", "v(c10)")
CLOSED = f"V1 a 0 {TRAPEZOID}\nR1 a b 1k\nC1 a 0 1u\nC2 b 0 1u\n.tran 10u 6m\n"


def exported(
    folder: Path, cards: str, ports: str, shown: tuple[str, ...], libraries: tuple[str, ...] = ()
) -> str:
    path = str(folder / "model.fmu")
    text = f"deck\n{cards}.fmu {ports} out={','.join(shown)}\n.end\n"
    export(text, path, 3, libraries=libraries)
    return path


@pytest.mark.parametrize("method", ["auto", "esdirk"])
def test_rows_of_an_fmu_are_those_of_the_command_line(tmp_path: Path, method: str) -> None:
    options = f".options method={method} reltol=1e-6\n"
    result = emsim.run(f"deck\n{DECK}{options}.save {' '.join(SHOWN)}\n.end\n")
    path = exported(tmp_path, DECK + options, "in=l6,c2 param=r1,v8,r11 tune=c1,r3,r4", SHOWN)
    found = fmpy.simulate_fmu(path, stop_time=6e-3, output_interval=1e-5)
    t = found["time"]
    # at a corner itself there are two values
    clear = np.abs(t[:, None] - np.array([0.0, 1e-3, 2e-3, 2.5e-3, 4e-3, 5e-3])).min(axis=1) > 1e-9
    for name in SHOWN:
        right = values_at(result, name, t)
        assert np.abs(found[name] - right)[clear].max() < 1e-5 * np.ptp(right), name


@pytest.mark.parametrize("method", ["auto", "esdirk"])
def test_values_of_a_session_are_those_of_the_command_line(method: str) -> None:
    options = f".options method={method} reltol=1e-6\n"
    result = emsim.run(f"deck\n{DECK}{options}.save {' '.join(SHOWN)}\n.end\n")
    s = emsim.Session(f"deck\n{DECK}{options}.end\n", "l6,c2", SHOWN, "c1,r3,r4")
    times = np.arange(0.0, 6e-3, 1e-5) + 3e-7  # soon behind the corners
    found = []
    for t in times:
        s.run(t)
        found.append(list(s.values().values()))
    for name, values in zip(SHOWN, np.array(found).T, strict=True):
        right = values_at(result, name, times)
        assert np.abs(values - right).max() < 1e-5 * np.ptp(right), name


CUTSET = f"""\
I1 0 n {TRAPEZOID}
R1 n 0 10
L1 n p 10m
R2 p 0 20
E1 m 0 n 0 1
C1 m 0 1u
.tran 10u 6m
"""


def test_a_capacitance_and_an_inductance_in_one_constraint_come_both_from_outside(tmp_path: Path) -> None:
    """v = R1 (I - i), L i' = v - R2 i, i(e1) = -C v'. By trap 50 % of range off."""
    options = ".options method=trap\n"
    path = exported(tmp_path, CUTSET + options, "param=l1,c1", ("i(e1)",))
    found = fmpy.simulate_fmu(path, stop_time=6e-3, output_interval=1e-5)
    t, tau = found["time"], 10e-3 / 30.0
    clear = np.abs(t[:, None] - np.array([0.0, 1e-3, 2e-3, 4e-3, 5e-3])).min(axis=1) > 1e-9
    bends = zip((1e-3, 2e-3, 4e-3, 5e-3), (1e3, -1e3, -1e3, 1e3), strict=True)
    # v' = R1 I' - R1 i', i' = (R1/(R1+R2)) I' (1 - exp(-s/tau))
    slope = sum(
        np.where(t > at, by * (1 - (1 - np.exp(-np.maximum(t - at, 0) / tau)) / 3), 0.0) for at, by in bends
    )
    right = -1e-6 * 10.0 * slope
    assert np.abs(found["i(e1)"] - right)[clear].max() < 1e-3 * np.ptp(right)


@pytest.mark.parametrize(
    ("cards", "ports", "shown", "says"),
    [
        (CLOSED, "in=v1", ("i(v1)",), "`v1` cannot come from outside: `i(v1)` follows from slopes"),
        (CLOSED, "in=v1", ("v(b)", "i(v1)*2"), "`i(v1)*2` follows from slopes"),
        ("I2 0 b 1\nL2 b 0 1m\n.tran 10u 6m\n", "in=i2", ("v(b)",), "`i2` cannot"),
        # a sum of rows in which a capacitance stands that comes from outside
        (
            f"I1 0 a {TRAPEZOID}\nC1 a b 1u\nC2 b c 1u\nL1 c 0 1m\n.tran 10u 6m\n",
            "param=c2",
            ("v(c)",),
            "`c2` cannot",
        ),
        # a gain in the constraint itself
        (
            CLOSED.replace(
                ".tran", "E1 e 0 a 0 2\nC3 e 0 1u\nB1 f 0 V={g*v(a)}\nC4 f 0 1u\n.param g=2\n.tran"
            ),
            "param=g",
            ("i(e1)", "i(b1)"),
            "`g` cannot come from outside: `i(b1)`",
        ),
        # by a condition
        *(
            (
                f"V1 a 0 {TRAPEZOID}\nB1 f 0 V={{{law}}}\nC1 f 0 1u\n.param g=2\n.tran 10u 6m\n",
                "param=g",
                ("i(b1)",),
                "`g` cannot come from outside: `i(b1)`",
            )
            for law in ("max(g,1)*v(a)", "if(g>1,2,3)*v(a)", "int(g)*v(a)")
        ),
        # what follows from the current is a state
        (
            CLOSED.replace(".tran", "F1 0 d V1 1\nC3 d 0 1u\nR3 d 0 1k\n.tran"),
            "in=v1",
            ("v(d)",),
            "`v(d)` follows from slopes",
        ),
    ],
)
def test_a_slope_that_nobody_knows_is_refused(
    tmp_path: Path, cards: str, ports: str, shown: tuple[str, ...], says: str
) -> None:
    with pytest.raises(emsim.DeckError, match="E381") as said:
        exported(tmp_path, cards, ports, shown)
    assert says in str(said.value)


def test_a_session_refuses_them_as_well() -> None:
    with pytest.raises(emsim.DeckError, match="E381") as said:
        emsim.Session(f"deck\n{CLOSED}.end\n", "v1", "i(v1)")
    assert "`v1` cannot come from outside: `i(v1)` follows" in str(said.value)


@pytest.mark.parametrize(
    ("cards", "ports", "shown"),
    [
        (CLOSED, "in=v1", ("v(b)",)),  # nothing shows the current
        (CLOSED, "param=c2,r1", ("i(v1)",)),  # in no loop of sources
        (CLOSED.replace(TRAPEZOID, "5"), "param=v1", ("i(v1)",)),  # nothing has a slope
        (CLOSED, "tune=v1", ("i(v1)",)),  # nor has what is set between two steps
    ],
)
def test_what_follows_from_no_slope_stays_open(
    tmp_path: Path, cards: str, ports: str, shown: tuple[str, ...]
) -> None:
    library = tmp_path / "any.so"
    library.write_bytes(b"\x7fELF" + bytes(14) + struct.pack("<H", 0xB7) + b" fmi3InstantiateCoSimulation")
    exported(tmp_path, cards, ports, shown, (str(library),))


def test_a_page_gives_up_what_would_keep_it_from_computing() -> None:
    """A gain in a loop of capacitors and sources is no number to the page's engine: it is not moved, the rest is."""
    text = f"gain\n.param g=2 r=1k\nV1 a 0 {TRAPEZOID}\nB1 f 0 V={{g*v(a)}}\nC4 f 0 1u\nR1 f 0 {{r}}\n.tran 10u 6m\n.end\n"
    model = computing(text, emsim.run(text).main, {}, {})
    assert model is not None
    assert [name for name, *_ in model.inputs] == ["r", "c4"]


def test_a_page_is_without_hands_where_these_would_keep_it_from_computing() -> None:
    """A hand on the switch is added to its control, and makes a factor of the cutset's constraint."""
    text = f"hand\n{CUTSET.replace('R1 n 0 10', 'S1 n 0 0 0 sm')}.model sm vswitch von=1 voff=-1 ron=1 roff=100\n.end\n"
    model = computing(text, emsim.run(text).main, {}, {})
    assert model is not None
    assert not model.hands
    assert [name for name, *_ in model.inputs] == ["l1", "r2", "c1"]

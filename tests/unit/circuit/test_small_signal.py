"""`.ac`, `.dc` and `.tf` against closed forms and against ngspice; the engine's linearised equations."""

from __future__ import annotations

import math
import subprocess

import numpy as np
import pytest
from support import needs_ngspice

import emsim
from emsim import pipeline
from emsim.outputs import load, raw

TIGHT = ".options reltol=1e-9 abstol=1e-18 vntol=1e-15"
# every linear element, a transformer, all controlled sources, diodes that are on and off, charges of junctions
MIXED = f"""everything linear, and diodes
V1 in 0 dc 0.8 ac 2 30 sin(0 1 1k)
I1 0 c dc 1m ac 1m -45
R1 in a 1k
C1 a 0 10n
L1 a b 10m
L2 c 0 40m
K1 L1 L2 0.8
R2 b 0 500
R3 c d 2k
D1 d 0 dm
D2 0 d dm
E1 e 0 a 0 2
R4 e f 1k
G1 f 0 c 0 1m
R5 f 0 3k
Vs g 0 0
R6 f g 1k
F1 h 0 Vs 5
R7 h 0 100
H1 k 0 Vs 200
R8 k 0 1k
B1 m 0 v=v(a)*v(f)+0.1*v(b)^2
R9 m 0 1k
.model dm d is=1e-12 n=1.5 cjo=10p tt=5n rs=2
{TIGHT}
"""


def oracle(tmp_path, text: str) -> list:
    """ngspice's own tables."""
    (tmp_path / "deck.cir").write_text(text)
    command = ["ngspice", "-b", "-r", "out.raw", "deck.cir"]
    subprocess.run(command, cwd=tmp_path, capture_output=True, timeout=60, stdin=subprocess.DEVNULL)
    return raw.read(str(tmp_path / "out.raw")).plots


def assert_same(ours, theirs, rtol: float = 1e-6) -> None:
    assert len(ours) == len(theirs) and ours.names[0] == theirs.names[0]
    np.testing.assert_allclose(
        ours.column(ours.names[0]), theirs.column(theirs.names[0]), rtol=1e-12, atol=1e-15
    )
    shared = [n for n in ours.signals if theirs.has_column(n)]
    assert len(shared) >= len(theirs.signals) - 1
    for name in shared:
        a, b = ours.column(name), theirs.column(name)
        assert np.abs(a - b).max() <= rtol * np.abs(b).max() + 1e-15, name


@needs_ngspice
@pytest.mark.ngspice
@pytest.mark.parametrize("sweep", ["dec 5 10 1meg", "oct 2 3 50", "lin 7 1k 4k", "dec 3 1 50", "lin 1 1k 1k"])
def test_small_signals_as_ngspice(tmp_path, sweep):
    text = MIXED + f".ac {sweep}\n.end\n"
    (theirs,) = oracle(tmp_path, text)
    table = emsim.run(text).table("ac")
    assert table.axis.log == (not sweep.startswith("lin")) and table.is_complex("v(c)")
    assert_same(table, theirs)


@needs_ngspice
@pytest.mark.ngspice
def test_functions_of_complex_columns_as_ngspice_prints_them(tmp_path):
    """vdb vp vm vr vi of nodes and differences, in dB and in rad."""
    words = "v(c) vdb(c) vp(c) vm(a,b) vr(c) vi(c)"
    text = MIXED + f".ac dec 2 100 10k\n.print ac {words}\n.end\n"
    (tmp_path / "d.cir").write_text(text)
    done = subprocess.run(
        ["ngspice", "-b", "d.cir"], cwd=tmp_path, capture_output=True, text=True, timeout=60
    )
    said: dict[str, list[float]] = {}
    names: list[str] = []
    for line in done.stdout.splitlines():
        cells = line.replace(",", " ").split()
        if cells[:1] == ["Index"]:
            names = cells[2:]
            names = [n for name in names for n in ([name] * 2 if name == "v(c)" else [name])]
        elif names and cells and cells[0].isdigit():
            for name, value in zip(names, cells[2:], strict=True):
                said.setdefault(name, []).append(float(value))
    r = emsim.run(text)
    for name in ("vdb(c)", "vp(c)", "vr(c)", "vi(c)"):
        np.testing.assert_allclose(r[name], said[name], rtol=2e-5)
    assert r.units["vdb(c)"] == "dB" and r.units["vp(c)"] == "rad"
    np.testing.assert_allclose(r["db(v(c)/v(in))"], 20 * np.log10(abs(r["v(c)"] / r["v(in)"])))


@needs_ngspice
@pytest.mark.ngspice
@pytest.mark.parametrize(
    "card",
    [
        "V1 -1 3 0.05",
        "I1 0 5m 1m V1 0 1 0.5",
        "temp -40 125 33",
        "R3 100 10k 900",
        "V1 3 -1 -0.25",
        "I1 0 2m 1m temp 0 50 25",
    ],
)
def test_operating_points_along_a_sweep_as_ngspice(tmp_path, card):
    text = MIXED + f".dc {card}\n.end\n"
    (theirs,) = oracle(tmp_path, text)
    assert_same(emsim.run(text).table("dc"), theirs, 2e-6)


@needs_ngspice
@pytest.mark.ngspice
@pytest.mark.parametrize("card", ["v(c) V1", "v(a,b) V1", "v(h) I1", "i(Vs) V1"])
def test_gains_and_resistances_as_ngspice(tmp_path, card):
    text = MIXED + f".tf {card}\n.end\n"
    (theirs,) = oracle(tmp_path, text)
    ours = emsim.run(text).table("tf")
    # of the current of a source ngspice gives 1e20 for the resistance at the output, whatever it is
    for name in ours.names[: 2 if card.startswith("i(") else 3]:
        (other,) = (n for n in theirs.names if name in n.lower())
        assert ours[name][0] == pytest.approx(theirs[other][0], rel=1e-6), name


def test_resistance_at_the_current_of_a_source():
    r = emsim.run("t\nV1 a 0 1\nR1 a b 1k\nR2 b 0 2k\nR3 b c 3k\nV2 c 0 0\n.tf i(V2) V1\n.end\n").table("tf")
    assert r["v2#output_impedance"][0] == pytest.approx(3e3 + 1 / (1 / 1e3 + 1 / 2e3), rel=1e-12)


MOTOR = """a DC motor with inertia and friction
V1 a 0 dc 0 ac 1
BODY rotor m=1 j=2m
JOINT shaft 0 rotor pin
MOTOR m1 a 0 shaft r=0.5 l=3m kt=0.1
DAMPER d1 shaft c=1m
.ac dec 10 1m 1k
.end
"""


def test_a_motor_with_inertia_is_its_transfer_function():
    """omega/v = kt / ((R + s L)(c + s J) + kt^2), the circuit and the machine in one matrix."""
    r = emsim.run(MOTOR)
    s = 2j * math.pi * r["frequency"]
    answer = 0.1 / ((0.5 + s * 3e-3) * (1e-3 + s * 2e-3) + 0.01)
    np.testing.assert_allclose(r["omega(shaft)"], answer, rtol=1e-9)
    np.testing.assert_allclose(r["angle(shaft)"], answer / s, rtol=1e-9)
    current = (1e-3 + s * 2e-3) / 0.1 * answer
    np.testing.assert_allclose(r["i(m1)"], current, rtol=1e-9)


def test_a_pendulum_at_rest_has_its_frequency():
    text = """hanging
.gravity 9.81
BODY bob m=0.5 j=0 com=(0,-0.4)
JOINT pivot 0 bob pin
DAMPER d pivot c=1m
V1 a 0 dc 0 ac 1
MOTOR m1 a 0 pivot r=1k kt=0.1
.ac lin 2001 0.6 1
.end
"""
    r = emsim.run(text)
    found = r["frequency"][np.argmax(abs(r["angle(pivot)"]))]
    assert found == pytest.approx(math.sqrt(9.81 / 0.4) / (2 * math.pi), abs=3e-4)
    assert not [d for d in r.diagnostics if d.code == "W306"]


def test_a_switch_keeps_its_state_along_a_sweep():
    """A hysteresis of 1 V about 2 V: on the way up it closes at 3, on the way down it opens at 1."""
    text = "t\nV1 c 0 0\nV2 a 0 1\nR1 a b 1k\nS1 b 0 c 0 sw\n.model sw sw vt=2 vh=1 ron=1 roff=1e9\n.dc V1 {} {} {}\n.end\n"
    up, down = emsim.run(text.format(0, 4, 0.25)), emsim.run(text.format(4, 0, -0.25))
    assert up["v-sweep"][up["v(b)"] < 0.5][0] == pytest.approx(3.25, abs=0.26)
    assert down["v-sweep"][down["v(b)"] > 0.5][0] == pytest.approx(0.75, abs=0.26)


def test_a_sweep_within_a_sweep_has_a_dimension_for_each():
    r = emsim.run("t\nV1 a 0 1\nV2 c 0 0\nR1 a b 1k\nR2 b c 1k\n.dc V1 0 2 1 V2 0 4 2\n.end\n")
    table = r.main
    assert table.steps == ["sweep(v2)"] and table.blocks() == [(0, 3), (3, 6), (6, 9)]
    shaped = r.to_xarray()
    assert shaped["v(b)"].dims == ("sweep(v2)", "v-sweep")
    assert shaped["v(b)"].sel({"sweep(v2)": 4, "v-sweep": 1}) == pytest.approx(2.5)
    with pytest.raises(ValueError, match="several courses"):
        r.at("v(b)", 1.0)


def test_adjoint_and_pencil_are_those_of_the_equations():
    flat = pipeline.read(MIXED + ".ac dec 1 1 10\n.end\n")
    assembly, _ = pipeline.prepare(flat)
    ctx, s = assembly.ctx, (3e3, 5e4)
    linear, why = assembly.system.small_signal(assembly.options)
    assert why is None
    output, rows = ctx.v("m"), [(ctx.nodes["a"], (1.0, 0.0))]
    direct = np.frombuffer(linear.respond([s], [output], [], rows)[0], complex)[0]
    re, im = linear.adjoint(s, output)[ctx.nodes["a"]]
    assert complex(re, im) == pytest.approx(direct, rel=1e-10)
    # and (G + s C) X = b by a dense solution
    indptr, indices, g, c = linear.pencil()
    n = assembly.system.n
    matrix = np.zeros((n, n), complex)
    for col in range(n):
        for k in range(indptr[col], indptr[col + 1]):
            matrix[indices[k], col] += g[k] + complex(*s) * c[k]
    b = np.zeros(n, complex)
    b[ctx.nodes["a"]] = 1.0
    assert np.linalg.solve(matrix, b)[ctx.nodes["m"]] == pytest.approx(direct, rel=1e-9)


@pytest.mark.parametrize(
    ("card", "code"),
    [
        (".ac dec 10 0 1k", "E305"), (".ac 10 1 1k", "E305"), (".ac dec 10 1k 1", "E305"), (".ac dec 0 1 1k", "E305"),
        (".dc V1 0 1 0", "E305"), (".dc V1 0 1", "E305"), (".dc V9 0 1 1", "E309"),
        (".dc C1 0 1 1", "E305"), (".tf v(a)", "E305"), (".tf v(a) R1", "E309"), (".tf db(v(a)) V1", "E305"),
    ],
)  # fmt: skip
def test_cards_that_make_no_sense(card, code):
    with pytest.raises(emsim.DeckError, match=code):
        emsim.run(f"t\nV1 a 0 1\nR1 a b 1k\nC1 b 0 1u\n{card}\n.end\n")


def test_a_temperature_that_a_parameter_reads_cannot_be_swept():
    with pytest.raises(emsim.DeckError, match="E309"):
        emsim.run("t\n.param r={100*temper}\nV1 a 0 1\nR1 a 0 {r}\n.dc temp 0 50 25\n.end\n")


@pytest.mark.parametrize("ending", ["raw", "csv", "parquet", "nc"])
@pytest.mark.parametrize("card", [".ac dec 3 10 1k", ".dc V1 0 2 1 V2 0 4 2"])
def test_files_give_back_what_was_written(tmp_path, ending, card):
    pytest.importorskip({"parquet": "pyarrow", "nc": "h5netcdf"}.get(ending, "emsim"))
    text = f"t\nV1 a 0 dc 1 ac 1\nV2 c 0 0\nR1 a b 1k\nC1 b c 1u\nR2 b c 1k\n{card}\n.print ac vdb(b) vp(b)\n.end\n"
    r = emsim.run(text)
    path = str(tmp_path / f"x.{ending}")
    r.save(path)
    back = load(path)
    assert back.names == r.names and back.main.axis.name == r.main.axis.name and back.analysis == r.analysis
    for name in r.names:
        np.testing.assert_allclose(back[name], r[name], rtol=1e-15, err_msg=name)
        assert back.main.is_complex(name) == r.main.is_complex(name)


@needs_ngspice
@pytest.mark.ngspice
def test_ngspice_loads_a_complex_raw_file(tmp_path):
    r = emsim.run("t\nV1 a 0 dc 1 ac 1\nR1 a b 1k\nC1 b 0 1u\n.ac dec 3 10 1k\n.end\n")
    r.save(str(tmp_path / "x.raw"))
    (tmp_path / "d.cir").write_text(
        "t\nR1 a 0 1\n.control\nload x.raw\nprint db(v(b))[6]\nquit 0\n.endc\n.end\n"
    )
    done = subprocess.run(
        ["ngspice", "-b", "d.cir"], cwd=tmp_path, capture_output=True, text=True, timeout=60
    )
    said = float(done.stdout.split("db(v(b))[6] =")[1].split()[0])
    assert said == pytest.approx(r["db(v(b))"][6], rel=1e-5)


def test_a_value_that_depends_on_the_frequency_is_refused_under_ac():
    deck = "hertz\nV1 a 0 dc 1 ac 1\nB1 b 0 V={v(a)*hertz}\nR1 b 0 1k\n.ac dec 5 1 1k\n.end\n"
    with pytest.raises(emsim.DeckError, match="hertz"):
        emsim.run(deck)


def test_pivots_that_are_kept_along_a_sweep_give_what_each_frequency_gives_alone():
    """Sections that turn over at frequencies twelve decades apart: no choice of pivots serves them all."""
    cards = ["V1 n0 0 AC 1"]
    for k in range(12):
        cards += [f"R{k} n{k} n{k + 1} {10.0 ** (k - 4):g}", f"C{k} n{k + 1} 0 {10.0 ** (-k - 3):g}"]
        cards += [f"L{k} n{k + 1} m{k} {10.0 ** (k - 8):g}", f"RL{k} m{k} 0 {10.0 ** (6 - k):g}"]
    deck = "sections\n" + "\n".join(cards) + "\n"
    swept = emsim.run(f"{deck}.ac dec 40 1m 1g\n.end\n").table("ac")
    for k in range(0, len(swept), 23):
        f = float(swept["frequency"][k])
        alone = emsim.run(f"{deck}.ac lin 1 {f!r} {f!r}\n.end\n").table("ac")
        for node in ("v(n1)", "v(n6)", "v(n12)", "i(l5)"):
            assert abs(swept[node][k] - alone[node][0]) <= 1e-12 * abs(alone[node][0])

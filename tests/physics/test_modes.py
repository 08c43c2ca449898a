"""`.modes` and `.pz` against closed forms: pendulums, torsion lines, links; and against ngspice.

Infinite eigenvalues of the pencil, far stiff ones and free motions are what a plain QZ gets wrong.
"""

from __future__ import annotations

import math
import subprocess

import numpy as np
import pytest
from support import needs_ngspice

import emsim
from emsim.interop.ngspice import named_alike
from emsim.outputs import raw


def modes(deck: str):
    return emsim.run(deck + "\n.modes\n.end\n").table("modes")


def natural(m, k) -> np.ndarray:
    """Frequencies [Hz] of M q'' + K q = 0."""
    squares = np.linalg.eigvals(np.linalg.solve(np.asarray(m, float), np.asarray(k, float)))
    return np.sort(np.sqrt(np.abs(squares.real))) / (2 * np.pi)


def test_a_double_pendulum():
    table = modes(
        "double\n.gravity 9.81\nBODY a m=1 j=0.02 com=(0.4,0)\nBODY b m=0.7 j=0.01 com=(0.3,0)\nPOINT a.end 0.5 0\n"
        "JOINT h 0 a pin ic=-90deg\nJOINT k a.end b pin"
    )
    g, l = 9.81, 0.5  # noqa: E741
    # absolute angles of the two rods
    m = [[0.02 + 1 * 0.16 + 0.7 * l * l, 0.7 * l * 0.3], [0.7 * l * 0.3, 0.01 + 0.7 * 0.09]]
    k = [[g * (1 * 0.4 + 0.7 * l), 0], [0, g * 0.7 * 0.3]]
    np.testing.assert_allclose(table["frequency"], natural(m, k), rtol=1e-9)
    assert (table["damping"] == 0.0).all()
    # the slow mode swings both to one side, the fast one against each other
    square = (2 * np.pi * table["frequency"]) ** 2
    for row in range(2):
        a = np.asarray(k, float) - square[row] * np.asarray(m)
        ratio = -a[0, 0] / a[0, 1]  # second angle by first
        shown = 1 + table["angle(k)"][row] / table["angle(h)"][row]  # angle(k) counts from the first rod
        assert shown == pytest.approx(ratio, rel=1e-8)


TORSION = """three discs on two shafts
BODY a m=1 j=1
BODY b m=1 j=2
BODY c m=1 j=3
JOINT ja 0 a pin
JOINT jb a b pin
JOINT jc b c pin
SPRING s1 jb k=100
SPRING s2 jc k=300"""


def test_a_torsion_line_of_three_masses_is_free_twice():
    table = modes(TORSION)
    expected = natural(np.diag([1, 2, 3]), [[100, -100, 0], [-100, 400, -300], [0, -300, 300]])
    f = table["frequency"]
    np.testing.assert_array_equal(f[:2], 0.0)
    np.testing.assert_array_equal(table["rate"][:2], 0.0)
    np.testing.assert_allclose(f[2:], expected[1:], rtol=1e-9)


def test_a_beam_of_twenty_links():
    """Links without mass between equal discs and equal springs, clamped at one end: 2 sqrt(k/j) sin((2 i - 1) pi/(4 n + 2))."""
    n, j, k = 20, 0.3, 700.0
    lines = ["beam"]
    for i in range(n):
        on = "0" if i == 0 else f"b{i - 1}"
        lines += [f"BODY b{i} m=1 j={j}", f"JOINT h{i} {on} b{i} pin", f"SPRING s{i} h{i} k={k}"]
    table = modes("\n".join(lines))
    expected = [
        2 * math.sqrt(k / j) * math.sin((2 * i - 1) * math.pi / (4 * n + 2)) / (2 * math.pi)
        for i in range(1, n + 1)
    ]
    np.testing.assert_allclose(table["frequency"], expected, rtol=1e-9)


def test_a_beam_that_bends():
    """Twenty rods that hang by pins: the chain's frequencies by its mass and stiffness matrices in absolute angles."""
    n, m, l, g = 20, 0.1, 0.2, 9.81  # noqa: E741
    lines = ["chain", f".gravity {g}"]
    for i in range(n):
        on = "0" if i == 0 else f"b{i - 1}.e"
        lines += [
            f"BODY b{i} m={m} shape=rod({l})",
            f"POINT b{i}.e {l} 0",
            f"JOINT h{i} {on} b{i} pin" + (" ic=-90deg" if i == 0 else ""),
        ]
    table = modes("\n".join(lines))
    below = np.arange(n, 0, -1) - 0.5  # rods that hang on each, itself as a half
    mass = np.array([[m * l * l * below[max(a, b)] for b in range(n)] for a in range(n)], float)
    mass[np.diag_indices(n)] = m * l * l * (np.arange(n, 0, -1) - 1 + 1 / 3)
    np.testing.assert_allclose(table["frequency"], natural(mass, np.diag(m * g * l * below)), rtol=1e-9)


def test_a_closed_loop_has_the_modes_of_what_moves():
    """A parallelogram of four rods swings as one pendulum: J/(m l) of two cranks and a coupler."""
    deck = (
        "parallelogram\n.gravity 9.81\nBODY a m=1 shape=rod(0.5)\nBODY c m=2 shape=rod(1)\nBODY b m=1 shape=rod(0.5)\n"
        "POINT a.e 0.5 0\nPOINT b.e 0.5 0\nPOINT c.e 1 0\nPOINT 0.r 1 0\n"
        "JOINT ja 0 a pin ic=-90deg\nJOINT jc a.e c pin ic=90deg\nJOINT jb 0.r b pin ic=-90deg\nJOINT jr c.e b.e pin"
    )
    table = modes(deck)
    inertia = 2 * (1 * 0.25 / 3) + 2 * 0.25
    assert table["frequency"] == pytest.approx(
        [math.sqrt(9.81 * (2 * 1 * 0.25 + 2 * 0.5) / inertia) / (2 * math.pi)], rel=1e-9
    )


def test_damping_and_growth():
    table = modes("a mass\nBODY b m=2\nJOINT j 0 b slide axis=(1,0)\nSPRING s j k=50\nDAMPER d j c=4")
    assert table["damping"][0] == pytest.approx(4 / (2 * math.sqrt(50 * 2)), rel=1e-12)
    assert table["rate"][0] == pytest.approx(1.0, rel=1e-12)
    falls = modes("on its head\n.gravity 9.81\nBODY b m=1 j=0 com=(1,0)\nJOINT j 0 b pin ic=90deg")
    assert sorted(falls["rate"]) == pytest.approx([-math.sqrt(9.81), math.sqrt(9.81)], rel=1e-9)


def test_a_motor_on_its_supply_has_the_modes_of_both_worlds():
    """Coil, inertia, a bypass capacitor behind a resistor: eigenvalues of the three equations in closed form."""
    r, l, k, j, b, c, rs = 2.0, 1e-3, 0.1, 1e-4, 1e-4, 1e-6, 10.0  # noqa: E741
    table = modes(
        f"motor\nv1 in 0 12\nrs in a {rs}\nc1 a 0 {c}\nMOTOR m a 0 j kt={k} r={r} l={l}\nBODY rotor m=1 j={j}\n"
        f"JOINT j 0 rotor pin\nDAMPER d j c={b}"
    )
    a = np.array([[-1 / (rs * c), -1 / c, 0], [1 / l, -r / l, -k / l], [0, k / j, -b / j]])
    expected = np.linalg.eigvals(a)
    found = -table["rate"] + 2j * np.pi * table["frequency"]
    for s in expected[expected.imag >= 0]:
        assert np.abs(found - s).min() <= 1e-9 * abs(s)
    assert len(found) == 1 + (expected.imag >= 0).sum()  # and the angle, which is free
    assert "mode" in table.names and table.unit("frequency") == "Hz"


def test_slow_poles_beside_fast_ones_keep_their_digits():
    lines = ["stiff", "v1 n0 0 0"]
    taus = [10.0 ** (-k) for k in range(0, 15, 2)]
    for k, tau in enumerate(taus):
        lines += [f"e{k} m{k} 0 n0 0 1", f"r{k} m{k} p{k} 1", f"c{k} p{k} 0 {tau!r}"]
    table = modes("\n".join(lines))
    np.testing.assert_allclose(np.sort(table["rate"]), np.sort(1 / np.array(taus)), rtol=1e-10)


PZ = {
    "two capacitors and a coil": "r0 in 0 1k\nr1 in out 1k\nc2 in out 2n\nl1 out o3 1m\nr2 o3 0 2k\nc1 out 0 1n",
    "a capacitor across the input": "c0 in 0 1n\nr1 in out 1k\nc1 out 0 2n\nr2 out 0 3k\nc3 out 0 1n",
    "Sallen and Key": "r1 in a 10k\nr2 a b 10k\nc1 a out 20n\nc2 b 0 5n\ne1 out 0 b 0 1",
    "a coil in series with a coil": "l1 in a 1m\nl2 a b 2m\nr1 b out 50\nc1 out 0 1u\nr2 out 0 1k",
    "a junction": "i1 0 out 1m\nd1 out 0 dm\nr1 in out 1k\nc1 out 0 1n\n.model dm d is=1e-14 cjo=10p tt=1n",
    "bridged T": "r1 in a 10k\nr2 a out 10k\nc1 in b 1n\nc2 b out 1n\nr3 b 0 5k\nc3 a 0 2n\nr4 out 0 100k",
}  # fmt: skip


@needs_ngspice
@pytest.mark.ngspice
@pytest.mark.parametrize("drive", ["vol", "cur"])
@pytest.mark.parametrize("name", PZ)
def test_poles_and_zeros_as_ngspice(tmp_path, name, drive):
    text = f"pz\n{PZ[name]}\n.pz in 0 out 0 {drive} pz\n.options reltol=1e-9\n.end\n"
    (tmp_path / "deck.cir").write_text(text)
    command = ["ngspice", "-b", "-r", "out.raw", "deck.cir"]
    subprocess.run(command, cwd=tmp_path, capture_output=True, timeout=60, stdin=subprocess.DEVNULL)
    theirs = named_alike(raw.read(str(tmp_path / "out.raw"))).plots[-1]
    ours = emsim.run(text).table("pz")
    for word in ("pole", "zero"):
        a, b = ([t.column(n)[0] for n in t.names if n.startswith(word)] for t in (ours, theirs))
        assert len(a) == len(b), (word, a, b)
        left = list(a)
        for s in b:
            nearest = min(left, key=lambda z: abs(z - s))
            assert abs(nearest - s) <= 1e-6 * abs(s), (word, a, b)
            left.remove(nearest)


def test_a_source_that_drives_the_input_is_the_input():
    r = emsim.run(
        "rc\nv1 in 0 1\nr1 in out 1k\nr2 out 0 1k\nc1 in out 1u\n.pz in 0 out 0 vol pz\n.end\n"
    ).table("pz")
    assert r.column("pole(1)")[0] == pytest.approx(-2000.0, rel=1e-12)
    assert r.column("zero(1)")[0] == pytest.approx(-1000.0, rel=1e-12)
    assert r.names == ["pole(1)", "zero(1)"] and r.unit("pole(1)") == "1/s"


def test_nodes_may_be_numbers():
    r = emsim.run("rc\nv1 1 0 1\nr1 1 2 1k\nc1 2 0 1u\n.pz 1 0 2 0 vol pol\n.end\n").table("pz")
    assert r.column("pole(1)")[0] == pytest.approx(-1000.0, rel=1e-12)


def test_nothing_arrives_at_the_output():
    with pytest.raises(emsim.ConvergenceError, match="E411"):
        emsim.run("rc\nv1 a 0 1\nr1 a b 1k\nc1 b 0 1u\nr2 c 0 1\nc2 c 0 1\n.pz b 0 c 0 cur zer\n.end\n")


@pytest.mark.parametrize(
    "card",
    [".pz b 0 a 0 vol", ".pz b b a 0 vol pz", ".pz b 0 a 0 volt pz", ".pz a 0 b 0 vol poles", ".modes 3"],
)
def test_what_is_no_card(card):
    with pytest.raises(emsim.DeckError, match="E305"):
        emsim.run(f"rc\nv1 a 0 1\nr1 a b 1k\nc1 b 0 1u\n{card}\n.end\n")


def test_an_unknown_node_is_named():
    with pytest.raises(emsim.DeckError, match="E309"):
        emsim.run("rc\nv1 a 0 1\nr1 a b 1k\nc1 b 0 1u\n.pz a 0 bb 0 vol pz\n.end\n")

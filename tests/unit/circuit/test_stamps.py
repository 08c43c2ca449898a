"""Every linear element's stamps, against matrices written by hand; rows in the order of the unknowns."""

from __future__ import annotations

import numpy as np
import pytest
from circuit_decks import deck

import emsim


def matrices(*lines: str) -> tuple[list[str], np.ndarray, np.ndarray, emsim.System]:
    s = emsim.compile(deck(*lines, ".tran 1m 1"))
    x = np.zeros(s.n)
    return s.names, s.C(x).toarray(), s.G(x).toarray(), s


def test_resistor_and_capacitor() -> None:
    names, c, g, _ = matrices("R1 a b 4", "C1 a b 3u", "R2 b 0 2", "C2 a 0 5u")
    assert names == ["a", "b"]
    np.testing.assert_allclose(g, [[0.25, -0.25], [-0.25, 0.75]], atol=1e-11)
    np.testing.assert_allclose(c, [[8e-6, -3e-6], [-3e-6, 3e-6]])


@pytest.mark.parametrize("ratio", [1e-3, 1e6], ids=["firm", "loose"])
def test_one_row_of_an_island_is_the_sum_of_its_rows(ratio: float) -> None:
    """Where resistances do not hold two nodes that a capacitor ties, one of their rows is the sum, and stores nothing."""
    cards = ("V1 s 0 2", f"R1 s a {4 * ratio:g}", "C1 a b 3u", f"R2 b 0 {2 * ratio:g}", "D1 b s d", "D2 a x d", "R3 x 0 7",
             "B1 a b I={v(s)*v(a,b)}", ".model d d(is=1n rs=0)")  # fmt: skip
    names, c, g, s = matrices(*cards)
    a, b = names.index("a"), names.index("b")
    # the conductance of the diodes at 0 V: 1 nA over k T/q at 27 C, and gmin
    d = 1e-9 / (1.380649e-23 * 300.15 / 1.602176634e-19) + 1e-12
    nodal = {
        a: {"a": 0.25 / ratio + d, "s": -0.25 / ratio, "x": -d},
        b: {"b": 0.5 / ratio + d, "s": -d},
    }
    row = {k: np.array([nodal[k].get(name, 0.0) for name in names]) for k in (a, b)}
    total = [k for k in (a, b) if not c[k].any()]
    assert len(total) == (ratio > 1.0)
    for k in (a, b):
        want = row[a] + row[b] if k in total else row[k]
        np.testing.assert_allclose(g[k], want, rtol=1e-6, atol=1e-18)
        if k not in total:
            np.testing.assert_allclose(c[k, [a, b]], [3e-6, -3e-6] if k == a else [-3e-6, 3e-6])
    # the residual and its derivative belong together
    x = np.linspace(-0.3, 0.4, s.n)
    for j in range(s.n):
        e = np.zeros(s.n)
        e[j] = 1e-6
        slope = (s.F(x + e) - s.F(x - e)) / 2e-6
        np.testing.assert_allclose(slope, s.G(x).toarray()[:, j], rtol=1e-6, atol=1e-9)


def test_inductor_and_mutual_inductance() -> None:
    names, c, g, _ = matrices("L1 a 0 4m", "L2 b 0 1m", "K1 L1 L2 0.5", "R1 a 0 1", "R2 b 0 1")
    assert names == ["a", "b", "l1", "l2"]
    np.testing.assert_allclose(g, [[1, 0, 1, 0], [0, 1, 0, 1], [-1, 0, 0, 0], [0, -1, 0, 0]])
    np.testing.assert_allclose(c[2:, 2:], [[4e-3, 1e-3], [1e-3, 1e-3]])
    assert not c[:2].any()


def test_three_coupled_inductors() -> None:
    _, c, _, _ = matrices(
        "L1 a 0 1", "L2 b 0 4", "L3 c 0 9", "K1 L1 L2 L3 0.5", "R1 a 0 1", "R2 b 0 1", "R3 c 0 1"
    )
    np.testing.assert_allclose(c[3:, 3:], [[1, 1, 1.5], [1, 4, 3], [1.5, 3, 9]])


def test_voltage_source_row_and_residual() -> None:
    names, _, g, s = matrices("V1 a b 5", "R1 a 0 1", "R2 b 0 1")
    assert names == ["a", "b", "v1"]
    np.testing.assert_allclose(g, [[1, 0, 1], [0, 1, -1], [1, -1, 0]])
    np.testing.assert_allclose(s.F([2.0, 1.0, 3.0], 0.0), [5.0, -2.0, 2.0 - 1.0 - 5.0])


def test_current_source_flows_from_its_first_node_through_itself() -> None:
    _, _, _, s = matrices("I1 a 0 2 m=3", "R1 a 0 1")
    np.testing.assert_allclose(s.F([0.0], 0.0), [6.0])


def test_controlled_sources() -> None:
    names, _, g, _ = matrices(
        "V1 a 0 1", "R1 a b 1", "R2 b 0 1",
        "E1 c 0 a b 3", "G1 d 0 a b 5 m=2", "F1 d 0 V1 7", "H1 e 0 V1 11", "Rc c 0 1", "Rd d 0 1", "Re e 0 1",
    )  # fmt: skip
    at = {name: k for k, name in enumerate(names)}
    row = g[at["e1"]]
    assert (row[at["c"]], row[at["a"]], row[at["b"]]) == (1, -3, 3)
    row = g[at["d"]]
    assert (row[at["a"]], row[at["b"]], row[at["v1"]], row[at["d"]]) == (10, -10, 7, 1)
    row = g[at["h1"]]
    assert (row[at["e"]], row[at["v1"]]) == (1, -11)


def test_behavioural_source_has_the_exact_derivative() -> None:
    s = emsim.compile(deck("V1 a 0 1", "B1 b 0 V={v(a)*v(a)+3*i(v1)}", "Rb b 0 1", ".tran 1m 1"))
    at = {name: k for k, name in enumerate(s.names)}
    x = np.zeros(s.n)
    x[at["a"]] = 2.0
    row = s.G(x).toarray()[at["b1"]]
    assert (row[at["b"]], row[at["a"]], row[at["v1"]]) == (1, -4, -3)


def test_algebraic_rows_and_units() -> None:
    s = emsim.compile(deck("V1 a 0 1", "R1 a b 1", "C1 b 0 1u", "L1 b 0 1", ".tran 1m 1"))
    assert dict(zip(s.names, s.algebraic.tolist(), strict=True)) == {
        "a": True,
        "b": False,
        "v1": True,
        "l1": False,
    }
    assert dict(zip(s.names, s.units, strict=True)) == {"a": "V", "b": "V", "v1": "A", "l1": "A"}
    assert s.index("v(b)") == s.index("B") == 1
    with pytest.raises(KeyError, match="l1"):
        s.index("l2")


def test_start_point_satisfies_the_equations() -> None:
    s = emsim.compile(deck("V1 a 0 6", "R1 a b 1", "R2 b 0 2", "L1 b c 1m", "R3 c 0 2", ".tran 1m 1"))
    np.testing.assert_allclose(s.F(s.x0, 0.0), 0.0, atol=1e-9)
    assert s.x0[s.index("b")] == pytest.approx(3.0)


@pytest.mark.parametrize(
    ("lines", "current"),
    [
        # figures of ngspice 39.3, current of the 5 V source
        (["R1 a 0 10 m=2"], -1.0),
        (["R1 a 0 10", "R2 a 0 10 m=0"], -0.5),
        (["R1 a 0 10 tc1=0.01 tc2=0.001 dtemp=10 scale=3", ".temp 37"], -0.10416667),
        (["R1 a 0 10 rm", ".model rm r tc1=0.02 r=7", ".temp 37"], -0.4166667),
        (["R1 a 0 rm l=10u w=2u", ".model rm r tc1=0.02 rsh=100 narrow=0.5u short=1u"], -6.25e-3),
        (["R1 a 0 rm", ".model rm r rsh=100 r=50"], -0.05),
        (["R1 a 0 rm l=10u", ".model rm r rsh=100 defw=4u"], -0.02),
        (["R1 a 0 10 tce=1", ".temp 37"], -0.452643),
        (["R1 a 0 0"], -5000.0),
        (["R1 a 0 -10"], 0.5),
        (["R1 a 0 r='10+v(a)*2'"], -0.25),
    ],
)
def test_resistor_values_as_ngspice(lines: list[str], current: float) -> None:
    table = emsim.run(deck("V1 a 0 5", *lines, ".op")).table("op")
    assert table["i(v1)"][0] == pytest.approx(current, rel=2e-6)


@pytest.mark.parametrize(
    ("source", "voltage"),
    [
        # figures of ngspice 39.3: m= multiplies the voltage of an expression, too
        ("B1 a 0 V=1 m=2", 2.0),
        ("B1 a 0 V=1 m=2 reciprocm=1", 0.5),
        ("B1 a 0 V=1 tc1=0.1 reciproctc=1", 0.5),
        ("B1 a 0 I=1 m=2", -2.0),
        ("B1 a 0 I=1 m=2 reciprocm=1", -0.5),
        ("B1 a 0 I=1 tc1=0.1 reciproctc=1", -0.5),
        ("E1 a 0 vol='1' m=2", 2.0),
        ("X1 a s m=2\n.subckt s a\nB1 a 0 V=1\n.ends", 1.0),
        ("X1 a s m=2\n.subckt s a\nB1 a 0 V=1 m=3\n.ends", 3.0),
        ("X1 a s m=2\n.subckt s a\nB1 a 0 I=1\n.ends", -2.0),
    ],
)
def test_multipliers_of_behavioural_sources_as_ngspice(source: str, voltage: float) -> None:
    table = emsim.run(deck(source, "R1 a 0 1", ".temp 37", ".op")).table("op")
    assert table["v(a)"][0] == pytest.approx(voltage)


@pytest.mark.parametrize(
    ("k", "warns"),
    [((0.9, 0.9, -0.9), True), ((0.9, 0.9, 0.9), False), ((1, 1, 1), False), ((0, 0.9, 0.9), True)],
)
def test_couplings_that_cannot_exist(k: tuple[float, ...], warns: bool) -> None:
    """ngspice 39: `is not positive definite`."""
    coils = "".join(f"L{j} n{j} 0 {j}m\nR{j} n{j} 0 1k\n" for j in (1, 2, 3))
    couplings = "".join(
        f"K{a}{b} L{a} L{b} {v}\n" for (a, b), v in zip(((1, 2), (2, 3), (1, 3)), k, strict=True)
    )
    r = emsim.run(f"t\nI1 0 n1 0\n{coils}{couplings}.op\n.end\n")
    said = [d.message for d in r.diagnostics if d.code == "W285"]
    assert bool(said) == warns and all("`l1`, `l2`, `l3`" in text for text in said)


def test_a_negative_hysteresis_is_spoken_of_once() -> None:
    r = emsim.run(
        "t\nV1 c 0 1\nR1 c a 1k\nS1 a 0 c 0 sm\nS2 a 0 c 0 sm\n.model sm SW vt=2 vh=-0.5\n.op\n.end\n"
    )
    (said,) = [d for d in r.diagnostics if d.code == "W286"]
    assert said.span.text == "vh=-0.5" and "on above 2.5, off below 1.5" in said.message

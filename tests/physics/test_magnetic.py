"""MAGNETIC: transformers, gaps that pull, iron that saturates, magnets: closed forms, scipy, balances of energy, messages."""

from __future__ import annotations

from math import pi, sqrt

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from support import deck, with_options

import emsim
from emsim import pipeline

MU0 = 4e-7 * pi


def run(text: str, options: str = "reltol=1e-8", analysis: str = ".tran 0.1m 60m") -> emsim.Result:
    return pipeline.run(
        f"magnetic\n{text}\n.options {options}\n{analysis}\n.end\n", energy="tran" in analysis
    )


def test_two_windings_on_reluctances_are_coupled_inductances():
    """N1 flux1 = L1 i1 + M i2 with the reluctances of core and stray paths: the same currents as K has."""
    n1, n2, core, one, other = 100, 50, 20e3, 2e6, 3e6
    magnetic = (
        f"MAGNETIC w1 a1 0 a 0 turns={n1}\nMAGNETIC s1 a1 0 r={one}\nMAGNETIC c a1 a2 r={core}\n"
        f"MAGNETIC w2 a2 0 b 0 turns={n2}\nMAGNETIC s2 a2 0 r={other}\n"
    )
    # F1 = n1 i1 and F2 = n2 i2 at the nodes: flux1 = F1/one + (F1 - F2)/core
    l1, l2, m = n1 * n1 * (1 / one + 1 / core), n2 * n2 * (1 / other + 1 / core), -n1 * n2 / core
    coils = f"L1 a 0 {l1}\nL2 0 b {l2}\nK1 L1 L2 {-m / sqrt(l1 * l2)!r}\n"
    circuit = "V1 p 0 SIN(0 10 50) AC 1\nR1 p a 1\nR2 b 0 8\n"
    ours, theirs = run(circuit + magnetic), run(circuit + coils)
    times = np.asarray(ours["time"])
    for name in ("v(a)", "v(b)"):
        np.testing.assert_allclose(ours[name], np.interp(times, theirs["time"], theirs[name]), atol=2e-3)
        assert ours.at(name, 0.0431) == pytest.approx(theirs.at(name, 0.0431), rel=1e-6)
    assert ours.energy.share < 1e-12
    ours, theirs = (run(circuit + text, analysis=".ac dec 5 1 10k") for text in (magnetic, coils))
    for name in ("v(a)", "v(b)"):
        np.testing.assert_allclose(ours[name], theirs[name], rtol=1e-9)


def test_windings_around_one_flux_are_an_ideal_transformer():
    r = run(
        "V1 a 0 SIN(0 10 50) AC 1\nR1 a p 1m\nMAGNETIC w1 x 0 p 0 turns=100\nMAGNETIC c x y r=1k\n"
        "MAGNETIC w2 0 y b 0 turns=25\nR2 b 0 8"
    )
    np.testing.assert_allclose(np.abs(r["v(b)"]), np.abs(r["v(p)"]) / 4.0, atol=1e-6)


@pytest.mark.parametrize("formulation", ["joint", "absolute"])
def test_a_gap_pulls_as_a_transducer_of_its_inductance(formulation):
    """N^2 mu0 A/gap as L= of a TRANSDUCER: the same energy, so the same motion."""
    machine = (
        "BODY p m=50m\nJOINT h 0 p slide axis=(1,0)\nSPRING k h k=40k\nDAMPER d h c=3\nV1 s 0 5\nR1 s a 8\n"
    )
    gap, turns = "1m-pos(h)", 300
    ours = "MAGNETIC w x 0 a 0 turns=300\nMAGNETIC g x 0 h gap={" + gap + "} area=50u\n"
    theirs = f"TRANSDUCER g a 0 h L={{{turns * turns * MU0 * 50e-6!r}/({gap})}}\n"
    one, other = (
        run(
            f"{machine}{text}.print tran force(g)",
            f"reltol=1e-9 formulation={formulation}",
            ".tran 0.1m 20m uic",
        )
        for text in (ours, theirs)
    )
    for name in ("pos(h)", "vel(h)", "force(g)"):
        scale = np.max(np.abs(other[name]))
        for t in (3e-3, 9e-3, 20e-3):
            assert one.at(name, t) == pytest.approx(other.at(name, t), abs=1e-7 * scale)
    assert one.energy.share < 1e-9


def test_a_gap_holds_with_b_squared_over_two_mu0():
    """In a magnetic circuit with flux phi the pull is phi^2/(2 mu0 A), and dW/dx at constant current."""
    r = run(
        "BODY p m=1\nJOINT h 0 p slide axis=(1,0)\nI1 0 a 2\nMAGNETIC w x 0 a 0 turns=200\n"
        "MAGNETIC fe x y len=0.1 area=100u mur=500\nMAGNETIC g y 0 h gap={0.5m-pos(h)} area=100u\n.print op flux(g) force(g)",
        analysis=".op",
    )
    flux = 400.0 / (0.1 / (500 * MU0 * 100e-6) + 0.5e-3 / (MU0 * 100e-6))
    assert r["flux(g)"][0] == pytest.approx(flux, rel=1e-12)
    assert r["force(g)"][0] == pytest.approx(flux**2 / (2 * MU0 * 100e-6), rel=1e-12)


def test_a_magnet_pulls_a_plate_and_its_energy_is_kept():
    """Br, mur, length l and gap x on one area: B = Br/(1 + mur x/l), pull B^2 A/(2 mu0)."""
    machine = "BODY p m=0.1\nJOINT h 0 p slide axis=(1,0)\n"
    magnet = "MAGNETIC m 0 x len=5m area=100u mur=1.05 br=1.2\nMAGNETIC g x 0 h gap={2m-pos(h)} area=100u\n"
    magnet += ".save pos(h) vel(h) flux(g) force(g)"
    r = run(machine + magnet, "reltol=1e-10", ".tran 1u 1m")
    x = 2e-3 - np.asarray(r["pos(h)"])
    b = 1.2 / (1.0 + 1.05 * x / 5e-3)
    np.testing.assert_allclose(r["flux(g)"], b * 100e-6, rtol=1e-10)
    np.testing.assert_allclose(r["force(g)"], b * b * 100e-6 / (2 * MU0), rtol=1e-10)

    def held(x: np.ndarray) -> np.ndarray:
        """Integral of the pull: the energy that the plate has won."""
        return 1.2**2 * 100e-6 / (2 * MU0) * (5e-3 / 1.05) / (1 + 1.05 * x / 5e-3)

    np.testing.assert_allclose(0.05 * np.asarray(r["vel(h)"]) ** 2, held(x) - held(np.array(2e-3)), atol=1e-9)
    assert r.energy.share < 1e-9


def test_iron_follows_its_curve():
    h = np.array([10.0, 100.0, 1e3, 1e4, 1e5])
    knee = 1.5 / (999 * MU0)
    wanted = MU0 * h + 1.5 * (h / knee) / np.sqrt(1 + (h / knee) ** 2)
    for field, b in zip(h, wanted, strict=True):
        r = run(
            f"I1 0 a {float(field) * 0.2 / 100!r}\nMAGNETIC w x 0 a 0 turns=100\n"
            "MAGNETIC fe x 0 len=0.2 area=1m mur=1000 bsat=1.5\n"
            ".print op flux(fe) mmf(x)",
            analysis=".op",
        )
        assert r["flux(fe)"][0] == pytest.approx(b * 1e-3, rel=1e-9)
        assert r["mmf(x)"][0] == pytest.approx(field * 0.2, rel=1e-12)


@pytest.mark.parametrize("formulation", ["joint", "absolute"])
def test_the_electromagnet_of_the_example_moves_as_scipy_has_it(formulation):
    """States flux in the core, place and speed; what the winding carries follows from the flux."""
    r = pipeline.run(
        with_options(deck("coupled/holding_magnet"), f"reltol=1e-9 formulation={formulation}", tran="1m 20m"),
        energy=True,
    )
    area, length, knee = 1e-4, 0.08, 1.2 / (1999 * MU0)

    def field(b: float) -> float:
        """H of the iron by Newton's method."""
        f = min(b / MU0, b * knee / 1.2)
        for _ in range(60):
            root = sqrt(1 + (f / knee) ** 2)
            f -= (MU0 * f + 1.2 * f / knee / root - b) / (MU0 + 1.2 / knee / root**3)
        return f

    def slopes(t: float, y: np.ndarray) -> list[float]:
        flux, x, u = y
        gap = 2 * (1.5e-3 - x)
        pole = flux / (MU0 * area / gap + 1 / 50e6)
        i = (pole + field(flux / area) * length) / 400
        volts = 12.0 * min(max((t - 1e-3) / 1e-5, 0.0), 1.0)
        pull = 0.5 * pole**2 * MU0 * area * 2 / gap**2
        return [(volts - 6 * i) / 400, u, (pull - 4e4 * x - 3 * u) / 0.05]

    y, parts = np.zeros(3), []
    for a, b in ((0, 1e-3), (1e-3, 1.01e-3), (1.01e-3, 20e-3)):
        found = solve_ivp(slopes, (a, b), y, "DOP853", rtol=1e-11, atol=1e-14, dense_output=True)
        y = found.y[:, -1]
        parts.append(found.sol)
    for t in (5e-3, 10e-3, 15e-3, 20e-3):
        flux, x, u = parts[2](t)
        assert r.at("flux(core)", t) == pytest.approx(flux, rel=1e-6)
        assert r.at("pos(lift)", t) == pytest.approx(x, rel=1e-6)
        assert r.at("vel(lift)", t) == pytest.approx(u, abs=1e-7)
    assert r.energy.share < 1e-9


def test_a_source_of_magnetomotive_force_gives_what_a_winding_takes():
    r = run(
        "MAGNETIC src x 0 mmf=SIN(0 500 50)\nMAGNETIC c x y r=100k\nMAGNETIC w y 0 b 0 turns=50\nR1 b 0 0.5"
    )
    assert r.energy.share < 1e-9 and r.energy.dissipated > 0.1
    np.testing.assert_allclose(r["i(w)"], -np.asarray(r["v(b)"]) / 0.5, atol=1e-9)


MESSAGES = [
    ("MAGNETIC m x 0 r=1 mmf=2", "E252", "exactly one"), ("MAGNETIC m x 0 turns=5", "E233", "of the circuit"),
    ("MAGNETIC m x 0 n 0 r=5", "E233", "two nodes"), ("MAGNETIC m x 0 gap=1m", "E230", "area="),
    ("MAGNETIC m x 0 r=5 mur=4", "E231", "mur="), ("MAGNETIC m x 0 len=1 area=1 mur=5 bsat=1 br=1", "E231", "bsat="),
    ("MAGNETIC m x 0 r={1+time}", "E252", "number"), ("MAGNETIC m x 0 h r={1meg+v(n)}", "E252", "v(n)"),
    ("MAGNETIC m x 0 h gap={pos(q)} area=1", "E250", "q"), ("MAGNETIC m x 0 gap=0 area=1", "E238", "greater"),
    ("MAGNETIC m x y r=5", "E262", "mmf(x)"), ("HEAT c x c=1\nMAGNETIC m x 0 r=5", "E260", "heat domain"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "code", "words"), MESSAGES)
def test_what_is_wrong_with_a_magnetic_circuit_is_told(text, code, words):
    with pytest.raises(emsim.DeckError) as told:
        run(f"V9 n 0 1\nBODY b m=1\nJOINT h 0 b slide axis=(1,0) ic=1\n{text}")
    found = [d for d in told.value.diagnostics if d.code == code]
    assert found and words in found[0].message and found[0].span is not None, told.value


def test_without_an_operating_point_nobody_knows_the_flux_of_a_magnet():
    with pytest.raises(emsim.DeckError, match="no operating point is looked for"):
        run(
            "MAGNETIC m x 0 len=1m area=1u mur=1 br=1\nMAGNETIC w x 0 a 0 turns=9\nR1 a 0 1",
            analysis=".tran 1m 2m uic",
        )


def test_a_gap_that_closes_is_told():
    r = run("BODY b m=1\nJOINT h 0 b slide axis=(1,0) ic=(0,1)\nI1 0 a 1\nMAGNETIC w x 0 a 0 turns=10\n"
            "MAGNETIC fe x y r=1meg\nMAGNETIC g y 0 h gap={1m-pos(h)} area=100u", analysis=".tran 0.1m 1.01m")  # fmt: skip
    assert any("fallen to 0" in d.message for d in r.diagnostics)

"""What jumps where a source bends: v = L di/dt of a coil that carries a source's current, i = C dv/dt of a capacitor that
sources hold.

Rows of the first step behind a corner of PULSE or PWL held values that never were, and Kirchhoff's laws held all the
same. Right values are closed forms. Corners themselves, where there are two values, are left out.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import emsim
from emsim.assemble import options

Signal = Callable[[np.ndarray], np.ndarray]
METHODS = ("auto", "trap", "gear", "radau", "esdirk", "trbdf2")
NEAR = 1e-11  # [s]: so near to a corner is on it
SINE = 2 * np.pi * 400.0


def line(times: list[float], values: list[float]) -> tuple[Signal, Signal]:
    """Straight lines and their slope, the one behind a corner at it."""
    slopes = [0.0, *(np.diff(values) / np.diff(times)), 0.0]
    return (
        lambda t: np.interp(t, times, values),
        lambda t: np.array(slopes)[np.searchsorted(times, t, side="right")],
    )


CORNERS = [1e-3, 2e-3, 4e-3, 5e-3]
U, DU = line([0.0, *CORNERS], [0.0, 0.0, 1.0, 1.0, 0.0])
TRAPEZOID = "PULSE(0 1 1m 1m 1m 2m)"


def behind_rc(t: np.ndarray) -> np.ndarray:
    """The voltage of 1 uF behind 1 kohm at that trapezoid: ramps from each corner on."""
    out, tau = np.zeros_like(t), 1e-3
    for corner, slope in zip(CORNERS, (1e3, -1e3, -1e3, 1e3), strict=True):
        s = np.maximum(t - corner, 0.0)
        out += slope * (s - tau * (1.0 - np.exp(-s / tau)))
    return out


def decays(t: np.ndarray, tau: float) -> np.ndarray:
    """exp(-s/tau) of every bend of that trapezoid, times what its slope changes by."""
    ramps = zip(CORNERS, (1e3, -1e3, -1e3, 1e3), strict=True)
    return sum(np.where(t >= at, by * np.exp(-np.maximum(t - at, 0.0) / tau), 0.0) for at, by in ramps)


# deck without .tran, signal, its exact value, corners
CASES: dict[str, tuple[str, str, Signal, list[float], str]] = {
    "a coil on a ramp alone": (
        f"I1 0 a {TRAPEZOID}\nR1 a b 2\nL1 b 0 5m",
        "v(a)",
        lambda t: 2 * U(t) + 5e-3 * DU(t),
        CORNERS,
        "10u 6m",
    ),
    "a ramp and a sine": (
        f"V1 a 0 SIN(0 1 400)\nR1 a b 2\nL1 b c 5m\nI1 0 c {TRAPEZOID}",
        "v(c)",
        lambda t: np.sin(SINE * t) + 2 * U(t) + 5e-3 * DU(t),
        CORNERS,
        "10u 6m",
    ),
    "beside another circuit": (
        f"I1 0 a {TRAPEZOID}\nR1 a b 2\nL1 b 0 5m\nV2 c 0 SIN(0 1 400)\nR2 c d 1k\nC2 d 0 100n",
        "v(a)",
        lambda t: 2 * U(t) + 5e-3 * DU(t),
        CORNERS,
        "10u 6m",
    ),
    "a capacitor between two sources": (
        f"V1 a 0 {TRAPEZOID}\nC1 a b 1u\nV2 b 0 SIN(0 1 400)\nR1 a b 1k",
        "i(v1)",
        lambda t: -(1e-6 * (DU(t) - SINE * np.cos(SINE * t)) + (U(t) - np.sin(SINE * t)) / 1e3),
        CORNERS,
        "10u 6m",
    ),
    "a capacitor across a pulse, beside RC": (
        f"V1 a 0 {TRAPEZOID}\nC1 a 0 1u\nR1 a b 1k\nC2 b 0 1u",
        "i(v1)",
        lambda t: -(1e-6 * DU(t) + (U(t) - behind_rc(t)) / 1e3),
        CORNERS,
        "10u 6m",
    ),
    "a short cutset of coils": (
        "V1 a 0 SIN(0 1 0.05meg)\nR1 a b 1k\nL1 b c 0.7m\nI1 0 c PWL(0 -1m 4.5855u -1.5m)\nR2 b 0 1k",
        "v(c)",
        lambda t: (
            0.5 * (np.sin(2 * np.pi * 5e4 * t) + 1e3 * np.interp(t, [0, 4.5855e-6], [-1e-3, -1.5e-3]))
            + 0.7e-3 * np.where(t < 4.5855e-6, -0.5e-3 / 4.5855e-6, 0.0)
        ),
        [4.5855e-6],
        "0.0276u 13.8u",
    ),
    # the source's slope passes a divider of capacitors, and an F makes a voltage of it
    "an F behind two capacitors in series": (
        f"V1 a 0 {TRAPEZOID}\nC1 a b 1u\nC2 b 0 3u\nF1 0 c V1 2\nR1 c 0 100",
        "v(c)",
        lambda t: -2 * 100 * 0.75e-6 * DU(t),
        CORNERS,
        "10u 6m",
    ),
    # (L1 + L2) i2' + R i2 = L1 I'
    "a cutset of a coil to ground and one that is a state": (
        f"I1 0 c {TRAPEZOID}\nL1 c 0 4m\nL2 c d 12m\nR1 d 0 100",
        "v(c)",
        lambda t: 4e-3 * (DU(t) - 0.25 * decays(t, 160e-6)),
        CORNERS,
        "10u 6m",
    ),
    "a coupled coil": (
        f"I1 0 a {TRAPEZOID}\nL1 a 0 4m\nL2 b 0 1m\nK1 L1 L2 0.5\nR1 b 0 100",
        "v(b)",
        lambda t: 1e-3 * (DU(t) - decays(t, 10e-6)),
        CORNERS,
        "10u 6m",
    ),
    "a source that an E copies across a capacitor": (
        f"V1 a 0 {TRAPEZOID}\nE1 b 0 a 0 3\nC1 b 0 1u\nR1 b 0 1k",
        "i(e1)",
        lambda t: -(3e-6 * DU(t) + 3e-3 * U(t)),
        CORNERS,
        "10u 6m",
    ),
}


def rows_off(case: str, method: str, reltol: float) -> float:
    """Largest distance from the closed form, in parts of the signal's range."""
    cards, name, exact, corners, times = CASES[case]
    deck = f"{case}\n{cards}\n.tran {times}\n.save all\n.options method={method} reltol={reltol:g}\n.end\n"
    result = emsim.run(deck)
    t = np.asarray(result.time)
    clear = (np.abs(t[:, None] - np.array(corners)).min(axis=1) > NEAR) & (t > 0.0)
    assert sum(clear) > 50
    right = exact(t[clear])
    return float(np.abs(np.asarray(result[name])[clear] - right).max() / np.ptp(right))


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("method", METHODS)
def test_rows_behind_a_corner_are_of_its_right_side(case: str, method: str):
    """From 31 to 41 % of range off under esdirk, gear and trbdf2 for a coil alone, whatever the tolerance; 37 % under auto for a
    capacitor across a pulse."""
    assert rows_off(case, method, 1e-3) < 5e-3


@pytest.mark.parametrize("case", CASES)
def test_the_same_where_the_tolerance_is_tight(case: str):
    """Beside another circuit auto was right down to 1e-8, and 5 V off at 1e-9."""
    assert rows_off(case, "auto", 1e-6) < 5e-6
    assert rows_off(case, "auto", 1e-9) < 1e-7


# the coil carries C du/dt, which jumps at a corner; at a node, and in a loop of the dual kind
IMPULSES = {
    "a coil": (
        f"V1 a 0 {TRAPEZOID}\nC1 a 0 1u\nF1 0 b V1 1\nR1 b c 2\nL1 c 0 5m",
        "v(b)",
        lambda t: -2e-6 * DU(t),
        "`l1`",
    ),
    "a coil beside another": (
        f"V1 a 0 {TRAPEZOID}\nC1 a 0 1u\nF1 0 b V1 1\nR1 b c 2\nL1 c 0 5m\nL2 d 0 1m\nK1 L1 L2 0.5\nR2 d 0 100",
        "v(b)",
        # (the impulse leaves L2 with the flux that it had: M^2 R2 / L2^2 = 125 ohm times what i(l1) jumps by)
        lambda t: -2e-6 * DU(t) - 125e-6 * decays(t, 10e-6),
        "`l",
    ),
    "a capacitor": (
        f"I1 0 a {TRAPEZOID}\nL1 a 0 5m\nE1 b 0 a 0 1\nR1 b 0 1\nC1 b c 1u\nE2 c 0 0 a 1",
        "i(e1)",
        lambda t: -5e-3 * DU(t),
        "`e",
    ),
}


@pytest.mark.parametrize("case", IMPULSES)
@pytest.mark.parametrize("method", METHODS)
def test_an_impulse_at_a_corner_stands_in_no_row_and_is_told(case: str, method: str):
    """A row held it divided by the length of the step over the corner, -6.5e9 V beside 23 V, without a word."""
    cards, name, exact, what = IMPULSES[case]
    deck = f"{case}\n{cards}\n.tran 10u 6m\n.save all\n.options method={method}\n.end\n"
    result = emsim.run(deck)
    t = np.asarray(result.time)
    behind = ~np.isin(t, CORNERS) & (t > 0.0)
    assert sum((t > corner) & (t < corner + NEAR) for corner in CORNERS).sum() >= 4
    right = exact(t[behind])
    assert np.abs(np.asarray(result[name])[behind] - right).max() < 5e-3 * np.ptp(right)
    assert [what in d.message.lower() for d in result.diagnostics if d.code == "W416"] == [True]


@pytest.mark.parametrize("case", ["a coil on a ramp alone", "a capacitor between two sources"])
def test_the_watch_sees_a_voltage_that_is_not_l_di_dt(case: str, monkeypatch: pytest.MonkeyPatch):
    """Kirchhoff's laws hold whatever v(b), behind the resistor, or the current through both sources was: nothing was told."""
    cards, _, _, _, times = CASES[case]
    deck = f"{case}\n{cards}\n.tran {times}\n.save all\n.end\n"
    assert not [d for d in emsim.run(deck).diagnostics if d.code == "W406"]
    place = emsim.compile(deck).names.index("b" if "coil" in case else "v1")
    resolve = options.resolve
    monkeypatch.setattr(options, "resolve", lambda *a, **k: {**resolve(*a, **k), "spoiled": place})
    assert [d for d in emsim.run(deck).diagnostics if d.code == "W406"]


def test_a_network_that_stopped_in_its_first_step_runs():
    """auto and radau gave up at 1e-22 s (E412) in a network with cutsets of coils that trap, gear and esdirk ran."""
    deck = (Path(__file__).parent / "coil_cutsets.cir").read_text()
    runs = {
        m: emsim.run(deck.replace(".end", f".options method={m}\n.end")) for m in ("auto", "radau", "esdirk")
    }
    t = np.linspace(0.5e-6, 34e-6, 50)
    for name in ("v(2)", "v(7)", "v(16)", "i(l9)"):
        curves = [np.interp(t, r.time, r[name]) for r in runs.values()]
        assert max(np.ptp(c) for c in curves) > 0
        for other in curves[1:]:
            assert np.abs(other - curves[0]).max() < 2e-3 * np.ptp(curves[0])


@pytest.mark.parametrize("method", METHODS)
def test_times_rise_where_corners_are_closer_than_a_step(method: str):
    """Rows at 5e-21 s, and then at 1e-30 s."""
    cards = "I1 0 a PWL(0 0.5 1e-30 0 2m 1 10m 1)\nL1 a 0 1m\nR1 a 0 1meg\n.tran 0.1m 5m"
    deck = f"corners\n{cards}\n.options method={method}\n.end\n"
    result = emsim.run(deck)
    assert (np.diff(np.asarray(result.time)) > 0).all()
    assert result["i(l1)"][-1] == pytest.approx(1.0, rel=1e-3)


@pytest.mark.parametrize("method", ["auto", "trap"])
def test_coils_in_series_with_other_currents_at_the_start_keep_their_flux(method: str):
    """The row that is lowered would have one of them decide: with `uic`, 1 mH at 1 A and 3 mH at none share 0.25 A."""
    deck = (
        f"flux\nL1 a b 1m ic=1\nL2 b 0 3m ic=0\nR1 a 0 1\n.tran 1u 100u uic\n.options method={method}\n.end\n"
    )
    result = emsim.run(deck)
    t = np.asarray(result.time)
    late = t > 1e-6
    assert np.allclose(np.asarray(result["i(l2)"])[late], 0.25 * np.exp(-t[late] / 4e-3), rtol=2e-3)


def test_small_signals_are_of_the_equations_as_they_are():
    """i(v1) = -jwC: the run's equations have the slope of a wave in their place."""
    deck = f"ac\nV1 a 0 {TRAPEZOID} ac 1\nC1 a 0 1u\nR1 a 0 1k\n.ac dec 2 1k 100k\n.end\n"
    result = emsim.run(deck)
    f = np.real(np.asarray(result["frequency"]))
    assert np.allclose(np.asarray(result["i(v1)"]), -(1e-3 + 2j * np.pi * f * 1e-6), rtol=1e-9)


@pytest.mark.parametrize("method", METHODS)
def test_steps_of_a_fixed_length_where_nothing_is_stored(method: str):
    """A capacitor across a source is no state once its current is the source's slope: steps are as long as asked, not the
    shortest there are."""
    cards = "V1 a 0 PWL(0 0 1.04m 0 3.14m 2.1 10m 2.1)\nC1 a 0 1u\n.tran 0.1m 6m"
    deck = f"fixed\n{cards}\n.save all\n.options fixed_step=0.1m method={method}\n.end\n"
    result = emsim.run(deck)
    assert 60 <= result.stats["steps"] <= 63
    t = np.asarray(result.time)
    clear = (np.abs(t - 1.04e-3) > NEAR) & (np.abs(t - 3.14e-3) > NEAR)
    right = np.where((t > 1.04e-3) & (t < 3.14e-3), -1e-3, 0.0)
    assert np.abs(np.asarray(result["i(v1)"]) - right)[clear].max() < 1e-12

"""MODE and FLANGE: a body by its modes; a uniform cantilever by those of the textbook, beside closed forms and BEAM."""

from __future__ import annotations

from math import cos, cosh, pi, sin, sinh
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

import emsim
from emsim import pipeline

BOTH = pytest.mark.parametrize("formulation", ["joint", "absolute"])


def cantilever(b: float) -> tuple[float, ...]:
    """Of length, EI and rhoa 1, with the root b: frequency [Hz], int phi, int x phi, phi and phi' at the end; int phi^2 = 1."""
    s = (cosh(b) + cos(b)) / (sinh(b) + sin(b))

    def phi(x: float) -> float:
        return cosh(b * x) - cos(b * x) - s * (sinh(b * x) - sin(b * x))

    slope = b * (sinh(b) + sin(b) - s * (cosh(b) - cos(b)))
    return b * b / (2 * pi), quad(phi, 0, 1)[0], quad(lambda x: x * phi(x), 0, 1)[0], phi(1.0), slope


MODES = [cantilever(b) for b in (1.87510406871196, 4.69409113297418, 7.85475743823761)]


def arm(count: int = 3, across: str = "y", zeta: float = 0.0, start: str = "", body: str = "") -> str:
    """The cantilever; its shape across y (in the plane) or z."""
    cards, shape = f"BODY arm m=1 com=(0.5,0) j={1 / 12} {body}\n", []
    if across == "z":
        cards = f"BODY arm m=1 com=(0.5,0) j=(0,{1 / 12},{1 / 12}) {body}\n"
    for k, (f, p, h, phi, slope) in enumerate(MODES[:count], 1):
        push, turn = (f"(0,{p!r})", f"{h!r}") if across == "y" else (f"(0,0,{p!r})", f"(0,{-h!r},0)")
        cards += f"MODE m{k} arm f={f!r} zeta={zeta} p={push} h={turn} {start if k == 1 else ''}\n"
        shape += [0.0, phi, slope] if across == "y" else [0.0, 0.0, phi, 0.0, -slope, 0.0]
    names = " ".join(f"m{k + 1}.q" for k in range(count))
    return f"{cards}FLANGE tip arm(1,0) {names} shape=({','.join(map(repr, shape))})\n"


def ask(cards: str, formulation: str = "joint", options: str = "reltol=1e-6") -> emsim.Result:
    text = f"modes\n{cards}\n.options {options} formulation={formulation} method=radau\n.end\n"
    return pipeline.run(text, energy=True)


def swings(r: emsim.Result) -> np.ndarray:
    """rad/s above 0, from the lowest."""
    w = np.sort(2 * pi * np.asarray(r.table("modes")["frequency"]))
    return w[w > 1e-3]


@BOTH
@pytest.mark.parametrize("across", ["y", "z"])
def test_held_at_its_frame_it_swings_by_its_modes(formulation, across):
    r = ask(f"{arm(across=across)}JOINT clamp 0 arm weld\n.modes\n.save x(arm)", formulation)
    np.testing.assert_allclose(swings(r), [2 * pi * f for f, *_ in MODES], rtol=1e-9)


@BOTH
def test_on_a_pin_it_has_the_frequencies_of_a_pinned_beam(formulation):
    """tan b = tanh b: 3.9266, 7.0686: of modes of another hold, by p and h alone."""
    r = ask(f"{arm()}JOINT hub 0 arm pin\n.modes\n.save x(arm)", formulation)
    for found, exact, share in zip(swings(r), (3.92660231, 7.06858275), (1e-4, 4e-3), strict=False):
        assert found == pytest.approx(exact**2, rel=share)


@BOTH
@pytest.mark.parametrize("across", ["y", "z"])
def test_a_mass_on_its_flange(formulation, across):
    """1 + cos b cosh b + mu b (cos b sinh b - sin b cosh b) = 0."""

    def zero(b: float) -> float:
        return 1 + cos(b) * cosh(b) + 0.2 * b * (cos(b) * sinh(b) - sin(b) * cosh(b))

    load = "BODY load m=0.2 j=(0,0,0)\nJOINT on tip.at load weld\n"
    r = ask(f"{arm(across=across)}JOINT clamp 0 arm weld\n{load}.modes\n.save x(arm)", formulation)
    squares = [(phi, (2 * pi * f) ** 2) for f, _, _, phi, _ in MODES]

    def of_three(w: float) -> float:
        return 1 - 0.2 * w * w * sum(phi * phi / (w2 - w * w) for phi, w2 in squares)

    assert swings(r)[0] == pytest.approx(brentq(of_three, 0.1, 3.51), rel=1e-9)
    assert swings(r)[0] == pytest.approx(brentq(zero, 0.5, 1.87) ** 2, rel=2e-4)
    assert swings(r)[1] == pytest.approx(brentq(zero, 3.2, 4.69) ** 2, rel=5e-3)


@BOTH
def test_a_force_on_its_flange_and_its_weight(formulation):
    """F sum phi^2/w^2, 1/3 of a beam; g sum phi p/w^2, 1/8; reactions of the whole: the weight, and its moment."""
    small = f"{arm()}JOINT clamp 0 arm weld\n"
    r = ask(f"{small}FORCE f tip.at dir=(0,1) 0.01\n.op static\n.save y(tip.at) angle(tip.at)", formulation)
    at = [(phi, slope, (2 * pi * f) ** 2) for f, _, _, phi, slope in MODES]
    assert float(r["y(tip.at)"][-1]) == pytest.approx(
        0.01 * sum(phi * phi / w2 for phi, _, w2 in at), rel=1e-9
    )
    assert float(r["y(tip.at)"][-1]) == pytest.approx(0.01 / 3, rel=2e-3)
    assert float(r["angle(tip.at)"][-1]) == pytest.approx(0.01 / 2, rel=2e-2)
    r = ask(f"{small}.gravity 0.01\n.op static\n.save y(tip.at) fy(clamp) mz(clamp)", formulation)
    assert float(r["y(tip.at)"][-1]) == pytest.approx(-0.01 / 8, rel=1e-3)
    np.testing.assert_allclose(
        [abs(float(r[n][-1])) for n in ("fy(clamp)", "mz(clamp)")], [0.01, 0.005], rtol=1e-6
    )


def test_a_motor_that_turns_it_beside_a_beam():
    """A soft torque on a hub: hub and end as those of a BEAM of eight elements; energy."""
    hub = "BODY hub m=1 j=0.2\nJOINT axle 0 hub pin\nJOINT root hub {root} weld\n"
    hub += "TORQUE t axle tau={{0.02*sin(3*time)}}\n.tran 50m 4\n"
    by_modes = ask(arm() + hub.format(root="arm") + ".save angle(axle) y(tip.at) energy()")
    by_beam = ask(
        "BEAM rod l=1 n=8 ei=1 ea=1e5 rhoa=1\n" + hub.format(root="rod.a") + ".save angle(axle) y(rod.b)"
    )
    assert abs(by_modes["angle(axle)"]).max() > 0.01
    for name, other in (("angle(axle)", "angle(axle)"), ("y(tip.at)", "y(rod.b)")):
        beside = np.interp(by_modes["time"], by_beam["time"], by_beam[other])
        np.testing.assert_allclose(by_modes[name], beside, atol=1e-4 * abs(beside).max())
    assert abs(by_modes.energy.share) < 1e-6


@pytest.mark.parametrize(("volts", "share"), [(6, 1e-2), (1.5, 1e-3)])
def test_the_deck_of_a_motor_and_a_flexible_arm(volts, share):
    """Beside a BEAM, but for what is of second order in its speed: a quarter of it, and less than a tenth of the difference."""
    deck = (Path(__file__).parents[2] / "netlists/coupled/flexible_arm.cir").read_text().replace(".end\n", "")
    deck = deck.replace("PULSE(0 6", f"PULSE(0 {volts}")
    start, end = deck.index("BODY   arm"), deck.index("BODY   load")
    beam = "BEAM rod l=0.6 n=8 e=70e9 rho=2700 section=rect(30m,3m) d=100u\n"
    rest = deck[end:].replace("tip.at", "rod.b").replace("hub arm", "hub rod.a").replace(" pos(first.q)", "")
    by_modes = pipeline.run(deck + ".options reltol=1e-6\n", energy=True)
    by_beam = pipeline.run(deck[:start] + beam + rest + ".options reltol=1e-6 method=radau\n")
    for name, other in (("angle(axle)", "angle(axle)"), ("y(tip.at)", "y(rod.b)")):
        beside = np.interp(by_modes["time"], by_beam["time"], by_beam[other])
        assert abs(by_modes[name] - beside).max() < share * (beside.max() - beside.min())
    assert abs(by_modes["pos(first.q)"]).max() > 3e-3 * volts
    assert abs(by_modes.energy.share) < 1e-6


def test_zeros_of_the_hub_are_the_frequencies_of_the_held_arm():
    """From the torque on the hub to its angle: it stands still where the arm swings by itself."""
    frequencies = [f * (1 + off) for f, *_ in MODES[:2] for off in (-0.01, 0.0, 0.01)]
    text = "BODY hub m=1 j=0.2\nJOINT axle 0 hub pin\nJOINT root hub arm weld\n"
    text += "Vin a 0 ac 1\nRin a 0 1\nTORQUE t axle tau={v(a)}\n"
    seen = []
    for f in frequencies:
        r = ask(f"{arm()}{text}.ac lin 1 {f!r} {f!r}\n.save angle(axle)").table("ac")
        seen.append(float(np.real(np.asarray(r["angle(axle)"])[-1])))
    for low, at, high in (seen[:3], seen[3:]):
        assert low * high < 0.0
        assert abs(at) < 1e-6 * min(abs(low), abs(high))


def test_damping_ratio_of_a_mode():
    r = ask(f"{arm(1, zeta=0.02)}JOINT clamp 0 arm weld\n.modes\n.save x(arm)").table("modes")
    assert np.asarray(r["damping"]).max() == pytest.approx(0.02, rel=1e-9)
    r = ask(f"{arm(1, zeta=0.05, start='ic=(0.01,0)')}JOINT clamp 0 arm weld\n.tran 0.1 20\n.save pos(m1.q)")
    assert float(r["pos(m1.q)"][0]) == 0.01
    assert r.energy.dissipated == pytest.approx(0.5 * 1e-4 * (2 * pi * MODES[0][0]) ** 2, rel=1e-2)


@BOTH
@pytest.mark.parametrize("across", ["y", "z"])
def test_thrown_its_centre_of_mass_goes_straight_on(formulation, across):
    """Whatever it turns and swings: r + R (com + p q/m); its energy stays."""
    spin = "omega=0.7" if across == "y" else "omega=(0.2,0.3,0.7)"
    cards = arm(2, across, start="ic=(0.05,0)", body=f"vx=0.5 vy=-0.2 {spin}")
    cards = cards.replace(f"j=(0,{1 / 12}", f"j=(0.01,{1 / 12}")
    at = (0, 1) if across == "y" else (0, 0, 1)
    one = f"arm({','.join(map(str, at))})"
    axes = "xy" if across == "y" else "xyz"
    names = [f"{a}({of})" for of in ("arm(0.5,0)", "arm", one) for a in axes]
    r = ask(f"{cards}.tran 20m 2\n.save {' '.join(names)} pos(m1.q) pos(m2.q) ke() pe()", formulation)
    push = sum(MODES[k][1] * np.asarray(r[f"pos(m{k + 1}.q)"]) for k in range(2))
    t = np.asarray(r["time"])
    for a in axes:
        path = np.asarray(r[f"{a}(arm(0.5,0))"]) + push * (np.asarray(r[f"{a}({one})"]) - r[f"{a}(arm)"])
        straight = np.polyval(np.polyfit(t, path, 1), t)
        np.testing.assert_allclose(path, straight, atol=2e-6)
    np.testing.assert_allclose(np.asarray(r["ke()"]) + r["pe()"], r["ke()"][0] + r["pe()"][0], rtol=1e-5)


def test_large_turns_are_told():
    cards = f"{arm(1)}JOINT clamp 0 arm weld\nFORCE f tip.at dir=(0,1) PULSE(0 1 0 1 1 1 9)\n.tran 10m 2\n.save y(tip.at)"
    said = [d.message for d in ask(cards).diagnostics if d.code == "W401"]
    assert len(said) == 1
    assert "0.2 rad" in said[0]
    assert not [d for d in ask(cards.replace("PULSE(0 1", "PULSE(0 0.1")).diagnostics if d.code == "W401"]


HELD = "BODY arm m=1 j=1\nJOINT c 0 arm weld\n"
WRONG = {
    "MODE m arm p=(0,1) h=0": "E230",  # its frequency
    "MODE m arm f=1 h=0": "E230",  # what it pushes
    "MODE m arm f=1 p=(0,0.5)": "E230",
    "MODE m arm f=1 p=(0,0,0,1) h=0": "E232",
    "MODE m arm f=1 p=(0,0.5) h=(0,1)": "E232",
    "MODE m arm(1,0) f=1 p=(0,0.5) h=0": "E240",  # p and h are about its origin
    "MODE m arm f=-1 p=(0,0.5) h=0": "E238",
    "MODE m arm f=1 p=(0,0.8) h=0\nMODE n arm f=2 p=(0,-0.8) h=0": "E238",  # more than its mass
    "MODE m arm f=1 p=(0,0.5) h=0\nFLANGE t arm(1,0) m.q shape=(0,1)": "E232",
    "MODE m arm f=1 p=(0,0.5) h=0\nFLANGE t arm(1,0) n.q shape=(0,1,0)": "E236",
    "MODE m arm f=1 p=(0,0.5) h=0\nFLANGE t arm(1,0) shape=(0,1,0)": "E233",
}


@pytest.mark.parametrize("cards", WRONG)
def test_what_is_wrong_with_modes_is_said_once(cards):
    with pytest.raises(emsim.DeckError) as error:
        emsim.compile(f"modes\n{HELD}{cards}\n.op\n.end\n")
    assert [d.code for d in error.value.diagnostics if d.severity == "error"] == [WRONG[cards]]

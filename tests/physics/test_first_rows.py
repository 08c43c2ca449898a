"""Every value of the first row is that of the consistent state at t = 0, behind what jumps there.

Beside closed forms, by every method and in both formulations.
"""

from math import pi, sin

import pytest

import emsim

G, DEG30 = 9.81, pi / 6
METHODS = "radau radau5 gauss4 trap gear esdirk trbdf2 rk45 dop853 auto".split()


def pendulum(cards: str) -> str:
    return (
        f"BODY bob m=1.3 j=0.02 com=(0,-1)\nJOINT hinge 0 bob pin ic=(30deg,2)\n{cards}\n.save alpha(hinge)"
    )


FALLS = -1.3 * G * sin(DEG30) / 1.32
MACHINES = {
    "by itself": (pendulum(""), {"alpha(hinge)": FALLS}),
    "a stop far away": (pendulum("STOP s hinge max=170deg"), {"alpha(hinge)": FALLS}),
    "an elastic stop far away": (pendulum("STOP s hinge max=170deg k=1k c=1"), {"alpha(hinge)": FALLS}),
    "friction": (pendulum("FRICTION f hinge fc=0.3"), {"alpha(hinge)": FALLS - 0.3 / 1.32}),
    "a stop, a spring and a damper": (
        pendulum("STOP s hinge max=170deg\nDAMPER d hinge c=0.5\nSPRING k hinge k=3"),
        {"alpha(hinge)": FALLS - (0.5 * 2 + 3 * DEG30) / 1.32},
    ),
    "a latch that waits": (pendulum("LATCH l hinge catch={angle(hinge)>2}"), {"alpha(hinge)": FALLS}),
    "a ball that slides and begins to roll": (
        "BODY ball m=2 shape=disc(0.1) y=0.1 vx=0.5 omega=-3\nCONTACT c ball 0 line=(0,1) r=0.1 e=0 mu=0.1\n"
        ".save x(ball) ax(ball) alpha(ball) force(c)",
        {
            "x(ball)": 0,
            "ax(ball)": -0.1 * G,
            "alpha(ball)": -0.1 * G * 2 * 0.1 / (0.5 * 2 * 0.1**2),
            "force(c)": 2 * G,
        },
    ),
    "a ball that meets the floor at the start": (
        "BODY ball m=2 j=1 vy=-2\nCONTACT c ball 0 line=(0,1) e=0.5\n.save vy(ball) ay(ball) force(c)",
        {"vy(ball)": 1, "ay(ball)": -G, "force(c)": 0},
    ),
    "a ball in a soft floor": (
        "BODY ball m=2 j=1 y=-0.01 vy=-2\nCONTACT c ball 0 line=(0,1) k=1k c=3\n.save vy(ball) ay(ball) force(c)",
        {"vy(ball)": -2, "ay(ball)": -G + 8, "force(c)": 16},
    ),
    # two links of no inertia about their ends but m/4, a coupler that does not turn
    "a parallelogram with a stop": (
        "BODY p m=1 j=0 com=(0,-0.5)\nBODY q m=1 j=0 com=(0,-0.5)\nBODY c m=2 j=0.1 com=(0.5,0)\n"
        "JOINT a 0 p pin ic=(30deg,2)\nJOINT b p(0,-1) c pin ic=-30deg\nJOINT d 0(1,0) q pin guess=30deg\n"
        "JOINT e c(1,0) q(0,-1) pin\nSTOP s a max=170deg\n.save alpha(a)",
        {"alpha(a)": -(2 * 0.5 + 2) * G * sin(DEG30) / (2 * 0.25 + 2)},
    ),
    "a motor whose coil carries a current": (
        pendulum(
            "STOP s hinge max=170deg\nMOTOR m a 0 hinge ke=0.5\nL1 0 a 10m ic=0.3\nD1 0 a dm\n.model dm d(is=1e-14)"
        )
        + " v(a) i(l1)",
        {"alpha(hinge)": FALLS + 0.5 * 0.3 / 1.32, "i(l1)": 0.3},
    ),
}
CIRCUITS = {
    "a capacitor across a source": (
        "V1 a 0 sin(0 5 50)\nC1 a 0 1u\nR1 a b 10\nC2 b 0 1u\n.save i(c1) i(c2) i(v1)",
        {"i(c1)": 1e-6 * 5 * 100 * pi, "i(c2)": 0, "i(v1)": -1e-6 * 5 * 100 * pi},
    ),
    "a coil behind a current source": (
        "I1 0 a sin(0.1 1 50)\nL1 a b 1m\nR1 b 0 10\nC1 b 0 1u\n.save v(a,b) i(c1)",
        {"v(a,b)": 1e-3 * 100 * pi, "i(c1)": 0},
    ),
    "given charges beside a switch and a diode": (
        "V1 a 0 5\nL1 a b 1m ic=0.2\nR1 b c 10\nC1 c 0 1u ic=2\nD1 0 c dm\nS1 c 0 g 0 sw\nVg g 0 0\n"
        ".model dm d(is=1e-14)\n.model sw sw(vt=1 ron=1 roff=1meg)\n.save i(c1) v(a,b) i(r1)",
        {"i(c1)": 0.2 - 2e-6, "v(a,b)": 1, "i(r1)": 0.2},
    ),
    "a switch that is on": (
        "V1 a 0 5\nL1 a b 1m ic=0.2\nS1 b 0 g 0 sw\nVg g 0 2\nD1 b d dm\nC1 d 0 1u ic=12\n"
        ".model dm d(is=1e-14)\n.model sw sw(vt=1 ron=1 roff=1meg)\n.save i(c1) v(a,b)",
        {"i(c1)": 0, "v(a,b)": 4.8},
    ),
}


def first(deck: str, method: str, tail: str, tran: str, reltol: float) -> emsim.Result:
    text = f"a first row\n.gravity 9.81\n{deck}\n.options {tail} reltol={reltol:g}\n.tran {tran}\n.end\n"
    try:
        return emsim.run(text, method=method)
    except (emsim.DeckError, emsim.ConvergenceError) as why:
        if "E413" not in str(why):
            raise
        pytest.skip("the method does not do this deck")


def close(run: emsim.Result, expected: dict[str, float]) -> None:
    for name, value in expected.items():
        assert run[name][0] == pytest.approx(value, rel=1e-9, abs=1e-11), name


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("formulation", ["joint", "absolute"])
@pytest.mark.parametrize("name", MACHINES)
def test_a_machine_begins_with_its_accelerations_and_forces(name: str, formulation: str, method: str) -> None:
    deck, expected = MACHINES[name]
    uic = " uic" if "ic=0.3" in deck else ""
    for reltol in (1e-3, 1e-9):
        close(first(deck, method, f"formulation={formulation}", f"10m 50m{uic}", reltol), expected)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", CIRCUITS)
def test_a_circuit_begins_with_what_flows(name: str, method: str) -> None:
    deck, expected = CIRCUITS[name]
    uic = " uic" if "ic=" in deck else ""
    close(first(deck, method, "gmin=1e-20", f"10u 200u{uic}", 1e-4), expected)

"""CLOCK, BLOCK, PWM: values beside recursions in Python, a sampled servo beside its exact discretisation, edges."""

import numpy as np
import pytest
from scipy.linalg import expm

import emsim

EMPTY = "V1 in 0 1\nR1 in 0 1k\n"


def run(lines: str, tran: str = ".tran 1m 20m") -> emsim.Result:
    return emsim.run(f"clocked\n{lines}\n{tran}\n.end\n")


def held(r: emsim.Result, name: str, ticks: np.ndarray, period: float) -> np.ndarray:
    """The value within each period."""
    return np.array([r.at(name, t + 0.5 * period) for t in ticks])


def test_difference_equations_are_exact():
    r = run(
        EMPTY + "CLOCK clk period=1m\nBLOCK b clock=clk x[-1]=1 x[-2]=-1 x={1.6*x[-1] - 0.89*x[-2] + v(in)}"
    )
    x, expected = [-1.0, 1.0], []
    for _ in range(20):
        x.append(1.6 * x[-1] - 0.89 * x[-2] + 1.0)
        expected.append(x[-1])
    np.testing.assert_allclose(held(r, "b.x", np.arange(20) * 1e-3, 1e-3), expected, rtol=1e-12)


def test_transfer_function_is_its_closed_form():
    """z^-1/(1 - a z^-1) of a step is (1 - a^k)/(1 - a)."""
    r = run(EMPTY + "CLOCK clk period=1m\nBLOCK b clock=clk y={ztf(v(in), 0,1, 1,-0.7)} m={average(y,3)}")
    k = np.arange(20)
    y = (1 - 0.7**k) / 0.3
    np.testing.assert_allclose(held(r, "b.y", k * 1e-3, 1e-3), y, atol=1e-12)
    mean = np.convolve(y, np.ones(3) / 3)[:20]
    np.testing.assert_allclose(held(r, "b.m", k * 1e-3, 1e-3), mean, atol=1e-12)


def test_clocks_of_clocks_and_delays():
    r = run(
        EMPTY + "CLOCK a period=1m\nCLOCK b of=a every=4 skip=2\nCLOCK c period=1m delay=0.25m\n"
        "BLOCK n clock=a x={x[-1] + 1}\nBLOCK m clock=b y={n.x}\nBLOCK l clock=c z={time}"
    )
    # at a common tick the slow block sees what the fast one has just computed
    assert [r.at("m.y", t) for t in (1.9e-3, 2.5e-3, 5.9e-3, 6.5e-3)] == [0, 3, 3, 7]
    assert [r.at("l.z", t) for t in (3.2e-3, 3.3e-3)] == pytest.approx([2e-3, 3e-3], abs=1e-15)


def test_pid_keeps_to_its_bounds_and_does_not_wind_up():
    deck = "V1 in 0 PWL(0 1 10.5m 1 10.6m -1)\nR1 in 0 1k\nCLOCK clk period=1m\n"
    r = run(deck + "BLOCK b clock=clk u={pid(v(in), 1, 500, 0, -2, 2)}")
    u = held(r, "b.u", np.arange(20) * 1e-3, 1e-3)
    i, expected = 0.0, []
    for k in range(20):
        e = 1.0 if k <= 10 else -1.0
        j = i + 0.5 * e
        w = e + j
        i = i if (w > 2 and j > i) or (w < -2 and j < i) else j
        expected.append(min(max(e + i, -2), 2))
    np.testing.assert_allclose(u, expected, rtol=1e-12)
    assert u[10] == 2 and u[11] == pytest.approx(-0.5)


def test_states_and_counts():
    deck = "V1 in 0 PULSE(0 5 0 1n 1n 3m 6m)\nV2 b 0 PULSE(0 5 1.5m 1n 1n 3m 6m)\nCLOCK clk period=1m offset=0.2m\n"
    r = run(
        deck
        + "BLOCK m clock=clk s={next(s[-1], 0,v(in)>1,1, 1,v(in)<1,2, 2,v(in)>1,0)} n={quad(v(in)/5, v(b)/5)}"
    )
    assert [r.at("m.s", t) for t in (0.1e-3, 0.5e-3, 3.5e-3, 6.5e-3, 7.5e-3)] == [0, 1, 2, 0, 1]
    # four counts each 6 ms, up as a is before b
    assert r.at("m.n", 18.1e-3) - r.at("m.n", 6.1e-3) == 8


SERVO = """
CLOCK clk freq=20k
BLOCK pos clock=clk e={{1 - angle(shaft)}} u={{40*e - 0.8*omega(shaft)}} v(drive)={{u}}
BODY rotor j=20u m=0.1
JOINT shaft 0 rotor pin
MOTOR m1 drive 0 shaft kt=20m r=2 l=1m b=1u
.options reltol={reltol} abstol={reltol} method=radau
"""


def exact_servo(ticks: int) -> np.ndarray:
    """Current, speed, angle at the ticks: x' = A x + B u with u held, by the exponential of (A B; 0 0)."""
    r, coil, k, b, j, h = 2.0, 1e-3, 20e-3, 1e-6, 20e-6, 1 / 20e3
    a = np.array([[-r / coil, -k / coil, 0, 1 / coil], [k / j, -b / j, 0, 0], [0, 1, 0, 0], [0, 0, 0, 0]])
    step, x, found = expm(a * h), np.zeros(3), []
    for _ in range(ticks):
        found.append(x)
        u = 40 * (1 - x[2]) - 0.8 * x[1]
        x = (step @ [*x, u])[:3]
    return np.array(found)


@pytest.mark.parametrize(("reltol", "error"), [(1e-4, 1e-6), (1e-6, 1e-7), (1e-9, 1e-8)])
def test_servo_beside_its_exact_discretisation(reltol, error):
    r = run(SERVO.format(reltol=reltol), ".tran 1m 20m")
    expected = exact_servo(400)
    angle = [r.at("angle(shaft)", k / 20e3) for k in range(0, 400, 20)]
    assert np.abs(np.array(angle) - expected[::20, 2]).max() < error


def test_two_points_a_sample():
    r = run(SERVO.format(reltol=1e-4), ".tran 10m 50m")
    assert r.stats["steps"] <= 1010  # 1000 ticks
    assert len(r["time"]) < 2.2 * 1000


@pytest.mark.parametrize(
    ("align", "begin"),
    [("left", lambda d: 0.0), ("right", lambda d: 1 - d), ("centre", lambda d: (1 - d) / 2)],
)
def test_edges_of_timers(align, begin):
    """Duties 0.13, 0.26, .. 1.04: the last pulse fills its period."""
    r = run(
        EMPTY
        + f"CLOCK clk period=1m\nPWM p clock=clk duty={{d.x}} align={align}\nBLOCK d clock=clk x={{x[-1] + 0.13}}",
        ".tran 1m 8m",
    )
    t, high = np.asarray(r["time"]), np.asarray(r["p.high"])
    rises = t[1:][np.diff(high) > 0]
    falls = t[1:][np.diff(high) < 0]
    duty = [min(0.13 * (k + 1), 1.0) for k in range(8)]
    expected = [(k + begin(d)) * 1e-3 for k, d in enumerate(duty)]
    ends = [e + d * 1e-3 for e, d in zip(expected, duty, strict=True)]
    merged = [e for k, e in enumerate(expected) if k == 0 or abs(e - ends[k - 1]) > 1e-12]
    np.testing.assert_allclose(rises, merged, atol=2e-12)
    open_ends = [e for k, e in enumerate(ends[:-1]) if abs(e - expected[k + 1]) > 1e-12]
    np.testing.assert_allclose(falls[: len(open_ends)], open_ends, atol=2e-12)


def test_dead_time_and_nodes():
    r = run(
        EMPTY + "CLOCK clk period=1m\nPWM p g h clock=clk duty=0.4 dead=0.05m level=5\nR2 g 0 1k\nR3 h 0 1k",
        ".tran 1m 4m",
    )
    at = lambda name, t: r.at(name, 2e-3 + t * 1e-3)  # noqa: E731
    assert [at("v(g)", t) for t in (0.34, 0.36, 0.69, 0.71)] == pytest.approx([0, 5, 5, 0])
    assert [at("v(h)", t) for t in (0.29, 0.31, 0.74, 0.76)] == pytest.approx([5, 0, 0, 5])


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        ("BLOCK b clock=clk x={y} y={x}", "E391.*need each other"),
        ("BLOCK b clock=clk x={x + 1}", "E391.*`b.x` needs itself"),
        ("BLOCK b clock=clk x={ddt(v(in))}", "E392.*continuous time"),
        ("BLOCK b clock=clok x={1+v(in)}", "E390.*no CLOCK is called `clok`(.|\n)*did you mean `clk`"),
        ("BLOCK b clock=clk x={v(in)}\nB1 1 0 V={b.y}\nR2 1 0 1", "E390.*no signal `y`"),
        ("BLOCK b clock=clk x={v(in)[-1]}", "E10"),
        ("BLOCK b clock=clk time={1}", "E390.*cannot be called `time`"),
        ("BLOCK b clock=clk y[-1]=2 x={v(in)}", "E390.*has no signal `y`"),
        ("B1 1 0 V={pid(v(in),1,1,0,0,1)}\nR2 1 0 1", "E392.*belongs into the equations"),
        ("CLOCK c of=clk every=1.5", "E390.*counts ticks"),
        ("CLOCK c freq=1k period=1m", "E390.*pace twice"),
    ],
)
def test_messages(lines, said):
    with pytest.raises(emsim.DeckError, match=said):
        run(EMPTY + "CLOCK clk period=1m\n" + lines)


def test_a_tick_without_a_value_ends_the_run():
    with pytest.raises(Exception, match=r"b\.x. is not finite"):
        run(EMPTY + "CLOCK clk period=1m\nBLOCK b clock=clk z={z[-1] + 1} x={1/(3 - z)}")


def test_operating_point_and_small_signals_hold_what_was_before():
    deck = "V1 in 0 1 ac 1\nCLOCK clk period=1m\nBLOCK b clock=clk x[-1]=3 x={v(in)} v(out)={x}\nR1 out 0 1\n"
    r = emsim.run(f"t\n{deck}.op\n.end\n")
    assert float(r["v(out)"][0]) == pytest.approx(3)
    small = emsim.run(f"t\n{deck}.ac dec 1 1 10\n.end\n")
    assert abs(small["v(out)"][0]) == 0 and any(d.code == "W390" for d in small.diagnostics)
    with pytest.raises(emsim.DeckError, match="E440"):
        emsim.run(f"t\n{deck}.ss 10u 1m\n.end\n")


def test_field_oriented_control_beside_its_equations_in_rotor_axes():
    """Voltages stand still between ticks while the rotor turns: di/dt in rotor axes with the voltage turned back."""
    from scipy.integrate import solve_ivp

    rs, coil, psi, p, j = 0.3, 0.6e-3, 12e-3, 4, 100e-6
    r = emsim.run("netlists/coupled/foc_sampled.cir")
    period, x, i = 1 / 20e3, np.zeros(4), np.zeros(3)  # x: id, iq, speed, angle

    def pid(k: int, e: float, kp: float, ki: float, bound: float) -> float:
        new = i[k] + ki * period * e
        w = kp * e + new
        if not ((w > bound and new > i[k]) or (w < -bound and new < i[k])):
            i[k] = new
        return min(max(kp * e + i[k], -bound), bound)

    for _ in range(200):
        ref = pid(0, 100 - x[2], 0.1, 5, 10)
        vd, vq, th0 = pid(1, -x[0], 1, 400, 20), pid(2, ref - x[1], 1, 400, 20), p * x[3]

        def rates(t, x, vd=vd, vq=vq, th0=th0):
            turned = (vd + 1j * vq) * np.exp(1j * (th0 - p * x[3]))
            w = p * x[2]
            torque = 1.5 * p * psi * x[1] - 0.1
            return [
                (turned.real - rs * x[0] + w * coil * x[1]) / coil,
                (turned.imag - rs * x[1] - w * (coil * x[0] + psi)) / coil,
                torque / j,
                x[2],
            ]

        x = solve_ivp(rates, (0, period), x, rtol=1e-9, atol=1e-11).y[:, -1]
    assert r.at("omega(shaft)", 200 * period) == pytest.approx(x[2], rel=1e-5)
    assert r.at("foc.q", 199.5 * period) == pytest.approx(r.at("foc.ref", 199.5 * period), rel=0.2)


LOOP = "CLOCK c {c}\nCLOCK d {d}\nBLOCK b clock={b} n[-1]=0 n={{n[-1]+time}} v(u)={{n}}\nPWM p h l {p}\nR1 h x 1k\nC1 x l 1n\n"
USUAL = {"c": "freq=1meg", "d": "of=c every=2", "b": "d", "p": "clock=c duty={0.3} level=2"}


@pytest.mark.parametrize(
    ("card", "one", "other"),
    [
        ("c", "freq=1meg", "freq=2meg"),
        ("c", "period=1u", "period=2u"),
        ("c", "freq=1meg offset=0.2u", "freq=1meg offset=0.3u"),
        ("c", "freq=1meg delay=0.2u", "freq=1meg delay=0.3u"),
        ("d", "of=c every=2", "of=c every=3"),
        ("d", "of=c every=3 skip=1", "of=c every=3 skip=2"),
        ("d", "of=c every=2 delay=0.2u", "of=c every=2 delay=0.3u"),
        ("d", "of=c every=2", "freq=1meg"),
        ("b", "c", "d"),
        ("p", "clock=c duty={0.3}", "clock=d duty={0.3}"),
        ("p", "clock=c duty={0.3}", "clock=c duty={0.4}"),
        ("p", "clock=c duty={0.3} align=left", "clock=c duty={0.3} align=right"),
        ("p", "clock=c duty={0.3} dead=10n", "clock=c duty={0.3} dead=20n"),
        ("p", "clock=c duty={0.3} level=2", "clock=c duty={0.3} level=3"),
    ],
)
def test_no_word_of_a_clock_is_ignored(card, one, other):
    def seen(told: str) -> np.ndarray:
        cards = LOOP.format(**{**USUAL, card: told})
        result = emsim.run(f"words\n{cards}.tran 0.25u 7.9u\n.end\n")
        return np.concatenate(
            [np.interp(np.linspace(1e-6, 7.9e-6, 50), result.time, result[s]) for s in ("v(u)", "v(x)")]
        )

    assert np.abs(seen(one) - seen(other)).max() > 1e-9

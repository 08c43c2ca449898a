"""slew(), timers that events set, absdelta, filters in z, idt with a reset: beside courses made by hand, under every method."""

from __future__ import annotations

from math import pi, sin, sqrt
from pathlib import Path

import numpy as np
import pytest
from module_decks import run
from scipy.optimize import brentq
from scipy.signal import lfilter

import emsim

METHODS = ["auto", "radau", "gear", "trap", "esdirk"]
HEADER = "inout in, out; electrical in, out;"


def behaving(tmp_path: Path, body: str, source: str, tail: str, declared: str = "") -> emsim.Result:
    module = f"module m(in, out); {HEADER} {declared}\nanalog begin {body} end\nendmodule\n"
    return run(
        tmp_path, module, f"V1 in 0 {source}\nN1 in out n\nR1 out 0 1k\n.model n m\n.save v(out)\n{tail}"
    )


def slewed_sine(rate: float) -> list[tuple[float, float, str]]:
    """sin(2 pi t) held to +-rate: it leaves the sine where that is as steep and meets it where the line does, in turn."""
    w, t, parts = 2 * pi, 0.0, []
    leave = (
        np.arccos(rate / w) / w
    )  # cos = rate/w: where the slope falls below the rate; before it the line from 0
    assert rate < w
    meets = brentq(lambda s: sin(w * s) - rate * s, leave, 0.5)
    parts.append((0.0, meets, "up"))
    t = 0.5 - leave  # the slope falls below -rate
    if meets > t:
        return []
    while t < 3:
        parts.append((parts[-1][1], t, "on"))
        way = -1 if sin(w * (t - 0.01)) > 0 else 1
        start = sin(w * t)
        end = brentq(
            lambda s, t=t, start=start, way=way: sin(w * s) - (start + way * rate * (s - t)),
            t + 0.05,
            t + 0.49,
        )
        parts.append((t, end, "up" if way > 0 else "down"))
        t += 0.5
    return parts


@pytest.mark.parametrize("method", METHODS)
def test_a_sine_that_is_too_steep(method: str, tmp_path: Path) -> None:
    rate = 4.5
    found = behaving(
        tmp_path,
        f"V(out) <+ slew(V(in), {rate});",
        "sin(0 1 1)",
        f".options method={method} reltol=1e-6\n.tran 5m 3",
    )
    parts = slewed_sine(rate)
    assert len(parts) == 13
    for begins, ends, kind in parts:
        for share in (0.1, 0.5, 0.9):
            t = begins + share * (ends - begins)
            if t > 2.99:
                continue
            course = sin(2 * pi * begins) + {"up": 1, "down": -1, "on": 0}[kind] * rate * (t - begins)
            wanted = sin(2 * pi * t) if kind == "on" else course
            assert found.at("v(out)", t) == pytest.approx(wanted, abs=2e-3)


@pytest.mark.parametrize("method", METHODS)
def test_jumps_become_ramps(method: str, tmp_path: Path) -> None:
    """A square of 0 and 1 that rises with 5/s and falls with 20/s; one that turns too early goes back from where it is."""
    found = behaving(
        tmp_path,
        "V(out) <+ slew(V(in) > 0 ? 1 : 0, 5, -20);",
        "sin(0 1 4)",
        f".options method={method} reltol=1e-6\n.tran 2m 1",
    )
    for k in range(3, 99):
        t = k * 0.01 + 0.003
        period, within = divmod(t, 0.25)
        high = 0.625 if within < 0.125 else 0.0
        wanted = 5 * within if high else max(0.625 - 20 * (within - 0.125), 0.0)
        assert found.at("v(out)", t) == pytest.approx(wanted, abs=2e-3), (period, within)


def test_slew_at_operating_points_and_small_signals(tmp_path: Path) -> None:
    body = "V(out) <+ slew(V(in) * V(in), 1, -1);"
    assert behaving(tmp_path, body, "0.5", ".op")["v(out)"][-1] == pytest.approx(0.25)
    assert list(behaving(tmp_path, body, "0", ".dc V1 0 2 1")["v(out)"]) == pytest.approx([0, 1, 4])
    assert abs(behaving(tmp_path, body, "0.5 ac 1", ".ac lin 1 1k 1k")["v(out)"][0]) == pytest.approx(1.0)
    with pytest.raises(emsim.DeckError, match="slew with slopes of -1 and 1"):
        behaving(tmp_path, "V(out) <+ slew(V(in), -1);", "0", ".op")
    with pytest.raises(emsim.DeckError, match="a slope of slew hangs on voltages"):
        behaving(tmp_path, "V(out) <+ slew(V(in), V(in));", "0", ".op")


@pytest.mark.parametrize("method", METHODS)
def test_a_timer_that_its_own_event_sets(method: str, tmp_path: Path) -> None:
    """Each wait is 1.5 times as long as the one before."""
    found = behaving(
        tmp_path,
        "@(initial_step) begin next = 0.1; wait_ = 0.1; n = 0; end\n"
        "@(timer(next)) begin n = n + 1; wait_ = 1.5 * wait_; next = next + wait_; end\nV(out) <+ n;",
        "0",
        f".options method={method}\n.tran 5m 2",
        "real next, wait_; integer n;",
    )
    instants, t, wait = [], 0.1, 0.1
    while t < 2:
        instants.append(t)
        wait *= 1.5
        t += wait
    assert len(instants) == 5
    for k in range(400):
        t = k * 0.005 + 0.0021
        assert found.at("v(out)", t) == pytest.approx(sum(i < t for i in instants), abs=1e-9)


def test_a_period_that_an_event_changes(tmp_path: Path) -> None:
    """Every 0.1 s; from 0.56 s on every 0.03 s, counted from 0.1 s: the next one is at 0.58 s."""
    found = behaving(
        tmp_path,
        "@(initial_step) begin p = 0.1; n = 0; end @(timer(0.56)) p = 0.03; @(timer(0.1, p)) n = n + 1; V(out) <+ n;",
        "0",
        ".tran 2m 1",
        "real p; integer n;",
    )
    instants = [0.1, 0.2, 0.3, 0.4, 0.5] + [0.1 + 0.03 * k for k in range(16, 30)]
    for k in range(1, 199):
        t = k * 0.005 + 0.0012
        assert found.at("v(out)", t) == pytest.approx(sum(i < t for i in instants), abs=1e-9)


@pytest.mark.parametrize("method", METHODS)
def test_absdelta_quantises(method: str, tmp_path: Path) -> None:
    """Where it has gone 0.25 from the last one: sin passes k/4 at asin(k/4), downwards as far again."""
    found = behaving(
        tmp_path,
        "@(absdelta(V(in), 0.25)) v = V(in); V(out) <+ v;",
        "sin(0 1.1 1)",
        f".options method={method} reltol=1e-6\n.tran 2m 1",
        "real v;",
    )
    last = 0.0
    for k in range(20_000):
        t = k * 5e-5
        x = 1.1 * sin(2 * pi * t)
        if abs(x - last) > 0.25:
            last += 0.25 if x > last else -0.25
        if k % 97 == 31:
            assert found.at("v(out)", t) == pytest.approx(last, abs=2e-3), t


FILTERS = {
    "zi_nd": ("'{0.2, 0.1}", "'{1, -1.2, 0.5}", [0.2, 0.1], [1, -1.2, 0.5]),
    "zi_zp": ("'{0.3, 0}", "'{0.6, 0.3, 0.6, -0.3}", [1, -0.3], [1, -1.2, 0.45]),
    "zi_np": ("'{0.5}", "'{0.9, 0}", [0.5], [1, -0.9]),
    "zi_zd": ("'{-1, 0}", "'{2, -1}", [1, 1], [2, -1]),
}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", FILTERS)
def test_filters_of_samples(name: str, method: str, tmp_path: Path) -> None:
    """Beside scipy's lfilter of the same samples; before them the input stood still."""
    top, bottom, b, a = FILTERS[name]
    found = behaving(
        tmp_path,
        f"V(out) <+ {name}(V(in), {top}, {bottom}, 10m, 0, 3m);",
        "sin(0.5 1 3)",
        f".options method={method} reltol=1e-6\n.tran 1m 0.5",
    )
    samples = [0.5 + sin(2 * pi * 3 * (0.003 + 0.01 * k)) for k in range(50)]
    course = lfilter(b, a, [0.5] * 2000 + samples)[2000:]
    for k in range(49):
        assert found.at("v(out)", 0.0085 + 0.01 * k) == pytest.approx(course[k], abs=2e-4)
    assert found.at("v(out)", 0.002) == pytest.approx(0.5 * sum(b) / sum(a), rel=1e-6)


def test_an_edge_of_a_filter_and_an_integrator(tmp_path: Path) -> None:
    found = behaving(
        tmp_path,
        "V(out) <+ zi_nd(V(in), '{1}, '{1, -1}, 0.1, 20m, 0.1);",
        "2",
        ".tran 1m 1\n.options reltol=1e-6",
    )
    # a pole at 0 Hz: it begins with one sample of 2, and 2 more each
    for k in range(1, 9):
        assert found.at("v(out)", 0.1 * k + 0.01) == pytest.approx(2 * k + 1, abs=1e-3)
        assert found.at("v(out)", 0.1 * k + 0.05) == pytest.approx(2 * k + 2, abs=1e-6)


@pytest.mark.parametrize(
    ("call", "said"),
    [
        ("zi_nd(V(in), '{1}, '{0, 1}, 1m)", "the denominator begins with 0"),
        ("zi_nd(V(in), '{1}, '{1}, 0)", "a period of 0 s"),
        ("zi_zp(V(in), '{0.1, 0.2}, '{0, 0}, 1m)", "complex roots come in pairs"),
    ],
)
def test_filters_that_cannot_be(call: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(emsim.DeckError, match=said):
        behaving(tmp_path, f"V(out) <+ {call};", "0", ".op")


@pytest.mark.parametrize("method", METHODS)
def test_an_integral_that_is_reset(method: str, tmp_path: Path) -> None:
    """Of cos(2 pi t) from 0.25 on, held there while the source of 2 Hz is above 0."""
    found = behaving(
        tmp_path,
        "V(out) <+ idt(cos(6.283185307179586 * $abstime), 0.25, V(in) > 0);",
        "sin(0 1 2)",
        f".options method={method} reltol=1e-7\n.tran 2m 2",
    )
    for k in range(1, 99):
        t = 0.02 * k + 0.003
        half = (t // 0.25) * 0.25
        free = (t // 0.25) % 2 == 1
        wanted = 0.25 + (sin(2 * pi * t) - sin(2 * pi * half)) / (2 * pi) if free else 0.25
        assert found.at("v(out)", t) == pytest.approx(wanted, abs=2e-4)


def test_a_shift_register_of_a_row(tmp_path: Path) -> None:
    found = behaving(
        tmp_path,
        "@(initial_step) for (k = 0; k < 3; k = k + 1) x[k] = 0;\n"
        "@(timer(0.1, 0.1)) begin x[2] = x[1]; x[1] = x[0]; x[0] = V(in); end\nV(out) <+ x[2];",
        "pwl(0 0 1 1)",
        ".tran 5m 1",
        "real x[0:2]; integer k;",
    )
    for k in range(1, 10):
        assert found.at("v(out)", 0.1 * k + 0.05) == pytest.approx(max(0.1 * (k - 2), 0.0), abs=1e-9)


def test_random_numbers_are_those_of_their_distribution(tmp_path: Path) -> None:
    """2000 draws at events: means and deviations within four times their own deviation, and the same seed gives the same ones."""
    draws = {
        "$rdist_uniform(seed, 2, 4)": (3.0, 1 / sqrt(3.0)),
        "$rdist_normal(seed, 1, 2)": (1.0, 2.0),
        "$rdist_exponential(seed, 2)": (2.0, 2.0),
        "$rdist_poisson(seed, 3)": (3.0, sqrt(3.0)),
        "$rdist_chi_square(seed, 3)": (3.0, sqrt(6.0)),
        "$rdist_erlang(seed, 2, 4)": (4.0, 4 / sqrt(2.0)),
        "$random(seed) / 2147483648.0": (0.0, 1 / sqrt(3.0)),
    }
    total = "; ".join(
        f"x = {call}; s[{2 * k}] = s[{2 * k}] + x; s[{2 * k + 1}] = s[{2 * k + 1}] + x * x"
        for k, call in enumerate(draws)
    )
    body = f"@(initial_step) seed = SEED; @(timer(1u, 1u)) begin {total}; end V(out) <+ s[0];" + "".join(
        f" o{k} = s[{k}];" for k in range(2 * len(draws))
    )
    declared = f"integer seed; real x, s[0:{2 * len(draws) - 1}];" + "".join(
        f' (* desc="sum" *) real o{k};' for k in range(2 * len(draws))
    )
    wanted = " ".join(f"@n1[o{k}]" for k in range(2 * len(draws)))
    runs = [
        behaving(
            tmp_path, body.replace("SEED", str(seed)), "0", f".tran 100u 2.0005m\n.save {wanted}", declared
        )
        for seed in (1, 1, 5)
    ]
    first, again, other = ([float(np.real(r[f"@n1[o{k}]"][-1])) for k in range(2 * len(draws))] for r in runs)
    assert first == again
    assert first != other
    n = 2000
    for k, (call, (mean, deviation)) in enumerate(draws.items()):
        average, square = first[2 * k] / n, first[2 * k + 1] / n
        assert average == pytest.approx(mean, abs=4 * deviation / sqrt(n)), call
        assert sqrt(square - average**2) == pytest.approx(deviation, rel=0.12), call


def test_the_seed_goes_on_as_the_standard_has_it(tmp_path: Path) -> None:
    """IEEE 1364, 17.9.3: 69069 seed + 1, of 32 bits with a sign."""
    seed, wanted = 12345, 0
    for _ in range(3):
        seed = (69069 * seed + 1) % 2**32
        wanted = seed - 2**32 if seed >= 2**31 else seed
    body = "@(initial_step) seed = 12345; seed2 = 12345; x = $random(seed2); x = $random(seed2); x = $random(seed2);"
    found = behaving(tmp_path, body + " V(out) <+ x / 1e9;", "0", ".op", "integer seed, seed2, x;")
    assert found["v(out)"][-1] == pytest.approx(wanted / 1e9, rel=1e-12)

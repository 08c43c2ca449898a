"""Lines with losses: small signals in closed form, steps in every method against transforms turned back, noise, ngspice."""

from __future__ import annotations

import math
import subprocess

import numpy as np
import pytest
from support import needs_ngspice

import emsim
from emsim.interop.ngspice import named_alike
from emsim.outputs import raw

METHODS = ["auto", "trap", "gear", "radau", "trbdf2", "esdirk"]
JOHNSON = 4 * 1.38064852e-23 * 300.15

# r, l, g, c of a metre
LINES = {
    "a cable": (20, 250e-9, 0, 100e-12),
    "a lossless one": (0, 250e-9, 0, 100e-12),
    "leaky": (200, 250e-9, 1e-4, 100e-12),
    "without distortion": (25, 250e-9, 1e-2, 100e-12),
    "leaky alone": (0, 250e-9, 1e-2, 100e-12),
    "in three pieces": (2000, 250e-9, 0, 100e-12),
    "hardly lossy": (1e-3, 250e-9, 0, 100e-12),
    "r and c": (1000, 0, 0, 1e-12),
    "r, g and c": (1000, 0, 1e-4, 1e-12),
    "r and g": (100, 0, 1e-3, 0),
}


def card(name):
    r, l, g, c = LINES[name]  # noqa: E741
    return f"o1 a 0 b 0 m\n.model m ltra(r={r} l={l} g={g} c={c} len=1)\n"


def ends(name, s, source, load):
    """Transfer from a source behind `source` ohm to both ends, `load` ohm at the far one."""
    r, l, g, c = LINES[name]  # noqa: E741
    along, across = s * l + r, s * c + g
    gamma, z0 = np.sqrt(along * across), np.sqrt(along / across)
    back = np.exp(-2 * gamma)
    chain_a, chain_b, chain_c = (1 + back) / 2, z0 * (1 - back) / 2, (1 - back) / z0 / 2
    voltage, current = chain_a * load + chain_b, chain_c * load + chain_a
    behind = voltage + source * current
    return voltage / behind, load * np.exp(-gamma) / behind


@pytest.mark.parametrize("name", LINES)
def test_small_signals(name):
    deck = f"line\nv1 in 0 ac 1\nr1 in a 30\n{card(name)}r2 b 0 70\n.ac dec 20 1k 10g\n.end\n"
    table = emsim.run(deck).table("ac")
    a, b = ends(name, 2j * np.pi * table["frequency"].real, 30, 70)
    # the partial fractions of a line without inductance are quadratures
    exact = 2e-5 if LINES[name][1] == 0 else 1e-8
    np.testing.assert_allclose(table["v(a)"], a, rtol=exact)
    np.testing.assert_allclose(table["v(b)"], b, atol=exact)


@pytest.mark.parametrize("name", LINES)
def test_operating_points(name):
    r, _, g, _ = LINES[name]
    deck = f"line\nv1 in 0 2\nr1 in a 30\n{card(name)}r2 b 0 70\n.op\n.dc v1 0 2 1\n.tf v(b) v1\n.tran 1n 20n\n.end\n"
    run = emsim.run(deck)
    a, b = (2.0, 2.0 * 70 / 100) if r == g == 0 else (2.0 * x for x in ends(name, 1e-2, 30, 70))
    if r == 0 and g:
        b = a = 2.0 / (1 + 30 * (1 / 70 + g))
    elif r == 0:
        a = b
    assert run.op["v(a)"][0] == pytest.approx(a, rel=1e-7)
    assert run.op["v(b)"][0] == pytest.approx(b, rel=1e-7)
    assert run.table("dc")["v(b)"][1] == pytest.approx(b / 2, rel=1e-7)
    assert run.table("tf")["transfer_function"][0] == pytest.approx(b / 2, rel=1e-7)
    # a run from there stays
    np.testing.assert_allclose(run.table("tran")["v(b)"], b, rtol=1e-6)


RISE = 0.2e-9


def turned_back(f, until, count=1 << 16):
    """The inverse Laplace transform at `count`/2 times up to `until`, by Fourier's along Re s = c."""
    whole = 2 * until
    shift = 26 / whole
    s = shift + 2j * np.pi * np.arange(count // 2 + 1) / whole
    t = np.arange(count) * whole / count
    return t[: count // 2], (np.fft.irfft(f(s), count) * count / whole * np.exp(shift * t))[: count // 2]


def step(s):
    """A ramp from 0 to 1 over RISE, rounded by two more of them: what is cut off of its transform is nothing."""
    return np.exp(-1e-9 * s) * ((1 - np.exp(-RISE * s)) / (RISE * s)) / s


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    "name", ["a cable", "leaky", "without distortion", "in three pieces", "r and c", "r, g and c"]
)
def test_steps_into_lines(name, method):
    source, load = 20, 200
    run = emsim.run(
        f"line\nv1 in 0 pulse(0 1 1n {RISE} {RISE} 1 2)\nr1 in a {source}\n{card(name)}r2 b 0 {load}\n"
        f".options method={method} reltol=1e-5\n.tran 0.05n 30n\n.end\n"
    )
    t, a = turned_back(lambda s: step(s) * ends(name, s, source, load)[0], 40e-9)
    b = turned_back(lambda s: step(s) * ends(name, s, source, load)[1], 40e-9)[1]
    seen = slice(0, int(0.74 * len(t)), 37)
    np.testing.assert_allclose(run.at("v(a)", t[seen]), a[seen], atol=5e-5)
    np.testing.assert_allclose(run.at("v(b)", t[seen]), b[seen], atol=5e-5)


def test_a_step_goes_into_an_rc_line_as_erfc():
    """Of a line without end: v(x, t) = erfc(x sqrt(r c/(4 t))); its end far away, and matched by nothing until it is seen."""
    r, c, x = 1e3, 1e-9, 1.0
    run = emsim.run(
        f"line\nv1 a 0 pulse(0 1 0 1p)\no1 a 0 m 0 one\no2 m 0 e 0 rest\n.model one ltra(r={r} c={c} len={x})\n"
        f".model rest ltra(r={r} c={c} len=9)\nr1 e 0 1e6\n.options reltol=1e-6\n.tran 1n 3u\n.end\n"
    )
    t = np.linspace(0.02e-6, 3e-6, 200)
    expected = np.array([math.erfc(x * math.sqrt(r * c / (4 * s))) for s in t])
    np.testing.assert_allclose(run.at("v(m)", t), expected, atol=2e-6)


def test_without_losses_it_is_a_t_line():
    deck = "line\nv1 in 0 pulse(0 1 1n 0.1n 0.1n 4n 9n)\nr1 in a 20\n{}r2 b 0 200\nc2 b 0 1p\n"
    deck += ".options reltol=1e-6\n.tran 0.1n 40n\n.end\n"
    lossy = emsim.run(deck.format(card("a lossless one")))
    lossless = emsim.run(deck.format("t1 a 0 b 0 z0=50 td=5n\n"))
    t = np.linspace(0, 40e-9, 700)
    np.testing.assert_allclose(lossy.at("v(b)", t), lossless.at("v(b)", t), atol=2e-5)


@pytest.mark.parametrize("name", ["a cable", "in three pieces", "r and c", "leaky"])
def test_noise_of_what_is_warm_alike(name):
    """The noise between two terminals is 4 k T times the real part of the impedance there (Nyquist)."""
    deck = f"line\nv1 in 0 {{}}\nr1 in a 50\n{card(name)}r2 b 0 70\n{{}}\n.end\n"
    noise = emsim.run(deck.format("ac 1", ".noise v(b) v1 dec 5 100k 3g")).table("noise")
    z = emsim.run(deck.format("0", "i1 0 b ac 1\n.ac dec 5 100k 3g")).table("ac")["v(b)"]
    np.testing.assert_allclose(noise["onoise_spectrum"] ** 2, JOHNSON * z.real, rtol=5e-5)


@pytest.mark.parametrize("name", ["a cable", "leaky", "r, g and c"])
def test_sensitivities(name):
    r, l, g, c = LINES[name]  # noqa: E741
    values = {"r": r, "l": l, "g": g, "c": c, "len": 1.0}

    def deck(cards, **changed):
        words = " ".join(f"{k}={v!r}" for k, v in (values | changed).items())
        text = f"line\nv1 in 0 dc 1 ac 1\nr1 in a 30\no1 a 0 b 0 m\n.model m ltra({words})\nr2 b 0 70\n{cards}\n.end\n"
        return emsim.run(text)

    ours = [deck(card) for card in (".sens v(b)", ".sens v(b) ac dec 3 1meg 1g")]
    for key, value in values.items():
        if not value:
            continue
        h = 1e-5 * value
        one, other = (deck(".op\n.ac dec 3 1meg 1g", **{key: value + side * h}) for side in (1, -1))
        slopes = [(one.table(k)["v(b)"] - other.table(k)["v(b)"]) / (2 * h) for k in ("op", "ac")]
        for table, slope in zip((o.table("sens") for o in ours), slopes, strict=True):
            scale = max(np.abs(slope).max(), 1e-4 / value)
            np.testing.assert_allclose(table[f"o1:{key}"], slope, atol=1e-4 * scale)


def test_energy_of_a_line_is_in_the_ledger():
    run = emsim.run(
        f"line\nv1 in 0 pulse(0 1 1n 0.2n 0.2n 8n 20n)\nr1 in a 30\n{card('a cable')}r2 b 0 70\n.tran 0.1n 60n\n.end\n",
        energy=True,
    )
    assert run.energy.share < 1e-4


def test_a_start_from_given_values():
    """A cable that has been at 1 V with no load is let go into its own impedance."""
    deck = (
        "line\nr1 a 0 1e9\no1 a 0 b 0 m ic=1,0,1,0\nr2 b 0 50\n.model m ltra(r=2 l=250n c=100p len=1)\n"
        ".options reltol=1e-6\n.tran 0.1n 9n uic\n.end\n"
    )
    run = emsim.run(deck)
    assert run.at("v(a)", 4.9e-9) == pytest.approx(1.0, abs=1e-6)  # knows nothing of the far end yet
    assert run.at("v(b)", 0.01e-9) == pytest.approx(0.5, abs=1e-3)


def test_poles_of_a_line_of_resistance_and_capacitance():
    """Shorted at both ends it has k^2 pi^2/(r c) each, the fast ones in groups."""
    table = emsim.run(
        "line\nv1 a 0 ac 1\nr1 b 0 1e-6\no1 a 0 b 0 m\n.model m ltra(r=1k c=1n len=1)\n.pz a 0 b 0 vol pol\n.end\n"
    ).table("pz")
    poles = sorted(-table[name][0].real for name in table.names if "pole" in name)
    np.testing.assert_allclose(poles[:6], [(k * math.pi) ** 2 / 1e-6 for k in range(1, 7)], rtol=1e-6)


@pytest.mark.parametrize(
    ("line", "model"),
    [
        ("o1 a 0 b 0 m", "ltra(r=1 l=1u c=1n)"), ("o1 a 0 b 0 m", "ltra(l=1u len=1)"), ("o1 a 0 b 0 m", "ltra(g=1 c=1n len=1)"),
        ("o1 a 0 b 0 m", "ltra(r=-1 l=1u c=1n len=1)"), ("o1 a 0 b 0 m", "ltra(r=1meg l=1u c=1n len=1)"),
        ("y1 a 0 b 0 m", "txl(r=1 l=1u c=1n)"), ("p1 a 0 b 0 m", "cpl(r=1 l=1u 2u c=1n length=1)"),
        ("p1 a a 0 b b 0 m", "cpl(r=1 0 1 l=1u 0.3u 1u c=1n -2n 1n length=1)"), ("p1 a 0 b b 0 m", "cpl(r=1 l=1u c=1n length=1)"),
        ("p1 a 0 b 0 m dimension=2", "cpl(r=1 l=1u c=1n length=1)"),
        ("p1 a a 0 b b 0 m", "cpl(r=1 0 2 l=1u 0.3u 1u c=1n -0.2n 1n length=1)"),
    ],
)  # fmt: skip
def test_what_is_no_line(line, model):
    with pytest.raises(emsim.DeckError, match="E295"):
        emsim.run(f"line\nv1 a 0 1\n{line}\n.model m {model}\nr2 b 0 120\n.op\n.end\n")


@pytest.mark.parametrize("card", [".pz a 0 b 0 vol pz", ".modes"])
def test_poles_of_a_line_with_a_delay_are_without_number(card):
    with pytest.raises(emsim.DeckError, match="E305"):
        emsim.run(
            f"line\nr1 a 0 50\no1 a 0 b 0 m\n.model m ltra(r=1 l=1u c=1n len=1)\nr2 b 0 120\n{card}\n.end\n"
        )


# ---- coupled lines ----

PAIR = "r=0.3 0 0.3 l=9.13n 3.3n 9.13n g=0 0 0 c=3.65p -0.8p 3.65p length=24"
FOUR = "r=0.03 0 0 0 0.03 0 0 0.03 0 0.03 l=9n 5.4n 0 0 9n 5.4n 0 9n 5.4n 9n "
FOUR += "c=3.5p -0.3p 0 0 3.5p -0.3p 0 3.5p -0.3p 3.5p length=6.3"


def symmetric(*rows):
    n = len(rows)
    found = np.zeros((n, n))
    for k, row in enumerate(rows):
        found[k, k:] = row
    return found + np.triu(found, 1).T


def test_small_signals_of_coupled_lines():
    """By the exponential of the chain matrix of both conductors."""
    r, length = np.diag([0.3, 0.3]), 24
    l, c = symmetric([9.13e-9, 3.3e-9], [9.13e-9]), symmetric([3.65e-12, -0.8e-12], [3.65e-12])  # noqa: E741
    table = emsim.run(
        f"pair\nv1 in 0 ac 1\nr1 in a 30\np1 a b 0 c d 0 m\nr3 b 0 50\nr4 c 0 60\nr5 d 0 70\n"
        f".model m cpl({PAIR})\n.ac dec 9 100k 2g\n.end\n"
    ).table("ac")
    for k, f in enumerate(table["frequency"].real):
        s = 2j * np.pi * f
        chain = np.block([[np.zeros((2, 2)), -(r + s * l)], [-s * c, np.zeros((2, 2))]]) * length
        values, vectors = np.linalg.eig(chain)
        whole = vectors @ np.diag(np.exp(values)) @ np.linalg.inv(vectors)
        # v1 + source i1 = (1, 0), v2 = load i2 (out of the far end)
        source, load = np.diag([30, 50]), np.diag([60, 70])
        far = np.vstack([load, np.eye(2)])  # of the currents out
        near = np.linalg.inv(whole) @ far
        out = np.linalg.solve(near[:2] + source @ near[2:], np.array([1.0, 0.0]))
        v1, v2 = near[:2] @ out, load @ out
        found = [table[f"v({n})"][k] for n in "abcd"]
        np.testing.assert_allclose(found, [*v1, *v2], atol=1e-9)


def test_coupled_lines_of_one_conductor_are_one_line():
    deck = "line\nv1 in 0 pulse(0 1 1n 0.2n 0.2n 4n 9n)\nr1 in a 20\n{}\nr2 b 0 200\n"
    deck += ".options reltol=1e-6\n.tran 0.1n 30n\n.end\n"
    one, *others = (
        emsim.run(deck.format(lines))
        for lines in (
            "o1 a 0 b 0 m\n.model m ltra(r=20 l=250n g=1m c=100p len=1)",
            "p1 a 0 b 0 m\n.model m cpl(r=20 l=250n g=1m c=100p length=1)",
            "p1 a 0 b 0 m length=1 dimension=1\n.model m cpl(r=20 l=250n g=1m c=100p len=2)",
            "y1 a 0 b 0 m len=1\n.model m txl(r=20 l=250n g=1m c=100p length=3)",
            "y1 a 0 b 0 m length=1\n.model m txl(r=20 l=250n g=1m c=100p)",
            "y1 a 0 b 0 m\n.model m txl(r=20 l=250n g=1m c=100p len=1)",
        )
    )  # fmt: skip
    t = np.linspace(0, 30e-9, 500)
    for other in others:
        np.testing.assert_allclose(one.at("v(b)", t), other.at("v(b)", t), atol=1e-9)


def test_noise_of_coupled_lines():
    deck = "pair\nv1 in 0 {}\nr1 in a 30\np1 a b 0 c d 0 m\nr3 b 0 50\nr4 c 0 60\nr5 d 0 70\n"
    deck += f".model m cpl({PAIR})\n{{}}\n.end\n"
    noise = emsim.run(deck.format("ac 1", ".noise v(d) v1 dec 5 100k 2g")).table("noise")
    z = emsim.run(deck.format("0", "i1 0 d ac 1\n.ac dec 5 100k 2g")).table("ac")["v(d)"]
    np.testing.assert_allclose(noise["onoise_spectrum"] ** 2, JOHNSON * z.real, rtol=1e-6)


def test_numbers_of_seven_digits_have_modes():
    """What two digits at the end couple is not told; a part in a hundred is."""
    deck = "pair\nv1 a 0 1\np1 a b 0 c d 0 m\nr3 b 0 50\nr4 c 0 60\nr5 d 0 70\n.model m cpl({})\n.op\n.end\n"
    manual = (
        "length=1 r=1 0 1 l=3.83572e-7 8.26253e-8 3.83572e-7 g=0 0 0 c=9.143579e-11 -9.78265e-12 9.143578e-11"
    )
    assert not emsim.run(deck.format(manual)).diagnostics
    (said,) = emsim.run(deck.format(PAIR.replace("0 0.3", "0 0.301"))).diagnostics
    assert said.code == "W290"


# ---- beside ngspice ----

DECKS = {
    "a cable and a diode": """v1 in 0 pulse(0 3 1n 0.5n 0.5n 8n 20n)
r1 in a 30
o1 a 0 b 0 m
.model m ltra(r=20 l=250n c=100p len=0.4)
d1 b 0 dm
c1 b 0 1p
r2 b 0 200
.model dm d is=1e-14 rs=2""",
    "r and c": """v1 in 0 pulse(0 1 1n 0.5n 0.5n 8n 20n)
r1 in a 30
o1 a 0 b 0 m
.model m ltra(r=1000 c=1p len=1)
r2 b 0 5k""",
    "without losses": """v1 in 0 pulse(0 1 1n 0.5n 0.5n 8n 20n)
r1 in a 30
o1 a 0 b 0 m
.model m ltra(l=250n c=100p len=1)
r2 b 0 5k""",
    "r and g": """v1 in 0 pulse(0 1 1n 0.5n 0.5n 8n 20n)
r1 in a 30
o1 a 0 b 0 m
.model m ltra(r=100 g=1m len=1)
r2 b 0 5k""",
    "one by txl": """v1 in 0 pulse(0 1 1n 0.5n 0.5n 8n 20n)
r1 in a 30
y1 a 0 b 0 m len=2
.model m txl(r=2 l=250n g=0 c=100p length=1)
r2 b 0 200""",
    "four by cpl": f"""v1 in 0 pulse(0 1 1n 0.5n 0.5n 8n 20n)
r1 in a 30
p1 a b c d 0 e f g h 0 m
.model m cpl({FOUR} g=0 0 0 0 0 0 0 0 0 0)
rb b 0 50
rc c 0 50
rd d 0 50
re e 0 50
rf f 0 50
rg g 0 50
rh h 0 50""",
}  # fmt: skip


@needs_ngspice
@pytest.mark.ngspice
@pytest.mark.parametrize("name", DECKS)
def test_as_ngspice(tmp_path, name):
    text = (
        f"lines\n{DECKS[name]}\n.options reltol=1e-5 abstol=1e-14 vntol=1e-9\n.tran 0.02n 20n 0 0.01n\n.end\n"
    )
    (tmp_path / "deck.cir").write_text(text)
    subprocess.run(
        ["ngspice", "-b", "-r", "out.raw", "deck.cir"], cwd=tmp_path, capture_output=True, timeout=60, stdin=subprocess.DEVNULL
    )  # fmt: skip
    theirs = named_alike(raw.read(str(tmp_path / "out.raw"))).plots[0]
    ours = emsim.run(text).table("tran")
    t = theirs["time"][(theirs["time"] > 1e-12) & (theirs["time"] < 19.9e-9)][::20]
    for column in ("v(a)", "v(b)"):
        a, b = ours.at(column, t), np.interp(t, theirs["time"], theirs[column])
        # of txl and cpl it takes Pade approximations
        assert np.abs(a - b).max() <= (2e-2 if "by" in name else 5e-3) * np.abs(theirs["v(a)"]).max(), column


@pytest.mark.parametrize("source", [0, 1e-6, 1, 1e3])
@pytest.mark.parametrize("r", [1e-6, 1e-3, 0.3, 7.2, 60, 250, 3000])
def test_operating_points_of_any_loss(r, source):
    """At rest the moments of a line of little loss hang on each other by large factors: Newton's method did not end."""
    head = "v1 a 0 1" if not source else f"v1 in 0 1\nr1 in a {source}"
    deck = f"line\n{head}\no1 a 0 c 0 m\n.model m ltra(r={r} l=200n c=80p len=1)\nr4 c 0 60\n.op\n.tran 0.1n 20n\n.end\n"
    run = emsim.run(deck)
    expected = 60 / (60 + r + source)
    assert run.op["v(c)"][0] == pytest.approx(expected, rel=1e-9)
    np.testing.assert_allclose(run.table("tran")["v(c)"], expected, rtol=1e-6)

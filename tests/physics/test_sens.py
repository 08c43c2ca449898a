"""`.sens`: what it says of each parameter against runs with that parameter a little other, and against ngspice."""

from __future__ import annotations

import re
import subprocess

import numpy as np
import pytest
from support import needs_ngspice

import emsim
from emsim.outputs import raw

TIGHT = ".options reltol=1e-12 abstol=1e-18 vntol=1e-15\n"

LINEAR = """everything linear
v1 in 0 dc {v1=1} ac 1
r1 in out {r1=1k} tc1={r1_tc1=1m} dtemp={r1_dtemp=10}
r2 out 0 2k m={r2_m=2}
c1 out 0 {c1=1n}
k1 l1 l2 {k1=0.5}
l1 out o2 {l1=1m}
l2 o3 0 1m
r3 o2 0 rm l={r3_l=10u} w=3u
r4 o3 0 rm2 l=20u
.model rm r rsh={r3:rsh=1k} narrow={r3:narrow=0.1u}
.model rm2 r rsh=1k
i1 0 out dc {i1=1m}
e1 x 0 out 0 {e1_gain=2}
g1 w 0 out 0 {g1_gain=2m}
r5 w x 1k
f1 w 0 v1 {f1_gain=3}
h1 y 0 v1 4
rx x 0 1k
ry y w {ry=3k}
"""
JUNCTIONS = """junctions and a switch
v1 in 0 dc {v1=1} ac 1
r1 in out {r1=1k}
d1 out 0 dm area={d1_area=1.5}
.model dm d is={d1:is=1e-14} n={d1:n=1.3} rs={d1:rs=20} cjo={d1:cjo=5n} tt={d1:tt=10n} vj={d1:vj=0.7} m={d1:m=0.4}
c1 out w {c1=10n}
s1 out w in 0 sw
r2 w 0 {r2=2k}
.model sw sw vt=0.4 ron={s1:ron=500} roff=1g
"""
LINES = """two lossless lines, one given by its frequency
v1 in 0 dc {v1=1} ac 1
r1 in a {r1=70}
t1 a 0 b 0 z0={t1_z0=50} td={t1_td=30n}
t2 b c w 0 z0={t2_z0=90} f={t2_f=3meg} nl={t2_nl=0.2}
r2 c 0 {r2=20}
r3 w 0 {r3=200}
c1 w 0 {c1=100p}
"""


def deck(template: str, changed: str = "", factor: float = 1.0) -> str:
    from emsim.units import spice_number

    def value(m) -> str:
        number = spice_number(m[2])
        return repr(number * factor) if m[1] == changed else m[2]

    return re.sub(r"\{([^=}]*)=([^}]*)\}", value, template) + TIGHT


NAMES = {
    id(t): re.findall(r"\{([^=}]*)=", t) for t in (LINEAR, JUNCTIONS, LINES)
}  # parameters that are written in the template


@pytest.mark.parametrize(("template", "out"), [(LINEAR, "w"), (JUNCTIONS, "w"), (LINES, "w")])
@pytest.mark.parametrize("over", ["", " ac dec 1 1k 1meg"])
def test_as_runs_with_another_value(template, out, over):
    """A lossless line's parameters were left out without a word."""
    table = emsim.run(deck(template) + f".sens v({out}){over}\n.end\n").table("sens")
    analysis = (over.strip() and "." + over.strip()) or ".op"

    def answer(name: str, factor: float) -> np.ndarray:
        r = emsim.run(deck(template, name, factor) + analysis + "\n.end\n")
        return r.plots[-1].column(f"v({out})")

    h = 2e-4
    for name in NAMES[id(template)]:
        from emsim.units import spice_number

        value = spice_number(re.search(r"\{" + re.escape(name) + r"=([^}]*)\}", template)[1])
        expected = (8 * (answer(name, 1 + h) - answer(name, 1 - h)) - (answer(name, 1 + 2 * h) - answer(name, 1 - 2 * h))) / (
            12 * h * value
        )  # fmt: skip
        found = table.column(name)
        # what rounding of the runs leaves of the difference
        floor = 3e-12 * np.abs(answer(name, 1.0)).max() / (h * value)
        assert np.abs(found - expected).max() <= 1e-8 * np.abs(expected).max() + abs(floor), name


@needs_ngspice
@pytest.mark.ngspice
@pytest.mark.parametrize("template", [LINEAR, JUNCTIONS.replace("area={d1_area=1.5}", "")])
@pytest.mark.parametrize("over", ["", " ac lin 1 10k 10k"])
def test_as_ngspice(tmp_path, template, over):
    """What ngspice leaves out is not looked at: of small signals their operating point, of coupled coils the mutual part; its
    d1_area is 16 V where twice the area changes the voltage by 30 mV, its k1 66 kV. Its own quotient is of first order, which
    shows where things bend."""
    if over and template is not LINEAR:
        return
    out = "w" if "s1 " not in template else "out"
    template = template.replace("s1 out w in 0 sw\n", "")
    text = deck(template) + f".sens v({out}){over}\n.end\n"
    (tmp_path / "deck.cir").write_text(text)
    subprocess.run(
        ["ngspice", "-b", "-r", "out.raw", "deck.cir"], cwd=tmp_path, capture_output=True, timeout=60, stdin=subprocess.DEVNULL
    )  # fmt: skip
    theirs = raw.read(str(tmp_path / "out.raw")).plots[0]
    ours = emsim.run(text).table("sens")
    shared = 0
    for name in theirs.names:
        plain = re.sub(r"^[vi]\((.*)\)$", r"\1", name).replace("_tc", "_tc1")
        if plain not in ours.names or plain.startswith(
            ("frequency", "r3", "d1_temp", "d1_area", "k1", "l1", "l2")
        ):
            continue
        a, b = ours.column(plain), theirs.column(name)
        if not np.abs(b).max() or (plain.endswith("_m") and plain[0] in "di"):
            continue  # ngspice has no such derivative
        shared += 1
        assert np.abs(a - b).max() <= (3e-6 if out == "w" else 3e-5) * np.abs(b).max(), plain
    assert shared >= (12 if out == "w" else 6)


def test_a_divider_in_closed_form():
    r = emsim.run("divider\nv1 a 0 6\nr1 a b 1k\nr2 b 0 2k\n.sens v(b)\n.end\n").table("sens")
    assert r["r1"][0] == pytest.approx(-6 * 2e3 / 3e3**2, rel=1e-12)
    assert r["r2"][0] == pytest.approx(6 * 1e3 / 3e3**2, rel=1e-12)
    assert r["v1"][0] == pytest.approx(2 / 3, rel=1e-12)
    assert (r.unit("r1"), r.unit("v1"), r.unit("r1_m")) == ("V/Ohm", "V/V", "V")


def test_a_capacitor_that_hangs_in_the_air():
    """Nodes whose rows are sums: the derivative of a row counts in the sum."""
    text = "x\nv1 a 0 ac 1\nc1 a b {c}\nc2 b c 2n\nc3 c 0 3n\nr1 b c 1meg\nr2 c 0 1meg\n"
    r = emsim.run(text.format(c="1n") + ".sens v(c) ac lin 1 1k 1k\n.end\n").table("sens")
    up, down = (
        emsim.run(text.format(c=c) + ".ac lin 1 1k 1k\n.end\n").table("ac").column("v(c)")[0] for c in ("1.001n", "0.999n")
    )  # fmt: skip
    assert r.column("c1")[0] == pytest.approx((up - down) / 2e-12, rel=1e-5)


@pytest.mark.parametrize(
    "card", ["", "v(b) v(a)", "v(b) ac", "v(b) ac dec 10", "i(r1)", "v(b) dc 1", "v(b) ac log 1 1 10"]
)
def test_what_is_no_card(card):
    with pytest.raises(emsim.DeckError):
        emsim.run(f"rc\nv1 a 0 1\nr1 a b 1k\nc1 b 0 1u\n.sens {card}\n.end\n")


def test_the_deck_is_as_it_was():
    text = "divider\nv1 a 0 6\nr1 a b rm l=10u\nr2 b 0 rm l=20u\n.model rm r rsh=1k\n.sens v(b)\n.op\n.end\n"
    r = emsim.run(text)
    assert r.table("op")["v(b)"][0] == pytest.approx(4.0, rel=1e-12)
    assert r.table("sens")["r1:rsh"][0] == pytest.approx(-6 * 2e3 / 3e3**2, rel=1e-11)


def test_a_scale_pan_on_a_spring():
    """At rest it hangs lower by m g/k."""
    deck = "scale\n.gravity 9.81\nBODY b m=2\nJOINT j 0 b slide axis=(0,1)\nSPRING s j k=500\nR1 a 0 1\n"
    r = emsim.run(deck + ".sens pos(j) static\n.end\n").table("sens")
    assert r["s_k"][0] == pytest.approx(2 * 9.81 / 500**2, rel=1e-10)
    assert r["b_m"][0] == pytest.approx(-9.81 / 500, rel=1e-10)


def test_a_motor_over_frequency():
    """omega/v = kt/((r + s l)(j s + b) + kt^2), by every one of these."""
    text = (
        "motor\nV1 a 0 ac 1\nMOTOR m a 0 j kt={kt} r={r} l={l}\nBODY rotor m=1 j={j}\nJOINT j 0 rotor pin\n"
        "DAMPER d j c={c}\n.sens omega(j) ac lin 1 5 5\n.end\n"
    )
    values = {"kt": 0.1, "r": 2.0, "l": 1e-3, "j": 1e-3, "c": 2e-4}
    table = emsim.run(text.format(**values)).table("sens")

    def gain(kt, r, l, j, c):  # noqa: E741
        s = 2j * np.pi * 5
        return kt / ((r + s * l) * (j * s + c) + kt * kt)

    for name, key in (("m_kt", "kt"), ("m_r", "r"), ("m_l", "l"), ("rotor_j", "j"), ("d_c", "c")):
        h = 1e-4 * values[key]
        up, down, up2, down2 = (gain(**{**values, key: values[key] + k * h}) for k in (1, -1, 2, -2))
        expected = (8 * (up - down) - (up2 - down2)) / (12 * h)
        assert table.column(name)[0] == pytest.approx(expected, rel=1e-8), name

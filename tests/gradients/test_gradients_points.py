"""`emsim.Deck.gradient` of .op, .dc and .ac, by the adjoint: beside closed forms and beside differences of runs."""

from __future__ import annotations

import math

import numpy as np
import pytest

import emsim

DIVIDER = """a divider
.param r=1k vin=10
V1 in 0 {vin}
R1 in out {r}
R2 out 0 3k
.op
.meas op vout find v(out)
.meas op drain find i(v1)
.meas op ratio param='vout/vin'
.end
"""

AMPLIFIER = """a transistor stage
.param rc=2k re=470 rb=47k vcc=12
Vcc vcc 0 {vcc}
Vin in 0 dc 0 ac 1
Cin in b 1u
Rb1 vcc b {rb}
Rb2 b 0 10k
Rc vcc c {rc}
Re e 0 {re}
Q1 c b e npn
.model npn npn is=1e-14 bf=150 vaf=80 cje=5p cjc=3p tf=0.4n
.op
.ac dec 10 10 100meg
.meas op vc find v(c)
.meas ac top max vdb(c)
.meas ac corner when vdb(c)=12 fall=1
.end
"""

LOWPASS = """a low pass
.param r=1k c=1u a=1
V1 in 0 dc 0 ac {a}
R1 in out {r}
C1 out 0 {c}
.ac dec 10 1 100k
.end
"""

TRANSFER = """a diode's transfer
.param r=1k
V1 in 0 0
R1 in out {r}
D1 out 0 dm
.model dm d is=1e-12 n=1.2
.dc v1 0 2 0.1
.meas dc half find v(out) at=1
.end
"""


def differences(deck: str, name: str, value: float, find) -> np.ndarray:
    def run(by: float) -> np.ndarray:
        return np.atleast_1d(find(emsim.run(deck, {name: repr(value + by)}, reltol=1e-12)))

    def central(by: float) -> np.ndarray:
        return (run(by) - run(-by)) / (2.0 * by)

    far = 2e-3 * abs(value)
    return (4.0 * central(0.5 * far) - central(far)) / 3.0


def test_a_divider_has_its_closed_form_at_the_operating_point():
    g = emsim.Deck(DIVIDER).gradient(by=["r", "vin", "r2"])
    r, r2, vin = 1e3, 3e3, 10.0
    assert g.names == ["vout", "drain", "ratio"] and g.by == ["r", "vin", "r2"]
    assert g["vout"] == pytest.approx(7.5, rel=1e-9)
    exact = [
        [-vin * r2 / (r + r2) ** 2, r2 / (r + r2), vin * r / (r + r2) ** 2],
        [vin / (r + r2) ** 2, -1.0 / (r + r2), vin / (r + r2) ** 2],
        [-r2 / (r + r2) ** 2, 0.0, r / (r + r2) ** 2],
    ]
    assert np.allclose(g.matrix, exact, rtol=1e-8, atol=1e-12)
    assert g["vout", "r"] == g.to_dict()["vout"]["r"]


def test_signals_of_an_operating_point_need_no_place():
    deck = DIVIDER.replace(".meas", "*.meas")
    g = emsim.Deck(deck).gradient("v(out)", by="r")
    assert g["v(out)", "r"] == pytest.approx(-10.0 * 3e3 / 4e3**2, rel=1e-8)


@pytest.mark.parametrize("by", [{"rc": 2e3}, {"re": 470.0}, {"vcc": 12.0}])
def test_an_amplifier_at_its_point_and_over_frequency(by):
    """The gain moves with the element itself, and with the operating point that the element moves."""
    ((name, value),) = by.items()
    for names in (["vc"], ["top", "corner"]):
        g = emsim.Deck(AMPLIFIER).gradient(names, by=name)
        ref = differences(AMPLIFIER, name, value, lambda r, n=names: [r.measures[m] for m in n])
        assert np.allclose(g.matrix[:, 0], ref, rtol=1e-6), (g.matrix, ref)


def test_parameters_of_models_and_the_temperature_count():
    g = emsim.Deck(AMPLIFIER).gradient("vc", by=["npn(bf)", "temp"])
    for k, (text, other) in enumerate((("bf=150", "bf={}"), (".op", ".options temp={}\n.op"))):
        value = (150.0, 27.0)[k]

        def run(by: float, text: str = text, other: str = other, value: float = value) -> float:
            deck = AMPLIFIER.replace(text, other.format(repr(value + by)))
            return emsim.run(deck, reltol=1e-12).measures["vc"]

        step = 1e-3 * value
        wide, narrow = ((run(h) - run(-h)) / (2.0 * h) for h in (2.0 * step, step))
        assert g.matrix[0, k] == pytest.approx((4.0 * narrow - wide) / 3.0, rel=1e-6)


def test_the_temperature_of_a_run_is_that_of_its_derivatives():
    deck = AMPLIFIER.replace(".op", ".options temp=60\n.op")
    here = emsim.Deck(AMPLIFIER, options={"temp": 60.0}).gradient("vc", by="rc")
    assert here["vc", "rc"] == pytest.approx(emsim.Deck(deck).gradient("vc", by="rc")["vc", "rc"], rel=1e-9)


def test_a_low_pass_over_frequency_has_its_closed_form():
    f = np.array([10.0, 159.0, 1e4])
    g = emsim.Deck(LOWPASS).gradient("v(out)", by=["r", "c1", "a"], at=f)
    s, r, c = 2j * math.pi * f, 1e3, 1e-6
    h = 1.0 / (1.0 + s * r * c)
    assert np.allclose(g.values, h, rtol=1e-9)
    assert np.allclose(g.matrix, np.stack([-s * c * h**2, -s * r * h**2, h], axis=1), rtol=1e-8)


def test_a_sweep_of_a_source():
    g = emsim.Deck(TRANSFER).gradient(by=["r", "dm(is)"])
    ref = differences(TRANSFER, "r", 1e3, lambda r: r.measures["half"])
    assert g.matrix[0, 0] == pytest.approx(ref[0], rel=1e-6)


@pytest.mark.parametrize(
    ("deck", "of", "at", "code"),
    [
        (DIVIDER, ["nothing"], None, "E289"),
        (DIVIDER.replace(".op\n", ".op\n.step param r 1k 2k 1k\n"), ["vout"], None, None),
        (LOWPASS, ["v(out)"], None, "E438"),
        (
            LOWPASS.replace("R1 in out {r}", "T1 in 0 out 0 z0=50 td=1n\nR1 out 0 {r}"),
            ["v(out)"],
            [1e3],
            "E364",
        ),
        (TRANSFER.replace(".dc v1 0 2 0.1", ".dc temp 0 50 10"), ["half"], None, "E364"),
    ],
)
def test_what_has_none_is_refused_by_name(deck, of, at, code):
    if code is None:
        assert emsim.Deck(deck).gradient(of, by="r")["vout"] == pytest.approx(7.5, rel=1e-9)
        return
    with pytest.raises(emsim.DeckError) as error:
        emsim.Deck(deck).gradient(of, by="r", at=at)
    assert error.value.diagnostics[0].code == code


def test_an_altered_element_cannot_be_read_again():
    deck = emsim.Deck(DIVIDER)
    deck.alter("r1", 2e3)
    with pytest.raises(emsim.DeckError, match="altered"):
        deck.gradient(by="r")
    deck = emsim.Deck(DIVIDER)
    deck.alter_parameter("r", 2e3)
    assert deck.gradient("vout", by="r")["vout", "r"] == pytest.approx(-10.0 * 3e3 / 5e3**2, rel=1e-8)

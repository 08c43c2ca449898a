"""Element lines by ngspice's argument rules."""

from __future__ import annotations

import pytest

from .support import codes, element, flat

MODELS = ".model rm R tc1=1m\n.model cm C\n.model dm D(is=1n)\n.model sm SW vt=1\n.model wm csw(it=1m)\n"


def test_resistor_forms():
    assert element("R1 a b 1k").value == 1e3
    e = element("R1 a b 1k tc=1m,2u m=2")
    assert e.params == {"tc1": 1e-3, "tc2": 2e-6, "m": 2.0}
    e = element(MODELS + "R1 a b rm L=10u W=2u")
    assert e.model.name == "rm" and e.value is None and e.params == {"l": 1e-5, "w": 2e-6}
    assert element(MODELS + "R1 a b 2k rm").model.params == {"tc1": 1e-3}
    assert element(".param x=2\nR1 a b {x*1k}").value == 2e3
    assert element(".param x=2\nR1 a b R='x*1k' tc1=1m").value == 2e3
    assert str(element("R1 a b R={1k*(1+v(c))}").value) == "1000*(1+v(c))"
    assert str(element("R1 a b r = v(c)*2 tc1=1m").value) == "v(c)*2"
    assert str(element("R1 a b {time+1}").value) == "time+1"


def test_capacitor_and_inductor_forms():
    assert element("C1 a b 1u IC=2").params == {"ic": 2.0}
    assert element(MODELS + "C1 a b cm L=1u W=1u").model.type == "c"
    assert str(element("C1 a b C={1u*v(a)}").value) == "1e-06*v(a)"
    e = element("C1 a b Q={1u*v(a)^2}")
    assert e.extra["whole"] and str(e.value) == "1e-06*(v(a)**2)"
    assert str(element("L1 a b L='1m*i(v1)'").value) == "0.001*i(v1)"
    assert element("L1 a b {2*1m}").value == 2e-3


@pytest.mark.parametrize(
    ("card", "dc", "ac"),
    [
        ("V1 a 0 5", 5.0, None), ("V1 a 0 DC 5", 5.0, None), ("V1 a 0 dc=5", 5.0, None), ("V1 a 0", None, None),
        ("V1 a 0 5 AC 1", 5.0, (1.0, 0.0)), ("V1 a 0 AC 1 90 DC {1+1}", 2.0, (1.0, 90.0)),
        ("V1 a 0 AC", None, (1.0, 0.0)), ("I1 a 0 -1m AC=2", -1e-3, (2.0, 0.0)), ("V1 dc ac 3", 3.0, None),
    ],
)  # fmt: skip
def test_source_values(card, dc, ac):
    e = element(card)
    assert (e.extra["dc"], e.extra["ac"], e.wave) == (dc, ac, None)


@pytest.mark.parametrize(
    ("text", "kind", "args"),
    [
        ("SIN(0 1 1k)", "sin", [0, 1, 1e3]), ("sin 0 1 1k", "sin", [0, 1, 1e3]), ("SIN (0, 1, 1k)", "sin", [0, 1, 1e3]),
        ("PULSE(0 5 0 1n 1n {d/f} {1/f})", "pulse", [0, 5, 0, 1e-9, 1e-9, 3e-4, 5e-4]),
        ("PULSE(0,5)", "pulse", [0, 5]), ("EXP(0 1 1u 2u)", "exp", [0, 1, 1e-6, 2e-6]),
        ("PWL(0 0 1m 5, 2m 5)", "pwl", [0, 0, 1e-3, 5, 2e-3, 5]), ("SFFM(0 1 1k)", "sffm", [0, 1, 1e3]),
        ("AM(1 0 1k 2k)", "am", [1, 0, 1e3, 2e3]), ("sin(0 -1 '2*f')", "sin", [0, -1, 4e3]),
    ],
)  # fmt: skip
def test_waveforms(text, kind, args):
    for card in (f"V1 a 0 {text}", f"V1 a 0 DC 1 AC 1 {text}", f"V1 a 0 {text} AC 1 DC 1"):
        wave = element(f".param d=0.6 f=2k\n{card}").wave
        assert wave.kind == kind and wave.args == pytest.approx(args)


def test_pwl_repeats():
    for text in (
        "PWL(0 0 1 1) r=0 td=1m",
        "PWL(0 0 1 1) td=1m r=0",
        "PWL 0 0 1 1 r=0 td=1m",
        "PWL(0 0 1 1) AC 1 td=1m r={0}",
    ):
        wave = element(f"V1 a 0 {text}").wave
        assert wave.args == [0, 0, 1, 1] and wave.params == {"r": 0.0, "td": 1e-3}


def test_behavioural_sources():
    for card in ("B1 a 0 V={v(b)*2}", "B1 a 0 v = v(b)*2", "B1 a 0 V='v(b)*2'", 'B1 a 0 V="v(b)*2"'):
        e = element(card)
        assert e.extra["output"] == "v" and str(e.value) == "v(b)*2"
    e = element("B1 a 0 I=v(b)>1?v(c):0 tc1=1m")
    assert (e.extra["output"], str(e.value), e.params) == ("i", "(v(b)>1)?v(c):0", {"tc1": 1e-3})


def test_brackets_about_the_nodes_of_switches():
    for card in ("S1 (a b c d) sm on", "S1 (a b) (c,d) sm on", "S1 a b (c d) sm on", "S1 a b c d sm on"):
        e = element(MODELS + card)
        assert (e.nodes, e.model.name, e.extra["initial"]) == (["a", "b", "c", "d"], "sm", "on")
    e = element(MODELS + "W1 (a b) V1 wm off")
    assert (e.nodes, e.extra["controls"], e.extra["initial"]) == (["a", "b"], ["v1"], "off")


def test_controlled_sources():
    e = element("E1 a b c d {2*5}")
    assert (e.nodes, e.value, e.extra["form"]) == (["a", "b", "c", "d"], 10.0, "linear")
    assert element("G1 a b (c,d) 1m").nodes == ["a", "b", "c", "d"]
    for card in ("E1 (a b c d) 10", "E1 (a, b, c, d) 10", "E1 (a b) c d 10", "E1 (a,b) (c d) 10"):
        assert (element(card).nodes, element(card).value) == (["a", "b", "c", "d"], 10.0)
    assert element("G1 a b v i 1m").nodes == ["a", "b", "v", "i"]  # nodes may be called like keywords
    assert element("G1 a b c d 1m m=2").params == {"m": 2.0}
    e = element("E1 a b POLY(2) c 0 (d,0) 0 1 2 {3}")
    assert e.extra["controls"] == [("c", "0"), ("d", "0")] and e.extra["coeffs"] == [0, 1, 2, 3]
    for card in (
        "E1 a b VALUE={v(c)^2}",
        "E1 a b value {v(c)^2}",
        "E1 a b V={v(c)^2}",
        "E1 a b vol='v(c)^2'",
    ):
        e = element(card)
        assert e.extra["form"] == "expr" and str(e.value) == "v(c)**2"
    assert str(element("G1 a b cur='v(c)'").value) == "v(c)"
    for card in (
        "E1 a b TABLE {v(c)} = (0,0) (1,{1+1})",
        "E1 a b TABLE {v(c)} (0 0) (1 2)",
        "E1 a b table={v(c)} 0,0 1,2",
    ):
        e = element(card)
        assert e.extra["table"] == [(0, 0), (1, 2)] and str(e.value) == "v(c)"
    e = element("F1 a b V1 3")
    assert (e.nodes, e.extra["controls"], e.value) == (["a", "b"], ["v1"], 3.0)
    e = element("H1 a b POLY(2) v1 v2 0 1 2")
    assert e.extra["controls"] == ["v1", "v2"] and e.extra["coeffs"] == [0, 1, 2]


def test_diodes_switches_coupling():
    e = element(MODELS + "D1 a k dm 2 off ic=0.5")
    assert e.model.type == "d" and e.params == {"area": 2.0, "off": 1.0, "ic": 0.5}
    e = element(MODELS + "S1 a b c d sm ON")
    assert (e.nodes, e.extra["initial"], e.model.params) == (["a", "b", "c", "d"], "on", {"vt": 1.0})
    e = element(MODELS + "W1 a b V1 wm off")
    assert (e.nodes, e.extra["controls"], e.extra["initial"]) == (["a", "b"], ["v1"], "off")
    e = element("K1 L1 L2 L3 0.99")
    assert e.extra["inductors"] == ["l1", "l2", "l3"] and e.value == 0.99


def test_a_model_takes_values_without_an_equals_sign():
    model = element(".model dm d is 1e-10 n 2 rs=1 level 1\nD1 a 0 dm").model
    assert model.params == {"is": 1e-10, "n": 2.0, "rs": 1.0, "level": 1.0}
    assert element(".model sm sw (vt {1+1} ron 5)\nS1 a 0 c 0 sm").model.params == {"vt": 2.0, "ron": 5.0}


def test_model_forms():
    text = ".model {} D{}\nD1 a 0 dx"
    for body in ("(is=1n rs={2*5})", " is=1n rs=10", "( is = 1n, rs = 10 )", " (is=1n\n+ rs=10)"):
        assert element(text.format("dx", body)).model.params == pytest.approx({"is": 1e-9, "rs": 10})
    assert element(".model d1 d(is=1n rs=1)\n.model dx ako:d1 d(rs=2)\nD1 a 0 dx").model.params == {
        "is": 1e-9,
        "rs": 2,
    }


def test_letters_that_come_later_are_kept():
    m = element(".model n NMOS(vto=1)\nM1 d g s b n L=1u W={2*5u}")
    assert (m.letter, m.nodes, m.model.type) == ("m", ["d", "g", "s", "b"], "nmos")
    assert m.params == pytest.approx({"l": 1e-6, "w": 1e-5})
    q = element(".model 2N2222 NPN\nQ1 c b e 2N2222 3")
    assert (q.nodes, q.model_name, q.extra["words"]) == (["c", "b", "e"], "2n2222", ["3"])
    assert element("T1 a 0 b 0 Z0=50 TD=1n").params == {"z0": 50.0, "td": 1e-9}
    assert element(".model gate d_and\nA1 [a b] c gate").letter == "a"


def test_dot_cards():
    deck = flat(
        "R1 a 0 1\n.tran 1u {2*5u} 0 1n UIC\n.op static\n.ic v(a)=1 V(b)={2+1}, v(c) = -1\n.nodeset v(a)=2\n"
        ".options reltol=1e-4 method=gear temp=50 acct\n.save v(a) i(v1) all\n.probe v(b)\n.temp 85\n.global vdd\n"
        ".print tran v(a) v(a,b) {v(a)*2} angle(hinge) i(v1)\n.gravity\n.view fps=30\n.meas tran x MAX v(a)\n.ac dec 10 1 1k"
    )
    tran, op, ac = deck.analyses
    assert tran.args == pytest.approx([1e-6, 1e-5, 0, 1e-9]) and tran.flags == {"uic"}
    assert op.flags == {"static"} and (ac.kind, ac.args[0]) == ("ac", "dec")
    assert [(m.analysis, m.name, m.clauses[0].word) for m in deck.measures] == [("tran", "x", "max")]
    assert [(n, x) for n, x, _ in deck.ics] == [("a", 1), ("b", 3), ("c", -1)]
    assert [(n, x) for n, x, _ in deck.nodesets] == [("a", 2)]
    assert deck.options == {"reltol": 1e-4, "method": "gear", "temp": 50.0, "acct": True}
    assert [p.text for p in deck.saves] == ["v(a)", "i(v1)", "all"] and [p.text for p in deck.probes] == [
        "v(b)"
    ]
    assert deck.temp == 85 and deck.gravity == pytest.approx((0, -9.80665, 0))
    (wanted,) = deck.prints
    assert [text for text, _ in wanted.items] == ["v(a)", "v(a,b)", "{v(a)*2}", "angle(hinge)", "i(v1)"]
    assert [str(ast) for _, ast in wanted.items] == ["v(a)", "v(a,b)", "v(a)*2", "angle(hinge)", "i(v1)"]


def test_gravity_forms():
    assert flat("R1 a 0 1\n.gravity 9.81").gravity == (0, -9.81, 0)
    assert flat("R1 a 0 1\n.gravity 1 2").gravity == (1, 2, 0)
    assert flat("R1 a 0 1\n.gravity 0 0 {-g}\n.param g=3").gravity == (0, 0, -3)
    assert flat("R1 a 0 1").gravity is None


def test_two_elements_of_one_name():
    assert codes("R1 a 0 1\nr1 b 0 2") == ["E135"]


KEYWORDS = [
    "r",
    "c",
    "l",
    "q",
    "v",
    "i",
    "dc",
    "ac",
    "sin",
    "exp",
    "am",
    "pulse",
    "pwl",
    "sffm",
    "value",
    "vol",
    "cur",
    "poly",
    "table",
    "off",
    "on",
    "uic",
    "tran",
]


@pytest.mark.parametrize("word", KEYWORDS)
@pytest.mark.parametrize("value", ["1", "{1}"])
def test_keywords_of_one_card_are_plain_words_on_others(word, value):
    """LALR shares states, and the contextual lexer with them: a keyword must not leak into another card."""
    for card in (
        f"D1 a k dm x={value} {word}=2",
        f"M1 d g s b nm x={value} {word}=2",
        f"S1 a b c d sm x={value} {word}=2",
        f"E1 a b c d 1 x={value} {word}=2",
        f"F1 a b v1 1 x={value} {word}=2",
        f"T1 a b c d x={value} {word}=2",
        *([] if word in "rclq" else [f"{letter}1 a b 1 x={value} {word}=2" for letter in "RCL"]),
        *(
            []
            if word in ("r", "dc", "ac", "sin", "exp", "am", "pulse", "pwl", "sffm")
            else [f"V1 a b 1 x={value} {word}=2"]
        ),
    ):
        e = element(f".model dm D\n.model sm SW\n.model nm NMOS\n{card}")
        assert e.params[word] == 2.0 and e.params["x"] == 1.0
    assert element(f"R1 {word} {word} 1").nodes == [word, word]
    assert element(f".model {word} D x={value} {word}=2\nD1 a 0 {word}").model.params[word] == 2.0
    assert (
        element(
            f".subckt {word} {word} p={value} {word}=2\nR1 {word} 0 {{p}}\n.ends\nX1 n {word} p={value}"
        ).value
        == 1
    )
    deck = flat(f".param p={value} {word}=2\n.options p={value} {word}=2\nR1 a 0 {{p*{word}}}")
    assert deck.elements[0].value == 2.0 and deck.options[word] == 2.0


def test_two_temperature_coefficients_in_either_spelling():
    from emsim.build import read

    for text in ("tc=2m,1u", "tc=2m 1u", "tc = 2m 1u m=2"):
        deck = read(f"t\nR1 a 0 1k {text}\n.end\n")
        (r,) = deck.body
        assert not deck.sink.diagnostics and r.value == 1000.0
        assert (r.params["tc1"], r.params["tc2"]) == (2e-3, 1e-6)


def test_names_of_parameters_stand_for_their_values():
    cards = ".param rv=2k vv=3 g=5\n"
    assert element(cards + "R1 a 0 rv").value == 2e3
    assert (
        element(cards + "R1 a 0 rv\n.model rv r(r=7)").value == 2e3
    )  # the parameter goes first, as in ngspice
    assert element(cards + "R1 a 0 1k tc1=g").params["tc1"] == 5.0
    assert element(cards + "E1 a 0 b 0 g").value == 5.0
    assert element(cards + "V1 a 0 vv AC g").extra == {"dc": 3.0, "ac": (5.0, 0.0)}
    assert element(cards + "V1 a 0 PULSE(0 vv 0 1u 1u g 2)").wave.args == [0, 3, 0, 1e-6, 1e-6, 5, 2]
    assert (
        codes(cards + "V1 a 0 ww")
        == codes(cards + "V1 a 0 time")
        == codes(cards + "R1 a 0 1 tc1=x")
        == ["E110"]
    )
    assert codes(cards + "R1 a 0 rw") == ["E140"]


def test_brackets_and_commas_about_nodes_are_blanks():
    for card in ("R1 (a b) 1k", "R1 a,b,1k", "R1 (a,b), 1k", "R1 a b 1k, tc=0"):
        e = element(card)
        assert (e.nodes, e.value) == (["a", "b"], 1e3)
    assert element("V1 (s 0) 1").nodes == ["s", "0"]
    e = element("E1 (a 0) (s,0) 3")
    assert (e.nodes, e.value) == (["a", "0", "s", "0"], 3.0)
    # keywords of one element are words to the others
    assert element("R1 a b ac=2 1k").value == 1e3 and element("V1 r c 1").nodes == ["r", "c"]


def test_other_spellings_of_values():
    assert element("V1 a 0 SINE(0 1 1k)").wave.kind == "sin"
    assert element("V1 a 0 DC").extra["dc"] == element("V1 a 0 DC SIN(1 2 3)").extra["dc"] == 0.0
    assert element("E1 a 0 s 0 gain=3").value == element("F1 a 0 vm gain=3").value == 3.0
    k = element("K1 L1 L2 k=0.5")
    assert (k.extra["inductors"], k.value, k.params) == (["l1", "l2"], 0.5, {})
    for card in ("PWL(0 0 1 1) r 0 td 1m", "PWL(0 0 1 1 r=0 td=1m)", "PWL 0 0 1 1 r 0 td 1m"):
        assert element("V1 a 0 " + card).wave.params == {"r": 0.0, "td": 1e-3}


def test_temper_is_a_constant():
    cards = ".param r={1k*(1+4m*(temper-27))}\n.temp 127\n"
    assert element(cards + "R1 a 0 {r}").value == element(cards + "R1 a 0 r").value == pytest.approx(1.4e3)

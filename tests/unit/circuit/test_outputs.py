"""Which columns a run has, their names and units."""

from __future__ import annotations

import numpy as np
import pytest
from circuit_decks import codes, deck, remarks

import emsim

RLC = ("V1 in 0 5", "R1 in out 10", "L1 out m 1m", "C1 m 0 1u", "R2 m 0 10")


def names(*lines: str) -> list[str]:
    return emsim.run(deck(*RLC, *lines)).names


def test_everything_when_nothing_is_asked_for() -> None:
    assert names(".tran 1u 10u") == ["time", "v(in)", "v(out)", "v(m)", "i(v1)", "i(l1)"]


def test_save_narrows_and_print_is_always_there() -> None:
    assert names(".save v(out) i(L1)", ".tran 1u 10u") == ["time", "v(out)", "i(l1)"]
    assert names(".save v(out)", ".print tran v(in,out) i(R1)", ".tran 1u 10u") == [
        "time", "v(out)", "v(in,out)", "i(r1)",
    ]  # fmt: skip
    assert names(".save all", ".tran 1u 10u") == names(".tran 1u 10u")


def test_time_that_is_asked_for_is_the_first_column() -> None:
    """A second one had no place in xarray and NetCDF."""
    r = emsim.run(deck(*RLC, ".save time v(out)", ".print tran v(out) time", ".tran 1u 10u", ".op"))
    assert r.table("tran").names == ["time", "v(out)"] and r.table("op").names == ["time", "v(out)"]
    assert r.prints == [("tran", ["v(out)", "time"])]
    assert float(r.to_xarray()["v(out)"].sel(time=r.time[-1])) == r["v(out)"][-1]


def test_bare_names_are_nodes() -> None:
    assert names(".save out v1#branch", ".tran 1u 10u") == ["time", "v(out)", "i(v1)"]


def test_par_is_a_bracket_about_an_expression_as_in_ngspice() -> None:
    """It was refused, with `pwr` as what might be meant."""
    asked = ".print tran par('v(out)*2') v(out)"
    r = emsim.run(deck(*RLC, asked, ".save par( 'v(in) - v(out)' )", ".tran 1u 10u"))
    assert r.prints == [("tran", ["v(out)*2", "v(out)"])]
    assert (r["v(out)*2"] == 2 * r["v(out)"]).all() and "v(in)-v(out)" in r


def test_print_of_another_analysis_is_left_alone() -> None:
    r = emsim.run(deck(*RLC, ".print op v(m)", ".print tran v(out)", ".op", ".tran 1u 10u"))
    assert r.prints == [("op", ["v(m)"]), ("tran", ["v(out)"])]


def test_currents_of_all_elements() -> None:
    lines = (
        "V1 a 0 6", "R1 a b 1k", "R2 b 0 1k", "D1 b c dm", "R3 c 0 1k", "I1 0 d 2m", "R4 d 0 1k",
        "G1 0 e a 0 1m", "R5 e 0 1k", "S1 a f a 0 sm", "R6 f 0 1k", ".model dm d", ".model sm sw vt=1",
        ".print op i(R1) i(D1) i(R3) i(I1) i(G1) i(S1) i(C1) i(R6)", "C1 a 0 1u", ".op",
    )  # fmt: skip
    r = emsim.run(deck(*lines)).table("op")
    assert r["i(d1)"][0] == pytest.approx(r["i(r3)"][0], rel=1e-6)
    assert r["i(i1)"][0] == 2e-3
    assert r["i(g1)"][0] == pytest.approx(6e-3)
    assert r["i(s1)"][0] == pytest.approx(r["i(r6)"][0])
    assert r["i(c1)"][0] == pytest.approx(0.0, abs=1e-15)


def test_units_of_expressions() -> None:
    r = emsim.run(deck(*RLC, ".print tran v(in) 2*i(R1) v(in)*i(r1) v(in)/i(r1) v(in)-v(m)", ".tran 1u 10u"))
    assert r.unit("2*i(r1)") == "A"
    assert r.unit("v(in)*i(r1)") == "W"
    assert r.unit("v(in)/i(r1)") == "Ohm"
    assert r.unit("v(in)-v(m)") == "V"


def test_device_parameters_are_noted() -> None:
    assert [d.code for d in remarks(*RLC, ".save all @r1[temp]", ".op")] == ["N284"]


def test_unknown_names() -> None:
    assert codes(*RLC, "B1 x 0 V={v(ouut)}", ".tran 1u 10u") == ["E289"]
    assert codes(*RLC, ".save i(r11)", ".tran 1u 10u") == ["E290"]


@pytest.mark.parametrize(
    "card",
    [
        ".print tran v(ouut) v(in)",
        ".save v(ouut) v(in)",
        ".print tran ouut v(in)",
        ".print tran v1:dcv0 v(in)",
    ],
)
def test_a_signal_of_a_node_that_is_not_there_is_left_out_with_a_word(card) -> None:
    """As in ngspice: a print of one node too many is no reason to compute nothing."""
    found = emsim.run(deck(*RLC, card, ".tran 1u 10u"))
    assert (
        [d.code for d in found.diagnostics] == ["W287"]
        and "v(in)" in found.names
        and "v(ouut)" not in found.names
    )


def test_parts_of_phasors_of_real_numbers() -> None:
    found = emsim.run(
        "t\nV1 a 0 -2\nR1 a 0 1\n.print op mag(v(a)) vm(a) vdb(a) ph(v(a)) vi(a) vr(a) im(v1)\n.op\n.end\n"
    )
    values = [float(found[name][0]) for name in found.prints[0][1]]
    assert values == pytest.approx([2, 2, 20 * np.log10(2), 0, 0, -2, 2])


def test_device_currents_by_ngspices_name():
    result = emsim.run(
        "t\nV1 a 0 1\nR1 a b 1k\nD1 b 0 dm\nB1 c 0 V={1k*@r1[i]}\n.model dm D\n.op\n.print op @R1[i] @d1[id]\n.end\n"
    )
    assert result.prints == [("op", ["@r1[i]", "@d1[id]"])] and result.unit("@r1[i]") == "A"
    assert result["@r1[i]"][0] == pytest.approx((1 - result["v(b)"][0]) / 1e3)
    assert result["@d1[id]"][0] == pytest.approx(result["@r1[i]"][0], rel=1e-6)
    assert result["v(c)"][0] == pytest.approx(1e3 * result["@r1[i]"][0])
    with pytest.raises(emsim.DeckError, match="no element is called `r7`"):
        emsim.run("t\nV1 a 0 1\nR1 a 0 1\n.op\n.print op @r7[i]\n.end\n")


def test_columns_asked_for_from_outside_the_deck() -> None:
    text = deck(*RLC, ".save v(out)", ".param k=3", ".tran 1u 10u")
    r = emsim.run(text, also=["v(in, m), k*i(R1)", "m"])
    assert r.names == ["time", "v(out)", "v(in,m)", "k*i(r1)", "v(m)"] and r.prints == []
    assert r.unit("k*i(r1)") == "A" and r["k*i(r1)"][-1] != 0
    assert r.deck == text


@pytest.mark.parametrize(
    ("text", "code", "column"), [("v(out) v(oot)", "E289", 10), ("v(out", "E103", 2), ("v(out) +", "E103", 9)]
)
def test_a_wrong_column_is_shown_in_the_text_that_asks_for_it(text: str, code: str, column: int) -> None:
    with pytest.raises(emsim.DeckError) as caught:
        emsim.run(deck(*RLC, ".tran 1u 10u"), also=[text])
    (found,) = (d for d in caught.value.diagnostics if d.severity == "error")
    assert found.code == code and found.span is not None
    assert (found.span.file.name, found.span.line, found.span.col) == ("signals", 1, column)


ONE_OF_EACH = (
    "V1 a 0 1", "R1 a b 1k", "L1 b c 1m", "D1 c 0 d", "C1 c 0 1n", "I1 0 c 1m", "E1 e 0 a 0 2", "Re e 0 1k",
    "L2 e f 1m", "R3 f 0 1", "K1 L1 L2 0.1", ".model d d", ".tran 10u 20u",
)  # fmt: skip


def columns(*lines: str) -> list[str]:
    return emsim.run(deck(*lines)).names


def test_probe_adds_and_save_narrows() -> None:
    usual = columns(*ONE_OF_EACH)
    assert columns(*ONE_OF_EACH, ".probe v(b)") == usual
    assert columns(*ONE_OF_EACH, ".save v(b)", ".probe v(c)") == ["time", "v(b)", "v(c)"]
    elements = ["v1", "r1", "l1", "d1", "c1", "i1", "e1", "re", "l2", "r3"]
    for word in ("alli", "all"):
        assert set(columns(*ONE_OF_EACH, f".probe {word}")) == {*usual, *(f"i({name})" for name in elements)}


def test_probe_of_all_has_every_terminal_of_transistors_and_subcircuits() -> None:
    """`.probe` alone added nothing, and the word before it only the first terminal."""
    parts = (
        "V1 a 0 5", "R1 a b 1k", "Q1 b a e qm", "Re e 0 1k", "X1 a e b three", "X2 b e two", "Re2 e 0 1k", ".model qm npn",
        ".subckt three p q s", "Rp p q 2k", "Rs q s 3k", ".ends", ".subckt two p q", "Rp p q 4k", ".ends", ".op",
    )  # fmt: skip
    r = emsim.run(deck(*parts, ".probe"))
    assert r.names == columns(*parts, ".probe alli")
    told = {"i(v1)", "i(r1)", "i(re)", "i(re2)", "i(x1.rp)", "i(x1.rs)", "i(x2.rp)", "i(x2)"}
    ends = {*(f"i(q1:{t})" for t in "cbe"), *(f"i(x1:{t})" for t in "pqs")}
    assert {name for name in r.names if name.startswith("i(")} == told | ends
    va, vb, ve = (float(r[f"v({n})"][0]) for n in "abe")
    assert r["i(x1:p)"] == pytest.approx((va - ve) / 2e3) and r["i(x2)"] == pytest.approx((vb - ve) / 4e3)
    assert r["i(x1:p)"] + r["i(x1:q)"] + r["i(x1:s)"] == pytest.approx(0.0, abs=1e-15)
    assert r["i(q1:c)"] + r["i(q1:b)"] == pytest.approx(-r["i(q1:e)"]) and (r["i(q1:b)"] > 1e-9).all()


def test_savecurrents_records_what_ngspice_records() -> None:
    more = ["@r1[i]", "@l1[i]", "@d1[id]", "@c1[i]", "@i1[current]", "@re[i]", "@l2[i]", "@r3[i]"]
    assert columns(*ONE_OF_EACH, ".options savecurrents", ".save v(a)") == ["time", "v(a)", *more]
    r = emsim.run(deck(*ONE_OF_EACH, ".options savecurrents"))
    np.testing.assert_allclose(r["@d1[id]"] + r["@c1[i]"] - r["@r1[i]"], 1e-3, rtol=1e-6)


def test_words_of_save_as_ngspice_reads_them() -> None:
    """`.save allv` and `.save alli` left nothing but the time."""
    usual = columns(*ONE_OF_EACH)
    assert columns(*ONE_OF_EACH, ".save allv") == usual
    elements = ["v1", "r1", "l1", "d1", "c1", "i1", "e1", "re", "l2", "r3"]
    assert set(columns(*ONE_OF_EACH, ".save alli")) == {"time", *(f"i({name})" for name in elements)}


def test_power_of_an_element_by_probe_as_in_ngspice() -> None:
    """It was refused: p() would read a machine."""
    sub = (".subckt load a b", "Rx a b 1k", ".ends", "X1 c 0 load")
    r = emsim.run(deck(*ONE_OF_EACH, *sub, ".probe p(r1) p(d1) p(x1.rx) p(V1)"))
    assert r["r1:power"] == pytest.approx(1e3 * ((r["v(a)"] - r["v(b)"]) / 1e3) ** 2, abs=1e-12)
    assert r["x1.rx:power"] == pytest.approx(r["v(c)"] ** 2 / 1e3) and (r["d1:power"] >= 0).all()
    assert r["v1:power"] == pytest.approx(r["v(a)"] * r["i(v1)"]) and r.units["r1:power"] == "W"

"""What decks of others write and ngspice, LTspice or PSpice take: it runs, with a warning where it is hardly meant."""

from __future__ import annotations

import math

import pytest

import emsim


def ran(text: str, **options: object) -> tuple[emsim.Result, list[str]]:
    result = emsim.run(text, options=options)
    return result, [d.code for d in result.diagnostics]


@pytest.mark.parametrize("mj", [0.5, 0.999999, 1.0, 1.067])
def test_grading_coefficients_of_fits_give_the_capacitance_of_their_formula(mj):
    """C = cj ad (1 - v/pb)^-mj; with v = -pb that is 2^-mj of 1 pF."""
    text = f"""t
vd a 0 dc -0.8 ac 1
m1 0 0 0 a mm w=10u l=2u ad=1e-9
.model mm nmos(level=1 mj={mj} cj=1e-3 pb=.8)
.ac lin 1 1k 1k
.end
"""
    result, codes = ran(text)
    assert -result["i(vd)"][0].imag / (2e3 * math.pi) == pytest.approx(1e-12 * 2**-mj, rel=1e-4)
    assert codes.count("W288") == (mj >= 1.0)


def test_the_capacitance_at_a_grading_of_one_goes_on_along_its_line():
    """Above fc pb: C = cj/(1 - fc)^(1 + mj) (1 - fc (1 + mj) + mj v/pb)."""
    text = """t
vd a 0 dc 0.6 ac 1
m1 0 0 0 a mm w=10u l=2u ad=1e-9
.model mm nmos(level=1 mj=1 cj=1e-3 pb=.8 is=1e-30)
.ac lin 1 1k 1k
.end
"""
    want = 1e-12 / 0.25 * (1 - 0.5 * 2 + 0.6 / 0.8)
    assert -ran(text)[0]["i(vd)"][0].imag / (2e3 * math.pi) == pytest.approx(want, rel=1e-4)


@pytest.mark.parametrize("type_", ["nchan", "pchan"])
def test_the_breakdown_of_a_power_transistor_has_no_sign(type_):
    """Cards of p-channel transistors state bv=-30; ngspice 39 breaks down at 30 V of either."""
    sign = -1 if type_ == "pchan" else 1
    text = """t
vd s d {v}
r1 s a 1
m1 a g d vm
vg g 0 0
vs d 0 0
.model vm vdmos({type_} bv={bv} is=1e-12)
.op
.end
"""
    first, second = (ran(text.format(v=31 * sign, type_=type_, bv=bv)) for bv in (30, -30))
    assert abs(first[0]["i(vd)"][0]) > 1e-3
    assert second[0]["i(vd)"][0] == pytest.approx(first[0]["i(vd)"][0], rel=1e-9)
    assert "W288" in second[1] and "W288" not in first[1]


def test_a_sweep_with_a_step_of_the_wrong_sign_arrives():
    result, codes = ran("t\nV1 a 0 1\nR1 a 0 1k\n.dc V1 0 5 -1\n.end\n")
    assert list(result["v(a)"]) == [0, 1, 2, 3, 4, 5] and codes == ["W308"]


def test_a_capacitor_by_model_alone_is_none():
    result, codes = ran("t\nV1 a 0 SIN(0 1 1k)\nR1 a b 1k\nC1 b 0 x\n.model x C\n.tran 10u 1m\n.end\n")
    assert max(abs(result["v(a)"] - result["v(b)"])) < 1e-12 and codes == ["W293"]


def test_tables_are_as_long_as_they_are_written():
    points = ",".join(f"{k / 1000},{k / 500}" for k in range(6000))
    text = f"t\nV1 a 0 1.2345\nB1 o 0 V=pwl(v(a),{points})\nR1 o 0 1\n.op\n.end\n"
    assert ran(text)[0]["v(o)"][0] == pytest.approx(2.469)


def test_parameters_of_a_subcircuit_in_the_vector_of_a_code_model():
    text = """t
v1 in 0 1
x1 in out amp k=3
.subckt amp a b k=1
a1 [a a] b s1
.model s1 summer(in_gain=[{k} 1])
.ends
.op
.end
"""
    assert ran(text)[0]["v(out)"][0] == pytest.approx(4.0)


def test_nodes_of_pspice_schematics_are_no_comments():
    text = """t
.ac dec 5 10 1k
R_R1         $N_0001 $N_0002  1k $ a comment
C_C1         $N_0002 0  1u
V_V1         $N_0001 0 DC 0 AC 1
.end
"""
    result, _ = ran(text)
    got, want = result["v($N_0002)"][0], 1 / (1 + 2j * math.pi * 10 * 1e-3)
    assert got == pytest.approx(want, rel=1e-9)


def test_paths_of_ltspice_have_blanks_and_its_libraries_may_be_missing():
    text = """t
V1 a 0 SINE(0 1 1k)
R1 a 0 1k
.lib C:\\Program Files (x86)\\LTC\\LTspiceIV\\lib\\cmp\\standard.bjt
.lib C:\\Program Files\\LTC\\LTspiceIV\\lib\\cmp\\standard.dio
.tran 5m
.backanno
.end
"""
    _, codes = ran(text, dialect="ltspice")
    assert codes == ["W154", "W154"]


def test_ratings_of_picked_parts_say_nothing():
    text = """t
V1 a 0 SINE(0 1 1k)
R1 a b 1k tol=1 pwr=0.1
C1 b 0 1u V=50 Irms=0 Rser=1m Lser=0
L1 b 0 1m Ipk=5
.tran 5m
.end
"""
    _, codes = ran(text, dialect="ltspice")
    assert codes == []


def test_an_output_of_dac_bridge_at_ground_drives_nothing():
    """ngspice 39 runs it: the other bits are as without it."""
    text = """bits of which one ends at ground
va a 0 pulse(0 5 0.5u 1n 1n 1u 2u)
a1 [a] [d] to_bit
a2 [d d] [out 0] to_volt
.model to_bit adc_bridge(in_low=1 in_high=2)
.model to_volt dac_bridge(out_low=0.5 out_high=3)
r1 out 0 1k
.tran 10n 2u
.end
"""
    found = ran(text)[0].tran
    assert [found.at("v(out)", t) for t in (0.4e-6, 1e-6, 1.9e-6)] == pytest.approx([0.5, 3.0, 0.5])


@pytest.mark.parametrize("word", [".include", ".inc", ".INCLUDE"])
def test_an_include_in_the_first_line_is_read(word, tmp_path):
    """As in ngspice 39, which reads nothing else there; the line is the title all the same."""
    (tmp_path / "load.inc").write_text("r2 a 0 1k\n")
    (tmp_path / "deck.cir").write_text(f"{word} load.inc\ni1 0 a 1m\nr1 a 0 1k\n.op\n.end\n")
    result = emsim.run(tmp_path / "deck.cir")
    assert result["v(a)"][0] == pytest.approx(0.5)
    assert [d.code for d in result.diagnostics] == ["W108"]
    assert result.title == f"{word} load.inc"


def test_a_model_in_the_first_line_is_not_read():
    with pytest.raises(emsim.DeckError, match=r"no \.model is called `d1`"):
        emsim.run(".model d1 d is=1e-14\ni1 0 a 1m\nd1 a 0 d1\n.op\n.end\n")


def test_what_the_outer_source_of_dc_was_is_not_among_all_vectors(tmp_path, monkeypatch):
    """ngspice 39 has no vector for it: columns of `print alli > file` are those that its user counted."""
    monkeypatch.chdir(tmp_path)
    text = "t\nv1 a 0 0\nv2 b 0 0\nr1 a b 1k\n"
    text += ".control\ndc v1 0 1 0.5 v2 0 2 1\nprint alli > i.txt\nprint allv > v.txt\n.endc\n.end\n"
    emsim.run(text)
    heads = {
        line
        for name in "iv"
        for line in (tmp_path / f"{name}.txt").read_text().splitlines()
        if "Index" in line
    }
    assert {tuple(line.split()[1:]) for line in heads} == {
        ("v-sweep", "v1#branch", "v2#branch"),
        ("v-sweep", "a", "b", "v-sweep"),
    }


def test_currents_of_terminals_as_ltspice_and_pspice_write_them():
    """ie(q1) is @q1[ie], id(m1) is @m1[id]: Kirchhoff's law of a transistor."""
    text = """t
v1 c 0 5
v2 b 0 0.7
re e 0 1k
q1 c b e qm
.model qm npn
m1 c b s 0 mm
.model mm nmos vto=0.1
rs s 0 1k
.op
.print op ic(q1) ib(q1) ie(q1) id(m1) is(m1) v(e) v(s)
.end
"""
    found = ran(text)[0].op
    ic, ib, ie, drain, source = (
        found[name][0] for name in ("ic(q1)", "ib(q1)", "ie(q1)", "id(m1)", "is(m1)")
    )
    assert ie == pytest.approx(-found["v(e)"][0] / 1e3, rel=1e-6)
    assert ic + ib + ie == pytest.approx(0.0, abs=1e-11)  # gmin
    assert source == pytest.approx(-found["v(s)"][0] / 1e3, rel=1e-4)
    assert drain == pytest.approx(-source, rel=1e-4)


def test_a_file_of_print_may_have_brackets_in_its_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    emsim.run(
        "t\nv1 a 0 5\nr1 a 0 1k\n.control\nop\nprint i(v1) > current(1).txt\nprint (v(a) > 0.5)\n.endc\n.end\n"
    )
    assert (tmp_path / "current(1).txt").read_text().split() == ["i(v1)", "=", "-5.00000e-03"]
    assert [file.name for file in tmp_path.iterdir()] == ["current(1).txt"]


# a clocked stage as layouts are extracted: its input and its well hang on capacitors and junctions alone
EXTRACTED = """t
vdd v 0 1.8
v1 clk 0 pulse 0 1.8 0.03u 10p 10p 60n 100n
v2 b 0 pulse 0 1.8 0.3u 10p 10p 0.1u 0.3u
m1 y x v w p w=7.2u l=0.18u ad=3.2p pd=15u
m2 z clk y 0 n w=3.6u l=0.18u ad=3.2p pd=9u as=1.6p ps=8u
m3 0 x z 0 n w=3.6u l=0.18u
m4 s y 0 0 n w=1.8u l=0.18u ad=0.8p pd=4.5u
c1 clk y 0.13f
c2 x u 0.13f
c3 t v 0.44f
c4 clk u 0.7f
c5 v b 0.19f
c6 y w 0.1f
c7 x 0 1f
c8 clk 0 0.09f
.model n nmos level=8 tox=4.1n k1=0.58 k3=0.043 rsh=6.7
.model p pmos level=8 tox=4.1n u0=115.7 ua=1.5n a0=1.76 rsh=7.8 ua1=4.3n cgdo=0.63n cf=0
.tran 10n 40n
.end
"""


def test_steps_that_creep_are_handed_to_another_method():
    """At 30 ns steps of 1e-22 s were taken for ever (E414): their currents are roundings of charges."""
    found = ran(EXTRACTED)[0].tran
    other = ran(EXTRACTED, method="trbdf2")[0].tran
    for node in "yxswzu":
        for t in (25e-9, 32e-9, 40e-9):
            assert found.at(f"v({node})", t) == pytest.approx(other.at(f"v({node})", t), abs=5e-3)


def test_a_start_for_a_node_that_is_not_there_is_told_and_passed_over():
    """ngspice: IC on non-existent node, ignored."""
    text = (
        "t\nv1 a 0 1\nr1 a b 1k\nc1 b 0 1u\n.ic v(nix)=1 v(b)=0.5\n.nodeset v(bb)=2\n.tran 10u 1m uic\n.end\n"
    )
    result, codes = ran(text)
    assert codes == ["W294", "W294"] and result.diagnostics[1].hint == "did you mean `b`?"
    assert result.at("v(b)", 1e-3) == pytest.approx(1 - 0.5 * math.exp(-1), rel=1e-4)


def test_marks_of_what_is_not_listed_are_passed_over():
    result, codes = ran("t\nv1 a 0 1\n.prot\nr1 a 0 1k\n.unprot\n.op\n.end\n")
    assert codes == [] and result["i(v1)"][0] == pytest.approx(-1e-3)


def test_options_among_commands_are_those_of_the_deck():
    """As in ngspice: they hold for what stands above them too."""
    text = """t
v1 a 0 1
r1 a 0 1k tc1=1e-2
.control
op
print i(v1)
.options temp=127
.endc
.end
"""
    result, codes = ran(text)
    assert codes == [] and "i(v1) = -5.00000e-04" in result.output
    with pytest.raises(emsim.DeckError) as refused:
        emsim.run(text.replace("temp=127", "temp=(1"))
    assert refused.value.diagnostics[0].code == "E103"


@pytest.mark.parametrize("source", ["v(a)", "i(v1)"])
def test_a_resistance_without_end_is_1e20_as_ngspice_writes_it(source):
    """Nothing flows into a gate."""
    text = f"""t
v1 a 0 1
m1 d a 0 0 n
r1 d vd 1k
vd vd 0 5
.model n nmos(vto=0.5 kp=1e-4)
.tf {source.replace("v(a)", "v(d)")} v1
.end
"""
    result, codes = ran(text)
    assert codes == [] and result["v1#input_impedance"][0] == 1e20


def test_cycles_of_a_sine_that_end_behind_the_run_change_nothing():
    """LTspice's seventh number; ngspice passes it over."""
    assert ran("t\nv1 a 0 SIN(0 1 50 0 0 0 50)\nr1 a 0 1\n.tran 1m 20m\n.end\n")[1] == []


@pytest.mark.parametrize("command", ["wrdata w v(a)", "write w v(a)"])
def test_numbers_go_into_a_file_without_an_ending(scratch, command):
    text = f"t\nv1 a 0 1\nr1 a 0 1k\n.control\nop\n{command}\n.endc\n.end\n"
    assert ran(text)[1] == [] and (scratch / "w").stat().st_size > 10
    (scratch / "w").write_text("all: w\n\tcc w.c\n")
    for wrong in (text, text.replace(command, "echo x > x"), text.replace(" w v", " .w v")):
        assert [d.code for d in emsim.run(wrong).diagnostics] == ["E163"]

"""What A lines say: connections, types, lists, messages; small signals and operating points; commands of .control."""

from __future__ import annotations

import cmath
import math

import pytest

import emsim


def deck(*lines: str, end: str = ".op") -> str:
    return "\n".join(["t", *lines, end, ".end", ""])


def op(*lines: str) -> emsim.Table:
    return emsim.run(deck(*lines)).table("op")


def test_connections_are_of_the_types_that_the_line_says():
    table = op(
        "V1 a 0 3", "V2 b 0 1", "R1 a 0 1k", "A1 %vd(a b) %v x m", "A2 %vnam v1 %vd (x y) n", "A3 a %i out m", "R2 out 0 10",
        "A4 %id(p q) z m", "V3 p 0 2", "R3 q 0 1k", "R4 y 0 1k", "R5 x 0 1k", ".model m gain(gain=2)", ".model n gain(gain=1k)",
    )  # fmt: skip
    assert float(table["v(x)"][0]) == pytest.approx(4.0)
    # the current into v1 at its first node: through R1, and into nothing else
    assert float(table["v(x)"][0] - table["v(y)"][0]) == pytest.approx(1e3 * float(table["i(v1)"][0]))
    assert float(table["v(out)"][0]) == pytest.approx(-60.0)
    assert float(table["v(z)"][0]) == pytest.approx(2 * 2e-3)


def test_a_subcircuit_has_its_own_models_nodes_and_sources():
    table = op(
        ".subckt amp in out", "Vm mid out 0", "A1 in mid g", "A2 %vnam vm probe h", ".model g gain(gain={k})", ".param k=3",
        ".model h gain(gain=1k)", "Rp probe 0 1k", ".ends", "V1 a 0 2", "X1 a b amp", "R1 b 0 1k",
    )  # fmt: skip
    assert float(table["v(b)"][0]) == pytest.approx(6.0)
    assert float(table["v(x1.probe)"][0]) == pytest.approx(1e3 * 6e-3)


def test_an_array_may_hold_numbers_with_their_scale():
    table = op(
        "V1 a 0 2",
        "V2 b 0 3",
        "A1 [a b] x s",
        "R1 x 0 1k",
        ".model s summer(in_gain=[500m 1] in_offset=[0, 1])",
    )
    assert float(table["v(x)"][0]) == pytest.approx(5.0)


@pytest.mark.parametrize(
    ("lines", "code", "said"),
    [
        (("A1 a x", ".model m gain"), "E140", "no .model is called `x`"),
        (("A1 a [x] m", ".model m gain"), "E341", "`out` of gain is one connection, not a list"),
        (("A1 a m", ".model m gain"), "E341", "the connection `out` of gain is missing"),
        (("A1 a x y m", ".model m gain"), "E341", "`y` is one word too many"),
        (("A1 %d a x m", ".model m gain"), "E341", "cannot be %d; it may be %v %vd %i %id %vnam"),
        (("A1 a a x m", ".model m summer"), "E341", "`in` of summer is a list: write it in [ ]"),
        (("A1 [a a x m", ".model m summer"), "E341", "the list of `in` has no `]`"),
        (("A1 [a] x m", ".model m summer"), "E341", "needs 2 connections at least"),
        (("A1 a %vd x m", ".model m gain"), "E341", "%vd takes two nodes"),
        (("A1 null x m", ".model m gain"), "E341", "`in` of gain cannot be left open"),
        (("A1 ~a x m", ".model m gain"), "E341", "`~` turns digital connections round"),
        (("A1 %vnam vv x m", ".model m gain"), "E341", "none is called `vv`"),
        (("A1 a x m gain=2", ".model m gain"), "E102", "its .model has"),
        (("A1 a x m", ".model m gain(gain=two)"), "E110", "gain= of .model `m` is no number"),
        (("A1 [a a] x m", ".model m summer(in_gain=[1 b])"), "E110", "`b` is no number"),
        (("A1 a x m", ".model m limit(out_lower_limit=2 out_upper_limit=1)"), "E340", "is above out_upper_limit"),
        (("A1 a x m", ".model m s_xfer(num_coeff=[1 1] den_coeff=[1])"), "E340", "the numerator's degree"),
        (("A1 a x m", ".model m d"), "E141", "needs a model of type code model, `m` is D"),
        (("A1 d x m", ".model m d_buffer", "R9 d 0 1k"), "E342", "node `d` is digital"),
        (("A1 [d] m", '.model m d_source(input_file="nowhere.txt")'), "E340", "cannot read nowhere.txt"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said_with_its_place(lines, code, said):
    with pytest.raises(emsim.DeckError) as told:
        emsim.run(deck("V1 a 0 1", "R1 x 0 1k", *lines))
    found = [d for d in told.value.diagnostics if d.code == code]
    assert found and said in found[0].message, str(told.value)
    assert found[0].span is not None and found[0].hint


def test_a_parameter_that_a_model_does_not_have_is_told_with_the_nearest():
    result = emsim.run(deck("V1 a 0 1", "A1 a x m", "R1 x 0 1k", ".model m gain(gian=2)"))
    (told,) = [d for d in result.diagnostics if d.code == "W284"]
    assert "gian" in told.message and "gain=" in (told.hint or "")


def test_a_table_file_that_is_out_of_form_is_told_with_its_line(tmp_path):
    (tmp_path / "s.txt").write_text("* stimuli\n0 0s 0s\n1n 1s\n")
    (tmp_path / "d.cir").write_text(
        't\nV1 a 0 1\nR1 a 0 1k\nA1 [x y] m\n.model m d_source(input_file="s.txt")\n.tran 1n 10n\n.end\n'
    )
    with pytest.raises(emsim.DeckError, match="line 3 has 1 states, `a1` 2 outputs"):
        emsim.run(str(tmp_path / "d.cir"))


def test_small_signals_of_a_transfer_function_are_its_values():
    result = emsim.run(deck(
        "V1 a 0 dc 0 ac 1", "A1 a x m", "R1 x 0 1k",
        ".model m s_xfer(num_coeff=[1 0 2] den_coeff=[1 0.5 2] gain=3 denormalized_freq=20k)", end=".ac dec 5 100 1meg",
    ))  # fmt: skip
    for f, v in zip(result.ac["frequency"].real, result.ac["v(x)"], strict=True):
        s = 2j * math.pi * f / 20e3
        assert cmath.isclose(v, 3 * (s * s + 2) / (s * s + 0.5 * s + 2), rel_tol=1e-9)


def test_an_integrator_and_a_slew_end_at_their_limits():
    """Slope 1e4 from 0.2 up to 0.7, back at once when the input turns at 1 ms."""
    result = emsim.run(deck(
        "V1 a 0 PWL(0 1 1m 1 1.000001m -1)", "A1 a x m", "R1 x 0 1k",
        ".model m int(gain=1e3 out_ic=0.2 out_upper_limit=0.7)", end=".tran 10u 1.4m",
    ))  # fmt: skip
    for t, value in ((0.25e-3, 0.45), (0.8e-3, 0.7), (1.2e-3, 0.5)):
        assert float(result.at("v(x)", t)) == pytest.approx(value, abs=2e-5)


def control(*commands: str) -> str:
    return "\n".join([
        "t", "V1 a 0 PULSE(0 1 5n 1n 1n 9n 20n)", "A1 [a] [d] adc", "A2 d q inv", "R1 a 0 1k",
        ".model adc adc_bridge(in_low=0.5 in_high=0.5 rise_delay=1n fall_delay=1n)",
        ".model inv d_inverter(rise_delay=2n fall_delay=3n)",
        ".tran 1n 20n", ".control", "run", *commands, ".endc", ".end", "",
    ])  # fmt: skip


def test_eprint_shows_when_digital_nodes_change(tmp_path):
    import subprocess
    import sys

    (tmp_path / "d.cir").write_text(control("eprint d q", "edisplay", "eprvcd d q", "eprvcd q > q.vcd"))
    done = subprocess.run(
        [sys.executable, "-m", "emsim", "d.cir", "--no-files"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    lines = [line.split() for line in done.stdout.splitlines()]
    rows = [w for w in lines if len(w) == 3 and w[0][:1].isdigit() and w[1][-1:] == "s"]
    assert [w[1:] for w in rows] == [["0s", "1s"], ["1s", "1s"], ["1s", "0s"], ["0s", "0s"], ["0s", "1s"]]
    assert [float(w[0]) for w in rows] == pytest.approx([0, 6.5e-9, 9.5e-9, 16.5e-9, 18.5e-9], abs=1e-13)
    assert ["d", ":", "d", ",", "3"] in lines
    dump = (tmp_path / "q.vcd").read_text()
    assert "$var wire 1 ! q $end" in dump and "#9500\n0!\n#18500\n1!" in dump
    assert "#6500" in done.stdout


def test_a_node_that_is_not_digital_is_told(tmp_path):
    result = emsim.run(control("eprint a"))
    assert any(d.code == "E162" and "no digital node" in d.message for d in result.diagnostics)


@pytest.mark.parametrize("name", ["gain", "sigma_delta", "oneshot", "table2d", "core", "divider"])
def test_its_equations_can_be_read(name, capsys):
    from pathlib import Path

    from emsim.cli import main

    path = Path(__file__).resolve().parent / "corpus" / f"xspice_{name}.cir"
    assert main(["explain", str(path)]) == 0
    assert "code model a1" in capsys.readouterr().out.lower() or name in ("divider", "core")


def test_a_model_is_altered_between_runs(tmp_path, capsys):
    """The deck is assembled again with what has been altered: its connections are what they were."""
    from emsim.cli import main

    text = deck(
        "V1 a 0 1", "A1 %vd(a 0) x m", "A2 [x] [d] adc", "R1 x 0 1k", ".model m gain(gain=3)", ".model adc adc_bridge",
        end=".op\n.control\nrun\nprint v(x)\naltermod m gain=5\nrun\nprint v(x)\nalter r1=2k\nrun\nprint i(a1)\n.endc",
    )  # fmt: skip
    (tmp_path / "d.cir").write_text(text)
    assert main([str(tmp_path / "d.cir"), "--no-files"]) == 0
    words = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert [float(w[2]) for w in words if len(w) == 3 and w[1] == "="] == pytest.approx([3.0, 5.0, -2.5e-3])


def test_a_parameter_of_a_model_is_stepped():
    lines = ("V1 a 0 1", "A1 a x m", "R1 x 0 1k", ".model m gain(gain={k})", ".param k=1")
    result = emsim.run(deck(*lines, end=".op\n.step param k list 1 2"))
    assert [float(v) for v in result.table("op")["v(x)"]] == [1.0, 2.0]

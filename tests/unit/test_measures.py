"""`.meas`: spellings, values with closed forms, units, what is said of cards that find nothing."""

import json
import math

import numpy as np
import pytest

import emsim
from emsim._engine import Curve as Polynomials
from emsim.build import parse_measure
from emsim.cli import main
from emsim.deck import Measure
from emsim.diagnostics import DeckError
from emsim.measures import KINDS, measure
from emsim.measures.curve import areas, integrals, nodes, resampling, slopes
from emsim.store import Columns
from emsim.table import Table
from emsim.units import product, quotient

R, C = 1e3, 1e-9
TAU = R * C
STEP = "t\nV1 in 0 PULSE(0 1 0 1n 1n 1 2)\nR1 in out 1k\nC1 out 0 1n\n.tran 10n 10u\n{}\n.end\n"


def found(deck: str, *lines: str) -> dict[str, emsim.measures.Measured]:
    return {m.name: m for m in emsim.run(deck.format("\n".join(lines))).measured}


def one(card: str, deck: str = STEP) -> float:
    return found(deck, f".meas tran x {card}")["x"].value


# ---- curves ---------------------------------------------------------------------------------------------


def Curve(x, y):
    """Arrays of (segments, n+1)."""
    return Polynomials(x.tobytes(), y.tobytes(), x.shape[1] - 1)


@pytest.mark.parametrize("n", [3, 4, 8])
def test_polynomials_of_the_degree_are_exact(n):
    t, p = nodes(n), np.polynomial.Polynomial(np.arange(1.0, n + 2))
    at = np.linspace(0, 1, 7)
    assert resampling(n, at) @ p(t) == pytest.approx(p(at), rel=1e-12)
    assert slopes(n) @ p(t) == pytest.approx(p.deriv()(t), rel=1e-11)
    assert p(t) @ areas(n) == pytest.approx(p.integ()(1.0), rel=1e-13)
    assert integrals(n) @ p(t) == pytest.approx(p.integ()(t), rel=1e-12, abs=1e-13)


def test_a_curve_crosses_where_its_polynomial_does_also_at_a_jump():
    x = np.array([nodes(4), 1 + nodes(4)])
    y = np.array([nodes(4) ** 2, 3 + nodes(4)])
    curve = Curve(x, y)
    at = [t for t, _ in curve.crossings(Curve(x, 0 * x + 0.25), 0, 2)]
    assert at == [pytest.approx(0.5, abs=1e-14)]
    assert list(curve.crossings(Curve(x, 0 * x + 2), 0, 2)) == [(1.0, 1)]
    assert list(curve.crossings(Curve(x, 0 * x), 0, 2)) == [(0.0, 1)]  # it starts there
    assert curve.value(1.0) == pytest.approx(3.0)


def test_an_extreme_between_the_points_is_found():
    x = np.array([nodes(4)])
    value, at = Curve(x, 1 - (x - 0.4) ** 2).extreme(1.0)
    assert (value, at) == (pytest.approx(1.0, abs=1e-15), pytest.approx(0.4, abs=1e-14))


# ---- spellings ------------------------------------------------------------------------------------------

SAME = [
    ("tran x trig v(a) val=0.5 rise=1 targ v(b) val=0.5 fall=last", "TRAN x TRIG V(a)=0.5 RISE=1 TARG V(b)=0.5 FALL=LAST"),
    ("tran x avg v(a) from=1u to=2u", "x AVG v(a) FROM 1u TO 2u"),
    ("tran x find v(b) when v(a)=1 td=1u", "tran x FIND v(b) WHEN v(a) = 1 TD=1u"),
    ("tran x param='a+b'", "tran x PARAM a+b"),
    ("tran x param='a+b'", "tran x param={a+b}"),
    ("tran x integ v(a)*i(r1)", "tran x INTEGRAL par('v(a)*i(r1)')"),
    ("tran x deriv v(a) at=1u", "tran x derivative v(a) AT=1u"),
    ("tran x max max(v(a),0) from=1u", "tran x MAX max(v(a),0) from=1u"),
    ("tran x min_at v(at)", "tran x MIN_AT v(at)"),
]  # fmt: skip


@pytest.mark.parametrize(("ours", "other"), SAME)
def test_ngspices_and_ltspices_spellings_are_one(ours, other):
    def told(card: Measure) -> list[object]:
        return [(c.word, c.body, c.level, sorted(c.values.items())) for c in card.clauses]

    a, b = parse_measure(ours), parse_measure(other)
    # LTspice writes levels behind `=`, ngspice as val=
    for card in (a, b):
        for clause in card.clauses:
            if "val" in clause.values and clause.level is None:
                clause.level = clause.values.pop("val")
    assert told(a) == told(b)
    assert a.name == "x" and {a.analysis, b.analysis} <= {"tran", ""}


def test_a_card_over_several_lines_with_comments_is_one():
    lines = [
        ".meas tran x trig v(in) val=0.5 rise=1",
        "* between",
        "+ targ v(out) val=0.5 ; the end",
        "+ rise=1",
    ]
    assert found(STEP, *lines)["x"].value == pytest.approx(TAU * math.log(2), rel=1e-3)


def test_a_node_whose_name_is_a_number_is_one():
    deck = "t\nV1 1 0 3\nR1 1 2 1k\nR2 2 0 2k\n.tran 1u 5u\n.meas tran x find 2 at=1u\n.four 1meg 2\n.end\n"
    result = emsim.run(deck)
    assert result.measures["x"] == pytest.approx(2.0) and result.spectra[0].harmonics[
        0
    ].magnitude == pytest.approx(2.0)
    with pytest.raises(DeckError, match="7"):
        emsim.run(deck.replace("find 2", "find 7"))


def test_a_measurement_may_be_called_like_a_word_of_the_card():
    assert found(STEP, ".meas tran max max v(out)", ".meas tran when find v(out) at=1u").keys() == {
        "max",
        "when",
    }


def test_a_signal_and_a_time_of_the_same_name_as_a_word_are_told_apart():
    deck = "t\nV1 at 0 PULSE(0 1 0 1n 1n 1 2)\nR1 at to 1k\nC1 to 0 1n\n.tran 10n 10u\n.meas tran x find v(to) at=1u\n.end\n"
    assert emsim.run(deck).measures["x"] == pytest.approx(1 - math.exp(-1), rel=1e-3)


@pytest.mark.parametrize(
    ("card", "said"),
    [
        ("x", "does not say what"),
        ("x trig v(in) val=0.5 targ v(out)", "`targ` does not say at which value"),
        ("x trig v(in) val=0.5", "`targ` is missing"),
        ("x find v(out)", "does not say where"),
        ("x when v(out)=0.5 rise=1 fall=1", "not by both"),
        ("x max v(out) when v(in)=1", "does not go with `max`"),
        ("x avg from=0 to=1u", "of which signal"),
        ("x when v(out)=", "is missing here"),
        ("x max v(nowhere)", "no node"),
        ("x param='y+1'", "no"),
    ],
)
def test_a_wrong_card_is_said_before_the_run(card, said):
    with pytest.raises(DeckError) as error:
        emsim.run(STEP.format(f".meas tran {card}"))
    assert said in str(error.value)


# ---- values ---------------------------------------------------------------------------------------------


def test_statistics_of_a_sine_over_whole_periods():
    deck = "t\nV1 a 0 SIN(1 2 1k)\nR1 a 0 1\n.tran 1u 4m\n.options reltol=1e-6\n{}\n.end\n"
    words = ("avg", "rms", "min", "max", "pp", "integ", "min_at", "max_at")
    got = found(deck, *(f".meas tran {w}_ {w} v(a) from=1m to=3m" for w in words))
    expected = [1, math.sqrt(1 + 2), -1, 3, 4, 2e-3, 1.75e-3, 1.25e-3]
    for word, value in zip(words, expected, strict=True):
        assert got[f"{word}_"].value == pytest.approx(value, rel=1e-5), word


def test_crossings_are_counted_by_direction_and_from_a_delay():
    deck = "t\nV1 a 0 SIN(0 1 1k)\nR1 a 0 1\n.tran 1u 4m\n.options reltol=1e-6\n{}\n.end\n"
    at = math.asin(0.5) / (2 * math.pi * 1e3)
    cases = {
        "rise=1": at, "rise=3": 2e-3 + at, "fall=1": 0.5e-3 - at, "cross=2": 0.5e-3 - at, "fall=last": 3.5e-3 - at,
        "td=1.2m rise=1": 2e-3 + at, "rise=1 from=1.2m to=3m": 2e-3 + at, "rise=-2": 2e-3 + at,
    }  # fmt: skip
    for words, expected in cases.items():
        assert one(f"when v(a)=0.5 {words}", deck) == pytest.approx(expected, abs=2e-9), words


def test_a_chain_of_measurements_and_parameters():
    lines = [
        ".param half=0.5", ".meas tran t1 when v(out)=half", ".meas tran t2 when v(out)='0.5*half+0.5'",
        ".meas tran ratio param='(t2-t1)/t1'", ".meas tran again find v(out) at=t1", ".meas tran top max v(out) to='t1+t2'",
    ]  # fmt: skip
    got = found(STEP, *lines)
    assert got["ratio"].value == pytest.approx(1.0, rel=2e-3)
    assert got["again"].value == pytest.approx(0.5, rel=1e-9)
    assert got["top"].value == pytest.approx(1 - math.exp(-3 * math.log(2)), rel=1e-3)
    assert (got["t1"].unit, got["ratio"].unit, got["again"].unit) == ("s", "", "V")


def test_what_reads_a_measurement_that_found_nothing_has_no_value_either():
    got = found(STEP, ".meas tran never when v(out)=2", ".meas tran twice param='2*never'")
    assert math.isnan(got["twice"].value) and "reads `never`" in got["twice"].trouble.message
    assert "never crosses 2" in got["never"].trouble.message and "between 0" in got["never"].trouble.hint


def test_a_machine_is_measured_like_a_circuit():
    deck = (
        "a pendulum\nBODY rod shape=rod(1) m=1\nJOINT hinge 0 rod pin ic=0.1\n.gravity 9.81\n.tran 1m 10\n"
        ".options reltol=1e-8\n.meas tran period trig angle(hinge)=0 fall=1 targ angle(hinge)=0 fall=2\n"
        ".meas tran fastest max omega(hinge)\n.meas tran drift pp energy()\n.meas tran turned integ rpm(omega(hinge))\n.end\n"
    )
    got = {m.name: m for m in emsim.run(deck).measured}
    # a rod about its end: I = l^2/3, so omega0^2 = 3 g/(2 l); the angle from hanging has its own zero
    assert got["fastest"].unit == "rad/s" and got["drift"].unit == "J" and got["period"].unit == "s"
    assert got["drift"].value < 1e-6 and got["period"].value > 1.0


RISE = (
    "t\nV1 in 0 PULSE(0 1 1u 1n 1n 5u 10u)\nR1 in out 1k\nC1 out 0 1n\n.tran 10n 30u\n"
    ".options reltol={} abstol=1e-18 vntol=1e-14 method={}\n"
    ".meas tran rise trig v(out) val=0.1 rise=1 targ v(out) val=0.9 rise=1\n.end\n"
)


def rise_error(method: str, reltol: float) -> float:
    return abs(emsim.run(RISE.format(reltol, method)).measures["rise"] / (TAU * math.log(9)) - 1)


@pytest.mark.parametrize("method", ["auto", "radau", "dop853", "rk45", "esdirk", "gear"])
def test_the_rise_time_of_an_rc_is_that_of_the_closed_form_to_1e_9(method):
    assert rise_error(method, 1e-10) < 1e-9


@pytest.mark.parametrize(
    ("method", "reltol"), [("trap", 1e-7), ("gear", 1e-5), ("trbdf2", 1e-5), ("esdirk", 1e-5), ("rk45", 1e-4), ("radau", 1e-5)]
)  # fmt: skip
def test_a_crossing_follows_the_tolerance(method, reltol):
    """Of the method's own dense output: a thousandth of the tolerance takes a tenth of the error at least, and it stays within
    it; straight lines between rows would keep theirs."""
    coarse, fine = rise_error(method, reltol), rise_error(method, 1e-3 * reltol)
    assert fine < max(0.1 * coarse, 1e-3 * reltol)


@pytest.mark.parametrize("method", ["dop853", "esdirk"])
def test_half_the_tolerance_takes_its_part_of_the_error(method):
    """Over ten halvings together, since steps that land elsewhere make one of them uneven."""
    ladder = [rise_error(method, 1e-4 * 0.5**k) for k in range(11)]
    assert ladder[10] < 0.02 * ladder[0]


def test_what_lies_between_the_frequencies_of_a_sweep_is_solved_there():
    """One point a decade, and the corner frequency to rounding."""
    deck = (
        "t\nV1 in 0 ac 1\nR1 in out 1k\nC1 out 0 1n\n.ac dec 1 1k 10meg\n.meas ac f3 when vdb(out)='-10*log10(2)'\n"
        ".meas ac area integ mag(v(out)) from=1k to=1meg\n.end\n"
    )
    got, corner = emsim.run(deck).measures, 1 / (2 * math.pi * TAU)
    assert got["f3"] == pytest.approx(corner, rel=1e-12)
    area = corner * (math.asinh(1e6 / corner) - math.asinh(1e3 / corner))
    assert got["area"] == pytest.approx(area, rel=1e-12)


def test_measurements_begin_where_the_results_do():
    deck = "t\nV1 a 0 SIN(0 1 1k)\nR1 a 0 1\n.tran 1u 2m 0.6m\n.meas tran lowest min_at v(a)\n.meas tran all avg v(a)\n.end\n"
    got = {m.name: m for m in emsim.run(deck).measured}
    assert got["lowest"].value == pytest.approx(0.75e-3, rel=1e-4) and got["all"].more[
        "from"
    ] == pytest.approx(0.6e-3)


def test_what_only_a_measurement_reads_is_computed_for_it():
    """Reactions and currents of elements are made only where something asks for them."""
    deck = (
        "t\n.gravity 9.81\nBODY rod shape=rod(1) m=2\nJOINT hinge 0 rod pin ic=-90deg\nV1 a 0 3\nR1 a b 1k\nS1 b 0 a 0 sw\n"
        ".model sw sw(ron=1k)\n.tran 1m 0.5\n.meas tran weight max fy(hinge)\n.meas tran current find i(S1) at=0.1\n.end\n"
    )
    got = emsim.run(deck).measures
    assert got["weight"] == pytest.approx(2 * 9.81, rel=1e-6) and got["current"] == pytest.approx(1.5e-3)


def test_small_signals_are_measured_in_decibels_and_a_note_tells_of_real_parts():
    deck = "t\nV1 in 0 ac 1\nR1 in out 1k\nC1 out 0 1n\n.ac dec 20 1k 100meg\n{}\n.end\n"
    corner = 1 / (2 * math.pi * TAU)
    lines = (
        ".meas ac f3 when vdb(out)='-10*log10(2)'", f".meas ac phase find vp(out) at={corner!r}",
        f".meas ac size find mag(v(out)) at={corner!r}", f".meas ac bare find v(out) at={corner!r}",
        ".meas ac slope deriv vm(out) at=1k", ".meas ac top max vdb(out)",
    )  # fmt: skip
    got = found(deck, *lines)
    assert got["f3"].value == pytest.approx(corner, rel=1e-4)
    assert got["phase"].value == pytest.approx(-math.pi / 4, rel=1e-4)
    assert got["size"].value == pytest.approx(math.sqrt(0.5), rel=1e-4)
    assert got["bare"].value == pytest.approx(0.5, rel=1e-4) and got["bare"].remark.code == "N331"
    assert got["f3"].remark is None and got["top"].more == {"at": 1e3}


def test_a_sweep_is_measured_in_the_direction_in_which_it_goes():
    deck = "t\nV1 in 0 0\nB1 out 0 V=v(in)*v(in)*v(in)\nR1 out 0 1k\n.dc V1 {} \n.meas dc x when v(out)=1 {}=1\n.end\n"
    assert emsim.run(deck.format("-2 2 0.1", "rise")).measures["x"] == pytest.approx(1.0, abs=1e-4)
    assert emsim.run(deck.format("2 -2 -0.1", "fall")).measures["x"] == pytest.approx(1.0, abs=1e-4)


def test_a_coarse_sweep_is_solved_between_its_points():
    """A diode's voltage is 0.6 V where its law says, on a grid of 0.2 V, for each temperature of the outer sweep."""
    deck = (
        "t\nV1 in 0 0\nR1 in a 1k\nD1 a 0 dd\n.model dd d(is=1e-14)\n.dc V1 0 5 {} temp 27 47 20\n"
        ".meas dc x find v(in) when v(a)=0.6\n.end\n"
    )
    coarse, fine = (emsim.run(deck.format(step)) for step in (0.2, 0.01))
    assert len(coarse.main) == 52 and len(coarse.measured) == 2
    current = 1e-14 * (math.exp(0.6 / (1.380649e-23 * 300.15 / 1.602176634e-19)) - 1)
    assert fine.measures["x"][0] == pytest.approx(0.6 + 1e3 * current, rel=1e-4)
    assert coarse.measures["x"] == pytest.approx(fine.measures["x"], rel=2e-3)


def test_a_table_that_nobody_ran_is_measured_too():
    """As a command of .control has it: a card from text, a table of columns."""
    t = np.linspace(0, 1, 201)
    table = Table("tran", ["time", "v(a)"], ["s", "V"], Columns([t, np.sin(7 * t)]))
    value = measure([parse_measure("tran x when v(a)=0.5 fall=1")], table)[0].value
    assert value == pytest.approx((math.pi - math.asin(0.5)) / 7, rel=1e-6)


WHOLE_COURSE = {
    "avg(v(a))": 1.0, "rms(v(a))": math.sqrt(3), "pp(v(a))": 4.0, "maximum(v(a))": 3.0, "minimum(v(a))": -1.0,
    "integ(v(a))": 4e-3, "ddt(v(a))": 4e3 * math.pi, "deriv(v(a))": 4e3 * math.pi, "avg(v(a)*i(r1))": 3e-3,
}  # fmt: skip


@pytest.mark.parametrize(("text", "last"), WHOLE_COURSE.items())
def test_functions_of_a_whole_course(text, last):
    """In .print, in Result[...] and in .meas they are the same, the latter on the polynomials within the steps."""
    deck = "t\nV1 a 0 SIN(1 2 1k)\nR1 a 0 1k\n.tran 10u 4m\n.options reltol=1e-7\n.save v(a) i(r1)\n"
    deck += f".meas tran x find {text} at=4m\n"
    dynamic = "" if text.startswith("ddt") else f".print tran {text}\n"
    result = emsim.run(deck + dynamic + ".end\n")
    tolerance = 2e-3 if "d" in text.partition("(")[0] else 1e-5
    assert result[text][-1] == pytest.approx(last, rel=tolerance)
    assert result.measures["x"] == pytest.approx(last, rel=1e-5)
    unit = {"integ(v(a))": "Wb", "ddt(v(a))": "V/s", "deriv(v(a))": "V/s", "avg(v(a)*i(r1))": "W"}.get(
        text, "V"
    )
    assert result.unit(text) == unit and result.measured[0].unit == unit


def test_functions_of_a_course_are_of_each_course():
    result = emsim.run("t\nV1 a 0 {v}\nR1 a 0 1k\n.tran 1u 5u\n.step param v list 1 3\n.end\n")
    averages = result["avg(v(a))"]
    assert averages[0] == pytest.approx(1) and averages[-1] == pytest.approx(3)


def test_columns_of_an_analysis_of_its_own_stand_in_expressions():
    deck = "t\nV1 in 0 dc 1 ac 1\nR1 in out 1k\nR2 out 0 1k\n.tf v(out) V1\n.noise v(out) V1 dec 1 1k 10k\n"
    deck += ".print tf db(transfer_function)\n.print noise db(onoise_spectrum)\n.meas noise loud find onoise_spectrum at=2k\n"
    result = emsim.run(deck + ".end\n")
    from emsim.outputs import text

    said = "\n".join(text.lines(result))
    assert "db(transfer_function) = -6.0206" in said and "db(onoise_spectrum)" in said
    assert result.measures["loud"] == pytest.approx(result.noise["onoise_spectrum"][0], rel=1e-3)


def test_analyses_may_be_given_beside_the_deck():
    deck = "t\nV1 in 0 dc 1 ac 1\nR1 in out 1k\nC1 out 0 1n\n.tran 1u 10u\n.end\n"
    result = emsim.run(deck, analyses=[".op", "ac dec 10 1k {f}".format(f="1meg")])
    assert [t.kind for t in result.plots] == ["op", "ac"]
    assert result.ac["v(out)"].dtype == complex and result.op["v(out)"] == pytest.approx([1.0])
    with pytest.raises(DeckError, match="no analysis"):
        emsim.run(deck, analyses=[".param x=1"])
    with pytest.raises(KeyError):
        _ = result.tran


# ---- units ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("a", "b", "times", "over"),
    [
        ("V", "A", "W", "Ohm"), ("V", "V", "V^2", ""), ("V", "s", "Wb", "V/s"), ("N m", "rad/s", "W", "N m s/rad"),
        ("W", "s", "J", "W/s"), ("A", "V", "W", "S"), ("rad", "s", "rad s", "rad/s"), ("dB", "Hz", "dB Hz", "dB/Hz"),
        ("m", "s", "m s", "m/s"), ("", "s", "s", "Hz"), ("V", "", "V", "V"),
    ],
)  # fmt: skip
def test_units_of_products_and_quotients(a, b, times, over):
    assert (product(a, b), quotient(a, b)) == (times, over)


# ---- the command line -----------------------------------------------------------------------------------


def test_the_command_prints_as_ngspice_does_and_ends_with_4_where_something_is_not_found(
    tmp_path, capsys, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "d.cir").write_text(
        STEP.format(".meas tran half when v(out)=0.5\n.meas tran never when v(out)=2")
    )
    assert main(["d.cir"]) == 4
    said = capsys.readouterr()
    assert "  Measurements for Transient Analysis\n" in said.out
    assert "half                =  6.9" in said.out and "never               = failed" in said.out
    assert "error[E430]: `never` is not found" in said.err and (tmp_path / "d.raw").exists()
    assert main(["--json", "d.cir"]) == 4
    told = json.loads(capsys.readouterr().out)["measures"]
    assert (
        [m["name"] for m in told] == ["half", "never"] and told[1]["value"] is None and told[0]["unit"] == "s"
    )


def test_every_kind_says_what_it_is_and_reads_its_own_form():
    for kind in KINDS:
        assert kind.meaning and parse_measure(
            kind.form.split(", .meas")[0].removeprefix(".meas ").partition(" (")[0]
        )


def test_a_gate_that_only_switches_read_is_measured_at_its_edges():
    """No step ends at the edges of such a source: what lies between the ends is not one polynomial."""
    deck = (
        "t\nVg g 0 PULSE(0 5 0 1u 1u 48u 100u)\nVs s 0 12\nS1 s a g 0 sw\nD1 0 a dd\nL1 a b 1m\nC1 b 0 10u\nR1 b 0 10\n"
        ".model sw sw(vt=2.5 ron=0.01 roff=1meg)\n.model dd d(is=1e-14)\n.tran 10u 2m\n"
        ".meas tran top max v(g)\n.meas tran low min v(g)\n.meas tran mean avg v(g) from=0.5m to=1.5m\n"
        ".meas tran rise trig v(g)=0.5 rise=3 targ v(g)=4.5 rise=3\n.end\n"
    )
    got = emsim.run(deck).measures
    assert got["top"] == pytest.approx(5, rel=1e-9) and got["low"] == pytest.approx(0, abs=1e-9)
    assert got["mean"] == pytest.approx(5 * 49 / 100, rel=1e-6) and got["rise"] == pytest.approx(
        0.8e-6, rel=1e-4
    )


def test_a_measurement_may_read_those_below_it():
    """ngspice takes `param` cards behind all others."""
    deck = """t
V1 a 0 PULSE(0 1 0 1u 1u 1m 2m)
R1 a b 1k
C1 b 0 100n
.tran 1u 4m
.meas tran ratio param='hi/lo'
.meas tran hi max v(b)
.meas tran lo avg v(b)
.end
"""
    found = emsim.run(deck).measures
    assert [*found] == ["ratio", "hi", "lo"]
    assert found["ratio"] == found["hi"] / found["lo"] == pytest.approx(1.998, abs=1e-3)

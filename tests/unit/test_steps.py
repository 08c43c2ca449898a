"""`.step` and lists of `.temp`: spellings, what is changed, results by step in every format; `.four`."""

import json
import math
import subprocess

import numpy as np
import pytest
from support import needs_ngspice

import emsim
from emsim.cli import main
from emsim.diagnostics import DeckError
from emsim.outputs import load

RC = "t\n.param c=1n\nV1 in 0 PULSE(0 1 0 1n 1n 1 2)\nR1 in out {r}\nC1 out 0 {c}\n.tran 100n 20u\n.options reltol=1e-8\n"
DIVIDER = "t\nV1 a 0 10\nR1 a b 1k\nR2 b 0 1k\n"


def rows(steps: list[dict[str, float]], name: str) -> list[float]:
    return [s[name] for s in steps]


@pytest.mark.parametrize(
    ("card", "values"),
    [
        ("param r list 1k 2k 5k", [1e3, 2e3, 5e3]),
        ("param r list 1k, 2k,5k", [1e3, 2e3, 5e3]),
        ("param r 1k 3k 0.5k", [1e3, 1.5e3, 2e3, 2.5e3, 3e3]),
        ("lin param r 1k 2k 1k", [1e3, 2e3]),
        ("dec param r 100 10k 2", [1e2, 1e2 * 10**0.5, 1e3, 1e3 * 10**0.5, 1e4]),
        ("oct param r 1k 8k 1", [1e3, 2e3, 4e3, 8e3]),
        ("param r 3k 1k -1k", [3e3, 2e3, 1e3]),
        ("param r {base} {3*base} {base}", [1e3, 2e3, 3e3]),
    ],
)
def test_values_of_a_step(card, values):
    result = emsim.run(RC + f".param base=1k\n.step {card}\n.meas tran half when v(out)=0.5\n.end\n")
    assert rows(result.steps, "r") == pytest.approx(values)
    # the delay of the edge's middle is half its length
    expected = [v * 1e-9 * math.log(2) + 0.5e-9 for v in values]
    assert result.measures["half"] == pytest.approx(expected, rel=1e-4)


def test_the_first_of_several_steps_runs_fastest():
    result = emsim.run(RC + ".step param r list 1k 2k\n.step param c list 1n 3n\n.end\n")
    assert [(s["r"], s["c"]) for s in result.steps] == [(1e3, 1e-9), (2e3, 1e-9), (1e3, 3e-9), (2e3, 3e-9)]
    table = result.main
    assert table.names[:3] == ["time", "r", "c"] and table.steps == ["r", "c"] and len(table.courses()) == 4
    assert table.step_values() == result.steps
    value = table.courses()[3].at("v(out)", 6e-6)
    assert value == pytest.approx(1 - math.exp(-1), rel=1e-3)


def test_steps_of_elements_sources_models_and_temperature():
    element = emsim.run(DIVIDER + ".op\n.step R2 list 1k 3k\n.end\n")
    assert element["v(b)"] == pytest.approx([5, 7.5]) and element.main.axis.name == "r2"
    assert element.main.unit("r2") == "Ohm" and element["r2"] == pytest.approx([1e3, 3e3])
    source = emsim.run(DIVIDER + ".op\n.step V1 0 4 2\n.end\n")
    assert source["v(b)"] == pytest.approx([0, 1, 2])
    diode = "t\nI1 0 a 1m\nD1 a 0 dd\n.model dd d(is=1e-14)\n.op\n"
    model = emsim.run(diode + ".step d dd(is) list 1e-14 1e-13\n.end\n")
    assert model["v(a)"][0] - model["v(a)"][1] == pytest.approx(0.025865 * math.log(10), rel=1e-3)
    assert model.main.names[0] == "dd(is)"
    hot = emsim.run(diode + ".temp 27 85\n.end\n")
    assert hot.steps == [{"temp": 27.0}, {"temp": 85.0}]
    for k, temp in enumerate((27, 85)):
        one = emsim.run(diode + f".temp {temp}\n.end\n")["v(a)"][0]
        assert hot["v(a)"][k] == pytest.approx(one, rel=1e-12)
    assert emsim.run(diode + ".step temp 27 85 58\n.end\n")["v(a)"] == pytest.approx(hot["v(a)"], rel=1e-12)


def test_every_analysis_is_run_in_every_step():
    deck = "t\nV1 in 0 dc 1 ac 1\nR1 in out {r}\nC1 out 0 1n\nR2 out 0 1k\n"
    deck += (
        ".op\n.dc V1 0 2 1\n.ac dec 5 1k 10meg\n.tran 1u 5u\n.tf v(out) V1\n.step param r list 1k 3k\n.end\n"
    )
    result = emsim.run(deck)
    assert {t.kind for t in result.plots} == {"op", "dc", "ac", "tran", "tf"}
    assert result.table("op")["v(out)"] == pytest.approx([0.5, 0.25])
    assert result.table("tf")["transfer_function"] == pytest.approx([0.5, 0.25])
    dc = result.table("dc")
    assert dc["v(out)"] == pytest.approx([0, 0.5, 1, 0, 0.25, 0.5]) and dc["r"] == pytest.approx(
        [1e3] * 3 + [3e3] * 3
    )
    assert [abs(c["v(out)"][0]) for c in result.table("ac").courses()] == pytest.approx([0.5, 0.25], rel=1e-3)


def test_a_machine_is_stepped_too():
    deck = (
        "t\n.gravity 0\nBODY cart m={m}\nJOINT rail 0 cart slide axis=(1,0)\nFORCE f cart fx=1\n.tran 1m 1\n"
    )
    deck += ".step param m list 1 2\n.meas tran speed find vel(rail) at=1\n.end\n"
    assert emsim.run(deck).measures["speed"] == pytest.approx([1.0, 0.5], rel=1e-6)


def test_each_run_of_a_machine_has_its_ledger(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    deck = (
        "t\n.gravity 0\nBODY cart m={m}\nJOINT rail 0 cart slide axis=(1,0)\nFORCE f cart fx=1\n.tran 1m 1\n"
    )
    deck += ".step param m list 1 2\n.end\n"
    (tmp_path / "d.cir").write_text(deck)
    assert main(["--energy", "--no-files", "d.cir"]) == 0
    said = capsys.readouterr().out
    assert said.count("Step: m = ") == 2 and said.count("supplied") >= 2


def test_a_measurement_that_is_not_found_in_one_step_has_the_others():
    deck = RC + ".step param r list 1k 100k\n.meas tran most when v(out)=0.9\n.end\n"
    result = emsim.run(deck)
    assert result.measures["most"][0] == pytest.approx(1e-6 * math.log(10), rel=1e-2)
    assert math.isnan(result.measures["most"][1])
    assert [d.code for d in result.diagnostics] == ["E430"]
    assert result.diagnostics[0].message.startswith("at r = 100000: `most` is not found")
    many = emsim.run(RC + ".step param r 100k 105k 1k\n.meas tran most when v(out)=0.9\n.end\n").diagnostics
    assert [d.code for d in many] == ["E430"] and many[0].message.endswith("(and in 5 further steps)")


@pytest.mark.parametrize(
    ("card", "said"),
    [
        ("param r list", "no values"),
        ("param r 1k", "start, an end and a step"),
        ("param r 1k 2k -1k", "do not lead"),
        ("dec param r 0 1k 5", "ascending positive"),
        ("", "does not say what"),
        ("R9 list 1 2", "no element"),
        ("npn nope(bf) list 1 2", "no .model"),
        ("param r list 1k 1k", "twice"),
        ("V1 list 1 2", "no plain value"),
        ("param r 1 1e9 1", "more than"),
        ("param r list 1k two", "`two` is no number"),
    ],
)
def test_a_wrong_step_is_said(card, said):
    with pytest.raises(DeckError) as error:
        emsim.run(RC + f".param r=1k\n.step {card}\n.end\n")
    assert said in str(error.value) and error.value.diagnostics[0].span is not None


def test_what_ends_a_run_is_told_with_its_step():
    deck = "t\n.param g=1\nC1 a 0 1 ic=1\nB1 0 a I={g*v(a)*v(a)}\n.step param g list -1 1\n.tran 10m 2 uic\n.end\n"
    with pytest.raises(emsim.ConvergenceError) as error:
        emsim.run(deck)
    assert "at g = 1:" in str(error.value)
    assert len(error.value.partial.steps) == 2 and len(error.value.partial.main.courses()) == 2


# ---- formats --------------------------------------------------------------------------------------------

FORMATS = ["raw", "parquet", "nc"]


@pytest.mark.parametrize("extension", FORMATS)
def test_steps_come_back_from_files(extension, tmp_path):
    if extension != "raw":
        pytest.importorskip({"parquet": "pyarrow", "nc": "h5netcdf"}[extension])
    result = emsim.run(RC + ".step param r list 1k 2k\n.ac dec 5 1k 1meg\n.end\n")
    result.save(tmp_path / f"x.{extension}")
    back = load(tmp_path / f"x.{extension}").main
    assert back.steps == ["r"] and back.step_values() == [{"r": 1e3}, {"r": 2e3}] and back.is_stepped
    for a, b in zip(back.courses(), result.main.courses(), strict=True):
        assert a.names == b.names and np.array_equal(a["v(out)"], b["v(out)"])


def test_csv_has_a_column_of_the_step(tmp_path):
    result = emsim.run(RC + ".step param r list 1k 2k\n.end\n")
    result.save(tmp_path / "x.csv")
    head, first, *_, last = (tmp_path / "x.csv").read_text().splitlines()
    assert head.startswith("time,r,") and first.split(",")[1] == "1000.0" and last.split(",")[1] == "2000.0"


def test_complex_steps_come_back_from_a_raw_file(tmp_path):
    deck = "t\nV1 in 0 ac 1\nR1 in out {r}\nC1 out 0 1n\n.ac dec 5 1k 1meg\n.step param r list 1k 2k\n.end\n"
    result = emsim.run(deck)
    result.save(tmp_path / "x.raw")
    back = load(tmp_path / "x.raw").main
    assert back.steps == ["r"] and np.allclose(back["v(out)"], result["v(out)"], rtol=1e-14)
    result.save(tmp_path / "y.raw", ascii=True)
    assert load(tmp_path / "y.raw").main.steps == ["r"]


def test_ltspices_stepped_files_are_read_with_their_steps_counted(tmp_path):
    head = (
        "Title: * x\nDate: today\nPlotname: Transient Analysis\nFlags: real forward stepped double\nNo. Variables: 2\n"
        "No. Points: 5\nOffset: 0.0\nCommand: Linear Technology Corporation LTspice XVII\nVariables:\n"
        "\t0\ttime\ttime\n\t1\tV(out)\tvoltage\nBinary:\n"
    )
    data = np.array([[0, 1], [1, 2], [2, 3], [0, 10], [2, 30]], dtype="<f8")
    (tmp_path / "x.raw").write_bytes(head.encode("utf-16-le") + data.tobytes())
    table = load(tmp_path / "x.raw").main
    assert table.steps == ["step"] and [len(c) for c in table.courses()] == [3, 2]
    assert table.courses()[1]["v(out)"].tolist() == [10, 30]


def test_pictures_have_a_curve_for_each_step_and_tables_a_line(tmp_path):
    from emsim.outputs.panels import panels

    result = emsim.run(RC + ".step param r list 1k 2k\n.print tran v(out)\n.end\n")
    (panel,) = panels(result.main, ["v(out)"])
    assert [c.name for c in panel.curves] == ["v(out) r=1k", "v(out) r=2k"]
    from emsim.outputs import text

    said = "\n".join(text.lines(result))
    assert said.count("Step: r = ") == 2 and said.count("Index   time") == 2


def test_the_page_has_what_is_measured_in_each_step():
    from emsim.outputs import html

    deck = RC + ".step param r list 1k 2k\n.meas tran half when v(out)=0.5\n.four 100k v(out)\n.end\n"
    run = html.document(emsim.run(deck))
    sheets = {name: inner for name, _, inner in run["sheets"]}
    assert (
        sheets["measures"].count("<tr>") == 2
        and "r = 2000" in sheets["measures"]
        and "<td>s</td>" in sheets["measures"]
    )
    assert sheets["harmonics"].count("THD") == 2
    assert "r" not in run["shown"] and len(run["blocks"]) == 1


def test_commands_run_every_step():
    found = emsim.run(RC + ".step param r list 1k 2k\n.control\nrun\n.endc\n.end\n")
    assert found.steps == [{"r": 1e3}, {"r": 2e3}] and found.main.steps == ["r"]


def test_the_command_tells_steps_and_measurements(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "d.cir").write_text(RC + ".step param r list 1k 2k\n.meas tran half when v(out)=0.5\n.end\n")
    assert main(["d.cir"]) == 0
    said = capsys.readouterr()
    assert "Step: r = 1000\nhalf" in said.out and "in 2 steps" in said.err
    assert main(["--json", "d.cir"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["steps"] == [{"r": 1e3}, {"r": 2e3}] and [m["step"] for m in told["measures"]] == [0, 1]


@needs_ngspice
def test_ngspice_loads_a_stepped_file(tmp_path):
    emsim.run(RC + ".step param r list 1k 2k\n.end\n").save(tmp_path / "x.raw")
    (tmp_path / "l.cir").write_text(
        "x\nr1 1 0 1\nv1 1 0 1\n.control\nload x.raw\nprint length(v(out))\n.endc\n.end\n"
    )
    said = subprocess.run(
        ["ngspice", "-b", "l.cir"], cwd=tmp_path, capture_output=True, text=True, timeout=60
    ).stdout
    assert "length(v(out)) = " in said


# ---- .four ----------------------------------------------------------------------------------------------


def test_harmonics_of_a_square_wave_are_those_of_its_series():
    deck = "t\nV1 a 0 PULSE(-1 1 0 1p 1p {0.5m-1p} 1m)\nR1 a 0 1\n.tran 10u 3m\n.four 1k v(a)\n.end\n"
    (one,) = emsim.run(deck).spectra
    for h in one.harmonics[1:]:
        assert h.magnitude == pytest.approx(4 / (math.pi * h.k) if h.k % 2 else 0.0, abs=1e-6)
    assert one.harmonics[1].phase == pytest.approx(0, abs=1e-4) and one.harmonics[
        0
    ].magnitude == pytest.approx(0, abs=1e-6)
    assert one.thd == pytest.approx(100 * math.sqrt(1 / 9 + 1 / 25 + 1 / 49 + 1 / 81), rel=1e-5)


def test_harmonics_are_known_of_the_methods_own_polynomials():
    deck = "t\nV1 a 0 SIN(0.5 2 1k 0 0 30)\nR1 a 0 1\nB1 b 0 V={v(a)^2}\nR2 b 0 1\n.tran 1m 5m\n.four 1k v(a) v(b)\n"
    a, b = emsim.run(deck + ".options reltol=1e-8\n.end\n").spectra
    assert (a.harmonics[0].magnitude, a.harmonics[1].magnitude) == (pytest.approx(0.5), pytest.approx(2))
    assert a.harmonics[1].phase == pytest.approx(30) and a.thd < 1e-5
    # (1/2 + 2 sin)^2 = 1/4 + 2 sin + 2 - 2 cos(2 ..)
    sizes = [h.magnitude for h in b.harmonics[:4]]
    assert sizes == pytest.approx([2.25, 2, 2, 0], abs=1e-5) and b.signal == "v(b)" and b.unit == "V"


def test_results_shorter_than_a_period_have_no_harmonics():
    result = emsim.run("t\nV1 a 0 SIN(0 1 1k)\nR1 a 0 1\n.tran 1u 0.5m\n.four 1k v(a)\n.end\n")
    assert not result.spectra and [d.code for d in result.diagnostics] == ["E430"]
    assert "a period of 1000 Hz" in result.diagnostics[0].message


@needs_ngspice
def test_harmonics_are_ngspices(tmp_path):
    deck = (
        "t\nV1 in 0 SIN(0 2 1k)\nR1 in out 1k\nD1 out 0 dd\nR2 out 0 10k\n.model dd d(is=1e-14)\n.tran 1u 10m 0 1u\n"
        ".four 1k v(out)\n.end\n"
    )
    (tmp_path / "d.cir").write_text(deck)
    said = subprocess.run(
        ["ngspice", "-b", "d.cir"], cwd=tmp_path, capture_output=True, text=True, timeout=60
    ).stdout
    theirs = [
        [float(w) for w in line.split()]
        for line in said.partition("Fourier analysis")[2].splitlines()
        if len(line.split()) == 6 and line.split()[0].isdigit()
    ]
    (ours,) = emsim.run(deck).spectra
    assert len(theirs) == len(ours.harmonics) == 10
    for h, (k, frequency, magnitude, phase, _, _) in zip(ours.harmonics, theirs, strict=True):
        assert (h.k, h.frequency) == (k, pytest.approx(frequency))
        assert h.magnitude == pytest.approx(magnitude, abs=1e-3)
        if k > 0 and magnitude > 0.05:
            assert h.phase == pytest.approx(phase, abs=0.3)

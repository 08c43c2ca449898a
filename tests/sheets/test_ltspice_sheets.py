"""LTspice's schematics: what is connected, in which order, under which turn; messages at the drawing's lines; its layout kept.

Where a pin comes to stand is written out here for each of the eight turns, apart from the reader's own rule.
"""

import subprocess
import sys

import numpy as np
import pytest
from support import needs_ngspice

import emsim
from emsim import pipeline
from emsim.schematic.picture import draw
from emsim.sheets.ltspice_symbols import standard

# x and y of a symbol's point in the drawing, by turn
TURNS = {
    "R0": lambda x, y: (x, y), "R90": lambda x, y: (-y, x), "R180": lambda x, y: (-x, -y), "R270": lambda x, y: (y, -x),
    "M0": lambda x, y: (-x, y), "M90": lambda x, y: (y, x), "M180": lambda x, y: (x, -y), "M270": lambda x, y: (-y, -x),
}  # fmt: skip
HEAD = "Version 4\nSHEET 1 880 680\n"
RC = (
    HEAD
    + """WIRE 96 96 32 96
WIRE 256 96 176 96
WIRE 256 128 256 96
WIRE 32 144 32 96
WIRE 32 256 32 224
WIRE 256 256 256 192
FLAG 32 256 0
FLAG 256 256 0
FLAG 256 96 out
SYMBOL res 192 80 R90
WINDOW 0 0 56 VBottom 2
WINDOW 3 32 56 VTop 2
SYMATTR InstName R1
SYMATTR Value 1k
SYMBOL cap 240 128 R0
SYMATTR InstName C1
SYMATTR Value 1\u00b5
SYMBOL voltage 32 128 R0
SYMATTR InstName V1
SYMATTR Value PULSE(0 1 0 1n 1n 5m 10m)
TEXT 32 320 Left 2 !.tran 4m
TEXT 32 360 Left 2 ;an RC low pass
"""
)


def cli(*args):
    """The program itself: exit code, stdout, stderr."""
    command = [sys.executable, "-m", "emsim", *args]
    return subprocess.run(command, capture_output=True, text=True, encoding="utf-8", timeout=300, check=False)


def written(tmp_path, text, name="a.asc", encoding="utf-8"):
    path = tmp_path / name
    path.write_text(text, encoding=encoding)
    return path


def line_of(words):
    return RC[: RC.index(words)].count("\n") + 1


def deck_of(path):
    return pipeline.load(str(path))


def cards(path):
    """Element cards by their names."""
    lines = deck_of(path).file.text.split("\n")[1:]
    return {line.split()[0]: line.split()[1:] for line in lines if line[:1].isalpha()}


@pytest.mark.parametrize("name", [n for n in standard() if n != "jumper"])
def test_every_standard_symbol_in_every_turn(tmp_path, name):
    """Each pin has a label that says which terminal it is."""
    symbol = standard()[name]
    letter = symbol.attributes["Prefix"][0]
    text = HEAD
    for k, (turn, place) in enumerate(TURNS.items()):
        x0, y0 = 1024 * k, 512
        for j, (_, x, y) in enumerate(symbol.pins):
            dx, dy = place(x, y)
            text += f"FLAG {x0 + dx} {y0 + dy} n{k}_{j}\n"
        text += f"SYMBOL {name} {x0} {y0} {turn}\nSYMATTR InstName {letter}{k}\nSYMATTR Value z{k}\n"
    found = cards(written(tmp_path, text))
    for k in range(len(TURNS)):
        nets = [f"n{k}_{j}" for j in range(len(symbol.pins))]
        nets += nets[2:3] if letter == "M" and len(nets) == 3 else []
        own = found[f"{letter}{k}"]
        assert own[: len(nets)] == nets, (name, k)
        assert f"z{k}" in own[len(nets) :]


def test_a_drawing_runs_as_its_closed_form(tmp_path):
    result = emsim.run(str(written(tmp_path, RC)), reltol=1e-6)
    t = result.time[result.time > 1e-6]
    assert np.allclose(np.interp(t, result.time, result["v(out)"]), 1 - np.exp(-t / 1e-3), atol=2e-5)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "utf-16-le", "latin-1", "utf-8-sig"])
def test_encodings_keep_micro(tmp_path, encoding):
    assert cards(written(tmp_path, RC, encoding=encoding))["C1"] == ["out", "0", "1u"]


def two(tmp_path, wires):
    """Nets of R1 from (0, 16) to (0, 96) and R2 from (160, 16) to (160, 96), with these lines."""
    text = HEAD + wires + "SYMBOL res -16 0 R0\nSYMATTR InstName R1\nSYMATTR Value 1\n"
    text += "SYMBOL res 144 0 R0\nSYMATTR InstName R2\nSYMATTR Value 1\n"
    found = cards(written(tmp_path, text))
    return found["R1"][:2], found["R2"][:2]


def test_the_end_of_a_wire_on_another_is_a_junction_and_a_crossing_is_none(tmp_path):
    a, b = two(tmp_path, "WIRE 0 16 160 16\n")
    assert a[0] == b[0] and a[1] != b[1]
    # a wire from R1's end to the middle of one at R2: a T
    a, b = two(tmp_path, "WIRE 0 16 80 16\nWIRE 80 0 80 96\nWIRE 160 96 80 96\n")
    assert a[0] == b[1]
    # the same lines across each other
    a, b = two(tmp_path, "WIRE 0 16 112 16\nWIRE 80 0 80 96\nWIRE 160 96 80 96\n")
    assert a[0] != b[1]
    # a wire that runs over a pin
    a, b = two(tmp_path, "WIRE -64 96 160 96\n")
    assert a[1] == b[1]
    # the same name in two places
    a, b = two(tmp_path, "FLAG 0 16 x\nFLAG 160 96 X\n")
    assert a[0] == b[1] == "x"


def test_nets_without_a_name_are_numbered_from_above_as_ltspice_does(tmp_path):
    a, b = two(tmp_path, "WIRE 160 16 160 0\nWIRE 0 112 0 96\nWIRE 160 112 160 96\n")
    assert (a, b) == (["N002", "N003"], ["N001", "N004"])


def test_two_names_on_one_net_are_told(tmp_path):
    path = written(tmp_path, RC.replace("FLAG 256 96 out", "FLAG 256 96 out\nFLAG 176 96 also"))
    (said,) = [d for d in deck_of(path).sink.diagnostics if d.code == "W155"]
    assert "out and also" in said.message and said.span.line == line_of("256 96 out") + 1


def test_messages_point_to_the_drawing(tmp_path):
    path = written(tmp_path, RC.replace("Value 1k", "Value 1k bad"))
    run = cli("check", str(path))
    assert run.returncode == 1
    assert (
        f"{path}:{line_of('Value 1k')}:18" in run.stdout + run.stderr
        and "SYMATTR Value 1k bad" in run.stdout + run.stderr
    )
    path = written(tmp_path, RC.replace(".tran 4m", ".tran 4m\\n.print tran v(nowhere)"))
    run = cli("check", str(path))
    assert f"{path}:{line_of('TEXT 32 320')}:45" in run.stdout + run.stderr


def test_what_a_symbol_lacks_is_told_by_name(tmp_path):
    path = written(tmp_path, RC + "SYMBOL PowerProducts\\LT3080 500 500 R0\nSYMATTR InstName U1\n")
    run = cli("check", str(path))
    assert (
        run.returncode == 1
        and "E156" in run.stderr
        and "LT3080" in run.stderr
        and f"{path}:{1 + RC.count(chr(10))}:8" in run.stderr
    )
    path = written(tmp_path, RC + "SYMBOL Digital\\and 500 500 R0\nSYMATTR InstName A1\n")
    assert "LTspice's own" in cli("check", str(path)).stderr
    path = written(tmp_path, RC.replace("WIRE 96 96 32 96", "WIRE 96 x 32 96"))
    run = cli("check", str(path))
    assert run.returncode == 1 and "E155" in run.stderr and f"{path}:3:1" in run.stderr


BLOCK = """Version 4
SymbolType BLOCK
RECTANGLE Normal -32 -32 32 32
PIN -32 0 LEFT 8
PINATTR PinName in
PINATTR SpiceOrder 1
PIN 32 0 RIGHT 8
PINATTR PinName out
PINATTR SpiceOrder 2
"""
HALF = (
    HEAD
    + """FLAG 16 16 in
FLAG 16 96 out
FLAG 96 176 0
WIRE 16 96 96 96
SYMBOL res 0 0 R0
SYMATTR InstName R1
SYMATTR Value 1k
SYMBOL res 80 80 R0
SYMATTR InstName R2
SYMATTR Value {r}
"""
)
ABOVE = (
    HEAD
    + """FLAG -32 0 a
FLAG 32 0 b
FLAG 200 96 0
FLAG 200 16 a
SYMBOL half 0 0 R0
SYMATTR InstName X1
SYMATTR Value r=3k
SYMBOL voltage 200 0 R0
SYMATTR InstName V1
SYMATTR Value 4
TEXT 0 300 Left 2 !.op
"""
)


def test_a_schematic_beside_its_symbol_is_a_subcircuit(tmp_path):
    written(tmp_path, BLOCK, "half.asy")
    written(tmp_path, HALF, "half.asc")
    path = written(tmp_path, ABOVE)
    assert emsim.run(str(path)).main["v(b)"][0] == pytest.approx(3.0)
    picture = draw(pipeline.read(str(path)), inside="xx1")
    assert {p["name"] for p in picture.data["parts"]} == {"xx1.r1", "xx1.r2"}
    assert {w["net"] for w in picture.data["wires"]} == {"b"}


def test_a_symbol_of_ones_own_brings_its_library(tmp_path):
    own = (
        BLOCK.replace("BLOCK", "CELL")
        + "SYMATTR Prefix X\nSYMATTR SpiceModel half.lib\nSYMATTR Value shown\nSYMATTR Value2 half\n"
    )
    written(tmp_path, own, "half.asy")
    written(tmp_path, ".subckt half p q\nR1 p q 1k\nR2 q 0 3k\n.ends\n", "half.lib")
    path = written(tmp_path, ABOVE.replace("SYMATTR Value r=3k\n", ""))
    assert emsim.run(str(path)).main["v(b)"][0] == pytest.approx(3.0)


def test_the_picture_stands_as_it_was_drawn(tmp_path):
    """Places of pins, differences in pixels, are those of the file times one factor, and every wire is there."""
    data = draw(pipeline.read(str(written(tmp_path, RC)))).data
    pins = {(p["name"], k): pin for p in data["parts"] for k, pin in enumerate(p["pins"])}
    file = {
        ("r1", 0): (176, 96),
        ("r1", 1): (96, 96),
        ("c1", 0): (256, 128),
        ("c1", 1): (256, 192),
        ("v1", 0): (32, 144),
        ("v1", 1): (32, 224),
    }
    x0, y0, _ = pins["v1", 0]
    for key, (x, y) in file.items():
        got = (pins[key][0] - x0, pins[key][1] - y0)
        assert got == pytest.approx(((x - 32) * 15 / 16, (y - 144) * 15 / 16), abs=0.11)
    assert pins["r1", 0][2] == "out" and pins["c1", 1][2] == "0"
    length = sum(
        abs(a[0] - b[0]) + abs(a[1] - b[1])
        for w in data["wires"]
        for a, b in zip(w["points"], w["points"][1:], strict=False)
    )
    assert length == pytest.approx((64 + 80 + 32 + 48 + 32 + 64) * 15 / 16, abs=0.6)
    assert any(words == "an RC low pass" for *_, words, net in data["names"])
    # the current from R1 on flows into C1
    wire = next(w for w in data["wires"] if w["net"] == "out")
    assert [data["parts"][p]["name"] for p, _, _ in wire["flow"]] in (["c1"], ["r1"])


def test_cards_of_machines_stand_in_a_drawing_as_directives(tmp_path):
    machine = "BODY arm shape=rod(0.3) m=0.2\\nJOINT hinge 0 arm pin\\nMOTOR m1 out 0 hinge kt=20m r=2 l=1m"
    path = written(tmp_path, RC.replace("Value 1k", "Value 1") + f"TEXT 32 400 Left 2 !{machine}\n")
    result = emsim.run(str(path))
    assert result["omega(hinge)"][-1] > 0
    i = result["i(m1)"]
    assert np.allclose(result["torque(m1)"] if "torque(m1)" in result.main else 0.02 * i, 0.02 * i, atol=1e-9)


@needs_ngspice
def test_convert_writes_a_deck_that_ngspice_reads(tmp_path):
    path = written(tmp_path, RC)
    run = cli("convert", str(path), str(tmp_path / "b.cir"))
    assert run.returncode == 0, run.stderr
    again = emsim.run(str(tmp_path / "b.cir"))
    assert again.at("v(out)", 1e-3) == pytest.approx(emsim.run(str(path)).at("v(out)", 1e-3), abs=1e-6)
    run = cli("compare", str(tmp_path / "b.cir"))
    assert run.returncode == 0, run.stdout + run.stderr


def test_a_schematic_is_not_included_nor_laid_out(tmp_path):
    path = written(tmp_path, RC)
    (tmp_path / "c.cir").write_text("title\n.include a.asc\nR9 a 0 1\n.op\n")
    run = cli("check", str(tmp_path / "c.cir"))
    assert run.returncode == 1 and "E157" in run.stderr and "c.cir:2:10" in run.stderr
    run = cli("fmt", str(path))
    assert run.returncode == 1 and "E157" in run.stderr and path.read_text(encoding="utf-8") == RC


def test_the_page_shows_the_drawing(tmp_path):
    run = cli("run", str(written(tmp_path, RC)), "--no-files", "--html", str(tmp_path / "p.html"))
    assert run.returncode == 0, run.stderr
    result = emsim.run(str(tmp_path / "a.asc"), scene=True)
    (picture,) = result.main.circuit.data["pictures"].values()
    assert {part["name"] for part in picture["parts"]} == {"r1", "c1", "v1"}
    assert any(words == "an RC low pass" for *_, words, _ in picture["names"])


def test_ltspices_own_folders_are_looked_through(tmp_path, monkeypatch):
    for folder in ("sym/Special", "sub", "cmp"):
        (tmp_path / "lib" / folder).mkdir(parents=True)
    own = (
        BLOCK.replace("BLOCK", "CELL")
        + "SYMATTR Prefix X\nSYMATTR SpiceModel half.lib\nSYMATTR Value2 half\n"
    )
    written(tmp_path, own, "lib/sym/Special/half.asy")
    written(tmp_path, ".subckt half p q\nR1 p q 1k\nR2 q 0 3k\n.ends\n", "lib/sub/half.lib")
    text = ".model bad D(n=1.2Is=1)\n.model 1N9999 D(is=1p\n+ n=1.5 mfg=any)\n"
    written(tmp_path, text, "lib/cmp/standard.dio", "utf-16")
    diode = (
        "SYMBOL diode 200 200 R0\nSYMATTR InstName D1\nSYMATTR Value 1N9999\nFLAG 216 200 b\nFLAG 216 264 0\n"
    )
    (tmp_path / "own").mkdir()
    drawing = (
        ABOVE.replace("SYMATTR Value r=3k\n", "").replace("SYMBOL half", "SYMBOL Special\\\\half") + diode
    )
    path = written(tmp_path / "own", drawing)
    assert "E156" in cli("check", str(path)).stderr
    monkeypatch.setenv("LTSPICE_LIB", str(tmp_path / "lib"))
    deck = deck_of(path)
    assert (
        "half.lib" in deck.file.text
        and ".model 1N9999 D(is=1p" in deck.file.text
        and ".model bad" not in deck.file.text
    )
    assert emsim.run(str(path)).main["v(b)"][0] < 1.0


def test_a_part_number_is_no_value(tmp_path):
    """4k7 is 4.7k where a value stands; 1N4148 is a name."""
    text = (
        RC.replace("Value 1k", "Value 4k7")
        + "SYMBOL diode 300 300 R0\nSYMATTR InstName D1\nSYMATTR Value 1N4148\n"
    )
    found = cards(written(tmp_path, text))
    assert found["R1"][-1] == "4.7k" and found["D1"][-1] == "1N4148"


def test_a_power_transistor_has_three_nodes_and_another_four(tmp_path):
    text = HEAD + "SYMBOL nmos 100 100 R0\nSYMATTR InstName M1\nSYMATTR Value P\n"
    text += "SYMBOL nmos 300 100 R0\nSYMATTR InstName M2\nSYMATTR Value Q\n"
    text += "TEXT 0 300 Left 2 !.model P VDMOS(kp=2)\\n.model Q NMOS(kp=1m)\n"
    found = cards(written(tmp_path, text))
    assert len(found["M1"]) == 4 and len(found["M2"]) == 5 and found["M2"][2] == found["M2"][3]


def test_lines_of_an_included_file_are_told_with_the_drawings_line(tmp_path):
    (tmp_path / "own.lib").write_text(".param a=\n")
    path = written(tmp_path, RC + "TEXT 32 500 Left 2 !.include own.lib\n")
    said = cli("check", str(path)).stderr
    assert "own.lib:1:" in said and f"included from {path}:{RC.count(chr(10)) + 1}" in said


def test_a_value_that_is_still_to_be_written_is_an_error_by_name(tmp_path):
    """ngspice takes a resistor without a value for 1 mOhm: a sheet that is not finished would run."""
    path = tmp_path / "a.asc"
    path.write_text(RC.replace("SYMATTR Value 1k", "SYMATTR Value"))
    with pytest.raises(emsim.DeckError, match="R1 has no value"):
        emsim.run(path)
    # its deck is written, and that it does not run is told at the place in the drawing
    run = cli("convert", str(path), str(tmp_path / "b.cir"))
    assert run.returncode == 1 and (tmp_path / "b.cir").exists()
    assert "R1 has no value" in run.stderr and "a.asc:" in run.stderr and "does not run" in run.stderr


def test_a_letter_in_place_of_the_dot(tmp_path):
    """LTspice reads 4k7 as 4.7k, SPICE as 4k: at 1/(2 pi 4.7k C) the gain is 1/sqrt(2)."""
    (tmp_path / "a.asc").write_text(RC)
    (tmp_path / "b.asc").write_text(RC.replace("SYMATTR Value 1k", "SYMATTR Value 4k7"))
    (tmp_path / "c.asc").write_text(RC.replace("SYMATTR Value 1k", "SYMATTR Value 4.7k"))
    a, b, c = (emsim.run(tmp_path / f"{name}.asc")["v(out)"] for name in "abc")
    assert np.array_equal(b, c) and not np.array_equal(a, c)

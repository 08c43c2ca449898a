"""KiCad's schematics: nets by wires, junctions, labels, power symbols; fields of symbols as cards; sheets below; the layout."""

import re
from pathlib import Path

import numpy as np
import pytest

import emsim
from emsim import pipeline
from emsim.cli import main
from emsim.schematic.picture import draw
from emsim.sheets.sexpr import Wrong, parse

# of the library: pins of a part that lies along y, 3.81 mm above and below its middle, and of a transistor
TWO = """(symbol "{name}" (pin_numbers hide) (property "Reference" "{ref}" (at 0 0 0))
  (symbol "{short}_0_1" (rectangle (start -1 -2.5) (end 1 2.5) (stroke (width 0.25)) (fill (type none))))
  (symbol "{short}_1_1" (pin passive line (at 0 3.81 270) (length 1.27) (name "~") (number "1"))
    (pin passive line (at 0 -3.81 90) (length 1.27) (name "~") (number "2"))))"""
POWER = """(symbol "power:{name}" (power) (property "Reference" "#PWR" (at 0 0 0)) (property "Value" "{name}" (at 0 0 0))
  (symbol "{name}_1_1" (pin power_in line (at 0 0 90) (length 0) (name "{name}") (number "1"))))"""
NPN = """(symbol "Q:NPN" (property "Reference" "Q" (at 0 0 0)) (symbol "NPN_1_1"
    (pin input line (at -5.08 0 0) (length 2) (name "B") (number "1"))
    (pin passive line (at 2.54 5.08 270) (length 2) (name "C") (number "2"))
    (pin passive line (at 2.54 -5.08 90) (length 2) (name "E") (number "3"))))"""
LIBRARY = "\n".join(
    [TWO.format(name=f"Device:{n}", short=n, ref=n) for n in ("R", "C", "V")]
    + [POWER.format(name=n) for n in ("GND", "VCC")]
    + [NPN]
)


def symbol(lib, ref, value, x, y, angle=0, more="", mirror=""):
    mirrored = f"(mirror {mirror})" if mirror else ""
    return (
        f'(symbol (lib_id "{lib}") (at {x} {y} {angle}) {mirrored} (unit 1) (uuid "u-{ref}")\n'
        f'  (property "Reference" "{ref}" (at {x + 2} {y} 0)) (property "Value" "{value}" (at {x + 2} {y + 2} 0))\n  {more})'
    )


def field(**fields):
    return " ".join(
        f'(property "{k.replace("_", ".", 1)}" "{v}" (at 0 0 0) (effects (font (size 1 1)) (hide yes)))'
        for k, v in fields.items()
    )


def wire(x0, y0, x1, y1):
    return f"(wire (pts (xy {x0} {y0}) (xy {x1} {y1})))"


def sheet(*items, version=20231120):
    body = "\n".join(items)
    return f'(kicad_sch (version {version}) (generator "eeschema") (uuid "root")\n(lib_symbols {LIBRARY})\n{body}\n)\n'


SOURCE = field(Sim_Device="V", Sim_Type="SIN", Sim_Params="dc=0 ampl=1 f=1k ac=1", Sim_Pins="1=+ 2=-")
# a source from (50, 50) down to ground, R along x, C down to ground
RC = (
    symbol("Device:V", "V1", "VSIN", 50, 53.81, more=SOURCE),
    symbol("power:GND", "#PWR1", "GND", 50, 57.62),
    wire(50, 50, 60, 50),
    symbol("Device:R", "R1", "1k", 63.81, 50, 90),
    wire(67.62, 50, 80, 50),
    symbol("Device:C", "C1", "100nF", 80, 53.81),
    symbol("power:GND", "#PWR2", "GND", 80, 57.62),
    '(label "out" (at 75 50 0) (effects (font (size 1.27 1.27))))',
    '(text ".ac dec 5 10 100k\\n.tran 10u 2m" (at 50 70 0))',
    '(text "an RC low pass" (at 50 80 0))',
)


@pytest.fixture
def written(tmp_path):
    def write(text, name="a.kicad_sch"):
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return str(path)

    return write


def cards(path):
    lines = pipeline.load(path).file.text.split("\n")[1:]
    return {line.split()[0]: line.split()[1:] for line in lines if line[:1].isalpha()}


def test_a_filter_runs_as_its_closed_form(written):
    result = emsim.run(written(sheet(*RC)))
    ac = result.table("ac")
    f = np.asarray(ac["frequency"]).real
    assert np.allclose(ac["v(/out)"], 1 / (1 + 2j * np.pi * f * 1e3 * 1e-7), rtol=1e-6)


@pytest.mark.parametrize("version", [20211123, 20230121, 20231120, 20250114])
def test_versions_6_to_9(written, version):
    assert cards(written(sheet(*RC, version=version)))["R1"][:2] == ["Net-1", "/out"]


TURNS = [
    (0, ""),
    (90, ""),
    (180, ""),
    (270, ""),
    (0, "x"),
    (0, "y"),
    (90, "x"),
    (90, "y"),
    (270, "x"),
    (270, "y"),
    (180, "x"),
]
# x to the right and y downwards of base, collector and emitter, by how the symbol stands
STAND = {
    (0, ""): ((-5.08, 0), (2.54, -5.08), (2.54, 5.08)), (90, ""): ((0, 5.08), (-5.08, -2.54), (5.08, -2.54)),
    (180, ""): ((5.08, 0), (-2.54, 5.08), (-2.54, -5.08)), (270, ""): ((0, -5.08), (5.08, 2.54), (-5.08, 2.54)),
    (0, "x"): ((-5.08, 0), (2.54, 5.08), (2.54, -5.08)), (0, "y"): ((5.08, 0), (-2.54, -5.08), (-2.54, 5.08)),
    (90, "x"): ((0, -5.08), (-5.08, 2.54), (5.08, 2.54)), (90, "y"): ((0, 5.08), (5.08, -2.54), (-5.08, -2.54)),
    (270, "x"): ((0, 5.08), (5.08, -2.54), (-5.08, -2.54)), (270, "y"): ((0, -5.08), (-5.08, 2.54), (5.08, 2.54)),
    (180, "x"): ((5.08, 0), (-2.54, -5.08), (-2.54, 5.08)),
}  # fmt: skip


@pytest.mark.parametrize(("angle", "mirror"), TURNS)
def test_a_transistor_in_every_turn(written, angle, mirror):
    model = field(Sim_Device="NPN", Sim_Type="GUMMELPOON", Sim_Pins="1=B 2=C 3=E", Sim_Params="bf=80")
    places = STAND[angle, mirror]
    labels = [
        f'(global_label "{n}" (shape input) (at {100 + x} {100 + y} 0))'
        for n, (x, y) in zip("bce", places, strict=True)
    ]
    found = cards(written(sheet(symbol("Q:NPN", "Q1", "any", 100, 100, angle, model, mirror), *labels)))
    assert found["Q1"] == ["c", "b", "e", "__Q1"]


def test_lines_connect_by_their_ends_and_by_junctions(written):
    parts = (symbol("Device:R", "R1", "1", 10, 13.81), symbol("Device:R", "R2", "1", 30, 13.81))
    tee = (wire(10, 10, 20, 10), wire(20, 0, 20, 20), wire(20, 20, 30, 20), wire(30, 20, 30, 17.62))
    deck = pipeline.load(written(sheet(*parts, *tee)))
    assert "R1 Net-2 " in deck.file.text and [d.code for d in deck.sink.diagnostics] == ["W155"]
    found = cards(written(sheet(*parts, *tee, "(junction (at 20 10))")))
    assert found["R1"][0] == found["R2"][1]
    # across each other
    crossing = (wire(10, 10, 25, 10), *tee[1:])
    found = cards(written(sheet(*parts, *crossing)))
    assert found["R1"][0] != found["R2"][1]


def test_labels_and_power_symbols_name_nets(written):
    parts = (symbol("Device:R", "R1", "1", 10, 13.81), symbol("Device:R", "R2", "1", 30, 13.81))
    same = ('(label "a" (at 10 10 0))', '(label "a" (at 30 17.62 0))')
    found = cards(written(sheet(*parts, *same)))
    assert found["R1"][0] == found["R2"][1] == "/a"
    # a local label and a global one of the same name are two nets
    other = ('(label "a" (at 10 10 0))', '(global_label "a" (shape input) (at 30 10 0))')
    found = cards(written(sheet(*parts, *other)))
    assert (found["R1"][0], found["R2"][0]) == ("/a", "a")
    rails = (symbol("power:VCC", "#PWR1", "VCC", 10, 10), symbol("power:VCC", "#PWR2", "VCC", 30, 17.62))
    found = cards(written(sheet(*parts, *rails)))
    assert found["R1"][0] == found["R2"][1] == "VCC"


OLD = "".join(
    f'(property "{k}" "{v}" (at 0 0 0))'
    for k, v in (("Spice_Primitive", "R"), ("Spice_Model", "3k"), ("Spice_Node_Sequence", "2 1"))
)
CASES = [
    ("R1", "4k7", "", "4.7k"),
    ("R1", "1M", "", "1Meg"),
    ("C1", "10u", "", "10u"),
    ("V1", "x", field(Sim_Device="V", Sim_Type="DC", Sim_Params="dc=5", Sim_Pins="1=+ 2=-"), "DC 5"),
    ("V1", "x", field(Sim_Device="V", Sim_Type="PULSE", Sim_Params="y1=0 y2=5 td=1m", Sim_Pins="1=- 2=+"), "PULSE(0 5 1m)"),
    ("V1", "x", field(Sim_Device="SPICE", Sim_Params=r"type=\"V\" model=\"dc(2)\" lib=\"\""), "dc 2"),
    ("R1", "x", OLD, "3k"),
    ("D1", "x", field(Sim_Device="D", Sim_Pins="1=K 2=A", Sim_Params="is=1p n=1.1"), "__D1"),
]  # fmt: skip


@pytest.mark.parametrize(("ref", "value", "fields", "rest"), CASES)
def test_fields_as_cards(written, ref, value, fields, rest):
    labels = (
        '(global_label "one" (shape input) (at 10 10 0))',
        '(global_label "two" (shape input) (at 10 17.62 0))',
    )
    found = cards(written(sheet(symbol("Device:R", ref, value, 10, 13.81, more=fields), *labels)))[ref]
    turned = "1=- 2=+" in fields or "1=K" in fields or "2 1" in fields
    assert found[:2] == (["two", "one"] if turned else ["one", "two"])
    assert " ".join(found[2:]) == rest


def test_a_subcircuit_by_the_order_of_its_library(written, tmp_path):
    (tmp_path / "half.lib").write_text(
        ".subckt half emitter base collector\nR1 base emitter 1k\nR2 base collector 3k\n.ends\n"
    )
    sub = field(Sim_Library="half.lib", Sim_Name="half", Sim_Pins="1=base 2=collector 3=emitter")
    labels = [
        f'(global_label "{n}" (shape input) (at {100 + x} {100 + y} 0))'
        for n, (x, y) in zip("bce", STAND[0, ""], strict=True)
    ]
    path = written(sheet(symbol("Q:NPN", "U1", "any", 100, 100, 0, sub), *labels))
    assert cards(path)["XU1"] == ["e", "b", "c", "half"]
    assert '.include "half.lib"' in pipeline.load(path).file.text


def test_what_has_no_model_is_told_and_connectors_are_left_out(written, capsys):
    path = written(
        sheet(*RC, symbol("Device:R", "U7", "LM358", 200, 200), symbol("Device:R", "J1", "Conn", 250, 200))
    )
    assert main(["check", path]) == 1
    said = capsys.readouterr().err
    assert (
        "E156" in said
        and "U7 (`LM358`) has no simulation model" in said
        and "left out, without a model: J1" in said
    )
    line = next(
        k
        for k, text in enumerate(Path(path).read_text(encoding="utf-8").split("\n"), 1)
        if '"U7"' in text and "Reference" in text
    )
    assert f"a.kicad_sch:{line}:" in said
    kept = written(sheet(*RC, symbol("Device:R", "U7", "LM358", 200, 200, more="(exclude_from_sim yes)")))
    assert main(["check", "-q", kept]) == 0


def uses(one, two):
    paths = f'(path "/root/s1" (reference "{one}") (unit 1)) (path "/root/s2" (reference "{two}") (unit 1))'
    return f'(instances (project "p" {paths}))'


BELOW = (
    '(hierarchical_label "in" (shape input) (at 10 10 0))',
    symbol("Device:R", "R?", "1k", 10, 13.81, more=uses("R1", "R2")),
    '(label "mid" (at 10 17.62 0))',
    symbol("Device:R", "R??", "2k", 10, 21.43, more=uses("R3", "R4")),
    symbol("power:GND", "#PWR9", "GND", 10, 25.24),
)


def box(uuid, name, x):
    return (
        f'(sheet (at {x} 40) (size 10 10) (uuid "{uuid}")\n'
        f'  (property "Sheetname" "{name}" (at 0 0 0)) (property "Sheetfile" "below.kicad_sch" (at 0 0 0))\n'
        f'  (pin "in" input (at {x} 45 180)))'
    )


def test_a_sheet_used_twice_has_parts_and_nets_of_its_own(written):
    written(sheet(*BELOW), "below.kicad_sch")
    ends = ('(label "a" (at 50 45 0))', '(label "b" (at 80 45 0))')
    path = written(sheet(box("s1", "one", 50), box("s2", "two", 80), *ends))
    found = cards(path)
    assert found == {
        "R1": ["/a", "/one/mid", "1k"],
        "R3": ["/one/mid", "0", "2k"],
        "R2": ["/b", "/two/mid", "1k"],
        "R4": ["/two/mid", "0", "2k"],
    }
    # both stand in the drawing, below the first sheet
    data = draw(pipeline.read(path)).data
    tops = {p["name"]: p["pins"][0][1] for p in data["parts"]}
    assert tops["r1"] < tops["r3"] < tops["r2"] < tops["r4"]


def test_the_picture_stands_as_it_was_drawn(written):
    data = draw(pipeline.read(written(sheet(*RC)))).data
    pins = {(p["name"], k): pin for p in data["parts"] for k, pin in enumerate(p["pins"])}
    x0, y0, _ = pins["v1", 0]
    for key, (x, y) in {
        ("r1", 0): (67.62, 50),
        ("r1", 1): (60, 50),
        ("c1", 0): (80, 50),
        ("c1", 1): (80, 57.62),
    }.items():
        # 10 pixels in 1.27 mm; R1 is turned, its first pin on the right
        found = (
            [(pins["r1", j][0] - x0, pins["r1", j][1] - y0) for j in (0, 1)]
            if key[0] == "r1"
            else [(pins[key][0] - x0, pins[key][1] - y0)]
        )
        assert any(f == pytest.approx(((x - 50) / 0.127, (y - 50) / 0.127), abs=0.11) for f in found)
    assert any(words == "an RC low pass" for *_, words, _ in data["names"])


def test_messages_point_to_the_schematic(written, capsys):
    path = written(sheet(*RC).replace('"1k"', '"1k bad"'))
    assert main(["check", path]) == 1
    said = capsys.readouterr().err
    where = re.search(r"a\.kicad_sch:(\d+):(\d+)", said)
    text = Path(path).read_text(encoding="utf-8").split("\n")[int(where[1]) - 1]
    assert "bad" in said and text[int(where[2]) - 1 :].startswith("bad")


def test_cards_of_machines_as_text(written):
    machine = "BODY arm shape=rod(0.3) m=0.2\\nJOINT hinge 0 arm pin\\nMOTOR m1 /out 0 hinge kt=20m r=2 l=1m"
    result = emsim.run(written(sheet(*RC, f'(text "{machine}" (at 50 90 0))')))
    assert "omega(hinge)" in result.table("tran")


@pytest.mark.parametrize(
    "text",
    [
        "(kicad_sch (version 1)",
        "(kicad_sch (version 1)))",
        "(kicad_sch (wire (pts (xy 1))))",
        "(kicad_sch " + "(" * 500,
    ],
)
def test_what_is_no_such_file_is_told(written, capsys, text):
    assert main(["check", written(text + "\n")]) == 1
    assert "E155" in capsys.readouterr().err


def test_lists_with_their_places():
    tree = parse('(a (b "x \\"y\\"\\n" 2)\n (c))')
    assert (
        tree.first("b").word(1) == 'x "y"\n'
        and tree.first("b").word(1).line == 1
        and tree.first("c").line == 2
    )
    with pytest.raises(Wrong):
        parse("(a")


def test_a_wire_without_points_is_told(written):
    with pytest.raises(emsim.DeckError, match=r"E155.*this `wire` of the schematic lacks"):
        emsim.run(written(sheet(*RC, "(wire (stroke (width 0)))")))

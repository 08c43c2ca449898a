"""Qucs-S' schematics: components with their ports under every turn, analyses and sweeps, equations, subcircuits, the layout."""

import numpy as np
import pytest

import emsim
from emsim import pipeline
from emsim.cli import main
from emsim.schematic.picture import draw
from emsim.sheets.qucs_parts import PARTS, value
from emsim.sheets.sheet import word


def sheet(components, wires="", symbol=""):
    return (
        f"<Qucs Schematic 24.4.0>\n<Properties>\n</Properties>\n<Symbol>\n{symbol}</Symbol>\n"
        f"<Components>\n{components}</Components>\n"
        f"<Wires>\n{wires}</Wires>\n<Diagrams>\n</Diagrams>\n<Paintings>\n"
        '  <Text 20 300 12 #000000 0 "an RC low pass">\n</Paintings>\n'
    )


PARTS_OF_RC = """  <Vac V1 1 40 100 18 -26 0 1 "1 V" 1 "1 kHz" 0 "0" 0 "0" 0 "0" 0 "0" 0>
  <GND * 1 40 130 0 0 0 0>
  <R R1 1 100 70 -26 15 0 0 "1 kOhm" 1 "26.85" 0 "0.0" 0 "0.0" 0 "26.85" 0 "european" 0>
  <C C1 1 160 100 17 -26 0 1 "100 nF" 1 "" 0 "neutral" 0>
  <GND * 1 160 130 0 0 0 0>
"""
WIRES_OF_RC = """  <40 70 70 70 "" 0 0 0 "">
  <130 70 160 70 "out" 150 40 10 "">
"""
AC = '  <.AC AC1 1 300 40 0 40 0 0 "log" 1 "100 Hz" 1 "100 kHz" 1 "31" 1 "no" 0>\n'
RC = sheet(PARTS_OF_RC + AC, WIRES_OF_RC)


@pytest.fixture
def written(tmp_path):
    def write(text, name="a.sch"):
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return str(path)

    return write


def lines(path):
    return pipeline.load(path).file.text.split("\n")[1:]


def test_a_filter_runs_as_its_closed_form(written):
    ac = emsim.run(written(RC)).table("ac")
    f = np.asarray(ac["frequency"]).real
    assert len(f) == 31
    assert np.allclose(ac["v(out)"], 1 / (1 + 2j * np.pi * f * 1e3 * 1e-7), rtol=1e-6)


# a place of a component by whether it is mirrored, top and bottom, and its quarters to the left
def stood(x, y, mirrored, turns):
    y = -y if mirrored else y
    return [(x, y), (y, -x), (-x, -y), (-y, x)][turns]


@pytest.mark.parametrize("kind", ["R", "Vdc", "_BJT", "VCVS", "OpAmp", "MOSFET", "JFET", "Relais", "S4Q_S"])
def test_ports_in_every_turn(written, kind):
    """Each port is named by a wire of no length; nets come in the order of the card whatever the turn."""
    cards = []
    for k, (mirrored, turns) in enumerate((m, t) for m in (0, 1) for t in range(4)):
        ports = [tuple(map(int, at.split(","))) for at in PARTS[kind][0].split()]
        wires = ""
        for j, (x, y) in enumerate(ports):
            dx, dy = stood(x, y, mirrored, turns)
            wires += f'  <{400 + dx} {400 + dy} {400 + dx} {400 + dy} "p{j}" 0 0 0 "">\n'
        given = ' "npn" 0' if kind == "_BJT" else ' "nfet" 0' if "FET" in kind else ' "1" 1'
        text = sheet(f"  <{kind} X{k} 1 400 400 0 0 {mirrored} {turns}{given}>\n", wires)
        (first, *_) = (line for line in lines(written(text)) if line[:1].isalpha())
        cards.append([w for w in first.replace(f"X{k}", "X").split() if w[:1] == "p" or "p" in w])
    assert len({tuple(c) for c in cards}) == 1 and cards[0]


def test_the_order_of_terminals(written):
    ports = {
        "_BJT": "p1 p0 p2",
        "MOSFET": "p1 p0 p2 p3",
        "JFET": "p1 p0 p2",
        "VCVS": "p1 p2 p0 p3",
        "VCCS": "p1 p2 p0 p3",
        "Diode": "p1 p0",
    }
    for kind, order in ports.items():
        places = [tuple(map(int, at.split(","))) for at in PARTS[kind][0].split()]
        wires = "".join(f'  <{x} {y} {x} {y} "p{j}" 0 0 0 "">\n' for j, (x, y) in enumerate(places))
        text = "\n".join(lines(written(sheet(f'  <{kind} X1 1 0 0 0 0 0 0 "npn" 0 "1" 0>\n', wires))))
        assert f"X1 {order} " in text, kind


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ("1 kOhm", "1k"),
        ("10 MHz", "10Meg"),
        ("1 Meg", "1Meg"),
        ("2 \u03bcF", "2u"),
        ("4k7", "4k7"),
        ("1.5 v", "1.5"),
        ("100 nF", "100n"),
        ("-5 V", "-5"),
        ("1e-3", "1e-3"),
        ("R1*2", "{R1*2}"),
        ("1K", "{1K}"),  # ngspice, which Qucs-S hands it to, has it as 1000
        ("3 mS", "3m"),
    ],
)
def test_values_with_units(given, said):
    assert value(word(given)) == said


@pytest.mark.parametrize(
    "ends", ['"0" 0 "10" 0 "3"', '"1" 0 "10" 0 "1e9"', '"a" 0 "10" 0 "3"', '"-1" 0 "10" 0 "3"']
)
def test_a_sweep_that_cannot_be_is_told(written, ends):
    sweep = f'  <.SW SW1 1 300 200 0 40 0 0 "AC1" 1 "log" 1 "C1" 1 {ends} 1>\n'
    with pytest.raises(emsim.DeckError, match=r"E155.*the sweep SW1 needs two numbers"):
        emsim.run(written(sheet(PARTS_OF_RC + AC + sweep, WIRES_OF_RC)))


@pytest.mark.parametrize(
    "said", ['"const" 1 "1" 1 "1k" 1 "10" 1', '"log" 1 "1" 1 "1k" 1 "n" 1', '"log" 1 "1" 1']
)
def test_an_analysis_without_its_numbers_is_told(written, said):
    with pytest.raises(emsim.DeckError, match=r"E155.*\.AC AC1 needs lin or log"):
        emsim.run(written(sheet(PARTS_OF_RC + f"  <.AC AC1 1 1 1 0 1 0 0 {said}>\n", WIRES_OF_RC)))


def test_sweeps_are_steps_and_dc(written):
    sweep = '  <.SW SW1 1 300 200 0 40 0 0 "AC1" 1 "list" 1 "C1" 1 "1" 0 "10" 0 "[10n; 20n]" 1>\n'
    result = emsim.run(written(sheet(PARTS_OF_RC + AC + sweep, WIRES_OF_RC)))
    assert len(result.steps) == 2
    parts = PARTS_OF_RC.replace("<Vac V1", "<Vdc V1").replace('"1 kHz" 0 "0" 0 "0" 0 "0" 0 "0" 0', "")
    dc = '  <.DC DC1 1 300 40 0 40 0 0 "26.85" 0>\n  <.SW SW1 1 300 200 0 40 0 0 "DC1" 1 "lin" 1 "V1" 1 "0" 1 "5 V" 1 "11" 1>\n'
    table = emsim.run(written(sheet(parts + dc, WIRES_OF_RC))).table("dc")
    assert len(table) == 11 and table["v(out)"][-1] == pytest.approx(5.0)


def test_equations_are_parameters_or_are_told(written, capsys):
    eqn = '  <Eqn Eqn1 1 300 40 -30 15 0 0 "rr=2*500" 1 "gain=dB(out.v)" 1 "yes" 0>\n'
    eqn += '  <NutmegEq Eqn2 1 300 90 -30 15 0 0 "ac" 1 "peak=mag(v(out))" 1>\n'
    path = written(sheet(PARTS_OF_RC.replace('"1 kOhm"', '"rr"') + AC + eqn, WIRES_OF_RC))
    assert main(["check", path]) == 0
    said = capsys.readouterr()
    assert "the equation gain reads results" in said.err and "a.sch:13:" in said.err
    assert "the equation peak reads results" in said.err and "a.sch:14:" in said.err
    f = emsim.run(path).table("ac")
    assert abs(f["v(out)"][0]) == pytest.approx(1 / abs(1 + 2j * np.pi * 100 * 1e3 * 1e-7), rel=1e-6)


BELOW = sheet(
    '  <Port P1 1 0 0 0 0 0 0 "1" 1 "analog" 0>\n  <R R1 1 30 0 0 0 0 0 "r" 1>\n'
    '  <R R2 1 90 0 0 0 0 0 "3k" 1>\n  <GND * 1 120 0 0 0 0 0>\n'
    '  <Port P2 1 60 0 0 0 0 0 "2" 1 "analog" 0>\n',
    symbol='  <.PortSym -30 0 1 0>\n  <.PortSym 30 0 2 180>\n  <.ID -20 14 SUB "1=r=2k=resistance=">\n',
)


def test_a_subcircuit_with_a_parameter(written):
    written(BELOW, "half.sch")
    for given, out in (("", 4 * 3 / 5), (' "1k" 1', 3.0)):
        sub = '  <Vdc V1 1 0 30 0 0 0 1 "4 V" 1>\n  <GND * 1 0 60 0 0 0 0>\n'
        sub += f'  <Sub S1 1 30 0 0 0 0 0 "half.sch" 0{given}>\n  <.DC DC1 1 0 300 0 0 0 0>\n'
        path = written(sheet(sub, '  <60 0 80 0 "b" 0 0 0 "">\n'))
        assert emsim.run(path).main["v(b)"][0] == pytest.approx(out)
    picture = draw(pipeline.read(path), inside="xs1").data
    assert {p["name"] for p in picture["parts"]} == {"xs1.r1", "xs1.r2"}


def test_an_ideal_transformer(written):
    parts = (
        '  <Vdc V1 1 0 30 0 0 0 1 "2 V" 1>\n  <GND * 1 0 60 0 0 0 0>\n'
        '  <Tr T1 1 30 30 0 0 0 0 "4" 1>\n  <GND * 1 60 60 0 0 0 0>\n'
        '  <R R1 1 60 90 0 0 0 1 "10" 1>\n  <.DC DC1 1 0 300 0 0 0 0>\n'
    )
    # ports of T1: primary (0, 0) and (0, 60), secondary (60, 0) and (60, 60)
    wires = '  <60 0 100 0 "s" 0 0 0 "">\n  <100 0 100 120 "" 0 0 0 "">\n  <60 120 100 120 "" 0 0 0 "">\n'
    main_ = emsim.run(written(sheet(parts, wires))).main
    assert main_["v(s)"][0] == pytest.approx(0.5)
    assert main_["i(v1)"][0] == pytest.approx(-0.05 / 4)


def test_what_has_no_card_is_told_by_name(written, capsys):
    path = written(
        sheet(PARTS_OF_RC + AC + '  <MLIN MS1 1 300 300 0 0 0 0 "Subst1" 1 "1 mm" 1>\n', WIRES_OF_RC)
    )
    assert main(["check", path]) == 1
    said = capsys.readouterr().err
    assert "E156" in said and "`MLIN` (MS1)" in said and "a.sch:13:9" in said
    path = written(RC.replace("<R R1 1 100 70", "<R R1 1 x 70"))
    assert main(["check", path]) == 1
    assert "E155" in capsys.readouterr().err


def test_the_picture_stands_as_it_was_drawn(written):
    data = draw(pipeline.read(written(RC))).data
    pins = {(p["name"], k): pin for p in data["parts"] for k, pin in enumerate(p["pins"])}
    x0, y0, _ = pins["v1", 0]
    file = {("r1", 0): (70, 70), ("r1", 1): (130, 70), ("c1", 0): (160, 130), ("c1", 1): (160, 70)}
    for key, (x, y) in file.items():
        assert (pins[key][0] - x0, pins[key][1] - y0) == pytest.approx((x - 40, y - 70), abs=0.11)
    assert any(words == "an RC low pass" for *_, words, _ in data["names"])


def test_cards_of_machines_in_a_script(written):
    machine = "BODY arm shape=rod(0.3) m=0.2\\nJOINT hinge 0 arm pin\\nMOTOR m1 out 0 hinge kt=20m r=2 l=1m\\n.tran 1m 0.1"
    path = written(
        sheet(PARTS_OF_RC + f'  <INCLSCR I1 1 300 40 0 0 0 0 "{machine}" 1 "" 0 "" 0>\n', WIRES_OF_RC)
    )
    assert "omega(hinge)" in emsim.run(path).table("tran")

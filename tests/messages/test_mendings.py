"""Slips of everyday decks: the message names the right thing, and what it carries to mend the deck makes it run.

slips/NAME.cir has one slip or two; the table says the codes, what the first message must say, and what a value of the mended run
must be. Each mending is applied as an editor applies it, `diagnostics.mended`.
"""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

import emsim
from emsim.diagnostics import Diagnostic, DiagnosticError, mended, to_json

SLIPS = Path(__file__).resolve().parent / "slips"
CORPUS = SLIPS.parent.parent / "ngspice" / "corpus"

# deck: codes, words of the first message and its hint, whether it can be mended by what it carries
TABLE: dict[str, tuple[str, str, bool]] = {
    # silent once
    "M_means_milli": ("W112", "milliohm, not 1 megohm 1Meg", True),
    "1F_cap": ("W112", "femtofarad, not 1 farad", True),
    "pulse_freq": ("W292", "0.01 s wide every 0.005 s `5m 10m`", True),
    "tran_order": ("W307", "step run `.tran 10u 5m`", True),
    "sine_with_a_comma": ("W113", "`1,5` two values 1.5", True),
    # numbers
    "comma": ("E110", "`4,7k` a decimal point is a dot 4.7k", True),
    "dc_with_a_comma": ("E110", "`4,7` a decimal point is a dot 4.7", True),
    "mass_with_a_comma": ("E231", "decimals have a dot", True),
    "unit_ohm_word": ("E110 E110", "`1 kOhm` right behind its number 1kOhm", True),
    "volts_apart": ("E110 E110", "`5 V` right behind its number 5V", True),
    "milliseconds_apart": ("E110", "`10 us` right behind its number", True),
    "cap_polarity_voltage": ("E110", "rating `10uF`", True),
    "motor_gear_ratio": ("E111", "{1/30}", True),
    "axis_deg": ("E232", "a vector, not an angle axis=(0,1)", True),
    # names and readings
    "der": ("E122", "`der` `ddt`", True),
    "dup_name": ("E135", "`r1` `R2`", True),
    "rpm_of_a_joint": ("E282", "`hinge` omega(hinge)", True),
    "energy_of_a_body": ("E291", "arm ke(arm)", True),
    "vel_of_a_body": ("E249", "arm is a body vx(arm)", True),
    "motor_body": ("E236", "arm is a body hangs on hinge", True),
    "jrotor": ("E231", "jrotor= j=", True),
    "e_with_a_delay": ("E307", "td= delay(v(b,0),0.1m)", True),
    # cards
    "tran_missing_dot": ("E105", "`tran` without its dot `.tran`", True),
    "print_without_its_dot": ("E105", "`print` without its dot", True),
    "model_without_its_dot": ("E140 E105", "no .model is called `dd`", True),
    "spring_nomark": ("E140 E230", "`slide`", True),
    "force_on_joint": ("E231", "FORCE f= rail is a joint cart dir=(1,0) 5", True),
    "inertia_only": ("E230 E231", "BODY w needs m= `m=0 j=1m`", True),
    "body_no_joint": ("E140 E231", "`slide`", False),  # E243 then: see below
    "joint_one_end": ("E233", "JOINT hinge one end `0 arm`", True),
    "mosfet_three": ("E109", "3 nodes d g s b `M1 d g 0 0 NM`", True),
    "sw_no_model": ("E109", "S1 names no model SW(", True),
    "sw_two_ctrl_missing": ("E109", "S1 two nodes `S1 in out g 0 sw`", True),
    "opamp_missing": ("E130", "lm358 LM358 `EU1 out 0 0 m 1e5`", True),
    "no_tran": ("N283", "no analysis .tran", True),
    "lt_steady": ("E113", "`steady` LTspice", False),  # its step of 0 is LTspice's too: E305 then
    "lt_A": ("E140", "`INV` LTspice v(in) > 0.5", False),
    # files of other programs
    "kicad": ("E128", "empty", False),  # a schematic is read; this one has nothing in it
    "gschem": ("E100", "gschem gnetlist", False),
    "xschem": ("E100", "xschem netlist", False),
    "eagle": ("E100", "Eagle KiCad", False),
    "mjcf": ("E100", "MuJoCo import model.xml", False),
    "urdf": ("E100", "URDF import robot.urdf", False),
    "modelica": ("E100", "Modelica BODY", False),
    # no slips
    "angle_body": ("", "", False),
    "rpm_joint": ("", "", False),
    "braces_missing": ("", "", False),
}


def text_of(name: str) -> str:
    return (SLIPS / f"{name}.cir").read_text(encoding="utf-8")


def ran(text: str) -> tuple[list[Diagnostic], emsim.Result | None]:
    """The diagnostics in the order of the text, and the result where there is one."""
    try:
        result = emsim.run(text)
    except DiagnosticError as error:
        found = error.diagnostics
        return sorted(found, key=lambda d: d.span.line if d.span else 0), None
    return result.diagnostics, result


def test_every_deck_has_its_row():
    assert sorted(path.stem for path in SLIPS.glob("*.cir")) == sorted(TABLE)


@pytest.mark.parametrize("name", TABLE)
def test_the_message_names_the_slip(name):
    codes, words, _ = TABLE[name]
    found, _ = ran(text_of(name))
    assert [d.code for d in found] == codes.split(), found
    if found:
        said = f"{found[0].message}\n{found[0].hint}"
        for word in words.split():
            assert word in said, said


@pytest.mark.parametrize("name", [name for name, row in TABLE.items() if row[2]])
def test_what_it_carries_mends_the_deck(name):
    text = text_of(name)
    found, _ = ran(text)
    for _ in range(3):  # one slip may hide another
        fixes = [d.fixes[0] for d in found if d.fixes]
        assert fixes, found
        text = mended(text, fixes)
        found, result = ran(text)
        if not found:
            break
    assert not found and result is not None, text
    assert len(result.plots[0]) > 0


@pytest.mark.parametrize(
    ("name", "column", "value"),
    [
        ("volts_apart", "i(v1)", -5e-3),  # 5 V over 1 k
        ("dc_with_a_comma", "v(a)", 4.7),
        ("sine_with_a_comma", "v(a)", 1.5 * math.sin(2 * math.pi * 0.1)),  # at 0.1 ms
        ("e_with_a_delay", "v(a)", 2 * math.sin(2 * math.pi * 0.8)),  # twice v(b) 0.1 ms before 0.9 ms
        ("mosfet_three", "v(d)", 12.0),
        ("opamp_missing", "v(out)", -10.0),  # -R2/R1, but for a gain of 1e5
    ],
)
def test_the_mended_deck_is_the_one_that_was_meant(name, column, value):
    found, _ = ran(text_of(name))
    text, ran_ = mended(text_of(name), [d.fixes[0] for d in found]), None
    ran_ = ran(text)[1]
    assert ran_ is not None
    at = {"sine_with_a_comma": 1e-4, "e_with_a_delay": 9e-4}.get(name)
    got = ran_[column][-1] if at is None else ran_.at(column, at)
    assert got == pytest.approx(value, rel=3e-4)


def test_what_is_left_of_a_deck_with_three_slips_names_the_third():
    text = text_of("body_no_joint")
    found, _ = ran(mended(text, [d.fixes[0] for d in ran(text)[0]]))
    assert [d.code for d in found] == ["E243"] and "body free can move" in found[0].message


def test_fixes_are_data():
    found, _ = ran(text_of("comma"))
    data = json.loads(json.dumps(to_json(found[0])))
    assert data["fixes"] == [
        {"span": {"file": "<text>", "line": 3, "col": 11, "end": 15}, "text": "4.7k", "label": "write `4.7k`"}
    ]


def test_ordinary_decks_have_no_such_slip():
    """None of the warnings about numbers in ngspice's corpus."""
    from emsim.editor.document import Document

    for path in CORPUS.glob("*.cir"):
        said = {d.code for d in Document(path.read_text(encoding="utf-8"), str(path)).diagnostics}
        assert not said & {"W112", "W113", "W292", "W307"}, path.name


@pytest.mark.parametrize(
    "line",
    [
        "R1 a b 1m",
        "R1 a b 1meg",
        "R1 a b 1MEG",
        "R1 a b 10mOhm",
        "R1 a b 1",
        "C1 a b 10f",
        "C1 a b 1uF",
        "C1 a b 1pF",
    ],
)
def test_small_values_are_meant(line):
    found, _ = ran(f"t\nV1 a 0 PULSE(0,1,0,1u,1u,1m,2m)\nR9 b 0 1k\n{line}\n.tran 10u 1m\n.end\n")
    assert not found


def test_mended_keeps_the_rest():
    from emsim.diagnostics import Fix, Span
    from emsim.source import SourceFile

    file = SourceFile("x", "abc\ndef\n")
    first, second, empty = Span(file, 1, 2, 3), Span(file, 2, 1, 4), Span(file, 1, 1, 1)
    assert mended(file.text, [Fix(second, "g"), Fix(first, "xx"), Fix(empty, "> ")]) == "> axxc\ng\n"

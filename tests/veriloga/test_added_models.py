"""Models that are added once: a text is checked, copied, and found by level and by name; what a run took is told."""

from __future__ import annotations

import os

import pytest

import emsim
from emsim.cli import main
from emsim.elements import public

# a square law whose polarity is told by its type, with its parameters in a file beside it
LAW = """`include "disciplines.vams"
`include "inc/values.inc"
module NAME(d, g, s, b);
  inout d, g, s, b;
  electrical d, g, s, b;
  `VALUES
  real v;
  analog begin
    v = type * V(g, s) - vt;
    I(d, s) <+ type * (v > 0 ? 0.5 * beta * w / l * v * v : 0);
  end
endmodule
"""
VALUES = """`define VALUES \\
  TYPE \\
  parameter real vt = 0.5; parameter real beta = 1m; \\
  (* type="instance" *) parameter real w = 1u; (* type="instance" *) parameter real l = 1u;
"""
PLAIN, BSIMCMG, ONE = (
    "parameter integer type = 1 from [-1:1] exclude 0;",
    "parameter integer devtype = 1 from [0:1]; parameter integer type = (devtype == 1 ? 1 : -1);",
    "localparam integer type = 1;",
)
DECK = """a pair by level
V1 a 0 1.5
V2 b 0 -1.5
M1 a a 0 0 n w=4u l=2u
M2 b b 0 0 p w=6u l=2u
.model n nmos level={level} vt=0.5
.model p pmos level={level} vt=0.6
.op
.end
"""


@pytest.fixture
def models(scratch, monkeypatch):
    """An empty folder for models, and a way to write a text of a name."""
    monkeypatch.setenv("EMSIM_MODELS", str(scratch / "models"))

    def write(module: str, kind: str = PLAIN, body: str = LAW) -> str:
        (scratch / "inc").mkdir(exist_ok=True)
        (scratch / "inc" / "values.inc").write_text(VALUES.replace("TYPE", kind))
        (scratch / f"{module}.va").write_text(body.replace("NAME", module))
        return f"{module}.va"

    return write


def errors(text: str) -> list[str]:
    with pytest.raises(emsim.DeckError) as wrong:
        emsim.run(text)
    return [f"{d.message} {d.hint or ''}" for d in wrong.value.diagnostics if d.severity == "error"]


@pytest.mark.parametrize(("kind", "level"), [(PLAIN, 69), (PLAIN, 103), (BSIMCMG, 103)])
def test_a_level_is_served_by_what_was_added_with_both_polarities(models, scratch, kind, level):
    assert main(["models", "add", models("psp103va", kind), "-q"]) == 0
    # nothing of where it came from is needed any more
    (scratch / "psp103va.va").unlink()
    (scratch / "inc" / "values.inc").unlink()
    result = emsim.run(DECK.format(level=level))
    assert result["i(v1)"] == pytest.approx(-0.5e-3 * 2 * 1.0, rel=1e-9)
    assert result["i(v2)"] == pytest.approx(0.5e-3 * 3 * 0.9**2, rel=1e-9)
    served = [d for d in result.diagnostics if d.code == "N286"]
    assert len(served) == 1 and "psp103va.va" in served[0].message and f"level {level}" in served[0].message


def test_list_name_subcircuit_and_remove(models, capsys):
    assert main(["models", "add", models("leaky")]) == 0
    assert main(["models"]) == 0
    assert "leaky" in capsys.readouterr().out
    by_name = "a\nV1 a 0 1.5\nN1 a a 0 0 m\n.model m LEAKY beta=2m\nX1 a a 0 0 leaky w=2u\n.op\n.end\n"
    assert emsim.run(by_name)["i(v1)"] == pytest.approx(-1e-3 - 1e-3, rel=1e-9)
    assert main(["models", "remove", "leaky", "-q"]) == 0
    assert "no subcircuit is called `leaky`" in errors(by_name)[0]
    assert "no module is called `leaky`" in errors(by_name.replace("X1", "*"))[0]
    assert main(["models", "remove", "leaky"]) == 2


def test_a_level_by_hand_and_levels_that_are_taken(models, capsys):
    assert main(["models", "add", models("own"), "--level", "333", "--of", "m", "-q"]) == 0
    assert emsim.run(DECK.format(level=333))["i(v1)"] == pytest.approx(-1e-3, rel=1e-9)
    # of which lines nobody can know
    assert main(["models", "add", models("own"), "--level", "333"]) == 2
    assert main(["models", "add", models("another"), "--level", "333", "--of", "m"]) == 0
    assert main(["models", "add", models("third"), "--level", "3", "--of", "m"]) == 0
    said = capsys.readouterr().out
    assert "level 333 is `own` already" in said and "level 3 is built in (mos3)" in said
    assert emsim.run(DECK.format(level=333))["i(v1)"] == pytest.approx(-1e-3, rel=1e-9)


def test_what_the_simulators_number_differently_is_told(models, capsys):
    assert main(["models", "add", models("ekv26_va")]) == 0
    assert "level 55 is ekv26_va (HSPICE) from now on, and elsewhere BSIM3SOI" in capsys.readouterr().out


def test_hdl_of_the_deck_and_built_in_names_go_first(models):
    assert main(["models", "add", models("psp103va"), "-q"]) == 0
    (text := models("psp103x"))
    result = emsim.run(DECK.format(level=69).replace("V1 a", f'.hdl "{os.path.abspath(text)}"\nV1 a', 1))
    assert [d for d in result.diagnostics if d.code == "N286"] == []


@pytest.mark.parametrize(
    ("line", "says"),
    [
        (
            ".model n nmos level=73",
            "level 73 is HiSIM_HV (ngspice and HSPICE), which is not among the devices here",
        ),
        (
            ".model n nmos level=55",
            "level 55 is EKV 2.6 (HSPICE), BSIM3SOI, fully depleted (ngspice and HSPICE)",
        ),
        (".model n nmos level=4321", "level 4321 is not known"),
        (".model n nsoi", "nsoi is BSIMSOI 4"),
        (".model n other", "no module is called `other`"),
    ],
)
def test_what_is_missing_is_named_with_the_command(models, line, says):
    if "55" in line:
        says = says.replace(" (ngspice and HSPICE)", " (ngspice)")
    letter = "N" if "other" in line else "M"
    (said,) = errors(f"a\nV1 a 0 1\n{letter}1 a a 0 0 n\n{line}\n.op\n.end\n")
    assert says in said and "emsim models add" in said


def test_a_level_of_a_public_diode_is_no_plain_diode(models):
    deck = "a\nV1 a 0 1m\nD1 a 0 d\n.model d d level=200\n.op\n.end\n"
    assert "level 200 is JUNCAP200" in errors(deck)[0]
    diode = (
        LAW.replace("(d, g, s, b)", "(d, s)").replace("d, g, s, b", "d, s").replace("V(g, s) - vt", "V(d, s)")
    )
    assert main(["models", "add", models("juncap200", body=diode), "-q"]) == 0
    assert emsim.run(deck)["i(v1)"] == pytest.approx(-0.5e-9, rel=1e-6)
    assert "level 201 is not known" in errors(deck.replace("200", "201"))[0]


def test_a_text_that_cannot_be_told_its_type_is_of_one_kind(models):
    assert main(["models", "add", models("asmhemt", ONE), "--level", "333", "-q"]) == 0
    (said,) = errors(DECK.format(level=333))
    assert "`asmhemt` has no parameter `type`: PMOS" in said


def test_what_a_text_does_not_take_is_told(models):
    assert main(["models", "add", models("psp103va"), "-q"]) == 0
    result = emsim.run(DECK.format(level=69).replace("w=4u", "w=4u ad=1p"))
    assert any(d.code == "W284" and "takes no ad=" in d.message for d in result.diagnostics)


def test_what_cannot_be_put_into_a_circuit_is_not_added(models, capsys, scratch):
    unread = LAW.replace("v = type", 'v = $simprobe("x", "y", 0) + type')
    assert main(["models", "add", models("psp103va", body=unread)]) == 1
    assert "$simprobe" in capsys.readouterr().err
    unfolded = LAW.replace("v = type", "v = absdelay(V(g), V(s)) + type")
    assert main(["models", "add", models("psp103va", body=unfolded)]) == 1
    assert "absdelay" in capsys.readouterr().err
    assert main(["models", "list"]) == 0
    assert capsys.readouterr().out == "" and list((scratch / "models").iterdir()) == []


def test_a_text_that_was_spoilt_is_an_error_not_another_model(models, scratch):
    assert main(["models", "add", models("psp103va"), "-q"]) == 0
    (scratch / "models" / "psp103va" / "psp103va.va").write_text("module psp103va(")
    said = errors(DECK.format(level=69))
    assert (
        said and "emsim models remove psp103va" in said[0] and not any("not among" in line for line in said)
    )


def test_nothing_of_others_is_taken_away(models, capsys, scratch):
    kept = scratch / "models" / "psp103va" / "letters.txt"
    kept.parent.mkdir(parents=True)
    kept.write_text("mine")
    assert main(["models", "add", models("psp103va")]) == 5
    assert "is no model" in capsys.readouterr().err and kept.read_text() == "mine"
    outside = LAW.replace("module NAME(", "module \\../../gone (")
    assert main(["models", "add", models("gone", body=outside)]) == 1
    assert not (scratch.parent / "gone").exists()
    assert [path.name for path in (scratch / "models").iterdir()] == ["psp103va"]


def test_the_table_has_each_module_once_and_each_level_a_place():
    for model in public.PUBLIC:
        assert set(model.levels) <= set(public.SPELLED)
        for head in model.heads:
            assert public.of_module(head + "_va") is not None
        for level in model.numbers():
            assert model in public.of_level(model.letter, level) and model.where(level)
    assert public.of_module("PSP103TVA").title == "PSP 103 with self-heating"
    assert public.of_module("PSP103VA").title == "PSP 103"


def test_tables_beside_a_text_come_along(models, scratch):
    """$table_model reads its points from the copy: the folder that it came from may go."""
    table = LAW.replace("0.5 * beta * w / l * v * v", '$table_model(v, "points/law.tbl", "1L")')
    path = models("tabled", body=table)
    (scratch / "points").mkdir()
    (scratch / "points" / "law.tbl").write_text("0 0\n1 3m\n")
    assert main(["models", "add", path, "-q", "--level", "77", "--of", "m"]) == 0
    (scratch / "points" / "law.tbl").unlink()
    deck = "t\nV1 d 0 2\nV2 g 0 1\nM1 d g 0 0 n w=1u l=1u\n.model n nmos level=77 vt=0.5\n.op\n.end\n"
    assert emsim.run(deck).op["i(v1)"][0] == pytest.approx(-1.5e-3)

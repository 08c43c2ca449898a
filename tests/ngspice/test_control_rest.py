"""What sections do beside the core: shapes, files, plots, definitions, devices shown; against what ngspice prints."""

from __future__ import annotations

import re

import pytest
from control_runs import agree, deck, here, there
from support import needs_ngspice

import emsim

pytestmark = [needs_ngspice, pytest.mark.ngspice]

RC = "V1 in 0 DC 1 AC 1\nR1 in out 1k\nR2 out 0 3k\nC1 out 0 1u"

SECTIONS = {
    "let counts where a vector was made": "let k = 1\nop\nlet k = k + 1\nop\nlet k = k + 1\nprint k\nsetplot const\nprint k",
    "let of another plot": "op\nlet a = 1\nop\nlet op1.a = 5\nprint op1.a",
    "commas of echo": "op\nlet z = 3\necho a,b\necho \"x =\", $&z\necho x , y\necho no. $&z',' R=$&z",
    "what is not known is false": "op\nif nothing = 3\necho yes\nelse\necho no\nend",
    "a plot of one's own": 'op\nset curplot = new\nset curplottitle = "mine"\nlet a = 3\nsetplot\nprint a',
    "a plot by a variable": "op\nset p = $curplot\nlet half = 0.5 * {$p}.v(out)\nprint half\nlet w = {op1}.v(in) + 1\nprint w",
    "capitals": "op\nlet Vs = V(OUT)\nprint Vs\nlet Ab = 2*VS\nprint AB",
    "reshape": "op\nlet a = vector(6)\nreshape a [2][3]\ndisplay\nprint a[1][2]\nreshape a [6]\nprint length(a)\nprint a",
    "compose values": "op\ncompose a values 1 2 5\nprint a length(a)",
    "compose steps": "op\ncompose a start=1 stop=3 step=0.5\nprint a",
    "compose count": "op\ncompose b start=0 stop=10 lin=5\nprint b",
    "compose log": "op\ncompose c start=1 stop=1000 log=4\nprint c",
    "cross": "op\ncompose a values 1 2 3\ncompose b values 4 5 6\ncross c 1 a b\nprint c",
    "diff of equal plots": "op\nop\ndiff op1 op2\necho done",
    "undefine": "define f(x) x*2\nprint f(3)\nundefine f\ndefine f(x) x*3\nprint f(3)",
    "linearize": "tran 10u 1m\nlinearize\nprint length(time) time[3]\nsetplot",
    "linearize on steps asked for": (
        "tran 10u 1m\nlet lin-tstart=100u\nlet lin-tstop=600u\nlet lin-tstep=100u\nlinearize v(out)\nprint time"
    ),
    "remcirc": "op\nprint v(out)\nremcirc\necho gone",
    "delete": "op\ndelete all\necho x",
    "setscale": "tran 10u 1m\nsetscale v(out)\necho ok",
    "showmod of no model": "op\nshowmod",
}


@pytest.mark.parametrize("name", SECTIONS)
def test_a_section_prints_what_ngspice_prints(name, tmp_path):
    agree(RC, SECTIONS[name], tmp_path)


@pytest.mark.parametrize("way", ["", "set filetype=ascii\n"])
def test_a_file_is_loaded_again(way, tmp_path):
    commands = f"{way}ac lin 3 10 1k\nwrite o.raw v(out)\ndestroy all\nload o.raw\nprint v(out)"
    text = deck(RC, commands)
    ours, theirs = here(text, tmp_path / "a")[0], there(text, tmp_path / "b")
    rows = [re.findall(r"^\d+\t.*$", said, re.M) for said in (ours, theirs)]
    assert len(rows[0]) == len(rows[1]) == 3
    for x, y in zip(*rows, strict=True):
        # (with the scale, or without it)
        numbers = [[float(w.rstrip(",")) for w in row.split()[-2:]] for row in (x, y)]
        assert numbers[0] == pytest.approx(numbers[1], rel=1e-4)


def test_what_two_plots_differ_in(tmp_path):
    """In whatever order."""
    text = deck(RC, "op\nalter v1 dc=2\nop\ndiff op1 op2")
    ours, theirs = here(text, tmp_path / "a")[0], there(text, tmp_path / "b")
    told = [sorted(re.findall(r"op1\.(\S+) = (\S+)\s+op2\.\S+ = (\S+)", said)) for said in (ours, theirs)]
    assert told[0] == told[1] and len(told[0]) == 3


def test_commands_of_another_file(tmp_path):
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "more.inc").write_text(
            "* commands\n.control\nlet q = 2*v(out)\nprint q\n.endc\n"
        )
    text = deck(RC, "op\nsource more.inc")
    assert "q = 1.500000e+00" in here(text, tmp_path / "a")[0]
    assert "q = 1.500000e+00" in there(text, tmp_path / "b")


def shown(text: str) -> dict[str, float]:
    return {k: float(v) for k, v in re.findall(r"^\s*(\w+)\s+(-?[\d.]+(?:e[-+]?\d+)?)$", text, re.M)}


@pytest.mark.parametrize(
    ("body", "command", "names"),
    [
        (RC, "show r1", {"resistance", "i", "p"}),
        (RC, "show v1", {"dc", "acmag", "i"}),
        (RC, "show c1", {"capacitance"}),
        ("V1 a 0 1\nD1 a 0 dm\n.model dm d(is=1e-12 n=1.2 rs=2)", "showmod", {"is", "n", "rs"}),
        ("V1 a 0 1\nQ1 a a 0 qm\n.model qm npn(bf=50 is=1e-15)", "showmod", {"bf", "is"}),
    ],
)
def test_numbers_that_are_shown(body, command, names, tmp_path):
    text = deck(body, f"op\n{command}")
    ours, theirs = shown(here(text, tmp_path / "a")[0]), shown(there(text, tmp_path / "b"))
    assert names <= set(ours) and names <= set(theirs)
    for name in names:
        assert ours[name] == pytest.approx(theirs[name], rel=1e-4)


def test_counters_are_told(tmp_path):
    ours = here(deck(RC, "tran 10u 1m\nrusage all"), tmp_path)[0]
    assert "Total analysis time" in ours and "steps = " in ours


def test_a_section_needs_no_circuit(tmp_path):
    text = (
        "only commands\n.control\nlet k = 0\nwhile k < 3\necho index $&k\nlet k = k + 1\nend\n.endc\n.end\n"
    )
    assert here(text, tmp_path / "a")[0].split("\n")[:3] == ["index 0", "index 1", "index 2"]
    assert "index 2" in there(text, tmp_path / "b")


STATED = """V1 1 0 dc 5 ac 2
R1 1 2 rm l=20u w=5u
R2 2 0 1k m=2 temp=50 tc1=0.01
C1 2 0 1u m=3
C2 2 0 cm l=20u w=10u
L1 2 3 1u m=2
R3 3 0 1
.model rm r rsh=100 narrow=1u
.model cm c cj=1m"""


@pytest.mark.parametrize(
    "word",
    ["@v1[dc]", "@v1[acmag]", "@r1[resistance]", "@r2[resistance]", "@c1[capacitance]", "@c2[capacitance]", "@l1[inductance]"],
)  # fmt: skip
def test_values_that_lines_and_models_state(word, tmp_path):
    agree(STATED, f"op\nprint {word}", tmp_path)


def test_stated_values_are_saved_beside_the_rest(tmp_path):
    body = STATED + "\n.save v(2) @v1[dc] @r1[resistance] @c1[capacitance] @r2[i]"
    agree(body, "op\nprint @v1[dc] @r1[resistance] @c1[capacitance] @r2[i]", tmp_path)
    found = emsim.run(f"t\n{body}\n.tran 1u 10u\n.end\n")
    assert list(found["@r1[resistance]"]) == pytest.approx([2000 / 3] * len(found.time))
    assert set(found["@v1[dc]"]) == {5.0}


def test_parameters_that_commands_read(tmp_path):
    body = ".param r = 2k\n.csparam start = {2*r}\n.csparam r = r\nV1 a 0 1\nR1 a b {r}\nR2 b 0 1k"
    agree(body, "op\nprint start r\nlet n = start/r\nprint n", tmp_path)


def test_a_device_stands_for_its_model(tmp_path):
    agree(
        "V1 a 0 1\nR1 a b rm\nR2 b 0 1k\n.model rm r(r=1k)",
        "op\nprint v(b)\naltermod r1 r = 3k\nop\nprint v(b)",
        tmp_path,
    )


PMOS = """V1 s 0 3
M1 d g s s pm w=10u l=1u
Vg g 0 0
R1 d 0 1k
J1 e 0 s jp
R2 e 0 100
.model pm pmos(vto=-1 kp=50u)
.model jp pjf(vto=-2 beta=1m)"""


def test_currents_of_p_channels_have_ngspice_s_sign(tmp_path):
    agree(PMOS, "op\nprint @m1[id] @m1[is] @m1[vgs] @j1[id]", tmp_path)


def test_powers_and_voltages_of_elements(tmp_path):
    body = "V1 a 0 5\nR1 a b 1k\nL1 b c 1m\nR2 c 0 1k\nI1 0 c 1m\nE1 e 0 c 0 2\nR3 e 0 1k\nG1 0 f c 0 1m\nR4 f 0 1k"
    agree(body, "op\n" + "\n".join(f"print @{e}[p]" for e in ("v1", "r1", "l1", "i1", "e1", "g1")), tmp_path)


def test_elements_inside_subcircuits_by_ngspice_s_names(tmp_path):
    body = ".subckt s a b\nV1 a x 0\nR1 x b 1k\n.ends\nV1 in 0 1\nX1 in out s\nR2 out 0 1k"
    agree(body, "op\nprint i(v.x1.v1) v.x1.v1#branch @r.x1.r1[i]", tmp_path)
    table = emsim.run(f"t\n{body}\n.op\n.end\n").op
    assert table["i(v.x1.v1)"] == table["i(x1.v1)"]


SWING = "V1 in 0 PULSE(0 1 10u 0.1u 0.1u 200u 500u)\nR1 in a 50\nL1 a b 1m\nC1 b 0 10n\nR2 b 0 2k"


@pytest.mark.parametrize(
    "commands",
    [
        "meas tran top max v(b)\nmeas tran at when v(b)=top",
        "let half = 0.5\nmeas tran t1 when v(b)=half rise=1\nmeas tran d trig v(b) val=0.1 rise=1 targ v(b) val=half rise=1",
    ],
)
def test_measurements_read_vectors(commands, tmp_path):
    body = f"{SWING}\n.options reltol=1e-6"
    text = deck(body, f"tran 0.1u 100u 0 0.05u\n{commands}")
    found = [
        dict(re.findall(r"^(\w+)\s+=\s+(\S+)", said, re.M))
        for said in (here(text, tmp_path / "a")[0], there(text, tmp_path / "b"))
    ]
    assert found[0].keys() == found[1].keys() != set()
    for name, value in found[0].items():
        assert float(value) == pytest.approx(float(found[1][name]), rel=1e-3)


def test_phases_in_degrees(tmp_path):
    agree(
        RC,
        "set units=degrees\nac dec 200 10 10k\nmeas ac p find vp(out) at=100\nprint p",
        tmp_path,
        within=1e-2,
    )


def test_harmonics_say_what_has_no_effect():
    text = deck("V1 a 0 SIN(0 1 1k)\nR1 a 0 1", "set fourgridsize=100\ntran 10u 2m\nfourier 1k v(a)")
    told = [d.message for d in emsim.run(text).diagnostics]
    assert any("fourgridsize" in m for m in told)


def test_the_folder_of_the_deck_is_known(tmp_path):
    (tmp_path / "deck.cir").write_text(deck(RC, "op\necho $inputdir"))
    said = emsim.run(str(tmp_path / "deck.cir"))
    assert str(tmp_path) in said.output


def test_a_model_may_state_what_stands_on_lines(tmp_path):
    agree("V1 in 0 1\nR1 in out 1k\nR2 out 0 m\n.model m r(resistance=3k)", "op\nprint v(out)", tmp_path)


@pytest.mark.parametrize("command", ["print v(in) , v(in)", "let z = v(in),1"])
def test_what_cannot_be_read_is_told_without_the_form_of_an_element(command):
    """`v(in)` and `z = ..` are no lines of elements V and Z."""
    told = [
        d
        for d in emsim.run(deck("V1 in 0 1\nR1 in 0 1", f"op\n{command}")).diagnostics
        if d.severity == "error"
    ]
    assert [(d.code, d.hint) for d in told] == [("E102", None)]

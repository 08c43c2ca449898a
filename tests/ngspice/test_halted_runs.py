"""Transients that are halted by `stop`, altered and resumed: closed forms, the run in one piece, and what ngspice prints."""

from __future__ import annotations

import math

import numpy as np
import pytest
from control_runs import agree, deck, here
from support import needs_ngspice

import emsim
from emsim.diagnostics import DeckError

RC = "V1 in 0 1\nR1 in out 1k\nC1 out 0 1u"
METHODS = ["auto", "trap", "gear", "radau", "trbdf2", "esdirk", "dop853", "gauss4"]
TIGHT = ".options reltol=1e-8 method="


def run(body: str, commands: str) -> emsim.Result:
    return emsim.run(deck(body, commands))


@pytest.mark.parametrize("method", METHODS)
def test_an_altered_resistor_acts_from_the_halt_on(method):
    r = run(RC + f"\n{TIGHT}{method}", "stop when time = 1m\ntran 10u 5m uic\nalter r1 = 500\nresume")
    t, v = r.time, r["v(out)"]
    assert t[-1] == pytest.approx(5e-3) and np.all(np.diff(t) > 0)
    left = 1 - math.exp(-1)
    before, after = t <= 1e-3, t > 1e-3
    np.testing.assert_allclose(
        v[before], 1 - np.exp(-t[before] / 1e-3), atol=2e-5 if method == "trap" else 1e-6
    )
    np.testing.assert_allclose(
        v[after], 1 - (1 - left) * np.exp(-(t[after] - 1e-3) / 5e-4), atol=2e-5 if method == "trap" else 1e-6
    )


def test_an_altered_capacitor_keeps_its_charge():
    r = run(RC + f"\n{TIGHT}radau", "stop when time = 1m\ntran 10u 5m uic\nalter c1 = 2u\nresume")
    t, v = r.time, r["v(out)"]
    after, left = t > 1e-3, 0.5 * (1 - math.exp(-1))
    np.testing.assert_allclose(v[after], 1 - (1 - left) * np.exp(-(t[after] - 1e-3) / 2e-3), atol=1e-6)
    assert r.at("v(out)", 1.001e-3) == pytest.approx(left, abs=1e-3)  # at once, not with the next row


@pytest.mark.parametrize(
    "relation", ["v(out) > 0.9", "out ge 0.9", "0.9 < v(out)", "v(out) = 0.9", "v(in)*0.9 <= v(out)"]
)
def test_it_is_halted_where_a_condition_comes(relation):
    r = run(RC + f"\n{TIGHT}radau", f"stop when {relation}\ntran 10u 5m uic")
    assert r.time[-1] == pytest.approx(-1e-3 * math.log(0.1), rel=1e-6)
    assert r["v(out)"][-1] == pytest.approx(0.9, rel=1e-6)


def test_of_two_conditions_in_one_line_both_must_hold():
    r = run(RC + f"\n{TIGHT}radau", "stop when v(out) > 0.5 when time > 2m\ntran 10u 5m uic")
    assert r.time[-1] == pytest.approx(2e-3, rel=1e-9)


def test_a_condition_that_holds_at_the_start_halts_there():
    r = run(RC, "stop when v(in) > 0.5\ntran 10u 5m uic\nlet rows = length(time)\nprint rows")
    assert "rows = 1.000000e+00" in r.output


def test_steps_are_those_of_the_print_grid():
    r = run(
        RC, "stop when time = 1m\ntran 10u 5m uic\nstep\nstep 3\nlet last = time[length(time)-1]\nprint last"
    )
    assert "last = 1.040000e-03" in r.output


CIRCUITS = {
    "pulses": "V1 in 0 pulse(0 5 1m 1n 1n 1m 2m)\nD1 in a dm\nR1 a out 100\nC1 out 0 10u\nR2 out 0 1k\n.model dm d(cjo=1n)",
    "coil": "V1 in 0 sin(0 1 1k)\nR1 in a 10\nL1 a out 10m\nC1 out 0 1u\nR2 out 0 200",
    "switch": "V1 in 0 sin(0 2 500)\nS1 in out in 0 sm\nR1 out 0 1k\nC1 out 0 1u\n.model sm sw(vt=1 vh=0.2 ron=10)",
    "transistor": "V1 c 0 10\nV2 b 0 sin(0.7 0.02 1k)\nRc c o 1k\nQ1 o b 0 qm\nC1 o 0 100n\n.model qm npn(cje=5p cjc=3p tf=1n)",
}


@pytest.mark.parametrize("name", CIRCUITS)
@pytest.mark.parametrize("at", ["1m", "1.2345m", "3m"])
def test_in_two_pieces_it_is_the_run_in_one(name, at):
    body = CIRCUITS[name] + "\n.options reltol=1e-7"
    whole = run(body, "tran 10u 6m")
    parts = run(body, f"stop when time = {at}\ntran 10u 6m\ndelete all\nresume")
    signal = "v(o)" if name == "transistor" else "v(out)"
    size = np.ptp(whole[signal])
    assert parts.time[-1] == pytest.approx(6e-3)
    for t in np.linspace(0.05e-3, 5.95e-3, 40):
        assert parts.at(signal, t) == pytest.approx(whole.at(signal, t), abs=2e-4 * size)


PENDULUM = """.gravity 9.81
BODY  arm   shape=rod(0.6) m=0.5
JOINT hinge 0 arm pin zero=-90deg ic=90deg damp=10m
MOTOR gen   a 0 hinge kt=0.3 r=1
Rload a 0   2
.options reltol=1e-8"""


def test_a_machine_goes_on_as_it_moved():
    whole = run(PENDULUM, "tran 10m 3")
    parts = run(
        PENDULUM, "stop when angle(hinge) < 0\nstop when time = 2\ntran 10m 3\nlet first = time[length(time)-1]\n"
        "print first\nresume\nresume\nresume"
    )  # fmt: skip
    first = float(parts.output.split("first = ")[1].split()[0])
    assert whole.at("angle(hinge)", first) == pytest.approx(0.0, abs=1e-5)
    assert whole.at("omega(hinge)", first) < -1.0
    for t in np.linspace(0.1, 2.9, 40):
        assert parts.at("angle(hinge)", t) == pytest.approx(whole.at("angle(hinge)", t), abs=1e-4)


SAID = {
    "status": (
        "stop when v(out) > 0.5 when time > 1m\nstop when v(out) gt v(in)\nstop when time = 2m\nstatus\ndelete 2\nstatus\n"
        "delete\nstatus\ndelete all\necho none\nstatus"
    ),
    "at a time": "stop when time = 1m\ntran 10u 5m uic\nprint time[length(time)-1] v(out)[length(time)-1]",
    "altered": (
        "stop when time = 1m\ntran 10u 5m uic\nalter r1 = 500\ndelete all\nresume\n"
        "print time[length(time)-1] v(out)[length(time)-1]"
    ),
    "charge": (
        "stop when time = 1m\ntran 1u 5m uic\nalter c1 = 2u\ndelete all\nresume\nmeas tran v find v(out) at=2m"
    ),
    "two runs": (
        "stop when time = 2m\ntran 10u 5m uic\ntran 10u 3m uic\nprint time[length(time)-1]\nresume\n"
        "print time[length(time)-1]\nsetplot"
    ),
    "nothing goes on": "tran 10u 1m uic\nresume\nprint time[length(time)-1]",
}


@needs_ngspice
@pytest.mark.ngspice
@pytest.mark.parametrize("name", SAID)
def test_a_section_prints_what_ngspice_prints(name, tmp_path):
    agree(RC, SAID[name], tmp_path, within=3e-3)


@pytest.mark.parametrize(
    ("body", "commands", "said"),
    [
        (RC, "stop", "condition"),
        (RC, "stop foo", "condition"),
        (RC, "stop after 4", "points"),
        (RC, "stop when v(out)", "relation"),
        (RC, "stop when v(out) <> 1", "nearly always"),
        (RC, "stop when @r1[i] > 1", "@r1[i]"),
        (RC + "\n.step param a 1 2 1\n.param a=1", "stop when time = 1m\ntran 10u 2m", ".step"),
        ("V1 a 0 1\nT1 a 0 b 0 z0=50 td=1n\nR1 b 0 50", "stop when time = 5n\ntran 1n 10n", "lines"),
    ],
)
def test_what_it_cannot_do_is_told(body, commands, said, tmp_path):
    try:
        found = run(body, commands).diagnostics
    except DeckError as error:
        found = error.diagnostics
    told = [d for d in found if d.severity == "error"]
    assert told and told[0].code in ("E161", "E163") and said in told[0].message


def test_a_node_that_is_not_there_is_told():
    with pytest.raises(DeckError):
        run(RC, "stop when v(nowhere) > 1\ntran 10u 1m")


def test_the_note_says_where_it_stands(tmp_path):
    _, done = here(deck(RC, "stop when time = 1m\ntran 10u 2m uic"), tmp_path)
    assert done.returncode == 0
    result = run(RC, "stop when time = 1m\ntran 10u 2m uic")
    assert any("stands at time = 0.001" in d.message for d in result.diagnostics)


FAMILY = "x\nV1 in 0 SIN(0 1 1k) AC 1\nR1 in out {r}\nC1 out 0 1u\n.param r=1k\n.step param r list 1k 2k\n"


def test_a_family_takes_real_numbers_beside_complex_ones() -> None:
    r = emsim.run(FAMILY + ".control\nac lin 5 1 1k\nlet out = mag(v(out))\nlet c = v1#branch\n.endc\n.end\n")
    table = r.plots[-1]
    assert all(len(table[name]) == len(table) == 10 for name in table.names)
    late = table["v(out)"][5:]  # of the last value, which the command made real
    w = 2e-3 * np.pi * 2e3 * 1e-3 * np.real(table["frequency"][5:])
    assert np.abs(late - 1.0 / np.sqrt(1.0 + w**2)).max() < 1e-9


def test_what_halts_no_runs_of_step_is_said_once_at_the_end_too() -> None:
    with pytest.raises(emsim.DeckError) as refused:
        emsim.run(FAMILY + ".tran 50u 1m\n.control\nstop when time > 0.5m\n.endc\n.end\n")
    assert [d.code for d in refused.value.diagnostics if d.severity == "error"] == ["E163"]

"""The library's parts (emsim/lib), each in the deck of `emsim new` that shows it: what they do, in figures."""

from __future__ import annotations

from math import pi, radians
from pathlib import Path

import numpy as np
import pytest

import emsim
from emsim.cli.new import FOLDER
from emsim.diagnostics import OutsideError
from emsim.elaborate.files import LIBRARY


def shown(name: str, options: str = "reltol=1e-6") -> emsim.Result:
    with open(f"{FOLDER}/{name}.cir", encoding="utf-8") as file:
        return emsim.run(file.read().replace(".end\n", f".options {options}\n.end\n"))


def test_a_bare_name_means_the_library_and_a_file_beside_the_deck_wins(tmp_path) -> None:
    deck = "mine\n.include voicecoil.lib\nBODY m m=1\nJOINT j 0 m slide\nVa a 0 1\nX1 a 0 j voicecoil\n.tran 1m 2m\n.end\n"
    path = tmp_path / "deck.cir"
    path.write_text(deck, encoding="utf-8")
    assert "i(x1.coil)" in emsim.run(path).names
    (tmp_path / "voicecoil.lib").write_text(
        ".subckt voicecoil a b joint\nRx a b 1\nDAMPER d joint c=1\n.ends\n", encoding="utf-8"
    )
    assert "i(x1.coil)" not in emsim.run(path).names


def test_a_misspelt_part_is_named() -> None:
    with pytest.raises(OutsideError) as error:
        emsim.compile("a\n.include servro.lib\nR1 a 0 1\n.op\n.end\n")
    assert "servo.lib" in (error.value.diagnostics[0].hint or "")


def test_every_file_of_the_library_is_shown() -> None:
    parts = {path.name for path in Path(LIBRARY).glob("*.lib")}
    text = "\n".join(path.read_text(encoding="utf-8") for path in Path(FOLDER).glob("*.cir"))
    assert parts and all(f".include {part}" in text for part in parts)


def test_the_servo_goes_where_it_is_told() -> None:
    found = shown("servo")
    # 5 V of 6 ask for +60 degrees; what is missing is the weight of the arm over the stiffness of the control
    assert found.at("angle(hinge)", 0.7) == pytest.approx(radians(60), abs=radians(0.2))
    assert found.at("angle(hinge)", 1.5) == pytest.approx(0.0, abs=radians(0.2))


def test_the_geared_motor_lifts_with_the_losses_of_its_gear() -> None:
    found = shown("gearmotor")
    # at constant speed the current carries the load over ratio and eta, and its own friction
    load = 2 * 9.81 * 0.02
    kt = (12 - 12 / 5 * 0.1) / 800
    current = (load / 30 / 0.8 + kt * 0.1) / kt
    assert found.at("i(x1.m)", 1.0) == pytest.approx(current, rel=1e-3)


def test_the_relay_makes_bounces_and_breaks() -> None:
    found = shown("relay")
    assert found.at("v(nc)", 4e-3) == pytest.approx(12.0, rel=0.01) and found.at("v(no)", 4e-3) < 0.1
    assert found.at("v(no)", 40e-3) == pytest.approx(12.0, rel=0.01) and found.at("v(nc)", 40e-3) < 0.1
    assert found.at("v(nc)", 100e-3) == pytest.approx(12.0, rel=0.01)
    assert found.at("hits(x1.ends)", 100e-3) >= 2


def test_the_solenoid_pulls_in_and_lets_go() -> None:
    found = shown("solenoid")
    assert found.at("pos(bore)", 60e-3) == pytest.approx(4.5e-3, abs=1e-6)
    assert found.at("pos(bore)", 120e-3) == pytest.approx(0.0, abs=1e-6)
    assert found.at("i(x1.coil)", 60e-3) == pytest.approx(2.4, rel=1e-3)


def test_the_voice_coil_has_the_impedance_of_its_cone() -> None:
    """x = bl i/(k - m w^2 + j w c), v = (r + j w l) i + bl j w x, at 40 Hz in the steady state."""
    found = shown("voicecoil", "reltol=1e-7")
    w = 2 * pi * 40
    cone = 2000 - 0.015 * w * w + 1j * w
    i = 4 / (6 + 1j * w * 0.5e-3 + 64 * 1j * w / cone)
    late = np.asarray(found.time) > 0.15
    assert np.abs(np.asarray(found["pos(way)"])[late]).max() == pytest.approx(abs(8 * i / cone), rel=5e-3)


def test_the_encoder_counts_its_lines() -> None:
    found = shown("encoder")
    edges = np.count_nonzero(np.diff(np.asarray(found["v(a)"])) > 2.5)
    assert edges == pytest.approx(16 * found.at("angle(shaft)", 1.0) / (2 * pi), abs=1)


def test_the_h_bridge_turns_both_ways() -> None:
    found = shown("hbridge")
    assert found.at("omega(shaft)", 0.24) > 500 and found.at("omega(shaft)", 0.49) < -450
    assert found.at("v(a,b)", 0.2) == pytest.approx(12.0, abs=0.3)


def test_the_inverter_runs_the_motor_to_the_speed_of_its_voltage() -> None:
    found = shown("inverter", "reltol=1e-5")
    # 180 degrees each switch: phases see 2/3 and 1/3 of the supply in turn
    assert 24 / 0.06 * 0.9 < found.at("omega(shaft)", 0.1) < 24 / 0.06 * 4 / 3


def test_both_controllers_hold_the_speed() -> None:
    found = shown("pid")
    assert found.at("omega(s1)", 1.0) == pytest.approx(100.0, rel=1e-4)
    assert found.at("omega(s2)", 1.0) == pytest.approx(100.0, rel=1e-4)
    held = np.asarray(found["v(u2)"])[(np.asarray(found.time) > 0.1011) & (np.asarray(found.time) < 0.1049)]
    assert np.ptp(held) < 0.05  # it holds between its samples, but for what it adds up


def test_the_field_oriented_drive_keeps_its_speed_under_load() -> None:
    found = shown("foc")
    # 3/2 p psi iq carries 0.1 N m; the integrals leave no error of speed and no current along the magnet
    assert found.at("omega(shaft)", 0.5) == pytest.approx(100, abs=1e-4)
    assert found.at("foc.q", 0.5) == pytest.approx(0.1 / (1.5 * 4 * 12e-3), rel=1e-4)
    assert abs(found.at("foc.d", 0.5)) < 1e-6

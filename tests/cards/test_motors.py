"""Machines of MOTOR by the type of their .model: closed forms, power to rounding, messages."""

from __future__ import annotations

import random
from math import cos, pi, radians, sin, sqrt

import numpy as np
import pytest
from machines import machine
from support import REFS, reference, run, values_at

import emsim
from emsim.cards.motors import MODELS
from emsim.deck import MOTOR_TYPES

MACHINES = {
    "dcwound": ("a 0 b 0", "ra=0.3 la=2m rf=9 lf=0.4 laf=0.2 rs=0.1 ls=1m lafs=50m j=1m b=1m"),
    "pmsm": ("a b c", "p=3 rs=0.2 ld=1m lq=3m psi=80m j=1m b=1m"),
    "pmsm with neutral": ("a b c 0", "p=3 rs=0.2 ld=1m lq=3m psi=80m l0=0.4m j=1m b=1m"),
    "pmsm saturating": ("a b c", "p=3 rs=0.2 ld=1m lq=3m psi=80m isat=2 j=1m b=1m"),
    "pmsm saturating with neutral": ("a b c 0", "p=3 rs=0.2 ld=1m lq=3m psi=80m isat=2 l0=0.4m j=1m b=1m"),
    "stepper saturating": ("a 0 b 0", "nr=50 km=0.2 r=0.6 l=2m td=20m isat=1 j=1m"),
    "induction saturating": ("a b c", "p=2 rs=0.5 rr=0.4 lm=60m lss=3m lsr=4m isat=1 j=1m b=1m"),
    "bldc": ("a b c", "p=2 r=0.5 l=0.4m ke=30m j=1m"),
    "bldc with neutral": ("a b c 0", "p=2 r=0.5 l=0.4m ke=30m j=1m"),
    "stepper": ("a 0 b 0", "nr=50 km=0.2 r=0.6 l=2m td=20m j=1m"),
    "induction": ("a b c", "p=2 rs=0.5 rr=0.4 lm=60m lss=3m lsr=4m j=1m"),
    "induction with neutral": ("a b c 0", "p=2 rs=0.5 rr=0.4 lm=60m lss=3m lsr=4m l0=2m j=1m"),
}


def driven(name: str, speed: str = "", sources: str = "") -> str:
    """A machine on a shaft, at a prescribed speed where one is given."""
    nodes, parameters = MACHINES[name]
    kind = name.partition(" ")[0]
    drive = f"DRIVE d h qd={speed}\n" if speed else ""
    sources = (
        sources or "Va a 0 SIN(0 5 50)\nVb b 0 SIN(1 5 50 0 0 -120)\nVc c 0 SIN(0 5 50 0 0 -240)\nRc c 0 1k\n"
    )
    start = "0.4" if speed else "(0.4,5)"
    machine = f"BODY r m=1 j=1m\nJOINT h 0 r pin ic={start}\n{drive}MOTOR m1 {nodes} h model=m\n"
    return f"{name}\n{machine}.model m {kind} {parameters}\n{sources}"


def test_the_types_that_decks_read_are_those_that_exist() -> None:
    assert tuple(MODELS) == MOTOR_TYPES


@pytest.mark.parametrize("name", MACHINES)
def test_power_in_is_stored_heat_and_work_at_every_point(name: str) -> None:
    """v i = dE/dt + r i^2 + T w as an identity, whatever the currents and their rates: to rounding."""
    m = machine(driven(name).partition("\n")[2])
    b = m.b
    card, joint = m.couplings["m1"], m.joints["h"]
    rates = [b.symbol() for _ in card.i]
    seed = [*zip(card.i, rates, strict=True), (joint.q, joint.u)]
    w = card._speed()
    stored = b.tangent([card.stored(m)], seed)[0]
    flux = b.tangent(card.flux, seed)
    emf = [*card.induced]
    for k, g in enumerate(card.volts):
        emf[k] = emf[k] + g
    into = b.const(0.0)
    for i, rate, e in zip(card.i, flux, emf, strict=True):
        into = into + i * (rate + e * w)
    work = card.turning * w
    resting = b.tangent([card.resting], seed)[0]  # cogging: torque from energy of its own
    rng = random.Random(7)
    for _ in range(50):
        x = [rng.uniform(-3.0, 3.0) for _ in range(40)]
        values = [(r, rng.uniform(-500.0, 500.0)) for r in rates]
        parts = b.eval(b.substitute([into, stored, work, resting], values), x, 0.0)
        left = parts[0] - parts[1] - parts[2] - parts[3]
        assert abs(left) < 1e-12 * max(map(abs, parts))


@pytest.mark.parametrize("name", MACHINES)
def test_every_machine_balances_over_a_run(name: str) -> None:
    ledger = emsim.run(driven(name) + ".tran 0.1m 50m uic\n.options reltol=1e-8\n.end\n").energy
    assert ledger.balanced
    assert ledger.share < 1e-8


@pytest.mark.parametrize(
    ("method", "reltol", "allowed"), [("trbdf2", 1e-4, 3e-3), ("trbdf2", 1e-6, 1e-5), ("auto", 1e-6, 1e-6)]
)
def test_smpm_spins_down_into_a_bridge_as_the_modelica_library_has_it(
    method: str, reltol: float, allowed: float
) -> None:
    ref = reference("msl_smpm_braking")
    found = run((REFS / "msl_smpm_braking.cir").read_text(), f"reltol={reltol} method={method}")
    signals = {
        "inertiaLoad.phi": "angle(shaft)", "inertiaLoad.w": "omega(shaft)", "smpm.is[1]": "i(m1,1)",
        "smpm.is[2]": "i(m1,2)", "smpm.idq_sr[1]": "id(m1)", "smpm.idq_sr[2]": "iq(m1)",
    }  # fmt: skip
    worst = max(
        np.abs(values_at(found, s, ref["time"]) - ref[k]).max() / np.ptp(ref[k]) for k, s in signals.items()
    )
    assert worst < allowed


def test_dq_steady_state_of_a_synchronous_machine() -> None:
    """0 = rs id - p w lq iq - vd,  0 = rs iq + p w (ld id + psi) - vq; the shaft is driven at w."""
    p, rs, ld, lq, psi, w, vd, vq = 3, 0.2, 1e-3, 3e-3, 0.08, 40.0, -2.0, 12.0
    phases = "".join(
        f"B{k} {k} 0 V={{{vd}*cos(3*angle(h)-{n}*2*pi/3)-{vq}*sin(3*angle(h)-{n}*2*pi/3)}}\n"
        for n, k in enumerate("abc")
    )
    found = emsim.run(driven("pmsm", f"{w}", phases) + ".tran 1m 0.5 uic\n.options reltol=1e-9\n.end\n")
    d, q = np.linalg.solve([[rs, -p * w * lq], [p * w * ld, rs]], [vd, vq - p * w * psi])
    torque = 1.5 * p * (psi * q + (ld - lq) * d * q) - 1e-3 * w
    columns = found.at("torque(m1)", 0.5), found.at("i(m1,1)", 0.5)
    th = p * (0.4 + w * 0.5)
    assert columns[0] == pytest.approx(torque, rel=1e-7)
    assert columns[1] == pytest.approx(d * cos(th) - q * sin(th), rel=1e-6)


def test_an_operating_point_shows_the_voltage_of_the_magnets() -> None:
    """Open terminals of a turning rotor, psi p w."""
    loads = "Ra a 0 1meg\nRb b 0 1meg\nRc c 0 1meg\n"
    found = emsim.run(
        driven("pmsm", "50", loads) + ".tran 0.1m 0.1\n.options reltol=1e-7\n.save v(a) v(b) v(c)\n.end\n"
    )
    t = np.asarray(found.time)
    for k, node in enumerate("abc"):
        want = -0.08 * 3 * 50 * np.sin(3 * (0.4 + 50 * t) - k * 2 * pi / 3)
        assert np.abs(np.asarray(found[f"v({node})"]) - want).max() < 2e-4


def test_the_back_emf_of_a_brushless_machine_is_a_trapezoid() -> None:
    loads = "Ra a 0 1meg\nRb b 0 1meg\nRc c 0 1meg\n"
    found = emsim.run(
        driven("bldc with neutral", "50", loads) + ".tran 0.1m 0.2\n.options reltol=1e-7\n.end\n"
    )
    for t in np.arange(0.0103, 0.19, 0.0031):
        e = np.degrees(2 * (0.4 + 50 * t)) % 360.0
        half = e % 180.0
        shape = min(half / 30.0, 1.0, (180.0 - half) / 30.0) * (1 if e < 180 else -1)
        assert found.at("v(a)", t) == pytest.approx(0.03 * 50 * shape, abs=1e-5)


def slip_torque(
    s: float, v: float, f: float, rs: float, rr: float, lm: float, lss: float, lsr: float, p: int
) -> float:
    """T-shaped equivalent circuit, amplitudes."""
    we = 2 * pi * f
    rotor = rr / s + 1j * we * lsr
    main = 1j * we * lm
    whole = rs + 1j * we * lss + main * rotor / (main + rotor)
    stator = v / whole
    ir = stator * main / (main + rotor)
    return 1.5 * p / we * rr / s * abs(ir) ** 2


@pytest.mark.parametrize("slip", [-0.3, 0.01, 0.05, 0.2, 1.0])
def test_steady_torque_of_an_induction_machine(slip: float) -> None:
    """At constant speed, against its equivalent circuit."""
    v, f, p = 100.0, 50.0, 2
    w = (1 - slip) * 2 * pi * f / p
    sources = "".join(f"V{k} {k} 0 SIN(0 {v} {f} 0 0 {90 - 120 * n})\n" for n, k in enumerate("abc"))
    found = emsim.run(driven("induction", f"{w!r}", sources) + ".tran 1m 4 uic\n.options reltol=1e-8\n.end\n")
    want = slip_torque(slip, v, f, 0.5, 0.4, 60e-3, 3e-3, 4e-3, p)
    torque = np.asarray(found["torque(m1)"])[np.asarray(found.time) > 3.9]
    assert np.abs(torque - want).max() < 1e-5 * abs(want)


def test_kloss_is_what_the_equivalent_circuit_says_without_stator_resistance() -> None:
    v, f, rr, lm, lss, lsr, p = 100.0, 50.0, 0.4, 60e-3, 3e-3, 4e-3, 2
    we, ls, lr = 2 * pi * f, lm + lss, lm + lsr
    sigma = 1 - lm * lm / (ls * lr)
    peak_slip = rr / (we * sigma * lr)
    peak = 1.5 * p * (v / we) ** 2 * (1 - sigma) / (2 * sigma * ls)
    for s in (0.01, 0.1, peak_slip, 0.9):
        kloss = 2 * peak / (s / peak_slip + peak_slip / s)
        assert slip_torque(s, v, f, 0.0, rr, lm, lss, lsr, p) == pytest.approx(kloss, rel=1e-12)


def test_a_stepper_holds_its_step_and_a_little_more_current_pulls_it() -> None:
    """Static torque km (ib cos - ia sin) - td sin(4 nr th): at rest under a load it stands where that is the load."""
    load = 0.5
    text = (
        "hold\nBODY r m=1 j=45u\nJOINT h 0 r pin ic=0.9deg damp=20m\nMOTOR m1 a 0 b 0 h model=m\n"
        f".model m stepper nr=50 km=0.19 r=0.55 l=1.5m td=20m\nTORQUE t h tau=-{load}\nVa a 0 2.2\nVb b 0 2.2\n"
        ".tran 1m 1\n.options reltol=1e-9\n.end\n"
    )
    th = emsim.run(text).at("angle(h)", 1.0)
    i = 2.2 / 0.55
    torque = 0.19 * i * (cos(50 * th) - sin(50 * th)) - 0.02 * sin(200 * th)
    assert torque == pytest.approx(load, rel=1e-6)
    # beyond the holding torque sqrt(2) km i it slips
    lost = emsim.run(text.replace(f"tau=-{load}", f"tau=-{1.05 * sqrt(2) * 0.19 * i}"))
    assert lost.at("angle(h)", 1.0) < -1.0


def test_detent_alone_holds_at_quarters_of_a_tooth() -> None:
    text = (
        "detent\nBODY r m=1 j=45u\nJOINT h 0 r pin ic=0.5deg damp=1m\nMOTOR m1 a 0 b 0 h model=m\n"
        ".model m stepper step=1.8deg hold=1 inom=4 r=0.55 l=1.5m td=20m\nRa a 0 1\nRb b 0 1\n.tran 1m 2\n.end\n"
    )
    assert emsim.run(text).at("angle(h)", 2.0) == pytest.approx(0.0, abs=1e-6)


def test_a_stepper_pulls_in_at_low_rates_and_loses_steps_at_high_ones() -> None:
    """Pull-in: from rest it follows 100 steps a second; at 5000 it stays behind (a rotor cannot gain that speed in a step)."""
    text = (
        "pull in\nBODY r m=1 j=45u\nJOINT h 0 r pin ic=0.9deg\nMOTOR m1 a 0 b 0 h model=m\n"
        ".model m stepper nr=50 km=0.19 r=0.55 l=1.5m b=0.8m\n.param n=@\n"
        "Va a 0 PULSE(2.2 -2.2 {1/n} 1u 1u {2/n} {4/n})\nVb b 0 PULSE(2.2 -2.2 {2/n} 1u 1u {2/n} {4/n})\n.tran 1m 0.409\n.end\n"
    )
    slow = emsim.run(text.replace("@", "100")).at("angle(h)", 0.409)
    assert slow == pytest.approx(radians(0.9 + 40 * 1.8), abs=radians(1.8))
    fast = emsim.run(text.replace("@", "5000")).at("angle(h)", 0.409)
    assert fast < 0.5 * radians(2000 * 1.8)


def test_a_data_sheet_is_met_at_its_no_load_point() -> None:
    for loss in ("coulomb", "viscous"):
        text = (
            f"sheet\nBODY r m=1 j=1u\nJOINT h 0 r pin\nMOTOR m1 a 0 h vnom=9 n0=12300rpm i0=0.118 istall=53.4 loss={loss}\n"
            "Vs a 0 9\n.tran 1m 0.5 uic\n.end\n"
        )
        found = emsim.run(text)
        assert found.at("omega(h)", 0.5) == pytest.approx(12300 * 2 * pi / 60, rel=1e-6)
        assert found.at("i(m1)", 0.5) == pytest.approx(0.118, rel=1e-5)


def test_a_sheet_that_contradicts_itself_is_told() -> None:
    text = (
        "sheet\nBODY r m=1 j=1u\nJOINT h 0 r pin\nMOTOR m1 a 0 h vnom=9 n0=12300rpm i0=0.118 istall=53.4 tstall=0.3\n"
        "Vs a 0 9\n.tran 1m 10m uic\n.end\n"
    )
    [said] = [d for d in emsim.run(text).diagnostics if d.code == "W242"]
    assert "24.1 % above tstall" in said.message
    assert not [d for d in emsim.run(text.replace("0.3\n", "0.371\n")).diagnostics if d.code == "W242"]


def test_a_wound_machine_in_shunt_and_series() -> None:
    """At constant speed: shunt ia = (v - laf v/rf w)/ra, series i = v/(ra + rf + laf w)."""
    model = ".model m dcwound ra=0.5 la=2m rf=50 lf=1 laf=1.2\n"
    shunt = (
        "s\nBODY r m=1\nJOINT h 0 r pin\nDRIVE d h qd=30\nMOTOR m1 a 0 a 0 h model=m\nVs a 0 100\n"
        + model
        + ".op\n.end\n"
    )
    found = emsim.run(shunt)
    assert found["i(m1,1)"][0] == pytest.approx((100 - 1.2 * 2 * 30) / 0.5, rel=1e-9)
    assert found["i(m1,2)"][0] == pytest.approx(2.0, rel=1e-9)
    series = shunt.replace("m1 a 0 a 0", "m1 a f f 0").replace("rf=50", "rf=0.5")
    assert emsim.run(series)["i(m1,1)"][0] == pytest.approx(100 / (1.0 + 1.2 * 30), rel=1e-9)


def test_bldc_of_a_terminal_sheet_is_half_of_everything() -> None:
    loads = "Ra a 0 1meg\nRb b 0 1meg\nRc c 0 1meg\n"
    one = driven("bldc", "50", loads) + ".tran 1m 50m uic\n.end\n"
    two = one.replace("r=0.5 l=0.4m ke=30m", "rtt=1 ltt=0.8m kt=60m")
    assert emsim.run(one).at("v(a)", 0.03) == emsim.run(two).at("v(a)", 0.03)


def test_windings_of_a_transducer_share_one_energy() -> None:
    """Two coils at an angle: torque -m sin(th) i1 i2, and the voltage that a turn of one makes in the other."""
    text = (
        "variometer\nBODY r m=0 j=20u\nJOINT h 0 r pin ic=0.7\nDRIVE d h q={0.7+30*time}\n"
        "TRANSDUCER t (a 0 b 0) (h) W={5m*i(t,1)^2 + 2m*i(t,2)^2 + 4m*cos(angle(h))*i(t,1)*i(t,2)}\n"
        "I1 0 a 2\nRl b 0 1meg\n.tran 0.1m 0.2\n.options reltol=1e-7\n.end\n"
    )
    found = emsim.run(text)
    t = np.asarray(found.time)
    assert np.abs(np.asarray(found["v(b)"]) - -4e-3 * 2 * 30 * np.sin(0.7 + 30 * t))[t > 1e-3].max() < 1e-5
    ledger = emsim.run(text.replace("1meg", "2").replace("I1 0 a 2", "I1 0 a SIN(0 2 50)")).energy
    assert ledger.balanced and ledger.share < 1e-6


def test_two_joints_of_a_transducer_feel_the_slopes_of_one_energy() -> None:
    text = (
        "two\nBODY a m=1\nBODY b m=2\nJOINT s 0 a slide axis=(1,0) ic=0.1\nJOINT r 0 b slide axis=(1,0) ic=0.3\n"
        "TRANSDUCER t (n 0) (s r) W={i(t,1)^2/2*1m/(0.1+pos(r)-pos(s))}\nI1 0 n 3\n.tran 1m 5m\n.end\n"
    )
    found = emsim.run(text)
    pull = 4.5e-3 / 0.3**2
    assert found["force(t,1)"][0] == pytest.approx(pull, rel=1e-9)
    assert found["force(t,2)"][0] == pytest.approx(-pull, rel=1e-9)


WRONG = {
    "MOTOR m1 a b h model=m\n.model m pmsm p=2 ld=1m psi=0.1": "E233",  # two nodes where three or four are needed
    "MOTOR m1 a b c h model=m\n.model m pmsm p=2 ld=1m": "E230",  # no magnets
    "MOTOR m1 a b c h model=m\n.model m pmsm p=2 ld=1m psi=0.1 ke=3": "E231",  # said twice
    "MOTOR m1 a b c h model=m\n.model m pmsm p=2 ld=1m psi=0.1 lmd=3": "E231",  # a parameter of nothing
    "MOTOR m1 a b c h model=m\n.model m bldc p=2 ke=1 l=1m rtt=1 r=1": "E231",
    "MOTOR m1 a 0 b 0 h model=m\n.model m stepper nr=50 l=1m hold=1": "E230",  # at which current?
    "MOTOR m1 a 0 h model=m\n.model m dcmotor vnom=9 n0=100": "E230",  # half a sheet
    "MOTOR m1 a 0 h model=m\n.model m dcmotor vnom=9 n0=100 i0=5 istall=4": "E238",  # more without load than at stall
    "MOTOR m1 a c h model=m\n.model m nmos": "E253",
    "MOTOR m1 a c h model=q": "E253",
    "MOTOR m1 a b c h model=m\n.model m induction p=2 rr=1 lm=-1 lss=1m lsr=1m": "E238",
    "TRANSDUCER t (a 0 b) (h) W={i(t,1)^2}": "E233",
    "TRANSDUCER t (a 0 b 0) (h) W={i(t,1)^2*angle(h)}": "E252",  # the second winding links nothing
    "TRANSDUCER t (a 0 b 0) (h h) W={i(t,1)*i(t,2)*angle(h)}": "E237",
    "TRANSDUCER t (a 0 b 0) (h) W={i(t,1)*i(t,3)*angle(h)}": "E249",
    "TRANSDUCER t (a 0 b 0) (h) W={i(t,1)*i(t,2)*time}": "E252",
}  # fmt: skip


@pytest.mark.parametrize("line", WRONG)
def test_what_is_wrong_with_a_machine_is_told_at_its_line(line: str) -> None:
    text = f"w\nBODY r m=1\nJOINT h 0 r pin\n{line}\nVa a 0 1\nVb b 0 1\nVc c 0 1\n.tran 1m 10m uic\n.end\n"
    with pytest.raises(emsim.DeckError) as error:
        emsim.compile(text)
    errors = [d for d in error.value.diagnostics if d.severity == "error"]
    assert [d.code for d in errors][:1] == [WRONG[line]]
    assert errors[0].span is not None

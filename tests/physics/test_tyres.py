"""TYRE: the formula's values and slopes, steady cornering, braking, standstill, a car on four tyres in a double lane change."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from support import deck, run
from tyres import TABLE, fitted, magic, plain

import emsim

MODEL = ".model t205 tyre " + " ".join(f"{k}={v}" for k, v in TABLE.items())


def rig(law: str, kappa: float, tan_alpha: float, fz: float, end: float = 0.4) -> tuple[float, float]:
    """Fx, Fy of a wheel drawn over the road at 20 m/s, after many relaxation lengths, with both slips held."""
    v, r = 20.0, 0.3
    text = f"""rig
BODY  hub m=1 j=1
JOINT table 0 hub planar ic=(0,0,0,{v},{v * tan_alpha!r},0)
BODY  rotor m=0 j=1
JOINT spin 0 rotor pin
DRIVE w spin q={{{v * (1 + kappa) / r!r}*time}}
DRIVE x rail q={{{v}*time}}
TYRE  t hub 0 spin r={r} fz={fz!r} {law}
{MODEL}
.tran 10m {end}
.save all friction(t,1) friction(t,2)
.end
"""
    # the hub on two driven slides, across and along
    text = text.replace(
        "BODY  hub m=1 j=1\n", "BODY sled m=1\nBODY hub m=1 j=1\nJOINT rail 0 sled slide axis=(1,0)\n"
    )
    text = text.replace(
        text[text.index("JOINT table") : text.index("BODY  rotor")], "JOINT cross sled hub slide axis=(0,1)\n"
    )
    text = text.replace("TYRE", f"DRIVE y cross q={{{v * tan_alpha!r}*time}}\nTYRE", 1)
    got = run(text, "reltol=1e-9")
    return float(got["friction(t,1)"][-1]), float(got["friction(t,2)"][-1])


SLIPS = [(0.0, 0.05), (0.1, 0.0), (-0.05, -0.1), (0.3, 0.2), (-0.6, 0.02)]


@pytest.mark.parametrize(("kappa", "t"), SLIPS)
@pytest.mark.parametrize("fz", [2500.0, 4000.0, 6000.0])
def test_coefficients_of_pac2002(kappa, t, fz):
    got = rig("model=t205 sigma=(0.2,0.2)", kappa, t, fz)
    assert got == pytest.approx(fitted(TABLE, kappa, math.atan(t), fz), rel=1e-7, abs=1e-4)


@pytest.mark.parametrize(("kappa", "t"), SLIPS)
def test_letters(kappa, t):
    got = rig("b=(10,8) c=(1.6,1.3) d=(1,0.9) e=(0.2,-1) sigma=(0.2,0.3)", kappa, t, 4000.0)
    wanted = plain((10, 8), (1.6, 1.3), (1, 0.9), (0.2, -1), kappa, t, 4000.0)
    assert got == pytest.approx(wanted, rel=1e-7, abs=1e-4)


# what a scale factor is the same as: coefficients times it
SCALED = {
    "lfzo": "fnomin", "lcx": "pcx1", "lmux": "pdx1 pdx2 pvx1 pvx2", "lex": "pex1 pex2 pex3", "lkx": "pkx1 pkx2",
    "lhx": "phx1 phx2", "lvx": "pvx1 pvx2", "lxal": "rbx1",
    "lcy": "pcy1", "lmuy": "pdy1 pdy2 pvy1 pvy2", "ley": "pey1 pey2", "lky": "pky1",
    "lhy": "phy1 phy2", "lvy": "pvy1 pvy2", "lyka": "rby1", "lvyka": "rvy1 rvy2",
}  # fmt: skip


@pytest.mark.parametrize("scale", SCALED)
def test_scale_factors(scale):
    table = {**TABLE, "pvx1": 0.02, "pex4": 0.1}
    scaled = {k: 0.8 * v if k in SCALED[scale].split() else v for k, v in table.items()}
    law = " ".join(f"{k}={v}" for k, v in table.items())
    got = rig(f"{law} {scale}=0.8 sigma=0.2", -0.07, 0.06, 5000.0)
    assert got == pytest.approx(fitted(scaled, -0.07, math.atan(0.06), 5000.0), rel=1e-7, abs=1e-4)


def test_relaxation_lengths_of_coefficients():
    """Behind a way x of constant slip the tyre shows 1 - exp(-x/sigma) of it."""
    fz, r0, end = 5000.0, 0.313, 0.02
    df = fz / 4000 - 1
    along = fz * (2.3 - 0.4 * df) * math.exp(0.2 * df) * r0 / 4000 * 0.9
    across = 2.1 * math.sin(2 * math.atan(fz / (1.7 * 4000))) * r0 * 0.7
    law = "model=t205 ptx1=2.3 ptx2=-0.4 ptx3=0.2 pty1=2.1 pty2=1.7 lsgkp=0.9 lsgal=0.7"
    got = rig(law, 0.1, 0.08, fz, end)
    kappa, t = 0.1 * (1 - math.exp(-20 * end / along)), 0.08 * (1 - math.exp(-20 * end / across))
    assert got == pytest.approx(fitted(TABLE, kappa, math.atan(t), fz), rel=1e-6)


def test_the_slope_is_bcd_and_the_peak_d():
    small = 1e-5
    law = "b=(10,8) c=(1.6,1.3) d=(1,0.9) e=(0.2,-1) sigma=(0.2,0.3)"
    assert rig(law, small, 0.0, 4000.0)[0] == pytest.approx(10 * 1.6 * 1 * 4000 * small, rel=1e-6)
    assert rig(law, 0.0, small, 4000.0)[1] == pytest.approx(-8 * 1.3 * 0.9 * 4000 * small, rel=1e-6)
    # sin has its peak where C atan(..) is a right angle
    top = brentq(
        lambda x: 1.6 * math.atan(10 * x - 0.2 * (10 * x - math.atan(10 * x))) - math.pi / 2, 0.01, 1
    )
    assert rig(law, top, 0.0, 4000.0)[0] == pytest.approx(4000.0, rel=1e-9)


def test_cornering_stiffness_of_the_table():
    """Ky = pKy1 Fz0 sin(2 atan(Fz/(pKy2 Fz0))) without shifts: 4000 N gives 46.0 kN/rad."""
    table = {k: v for k, v in TABLE.items() if k[:3] not in ("phy", "pvy", "rvy", "rby", "rcy")}
    text = " ".join(f"{k}={v}" for k, v in table.items())
    stiffness = 14.95 * 4000 * math.sin(2 * math.atan(1 / 2.13))
    assert rig(f"{text} sigma=0.2", 0.0, 1e-5, 4000.0)[1] == pytest.approx(-stiffness * 1e-5, rel=1e-5)


# ---- a car of two tyres, and of four -------------------------------------------------------------------

M, IZ, A, B, G = 1500.0, 2500.0, 1.2, 1.6, 9.81
FRONT, REAR = M * G * B / (A + B), M * G * A / (A + B)


def single_track(delta: float, v: float) -> str:
    """Held at its speed by a force along; both axles as one tyre each."""
    law = "b=8 c=1.3 d=0.9 e=-1 sigma=0.4"
    return f"""single track
BODY car m={M} j={IZ} vx={v}
BODY hub m=0 j=0
JOINT steer car({A},0) hub pin
DRIVE wheel steer q={{{delta}*(1-exp(-time*time))}}
TYRE front hub 0 fz={FRONT!r} {law}
TYRE rear car(-{B},0) 0 fz={REAR!r} {law}
FORCE engine car fx={{1e5*({v}-hypot(vx(car),vy(car)))*cos(angle(car))}} fy={{1e5*({v}-hypot(vx(car),vy(car)))*sin(angle(car))}}
.tran 0.1 25
.save all omega(car) vx(car) vy(car)
.end
"""


@pytest.mark.parametrize("v", [10.0, 25.0])
def test_steady_cornering_has_the_understeer_gradient(v):
    """At small angles r = v delta/(L + K v^2), K = m/L (b/C1 - a/C2) (Pacejka 1.3); here loads make C1/C2 = b/a, so K = 0; with
    a softer front axle it is not."""
    delta = 1e-4
    text = single_track(delta, v)
    for d, wanted in ((0.9, 0.0), (0.6, None)):
        changed = text.replace("d=0.9", f"d={d}", 1)
        c1, c2 = 8 * 1.3 * d * FRONT, 8 * 1.3 * 0.9 * REAR
        gradient = M / (A + B) * (B / c1 - A / c2)
        assert wanted is None or gradient == pytest.approx(wanted, abs=1e-12)
        got = run(changed, "reltol=1e-8")
        speed = math.hypot(float(got["vx(car)"][-1]), float(got["vy(car)"][-1]))
        assert float(got["omega(car)"][-1]) == pytest.approx(
            speed * delta / (A + B + gradient * speed**2), rel=1e-5
        )


def test_modes_at_speed():
    """Sway, yaw and two relaxing slips of the single track, against the eigenvalues of its matrix."""
    v, sigma, d1 = 20.0, 0.4, 0.6
    k1, k2 = 8 * 1.3 * d1 * FRONT / sigma, 8 * 1.3 * 0.9 * REAR / sigma
    matrix = [
        [0, -v, -k1 / M, -k2 / M],
        [0, 0, -A * k1 / IZ, B * k2 / IZ],
        [1, A, -v / sigma, 0],
        [1, -B, 0, -v / sigma],
    ]
    text = f"""modes
.gravity 0
BODY car m={M} j={IZ} vx={v}
TYRE front car({A},0) 0 fz={FRONT!r} b=8 c=1.3 d={d1} e=-1 sigma={sigma}
TYRE rear car(-{B},0) 0 fz={REAR!r} b=8 c=1.3 d=0.9 e=-1 sigma={sigma}
.modes
.end
"""
    got = emsim.run(text).table("modes")
    found = sorted(
        (float(r), float(f)) for r, f in zip(got["rate"], got["frequency"], strict=True) if r > 1e-6
    )
    wanted = [z for z in np.linalg.eigvals(np.array(matrix)) if z.imag >= 0.0]  # a pair is one mode
    assert len(wanted) == 2
    for (rate, frequency), z in zip(found, sorted(wanted, key=lambda z: -z.real), strict=True):
        assert rate == pytest.approx(-z.real, rel=1e-6)
        assert 2 * math.pi * frequency == pytest.approx(z.imag, rel=1e-6)


def braking(torque: float) -> str:
    return f"""braking
BODY car m=400 vx=30
BODY wheel m=0 j=1e-3
JOINT road 0 car slide axis=(1,0) ic=(0,30)
JOINT spin 0 wheel pin ic=(0,100)
TYRE t car 0 spin r=0.3 fz=4000 b=10 c=1.6 d=1 e=0.2 sigma=0.2
TORQUE brake spin tau={{-{torque}*tanh(omega(spin))}}
.options reltol=1e-7
.tran 0.1 7
.end
""".replace(" vx=30", "")


def test_braking_distance():
    """A wheel without inertia takes F = torque/r from the road: v^2/(2 a), and then it stands."""
    got = run(braking(600.0))
    assert float(got["pos(road)"][-1]) == pytest.approx(30**2 / (2 * 5.0), rel=3e-3)
    assert abs(float(got["vel(road)"][-1])) < 0.2  # the tyre is a spring now
    assert abs(got.energy.residual) < 1e-6 * got.energy.turnover
    # what the brake does not take the slip does
    assert got.energy.dissipated - got.energy.supplied == pytest.approx(0.5 * 400 * 900, rel=1e-3)
    assert 0.02 * 180e3 < got.energy.dissipated < 0.05 * 180e3


@pytest.mark.parametrize("formulation", ["joint", "absolute"])
def test_a_wheel_in_space_brakes_as_one_beside_the_picture(formulation):
    """The wheel on its hub, which goes along x above a road across z; its load is what a guide carries."""
    flat = run(braking(600.0), "reltol=1e-8", tran="0.1 2")
    text = braking(600.0).replace("BODY wheel m=0 j=1e-3", "BODY wheel m=0 j=(1e-3,1e-3,1e-3)")
    text = text.replace("BODY car m=400", "BODY car m=400 j=(9,9,9)").replace(
        "spin 0 wheel", "spin car(0,0,0.3) wheel"
    )
    text = text.replace("pin ic=(0,100)", "pin axis=(0,1,0) ic=(0,100)").replace(
        "fz=4000", "fz={3000+fz(road)}"
    )
    text = text.replace("braking\n", "braking\n.gravity 0 0 -2.5\n")
    solid = run(text, f"reltol=1e-8 formulation={formulation}", tran="0.1 2")
    for name in ("pos(road)", "vel(road)", "omega(spin)"):
        assert float(solid[name][-1]) == pytest.approx(float(flat[name][-1]), rel=1e-6)


def test_seen_from_the_side_its_load_is_that_of_a_contact():
    """A car that stands on its wheel's rim, and brakes as one of given load."""
    flat = run(braking(600.0), "reltol=1e-8", tran="0.1 2")
    text = """side
.gravity 10
BODY frame m=0 j=0
BODY car m=400 j=1
JOINT road 0 frame slide axis=(1,0) ic=(0,30)
JOINT lift frame car slide axis=(0,1) ic=0.3
BODY wheel m=0 j=1e-3
JOINT spin car wheel pin ic=(0,-100)
CONTACT c car 0 line=(0,1) r=0.3
TYRE t car(0,-0.3) 0 spin r=-0.3 fz={force(c)} normal=(0,1,0) b=10 c=1.6 d=1 e=0.2 sigma=0.2
TORQUE brake spin tau={-600*tanh(omega(spin))}
.tran 0.1 2
.end
"""
    got = run(text, "reltol=1e-8")
    assert float(got["force(c)"][-1]) == pytest.approx(4000.0, rel=1e-9)
    assert float(got["pos(road)"][-1]) == pytest.approx(float(flat["pos(road)"][-1]), rel=1e-6)
    assert float(got["vel(road)"][-1]) == pytest.approx(float(flat["vel(road)"][-1]), rel=1e-6)


def test_a_wheel_that_lifts_off_pushes_nothing():
    """fz= as an expression that falls below 0: the coefficients too have values at no load."""
    text = f"""lifts off
BODY car m=400
JOINT road 0 car slide axis=(0,1) ic=(0,1)
TYRE t car 0 along=(1,0) fz={{4000*(1-time)}} model=t205 sigma=0.4
{MODEL}
.tran 10m 2
.save all friction(t,2) force(t)
.end
"""
    got = run(text, "reltol=1e-8")
    assert float(got["friction(t,2)"][-1]) == 0.0 == float(got["force(t)"][-1])
    assert np.isfinite(got["vel(road)"]).all() and float(got["friction(t,2)"][5]) < 0.0


def test_it_holds_at_standstill():
    """On a slope of 0.2 g with the wheel locked, let down slowly: u' = x' (1 - u/sigma), so x = -sigma ln(1 - kappa)."""
    text = """held
.gravity 2 -9.6
BODY car m=400
JOINT road 0 car slide axis=(1,0) damp=60k
BODY wheel m=0 j=1
JOINT spin 0 wheel pin
DRIVE lock spin q={0}
TYRE t car 0 spin r=0.3 fz=4000 b=10 c=1.6 d=1 e=0.2 sigma=0.2
.tran 0.1 10
.end
"""
    got = run(text, "reltol=1e-8")
    kappa = brentq(lambda x: magic(x, 10, 1.6, 4000.0, 0.2) - 800.0, 0, 0.1)
    assert float(got["pos(road)"][-1]) == pytest.approx(-0.2 * math.log1p(-kappa), rel=1e-6)


def four_wheels(t_end: float):
    """The car of netlists/mechanical/double_lane_change.cir by scipy: yaw, place, four relaxing side slips, two driven wheels."""
    half, r, j, sx, sy, torque = 0.75, 0.31, 1.2, 0.25, 0.45, 100.0
    places = [(A, half), (A, -half), (-B, half), (-B, -half)]
    loads = [FRONT / 2, FRONT / 2, REAR / 2, REAR / 2]

    def steer(t):
        return 0.05 * sum(
            s * math.exp(-(((t - at) / 0.3) ** 2)) for s, at in ((1, 1.0), (-1, 1.9), (-1, 2.8), (1, 3.7))
        )

    def slope(t, x):
        _, _, yaw, vx, vy, w = x[:6]
        ys, us, ws = x[6:10], x[10:12], x[12:14]
        out = np.zeros(14)
        out[:3] = vx, vy, w
        force, moment = np.zeros(2), 0.0
        for k, ((px, py), fz) in enumerate(zip(places, loads, strict=True)):
            c, s = math.cos(yaw), math.sin(yaw)
            arm = np.array([c * px - s * py, s * px + c * py])
            v = np.array([vx - w * arm[1], vy + w * arm[0]])
            turn = yaw + (steer(t) if k < 2 else 0.0)
            ahead, left = (
                np.array([math.cos(turn), math.sin(turn)]),
                np.array([-math.sin(turn), math.cos(turn)]),
            )
            vel, side = v @ ahead, v @ left
            out[6 + k] = side - abs(vel) * ys[k] / sy
            kappa = 0.0
            if k >= 2:
                over = vel - r * ws[k - 2]
                out[10 + k - 2] = over - abs(vel) * us[k - 2] / sx
                kappa = -us[k - 2] / sx
            fx, fy = fitted(TABLE, kappa, math.atan(ys[k] / sy), fz)
            if k < 2:
                fx = 0.0
            else:
                out[12 + k - 2] = (torque - r * fx) / j
            f = fx * ahead + fy * left
            force += f
            moment += arm[0] * f[1] - arm[1] * f[0]
        out[3:6] = force[0] / M, force[1] / M, moment / IZ
        return out

    start = np.zeros(14)
    start[3], start[12:] = 25.0, 25.0 / r
    found = solve_ivp(slope, (0, t_end), start, "DOP853", rtol=1e-11, atol=1e-11)
    return found.y[:, -1]


def test_double_lane_change():
    """A car on four tyres of PAC2002, against an own integration."""
    end = 4.5
    x, y, yaw, vx, vy, w, *rest = four_wheels(end)
    got = run(deck("mechanical/double_lane_change"), "reltol=1e-9", tran=f"0.1 {end}")
    for name, wanted in (
        ("x(car)", x),
        ("y(car)", y),
        ("angle(car)", yaw),
        ("omega(car)", w),
        ("vx(car)", vx),
        ("vy(car)", vy),
    ):
        assert float(got[name][-1]) == pytest.approx(wanted, abs=1e-6), name
    assert float(got["omega(s3)"][-1]) == pytest.approx(rest[6], abs=1e-5)
    assert abs(got.energy.residual) < 1e-7 * got.energy.turnover
    assert max(got["y(car)"]) > 1.5  # it has changed the lane


@pytest.mark.parametrize("formulation", ["joint", "absolute"])
def test_in_space(formulation):
    """The same cornering with the road along xz: axes say nothing."""
    flat = single_track(0.02, 15.0)
    r = run(flat, "reltol=1e-8", tran="0.1 4")
    law = "b=8 c=1.3 d=0.9 e=-1 sigma=0.4 normal=(0,1,0)"
    text = f"""single track on the xz plane
BODY a m=0 j=(0,0,0)
BODY c m=0 j=(0,0,0)
BODY car m={M} j=({IZ},{IZ},{IZ})
JOINT ja 0 a slide axis=(1,0,0) ic=(0,15)
JOINT jc a c slide axis=(0,0,-1)
JOINT jy c car pin axis=(0,1,0)
BODY hub m=0 j=(0,0,0)
JOINT steer car({A},0,0) hub pin axis=(0,1,0)
DRIVE wheel steer q={{0.02*(1-exp(-time*time))}}
TYRE front hub 0 fz={FRONT!r} {law}
TYRE rear car(-{B},0,0) 0 fz={REAR!r} {law}
TORQUE none jy tau=0
FORCE engine car fx={{1e5*(15-hypot(vx(car),vz(car)))*cos(angle(jy))}} fz={{-1e5*(15-hypot(vx(car),vz(car)))*sin(angle(jy))}}
.tran 0.1 4
.end
"""
    s = run(text, f"reltol=1e-8 formulation={formulation}")
    assert float(s["angle(jy)"][-1]) == pytest.approx(float(r["angle(car)"][-1]), abs=1e-6)


WRONG = {
    "TYRE t car 0 b=8 c=1 d=1 sigma=1": None,  # no fz=: no machine card
    "TYRE t car 0 fz=4k b=8 c=1 d=1": "needs sigma=",
    "TYRE t car 0 fz=-1 b=8 c=1 d=1 sigma=1": "a road does not pull",
    "TYRE t car 0 fz=1 b=8 c=1 d=1 sigma=1 e=2": "above 1",
    "TYRE t car 0 fz=1 b=8 c=1 d=1 sigma=1 r=1": "rolls freely",
    "TYRE t car 0 fz=1 model=none sigma=1": "no .model of type tyre",
    "TYRE t car 0 fz=1 fnomin=1 sigma=1": "other than 0",
    "TYRE t car 0 fz=1 model=t205": "without a relaxation length",
    "TYRE t car 0 fz=1 model=t205 sigma=1 b=1": "each says it all",
    "TYRE t car 0 fz=1 b=8 c=1 d=1 sigma=(1,2,3)": "one number, or two",
}


@pytest.mark.parametrize("card", WRONG)
def test_what_is_wrong_is_told(card):
    text = f"t\nBODY car m=1 j=(1,1,1)\n{card}\n{MODEL}\n.tran 1m 1m\n.end\n"
    with pytest.raises(emsim.DeckError, match=WRONG[card]):
        emsim.run(text)

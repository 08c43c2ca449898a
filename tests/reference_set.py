"""The reference set: decks whose solutions are known, and what the error of a run is.

An error is the largest deviation of a signal at the reference times as a share of the signal's range over the run; of a
run, that of its worst signal.

`PROBLEMS`      values at a few times, from closed forms or from computations that agree on the digits written here
`TRAJECTORIES`  tables in tests/physics/refs/*.csv, each with its source and licence; eight to ten digits
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from support import deck, reference, run, values_at

Signal = str | Callable[[Callable[[str], np.ndarray]], np.ndarray]
Errors = dict[str, float]

LADDER = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10)
ALL = ("radau", "radau5", "radau9", "radau13", "auto")


@dataclass(frozen=True)
class Problem:
    deck: str
    signals: dict[str, Signal]  # name in the reference -> column, or function of columns
    values: dict[float, dict[str, float]]  # time [s] -> signal -> value
    source: str
    floor: float = 1e-11  # digits of the reference, or the rounding of the problem
    ladder: tuple[float, ...] = LADDER
    slow: tuple[str, ...] = ()  # methods that take long here
    # (method, reltol) -> the error there, where a method is known to miss its tolerance
    misses: dict[tuple[str, float], float] = field(default_factory=dict)

    @property
    def name(self) -> str:
        return self.deck.split("/")[1].removeprefix("ref_")

    def errors(self, options: str) -> Errors:
        """Of each signal."""
        return self.errors_of(self.run(options))

    def run(self, options: str):
        return run(deck(self.deck), options)

    def errors_of(self, result) -> Errors:
        times = np.array(sorted(self.values), dtype=float)
        found = {}
        for name, how in self.signals.items():
            column, value = taken(how, lambda n: np.asarray(result[n])), taken(how, at(result, times))
            want = np.array([self.values[t][name] for t in sorted(self.values)])
            found[name] = float(np.abs(value - want).max() / np.ptp(column))
        return found

    def apart(self, result, other) -> float:
        """The largest difference of two runs over all times that both recorded, as a share of the signals' ranges."""
        times = np.asarray(result.time), np.asarray(other.time)
        rows = np.intersect1d(*times, return_indices=True)[1:]
        assert len(rows[0]) > 2, "no common points"
        worst = 0.0
        for how in self.signals.values():
            a, b = (taken(how, lambda n, r=r: np.asarray(r[n])) for r in (result, other))
            worst = max(worst, float(np.abs(a[rows[0]] - b[rows[1]]).max() / np.ptp(b)))
        return worst


@dataclass(frozen=True)
class Trajectory:
    deck: str
    ref: str
    signals: dict[str, Signal]
    tight: float = (
        1e-5  # reached at reltol 1e-8; where it is more, the deck differs from the stated equations
    )
    default: float = 1e-3
    slow: bool = False

    @property
    def name(self) -> str:
        return self.ref

    @property
    def floor(self) -> float:
        """Ten digits in the tables, nine after the division by the range."""
        return max(1e-7, 0.1 * self.tight)

    def errors(self, options: str) -> Errors:
        ref = reference(self.ref)
        result = run(deck(self.deck), options)
        found = {}
        for signal, how in self.signals.items():
            value = taken(how, at(result, ref["time"]))
            found[signal] = float(np.abs(value - ref[signal]).max() / np.ptp(ref[signal]))
        return found


def taken(how: Signal, of: Callable[[str], np.ndarray]) -> np.ndarray:
    return of(how) if isinstance(how, str) else how(of)


def at(result, times: np.ndarray) -> Callable[[str], np.ndarray]:
    return lambda name: values_at(result, name, times)


def turned(name: str) -> Signal:
    """Counted clockwise in the reference."""
    return lambda v: -v(name)


def both(name: str) -> Signal:
    """An absolute angle or speed of the second body: both joints'."""
    return lambda v: v(f"{name}(p1)") + v(f"{name}(p2)")


OWN = "extrapolation of order 24 (Gragg-Bulirsch-Stoer) in binary128, two tolerances; "
TEST_SET = "Test Set for IVP Solvers; RADAU in binary128 agrees to the digits given"

PROBLEMS = [
    Problem(
        "mechanical/ref_andrews_squeezer",
        {
            "y1": "angle(beta)", "y2": "angle(theta)", "y3": "angle(gamma)", "y4": "angle(phi)",
            "y5": "angle(delta)", "y6": "angle(omega)", "y7": "angle(epsilon)", "y8": "omega(beta)",
        },
        {
            0.03: {
                "y1": 15.810771195153707, "y2": -15.756371058411839, "y3": 0.0408222401196458,
                "y4": -0.5347301163420796, "y5": 0.5244099658799541, "y6": 0.5347301163420796,
                "y7": 1.0480807410419379, "y8": 1139.9203022591061,
            }
        },
        OWN + "the published values of the Test Set agree to 7e-11",
        floor=2e-11,
    ),
    Problem(
        "mechanical/ref_n_four_bar",
        {"theta": turned("angle(p0)"), "thetap": turned("omega(p0)")},
        {10: {"theta": 31.750597186986102, "thetap": 1.5066421808418295}},
        OWN + "one-freedom reduction; IFToMM benchmark A02, N = 2",
        floor=3e-9,
    ),
    Problem(
        "mechanical/ref_n_four_bar_40",
        {"theta": turned("angle(p0)"), "thetap": turned("omega(p0)")},
        {
            10: {"theta": 31.597433743985738, "thetap": 1.1676221087517068},
            20: {"theta": 63.255295368190928, "thetap": 1.7185696100557373},
        },
        OWN + "one-freedom reduction; IFToMM benchmark A02, N = 40",
        floor=3e-8,
        ladder=(1e-3, 1e-5, 1e-7, 1e-9),
        slow=("radau5", "radau9", "radau13", "auto"),
        # one step across a flat window whose estimate of order 8 is near zero; 1.2e-3 and 9e-4 are within the tolerance
        misses={("radau13", 1e-3): 3e-2},
    ),
    Problem(
        "mechanical/ref_chain20",
        {
            "tipx": "x(b20(50m,0))", "tipz": "y(b20(50m,0))",
            "tipvx": "vx(b20(50m,0))", "tipvz": "vy(b20(50m,0))", "th1": "angle(j1)",
        },
        {
            0.5: {
                "tipx": -0.2644724987233726, "tipz": -0.8502348046545563, "tipvx": -5.419639722903846,
                "tipvz": 2.3203542157405419, "th1": 0.0120587606578787,
            },
            1.0: {
                "tipx": -0.8968446528687677, "tipz": -0.1663344670807269, "tipvx": 0.2743286709401381,
                "tipvz": -0.2018095072197506, "th1": -0.9759707778769142,
            },
        },
        OWN + "Drake, Simbody and MuJoCo agree to 1e-11",
        floor=2e-11,
        slow=("radau5", "radau13"),
    ),
    Problem(
        "mechanical/ref_double_pendulum",
        {"theta1": "angle(p1)", "theta2": both("angle"), "omega1": "omega(p1)", "omega2": both("omega")},
        {
            1: {
                "theta1": -0.6250876998063906, "theta2": -1.034585085680012,
                "omega1": -3.922279572887977, "omega2": -1.303099248696331,
            },
            2: {
                "theta1": -0.4829715342517544, "theta2": -1.3240487123023625,
                "omega1": 3.0652881920734013, "omega2": 2.949271547571619,
            },
            5: {
                "theta1": -0.6271867050665307, "theta2": -1.3013155502098117,
                "omega1": 2.1254086738429107, "omega2": 3.8818887272656074,
            },
        },
        OWN + "MuJoCo, Simbody and scipy agree",
    ),
    Problem(
        "mechanical/ref_four_bar",
        {"th1": "angle(a)", "th2": "angle(coupler)", "th3": "angle(rocker)", "w1": "omega(a)"},
        {
            1: {"th1": 13.58013651307514, "th2": 0.4745920656150973,
                "th3": 1.336962208016465, "w1": 10.39454183822152},
            2: {"th1": 26.735101774286694, "th2": 0.4297199586210235,
                "th3": 1.5956794372959892, "w1": 7.2003922229514952},
            5: {"th1": 67.782721501225597, "th2": 1.3566720793825794,
                "th3": 2.3845892895086871, "w1": 24.37615472632867},
        },
        OWN + "Simbody, Exudyn, MuJoCo agree",
        floor=3e-10,
    ),
    Problem(
        "electrical/ref_robertson",
        {"y1": "v(y1)", "y2": "v(y2)", "y3": "v(y3)"},
        {1e11: {"y1": 2.0833401497013e-8, "y2": 8.33336077033478e-14, "y3": 0.99999997916651517}},
        TEST_SET,
    ),
    Problem(
        "electrical/ref_transistor_amplifier",
        {f"y{k}": f"v({k})" for k in range(1, 9)},
        {
            0.2: {
                "y1": -0.00556214501226272, "y2": 3.0065224719030423, "y3": 2.849958788608128,
                "y4": 2.92642253620624, "y5": 2.70461786501055, "y6": 2.7618377783931451,
                "y7": 4.770927631616772, "y8": 1.2369958680915479,
            }
        },
        TEST_SET,
        floor=1e-10,
    ),
    Problem(
        "electrical/ref_ring_modulator",
        {f"y{k}": f"v({k})" for k in range(1, 8)} | {f"y{k}": f"i(l{k})" for k in range(8, 16)},
        {
            1e-3: {
                "y1": -0.023390573584, "y2": -0.0073674854860, "y3": 0.2582956710, "y4": -0.4064465721,
                "y5": -0.4039455665, "y6": 0.2607966766, "y7": 0.1106761861273, "y8": 2.939904342434e-7,
                "y9": -2.840029933e-8, "y10": 0.000726719826729, "y11": 0.000792948719702,
                "y12": -0.000725528349576, "y13": -0.000794140196855, "y14": 7.0884954169e-5,
                "y15": 2.3900590753e-5,
            }
        },
        TEST_SET,
        floor=1e-9,
        ladder=(1e-3, 1e-5, 1e-7),
        slow=("radau5", "radau9", "radau13", "radau"),
    ),
    Problem(
        "mechanical/ref_simple_pendulum",
        {"theta": "angle(hinge)", "thetadot": "omega(hinge)"},
        {
            1: {"theta": -1.405027311524799, "thetadot": -1.799309016907079},
            10: {"theta": 0.2786806735699829, "thetadot": -4.343160692864683},
        },
        "Jacobi elliptic functions in 60-digit arithmetic",
    ),
    Problem(
        "coupled/ref_dc_motor_step",
        {"i": "i(m1)", "omega": "omega(shaft)"},
        {
            0.001: {"i": 7.554394628905245, "omega": 2.202928666329948},
            0.01: {"i": 9.786647356068963, "omega": 49.27062611794250},
            0.1: {"i": 1.006393854931379, "omega": 220.3660061830447},
            0.5: {"i": 0.04784086286097782, "omega": 239.0431992803071},
        },
        "matrix exponential, 40 digits",
    ),
    Problem(
        "coupled/ref_slider_crank",
        {"phi": "angle(shaft)", "omega": "omega(shaft)", "i": "i(m1)"},
        {
            0.1: {"phi": 3.332138890806870, "omega": 93.76689877110422, "i": 7.295889781272553},
            0.5: {"phi": 56.08378465742719, "omega": 202.7096045187029, "i": 3.100871101090060},
            1.0: {"phi": 157.6904489395086, "omega": 215.8185637565509, "i": -0.879138089515779},
        },
        "Gragg-Bulirsch-Stoer in binary128; an absolute-coordinate model agrees to 8 digits",
    ),
    Problem(
        "electrical/ref_lc_tank",
        {"v": "v(a)", "i": "i(l1)"},
        {1.0: {"v": 0.8799452654465220, "i": -0.01502319306333544}},
        "closed form",
        ladder=(1e-6, 1e-7, 1e-9),
        slow=ALL,
    ),
    Problem(
        "electrical/ref_rlc_700mhz",
        {"v": "v(c)"},
        {1e-9: {"v": 1.269164019521405}, 5e-9: {"v": 1.079917727993278}, 1e-8: {"v": 0.9937509591513175}},
        "closed form",
    ),
    Problem(
        "electrical/ref_vc_loop",
        {"i": lambda v: -v("i(v1)")},
        {0: {"i": 0.03141592653589793}, 1e-4: {"i": 0.02541601846157630}, 2e-4: {"i": 0.009708055193627333}},
        "closed form, i = C dV/dt",
        floor=1e-9,  # index 2: the deck's own tmax, not the tolerance, decides
    ),
]  # fmt: skip

TRAJECTORIES = [
    Trajectory(
        "coupled/ref_msl_moving_coil", "msl_moving_coil", {"i": "i(lc)", "x": "pos(way)", "v": "vel(way)"}
    ),
    Trajectory(
        "coupled/ref_msl_solenoid_pullin",
        "msl_solenoid_pullin",
        {"Phi": lambda v: 1e-6 * v("v(phi)"), "x": "pos(way)", "v": "vel(way)"},
    ),
    Trajectory(
        "coupled/ref_pmsm_interior",
        "pmsm_interior",
        {"w": "omega(shaft)", "id": "id(m1)", "iq": "iq(m1)", "ia": "i(m1,1)", "ib": "i(m1,2)"},
        tight=1e-6,
    ),
    Trajectory(
        "coupled/ref_bldc_six_step",
        "bldc_six_step",
        {"w": "omega(shaft)", "ia": "i(m1,1)", "ib": "i(m1,2)", "th": "angle(shaft)"},
        tight=1e-6,
    ),
    Trajectory(
        "coupled/ref_stepper_20_steps",
        "stepper_20_steps",
        {"th": "angle(shaft)", "w": "omega(shaft)", "ia": "i(m1,1)"},
        tight=1e-6,
    ),
    Trajectory("coupled/ref_universal_ac", "universal_ac", {"w": "omega(shaft)", "i": "i(m1,1)"}, tight=1e-6),
    Trajectory("coupled/ref_dc_datasheet", "dc_datasheet", {"w": "omega(shaft)", "i": "i(m1)"}, tight=1e-6),
    Trajectory("coupled/ref_ctms_motor_speed", "ctms_dc_motor_speed", {"w": "omega(shaft)", "i": "i(m1)"}),
    Trajectory(
        "coupled/ref_ctms_motor_position",
        "ctms_dc_motor_position",
        {"theta": "angle(shaft)", "w": "omega(shaft)", "i": "i(m1)"},
    ),
    Trajectory(
        "coupled/ref_comb_drive", "comb_drive_resonator", {"x": "pos(beam)", "v": "vel(beam)", "i": "i(comb)"}
    ),
    Trajectory(
        "coupled/ref_es_pullin_below",
        "es_pullin_below",
        {
            "v_plate": "v(p)",
            "x": "pos(flex)",
            "v": "vel(flex)",
            "q": lambda v: 8.8541878128e-12 * 40e-9 / (2e-6 - v("pos(flex)")) * v("v(p)"),
        },
    ),
    Trajectory(
        "coupled/ref_linear_pot", "linear_pot_readout", {"x": "pos(rail)", "v": "vel(rail)", "vc": "v(wip)"}
    ),
    Trajectory(
        "coupled/ref_msl_dcpm_start",
        "msl_dcpm_start",
        {"dcpm.la.i": "i(m1)", "loadInertia.phi": "angle(shaft)", "loadInertia.w": "omega(shaft)"},
    ),
    Trajectory(
        "mechanical/ref_msl_pendulum", "msl_mb_pendulum", {"rev.phi": "angle(rev)", "rev.w": "omega(rev)"}
    ),
    Trajectory(
        "mechanical/ref_msl_planar_fourbar",
        "msl_mb_planar_fourbar",
        {"revolute1.phi": "angle(rev1)", "revolute1.w": "omega(rev1)"},
    ),
    Trajectory(
        "mechanical/ref_msl_fourbar_spatial",
        "msl_mb_fourbar_spatial",
        {"j1.phi": "angle(j1)", "j1.w": "omega(j1)"},
    ),
    Trajectory(
        "mechanical/ref_msl_elastogap",
        "msl_trans_elastogap",
        {
            "elastoGap1.v_rel": "vel(rail2)",
            "elastoGap2.s_rel": lambda v: 2.0 - v("pos(rail2)"),
            "springDamper1.v_rel": "vel(rail1)",
            "springDamper2.s_rel": lambda v: 2.0 - v("pos(rail1)"),
        },
    ),
    Trajectory(
        "mechanical/ref_msl_rot_first",
        "msl_rot_first",
        {
            "damper.phi_rel": lambda v: -v("angle(j2)"),
            "damper.w_rel": lambda v: -v("omega(j2)"),
            "inertia3.phi": "angle(load)",
            "inertia3.w": "omega(load)",
        },
    ),
    Trajectory(
        "mechanical/ref_msl_backlash",
        "msl_rot_backlash",
        {
            "elastoBacklash.phi_rel": "angle(a)",
            "elastoBacklash.w_rel": "omega(a)",
            "springDamper.phi_rel": "angle(b)",
            "springDamper.w_rel": "omega(b)",
        },
    ),
    Trajectory(
        "mechanical/ref_msl_friction",
        "msl_rot_friction",
        {
            "clutch.phi_rel": "angle(clutch)",
            "clutch.w_rel": "omega(clutch)",
            "inertia3.phi": "angle(p3)",
            "inertia3.w": "omega(p3)",
            "spring.phi_rel": "angle(shaft)",
            "spring.w_rel": "omega(shaft)",
        },
    ),
    Trajectory(
        "mechanical/ref_msl_friction_stop",
        "msl_trans_friction_stop",
        {
            "stop1.s": "pos(s1)",
            "stop1.v": "vel(s1)",
            "stop2.s": "pos(s2)",
            "stop2.v": "vel(s2)",
            "mass.s": "pos(s3)",
            "mass.v": "vel(s3)",
        },
    ),
    Trajectory(
        "mechanical/ref_msl_brake", "msl_trans_brake", {"mass1.s": "pos(rail)", "mass1.v": "vel(rail)"}
    ),
    Trajectory(
        "mechanical/ref_fric_two_on_shaft", "fric_two_on_shaft", {"q": "angle(slow)", "u": "omega(slow)"}
    ),
    Trajectory(
        "mechanical/ref_fric_arm10",
        "fric_arm10",
        {**{f"th{k}": f"angle(l{k})" for k in range(1, 11)}, "w1": "omega(h1)", "w10": "omega(l10)"},
    ),
    Trajectory(
        "mechanical/ref_fric_slider_crank", "fric_slider_crank_mu", {"phi": "angle(a)", "w": "omega(a)"}
    ),
    Trajectory("mechanical/ref_stop_pendulum", "stop_pendulum", {"th": "angle(hinge)", "w": "omega(hinge)"}),
    Trajectory("mechanical/ref_newton_cradle", "newton_cradle5", {"th1": "angle(h1)", "th5": "angle(h5)"}),
    Trajectory("electrical/ref_msl_hbridge_rl", "msl_hbridge_rl", {"inductor.i": "i(l1)"}),
    Trajectory(
        "electrical/ref_msl_cauer",
        "msl_cauer_lowpass",
        {"C1.v": "v(n1)", "C3.v": "v(n2)", "C5.v": "v(n3)", "L1.i": "i(l1)", "L2.i": "i(l2)"},
    ),
    Trajectory(
        "electrical/ref_msl_saturating_inductor",
        "msl_saturating_inductor",
        {"Inductance1.i": "i(l1)", "SaturatingInductance1.Psi": "v(psi)"},
    ),
    Trajectory(
        "paper/paper_fig1_topology_A",
        "paper_fig1_topology_A",
        {"iL1": "i(l1)", "vC1": "v(n)", "iL2": "i(l2)"},
    ),
    Trajectory(
        "paper/paper_fig1_topology_B",
        "paper_fig1_topology_B",
        {"iL1": "i(l1)", "vC1": "v(b)", "iL2": "i(l2)"},
    ),
    Trajectory(
        "paper/motor_pendulum_kp30",
        "paper_motor_pendulum_kp30",
        {"i": "i(m1)", "theta": "angle(hinge)", "w": "omega(hinge)", "x_cm": "x(arm.com)", "V": "v(drive)"},
    ),
    Trajectory(
        "paper/motor_pendulum_kp30_friction",
        "paper_motor_pendulum_kp30_friction",
        {"i": "i(m1)", "theta": "angle(hinge)", "w": "omega(hinge)", "x_cm": "x(arm.com)", "V": "v(drive)"},
    ),
    Trajectory(
        "paper/motor_pendulum_kp1000",
        "paper_motor_pendulum_kp1000",
        {"i": "i(m1)", "theta": "angle(hinge)", "w": "omega(hinge)", "x_cm": "x(arm.com)", "V": "v(drive)"},
    ),
]

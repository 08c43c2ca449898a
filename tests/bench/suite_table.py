"""The benchmark set: which decks are charted together, and the table that the README shows.

Decks lie in netlists/; those that are only here for their cost in netlists/bench/. `signals` are the columns compared, () for
the states among the deck's columns; `stop` ends the run earlier than the deck does [s]; `engines` are the other programs
that build the same machine (peers/).
"""

from __future__ import annotations

from emsim.reports.work_precision import Chart, Series, best, exponent, short

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

ERRORS = (1e-3, 1e-6)
ENGINES = ("mujoco", "exudyn", "drake")
GROUPS = {
    "circuits": "Circuits, beside ngspice",
    "machines": "Machines",
    "coupled": "Circuit and machine together",
    "friction": "Friction and impacts, beside MuJoCo, Exudyn and Drake",
    "transistors": "Transistors, beside ngspice",
}
# of the README: the groups of each, and its picture: a summary, or a panel a deck
SECTIONS = {
    "suite": (("circuits", "machines", "coupled"), "netlists/bench/suite.png"),
    "friction": (("friction",), "netlists/bench/friction.png"),
    "transistors": (("transistors",), "netlists/bench/transistors.png"),
}
PANELS = ("friction", "transistors")


class Entry:
    """One deck of the set."""

    __slots__ = ("deck", "engines", "group", "name", "signals", "stop", "why")

    def __init__(
        self, group: str, name: str, deck: str, why: str, signals: tuple[str, ...] = (),
        stop: float | None = None, engines: tuple[str, ...] = (),
    ) -> None:  # fmt: skip
        self.group, self.name, self.deck, self.why = group, name, deck, why
        self.signals, self.stop, self.engines = signals, stop, engines


SUITE = [
    Entry("circuits", "RC, pulses", "bench/rc_pulses", "corners of a source; the price of a run as such"),
    Entry("circuits", "RLC ladder", "bench/rlc_ladder", "twenty states that ring and hardly lose"),
    Entry("circuits", "four-diode bridge", "electrical/diode_bridge", "a rectifier: long waits, short pulses",
          ("v(p)", "v(out)")),
    Entry("circuits", "diode clipper", "electrical/clipper", "stiff while the diode blocks", ("v(out)",)),
    Entry("circuits", "diode multiplier", "bench/multiplier4", "eight diodes that take turns"),
    Entry("circuits", "LC oscillator", "bench/lc_oscillator", "a limit cycle: accuracy is phase"),
    Entry("circuits", "LC tank", "bench/lc_tank", "a hundred lossless periods"),
    Entry("circuits", "buck converter", "electrical/buck_converter", "switch and diode, fifty edges",
          ("v(out)", "i(l1)")),
    Entry("circuits", "two-loop RLC", "bench/two_loop_rlc", "the paper's Fig. 1: ringing beside stiff"),
    Entry("circuits", "transistor amplifier", "electrical/ref_transistor_amplifier",
          "test set for IVP solvers: stiff DAE of index 1"),
    Entry("circuits", "ring modulator", "electrical/ref_ring_modulator",
          "test set for IVP solvers: fast ringing in diodes", stop=0.1e-3),
    Entry("circuits", "Robertson", "electrical/ref_robertson", "eleven decades of time"),
    Entry("machines", "pendulum", "mechanical/ref_simple_pendulum", "one freedom, elliptic functions",
          engines=ENGINES),
    Entry("machines", "double pendulum", "mechanical/ref_double_pendulum", "chaotic: errors grow",
          engines=ENGINES),
    Entry("machines", "chain of 20", "mechanical/ref_chain20", "a long tree: work per evaluation",
          ("x(b20(50m,0))", "y(b20(50m,0))", "angle(j1)"), engines=ENGINES),
    Entry("machines", "four-bar", "mechanical/ref_four_bar", "one loop, rods", ("angle(a)", "omega(a)"),
          engines=ENGINES),
    Entry("machines", "slider-crank", "bench/slider_crank", "one loop with a slide"),
    Entry("machines", "Andrews' squeezer", "mechanical/ref_andrews_squeezer",
          "test set for IVP solvers: three loops, fast"),
    Entry("machines", "two four-bars", "mechanical/ref_n_four_bar", "IFToMM: passes singular positions",
          stop=4.0),
    Entry("machines", "Bricard", "mechanical/bricard", "IFToMM: a spatial loop with a redundant row"),
    Entry("machines", "spring pendulum", "mechanical/spring_pendulum", "slow swings on a stiff spring"),
    Entry("machines", "trammel", "mechanical/trammel", "a rod between two slides"),
    Entry("coupled", "pendulum servo", "coupled/pendulum_servo", "motor, potentiometer, limited amplifier"),
    Entry("coupled", "motor and slider-crank", "coupled/ref_slider_crank", "a loop driven by a winding"),
    Entry("coupled", "comb drive", "coupled/ref_comb_drive", "a MEMS at resonance: small numbers, high Q"),
    Entry("coupled", "cart-pole", "bench/cart_pole", "feedback through circuit and machine"),
    Entry("coupled", "H-bridge motor", "coupled/ref_pwm_hbridge_motor", "20 kHz PWM: edges that are known",
          ("i(m1)", "omega(shaft)"), 20e-3),
    Entry("coupled", "voice coil", "coupled/voice_coil", "a force that fades with the stroke"),
    Entry("coupled", "two-link arm", "bench/two_link_arm", "two motors on two links"),
    Entry("coupled", "stiff motor", "coupled/ref_ctms_motor_position", "L/R of 0.7 us in a run of 0.2 s"),
    Entry("friction", "sled", "bench/sled", "a block that slides on a sled and sticks to it, nine times",
          ("pos(rail)", "pos(bed)"), engines=ENGINES),
    Entry("friction", "arm that rubs", "mechanical/ref_fric_arm10", "ten joints with friction: 209 events in 6 s",
          ("angle(l1)", "angle(l10)"), stop=6.0, engines=("mujoco", "exudyn")),
    Entry("friction", "bouncing ball", "mechanical/bouncing_ball", "contact: impacts without end in finite time",
          ("pos(up)",), engines=("mujoco", "exudyn")),
    Entry("friction", "pendulum at a stop", "mechanical/ref_stop_pendulum", "a rigid stop, and rest at it",
          ("angle(hinge)", "omega(hinge)"), engines=("mujoco", "exudyn")),
    Entry("transistors", "741 op-amp", "electrical/opamp_741", "a whole integrated circuit that slews"),
    Entry("transistors", "TTL gate", "electrical/ttl_nand", "transistors that saturate and recover"),
    Entry("transistors", "Colpitts oscillator", "electrical/colpitts", "a limit cycle: accuracy is phase"),
    Entry("transistors", "CMOS ring of 5", "electrical/cmos_ring", "gate capacitances, two periods"),
    Entry("transistors", "ECL gate", "electrical/ecl_gate", "transistors that never saturate"),
    Entry("transistors", "CMOS ring of 51", "bench/mos_ring51", "a hundred transistors of level 1"),
    Entry("transistors", "bipolar ring of 51", "bench/bjt_ring51", "fifty transistors with all of their charges"),
]  # fmt: skip
QUICK = ("RC, pulses", "double pendulum", "voice coil")  # of --quick


def marks(section: str) -> tuple[str, str]:
    """Between which a section of the README stands."""
    return (
        f"<!-- {section}: written by python tests/bench/suite.py --readme -->",
        f"<!-- end of {section} -->",
    )


def table(charts: Sequence[Chart], groups: Sequence[str] = tuple(GROUPS)) -> Iterator[str]:
    """One row an entry of these groups; a dash where nothing was measured. Charts are found by `name`."""
    found = {chart.name: chart for chart in charts}
    heads = [f"best at {exponent(e)} | auto | peer / auto" for e in ERRORS]
    yield f"| problem | {' | '.join(heads)} |"
    yield "|---" * (1 + 3 * len(ERRORS)) + "|"
    for entry in (e for e in SUITE if e.group in groups):
        chart = found.get(entry.name)
        cells = [cell for e in ERRORS for cell in (_cells(chart, e) if chart else ("-", "-", "-"))]
        yield f"| [{entry.name}](netlists/{entry.deck}.cir) | " + " | ".join(cells) + " |"


def _cells(chart: Chart, error: float) -> tuple[str, str, str]:
    """Best method and its time, auto's time, and how many times that the best peer takes."""
    own = [s for s in chart.own if s.name != "auto"]
    first = best(own, error, chart.distance)
    auto = chart.find("auto")
    time = auto.at(error, chart.distance) if auto else None
    mine = time if auto else (first[1] if first else None)
    return (
        f"{first[0].name} {short(first[1])}" if first else "none",
        short(time) if time is not None else "-" if auto is None else "not reached",
        _ratio([s for s in chart.series if s.group in ("ngspice", "engine")], error, chart.distance, mine),
    )


def _ratio(peers: Sequence[Series], error: float, floor: float, mine: float | None) -> str:
    """`41x ngspice`; `> 41x ngspice` where no peer got there and that one came nearest."""
    if not peers or mine is None:
        return "-"
    if not any(s.good for s in peers):
        return f"{', '.join(s.name for s in peers)}: no result"
    first = best(peers, error, floor)
    if first:
        return f"{_times(first[1] / mine)} {first[0].name}"
    # the nearest miss: what it took for its own best error is less than what it would take
    series, point = min(
        ((s, p) for s in peers for p in s.good), key=lambda pair: (pair[1].error or 0.0, pair[1].seconds)
    )
    return f"> {_times(point.seconds / mine)} {series.name} at {point.error:.0e}"


def _times(ratio: float) -> str:
    return f"{ratio:.2g}x" if ratio < 9.95 else f"{ratio:.0f}x"


def engines(charts: Sequence[Chart]) -> Iterator[str]:
    """Machines beside other engines: CPU time of each at equal error; nothing where no engine was run."""
    rows = [(c, [s for s in c.series if s.group == "engine" and s.good]) for c in charts]
    rows = [(c, series) for c, series in rows if series]
    if not rows:
        return
    programs = list(dict.fromkeys(s.name.split()[0] for _, series in rows for s in series))
    yield "| machine | error | emsim | " + " | ".join(programs) + " |"
    yield "|---" * (3 + len(programs)) + "|"
    for chart, series in rows:
        for error in ERRORS if chart.group == "friction" else (1e-6, 1e-8):
            mine = best(chart.own, error, chart.distance)
            cells = [f"{mine[0].name} {short(mine[1])}" if mine else "none"]
            for program in programs:
                its = best([s for s in series if s.name.split()[0] == program], error, chart.distance)
                ratio = f" ({_times(its[1] / mine[1])})" if its and mine else ""
                cells.append(
                    f"{its[0].name.partition(' ')[2]} {short(its[1])}{ratio}"
                    if its
                    else _missed(
                        [s for s in series if s.name.split()[0] == program], mine[1] if mine else None
                    )
                )
            yield f"| {chart.name} | {exponent(error)} | " + " | ".join(cells) + " |"


def _missed(series: Sequence[Series], mine: float | None) -> str:
    """An engine that does not get there: the least error that it got, and how many times over it took for that. A dash for
    one that was not run."""
    if not series:
        return "-"
    good = [(p.error or 0.0, p.seconds, s.name) for s in series for p in s.good]
    if not good or mine is None:
        return "not reached"
    error, seconds, name = min(good)
    return f"not reached (> {_times(seconds / mine)}: {name.partition(' ')[2]} at {error:.0e})"


def slow_auto(charts: Iterable[Chart], allowed: float = 1.3) -> Iterator[str]:
    """Where auto takes more than `allowed` times the best single method at equal error."""
    for chart in charts:
        auto = chart.find("auto")
        if auto is None:
            continue
        for k in range(2, 10):
            error = 10.0**-k
            first = best([s for s in chart.own if s.name != "auto"], error, chart.distance)
            time = auto.at(error, chart.distance)
            if first and (time is None or time > allowed * first[1]):
                took = "does not get there" if time is None else f"takes {time / first[1]:.2g}x"
                yield f"{chart.name} at {exponent(error)}: auto {took}, {first[0].name} {short(first[1])}"


def section(charts: Sequence[Chart], picture: str = "", groups: Sequence[str] = tuple(GROUPS)) -> str:
    """What stands between a section's marks."""
    parts = [f"![CPU time to reach an error, tool by tool]({picture})", ""] if picture else []
    parts += list(table(charts, groups))
    if lines := list(engines(charts)):
        parts += ["", *lines]
    return "\n".join(parts)


def into(text: str, inner: str, section: str = "suite") -> str:
    """A README with `inner` between the section's marks. ValueError where it has none."""
    first, last = marks(section)
    before, start, rest = text.partition(first)
    _, end, after = rest.partition(last)
    if not start or not end:
        raise ValueError(f"it has no {first} and {last}")
    return f"{before}{start}\n\n{inner}\n\n{end}{after}"

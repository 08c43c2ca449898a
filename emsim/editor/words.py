"""The language's words with a line of meaning each, for editors: dot cards, functions, options. What machine cards and their
parameters mean stands in the cards' own specs, what elements are in the classes of elements/."""

from __future__ import annotations

from .. import dots, functions
from ..analyses import ANALYSES
from ..assemble import options
from ..cards.joints import WORDS as JOINT_WORDS
from ..cards.joints import readers
from ..functions import BRANCHES, DRAWN, OF_TICKS, OF_TIME
from ..measures import KINDS

# dot card -> (form, meaning)
DOTS = {**{f".{a.word}": (a.form, a.meaning) for a in ANALYSES.values()}, **dots.CARDS}
# word of .meas -> (form, meaning)
MEASURES = {
    **{kind.words[0]: (kind.form.partition(", .meas")[0], kind.meaning) for kind in KINDS},
    "targ": ("targ v(b) val=0.5 fall=1", "where it ends"),
    "when": ("when v(a)=0.5 rise=2", "the place where a signal crosses a value or another signal"),
    "val": ("val=0.5", "the value that a signal crosses; as trig v(a)=0.5"),
    "rise": ("rise=1, rise=last", "which crossing upwards, counted from `td` or `from` on"),
    "fall": ("fall=1, fall=last", "which crossing downwards"),
    "cross": ("cross=1, cross=last", "which crossing, in either direction"),
    "td": ("td=1m", "crossings before this place do not count"),
    "from": ("from=1m", "where the part begins; left out: with the results"),
    "to": ("to=2m", "where the part ends"),
    "at": ("at=1m", "a place on the axis: a time, a frequency, a swept value"),
}

# function that reads the circuit or the machine -> (form, unit, meaning)
PROBES = {
    **{w: (f"{w}({readers(w)})", unit, "coordinate or speed of a joint") for w, unit in JOINT_WORDS.items()},
    "v": ("v(node) | v(a,b) | v(coupling)", "V", "voltage of a node, between two, or of a coupling"),
    "i": ("i(element) | i(coupling) | i(coupling,k)", "A", "current into the first terminal; of winding k"),
    "angle": ("angle(pin) | angle(body) | angle(a,b)", "rad", "coordinate of a pin, orientation of a body"),
    "omega": ("omega(pin) | omega(body)", "rad/s", "speed of a pin, rotation of a body"),
    "alpha": ("alpha(pin) | alpha(body)", "rad/s^2", "acceleration of a pin"),
    "pos": ("pos(slide)", "m", "coordinate of a slide"),
    "vel": ("vel(slide)", "m/s", "speed of a slide"),
    "acc": ("acc(slide)", "m/s^2", "acceleration of a slide"),
    **{c: (f"{c}(point)", "m", f"{c} of a point in the world") for c in "xyz"},
    **{f"v{c}": (f"v{c}(point)", "m/s", f"velocity of a point along {c}") for c in "xyz"},
    **{f"a{c}": (f"a{c}(point)", "m/s^2", f"acceleration of a point along {c}") for c in "xyz"},
    **{f"f{c}": (f"f{c}(joint)", "N", f"reaction on B from A along {c}, world axes") for c in "xyz"},
    **{f"m{c}": (f"m{c}(joint)", "N m", f"moment on B from A about {c}, world axes") for c in "xyz"},
    "force": ("force(card)", "N", "what a coupling or element applies"),
    "torque": ("torque(card)", "N m", "what a coupling or element applies"),
    **{w: (f"{w}(motor)", "A", f"current of a pmsm {how} its magnets") for w, how in (("id", "along"), ("iq", "across"))},
    "p": ("p(coupling)", "W", "electrical power taken"),
    "gap": ("gap(card)", "m", "distance of a STOP or CONTACT, the smaller one of two ends"),
    "slip": ("slip(card)", "m/s", "speed of what rubs: a FRICTION, a CONTACT with mu="),
    "rolling": ("rolling(contact)", "N m", "moment on P's part against rolling on Q's, of a CONTACT with rolling="),
    "drilling": ("drilling(contact)", "N m", "moment on P's part against turning about the normal, of a CONTACT with drilling="),
    "friction": ("friction(contact)", "N", "force on P's part along Q's, of a CONTACT with mu="),
    "mode": ("mode(card)", "", "FRICTION: 0 sticks, -1 1 slides; STOP: -1 1 at an end; CONTACT: 1 closed, -2 2 slides"),
    "hits": ("hits(card)", "", "how often the parts of a STOP or CONTACT have met"),
    "impulse": ("impulse(card)", "N s", "sum of the impulses of a rigid STOP or CONTACT"),
    "tension": ("tension(rope) | tension(rope,k)", "N", "with which a ROPE pulls; of its k-th stretch with grip="),
    "length": ("length(rope) | length(rope,k)", "m", "of a ROPE, without what is wound at its ends"),
    "temp": ("temp(node)", "K", "temperature of a node of heat"),
    "mmf": ("mmf(node)", "A", "magnetomotive force of a node of a magnetic circuit"),
    "pressure": ("pressure(node)", "Pa", "pressure of a node of a hydraulic circuit over that of the surroundings"),
    "heat": ("heat(card)", "W", "what goes through a HEAT, from its first node"),
    "flux": ("flux(card)", "Wb", "what goes through a MAGNETIC; of a winding out of its first node"),
    "flow": ("flow(card)", "m^3/s", "what goes through a HYDRAULIC, from its first node"),
    "energy": ("energy()", "J", "what circuit and machine hold: kinetic, potential, of fields, coils and capacitors"),
    "ke": ("ke() | ke(body)", "J", "kinetic energy"),
    "pe": ("pe()", "J", "potential energy"),
    "power": ("power() | power(card)", "W", "power brought in"),
    "loss": ("loss()", "W", "what circuit and machine turn into heat, and what diodes take"),
    "supplied": ("supplied()", "W", "what sources and drives bring in: d/dt energy() + loss()"),
}  # fmt: skip
# what their arguments name
READS = {
    **dict.fromkeys(JOINT_WORDS, ("joint",)),
    **dict.fromkeys(("angle", "omega", "alpha"), ("joint", "body")),
    **dict.fromkeys(("pos", "vel", "acc", "fx", "fy", "fz", "mx", "my", "mz"), ("joint",)),
    **dict.fromkeys(("x", "y", "z", "vx", "vy", "vz", "ax", "ay", "az"), ("point", "body")),
    **dict.fromkeys(("force", "torque", "id", "iq", "p", "gap", "slip", "friction", "rolling", "drilling"), ("card",)),
    **dict.fromkeys(("mode", "hits", "impulse", "power", "tension", "length", "heat", "flux", "flow"), ("card",)),
    "ke": ("body",), "v": ("node", "card"), "i": ("element", "card"),
}  # fmt: skip

# .options -> (unit, default, meaning)
OPTIONS = {o.name: (o.unit, o.default, o.what) for o in options.OPTIONS.values()}

# function of expressions -> (form, meaning); those that read circuit and machine are in PROBES
FUNCTIONS = {
    **{f.name: (f.form, f.what) for f in functions.FUNCTIONS},
    **BRANCHES,
    **OF_TIME,
    **OF_TICKS,
    **DRAWN,
}
# function of results, in .print, .meas, --plot, the page and Result[...] -> (form, meaning)
OF_RESULTS = {
    **{f.name: (f.form, f.what) for f in (*functions.OF_ROWS, *functions.COURSES)},
    "fft": ("fft(x)", 'spectrum of a transient, in --plot; in Python r.fft("v(out)")'),
}

# waveform -> (meaning, arguments: name, unit, what stands for one that is left out); "~" where 0 counts as left out
WAVES = {
    "PULSE": (
        "pulses with straight edges",
        "v1 V -, v2 V -, td s 0, tr s ~tstep, tf s ~tstep, pw s ~tstop, per s ~tstop, n - without_end",
    ),
    "SIN": ("a sine that begins at td and decays with theta; the phase in degrees",
            "vo V -, va V 0, freq Hz ~1/tstop, td s 0, theta 1/s 0, phase deg 0"),
    "EXP": ("two exponential steps, to v2 and back",
            "v1 V -, v2 V -, td1 s ~tstep, tau1 s ~tstep, td2 s ~td1+tstep, tau2 s ~tstep"),
    "PWL": ("straight lines between points; td= delays, r= repeats from that time on", "t1 s -, v1 V -, .. - .."),
    "SFFM": ("a sine whose frequency a sine changes",
             "vo V -, va V 0, fc Hz ~1/tstop, mdi - 0, fs Hz ~1/tstop, phc deg 0, phs deg 0"),
    "AM": ("a sine whose amplitude a sine changes; as in ngspice the phase stands in the seventh place and the sixth is ignored",
           "va V -, vo V 0, mf Hz ~1/tstop, fc Hz 0, td s 0, - - -, ph deg 0"),
    "TRNOISE": ("random: normal values every nt, 1/f noise of exponent nalpha, a telegraph signal; the same for the same seed",
                "na V -, nt s 0, nalpha - 0, namp V 0, rtsam V 0, rtscapt s 0, rtsemt s 0"),
    "TRRANDOM": ("a random value for each ts from td on; type 1 even, 2 normal, 3 exponential, 4 Poisson",
                 "type - -, ts s -, td s 0, a V 1, b V 0"),
}  # fmt: skip

# method -> (order, kind, what it is for)
METHODS = {names[0]: tuple(told) for names, *told in options.REGISTRY}


def option(name: str) -> str:
    """An option in a line: meaning, unit, default."""
    unit, default, meaning = OPTIONS[name]
    return meaning + (f" [{unit}]" if unit else "") + (f", default {default}" if default != "-" else "")


def reads(function: str) -> tuple[str, ...]:
    """Kinds of things that a probe's argument may name."""
    return READS.get(function, ())


def wave_form(word: str) -> str:
    """A waveform as it is written."""
    names = [row.split()[0] for row in WAVES[word][1].split(",")]
    return f"{word}({' '.join(names)}{' [td=] [r=]' if word == 'PWL' else ''})"


def arguments(word: str) -> list[tuple[str, str, str]]:
    """Of a waveform's arguments: name, unit, what stands for one that is left out."""
    rows = [row.split() for row in WAVES[word][1].split(",")]
    return [(name, unit, _left_out(value)) for name, unit, value in rows if name not in ("-", "..")]


def _left_out(value: str) -> str:
    if value == "-":
        return "must be given"
    word = value.removeprefix("~").replace("_", " ").replace("+", " + ")
    return word + (", *or 0*" if value.startswith("~") else "")


def commands() -> dict[str, tuple[str, str]]:
    """Commands of .control: how each is written, what it does."""
    from ..control import COMMANDS
    from ..control.program import FLOW

    found = {
        c.word: (c.form, c.meaning) for c in COMMANDS.values() if not c.meaning.startswith("passed over")
    }
    return {**found, **FLOW}


def limits() -> list[tuple[str, str]]:
    """What a .control section may write and use up."""
    from ..control.budget import BYTES, DEPTH, RESULTS, TEXT, WORK

    return [
        (
            "files",
            " ".join("." + suffix for suffix in RESULTS) + "; in place of none that emsim has not written",
        ),
        (
            "limits",
            f"{WORK:,} commands, {BYTES:,} bytes made, {TEXT:,} put into one command, {DEPTH} levels of blocks and files",
        ),
    ]


def control_functions() -> list[str]:
    """Functions of vectors."""
    from ..control.functions import EACH, WHOLE

    return sorted({*EACH, *WHOLE})

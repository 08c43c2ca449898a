"""The language's words with a line of meaning each, for editors: dot cards, functions, options. What machine cards and their
parameters mean stands in the cards' own specs, what elements are in elements.TABLE."""

from __future__ import annotations

# dot card -> (form, meaning)
DOTS = {
    ".tran": (".tran tstep tstop [tstart [tmax]] [uic]", "transient analysis [s]; uic: start from given values"),
    ".op": (".op [static]", "operating point, mechanics held where it starts; static: everything comes to rest"),
    ".param": (".param name=value [name={expression} ..]", "parameters, of the deck or of the subcircuit"),
    ".func": (".func name(a,b) {expression}", "a function for expressions"),
    ".model": (".model name type(parameter=value ..)", "a model: d, sw, csw, r, c, l, dcmotor"),
    ".subckt": (".subckt name node .. [parameter=default ..]", "begins a subcircuit; its terminals may be nodes, bodies, joints"),
    ".ends": (".ends [name]", "ends a subcircuit"),
    ".include": (".include file", "reads another file here"),
    ".lib": (".lib file section", "reads a section of a library here"),
    ".endl": (".endl [section]", "ends a section of a library"),
    ".global": (".global node ..", "nodes that mean the same in every subcircuit"),
    ".ic": (".ic v(node)=value ..", "voltages at the start, held while the operating point is found"),
    ".nodeset": (".nodeset v(node)=value ..", "where the search for the operating point starts"),
    ".print": (".print tran v(node) i(Vname) {expression} ..", "a table on stdout"),
    ".save": (".save v(node) angle(joint) .. | all", "what goes to the raw file; otherwise everything"),
    ".probe": (".probe v(node) angle(joint) ..", "the same as .save"),
    ".options": (".options name=value ..", "tolerances, method, formulation"),
    ".temp": (".temp value", "temperature [C]"),
    ".if": (".if (condition)", "cards that count where the condition is not 0"),
    ".elseif": (".elseif (condition)", "another condition of an .if"),
    ".else": (".else", "cards where no condition of the .if holds"),
    ".endif": (".endif", "ends an .if"),
    ".gravity": (".gravity [g] | gx gy [gz]", "gravity [m/s^2], 9.80665 along -y; without the card there is none"),
    ".view": (".view [fps=] [speed=] [trace=point] [scale=]", "how the machine is drawn"),
    ".title": (".title text", "another title"),
    ".end": (".end", "the end of the deck"),
}  # fmt: skip

# function that reads the circuit or the machine -> (form, unit, meaning)
PROBES = {
    "v": ("v(node) | v(a,b) | v(coupling)", "V", "voltage of a node, between two, or of a coupling"),
    "i": ("i(element) | i(coupling)", "A", "current into the first terminal"),
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
    "p": ("p(coupling)", "W", "electrical power taken"),
    "gap": ("gap(card)", "m", "distance of a STOP or CONTACT"),
    "energy": ("energy()", "J", "kinetic and potential energy of the machine and its fields"),
    "ke": ("ke() | ke(body)", "J", "kinetic energy"),
    "pe": ("pe()", "J", "potential energy"),
    "power": ("power() | power(card)", "W", "power brought in"),
    "loss": ("loss()", "W", "power turned into heat"),
}  # fmt: skip
# what their arguments name
READS = {
    **dict.fromkeys(("angle", "omega", "alpha"), ("joint", "body")),
    **dict.fromkeys(("pos", "vel", "acc", "fx", "fy", "fz", "mx", "my", "mz"), ("joint",)),
    **dict.fromkeys(("x", "y", "z", "vx", "vy", "vz", "ax", "ay", "az"), ("point", "body")),
    **dict.fromkeys(("force", "torque", "p", "gap", "power"), ("card",)),
    "ke": ("body",), "v": ("node", "card"), "i": ("element", "card"),
}  # fmt: skip

# .options -> meaning
OPTIONS = {
    "method": "integration method",
    "formulation": "coordinates of the machine: joint (the default) or absolute",
    "reltol": "relative tolerance, 1e-3",
    "abstol": "absolute tolerance of currents [A], 1e-12",
    "vntol": "absolute tolerance of voltages [V], 1e-6",
    "chgtol": "absolute tolerance of charges [C], 0: capacitors are measured in volt",
    "flxtol": "absolute tolerance of flux linkages [Wb], 0: inductors are measured in ampere",
    "lentol": "absolute tolerance of lengths [m], 1e-8 of the largest in the deck",
    "angtol": "absolute tolerance of angles [rad], 1e-8",
    "veltol": "absolute tolerance of velocities [m/s], 1e-8 sqrt(g L)",
    "spintol": "absolute tolerance of angular velocities [rad/s], 1e-6",
    "forcetol": "absolute tolerance of multipliers that are forces [N], 1e-8 of the largest weight",
    "torquetol": "absolute tolerance of multipliers that are torques [N m], 1e-8 of the largest weight and length",
    "trtol": "how far the truncation error may exceed its estimate",
    "gmin": "least conductance of a junction [S], 1e-12",
    "itl1": "Newton iterations of the operating point",
    "itl2": "Newton iterations of each of its stepping stages",
    "itl4": "Newton iterations of a time point",
    "maxord": "highest order of gear, 5; 2 is SPICE's",
    "maxsteps": "a run that would need more steps is refused with an estimate, 1e8",
    "fixed_step": "every step this long [s], no error control",
    "temp": "temperature [C], 27",
    "tnom": "temperature at which models were measured [C], 27",
    "rshunt": "resistance from every node to ground [ohm]",
    "gshunt": "conductance from every node to ground [S]",
    "cshunt": "capacitance from every node to ground [F]",
    "projection": "0: explicit methods let closed loops drift",
}  # fmt: skip


def reads(function: str) -> tuple[str, ...]:
    """Kinds of things that a probe's argument may name."""
    return READS.get(function, ())

"""Components of Qucs-S: where their ports are, what their properties are called, and the cards that they are. Facts of its
sources (qucs/components, qucs/spicecomponents); coordinates in its unit, a grid of 10, as a part stands unturned.
"""

from __future__ import annotations

import re

from ..units import infix, spice_number
from .sheet import Pin, word

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable

    from .sheet import Card, Word

LYING = "-30,0 30,0"
DRIVING = "30,0 -30,0"
FOUR = "-30,-30 30,-30 30,30 -30,30"
GATED = "-30,0 0,-30 0,30"
BASED = "0,-30 -30,0 0,30"
BJT = (
    "Type Is Nf Nr Ikf Ikr Vaf Var Ise Ne Isc Nc Bf Br Rbm Irb Rc Re Rb Cje Vje Mje Cjc Vjc Mjc Xcjc Cjs Vjs Mjs Fc Tf Xtf Vtf "
    "Itf Tr Temp Kf Af Ffe Kb Ab Fb Ptf Xtb Xti Eg Tnom Area"
)
MOS = (
    "Type Vt0 Kp Gamma Phi Lambda Rd Rs Rg Is N W L Ld Tox Cgso Cgdo Cgbo Cbd Cbs Pb Mj Fc Cjsw Mjsw Tt Nsub Nss Tpg Uo Rsh Nrd "
    "Nrs Cj Js Ad As Pd Ps Kf Af Ffe Temp Tnom"
)
JFET = "Type Vt0 Beta Lambda Rd Rs Is N Isr Nr Cgs Cgd Pb Fc M Kf Af Ffe Temp Xti Vt0tc Betatce Tnom Area"
DIODE = (
    "Is N Cj0 M Vj Fc Cp Isr Nr Rs Tt Ikf Kf Af Ffe Bv Ibv Temp Xti Eg Tbv Trs Ttt1 Ttt2 Tm1 Tm2 Tnom Area"
)
# ports, names of the properties, both in their order
PARTS: dict[str, tuple[str, str]] = {
    "R": (LYING, "R Temp Tc1 Tc2"), "Rus": (LYING, "R Temp Tc1 Tc2"), "C": (LYING, "C V"), "L": (LYING, "L I"),
    "DCBlock": (LYING, "C"), "DCFeed": (LYING, "L"), "GND": ("0,0", ""), "IProbe": (LYING, ""),
    "VProbe": ("-10,20 10,20", ""), "Vdc": (DRIVING, "U"), "Idc": (DRIVING, "I"), "Vac": (DRIVING, "U f Phase Theta VO TD"),
    "Iac": (DRIVING, "I f Phase Theta IO TD"), "Vpulse": (DRIVING, "U1 U2 T1 T2 Tr Tf"),
    "Ipulse": (DRIVING, "I1 I2 T1 T2 Tr Tf"), "Vrect": (DRIVING, "U TH TL Tr Tf Td U0"),
    "Irect": (DRIVING, "I TH TL Tr Tf Td"), "Vexp": (DRIVING, "U1 U2 T1 T2 Tr Tf"), "Iexp": (DRIVING, "I1 I2 T1 T2 Tr Tf"),
    "VCVS": (FOUR, "G T"), "VCCS": (FOUR, "G T"), "CCVS": (FOUR, "G T"), "CCCS": (FOUR, "G T"), "Tr": (FOUR, "T"),
    "MUT": (FOUR, "L1 L2 k"), "OpAmp": ("-30,20 -30,-20 40,0", "G Umax"), "Diode": (LYING, DIODE),
    "BJT": ("-30,0 0,-30 0,30 30,0", BJT), "_BJT": (GATED, BJT), "MOSFET": ("-30,0 0,-30 0,30 20,0", MOS),
    "_MOSFET": (GATED, MOS), "JFET": (GATED, JFET), "Pac": (DRIVING, "Num Z P f Temp EnableTran LoadOnly"),
    "Relais": (FOUR, "Vt Vh Ron Roff Temp"),
    "potentiometer": ("-40,0 0,-20 40,0", "R_pot Rotation Taper_Coeff LEVEL Max_Rotation"), "R_SPICE": (LYING, ""),
    "C_SPICE": (DRIVING, ""), "L_SPICE": (LYING, ""), "DIODE_SPICE": (LYING, ""), "NPN_SPICE": (BASED, ""),
    "PNP_SPICE": (BASED, ""), "NJF_SPICE": (BASED, ""), "PJF_SPICE": (BASED, ""), "MESFET_SPICE": (BASED, ""),
    "PMF_MESFET_SPICE": (BASED, ""), "NMOS_SPICE": (BASED + " 20,0", ""), "PMOS_SPICE": (BASED + " 20,0", ""),
    "MOS_SPICE": (BASED + " 20,0", ""), "BJT_SPICE": (BASED + " 30,0", ""),
    "LTL_SPICE": ("-30,-10 -30,10 30,-10 30,10", "Z0 Td F Nl"), "S4Q_V": (DRIVING, ""), "S4Q_I": (DRIVING, ""),
    "S4Q_Ieqndef": (DRIVING, ""), "src_eqndef": (DRIVING, ""), "S4Q_W": (LYING, ""),
    "S4Q_S": ("-30,0 30,0 10,-30 -10,-30", ""), "vPWL": (DRIVING, ""), "iPWL": (DRIVING, ""), "eNL": (DRIVING, ""),
    "gNL": (DRIVING, ""),
}  # fmt: skip
# the letters of those whose properties are the rest of their card
AS_WRITTEN = {
    "R_SPICE": "R", "C_SPICE": "C", "L_SPICE": "L", "DIODE_SPICE": "D", "NPN_SPICE": "Q", "PNP_SPICE": "Q", "NJF_SPICE": "J",
    "PJF_SPICE": "J", "MESFET_SPICE": "Z", "PMF_MESFET_SPICE": "Z", "NMOS_SPICE": "M", "PMOS_SPICE": "M", "S4Q_V": "V",
    "S4Q_I": "I", "S4Q_Ieqndef": "B", "src_eqndef": "B", "S4Q_W": "W", "S4Q_S": "S", "vPWL": "V", "iPWL": "I", "eNL": "E",
    "gNL": "G",
}  # fmt: skip
# parameters of Qucs' models that SPICE's do not have
INFINITE = ("Ikf", "Ikr", "Vaf", "Var", "Irb", "Bv")  # where they are 0
UNKNOWN = frozenset(
    "Type Temp Ffe Kb Ab Fb Area Cp Isr Nr Ttt1 Ttt2 Tm1 Tm2 Vt0tc Betatce Rg Tt_mos W L Nrd Nrs Ad As Pd Ps".split()
)
EMPTY = re.compile(r"\s*\w*=\s*$")  # a line that its owner left as it came
UNIT = re.compile(
    r"^([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([Mm]eg|[TGMkmunpfa\u00b5\u03bc]?)\s*(?:[Oo]hms?|Hz|dBm|[FHVASsmWva])?$"
)


def value(given: Word) -> Word:
    """A value in SPICE's letters: 10 MHz is 10Meg; a name or a formula stands in braces."""
    text = given.strip()
    found = UNIT.match(text)
    if found:
        scale = {"M": "Meg", "\u00b5": "u", "\u03bc": "u"}.get(found[2], found[2])
        return word(found[1] + scale, given.line, given.col)
    if text[:1] == "'" and text[-1:] == "'":
        text = text[1:-1]
    # 4k7 is judged where it is read as a number: in Qucs-S ngspice reads it as 4k
    plain = text[:1] == "{" or text == "" or infix(text) is not None
    return word(text if plain else "{" + text + "}", given.line, given.col)


class Part:
    """A component: `kind`, `name`, its properties by position and by name, its pins."""

    def __init__(self, kind: str, name: Word, given: list[Word], pins: list[Pin]) -> None:
        self.kind, self.name, self.given, self.pins = kind, name, given, pins
        names = PARTS[kind][1].split() if kind in PARTS else []
        self.of = dict(zip(names, given, strict=False))

    def value(self, name: str, default: str = "0") -> Word:
        found = self.of.get(name)
        return value(found if found is not None and found.strip() else word(default))

    def named(self, letter: str) -> Word:
        text = str(self.name)
        return word(text if text[:1].upper() == letter else letter + text, self.name.line, self.name.col)


def cards(p: Part) -> list[Card] | None:
    """The cards of a component; None where it has none here."""
    if p.kind in AS_WRITTEN:
        return _as_written(p)
    make = MAKE.get(p.kind)
    return None if make is None else make(p)


def _as_written(p: Part) -> list[Card]:
    """A card whose rest are the component's properties; lines behind the first are cards of their own, or go on with +."""
    first, *more = [*p.given[:5], word("")]
    pins = p.pins if p.kind not in ("S4Q_S",) else [p.pins[0], p.pins[1], p.pins[2], p.pins[3]]
    before = {"src_eqndef": "V=", "S4Q_Ieqndef": "I="}.get(p.kind, "")
    before = "" if re.match(r"[VI]\s*=", first.strip(), re.I) else before
    found: list[Card] = [[p.named(AS_WRITTEN[p.kind]), *pins, before, first]]
    for line in more:
        if EMPTY.match(line):
            continue
        if line.strip()[:1] == "+":
            found[-1].append(word(line.strip()[1:].strip(), line.line, line.col))
        elif line.strip():
            found.append([word(line.strip(), line.line, line.col)])
    return found


def _two(letter: str, key: str, more: str = "") -> Callable[[Part], list[Card]]:
    def make(p: Part) -> list[Card]:
        start = p.of.get(more, word("")).strip() if more else ""
        own: list[Card] = [
            [p.named(letter), *p.pins, p.value(key), *([f"ic={value(word(start))}"] if start else [])]
        ]
        return own

    return make


def _resistor(p: Part) -> list[Card]:
    drift = [f"{k.lower()}={p.value(k)}" for k in ("Tc1", "Tc2") if spice_number(p.value(k))]
    return [[p.named("R"), *p.pins, p.value("R"), *drift]]


def _sine(letter: str, size: str, offset: str) -> Callable[[Part], list[Card]]:
    def make(p: Part) -> list[Card]:
        v = p.value
        wave = f"SIN({v(offset)} {v(size)} {v('f')} {v('TD')} {v('Theta')} {v('Phase')})"
        return [
            [
                p.named(letter),
                *p.pins,
                f"DC {v(offset)}",
                f"AC {v(size)} {v('Phase')}",
                word(wave, p.name.line, p.name.col),
            ]
        ]

    return make


def _pulse(letter: str, low: str, high: str) -> Callable[[Part], list[Card]]:
    def make(p: Part) -> list[Card]:
        v = p.value
        width = f"{{({_bare(v('T2'))})-({_bare(v('T1'))})-({_bare(v('Tr'))})-({_bare(v('Tf'))})}}"
        return [
            [
                p.named(letter),
                *p.pins,
                "DC 0",
                f"PULSE({v(low)} {v(high)} {v('T1')} {v('Tr')} {v('Tf')} {width})",
            ]
        ]

    return make


def _power(p: Part) -> list[Card]:
    """A port: a source behind Z, of which P is what it can give: 2 sqrt(2 Z P) behind it, P in dBm."""
    z, number, f = p.value("Z", "50"), p.value("Num", "1"), p.value("f")
    level = spice_number(p.value("P"))
    text = p.of.get("P", word("")).strip()
    given = p.of.get("LoadOnly", word("")).strip() != "true" and text != ""
    size = (
        f"{{2*sqrt(2*({_bare(z)})*1m)*10**(({_bare(p.value('P')) if level is None else f'{level:g}'})/20)}}"
        if given
        else "0"
    )
    wave = [f"SIN(0 {size} {f})"] if given and p.of.get("EnableTran", word("true")).strip() != "false" else []
    return [[p.named("V"), *p.pins, "DC 0", f"AC {size}", *wave, f"portnum {number}", f"z0 {z}"]]


def _square(letter: str, size: str) -> Callable[[Part], list[Card]]:
    def make(p: Part) -> list[Card]:
        v = p.value
        period = "+".join(f"({_bare(v(k))})" for k in ("TH", "TL", "Tr", "Tf"))
        wave = f"PULSE({v('U0')} {v(size)} {v('Td')} {v('Tr')} {v('Tf')} {v('TH')} {{{period}}})"
        return [[p.named(letter), *p.pins, "DC 0", wave]]

    return make


def _rise(letter: str, low: str, high: str) -> Callable[[Part], list[Card]]:
    def make(p: Part) -> list[Card]:
        v = p.value
        return [
            [
                p.named(letter),
                *p.pins,
                "DC 0",
                f"EXP({v(low)} {v(high)} {v('T1')} {v('Tr')} {v('T2')} {v('Tf')})",
            ]
        ]

    return make


def _bare(text: Word) -> str:
    return text.strip("{}")


def _by_voltage(letter: str) -> Callable[[Part], list[Card]]:
    """Ports: control +, output +, output -, control -."""
    return lambda p: [[p.named(letter), p.pins[1], p.pins[2], p.pins[0], p.pins[3], p.value("G", "1")]]


def _by_current(letter: str) -> Callable[[Part], list[Card]]:
    def make(p: Part) -> list[Card]:
        sense = f"V{p.name}_in"
        return [
            [p.named(letter), p.pins[1], p.pins[2], sense, p.value("G", "1")],
            [sense, p.pins[0], p.pins[3], "DC 0"],
        ]

    return make


def _transformer(p: Part) -> list[Card]:
    """An ideal one, driven on its first side: v2 = v1/T, i1 = -i2/T."""
    t, inner = _bare(p.value("T", "1")), f"{p.name}_2"
    return [
        [f"E{p.name}", inner, p.pins[2], p.pins[0], p.pins[3], f"{{1/({t})}}"],
        [f"V{p.name}", p.pins[1], inner, "DC 0"],
        [f"F{p.name}", p.pins[0], p.pins[3], f"V{p.name}", f"{{-1/({t})}}"],
    ]


def _coupled(p: Part) -> list[Card]:
    a, b = f"L{p.name}_1", f"L{p.name}_2"
    return [
        [a, p.pins[0], p.pins[3], p.value("L1")],
        [b, p.pins[1], p.pins[2], p.value("L2")],
        [f"K{p.name}", a, b, p.value("k")],
    ]


def _amplifier(p: Part) -> list[Card]:
    """G times the difference, not beyond Umax. Ports: -, +, output."""
    g, most = _bare(p.value("G")), _bare(p.value("Umax"))
    law: list[str | Pin] = [
        "V={limit((",
        g,
        ")*(V(",
        p.pins[1],
        ")-V(",
        p.pins[0],
        ")),-(",
        most,
        "),(",
        most,
        "))}",
    ]
    joined = _Joined(law)
    return [[p.named("B"), p.pins[2], "0", joined]]


class _Joined(Pin):
    """Pieces without blanks between them, of which pins become their nets."""

    def __init__(self, pieces: list[str | Pin]) -> None:
        super().__init__(0, 0, "", word(""))
        self.pieces = pieces

    @property
    def net(self) -> str:
        return "".join(piece.net if isinstance(piece, Pin) else piece for piece in self.pieces)

    @net.setter
    def net(self, _: str) -> None:
        pass


def _model(
    p: Part, letter: str, kind: str, order: tuple[int, ...], own: str, renamed: dict[str, str]
) -> list[Card]:
    """An element with a model of its own; `own` are properties of the element."""
    name = p.named(letter)
    model = f"{letter}MOD_{p.name}"
    said = [
        f"{renamed.get(k, k)}={p.value(k)}"
        for k, v in p.of.items()
        if k not in UNKNOWN
        and v.strip()
        and not (k in INFINITE and p.value(k) in ("0", "0.0"))
        and renamed.get(k, k)
    ]
    more = [
        f"{k}={p.value(k)}"
        for k in own.split()
        if p.of.get(k, word("")).strip() and (letter != "M" or p.value(k) not in ("0", "0.0"))
    ]
    pins = [p.pins[k] for k in order if k < len(p.pins)]
    return [
        [name, *pins, model, *more],
        [f".model {model} {kind}(", word(" ".join(said), p.name.line, p.name.col), ")"],
    ]


def _diode(p: Part) -> list[Card]:
    return _model(p, "D", "D", (1, 0), "Area", {"Cj0": "cjo", "Tbv": "tcv", "Trs": ""})


def _bipolar(p: Part) -> list[Card]:
    kind = "PNP" if p.of.get("Type", word("")).lower() == "pnp" else "NPN"
    return _model(p, "Q", kind, (1, 0, 2, 3), "Area", {})


def _mosfet(p: Part) -> list[Card]:
    kind = "PMOS" if p.of.get("Type", word("")).lower().startswith("p") else "NMOS"
    found = _model(p, "M", kind, (1, 0, 2, 3), "L W Ad As Pd Ps", {"Vt0": "vto", "N": "", "Tt": ""})
    if len(p.pins) == 3:
        found[0].insert(4, p.pins[2])
    return found


def _jfet(p: Part) -> list[Card]:
    kind = "PJF" if p.of.get("Type", word("")).lower().startswith("p") else "NJF"
    return _model(p, "J", kind, (1, 0, 2), "Area", {"Vt0": "vto", "N": "", "M": "", "Xti": ""})


def _relay(p: Part) -> list[Card]:
    v, model = p.value, f"SMOD_{p.name}"
    on = v("Ron") if spice_number(v("Ron")) else "1e-6"
    law = f".model {model} SW(vt={v('Vt')} vh={v('Vh')} ron={on} roff={v('Roff')})"
    return [[p.named("S"), p.pins[1], p.pins[2], p.pins[0], p.pins[3], model], [law]]


def _pot(p: Part) -> list[Card]:
    r, at, most = (
        _bare(p.value(k, d)) for k, d in (("R_pot", "10k"), ("Rotation", "120"), ("Max_Rotation", "240"))
    )
    return [
        [f"R{p.name}_1", p.pins[0], p.pins[1], f"{{({r})*({at})/({most})}}"],
        [f"R{p.name}_2", p.pins[1], p.pins[2], f"{{({r})*(1-({at})/({most}))}}"],
    ]


MAKE: dict[str, Callable[[Part], list[Card]]] = {
    "R": _resistor, "Rus": _resistor, "C": _two("C", "C", "V"), "L": _two("L", "L", "I"), "DCBlock": _two("C", "C"),
    "DCFeed": _two("L", "L"), "Vdc": lambda p: [[p.named("V"), *p.pins, "DC", p.value("U")]],
    "Idc": lambda p: [[p.named("I"), *p.pins, "DC", p.value("I")]], "Vac": _sine("V", "U", "VO"),
    "Iac": _sine("I", "I", "IO"), "Vpulse": _pulse("V", "U1", "U2"), "Ipulse": _pulse("I", "I1", "I2"),
    "Vrect": _square("V", "U"), "Irect": _square("I", "I"), "Vexp": _rise("V", "U1", "U2"), "Iexp": _rise("I", "I1", "I2"),
    "VCVS": _by_voltage("E"), "VCCS": _by_voltage("G"), "CCVS": _by_current("H"), "CCCS": _by_current("F"),
    "IProbe": lambda p: [[p.named("V"), *p.pins, "DC 0"]], "VProbe": lambda p: [], "Tr": _transformer, "MUT": _coupled,
    "OpAmp": _amplifier, "Diode": _diode, "BJT": _bipolar, "_BJT": _bipolar, "MOSFET": _mosfet, "_MOSFET": _mosfet,
    "JFET": _jfet, "Pac": _power, "Relais": _relay, "potentiometer": _pot,
    "LTL_SPICE": lambda p: [[p.named("T"), *p.pins, *(f"{k}={p.value(k)}" for k in ("Z0", "Td") if k in p.of)]],
}  # fmt: skip

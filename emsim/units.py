"""Numbers and units: SPICE's rule on electrical cards, SI with checked units on machine cards.

SPICE scales by the first letters after a number and ignores the rest: `10kohm` is 1e4, and `5N` is 5 nano. `a` is
no scale: `5A` is five ampere, as in ngspice up to 39 (later releases make 5e-18 of it). On machine cards scale
suffixes still scale (`30m` is 0.03), the units of `UNITS` convert, and any other letters are an error that shows how
SPICE would have read them. Nothing is ever silently wrong by a thousand.
"""

from __future__ import annotations

from math import pi

ABSOLUTE_ZERO = -273.15  # [C]
SCALES = {
    "t": 1e12,
    "g": 1e9,
    "k": 1e3,
    "m": 1e-3,
    "u": 1e-6,
    "µ": 1e-6,  # micro sign
    "μ": 1e-6,  # Greek mu
    "n": 1e-9,
    "p": 1e-12,
    "f": 1e-15,
}
_LONG_SCALES = {"meg": 1e6, "mil": 25.4e-6}
_SCALE_NAMES = {
    "t": "tera", "g": "giga", "k": "kilo", "m": "milli", "u": "micro", "µ": "micro", "μ": "micro", "n": "nano",
    "p": "pico", "f": "femto", "meg": "mega", "mil": "mil (25.4 um)",
}  # fmt: skip

# what the letters after a number may say on a machine card, in SI
UNITS = {
    "kg": 1.0,
    "mm": 1e-3,
    "cm": 1e-2,
    "um": 1e-6,
    "deg": pi / 180.0,
    "rad": 1.0,
    "rpm": 2.0 * pi / 60.0,
    "bar": 1e5,
    "degc": 1.0,  # from its own zero: `machine_number`
}
# units that people write, with what to write instead; values on machine cards are SI already
_KNOWN_UNITS = {
    "n": ("newton", 1.0), "nm": ("newton metre", 1.0), "s": ("second", 1.0), "ms": ("millisecond", 1e-3),
    "us": ("microsecond", 1e-6), "kgm2": ("kg m^2", 1.0), "km": ("kilometre", 1e3), "kn": ("kilonewton", 1e3),
    "mn": ("millinewton", 1e-3), "j": ("joule", 1.0), "w": ("watt", 1.0), "kw": ("kilowatt", 1e3),
    "ohm": ("ohm", 1.0), "kohm": ("kiloohm", 1e3), "h": ("henry", 1.0), "mh": ("millihenry", 1e-3),
    "uh": ("microhenry", 1e-6), "v": ("volt", 1.0), "mv": ("millivolt", 1e-3), "in": ("inch", 0.0254),
    "inch": ("inch", 0.0254), "ft": ("foot", 0.3048), "lb": ("pound", 0.45359237), "mg": ("milligram", 1e-6),
    "degree": ("degree", pi / 180), "degrees": ("degree", pi / 180), "hz": ("hertz", 1.0), "a": ("ampere", 1.0),
    "ma": ("milliampere", 1e-3),
}  # fmt: skip
# units whose letters SPICE drops or reads as something else; worth a word where an expression uses them
MISREAD_UNITS = ("kg", "cm", "deg", "rpm")

# suffixes that people take for something else: (SPICE's reading, what was meant, what to write after the digits)
MISREAD_SUFFIXES = {
    "N": ("nano", "newton", ""),
    "g": ("giga", "gram", "m"),
    "G": ("giga", "gram", "m"),
    "M": ("milli", "mega", "meg"),
}

# 5N/m, 20mNm/A, 3N*m: (scale letter, unit)
_COMPOUND = r"([munk]?)((?:N|Nm|V|A|J|kg|m|rad)[/*](?:m|s|A|rad|deg)[\w/*^]*)"
_DIGITS = "0123456789"


def split_number(text: str) -> tuple[str, str] | None:
    """(mantissa with exponent, the rest) of a word that begins as a number; None when it does not. Before an exponent
    stands an e, or a d as in Fortran."""
    i, n = 0, len(text)
    if i < n and text[i] in "+-":
        i += 1
    first = i
    while i < n and text[i] in _DIGITS:
        i += 1
    digits = i - first
    if i < n and text[i] == ".":
        i += 1
        first = i
        while i < n and text[i] in _DIGITS:
            i += 1
        digits += i - first
    if not digits:
        return None
    if i < n and text[i] in "eEdD":
        j = i + 1
        if j < n and text[j] in "+-":
            j += 1
        first = j
        while j < n and text[j] in _DIGITS:
            j += 1
        if j > first:
            i = j
    return text[:i].replace("d", "e").replace("D", "e"), text[i:]


def scale_of(letters: str) -> tuple[float, str]:
    """SPICE's reading of the letters after a number: (factor, the letters that made it)."""
    low = letters.lower()
    if low[:3] in _LONG_SCALES:
        return _LONG_SCALES[low[:3]], letters[:3]
    if low and low[0] in SCALES:
        return SCALES[low[0]], letters[0]
    return 1.0, ""


def spice_number(text: str) -> float | None:
    """A word as SPICE reads it, or None when it does not begin as a number. See `spice_leftover`."""
    parts = split_number(text)
    if parts is None:
        return None
    mantissa, letters = parts
    if not letters:
        return float(mantissa)
    used = scale_of(letters)[1].lower()
    if used in _EXPONENTS and "e" not in mantissa and "E" not in mantissa:
        return float(mantissa + _EXPONENTS[used])  # one rounding: 1.1n is the double nearest to 1.1e-9
    return float(mantissa) * scale_of(letters)[0]


_EXPONENTS = {
    "t": "e12", "g": "e9", "meg": "e6", "k": "e3", "m": "e-3", "u": "e-6", "µ": "e-6", "μ": "e-6", "n": "e-9",
    "p": "e-12", "f": "e-15",
}  # fmt: skip


def infix(text: str) -> str | None:
    """4k7 with its letter at the end, 4.7k; None of any other word. LTspice reads it so, SPICE as 4k."""
    digits = text.lstrip("+-0123456789")
    letter = scale_of(digits.rstrip("0123456789"))[1]
    whole, behind = text[: len(text) - len(digits)], digits[len(letter) :]
    return (
        f"{whole}.{behind}{letter}" if letter and behind.isdigit() and whole.lstrip("+-").isdigit() else None
    )


# what may stand behind the scale letter and means nothing; the engine's number.rs has the same list
TRAILING_UNITS = frozenset(
    """a adc aac amp amps ampere amperes aohm aohms c db deg degc degrees f farad farads h henrys henries henry hertz hy hz j
    m meter meters ohm ohms r rad s sec second seconds secs v va vac vdc volt volts vpp vrms w watt watts""".split()
)


def spice_leftover(text: str) -> str:
    """What SPICE ignores at the end of a number word and a person may have meant: all that is no unit behind a scale letter.
    1Farad is among it, a femto and `arad`."""
    parts = split_number(text)
    letters = (parts[1] if parts else text).removesuffix("%")
    rest = letters[len(scale_of(letters)[1]) :].lower()
    return letters if rest and rest not in TRAILING_UNITS and rest not in "\u03c9\u2126" else ""


def machine_number(text: str) -> float | None:
    """A word on a machine card in SI, or None when it is not a number there (see `machine_number_problem`)."""
    parts = split_number(text)
    if parts is None:
        return None
    mantissa, letters = parts
    low = letters.lower()
    if not low or low in _EXPONENTS or low == "mil":
        return spice_number(text)
    if low == "degc":
        return float(mantissa) - ABSOLUTE_ZERO
    if low in UNITS:
        return float(mantissa) * UNITS[low]
    return None


def known_unit(text: str) -> float | None:
    """A number with a unit that people write and machine cards do not take, 0.3mH, in SI."""
    parts = split_number(text)
    known = _KNOWN_UNITS.get(parts[1].lower()) if parts else None
    return None if known is None or parts is None else float(parts[0]) * known[1]


def machine_number_problem(text: str) -> tuple[str, str, str | None]:
    """(message, hint, what to write instead) for a word that begins as a number but is none on a machine card."""
    parts = split_number(text)
    assert parts is not None
    mantissa, letters = parts
    import re

    if compound := re.fullmatch(_COMPOUND, letters):
        plain = f"{mantissa}{compound[1]}"
        return f"`{text}` carries a unit", f"values on machine cards are SI: write `{plain}`", plain
    if not letters.isalpha():
        said = f"`{text}` is not a number"
        if any(c in letters for c in "*/+-^"):
            return said, f"write a calculation in braces: {{{text}}}", f"{{{text}}}"
        return said, "write a number, with a scale suffix or one of the units " + " ".join(UNITS), None
    _, used = scale_of(letters)
    reading = f"{mantissa} {_SCALE_NAMES[used.lower()]}" if used else mantissa
    low = letters.lower()
    message = f"`{letters}` is no unit here; SPICE would read `{text}` as {reading}"
    if low in _KNOWN_UNITS:
        name, size = _KNOWN_UNITS[low]
        value = f"{float(mantissa) * size:.12g}"
        return message, f"values on machine cards are SI: for {mantissa} {name} write `{value}`", value
    return message, "values on machine cards are SI; units understood: " + " ".join(UNITS), None


# ---- units of products ----

# kg, m, s, A, rad-like words, and all else by its own name
_IN_BASE: dict[str, dict[str, int]] = {
    "kg": {"kg": 1}, "m": {"m": 1}, "s": {"s": 1}, "A": {"A": 1},
    "N": {"kg": 1, "m": 1, "s": -2}, "J": {"kg": 1, "m": 2, "s": -2}, "W": {"kg": 1, "m": 2, "s": -3},
    "C": {"A": 1, "s": 1}, "V": {"kg": 1, "m": 2, "s": -3, "A": -1}, "Ohm": {"kg": 1, "m": 2, "s": -3, "A": -2},
    "S": {"kg": -1, "m": -2, "s": 3, "A": 2}, "F": {"kg": -1, "m": -2, "s": 4, "A": 2},
    "H": {"kg": 1, "m": 2, "s": -2, "A": -2}, "Wb": {"kg": 1, "m": 2, "s": -2, "A": -1}, "Hz": {"s": -1},
    "Pa": {"kg": 1, "m": -1, "s": -2}, "K": {"K": 1},
}  # fmt: skip
# what a product is called, where it has a name
_NAMED = ("V", "A", "W", "J", "Ohm", "S", "F", "H", "Wb", "N", "m", "kg", "s", "Hz", "Pa", "K")


def product(a: str, b: str, sign: int = 1) -> str:
    """The unit of a product (or, sign -1, a quotient) of quantities in these units: V and A make W, V and s Wb, N m and rad/s W.
    An angle counts for nothing in an energy or a power. What has no name of its own is written out: V^2, A/s."""
    if not b:
        return a
    ours, others = _base(a), _base(b)
    if ours is None or others is None:
        return _written(a, b, sign)
    total = {key: ours.get(key, 0) + sign * others.get(key, 0) for key in {**ours, **others}}
    total = {key: power for key, power in total.items() if power}
    without = {key: power for key, power in total.items() if key != "rad"}
    if without != total:
        for name in ("W", "J", "N"):
            if _IN_BASE[name] == without:
                return name
    if not total:
        return ""
    for name in _NAMED:
        if _IN_BASE[name] == total:
            return name
    return _written(a, b, sign)


def quotient(a: str, b: str) -> str:
    """The unit of a/b: V/A is Ohm, V/V nothing, V/s stays V/s."""
    return product(a, b, -1)


def _factors(unit: str) -> dict[str, int]:
    """ "N m/s^2" -> {"N": 1, "m": 1, "s": -2}."""
    found: dict[str, int] = {}
    for k, part in enumerate(unit.split("/")):
        for word in part.split():
            name, _, power = word.partition("^")
            if name != "1":
                found[name] = found.get(name, 0) + (1 if k == 0 else -1) * int(power or 1)
    return found


def _base(unit: str) -> dict[str, int] | None:
    """In kg, m, s, A, rad; None where the unit is none of SI's, such as dB."""
    total: dict[str, int] = {}
    try:
        factors = _factors(unit)
    except ValueError:
        return None
    for name, power in factors.items():
        if name != "rad" and name not in _IN_BASE:
            return None
        for key, one in ({"rad": 1} if name == "rad" else _IN_BASE[name]).items():
            total[key] = total.get(key, 0) + power * one
    return {key: power for key, power in total.items() if power}


def _written(a: str, b: str, sign: int) -> str:
    """Both, written out: V^2, V/s, 1/s."""
    try:
        total = _factors(a)
        for name, power in _factors(b).items():
            total[name] = total.get(name, 0) + sign * power
    except ValueError:
        return ""

    def side(of: int) -> str:
        return " ".join(n if abs(p) == 1 else f"{n}^{abs(p)}" for n, p in total.items() if p * of > 0)

    above, below = side(1), side(-1)
    return above if not below else f"{above or 1}/{below.replace(' ', '/')}"

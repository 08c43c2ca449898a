"""Units written after numbers, against what the numbers measure.

`Param.unit` says what a parameter is in. Where that is "rad or m" the joint decides: an angle where it turns, a
length where it slides, coordinate by coordinate. So this runs when names are resolved, for all cards alike. A
number inside a calculation is not judged: 2/30mm is a fine stiffness.
"""

from __future__ import annotations

from math import pi

from ..deck import Waveform
from ..units import split_number

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..diagnostics import Sink, Span
    from .base import Card

# what may be written after a number -> units of parameters it fits; mm for a speed is mm/s, as deg is deg/s
FITS = {
    "kg": ("kg",),
    "mm": ("m", "m/s"),
    "cm": ("m", "m/s"),
    "um": ("m", "m/s"),
    "deg": ("rad", "rad/s"),
    "rad": ("rad", "rad/s"),
    "rpm": ("rad/s",),
    "bar": ("Pa",),
    "degc": ("K",),
}
OF_MOTION = {"turn": ("rad", "rad/s"), "slide": ("m", "m/s")}
WHERE = {"turn": " where a joint turns", "slide": " where a joint slides"}
LEVELS = 2  # arguments of a waveform that are levels; of a PWL every second one is


def check(card: Card, motions: Sequence[str], sink: Sink) -> bool:
    """Reports numbers whose unit does not fit; False after an error. `motions` are those of the joint that the card
    is or sits on, "turn" or "slide" a coordinate; empty where there is none."""
    good = True
    title = f"{card.spec.word} {card.name}"
    counts: dict[str, int] = {}
    for key, value in card.raw.params.items():
        counts[key] = len(value) if isinstance(value, tuple) else 1
    for key, wave, place, unit, at in card.raw.units:
        what, where = f"{key}= of {title}", ""
        if not key or card.spec.word == "POINT":
            what, wanted = f"a point of {title}" if not key else title, ["m"]
        elif key not in card.spec.params or card.spec.params[key].kind in ("word", "flag", "heat", "owner"):
            continue
        elif wave and not (place % 2 if wave == "pwl" else place < LEVELS):
            what, wanted = f"argument {place + 1} of {wave.upper()} of {title}", ["s, Hz or degrees"]
        else:
            wanted = _alternatives(card.spec.params[key].unit)
            motion = _motion(card, key, 0 if wave else place, counts.get(key, 1), motions)
            if motion and (narrow := [u for u in wanted if u in OF_MOTION[motion]]):
                if len(wanted) > 1:
                    where = WHERE[motion]
                speed = key == "ic" and place >= len(motions)
                wanted = [u for u in OF_MOTION[motion] if u.endswith("/s")] if speed else narrow[:1]
        if any(u in FITS[unit] for u in wanted) or (key == "axis" and counts[key] == 1):
            continue  # a direction that is one angle: told as such
        is_in = f"is in {' or '.join(wanted)}" if wanted else "has no unit"
        sink.error("E256", f"{what} {is_in}{where}; {unit} does not fit", at)
        good = False
    _degrees(card, motions, sink)
    return good


def number_fits(card: Card, key: str, text: str, motions: Sequence[str], at: Span, sink: Sink) -> None:
    """E256 where the unit behind one number of a .model does not fit the card's parameter."""
    split = split_number(text)
    unit = split[1].lower() if split else ""
    if unit not in FITS:
        return
    wanted = [u.partition(" (")[0] for u in _alternatives(card.spec.params[key].unit)]
    if unit == "kg" and motions == ("slide",) and "(kg)" in card.spec.params[key].unit:
        return
    if not any(u in FITS[unit] for u in wanted):
        is_in = f"is in {' or '.join(wanted)}" if wanted else "has no unit"
        sink.error(
            "E256", f"{key}= of a .model for {card.spec.word} {card.name} {is_in}; {unit} does not fit", at
        )


def _degrees(card: Card, motions: Sequence[str], sink: Sink) -> None:
    """Warns of angles that read like degrees: whole multiples of 5 from 10 on, without a unit."""
    with_unit = {(key, place) for key, _, place, _, _ in card.raw.units}
    for key, value in card.raw.params.items():
        param = card.spec.params.get(key)
        if param is None or "rad" not in (units := _alternatives(param.unit)):
            continue
        values = value if isinstance(value, tuple) else (value,)
        if isinstance(value, Waveform):
            values = tuple(value.args if value.kind == "pwl" else value.args[:LEVELS])
        for place, number in enumerate(values):
            if isinstance(value, Waveform):
                motion, is_angle = _motion(card, key, 0, 1, motions), value.kind != "pwl" or place % 2 == 1
            else:
                motion = _motion(card, key, place, len(values), motions)
                is_angle = not (key == "ic" and place >= len(motions))
            if (motion != "turn" and len(units) > 1) or not is_angle or (key, place) in with_unit:
                continue
            if isinstance(number, (int, float)) and abs(number) >= 10 and number % 5 == 0:
                sink.warning(
                    "W239",
                    f"{key}= of {card.spec.word} {card.name} is {number:g} rad, {abs(number) / (2 * pi):.1f} turns",
                    card.place(key),
                    f"angles are in radians; degrees are written {number:g}deg",
                )
                break


def _alternatives(unit: str) -> list[str]:
    """The units that a parameter's text names."""
    named = unit.replace(", and per second", " or rad/s or m/s").split(" or ")
    return [u.strip() for u in named if u.strip()]


def _motion(card: Card, key: str, place: int, count: int, motions: Sequence[str]) -> str:
    """Of the coordinate that a number is for; "" where that is open."""
    if not motions or card.spec.word != "JOINT":
        return motions[0] if motions else ""
    if key not in ("zero", "guess", "ic"):
        return ""
    if count == 1 and (kind := getattr(card, "kind", None)) is not None:  # see Joint._placed
        return motions[kind.main]
    return motions[place % len(motions)]

"""What shapes that share a place must know of each other, once all are there (drawing.py).

bones   to      everything that is fastened to them
        spin    radius of one that is nothing but a wheel [m]: the largest of its gears, else the one that its inertia says
        round   radius that its CONTACT gives it [m];  hidden: what it looks like is drawn by its gear or its cam
joint, what is elastic at one   below   a motor covers it
elastic         ahead    its wall is in front of the slide: behind is a cam
POT             rings    how many others lie within it
GEAR            radii    of its wheels [m], teeth  their numbers
                law      how they mesh: "outer", "inner" (the larger is a ring), "idler" (one is between them)
                known    which of its wheels stands as an earlier gear says, by  the number of that
                lead     a slide and a pin: "screw", "rope" or "string" (unwound from a wheel that hangs in it), r its radius [m]
CAM             slots    of a Geneva wheel
FRICTION        plates   of a clutch: where the two shafts stand
"""

from __future__ import annotations

from math import hypot, pi

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    Shape = dict[str, Any]


def arrange(shapes: list[Shape]) -> None:
    pots: dict[str, int] = {}
    motors = {str(s["a"]) for s in shapes if s["kind"] == "motor"}
    cams = [s for s in shapes if s["kind"] == "cam"]
    wheels: dict[int, float] = {}
    drawn: set[int] = set()  # bodies that their gear or their cam draws
    for k, s in enumerate(shapes):
        if s["kind"] == "pot":
            s["rings"] = pots[str(s["a"])] = pots.get(str(s["a"]), -1) + 1
        elif s["kind"] == "joint" or (s["kind"] in ("spring", "damper") and "a" in s):
            s["below"] = str(s["a"]) in motors
            s["ahead"] = any(cam["first"]["b"] == s["b"] for cam in cams)
        elif s["kind"] == "gear":
            _geared(s, shapes[:k], wheels, drawn)
        elif s["kind"] == "cam":
            drawn |= _profiled(s)
        elif s["kind"] == "friction" and s["joint"] == "pin" and s["b"][0] and s["a"][0]:
            s["plates"] = True
    for s in shapes:
        if s["kind"] == "bones":
            _boned(s, shapes, wheels, drawn)


def _boned(s: Shape, shapes: list[Shape], wheels: dict[int, float], drawn: set[int]) -> None:
    body = int(s["at"][0])
    free = not [p for p in s["to"] if hypot(*(p[k] - s["at"][k] for k in (1, 2, 3))) > 1e-9]
    touches = [c["r"] for c in shapes if c["kind"] == "contact" and c["p"] == s["at"]]
    s["hidden"] = body in drawn
    if s["spin"]:
        s["spin"] = wheels.get(body, 0.38 * s["spin"] if free else 0.0)
    elif free and body in wheels:
        s["spin"] = wheels[body]
    elif free and s["planar"]:
        sorts = [j["sort"] for j in shapes if j["kind"] == "joint" and body in (j["a"][0], j["b"][0])]
        s["spin"] = s["gyration"] if sorts == ["pin"] else 0.0
    if touches and free:
        s["round"] = max(touches)


def _geared(s: Shape, before: list[Shape], wheels: dict[int, float], drawn: set[int]) -> None:
    a, b, ratio = s["first"], s["second"], abs(s["ratio"])
    if {a["joint"], b["joint"]} == {"slide", "pin"}:
        slide, pin = (a, b) if a["joint"] == "slide" else (b, a)
        s["lead"] = _led(s, slide, pin, abs(s["ratio"]) / (2 * pi))
        body = int(pin["b"][0])
        if s["lead"] == "screw":
            drawn.add(body)
        elif s["lead"] == "rope":
            wheels[body] = max(s["r"], wheels.get(body, 0.0))
        return
    apart = hypot(a["a"][1] - b["a"][1], a["a"][2] - b["a"][2])
    if not (a["a"][0] == b["a"][0] and a["joint"] == b["joint"] == "pin" and apart and ratio):
        return
    least = min(ratio, 1.0 / ratio)
    s["law"] = "outer" if s["ratio"] < 0 else "inner" if a["a"][0] and ratio != 1.0 else "idler"
    large = (
        apart * {"outer": 1.0 / (1.0 + least), "inner": 1.0 / (1.0 - least or 1.0), "idler": 0.38}[s["law"]]
    )
    s["radii"] = [large * least, large] if ratio > 1.0 else [large, large * least]
    s["known"], s["by"], teeth = _known(s, before)
    s["teeth"] = _teeth(least, ratio > 1.0) if teeth is None else teeth
    for joint, radius in zip((a, b), s["radii"], strict=True):
        body = int(joint["b"][0])
        if s["law"] == "inner" and radius == large:
            drawn.add(body)
        else:
            wheels[body] = max(radius, wheels.get(body, 0.0))


def _known(s: Shape, before: list[Shape]) -> tuple[int, int | None, list[int] | None]:
    """Which of the two wheels is one of an earlier gear too, the number of that, and the teeth that follow from it."""
    for by, other in enumerate(before):
        if other["kind"] != "gear" or "teeth" not in other:
            continue
        for mine, joint in enumerate((s["first"], s["second"])):
            for theirs, its in enumerate((other["first"], other["second"])):
                if joint["b"][0] == its["b"][0] and _same(s["radii"][mine], other["radii"][theirs]):
                    own = other["teeth"][theirs]
                    far = max(1, round(own * s["radii"][1 - mine] / s["radii"][mine]))
                    return mine, by, [own, far] if mine == 0 else [far, own]
    return 0, None, None


def _teeth(least: float, first: bool) -> list[int]:
    """In the ratio's proportion, the smaller wheel with 12 to 32: of the fewest those that are whole, or nearly."""
    off = {z: abs(z / least - round(z / least)) for z in range(12, 33)}
    z = next((z for z in off if off[z] < 1e-3), min(off, key=lambda z: off[z]))
    pair = [z, round(z / least)]
    return pair if first else pair[::-1]


def _same(a: float, b: float) -> bool:
    """To a thousandth: nobody sees less."""
    return abs(a - b) < 1e-3 * abs(b)


def _led(s: Shape, slide: Shape, pin: Shape, r: float) -> str:
    """What turns a travel into a turn; "" where it is none of those that are known."""
    if pin["a"][0] == slide["b"][0]:
        s["r"] = r
        return "string"
    (ax, ay), (ux, uy) = slide["axis"][:2], (pin["a"][1] - slide["a"][1], pin["a"][2] - slide["a"][2])
    off = abs(ax * uy - ay * ux)
    s["r"] = r
    if pin["a"][0] != slide["a"][0]:
        return ""
    return "screw" if off < 0.5 * r else "rope" if abs(off - r) < 0.05 * r else ""


def _profiled(s: Shape) -> set[int]:
    """What a cam looks like: its profile where a slide goes over its middle, a Geneva wheel where a turn of it moves another pin
    by a part of a turn. The bodies that are drawn with it."""
    a, b, lift = s["first"], s["second"], s.pop("lift")
    if not lift or b["joint"] != "pin" or a["a"][0] != b["a"][0]:
        return set()
    away = (a["a"][1] - b["a"][1], a["a"][2] - b["a"][2])
    turned = abs(lift[-1] - lift[0])
    low, high = min(lift), max(lift)
    if a["joint"] == "pin" and turned > 1e-6 and hypot(*away) > 0:
        n = round(2 * pi / turned)
        if n >= 3 and _same(n * turned, 2 * pi):
            s["slots"], s["lift"] = n, lift
            return {int(a["b"][0]), int(b["b"][0])}
    axis = a["axis"]
    if (
        a["joint"] == "slide"
        and turned < 1e-6 * (high - low)
        and abs(away[0] * axis[1] - away[1] * axis[0]) < 1e-9
    ):
        far = away[0] * axis[0] + away[1] * axis[1]
        s["base"] = max(0.4 * far, 1.2 * (high - low) - low)
        s["lift"] = lift
        return {int(b["b"][0])}
    return set()

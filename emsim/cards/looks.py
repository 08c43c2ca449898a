"""What a body may look like, `look=` of BODY: it changes its picture alone, not its mass and not what touches it.

ball(r)  wheel(r)  gear(r,teeth)    about the origin, the axis of a wheel along z, or the axis of the pin that it turns on
wagon(l,h)  plate(w,h[,d])          about the origin; a wagon with its two wheels below
stl(file[,metres])                  the surface in an STL file, in the body's axes; what one of its units is, 1m for millimetres
"""

from __future__ import annotations

from ..diagnostics import suggest
from .base import is_number

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from ..diagnostics import Sink, Span

# how many numbers each takes
LOOKS: dict[str, tuple[int, int]] = {
    "ball": (1, 1),
    "wheel": (1, 1),
    "gear": (2, 2),
    "wagon": (2, 2),
    "plate": (2, 3),
    "stl": (0, 1),
}
FORM = "ball(r), wheel(r), gear(r,teeth), wagon(l,h), plate(w,h) or stl(file[,metres])"


def read(value: Any, what: str, place: Span, sink: Sink) -> tuple[str, list[float]] | None:
    """Its kind and its numbers [m]; None after an error. The file of stl(..) is none of the numbers."""
    name, args = getattr(value, "fn", None), getattr(value, "args", ())
    if name == "stl":
        args = args[1:]
    sizes = [getattr(a, "value", a) for a in args]
    if name not in LOOKS:
        near = suggest(name, LOOKS) if name else None
        if isinstance(value, str) and value.endswith(".stl"):
            sink.error("E232", f"look= of {what} is {FORM}", place, f"write look=stl({value})")
            return None
        said = f"look= of {what} is {FORM}" + (f", there is no `{name}`" if name else "")
        sink.error("E232", said, place, f"did you mean {near}(..)?" if near else None)
        return None
    low, high = LOOKS[name]
    if not low <= len(sizes) <= high or not all(is_number(v) and 0.0 < v < float("inf") for v in sizes):
        if name == "stl":
            said = f"stl(file[,metres]) of {what} takes what one unit of the file is in metres, greater than zero"
            sink.error("E232", said, place)
            return None
        many = f"{low} to {high} sizes" if low != high else f"{low} size" + "s" * (low > 1)
        sink.error("E232", f"{name}(..) of {what} takes {many} in metres, greater than zero", place)
        return None
    if name == "gear" and not (6 <= sizes[1] <= 400 and float(sizes[1]).is_integer()):
        sink.error("E232", f"gear(r,teeth) of {what} has 6 to 400 teeth, a whole number", place)
        return None
    return name, sizes

"""The derivative of a measure by way of the signals that it reads: it is taken anew of signals that are moved along their
derivatives, a little to either side, and no other run is made. What a measure is of moved signals may bend, so two distances
make one derivative of fourth order (Richardson); where both sides differ by as much at half the distance, it has none.
"""

from __future__ import annotations

import math

from ..diagnostics import Diagnostic, deck_error

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import numpy as np

    from ..deck import Measure
    from ..measures import Measured

    Moved = Callable[[float], list[Measured]]


def derivative(
    cards: Sequence[Measure], moved: Moved, here: Sequence[Measured], by: str, step: float
) -> np.ndarray:
    """Derivatives of measures by a quantity, array (measures,). `moved`: they, of signals moved by so much of the quantity;
    `here`: they, of those that are not. Raises DeckError E443 where one has none."""
    import numpy as np

    places = (step, -step, 0.5 * step, -0.5 * step)
    sides = [moved(place) for place in places]
    found = np.empty(len(cards))
    for k, card in enumerate(cards):
        if lost := next((side[k] for side in sides if side[k].trouble is not None), None):
            assert lost.trouble is not None
            none(card, by, f"with `{by}` a little aside there is none: {lost.trouble.message}")
        far, back, near, behind = (side[k].value for side in sides)
        wide, narrow = (far - back) / (2.0 * step), (near - behind) / step
        found[k] = (4.0 * narrow - wide) / 3.0
        middle = here[k].value
        bent = [abs(far + back - 2.0 * middle) / step, abs(near + behind - 2.0 * middle) / (0.5 * step)]
        size = abs(found[k])
        # so much of the derivative is no corner, nor is so much of the value, by rounding
        floor = 1e-5 * size + 1e-10 * max(abs(middle), abs(far), abs(back)) / step
        # of a bend half the distance leaves a half; of a corner all
        corner = bent[1] > 0.75 * bent[0] and bent[1] > floor
        jumps = abs(narrow - wide) > 0.5 * abs(wide) + floor and abs(far - back) > 0.9 * abs(
            2.0 * (near - behind)
        )
        if not math.isfinite(found[k]) or corner or jumps:
            none(
                card,
                by,
                "another crossing, peak or condition takes the place of the one it is taken from, to one side",
            )
    return found


def values(cards: Sequence[Measure], found: Sequence[Measured]) -> np.ndarray:
    """The numbers. Raises DeckError: E430 of what found nothing."""
    import numpy as np

    from ..diagnostics import DeckError

    if trouble := [m.trouble for m in found if m.trouble is not None]:
        raise DeckError(trouble)
    return np.array([m.value for m in found])


def none(card: Measure, by: str, why: str) -> None:
    deck_error(
        "E443",
        f"`{card.name}` has no derivative by `{by}`: {why}",
        card.span,
        "measure what changes smoothly",
    )


def at_one_instant(by: str, t: float) -> Diagnostic:
    """Events so near to each other that the order in which they come may turn."""
    said = f"events at t = {t:.6g} s are all but at one instant: derivatives by `{by}` hold while their order does"
    return Diagnostic("warning", "W443", said, None, "compare with a run at another value")

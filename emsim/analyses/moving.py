"""Does the machine rest, or go on steadily, where an analysis linearises it?

About a motion x(t) the equations of small motions are C z' + G z = 0 with C and G of where it is at t. Their eigenvalues are
modes where C and G stay: at rest, and where the machine goes on with constant speeds through places that are alike.
Coordinates that turn with a body, quaternions and those of a body's own axes in the world, leave such a place though the motion
is steady. One moment of them says nothing about modes.
"""

from __future__ import annotations

from ..diagnostics import Diagnostic

TYPE_CHECKING = False
if TYPE_CHECKING:
    import numpy as np

    from .._engine import SmallSignal
    from ..assemble import Assembly
    from .base import Analysis

AT_REST = 1e-6  # of its terms: a force or torque below it moves nothing


def unsteady(assembly: Assembly, analysis: Analysis, linear: SmallSignal) -> list[Diagnostic]:
    """A warning where the machine gathers speed at the point; an error where its coordinates move, and not steadily."""
    import numpy as np

    system, ctx = assembly.system, assembly.ctx
    kinds, units = np.array(system.kinds), np.array(system.units)
    is_place, is_speed, straight = kinds == "coordinate", kinds == "speed", (units == "m") | (units == "m/s")
    least = {option: value for _, _, option, value, _ in system.quantities(assembly.options)}
    still = np.where(straight, *(least.get(name, 0.0) for name in ("veltol", "spintol")))
    # multipliers at a start are known no better than to their tolerance; that of forces is there where that of torques is not
    held = least.get("forcetol", 1e-12)
    small = np.where(straight, held, least.get("torquetol", held * ctx.scale.length))
    force = np.array(linear.residual)
    indptr, rows, g, _ = linear.pencil()

    def summed(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """G x, and the sizes of its terms."""
        found = np.array(g) * np.repeat(x, np.diff(indptr))
        return np.bincount(rows, found, system.n), np.bincount(rows, abs(found), system.n)

    size = summed(np.array(linear.x))[1]
    gathers = is_speed & (abs(force) > np.maximum(AT_REST * size, small))
    # the row of a coordinate is  q' - N u = 0
    rates = np.where(is_place & (abs(force) > still), -force, 0.0)
    bends, terms = summed(rates)[0], summed(np.full(system.n, abs(rates).max()))[1]
    turns = is_place & (abs(bends) > AT_REST * terms)
    if not (gathers | turns).any():
        return []
    name, word = system.names[(gathers | turns).argmax()], analysis.word
    by_bodies = ctx.options["formulation"] == "absolute"
    if turns.any() or (by_bodies and rates.any()):
        said = f"the machine moves where .{word} linearises it, and {name} does not go on steadily"
        hint = (
            "`.options formulation=joint`, whose coordinates may"
            if by_bodies
            else "JOINT pin for what spins about one axis"
        )
        hint += f"; or static at the end of .{word}, which looks for a rest"
        return [Diagnostic("error", "E416", said, analysis.card.span, hint)]
    said = f"the machine is not at rest where .{word} linearises it: {name} changes"
    hint = f"ic= of a position at rest, or .{word} ... static, which looks for one"
    ctx.remark("W306", said, analysis.card.span, hint)
    return []

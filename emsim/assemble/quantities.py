"""Currents of elements and their operating values, as expressions: what columns and behavioural sources read of them."""

from __future__ import annotations

from ..elements.base import CURRENT_NAMES

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .._engine import Expr
    from .context import Context

MECHANICAL_WORDS = """
    angle omega alpha pos vel acc x y z vx vy vz ax ay az fx fy fz mx my mz
    force torque i v id iq p gap slip friction mode hits impulse energy ke pe power loss supplied
"""
MECHANICAL = frozenset(MECHANICAL_WORDS.split())


def device_value(ctx: Context, device: str, parameter: str) -> Expr | None:
    """@device[parameter]; of a coupling of the machine its current. None for what is not computed."""
    element = ctx.elements.get(ctx.element_name(device))
    if element is not None:
        return element.probe(ctx, parameter)
    return element_current(ctx, device) if parameter in CURRENT_NAMES else None


def device_unit(ctx: Context, word: str) -> str:
    """Unit of @device[parameter]."""
    device, _, parameter = word[1:].rstrip("]").partition("[")
    element = ctx.elements.get(ctx.element_name(device))
    return "A" if element is None else element.probes(ctx).get(parameter, "A")


def element_current(ctx: Context, name: str) -> Expr | None:
    """Current into the first terminal of an element or coupling; None when there is no such thing."""
    name = ctx.element_name(name)
    index = ctx.branch(name)
    if index is not None:
        return ctx.b.x(index)
    element = ctx.elements.get(name)
    if element is None:
        return None
    return element.current(ctx)

"""Environments of Gymnasium whose physics is a deck: `emsim.env(deck, ..)`, and two that come along (extra `emsim[gym]`).

    emsim/CartPole-v0    a pole on a cart, whose motor an agent gives its voltage (cart_pole.py, cart_pole.cir)
    emsim/Leg-v0         a leg of two links and two motors that hops (leg.py, leg.cir)

`gymnasium.make` finds them by the entry point of this package, or once it is imported; so does `gymnasium.make_vec`, whose many
run in threads of the engine.
"""

from __future__ import annotations

from .environment import Environment, Task, env

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .vector import Vector

__all__ = ["Environment", "Task", "Vector", "env", "register"]

NAMED = {"emsim/CartPole-v0": "cart_pole", "emsim/Leg-v0": "leg"}


def register() -> None:
    """Makes the named environments known to gymnasium, once."""
    import gymnasium

    for name, home in NAMED.items():
        if name not in gymnasium.registry:
            gymnasium.register(
                name,
                entry_point=f"emsim.environments.{home}:make",
                vector_entry_point=f"emsim.environments.{home}:make_vec",
                # (time that is up is the environment's own `truncated`)
                order_enforce=True,
            )


def __getattr__(name: str) -> Any:
    if name == "Vector":
        from .vector import Vector

        return Vector
    raise AttributeError(f"module 'emsim.environments' has no attribute {name!r}")


register()

"""FRICTION: Coulomb friction with stiction on a joint. Named, and refused: it has no equations yet."""

from __future__ import annotations

from .base import Card, Default, Required, Spec


class Friction(Card):
    supported = False
    spec = Spec(
        "FRICTION",
        "FRICTION name joint fc= [fs=] [vs=] [b=]",
        terminals="joint:joint",
        mark=("fc",),
        meaning="Coulomb friction with stiction",
        fc=Required("N or N m", "friction while sliding", least=0.0),
        fs=Default(None, "N or N m", "friction that must be overcome to start", least=0.0),
        vs=Default(None, "m/s or rad/s", "speed over which fs falls to fc", least=0.0),
        b=Default(0.0, "N s/m or N m s/rad", "viscous part", least=0.0),
    )

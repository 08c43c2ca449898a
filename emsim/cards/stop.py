"""STOP: ends of a joint's travel, elastic or with restitution. Named, and refused: it has no equations yet."""

from __future__ import annotations

from .base import Card, Default, Spec


class Stop(Card):
    supported = False
    spec = Spec(
        "STOP",
        "STOP name joint min= max= (k= [c=]) or e=",
        terminals="joint:joint",
        mark=("min", "max"),
        meaning="ends of a joint's travel",
        min=Default(None, "m or rad", "lower end"),
        max=Default(None, "m or rad", "upper end"),
        k=Default(None, "N/m or N m/rad", "stiffness of the ends", least=0.0),
        c=Default(0.0, "N s/m or N m s/rad", "damping of the ends", least=0.0),
        e=Default(None, "", "coefficient of restitution", least=0.0),
    )

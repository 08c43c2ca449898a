"""CONTACT: a point or round shape against a line or round shape. Named, and refused: it has no equations yet."""

from __future__ import annotations

from .base import Card, Default, Spec


class Contact(Card):
    supported = False
    spec = Spec(
        "CONTACT",
        "CONTACT name P Q k= or e= [c=] [mu=]",
        terminals="p:point q:point",
        mark=("k", "e"),
        meaning="contact of a point or round shape with a line or round shape",
        k=Default(None, "N/m", "stiffness", least=0.0),
        e=Default(None, "", "coefficient of restitution", least=0.0),
        c=Default(0.0, "N s/m", "damping", least=0.0),
        mu=Default(0.0, "", "friction coefficient", least=0.0),
    )

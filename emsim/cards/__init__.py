"""Machine cards, one file each. This list is the only place where they are registered."""

from __future__ import annotations

from .base import Card, Spec
from .belt import Belt
from .body import Body
from .cam import Cam
from .contact import Contact
from .damper import Damper
from .drive import Drive
from .force import Force
from .freewheel import Freewheel
from .friction import Friction
from .gear import Gear
from .joint import Joint
from .motors import Motor
from .point import Point
from .pot import Pot
from .spring import Spring
from .stop import Stop
from .torque import Torque
from .transducer import Transducer

CARDS: dict[str, type[Card]] = {
    card.spec.word: card
    for card in (
        Body,
        Point,
        Joint,
        Motor,
        Pot,
        Spring,
        Damper,
        Friction,
        Freewheel,
        Stop,
        Gear,
        Belt,
        Cam,
        Force,
        Torque,
        Drive,
        Contact,
        Transducer,
    )
}

__all__ = ["CARDS", "Card", "Spec"]

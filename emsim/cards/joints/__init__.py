"""The kinds of joints, one file each. What a kind has to say: base.py."""

from __future__ import annotations

from .ball import Ball
from .cylinder import Cylinder
from .free import Free
from .pin import Pin
from .pinslot import Pinslot
from .planar import Planar
from .rod import Rod
from .screw import Screw
from .slide import Slide
from .universal import Universal
from .weld import Weld

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .base import JointKind

KINDS: dict[str, type[JointKind]] = {
    kind.name: kind
    for kind in (
        Pin,
        Slide,
        Weld,
        Free,
        Planar,
        Pinslot,
        Rod,
        Ball,
        Universal,
        Cylinder,
        Screw,
    )
}
ALIASES = {alias: kind.name for kind in KINDS.values() for alias in kind.aliases}
# functions that read a coordinate or a speed of a joint by the kind's own words -> unit
WORDS = {c.word: c.unit for kind in KINDS.values() for c in (*kind.coordinates, *kind.speeds, *kind.measures)}


def readers(word: str) -> str:
    """The kinds that a function reads, as text: pin, cylinder."""
    kinds = (
        k for k in KINDS.values() if any(c.word == word for c in (*k.coordinates, *k.speeds, *k.measures))
    )
    return ", ".join(dict.fromkeys(k.name for k in kinds))

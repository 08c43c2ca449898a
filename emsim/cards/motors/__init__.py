"""The machines of MOTOR, one file each, by the type of their .model. What they share: base.py."""

from __future__ import annotations

from .bldc import Bldc
from .dc import Motor
from .induction import Induction
from .pmsm import Pmsm
from .stepper import Stepper
from .wound import Wound

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .base import Machine

MODELS: dict[str, type[Machine]] = {
    kind.of_type: kind
    for kind in (
        Motor,
        Wound,
        Pmsm,
        Bldc,
        Stepper,
        Induction,
    )
}

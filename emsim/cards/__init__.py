"""Machine cards, one file each. This list is the only place where they are registered; a file is imported when a deck has a
machine."""

from __future__ import annotations

from ..registry import Registry

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping

    from .base import Card

__all__ = ["CARDS"]

# word -> file and class
INDEX = {
    "BODY": "body Body",
    "POINT": "point Point",
    "SHAPE": "shape ShapeCard",
    "JOINT": "joint Joint",
    "MOTOR": "motors Motor",
    "POT": "pot Pot",
    "SPRING": "spring Spring",
    "DAMPER": "damper Damper",
    "FRICTION": "friction Friction",
    "FREEWHEEL": "freewheel Freewheel",
    "STOP": "stop Stop",
    "LATCH": "latch Latch",
    "GEAR": "gear Gear",
    "RATIO": "ratio Ratio",
    "BELT": "belt Belt",
    "ROPE": "rope Rope",
    "BEAM": "beam Beam",
    "MODE": "mode Mode",
    "FLANGE": "flange Flange",
    "CAM": "cam Cam",
    "FORCE": "force Force",
    "TORQUE": "torque Torque",
    "DRIVE": "drive Drive",
    "CONTACT": "contact Contact",
    "ROLL": "roll Roll",
    "KNIFE": "knife Knife",
    "TYRE": "tyre Tyre",
    "TRANSDUCER": "transducer Transducer",
    "CLOCK": "clock Clock",
    "BLOCK": "block Block",
    "PWM": "pwm Pwm",
    "FMU": "fmu Fmu",
    "HEAT": "domains.heat Heat",
    "MAGNETIC": "domains.magnetic Magnetic",
    "HYDRAULIC": "domains.hydraulic Hydraulic",
}
CARDS: Mapping[str, type[Card]] = Registry(__name__, INDEX)

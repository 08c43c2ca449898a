"""SPICE elements, one file a letter (base.py says what an element is). This list is the only place where they are
registered."""

from __future__ import annotations

from .. import source
from .a import OfCodeModel
from .b import Behavioural
from .base import Element, Param
from .c import Capacitor
from .d import Diode
from .e import VoltageByVoltage
from .f import CurrentByCurrent
from .g import CurrentByVoltage
from .h import VoltageByCurrent
from .i import CurrentSource
from .j import Jfet
from .k import Coupling
from .l import Inductor
from .m import Mosfet
from .n import OfModule
from .o import LossyLine
from .p import CoupledLines
from .q import Bipolar
from .r import Resistor
from .s import VoltageSwitch
from .t import Line
from .u import RcLine
from .v import VoltageSource
from .w import CurrentSwitch
from .x import Use
from .y import SingleLine
from .z import Mesfet

ELEMENTS: tuple[type[Element], ...] = (
    Resistor,
    Capacitor,
    Inductor,
    Coupling,
    VoltageSource,
    CurrentSource,
    VoltageByVoltage,
    CurrentByCurrent,
    CurrentByVoltage,
    VoltageByCurrent,
    Behavioural,
    VoltageSwitch,
    CurrentSwitch,
    Diode,
    Bipolar,
    Jfet,
    Mosfet,
    Mesfet,
    OfModule,
    Line,
    LossyLine,
    SingleLine,
    CoupledLines,
    RcLine,
    OfCodeModel,
    Use,
)

# letter in lower case -> class
LETTERS: dict[str, type[Element]] = {kind.letter: kind for kind in ELEMENTS}
# the classes that cards have: asked more quickly than isinstance
CLASSES = frozenset(LETTERS.values())
# letter in upper case -> class, of what stands in a circuit
TABLE: dict[str, type[Element]] = {kind.letter.upper(): kind for kind in ELEMENTS if kind is not Use}
# type of a .model -> the class that takes it
MODEL_TYPES: dict[str, type[Element]] = {word: kind for kind in ELEMENTS for word in kind.model_types}

# cards that are nothing but words come without a tree: grammar rule -> (words, is the last one a number?)
source.PLAIN.update({kind.plain[0]: kind.plain[1:] for kind in ELEMENTS if kind.plain is not None})

__all__ = ["CLASSES", "ELEMENTS", "LETTERS", "MODEL_TYPES", "TABLE", "Element", "Param"]

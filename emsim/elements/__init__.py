"""SPICE elements, one file a letter (base.py says what an element is). This list is the only place where they are registered;
a letter's file is imported when a deck has it."""

from __future__ import annotations

from .. import source
from ..registry import Registry
from .base import Element, Param

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from typing import Any

__all__ = ["LETTERS", "MODEL_TYPES", "Element", "Param"]

# letter in lower case -> file and class
INDEX = {
    "r": "r Resistor",
    "c": "c Capacitor",
    "l": "l Inductor",
    "k": "k Coupling",
    "v": "v VoltageSource",
    "i": "i CurrentSource",
    "e": "e VoltageByVoltage",
    "f": "f CurrentByCurrent",
    "g": "g CurrentByVoltage",
    "h": "h VoltageByCurrent",
    "b": "b Behavioural",
    "s": "s VoltageSwitch",
    "w": "w CurrentSwitch",
    "d": "d Diode",
    "q": "q Bipolar",
    "j": "j Jfet",
    "m": "m Mosfet",
    "z": "z Mesfet",
    "n": "n OfModule",
    "t": "t Line",
    "o": "o LossyLine",
    "y": "y SingleLine",
    "p": "p CoupledLines",
    "u": "u RcLine",
    "a": "a OfCodeModel",
    "x": "x Use",
}
# letter -> the words of .model that its class takes; A takes the names of code models
OF_MODELS = {
    "r": "r res", "c": "c cap", "l": "l ind", "k": "core", "s": "sw vswitch", "w": "csw iswitch", "d": "d",
    "q": "npn pnp lpnp", "j": "njf pjf", "m": "nmos pmos vdmos vdmosn vdmosp nsoi psoi", "z": "nmf pmf nhfet phfet",
    "o": "ltra", "y": "txl", "p": "cpl", "u": "urc",
}  # fmt: skip
# a card that is nothing but words comes without a tree: its rule in the grammar -> (words, is the last one a number?)
source.PLAIN.update(
    resistor=(4, True), capacitor=(4, True), inductor=(4, True), source=(4, True), linear=(6, True), diode=(4, False)
)  # fmt: skip


class ModelTypes(Registry):
    """Type of a .model -> the class that takes it. Names of code models are looked up when no other word fits."""

    __slots__ = ("is_whole",)

    def __init__(self) -> None:
        index = {word: INDEX[letter] for letter, words in OF_MODELS.items() for word in words.split()}
        super().__init__(__name__, index)
        self.is_whole = False

    def complete(self) -> dict[str, str]:
        if not self.is_whole:
            from .xspice import NAMES

            self.index.update({name: INDEX["a"] for name in NAMES if name not in self.index})
            self.is_whole = True
        return self.index

    def __getitem__(self, name: str) -> Any:
        if name not in self.index:
            self.complete()
        return super().__getitem__(name)

    def __contains__(self, name: object) -> bool:
        return name in self.index or name in self.complete()

    def __iter__(self) -> Iterator[str]:
        return iter(self.complete())

    def __len__(self) -> int:
        return len(self.complete())


LETTERS: Mapping[str, type[Element]] = Registry(__name__, INDEX)
MODEL_TYPES: Mapping[str, type[Element]] = ModelTypes()

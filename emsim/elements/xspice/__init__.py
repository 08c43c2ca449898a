"""XSPICE's code models, one file each; base.py says what a code model is. Those of digital parts are the engine's
(engine/dae/src/logic/), digital.py puts them into a circuit."""

from __future__ import annotations

from ..._engine import digital_parts

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .base import CodeModel

# each is a file here, which is loaded when a deck names it
OWN: tuple[str, ...] = (
    "adc_bridge", "aswitch", "capacitoric", "climit", "cmeter", "core", "d_dt", "d_genlut", "d_lut", "d_osc", "d_pwm",
    "d_source", "d_state", "dac_bridge", "delay", "divide", "filesource", "gain", "hyst", "ilimit", "inductoric",
    "int", "lcouple", "limit", "lmeter", "memristor", "mult", "multi_input_pwl", "oneshot", "potentiometer",
    "pswitch", "pwl", "pwlts", "s_xfer", "sidiode", "sine", "slew", "square", "summer", "table2d", "table3d",
    "triangle", "zener",
)  # fmt: skip
# XSPICE has these, and what does the same here
ABSENT: dict[str, str] = {
    "bidi_bridge": "an adc_bridge for what is read, a dac_bridge behind a resistor for what is driven",
    "d_to_real": "a dac_bridge with out_low and out_high",
    "real_to_v": "a gain with a limit of slope: `slew` behind a dac_bridge",
    "real_gain": "`gain` between the voltages that dac_bridge makes",
    "real_delay": "`delay`, or d_dff before the dac_bridge",
    "spice2poly": "a source with POLY",
}
# the engine's own, by name
PARTS = {part[0]: part for part in digital_parts()}
NAMES: tuple[str, ...] = (*OWN, *(name for name in PARTS if name not in OWN))

_MADE: dict[str, type[CodeModel]] = {}


def code_model(name: str) -> type[CodeModel]:
    """The class of a code model. KeyError where there is none."""
    if name not in NAMES:
        raise KeyError(name)
    if name not in _MADE:
        if name in OWN:
            from importlib import import_module

            _MADE[name] = import_module(f"{__name__}.{name}_").MODEL
        else:
            from .digital import of_part

            _MADE[name] = of_part(PARTS[name])
    return _MADE[name]

"""d_osc: a digital clock whose frequency follows a voltage."""

from __future__ import annotations

from .base import CodeModel, Seat, Word, driving, named, numbers, reading
from .pwl_ import pairs
from .sine_ import CONTROL, controlled
from .square_ import is_within

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..contract import Expr

DELAYS = {
    "rise_delay": Word("delay of a rise", "s", 1e-9, least=1e-12),
    "fall_delay": Word("delay of a fall", "s", 1e-9, least=1e-12),
}


def clock(seat: Seat, high: Expr) -> None:
    """The output is high where a flag is, after the delays."""
    b = seat.ctx.b
    node, _ = b.digital_node(f"{seat.name}#high")
    b.digital_senses(node, high, b.const(0.0))
    delays = {key: [seat[key]] for key in DELAYS}
    seat.part("adc_bridge", [[(node, False)], [seat.digital("out")]], delays)


class Oscillator(CodeModel):
    name = "d_osc"
    what = "digital clock whose frequency follows its input"
    law = "each period out is 0 first and 1 for the duty_cycle at its end; events are located exactly"
    ports = (reading("cntl_in"), driving("out", "d"))
    parameters = named(
        cntl_array=CONTROL["cntl_array"],
        freq_array=numbers("frequencies there, straight lines between and beyond", "Hz", (1e6, 1e7)),
        duty_cycle=Word("part of the period in which it is 1", "", 0.5, least=1e-6, most=0.999999),
        init_phase=Word("phase at the start", "deg", 0.0, least=-180.0, most=360.0),
        **DELAYS,
    )

    def check(self, seat: Seat) -> None:
        pairs(seat, "cntl_array", "freq_array")

    def build(self, seat: Seat) -> None:
        duty = seat["duty_cycle"]
        phase = seat.phase(controlled(seat), seat["init_phase"] / 360.0)
        clock(seat, is_within(seat, phase, duty))


MODEL = Oscillator

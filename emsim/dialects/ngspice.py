"""ngspice, as it is without a compatibility mode."""

from __future__ import annotations

from .base import Dialect

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import ClassVar


class Ngspice(Dialect):
    name = "ngspice"
    differences: ClassVar[tuple[tuple[str, str], ...]] = (
        ("PWL(0 0 +1m 5)", "the time counts from 0, as one without a sign"),
        ("a ^ b", "|a| to the power of b, as a ** b"),
        ("pwr(x,y), pow(x,y) in sources", "sgn(x)|x|^y, and |x|^y; in .param the other way round"),
        ("if(x,y,z)", "y where x is not 0"),
        ("L1 a b 1m", "no resistance in series"),
    )

"""Parameters from data and from goals.

quantities.py  what is found: bounds, start values, the scale it is looked for on
data.py        measured curves
model.py       the deck's run with its sensitivities, at other values
fitted.py      values to curves: least squares
certainty.py   how sure they are: intervals, correlations, what the data cannot tell apart
optimised.py   values to goals of .meas
workers.py     runs on the cores of this machine
pictures.py    data and curve, what is left
"""

from __future__ import annotations

from .fitted import fit
from .optimised import optimise

__all__ = ["fit", "optimise"]

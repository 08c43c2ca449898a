"""`emsim.Deck.gradient`: derivatives of measures by quantities.

found.py     what comes out: values and a labelled matrix
asked.py     measures, or signals at places, as cards
transient.py along a run: signals and the times of their events, moved together (analyses/slopes.py has their derivatives)
points.py    at operating points, of sweeps too, and over frequency: one transposed solution an output, by the adjoint
moved.py     a measure of signals that are moved: its derivative, and where it has none
"""

from __future__ import annotations

from .asked import gradient
from .found import Gradient

__all__ = ["Gradient", "gradient"]

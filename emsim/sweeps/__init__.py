"""One deck, many runs: grids, Monte Carlo, corners, sensitivities.

    plan.py      the sweep as a whole
    axes.py      what varies: `R1=1k..10k:20`, lists, logarithmic spacing
    samples.py   which runs there are: points of the grid, and where random values lie in each
    runs.py      one run: its measures and signals, in any process
    pool.py      all of them, on the cores of this machine or on a cluster
    journal.py   what has been computed, so that an interrupted sweep goes on
    result.py    the labelled result, its statistics and files
    pictures.py  families, histograms, yield, tornado
    page.py      all of it as one page

Every run is decided by its number alone, so results are the same bits whatever the number of workers and their order.
"""

from __future__ import annotations

from .plan import sweep
from .result import Swept

__all__ = ["Swept", "sweep"]

"""Co-simulation FMUs (FMI 3.0 and 2.0): a deck with some of its sources driven from outside, for other simulators.

What is in the file: the description (description.py), the library with the functions of FMI (library.py: the engine, without
Python), and the deck's equations as bytes, `System.pack`: the same builder makes them that makes those of a run.
"""

from .export import Exported, export

__all__ = ["Exported", "export"]

"""What a transient costs in ngspice: CPU seconds of the analysis alone, and the values it gives.

ngspice's own "Total analysis time" is a wall clock with a resolution of a millisecond. Here the process's CPU time is taken
instead (getrusage), of a control section that runs the analysis n times, less that of the same deck and section with
no run in it (start, parsing), divided by n; n so large that start-up does not matter.

The deck goes in as `_rebuild` of ngspice.py leaves it, without its output and measure cards; only the asked signals are saved.
"""

from __future__ import annotations

import os
import tempfile
from math import ceil

from ..outputs import raw
from .child import Child
from .ngspice import NgspiceError, _rebuild, find, last_words, named_alike, surroundings
from .spice_deck import cards, first_word, only_signals

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..table import Table

WORTH = 0.06  # CPU seconds that the repeated runs of one measurement take together
MOST = 40  # runs in one process


class Bench:
    """One deck under varying options, in a folder of its own; use it in a `with`."""

    def __init__(self, text: str, folder: str, signals: Sequence[str]) -> None:
        self.text, self.base, self.signals = text, folder, signals
        self.program = find()
        self._start: float | None = None

    def __enter__(self) -> Bench:
        self._folder = tempfile.TemporaryDirectory(prefix="emsim-ngspice-")
        return self

    def __exit__(self, *_: object) -> None:
        self._folder.cleanup()

    def deck(self, tran: tuple[float, float, float, float], options: str, control: Sequence[str]) -> str:
        """tran: (tstep, tstart, tstop, tmax) [s]."""
        bare = _rebuild(self.text, self.base, tran, [f".options {options}"])
        title, _, rest = bare.partition("\n")
        kept = [line for card in cards(rest) if first_word(card) not in (".save", ".end") for line in card]
        section = [".control", "set filetype=binary", *control, "quit", ".endc", ".end", ""]
        return "\n".join([title, *kept, ".save " + only_signals(" ".join(self.signals)), *section])

    def values(
        self, tran: tuple[float, float, float, float], options: str, timeout: float
    ) -> tuple[Table, float]:
        """The table of one run and a first figure for its CPU seconds. NgspiceError when it fails or takes too long."""
        target = os.path.join(self._folder.name, "out.raw")
        begins = self.start_up(tran, options)  # first of all: it finds the program cold, and not the run
        if os.path.exists(target):
            os.remove(target)
        cpu, log = self._cpu(self.deck(tran, options, ["run", f"write {target}"]), timeout)
        if not os.path.exists(target):
            raise NgspiceError(last_words(log))
        result = named_alike(raw.read(target))
        if not result.plots or not len(result.main):
            raise NgspiceError(last_words(log))
        return result.main, max(cpu - begins, 1e-4)

    def seconds(
        self, tran: tuple[float, float, float, float], options: str, about: float, timeout: float
    ) -> float:
        """CPU seconds of one analysis; `about`: what it will be, for the number of runs."""
        n = max(1, min(MOST, ceil(WORTH / about)))
        runs = ["repeat " + str(n), "run", "destroy all", "end"]
        cpu, _ = self._cpu(self.deck(tran, options, runs), timeout * n)
        return max(cpu - self.start_up(tran, options), 1e-6) / n

    def start_up(self, tran: tuple[float, float, float, float], options: str) -> float:
        """CPU seconds of a process that reads the deck and runs nothing: the least of three, measured once."""
        if self._start is None:
            self._start = min(self._cpu(self.deck(tran, options, []), 60.0)[0] for _ in range(3))
        return self._start

    def _cpu(self, deck: str, timeout: float) -> tuple[float, str]:
        import resource

        path = os.path.join(self._folder.name, "deck.cir")
        with open(path, "w", encoding="utf-8") as file:
            file.write(deck)
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        command, env = [self.program, "-n", "-b", path], surroundings(self._folder.name)
        with open(os.path.join(self._folder.name, "log.txt"), "w+b") as said:
            with Child(command, self._folder.name, env, said) as run:
                if run.wait(timeout) is None:
                    raise NgspiceError(f"over {timeout:g} s")
            said.seek(0)
            log = said.read().decode("utf-8", "replace")
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime, log

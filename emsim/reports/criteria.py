"""Criteria of the stability atlas: what became of a run, as a word and a number.

    ok        the criterion is met
    damped    less is left of an amplitude, or of an energy, than the equations leave
    rings     the error changes sign from point to point
    drifts    the error grows or stays without doing either of these
    explodes  the solution left every bound
    stops     the run did not get to its end

A criterion is a function from a Trial to a Verdict. It compares with a closed form, a converged reference or an
invariant; which one, and how near, stands in the case (hard.py).
"""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np

    from ..diagnostics import Diagnostic
    from ..result import Result

OK, DAMPED, RINGS, DRIFTS, EXPLODES, STOPS = "ok", "damped", "rings", "drifts", "explodes", "stops"
VERDICTS = (OK, DAMPED, RINGS, DRIFTS, EXPLODES, STOPS)
FAR = 10.0  # so many times the reference's range is an explosion


class Verdict:
    """word: one of VERDICTS; number: a few characters for the table; text: the number in words."""

    __slots__ = ("number", "text", "word")

    def __init__(self, word: str, number: str, text: str) -> None:
        self.word, self.number, self.text = word, number, text

    def __repr__(self) -> str:
        return f"{self.word} {self.number} ({self.text})"


class Trial:
    """One case under one method.

    result   what was computed, None where nothing was
    trouble  why the run stopped by itself, None where it did not
    reached  share of the time span, 0..1
    steps    accepted steps
    again    the same with other options: again(reltol=1e-10) -> Trial
    """

    __slots__ = ("again", "reached", "result", "seconds", "steps", "trouble")

    def __init__(
        self, result: Result | None, trouble: Diagnostic | None, reached: float, again: Callable[..., Trial]
    ) -> None:
        self.result, self.trouble, self.reached, self.again = result, trouble, reached, again
        stats = result.stats if result is not None and result.plots else {}
        self.steps = int(stats.get("steps", 0))
        self.seconds = float(stats.get("seconds") or 0.0)

    @property
    def finished(self) -> bool:
        return self.trouble is None and self.reached >= 1.0

    def __getitem__(self, name: str) -> np.ndarray:
        assert self.result is not None
        return self.result[name]


def stopped(trial: Trial) -> Verdict:
    """The verdict on a run that did not reach its end."""
    if trial.trouble is not None:
        code, message = trial.trouble.code, trial.trouble.message
        if code == "E413":
            return Verdict(STOPS, "unfit", message)
        if code == "E414":
            return Verdict(STOPS, f"{estimate(message):.0e} st", message)
        began = trial.result is not None and len(trial.result.plots) and len(trial["time"])
        word = EXPLODES if code == "E412" else STOPS
        return Verdict(word, f"{trial['time'][-1]:.2g} s" if began else "at once", message)
    left = f"{trial.steps:.2g} steps for {trial.reached:.2g} of the run"
    need = trial.steps / max(trial.reached, 1e-15)
    return Verdict(STOPS, f"{need:.0e} st", f"{left}: all of it would take about {need:.0e}")


def estimate(message: str) -> float:
    """The number of steps that a refusal (E414) speaks of."""
    import re

    said = re.search(r"about (\S+) steps", message)
    return float(said[1]) if said else 0.0


def judged(error: np.ndarray, limit: float, unit: str = "") -> Verdict | None:
    """None where |error| (relative to the range) stays within the limit; else what kind of error it is."""
    import numpy as np

    worst = float(np.abs(error).max()) if len(error) else float("inf")
    if worst <= limit:
        return None
    if not worst < FAR:
        return Verdict(EXPLODES, f"{worst:.0e}", f"off by {worst:.2g} of the range")
    tail = error[np.abs(error) > 0.1 * worst]
    signs = np.sign(tail[1:] * tail[:-1])
    if len(tail) > 5 and (signs < 0).mean() > 0.7:
        return Verdict(
            RINGS, percent(worst), f"alternates from step to step by {percent(worst)} of the range"
        )
    return Verdict(DRIFTS, percent(worst), f"off by {percent(worst)} of the range{unit}")


def percent(x: float) -> str:
    return f"{100 * x:.2g} %"


def follows(
    limit: float, *signals: tuple[str, Callable[[np.ndarray], np.ndarray]],
    settled: float = 0.0, behind: tuple[float, ...] = (0.0,),
) -> Callable[[Trial], Verdict]:  # fmt: skip
    """Every signal stays within `limit` of its closed form, relative to the form's range; the first `settled`
    seconds behind each of the corners `behind` are not looked at."""

    def criterion(trial: Trial) -> Verdict:
        import numpy as np

        time = trial["time"]
        seen = np.ones(len(time), dtype=bool)
        for corner in behind:
            seen &= (time < corner) | (time >= corner + settled)
        worst, number = None, 0.0
        for name, form in signals:
            want = form(time)
            scale = float(np.ptp(want)) or float(np.abs(want).max())
            error = (trial[name] - want)[seen] / scale
            number = max(number, float(np.abs(error).max()))
            worst = worst or judged(error, limit, f" on {name}")
        return worst or Verdict(OK, percent(number), f"within {percent(number)} of the closed form")

    return criterion


def ends(limit: float, **want: float) -> Callable[[Trial], Verdict]:
    """The last values, relative to max(1, |value|), from a converged reference; `_` in names stands for brackets:
    angle_p0 is angle(p0)."""

    def criterion(trial: Trial) -> Verdict:
        off = 0.0
        for name, value in want.items():
            head, _, inside = name.partition("_")
            off = max(off, abs(float(trial[f"{head}({inside})"][-1]) - value) / max(1.0, abs(value)))
        if not off < FAR:
            return Verdict(EXPLODES, f"{off:.0e}", f"off by {off:.2g}")
        word = OK if off <= limit else DRIFTS
        return Verdict(word, f"{off:.0e}", f"off by {off:.2g} at the end, allowed {limit:g}")

    return criterion


def kept(
    swing: Callable[[Trial], tuple[np.ndarray, np.ndarray]], period: float, periods: int,
    amplitude: float = 0.01, phase: float = 0.01,
) -> Callable[[Trial], Verdict]:  # fmt: skip
    """A lossless oscillation: `swing` gives its amplitude (1 at the start) and its phase in periods at every point;
    at the end the first is 1 within `amplitude`, the second t/period within `phase`."""

    def criterion(trial: Trial) -> Verdict:
        size, turns = swing(trial)
        time = trial["time"]
        left = float(size[time >= (periods - 5) * period].max())
        off = float(turns[-1] - time[-1] / period) if left > 1e-6 else float("nan")
        text = f"amplitude {left:.4f} after {periods} periods"
        if phase < float("inf"):
            text += f", phase {off:+.4f} periods"
        if left < 1 - amplitude:
            return Verdict(DAMPED, f"A {left:.2g}", text)
        if left > 1 + amplitude:
            return Verdict(EXPLODES if left > FAR else DRIFTS, f"A {left:.4g}", text)
        if not abs(off) <= phase:
            return Verdict(DRIFTS, f"ph {off:.2g}", text)
        return Verdict(OK, f"A {abs(left - 1):.0e}" if amplitude < 1 else f"ph {off:.0e}", text)

    return criterion


def tank(f: float, capacitor: float) -> Callable[[Trial], tuple[np.ndarray, np.ndarray]]:
    """Amplitude and phase of v(a) = cos(2 pi f t) and its inductor's current, at every point."""

    def swing(trial: Trial) -> tuple[np.ndarray, np.ndarray]:
        import numpy as np

        z = 1 / (2 * np.pi * f * capacitor)
        v, i = trial["v(a)"], trial["i(l1)"]
        return np.hypot(v, z * i), np.unwrap(np.arctan2(z * i, v)) / (2 * np.pi)

    return swing


def pendulum(trial: Trial) -> tuple[np.ndarray, np.ndarray]:
    """Of the pendulum let go from the horizontal (length 1, g 9.81): sin of half the largest angle from the energy
    u^2/2 + g (1 - cos q); phase by the zero crossings, between which it counts as linear."""
    import numpy as np

    q, u, time = trial["angle(hinge)"], trial["omega(hinge)"], trial["time"]
    energy = u**2 / 2 + 9.81 * (1 - np.cos(q))
    size = np.sqrt(energy / 9.81)
    # the angle falls through zero at a quarter, rises at three quarters: half a period between crossings
    at = np.flatnonzero((q[1:] * q[:-1] <= 0) & (q[:-1] != 0))
    near = np.where(np.abs(q[at]) < np.abs(q[at + 1]), at, at + 1)
    crossings = time[near] - q[near] / u[near]
    turns = 0.25 + 0.5 * np.arange(len(crossings))
    if len(turns) < 2:
        return size, np.zeros_like(time)
    last = turns[-1] + (time - crossings[-1]) * (turns[-1] - turns[-2]) / (crossings[-1] - crossings[-2])
    return size, np.where(time > crossings[-1], last, np.interp(time, crossings, turns))


def closed(gap: float, energy: float) -> Callable[[Trial], Verdict]:
    """A loop stays closed to `gap` metres and its energy to `energy` of itself."""

    def criterion(trial: Trial) -> Verdict:
        import numpy as np

        open_by = float(np.abs(trial["v(gap)"]).max())
        book = trial["energy()"]
        change = float((book[-1] - book[0]) / abs(book[0]))
        text = f"the loop opens by {open_by:.2g} m, energy changes by {percent(change)}"
        if not (open_by < 1.0 and abs(change) < FAR):
            return Verdict(EXPLODES, f"{open_by:.0e} m", text)
        if open_by > gap:
            return Verdict(DRIFTS, f"{open_by:.0e} m", text)
        if abs(change) > energy:
            return Verdict(DAMPED if change < 0 else DRIFTS, f"E {percent(change)}", text)
        return Verdict(OK, f"{open_by:.0e} m", text)

    return criterion


def agree(limit: float, a: str, b: str, least: float) -> Callable[[Trial], Verdict]:
    """Two signals are one within `limit`, and move by at least `least`."""

    def criterion(trial: Trial) -> Verdict:
        import numpy as np

        one, other = trial[a], trial[b]
        off = float(np.abs(one - other).max())
        if not np.ptp(one) >= least:
            return Verdict(
                DAMPED, f"{np.ptp(one):.2g} rad", f"{a} moves by {np.ptp(one):.3g} instead of {least:.3g}"
            )
        word = OK if off <= limit else DRIFTS if off < FAR * least else EXPLODES
        return Verdict(word, f"{off:.0e}", f"{a} and {b} differ by {off:.2g}, allowed {limit:g}")

    return criterion


def horizon(least: float, reltol: float, apart: float = 0.1) -> Callable[[Trial], Verdict]:
    """Time at which the run and one at a tighter `reltol` are `apart` radians apart; `least` is asked for."""

    def criterion(trial: Trial) -> Verdict:
        import numpy as np

        tight = trial.again(reltol=reltol)
        if not tight.finished:
            return stopped(tight)
        grid = np.linspace(0, trial["time"][-1], 2001)
        assert trial.result is not None and tight.result is not None
        off = np.zeros_like(grid)
        for name in ("angle(p1)", "angle(p2)"):
            off = np.maximum(off, np.abs(trial.result.at(name, grid) - tight.result.at(name, grid)))
        over = np.flatnonzero(off > apart)
        until = float(grid[over[0]]) if len(over) else float(grid[-1])
        text = f"predictable for {until:.3g} s of {grid[-1]:.3g} s, asked for {least:g} s"
        return Verdict(OK if until >= least else DRIFTS, f"{until:.3g} s", text)

    return criterion


def refused(least: float, signal: str) -> Callable[[Trial], Verdict]:
    """The run is refused because of its cost, and the estimate is at least so many steps. One that gets to its end has
    stepped over a mode that persists: `signal` tells what is left of it."""

    def criterion(trial: Trial) -> Verdict:
        import numpy as np

        if trial.trouble is not None and trial.trouble.code == "E414":
            steps = estimate(trial.trouble.message)
            word = OK if steps >= least else STOPS
            return Verdict(word, f"{steps:.0e} st", f"refused: {trial.trouble.message}")
        if not trial.finished:
            return stopped(trial)
        values = trial[signal]
        left = float(np.abs(values[-20:]).max() / np.abs(values).max())
        if left < 0.5:
            return Verdict(
                DAMPED, f"A {left:.1g}", f"{left:.2g} of {signal} is left after {trial.steps} steps"
            )
        turns = float((values[1:] * values[:-1] < 0)[-100:].mean())
        return Verdict(
            RINGS if turns > 0.7 else DRIFTS,
            f"A {left:.2g}",
            f"{signal} is an alias after {trial.steps} steps",
        )

    criterion.judges_stops = True  # type: ignore[attr-defined]
    return criterion

"""`.sens v(out) [i(v1) ..] tran [by r c1 m1(ke) ..]`: how a transient changes with parameters, as waveforms.

The derivatives of the outputs by each parameter, along the run of the deck's .tran, by forward sensitivities of the equations
beside the run (engine/dae/src/tangent.rs). Columns: time, the outputs, and sens(v(out),r) in units of the output over those of
the parameter. Without `by`: every .param of the deck, or, where there is none, the values of its R, C, L, V and I.

The engine has the derivatives by the unknowns exactly. Those by a parameter are differences of fourth order of the equations
at one point, not of runs: exact to some 1e-11 of what the parameter contributes.
"""

from __future__ import annotations

from .base import Analysis, Axis, Computed, Run, wrong

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any, ClassVar, Self

    import numpy as np

    from .._engine import System, Waveforms
    from ..assemble import Assembly, Context, Output
    from ..deck import Analysis as Card
    from ..deck import Probe
    from ..diagnostics import Diagnostic, Sink
    from ..elaborate.flat import FlatDeck
    from .base import Progress
    from .tran import Tran

STEP = 1e-3  # of a parameter's value, or of 1 where that is 0
POINTS = ((1, 8.0), (2, -1.0))  # central difference of order 4: sum k (f(j h) - f(-j h))/(12 h)
NODES = (0.0, 0.15505102572168218, 0.6449489742783178, 1.0)  # of a part of a step: its ends, Radau's stages
DEGREE = 8  # of what is kept of the outputs within the steps
FORM = ".sens v(out) [i(v1) ..] tran [by r c1 m1(ke) ..]"


class Slopes(Analysis):
    word = "sens"
    asks_as = "tran"
    form = FORM
    meaning = "how a transient changes with parameters"
    plotname = "Transient Sensitivity"
    axis = Axis("time", "s")
    names_itself: ClassVar[bool] = True
    shown: ClassVar[tuple[str, ...]] = ("sens",)

    def __init__(self, card: Card, asked: Sequence[Probe], names: Sequence[str]) -> None:
        self.card, self.asked, self.names = card, asked, names

    @classmethod
    def read(cls, card: Card, sink: Sink) -> Self | None:
        from ..build import parse_signals

        words = [str(a).lower() for a in card.args]
        at = words.index("tran")
        asked = parse_signals(" ".join(words[:at]), ".sens") if at else []
        rest = words[at + 1 :]
        if not asked or (rest and (rest[0] != "by" or not rest[1:])):
            wrong(cls, card, sink, ".sens .. tran takes signals, and behind `by` what they are derived by")
            return None
        if twice := next((name for k, name in enumerate(rest) if name in rest[:k]), None):
            wrong(cls, card, sink, f"`{twice}` stands twice")
            return None
        return cls(card, asked, rest[1:])

    def columns(self, ctx: Context) -> list[Output]:
        from ..assemble.outputs import column

        found = [column(ctx, probe.text, probe.ast, self.card.span) for probe in self.asked]
        if later := next((output.name for output in found if output.expr is None), None):
            wrong(
                type(self), self.card, ctx.sink, f".sens .. tran takes what the equations give, not `{later}`"
            )
        return found

    def run(self, assembly: Assembly, progress: Progress | None = None) -> Run:
        from ..diagnostics import DeckError
        from .tran import Tran

        outputs = assembly.outputs[self]
        names = list(self.names) or chosen(assembly.flat)
        trouble: list[Diagnostic] = []
        data: list[Any] = [[]] * (1 + len(outputs) * (1 + len(names)))
        runs = [a for a in assembly.analyses if isinstance(a, Tran)]
        grid, status = None, "failed"
        try:
            if not runs:
                raise _unfit("the deck has no .tran", self.card, "add .tran tstep tstop")
            waves, along = solve(assembly, runs[-1], self, names, progress)
            grid, status = (runs[-1].tstep, runs[-1].tstop, runs[-1].tstart), waves.status
            trouble = told(assembly, self, runs[-1], waves, names)
            data = _columns(waves, along, len(outputs))
        except DeckError as error:
            trouble = list(error.diagnostics)
        columns = ["time", *(o.name for o in outputs)]
        units = ["s", *(o.unit for o in outputs)]
        for name in names:
            columns += [f"sens({o.name},{name})" for o in outputs]
            units += ["" for _ in outputs]
        computed = Computed(data, status="failed" if trouble and status == "ok" else status)
        return Run(
            self, columns, units, computed, self.axis, grid=grid, trouble=trouble, plotname=self.plotname
        )


def solve(
    assembly: Assembly, tran: Tran, analysis: Analysis, names: Sequence[str], progress: Progress | None = None
) -> tuple[Waveforms, Along]:
    """The run of `tran`, with the outputs of `analysis` as its columns and within its steps, and their derivatives by the
    quantities `names`. Raises DeckError (E364) where there are none."""
    check(assembly, analysis)
    exprs = [o.expr for o in assembly.outputs[analysis] if o.expr is not None]
    sizes, besides = [], []
    for k, name in enumerate(names):
        size, others = beside(assembly, analysis, name)
        sizes.append(size)
        besides += [(k, *other) for other in others]

    def tick(now: float, step: float, steps: int, events: int) -> bool:
        return bool(progress and progress(now, tran.tstop, step, steps, events))

    waves = assembly.system.tran(
        tran.tstep, tran.tstop, tstart=tran.tstart, tmax=tran.tmax, uic=tran.uic, outputs=exprs, options_=assembly.options,
        progress=tick if progress else None, inside=(exprs, DEGREE), tangent=(sizes, besides),
    )  # fmt: skip
    return waves, Along(waves, len(names), len(exprs))


def check(assembly: Assembly, analysis: Analysis) -> None:
    """Raises DeckError for decks whose sensitivities along a transient are not defined here."""
    if assembly.ctx.delayed:
        raise _unfit("lines read what was a time ago: their sensitivities are not computed", analysis.card)
    if assembly.ctx.digital:
        said = "digital nodes hand instants on, not values: sensitivities through them are not computed"
        raise _unfit(said, analysis.card)
    if assembly.ctx.flat.clocked:
        raise _unfit("blocks jump at their ticks: sensitivities through them are not computed", analysis.card)
    if assembly.options["method"] == "multirate":
        raise _unfit(
            "method=multirate has no one step that they could go along with", analysis.card, "another method"
        )
    if assembly.flat.origin is None:
        said = "the deck was altered while it ran: it cannot be read again with other values"
        raise _unfit(said, analysis.card, "write the values into the deck, or alter a .param of it")


def others(
    assembly: Assembly, analysis: Analysis, name: str
) -> tuple[float, list[tuple[float, float, Assembly]]]:
    """The size of a quantity, and the deck assembled with other values of it: by how much, weight in the derivative, assembly."""
    from ..assemble import assemble
    from ..diagnostics import DeckError
    from ..elaborate.quantity import reread, value

    here = value(assembly.flat, name, analysis.card.span)
    size = abs(here) or 1.0
    step, found = STEP * size, []
    for j, weight in POINTS:
        for by in (j * step, -j * step):
            try:
                flat = reread(assembly.flat, {name: here + by})
                flat.measures = assembly.flat.measures
                flat.temp = here + by if name == "temp" else assembly.flat.temp
                flat.tnom = assembly.flat.tnom
                options = dict(assembly.options)
                other = assemble(flat, options, assembly.ctx.times, analyses=[analysis])
            except DeckError as error:
                first = next(d for d in error.diagnostics if d.severity == "error")
                raise _unfit(f"there is no derivative by `{name}`: {first.message}", analysis.card) from None
            found.append((by, weight / (12.0 * step) * (1.0 if by > 0 else -1.0), other))
    return size, found


def beside(
    assembly: Assembly, analysis: Analysis, name: str
) -> tuple[float, list[tuple[float, float, System, list[Any]]]]:
    """The size of a quantity, and the equations with other values of it: by how much, weight in the derivative, system,
    outputs."""
    size, found = others(assembly, analysis, name)
    return size, [
        (by, weight, other.system, [o.expr for o in other.outputs[analysis]]) for by, weight, other in found
    ]


class Along:
    """Derivatives along a run: a cubic for each part of its steps, and the outputs themselves as polynomials of degree DEGREE.
    Where a parameter moves corners of sources, the derivatives that the engine has go along with these, and that of the time
    stands behind those of the outputs."""

    def __init__(self, waves: Waveforms, parameters: int, outputs: int) -> None:
        import numpy as np

        found = waves.tangent()
        assert found is not None
        width, data, turns = found
        self.parameters, self.outputs = parameters, outputs
        rows = np.frombuffer(data).reshape(-1, len(NODES), width)
        self.starts, self.ends = rows[:, 0, 0], rows[:, -1, 0]
        self.rows = rows[:, :, 1:].reshape(len(rows), len(NODES), parameters, outputs + 1)
        self.shifts = bool(self.rows[..., -1].any())
        self.turns = np.frombuffer(turns).reshape(-1, 2 + parameters)
        self.waves = waves

    def at(self, times: np.ndarray) -> np.ndarray:
        """Derivatives at ascending times within the run: array of (times, parameters, outputs). Of one time that stands
        twice, the first is before a jump there."""
        import numpy as np

        first = np.concatenate(([True], times[1:] > times[:-1])) if len(times) else np.zeros(0, bool)
        part = np.searchsorted(self.starts, times, side="right") - 1
        before = np.searchsorted(self.starts, times, side="left") - 1
        part = np.where(first & (times <= self.ends[before]) & (before >= 0), before, part)
        found = self._within(part, times)
        if self.shifts:
            found[..., :-1] -= found[..., -1:] * self.values(times, 1)[:, None, :]
        return found[..., :-1]

    def raw(self, steps: np.ndarray) -> np.ndarray:
        """Derivatives as they go along with corners, that of the time behind them, at times within the run's steps: (steps,
        times) to (parameters, outputs + 1, steps, times)."""
        import numpy as np

        # the ends of a step belong to its own parts
        inside = steps + 1e-6 * (steps.mean(axis=1, keepdims=True) - steps)
        part = np.searchsorted(self.starts, inside.ravel(), side="right") - 1
        return np.moveaxis(self._within(part, steps.ravel()), 0, -1).reshape(
            self.parameters, self.outputs + 1, *steps.shape
        )

    def _within(self, part: np.ndarray, times: np.ndarray) -> np.ndarray:
        import numpy as np

        part = np.clip(part, 0, len(self.starts) - 1)
        width = self.ends[part] - self.starts[part]
        u = (times - self.starts[part]) / np.where(width > 0.0, width, 1.0)
        found: np.ndarray = np.einsum("tk,tkpo->tpo", lagrange(u, NODES), self.rows[part])
        return found

    def nodes(self, k: int) -> tuple[np.ndarray, np.ndarray]:
        """Times at which something may jump, before and behind it, and how they move with a parameter."""
        import numpy as np

        turns = self.turns[np.argsort(self.turns[:, 0], kind="stable")]
        times, moves = turns[:, :2].ravel(), np.repeat(turns[:, 2 + k], 2)
        if self.shifts:
            ends = np.stack((self.starts, self.ends), axis=1).ravel()
            shifts = self.rows[:, (0, -1), k, -1].ravel()
            moves = moves + np.interp(times, ends, shifts)
        return times, moves

    def values(self, times: np.ndarray, derivative: int = 0) -> np.ndarray:
        """The outputs at ascending times, or (1) their slopes: array of (times, outputs), by the steps' own dense output."""
        import numpy as np

        count = DEGREE + 1
        at = np.frombuffer(self.waves.inside(0)).reshape(-1, count)
        nodes = 0.5 - 0.5 * np.cos(np.pi * np.arange(count) / DEGREE)
        part = np.clip(np.searchsorted(at[:, 0], times, side="right") - 1, 0, len(at) - 1)
        width = at[part, -1] - at[part, 0]
        weights = lagrange((times - at[part, 0]) / np.where(width > 0.0, width, 1.0), nodes)
        if derivative:
            from .._engine import chebyshev

            weights = (weights @ np.array(chebyshev("slopes", DEGREE))) / np.where(
                width > 0.0, width, np.inf
            )[:, None]
        columns = [
            np.frombuffer(self.waves.inside(1 + k)).reshape(-1, count)[part] for k in range(self.outputs)
        ]
        return np.stack([np.einsum("tk,tk->t", weights, column) for column in columns], axis=1)


def lagrange(u: np.ndarray, nodes: Sequence[float] | np.ndarray) -> np.ndarray:
    """Weights of the values at the nodes in the polynomial through them, at each u: array of (len(u), len(nodes))."""
    import numpy as np

    x = np.asarray(nodes)
    weights = np.ones((len(u), len(x)))
    for k in range(len(x)):
        for j in range(len(x)):
            if j != k:
                weights[:, k] *= (u - x[j]) / (x[k] - x[j])
    return weights


def told(
    assembly: Assembly, analysis: Analysis, tran: Tran, waves: Waveforms, names: Sequence[str]
) -> list[Diagnostic]:
    """Why a run has no end, or its derivatives have none."""
    from ..assemble.bonds import breakable
    from ..diagnostics import Diagnostic

    if waves.status == "failed":
        from .failure import explain

        return explain(assembly, tran, waves, [])
    why = waves.refused
    flags = assembly.system.flag_names
    weak = None if assembly.machine is None else breakable(assembly.machine)
    if why is None and weak is not None:
        why = {"kind": "breaks", "flag": None, "t": None, "parameter": None}
    if why is None:
        if not waves.chattering:
            return []
        why = {"kind": "chatter", "flag": waves.chattering[0], "t": None, "parameter": None}
    flag = "a condition" if why["flag"] is None or not flags[why["flag"]] else f"`{flags[why['flag']]}`"
    name = "" if why["parameter"] is None else f"`{names[why['parameter']]}`"
    sentences = {
        "memory": (f"{flag} is kept of the state at an event, and the equations read it", None),
        "impact": (
            f"{flag} hits, and with values a little aside it does so otherwise",
            "another value: which parts stick, slide or rebound changes just there",
        ),
        "touch": (
            f"{flag} touches its threshold without crossing it, or turns together with another condition",
            None,
        ),
        "chatter": (f"{flag} slides along its threshold", "give it a hysteresis"),
        "breaks": (f"how the instant moves at which LATCH {weak} breaks is not known", "leave out its limit"),
        "corner": (
            f"{name} parts corners of sources that fall together, or lets them change places",
            "move them a little apart",
        ),
        "other": (
            f"the equations with another value of {name} are not the same ones, or have no start",
            None,
        ),
        "singular": ("their equations are singular", None),
        "full": ("they are too many to keep", "a shorter run, or fewer parameters"),
    }
    said, hint = sentences[why["kind"]]
    at = "" if why["t"] is None else f" from t = {why['t']:.6g} s on"
    return [Diagnostic("error", "E423", f"there are no sensitivities{at}: {said}", analysis.card.span, hint)]


def _columns(waves: Waveforms, along: Along, outputs: int) -> list[Any]:
    import numpy as np

    data = [np.frombuffer(waves.column(k)) for k in range(1 + outputs)]
    times = data[0]
    if not len(along.ends):
        return [[] for _ in range(1 + outputs * (1 + along.parameters))]
    known = times <= along.ends[-1]
    slopes = along.at(times[known])
    data = [column[known] for column in data]
    return [column.tobytes() for column in (*data, *slopes.reshape(len(slopes), -1).T)]


def chosen(flat: FlatDeck) -> list[str]:
    """Where nothing is said: every .param of the deck, or, where there is none, the values of its R, C, L, V, I."""
    params = list(flat.origin.deck.params) if flat.origin is not None else list(flat.params)
    if params:
        return params
    plain = (e for e in flat.elements if e.letter in "rclvi" and e.wave is None)
    return [e.name for e in plain if isinstance(e.value, (int, float)) or e.extra.get("dc") is not None]


def _unfit(said: str, card: Card, hint: str | None = None) -> Exception:
    from ..diagnostics import DeckError, Diagnostic

    return DeckError(
        Diagnostic("error", "E364", f"no sensitivities along a transient: {said}", card.span, hint)
    )

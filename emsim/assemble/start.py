"""The start: coordinates that close every loop, speeds that keep them closed, rows that say nothing new.

Positions: mass-weighted projection of the start onto h(q, 0) = 0, `ic=` held. Speeds: the least mass-weighted
change such that dh/dt = 0. A row is redundant when H = dh/dq loses rank without it, here and at a
configuration nearby (a change point alone does not make a row redundant). A coordinate whose motion meets no
inertia and no constraint cannot be integrated: [M; H] must have full column rank.
"""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .._engine import Expr
    from .loops import Row
    from .machine import Machine

CLOSE = 1e-9  # a loop is closed when the gap is below this, relative to the scene's size
RANK = (
    1e-5  # of singular values; an over-determined loop closes only to the root of the projection's accuracy
)
MOVED = 1e-9
MASSLESS = 1e-13  # beside the heaviest neighbour: a bead of 1e-12 kg on a kilogram still has inertia


class Start:
    """What was found: state `x`, `dof`, `moved` [(name, from, to)], `redundant` rows, `singular` there."""

    __slots__ = ("dof", "moved", "redundant", "singular", "x")

    def __init__(self) -> None:
        self.x: list[float] = []
        self.dof = 0
        self.moved: list[tuple[str, float, float]] = []
        self.redundant: list[Row] = []
        self.singular = False


def assemble(m: Machine) -> Start:
    """Finds the start, writes it into the builder, removes redundant rows from m.rows."""
    result = Start()
    own = m.own
    x = result.x = m.initial_state()
    if not own:
        _write(m, x)
        for row in m.rows:
            if abs(m.b.eval([m.public(row.h)], x, 0.0)[0]) > CLOSE:
                _cannot_close(m, [row], [m.b.eval([m.public(row.h)], x, 0.0)[0]])
        m.rows.clear()
        return result

    hs = [m.public(row.h) for row in m.rows]
    qs = [m.b.x(c.row) for c in own]
    if hs:
        mass = mass_matrix(m, x)
        before = list(x)
        held = [(m.public(q), u) for q, u in _held_at_cuts(m)]
        if not _close_loops(m, x, hs, [q for q, _ in held], mass):
            return result
        result.moved = [
            (c.q_name, before[c.row], x[c.row])
            for c in own
            if abs(x[c.row] - before[c.row]) > MOVED * (1.0 + abs(before[c.row]))
        ]
        gradient = [m.b.grad(h, qs) for h in hs]
        keep, result.singular = _independent(m, x, hs, gradient, mass)
        result.redundant = [row for k, row in enumerate(m.rows) if k not in keep]
        m.rows[:] = [m.rows[k] for k in keep]
        if result.singular:
            m.sink.warning(
                "W233",
                f"the loop of joints {_loops(m, m.rows)} starts at a change point: it can go on in two ways",
                m.span_of(m.rows[-1].owner),
                "start it a little aside with ic=, or drive through the point with other joints held",
            )
        gradient = [gradient[k] for k in keep]
        jacobian = _matrix(m, gradient, x)
        before = list(x)
        _speeds(m, x, jacobian, held, mass_matrix(m, x))
        result.moved += [
            (c.u_name, before[c.speed_row], x[c.speed_row])
            for c in own
            if abs(x[c.speed_row] - before[c.speed_row]) > MOVED * (1.0 + abs(before[c.speed_row]))
        ]
    else:
        jacobian = []
    result.dof = len(own) - len(m.rows)
    _inertia_everywhere(m, mass_matrix(m, x), jacobian)
    _write(m, x)
    return result


def _write(m: Machine, x: list[float]) -> None:
    for c in (*m.own, *m.given):
        for row in (c.row, c.speed_row):
            if row >= 0:
                m.b.set_initial(row, x[row])


def mass_matrix(m: Machine, x: list[float]) -> list[list[float]]:
    """M = d^2 T/du^2 at x. p = dT/du is linear in u, so columns are differences of p."""
    x = list(x)
    for c in m.own:
        x[c.speed_row] = 0.0
    rest = m.b.eval(m.momenta, x, 0.0)
    columns = []
    for c in m.own:
        x[c.speed_row] = 1.0
        columns.append([p - r for p, r in zip(m.b.eval(m.momenta, x, 0.0), rest, strict=True)])
        x[c.speed_row] = 0.0
    return [list(row) for row in zip(*columns, strict=True)]


def _matrix(m: Machine, rows: list[list[Expr]], x: list[float]) -> list[list[float]]:
    """Rows of expressions as numbers at x."""
    if not rows:
        return []
    n = len(rows[0])
    flat = m.b.eval([e for row in rows for e in row], x, 0.0)
    return [flat[k : k + n] for k in range(0, len(flat), n)]


def _weights(mass: list[list[float]]) -> list[list[float]]:
    """The mass matrix made safe for weighting: a coordinate without inertia gets a small one."""
    scale = max((row[k] for k, row in enumerate(mass)), default=0.0) or 1.0
    return [[v + (1e-9 * scale if i == j else 0.0) for j, v in enumerate(row)] for i, row in enumerate(mass)]


def _held_at_cuts(m: Machine) -> list[tuple[Expr, float | None]]:
    """What ic= of cut joints asks for: (expression to be 0, speed or None)."""
    found = []
    for name in m.plan.cut:
        joint = m.joints[name]
        for q, start, speed in zip(joint.qs, joint.card.start, joint.card.speed, strict=True):
            if start is not None:
                found.append((q - start, speed))
    return found


def _close_loops(
    m: Machine, x: list[float], hs: list[Expr], cuts: list[Expr], mass: list[list[float]]
) -> bool:
    """Project x onto h = 0; reports what stands in the way."""
    own, rows = [c.row for c in m.own], [c.row for c in m.own]
    held = [c.held for c in m.own]
    weights = [m.b.const(v) for row in _weights(mass) for v in row]
    ok, q, residual = m.b.project(own, [*hs, *cuts], weights, x, held, 0.0, 1e-13)
    if not ok:
        gap = [abs(v) for v in residual]
        if max(gap) > CLOSE * size(m, x):
            if (any(held) or cuts) and m.b.project(own, hs, weights, x, [False] * len(held), 0.0, 1e-13)[0]:
                _held_in_the_way(m)
            else:
                _cannot_close(m, m.rows, residual[: len(hs)])
            return False
    for row, value in zip(rows, q, strict=True):
        x[row] = value
    return True


def size(m: Machine, x: list[float]) -> float:
    """A length that says how big the scene is: the farthest joint or centre of mass [m]."""
    points = [m.frames[j.b].point(j.pb).pos for j in m.joints.values() if j.b in m.frames]
    values = m.b.eval([m.public(m.b.const(0.0) + e) for p in points for e in p], x, 0.0) if points else []
    return max((abs(v) for v in values), default=1.0) or 1.0


def _held_in_the_way(m: Machine) -> None:
    names = [c.of for c in m.own if c.held]
    names += [name for name in m.plan.cut if m.joints[name].card.given("ic")]
    joint = m.joints.get(names[0])
    span = joint.card.place("ic") if joint is not None else None
    m.sink.error(
        "E244",
        f"the loop {_loops(m, m.rows)} cannot close with ic= held at {', '.join(names)}",
        span,
        "guess= lets a coordinate move during assembly, ic= does not",
    )


def _loops(m: Machine, rows: list[Row]) -> str:
    owners = dict.fromkeys(row.owner for row in rows)
    return "; ".join(f"{', '.join(m.loop_of(name))}" for name in owners)


def _cannot_close(m: Machine, rows: list[Row], residual: list[float]) -> None:
    worst = max(range(len(rows)), key=lambda k: abs(residual[k]))
    row = rows[worst]
    unit = "m" if row.unit == "N" else "rad"
    m.sink.error(
        "E242",
        f"the loop of joints {_loops(m, [row])} cannot close: "
        f"{abs(residual[worst]):.3g} {unit} are left at {row.owner}",
        m.span_of(row.owner),
        "check lengths and points of the bodies, or give guess= nearer to where it closes",
    )


def _independent(
    m: Machine,
    x: list[float],
    hs: list[Expr],
    gradient: list[list[Expr]],
    mass: list[list[float]],
) -> tuple[list[int], bool]:
    """(rows to keep, is the start singular though no row is redundant)."""
    count, keep = m.b.rank(_matrix(m, gradient, x), RANK)
    if count == len(hs):
        return keep, False
    # a step away and back onto the constraints: rank there tells a change point from a redundant row
    away = list(x)
    for k, c in enumerate(m.own):
        away[c.row] += (0.02 + 0.013 * (k % 5)) * (1.0 if c.rotary else 0.1 * size(m, x))
    rows = [c.row for c in m.own]
    weights = [m.b.const(v) for row in _weights(mass) for v in row]
    ok, q, _ = m.b.project(rows, hs, weights, away, [False] * len(rows), 0.0, 1e-13)
    if not ok:
        return sorted(keep), False
    for row, value in zip(rows, q, strict=True):
        away[row] = value
    there, keep_there = m.b.rank(_matrix(m, gradient, away), RANK)
    return (sorted(keep_there), True) if there > count else (sorted(keep), False)


def _speeds(
    m: Machine,
    x: list[float],
    jacobian: list[list[float]],
    cuts: list[tuple[Expr, float | None]],
    mass: list[list[float]],
) -> None:
    """H u = -dh/dt at u = 0, `ic=` speeds held, those of cut joints as rows of their own."""
    own = m.own
    if not jacobian:
        return
    u0 = [c.start_speed for c in own]
    still = list(x)
    for c in own:
        still[c.speed_row] = 0.0
    drift = m.b.eval([m.public(m.rate(row.h)) for row in m.rows], still, 0.0)
    wanted = [(q, u) for q, u in cuts if u is not None]
    if wanted:
        qs = [m.b.x(c.row) for c in own]
        jacobian = jacobian + _matrix(m, [m.b.grad(q, qs) for q, _ in wanted], x)
        drift = drift + [-u for _, u in wanted]
    held = [c.held_speed for c in own]
    flat = [v for row in _weights(mass) for v in row]
    u = m.b.project_velocity(jacobian, flat, u0, held, [-d for d in drift])
    gap = [
        sum(h * v for h, v in zip(row, u, strict=True)) + d for row, d in zip(jacobian, drift, strict=True)
    ]
    scale = max((abs(v) for v in (*u, *drift)), default=0.0)
    if max(map(abs, gap)) > 1e-7 * (scale + 1e-30) * max(1.0, size(m, x)):
        names = [c.of for c in own if c.held_speed]
        names += [n for n in m.plan.cut if any(u is not None for u in m.joints[n].card.speed)]
        worst = min(max(range(len(gap)), key=lambda k: abs(gap[k])), len(m.rows) - 1)
        m.sink.error(
            "E244",
            f"the speeds held by ic= of {', '.join(names) or 'the joints'} break the loop "
            f"{_loops(m, [m.rows[worst]])}",
            m.span_of(names[0]) if names else None,
            "hold the speed of one joint per degree of freedom and leave the others free",
        )
    for c, value in zip(own, u, strict=True):
        x[c.speed_row] = value


def _inertia_everywhere(m: Machine, mass: list[list[float]], jacobian: list[list[float]]) -> None:
    """Every coordinate must meet inertia or be held by constraints."""
    n = len(mass)
    scale = [row[k] ** 0.5 if row[k] > 0.0 else 0.0 for k, row in enumerate(mass)]
    largest = max(scale, default=0.0)
    loose = [k for k in range(n) if scale[k] <= 1e-12 * largest or scale[k] == 0.0]
    unit = [1.0 if k in loose else scale[k] for k in range(n)]
    rows = [
        [0.0 if k in loose or j in loose else mass[k][j] / (unit[k] * unit[j]) for j in range(n)]
        for k in range(n)
    ]
    for row in jacobian:
        scaled = [v / unit[j] for j, v in enumerate(row)]
        top = max(map(abs, scaled), default=0.0) or 1.0
        rows.append([v / top for v in scaled])
    count, _ = m.b.rank(rows, MASSLESS)
    if count == n:
        return
    if not loose:  # singular all the same: name the coordinates that a leading block cannot tell apart
        loose = [next(k for k in range(n) if m.b.rank([r[: k + 1] for r in rows], MASSLESS)[0] <= k)]
    for c in [m.own[k] for k in loose][: max(1, n - count)]:
        body = m.moved_by(c)
        m.sink.error(
            "E243",
            f"body {body} can move ({c.q_name}) but has no {'inertia' if c.rotary else 'mass'} to move",
            m.span_of(body),
            "give it m= and j=, or a shape=; a point mass on its own axis has no inertia",
        )

"""The start: coordinates that close every loop, speeds that keep them closed, rows that say nothing new.

Positions: mass-weighted projection of the start onto h(q, 0) = 0, `ic=` held. Speeds: the least mass-weighted
change such that dh/dt = 0. A row is redundant when H = dh/dq loses rank without it, here and at configurations nearby, also
at those that drives reach later (a change point alone does not make a row redundant). A coordinate whose motion meets no
inertia and no constraint cannot be integrated: [M; H] must have full column rank.
"""

from __future__ import annotations

from . import closing
from .loops import Start

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator

    from .._engine import Expr
    from .loops import Row
    from .mechanism import Mechanism

RANK = (
    1e-5  # of singular values; an over-determined loop closes only to the root of the projection's accuracy
)
MOVED = 1e-9
LATER = (0.0, 0.01, 0.05, 0.13, 0.29, 0.47, 0.71, 0.97)  # parts of the run: where a driven loop is looked at
SAID = 4  # coordinates that a message names
EVIDENT = 1e-6  # of the largest one
MASSLESS = 1e-13  # beside the heaviest neighbour: a bead of 1e-12 kg on a kilogram still has inertia


def assemble(m: Mechanism) -> Start:
    """Finds the start, writes it into the builder, removes redundant rows from m.rows."""
    result = Start()
    own = m.own
    x = result.x = m.initial_state()
    measured = [row for row in m.rows if row.measured]
    known = [row for row in m.rows if not (row.measured or row.of_speeds)]
    if not own:
        closing.measure(m, x, measured)
        _write(m, x)
        for row in m.rows:
            if abs(m.b.eval([m.public(row.h)], x, 0.0)[0]) > closing.CLOSE:
                closing.cannot_close(m, [row], [m.b.eval([m.public(row.h)], x, 0.0)[0]])
        result.redundant = list(m.rows)
        m.rows.clear()
        return result

    if m.start_is_known:
        pass
    elif m.rows:
        mass = mass_matrix(m, x)  # of where it is, whatever its speeds
        before = list(x)
        held = [(m.public(q), u) for q, u in closing.held_at_cuts(m)]
        if not closing.close_loops(m, x, known, [q for q, _ in held], mass):
            return result
        closing.measure(m, x, measured)
        for (name, k), follows in m.turned.items():
            x[follows] = m.b.eval([m.public(m.joints[name].qs[k])], x, 0.0)[0]
        if x != before:
            mass = mass_matrix(m, x)
        result.moved = [
            (c.q_name, before[c.row], x[c.row])
            for c in m.places
            if abs(x[c.row] - before[c.row]) > MOVED * (1.0 + abs(before[c.row]))
        ]
        gradient = [m.public_all(m.row_slopes(row)) for row in m.rows]
        keep, result.singular = _independent(m, x, gradient, mass)
        result.redundant = [row for k, row in enumerate(m.rows) if k not in keep]
        m.rows[:] = [m.rows[k] for k in keep]
        gradient = [gradient[k] for k in keep]
        jacobian = matrix(m, gradient, x)
        before = list(x)
        _speeds(m, x, jacobian, held, mass)
        if result.singular:
            _leave(m, x, jacobian, mass)
            _say_how(m, x)
        result.moved += [
            (c.u_name, before[c.speed_row], x[c.speed_row])
            for c in m.motions
            if abs(x[c.speed_row] - before[c.speed_row]) > MOVED * (1.0 + abs(before[c.speed_row]))
        ]
        if not _all_have_inertia(m):
            _inertia_everywhere(m, mass, jacobian)
    elif not _all_have_inertia(m):
        _inertia_everywhere(m, mass_matrix(m, x), [])
    result.dof = len(m.motions) - len(m.rows)
    _write(m, x)
    return result


def _write(m: Mechanism, x: list[float]) -> None:
    for c in (*m.own, *m.given):
        for row in (c.row, c.speed_row):
            if row >= 0:
                m.b.set_initial(row, x[row])
    for follows in m.turned.values():
        m.b.set_initial(follows, x[follows])


def mass_matrix(m: Mechanism, x: list[float]) -> list[list[float]]:
    """M = d^2 T/du^2 at x. p = dT/du is linear in u, so columns are differences of p."""
    x = list(x)
    for c in m.motions:
        x[c.speed_row] = 0.0
    rest = m.b.eval(m.momenta, x, 0.0)
    columns = []
    for c in m.motions:
        x[c.speed_row] = 1.0
        columns.append([p - r for p, r in zip(m.b.eval(m.momenta, x, 0.0), rest, strict=True)])
        x[c.speed_row] = 0.0
    return [list(row) for row in zip(*columns, strict=True)]


def matrix(m: Mechanism, rows: list[list[Expr]], x: list[float], t: float = 0.0) -> list[list[float]]:
    """Rows of expressions as numbers at x."""
    if not rows:
        return []
    n = len(rows[0])
    if not n:
        return [[] for _ in rows]
    flat = m.b.eval([e for row in rows for e in row], x, t)
    return [flat[k : k + n] for k in range(0, len(flat), n)]


def _independent(
    m: Mechanism, x: list[float], gradient: list[list[Expr]], mass: list[list[float]]
) -> tuple[list[int], bool]:
    """(rows to keep, is the start singular though no row is redundant)."""
    best = m.b.rank(matrix(m, gradient, x), RANK)
    if best[0] == len(m.rows):
        return best[1], False
    # rank at other poses tells a change point from a redundant row
    singular = False
    for away, t in _others(m, x, mass, m.rows):
        there = m.b.rank(matrix(m, gradient, away, t), RANK)
        if there[0] > best[0]:
            best, singular = there, True
        if best[0] == len(m.rows):
            break
    return sorted(best[1]), singular


def _others(
    m: Mechanism, x: list[float], mass: list[list[float]], rows: list[Row]
) -> Iterator[tuple[list[float], float]]:
    """Other poses, and their times: steps away and back onto the constraints, and where drives lead."""
    weights = [m.b.const(v) for row in closing.weights_of(closing.of_places(m, mass, x)) for v in row]
    places = [c.row for c in m.places]
    hs = [m.public(row.h) for row in (*rows, *m.norms) if not row.of_speeds]
    driven = [c for c in m.given if c.row >= 0]
    for k, part in enumerate(LATER if m.drives else LATER[:1]):
        away = list(x)
        for at, c in enumerate((*m.places, *driven)):
            away[c.row] += (
                (1 + k) * (0.02 + 0.013 * (at % 5)) * (1.0 if c.rotary else 0.1 * closing.size(m, x))
            )
        t = part * m.ctx.times[1]
        if hs:
            ok, q, _ = m.b.project(places, hs, weights, away, [False] * len(places), t, 1e-13)
            if not ok:
                continue
            for row, value in zip(places, q, strict=True):
                away[row] = value
        yield away, t


def poses(m: Mechanism) -> Iterator[tuple[list[float], float]]:
    """The start, and other poses, each with its time."""
    yield m.found.x, 0.0
    mass = mass_matrix(m, m.found.x) if m.motions else []
    yield from _others(m, m.found.x, mass, [*m.rows, *m.found.redundant])


def _leave(m: Mechanism, x: list[float], jacobian: list[list[float]], mass: list[list[float]]) -> None:
    """Speeds at a change point. Where combinations w of the rows vanish, w^T H = 0, they do not hold u by dh/dt = 0 but by
    w^T d2h/dt2 = 0, which no acceleration enters: a quadratic equation, whose two solutions are the two ways to go on."""
    _, independent = m.b.rank(jacobian, RANK)
    seed: list[tuple[Expr, Expr | float]] = [(c.q, m.public(c.rate)) for c in m.places]
    seed += [(m.b.x(c.row), m.public(c.u)) for c in m.given if c.row >= 0]
    seed.append((m.b.time(), 1.0))
    rates = m.public_all(m.row_rates(m.rows))
    bent = m.b.tangent(rates, seed)
    asked = [rates[k] for k in independent]
    for k in range(len(m.rows)):
        if k in independent:
            continue
        total = bent[k]
        for i, share in zip(
            independent, _shares([jacobian[i] for i in independent], jacobian[k]), strict=True
        ):
            total = total - share * bent[i]
        asked.append(total)
    if max(map(abs, m.b.eval(asked, x, 0.0))) < MOVED:
        return  # it may as well stay
    own = [c.speed_row for c in m.motions]
    held = [c.held_speed for c in m.motions]
    weights = [m.b.const(v) for row in closing.weights_of(mass) for v in row]
    for sign in (1.0, -1.0):
        trial = list(x)
        for k, row in enumerate(own):
            trial[row] += (
                0.0
                if held[k]
                else sign * (1.0 + 0.1 * (k % 5)) * (1.0 if m.motions[k].rotary else closing.size(m, x))
            )
        ok, u, _ = m.b.project(own, asked, weights, trial, held, 0.0, 1e-10)
        if ok:
            for row, value in zip(own, u, strict=True):
                x[row] = value
            return


def _shares(rows: list[list[float]], row: list[float]) -> list[float]:
    """The combination of independent rows that gives another, by least squares."""
    a = [[sum(v * w for v, w in zip(p, q, strict=True)) for q in (*rows, row)] for p in rows]
    n = len(rows)
    for k in range(n):
        pivot = max(range(k, n), key=lambda i: abs(a[i][k]))
        a[k], a[pivot] = a[pivot], a[k]
        for i in range(n):
            if i != k:
                f = a[i][k] / a[k][k]
                a[i] = [v - f * w for v, w in zip(a[i], a[k], strict=True)]
    return [a[k][n] / a[k][k] for k in range(n)]


def _say_how(m: Mechanism, x: list[float]) -> None:
    """The pose and the loop that can go on in two ways, and the way that is taken."""
    pose = ", ".join(f"{c.q_name} = {x[c.row]:.4g}" for c in m.places[:SAID])
    moving = [c for c in m.motions if abs(x[c.speed_row]) > MOVED]
    way = ", ".join(f"{c.u_name} = {x[c.speed_row]:.4g}" for c in moving[:SAID])
    m.sink.warning(
        "W233",
        f"the loop of joints {closing.loops_of(m, m.rows)} starts at a change point ({pose}): it can go on in two ways"
        + (f", and goes on with {way}" if way else ""),
        m.span_of(m.rows[-1].owner),
        "start it a little aside with ic=, or say its speed with ic=(q,qd)",
    )


def _speeds(
    m: Mechanism,
    x: list[float],
    jacobian: list[list[float]],
    cuts: list[tuple[Expr, float | None]],
    mass: list[list[float]],
) -> None:
    """H u = -dh/dt at u = 0, `ic=` speeds held, those of cut joints as rows of their own."""
    own = m.motions
    if not jacobian:
        return
    u0 = [c.start_speed for c in own]
    still = list(x)
    for c in own:
        still[c.speed_row] = 0.0
    drift = m.b.eval(m.public_all(m.row_rates(m.rows)), still, 0.0)
    wanted = [(q, u) for q, u in cuts if u is not None]
    if wanted:
        jacobian = jacobian + matrix(m, [m.along_speeds(q) for q, _ in wanted], x)
        drift = drift + [-u for _, u in wanted]
    held = [c.held_speed for c in own]
    flat = [v for row in closing.weights_of(mass) for v in row]
    u = m.b.project_velocity(jacobian, flat, u0, held, [-d for d in drift])
    gap = [
        sum(h * v for h, v in zip(row, u, strict=True)) + d for row, d in zip(jacobian, drift, strict=True)
    ]
    scale = max((abs(v) for v in (*u, *drift)), default=0.0)
    if max(map(abs, gap)) > 1e-7 * (scale + 1e-30) * max(1.0, closing.size(m, x)):
        names = [c.of for c in own if c.held_speed]
        names += [n for n in m.plan.cut if any(u is not None for u in m.joints[n].card.speed)]
        worst = min(max(range(len(gap)), key=lambda k: abs(gap[k])), len(m.rows) - 1)
        m.sink.error(
            "E244",
            f"the speeds held by ic= of {', '.join(names) or 'the joints'} break the loop "
            f"{closing.loops_of(m, [m.rows[worst]])}",
            m.span_of(names[0]) if names else None,
            "hold the speed of one joint per degree of freedom and leave the others free",
        )
    for c, value in zip(own, u, strict=True):
        x[c.speed_row] = value


def _all_have_inertia(m: Mechanism) -> bool:
    """Has every moving body mass, and moments about all axes? Then a tree moves nothing without inertia, however it is jointed,
    and nothing has to be worked out: what a row less would cost grows with the third power of their number."""
    moving = [body for body in m.bodies.values() if not body.fixed]
    spatial = any(joint.kind.leaves_plane() for joint in m.joints.values())
    if spatial and any(any(body.inertia[3:]) for body in moving):
        return False  # products of inertia: their tensor may be singular
    masses = [body.m for body in moving]
    moments = [j for body in moving for j in body.inertia[0 if spatial else 2 : 3]]
    return all(min(values, default=0.0) > EVIDENT * max(values, default=0.0) for values in (masses, moments))


def _inertia_everywhere(m: Mechanism, mass: list[list[float]], jacobian: list[list[float]]) -> None:
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
    for c in [m.motions[k] for k in loose][: max(1, n - count)]:
        body = m.moved_by(c)
        m.sink.error(
            "E243",
            f"body {body} can move ({c.q_name or c.u_name}) but has no {'inertia' if c.rotary else 'mass'} to move",
            m.span_of(body),
            "give it m= and j=, or a shape=; a point mass on its own axis has no inertia",
        )

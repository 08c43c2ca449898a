"""Positions at the start: every loop closed, `ic=` held, `guess=` as near as it goes; then the rods are measured.

What is closed is h(q, 0) = 0, by a mass-weighted projection of where the cards put the coordinates. A `guess=` on a
coordinate of the tree is where that one sets out; on a joint that is cut, or tied by a gear, it is no coordinate. Where
there is such a one, or the loop has closed far from its guesses, all of them are rows first, and the projection sets
out from the point that meets them best; the assembly nearer to the guesses is taken. So the branch of a loop is the
one that was guessed, whichever joint is cut. Where nothing is guessed, the pose that was drawn is the guess. A rod
without `l=` takes no part: its length is the distance of its ends once the others have closed.
"""

from __future__ import annotations

from math import pi, remainder

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .._engine import Expr
    from .loops import Row
    from .mechanism import Mechanism
    from .scene import Coordinate

CLOSE = 1e-9  # a loop is closed when the gap is below this, relative to the scene's size
FAR = 0.5  # [rad^2] from its guesses, some 40 degrees: then it may be another branch
TRIES = 12  # of other starts


def weights_of(mass: list[list[float]]) -> list[list[float]]:
    """The mass matrix made safe for weighting: a coordinate without inertia gets a small one."""
    scale = max((row[k] for k, row in enumerate(mass)), default=0.0) or 1.0
    return [[v + (1e-9 * scale if i == j else 0.0) for j, v in enumerate(row)] for i, row in enumerate(mass)]


def of_places(m: Mechanism, mass: list[list[float]], x: list[float]) -> list[list[float]]:
    """The mass matrix of the speeds as a metric of the coordinates. Those of a group (q' = N u) count alike, with the mean
    inertia of its speeds."""
    if not m.groups:
        return mass
    at = {id(c): k for k, c in enumerate(m.motions)}
    mean: dict[int, float] = {}
    for group in m.groups:
        rows = [at[id(c)] for c in group.speeds]
        n = m.b.eval([e for column in group.columns() for e in column], x, 0.0)
        inertia = sum(mass[k][k] for k in rows) / sum(v * v for v in n)
        mean.update((id(c), inertia) for c in group.places)

    def entry(a: Coordinate, b: Coordinate) -> float:
        if id(a) in mean or id(b) in mean:
            return mean[id(a)] if a is b else 0.0
        return mass[at[id(a)]][at[id(b)]]

    return [[entry(a, b) for b in m.places] for a in m.places]


def held_at_cuts(m: Mechanism) -> list[tuple[Expr, float | None]]:
    """What ic= of cut joints asks for: (expression to be 0, speed or None)."""
    found = []
    for name in m.plan.cut:
        joint = m.joints[name]
        for q, start, speed in zip(joint.qs, joint.card.start, joint.card.speed, strict=False):
            if start is not None:
                found.append((q - start, speed))
    return found


def close_loops(
    m: Mechanism, x: list[float], known: list[Row], cuts: list[Expr], mass: list[list[float]]
) -> bool:
    """Project x onto h = 0 of these rows; reports what stands in the way."""
    hs = [m.public(row.h) for row in (*known, *m.norms)]
    own = [c.row for c in m.places]
    held = [c.held for c in m.places]
    weights = [m.b.const(v) for row in weights_of(of_places(m, mass, x)) for v in row]
    asked = [*hs, *cuts]
    ok, q, residual = m.b.project(own, asked, weights, x, held, 0.0, 1e-13)
    if ok:
        q = _unturned(m, x, q, asked)
    wanted, is_new = _guesses(m, x) if m.guessed else ([], False)
    if not wanted:
        wanted = _drawn(m, x, q)
    if wanted and (is_new or not ok or _off(m, x, q, wanted) > FAR):
        starts = [m.b.project(own, [*asked, *(e for e, _ in wanted)], weights, x, held, 0.0, 1e-13)[1]]
        for start in starts:
            there, nearer, _ = m.b.project(own, asked, weights, _with(m, x, start), held, 0.0, 1e-13)
            nearer = _unturned(m, x, nearer, asked)
            if there and (not ok or _off(m, x, nearer, wanted) + CLOSE < _off(m, x, q, wanted)):
                ok, q = True, nearer
            # one search may end in the wrong branch too
            if len(starts) <= TRIES and (not ok or _off(m, x, q, wanted) > FAR):
                starts.append(_aside(m, starts[0], len(starts)))
    if not ok:
        gap = [abs(v) for v in residual]
        if max(gap) > CLOSE * size(m, x):
            if (any(held) or cuts) and m.b.project(own, hs, weights, x, [False] * len(held), 0.0, 1e-13)[0]:
                _held_in_the_way(m, known)
            else:
                cannot_close(m, known, residual[: len(known)])
            return False
    x[:] = _with(m, x, q)
    return True


def _with(m: Mechanism, x: list[float], q: list[float]) -> list[float]:
    """The state with these coordinates."""
    x = list(x)
    for c, value in zip(m.places, q, strict=True):
        x[c.row] = value
    return x


def _aside(m: Mechanism, q: list[float], k: int) -> list[float]:
    """The k-th other start: free angles turned by golden angles, no two alike."""
    turns = [remainder(2.399963 * k * (i + 1), 2.0 * pi) for i in range(len(q))]
    free = [c.rotary and not c.held for c in m.places]
    return [v + turn * f for v, turn, f in zip(q, turns, free, strict=True)]


def _unturned(m: Mechanism, x: list[float], q: list[float], hs: list[Expr]) -> list[float]:
    """Without the full turns that the search has taken on its way, where they make no difference to h."""
    q = list(q)
    for k, c in enumerate(m.places):
        near = x[c.row] + remainder(q[k] - x[c.row], 2.0 * pi)
        if c.rotary and not c.held and abs(near - q[k]) > 1.0:
            before, trial = _sizes(m, x, q, hs), [*q[:k], near, *q[k + 1 :]]
            if _sizes(m, x, trial, hs) < 2.0 * before + CLOSE:
                q = trial
    return q


def _sizes(m: Mechanism, x: list[float], q: list[float], hs: list[Expr]) -> float:
    return max((abs(v) for v in m.b.eval(hs, _with(m, x, q), 0.0)), default=0.0)


def _guesses(m: Mechanism, x: list[float]) -> tuple[list[tuple[Expr, bool]], bool]:
    """What guess= asks for, as (expression to be 0, is it an angle?); and whether the coordinates do not set out
    from there anyway. An angle is within half a turn of its guess at x: full turns are not guessed."""
    rows, new = [], False
    coordinates = [m.b.x(c.row) for c in m.places]
    for joint in m.joints.values():
        if not joint.card.given("guess") or (joint.coordinates and joint.coordinates[0].drive is not None):
            continue
        new = new or not joint.coordinates or all(c.row < 0 for c in joint.coordinates)
        for k, q in enumerate(joint.qs):
            wanted, angle = joint.card.search[k], joint.kind.coordinates[k].turns
            if joint.card.start[k] is not None or not joint.card.guessed(k):
                continue
            q = m.public(q)
            if angle:
                off = m.b.eval([q], x, 0.0)[0] - wanted
                wanted += off - remainder(off, 2.0 * pi)
            if any(m.b.depends(q, coordinates)):
                rows.append((q - wanted, angle))
    return rows, new


def _drawn(m: Mechanism, x: list[float], closed: list[float]) -> list[tuple[Expr, bool]]:
    """The same where nothing is guessed: every coordinate that may move stays where it is; lengths count as parts of the
    machine's size, drawn or closed."""
    span = max(size(m, x), size(m, _with(m, x, closed)))
    free = [c for c in m.places if c.u_name and not c.held]
    return [((c.q - x[c.row]) * (1.0 if c.rotary else 1.0 / span), c.rotary) for c in free]


def _off(m: Mechanism, x: list[float], q: list[float], wanted: list[tuple[Expr, bool]]) -> float:
    """How far from its guesses a state is: the square of what is left of them, full turns not counted."""
    left = zip(m.b.eval([e for e, _ in wanted], _with(m, x, q), 0.0), wanted, strict=True)
    return sum((remainder(v, 2.0 * pi) if angle else v) ** 2 for v, (_, angle) in left)


def measure(m: Mechanism, x: list[float], rows: list[Row]) -> None:
    """What rows come to where the machine starts is what they hold: the lengths of rods that were given none."""
    for row in rows:
        value = m.b.eval([m.public(row.h)], x, 0.0)[0]
        row.h = row.h - value
        joint = m.joints.get(row.owner)
        if joint is not None:
            joint.kind.length = value
            if value == 0.0:
                no_length(m, row.owner)


def no_length(m: Mechanism, rod: str) -> None:
    m.sink.error(
        "E242", f"rod {rod} has no length at the start", m.span_of(rod), "give l=, or guess= elsewhere"
    )


def size(m: Mechanism, x: list[float]) -> float:
    """A length that says how big the scene is: the farthest joint or centre of mass [m]."""
    points = [m.frames[j.b].point(j.pb).pos for j in m.joints.values() if j.b in m.frames]
    values = m.b.eval([m.public(m.b.const(0.0) + e) for p in points for e in p], x, 0.0) if points else []
    return max((abs(v) for v in values), default=1.0) or 1.0


def _held_in_the_way(m: Mechanism, rows: list[Row]) -> None:
    names = [c.of for c in m.places if c.held]
    names += [name for name in m.plan.cut if m.joints[name].card.given("ic")]
    joint = m.joints.get(names[0])
    span = joint.card.place("ic") if joint is not None else None
    m.sink.error(
        "E244",
        f"the loop {loops_of(m, rows)} cannot close with ic= held at {', '.join(names)}",
        span,
        "guess= lets a coordinate move during assembly, ic= does not",
    )


def loops_of(m: Mechanism, rows: list[Row]) -> str:
    owners = dict.fromkeys(row.owner for row in rows)
    return "; ".join(f"{', '.join(m.loop_of(name))}" for name in owners)


def cannot_close(m: Mechanism, rows: list[Row], residual: list[float]) -> None:
    worst = max(range(len(rows)), key=lambda k: abs(residual[k]))
    row = rows[worst]
    unit = ("m" if row.unit == "N" else "rad") + ("/s" if row.of_speeds else "")
    m.sink.error(
        "E242",
        f"the loop of joints {loops_of(m, [row])} cannot close: "
        f"{abs(residual[worst]):.3g} {unit} are left at {row.owner}",
        m.span_of(row.owner),
        "check lengths and points of the bodies, or give guess= nearer to where it closes",
    )

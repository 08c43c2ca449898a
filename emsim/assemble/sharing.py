"""Reactions that equilibrium does not determine: which they are, and the least of all answers.

H = dh/dq of all rows, also of those that were left out since they say nothing new. Multipliers are known up to self-stresses z,
z^T H = 0, and a reaction is R + E z: R what the rows that were kept give, E what each row adds, a slope dh/ds of a virtual
motion. It is unique where E z = 0. Shown is the answer that is least in

    sum force^2 + sum (moment / l)^2        l: root mean square distance of the joints concerned from their mean

which is how joints share a load that are all equally stiff, whatever the order of cards. With the rows that were kept, H_k,
and those that were left out, H_l, in symbols, so that it holds in every pose:

    Z = [-(H_k D H_k^T)^-1 H_k D H_l^T; 1]      self-stresses, one a row that was left out; D makes columns alike
    a = -(V^T W V)^-1 V^T W R,   V = E Z        W: weights of the sum; shown is R + V a

Both matrices are symmetric and positive definite. Nothing that moves reads this, but friction that goes with a load.
Closure rows that fold to a constant are of this kind too: a second hinge on the axis of the first.
"""

from __future__ import annotations

from . import reactions
from .asked import EFFORTS, FORCES, MOMENTS, REACTIONS
from .loops import Row
from .scale import scale
from .scene import FREE
from .start import RANK, matrix, poses
from .tree import Parts

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from .._engine import Builder, Expr
    from .mechanism import Mechanism
    from .scene import JointState

    Key = tuple[str, str]  # function and name, as the deck writes them: ("fx", "hinge")
    Pose = tuple[list[float], float]  # a state and its time

EFFORT = reactions.EFFORT
RIDGE = 1e-14  # of the diagonal
ALONE = 1e-9  # of the largest share: a row that has less has none


def _idle(m: Mechanism) -> list[Row]:
    """Closure rows that fold, though they hold something: whatever moves, they are constant."""
    found = []
    for name in m.plan.cut:
        joint = m.joints[name]
        if not m.plan.loop(joint.a, joint.b):
            continue
        taken = {row.place for row in (*m.rows, *m.found.redundant) if row.owner == name}
        rows = joint.closure(m.b, m.frames[joint.a], m.frames[joint.b])
        if len(taken) == len(rows):
            continue
        slopes = [reactions.own_slopes(m, joint, REACTIONS[fn]) for fn in reactions.words(m)]
        for k, (label, _, unit) in enumerate(rows):
            if k not in taken and any(m.public(column[k]).value != 0.0 for column in slopes):
                found.append(Row(name, k, label, m.b.const(0.0), unit))
    return found


def _product(b: Builder, p: Sequence[Expr], q: Sequence[Expr]) -> Expr:
    total = b.const(0.0)
    for v, w in zip(p, q, strict=True):
        if v.value != 0.0 and w.value != 0.0:
            total = total + v * w
    return total


def _solve(b: Builder, a: list[list[Expr]], columns: list[list[Expr]]) -> list[list[Expr]]:
    """x of A x = c for every column c; A is symmetric and positive definite, so L D L^T needs no pivots. Where a pose takes rank
    from it, as where links lie in one line, RIDGE keeps x finite."""
    n = len(a)
    lower: list[list[Expr]] = [[] for _ in range(n)]
    d: list[Expr] = []
    for i in range(n):
        scaled: list[Expr] = []  # L D of this row
        for j in range(i):
            scaled.append(a[i][j] - _product(b, scaled, lower[j]))
        lower[i] = [v / p for v, p in zip(scaled, d, strict=True)]
        d.append(a[i][i] * (1.0 + RIDGE) - _product(b, scaled, lower[i]))
    found = []
    for column in columns:
        x: list[Expr] = []
        for i in range(n):
            x.append(column[i] - _product(b, lower[i], x))
        x = [v / p for v, p in zip(x, d, strict=True)]
        for i in reversed(range(n)):
            x[i] = x[i] - _product(b, [lower[k][i] for k in range(i + 1, n)], x[i + 1 :])
        found.append(x)
    return found


class Sharing:
    """Rows and reactions of a machine that holds more than there is to hold."""

    def __init__(self, m: Mechanism) -> None:
        self.m = m
        self.rows: list[Row] = [*m.rows, *m.found.redundant, *_idle(m)]
        self.kept = len(m.rows)
        self._at: dict[int, int] = {}  # motion -> its place in slopes
        self._slopes: list[list[Expr]] = []
        self._gradient: list[list[Expr]] = []
        self._taking_part: set[int] = set()
        self.length = 1.0
        self.effects: dict[Key, list[Expr]] = {}
        self.groups: list[dict[Key, list[Expr]]] = []
        self._shares: dict[Key, Expr] = {}

    # what rows add to reactions -----------------------------------------------------------------------

    def _keys(self) -> list[Key]:
        """All reactions and efforts that there are expressions of."""
        m = self.m
        found = [
            (fn, joint.name)
            for key, joint in m.joints.items()
            for fn in reactions.words(m)
            if key[:1] != FREE and (joint.cut or REACTIONS[fn] in joint.virtuals)
        ]
        places = [(row.place, row.owner) for row in self.rows if row.owner in m.couplings]
        places += [(0, name) for name in m.couplings if reactions.keeper(m, name) is not None]
        return found + [(f"{EFFORT},{place}", name) for place, name in dict.fromkeys(places)]

    def _turns(self, key: Key) -> bool:
        """Is it a moment?"""
        fn, name = key
        if fn.partition(",")[0] != EFFORT:
            return fn in MOMENTS
        unit = next((row.unit for row in self.rows if row.owner == name), "")
        first = self.m.joints.get(self.m.couplings[name].terminals[0][2].name)
        return unit == "N m" if unit else first is not None and first.rotary

    def _effects(self, fn: str, name: str) -> list[Expr] | None:
        """What a unit of each row's multiplier adds; None where no row adds anything."""
        m = self.m
        joint = m.joints.get(name)
        if fn in REACTIONS and joint is not None:
            found = self._at_cut(joint, fn) if joint.cut else self._in_tree(joint, fn)
        elif any(row.owner == name for row in self.rows):
            place = int(fn.partition(",")[2])
            found = [m.b.const(float(row.owner == name and row.place == place)) for row in self.rows]
        elif (what := reactions.keeper(m, name)) is not None:
            motion, factor = what
            found = [-factor * slopes[self._at[id(motion)]] for slopes in self._slopes]
        else:
            return None
        return None if all(e.value == 0.0 for e in found) else found

    def _in_tree(self, joint: JointState, fn: str) -> list[Expr]:
        across = reactions.across(self.m, joint, REACTIONS[fn])
        found = []
        for slopes in self._slopes:
            total = self.m.b.const(0.0)
            for weight, key in across:
                total = total - weight * slopes[self._at[id(joint.virtuals[key])]]
            found.append(total)
        return found

    def _at_cut(self, joint: JointState, fn: str) -> list[Expr]:
        m = self.m
        slopes = reactions.own_slopes(m, joint, REACTIONS[fn])
        zero = m.b.const(0.0)
        return [m.public(slopes[row.place]) if row.owner == joint.name else zero for row in self.rows]

    # which are not unique -----------------------------------------------------------------------------

    def _stresses(self, pose: Pose) -> list[list[float]]:
        """A basis of the self-stresses at a pose, one for each row that was left out, without what is rounding."""
        h = matrix(self.m, self._gradient, *pose)
        kept, left = h[: self.kept], h[self.kept :]
        sizes = [sum(v * v for v in row) ** 0.5 for row in h]
        n = self.kept
        found = []
        for k, row in enumerate(left):
            share = [0.0] * n
            if n and any(row):
                columns = [list(column) for column in zip(*kept, strict=True)]
                unit = [float(i == j) for i in range(n) for j in range(n)]
                share = self.m.b.project_velocity(columns, unit, share, [False] * n, row)
            z = [-v for v in share] + [float(k == j) for j in range(len(left))]
            largest = max(abs(v) * s for v, s in zip(z, sizes, strict=True))
            found.append(
                [v if j >= n or abs(v) * sizes[j] > ALONE * largest else 0.0 for j, v in enumerate(z)]
            )
        return found

    def examine(self) -> bool:
        """Sorts what is not unique into groups that share nothing with one another; is there anything?"""
        m = self.m
        if len(self.rows) == self.kept:
            return False
        symbols = [v.s for v in m.virtuals] + [c.q for c in m.given]
        self._at = {id(one): k for k, one in enumerate([*m.virtuals, *m.given])}
        rates = [v.rate for v in m.virtuals] + [c.u for c in m.given]
        self._slopes = [
            m.public_all(m.b.grad(row.h, rates if row.of_speeds else symbols)) if symbols else []
            for row in self.rows
        ]
        self._gradient = [m.public_all(m.row_slopes(row)) for row in self.rows]
        self.length = scale(m).length or 1.0
        self.effects = {key: effects for key in self._keys() if (effects := self._effects(*key)) is not None}
        keys = list(self.effects)
        parts = Parts(name for _, name in keys)
        hit: set[Key] = set()
        flat = [e for effects in self.effects.values() for e in effects]
        count = len(self.rows)
        for pose in poses(m):
            values = m.b.eval(flat, *pose) if flat else []
            for z in self._stresses(pose):
                self._taking_part |= {k for k, v in enumerate(z) if v != 0.0}
                sums = {
                    key: abs(sum(v * w for v, w in zip(values[i * count : (i + 1) * count], z, strict=True)))
                    / (self.length if self._turns(key) else 1.0)
                    for i, key in enumerate(keys)
                }
                largest = max(sums.values(), default=0.0)
                moved = [key for key in keys if sums[key] > RANK * largest]
                hit |= {*moved}
                for _, name in moved[1:]:
                    parts.join(moved[0][1], name)
        groups: dict[str, dict[Key, list[Expr]]] = {}
        for key in keys:
            if key in hit:
                groups.setdefault(parts.find(key[1]), {})[key] = self.effects[key]
        self.groups = [*groups.values()]
        return bool(self.groups)

    def read(self) -> list[str]:
        """What the deck reads of it."""
        asked = sorted(self.m.wanted, key=lambda one: (one[1], one[0]))
        return [f"{fn}({name})" for fn, name in asked if self.is_open((fn, name))]

    def rubs(self) -> list[str]:
        """Cards whose friction goes with such a load."""
        return [
            f"FRICTION {card.name}"
            for card in self.m.couplings.values()
            if card.spec.word == "FRICTION" and card.given("mu")
            if any(self.is_open((fn, card.terminals[0][2].name)) for fn in FORCES)
        ]

    def is_open(self, key: Key) -> bool:
        """Is this reaction, as the deck writes it, one of many answers?"""
        fn, name = key
        if fn in EFFORTS:
            return any(n == name and f.startswith(EFFORT) for group in self.groups for f, n in group)
        return any(key in group for group in self.groups)

    # the least answer ---------------------------------------------------------------------------------

    def _extent(self, group: dict[Key, list[Expr]]) -> float:
        """l of a group of reactions [m]."""
        m = self.m
        names = dict.fromkeys(name for _, name in group)
        joints = dict.fromkeys(
            name if name in m.joints else m.couplings[name].terminals[0][2].name for name in names
        )
        at = [m.joints[name] for name in joints if name in m.joints]
        points = [m.b.const(0.0) + v for j in at for v in m.frames[j.b].point(j.pb).pos]
        values = m.b.eval(m.public_all(points), m.found.x, 0.0) if points else []
        square = 0.0
        for axis in (values[0::3], values[1::3], values[2::3]):
            mean = sum(axis) / max(1, len(axis))
            square += sum((v - mean) ** 2 for v in axis) / max(1, len(axis))
        extent = square**0.5
        return extent if extent > ALONE * self.length else self.length

    def settle(self) -> None:
        """The least answer in symbols; reactions may be read from now on."""
        m, b = self.m, self.m.b
        kept = [k for k in sorted(self._taking_part) if k < self.kept]
        left = range(self.kept, len(self.rows))
        # H D: a length or an angle counts by what rows make of it at the start
        start = matrix(m, self._gradient, m.found.x, 0.0)
        sizes = [max(map(abs, column)) for column in zip(*start, strict=True)]
        scaled = [
            [e * (1.0 / s**2 if s > 0.0 else 1.0) for e, s in zip(self._gradient[k], sizes, strict=True)]
            for k in kept
        ]
        gram = [[_product(b, row, self._gradient[k]) for k in kept] for row in scaled]
        asked = [[_product(b, row, self._gradient[k]) for row in scaled] for k in left]
        # what a unit at each row that was left out adds to every reaction, with what balances it at the others
        adds: dict[Key, list[Expr]] = {}
        shares = _solve(b, gram, asked)
        for key in [key for group in self.groups for key in group]:
            effects = self.effects[key]
            own = [effects[k] for k in kept]
            adds[key] = [effects[k] - _product(b, own, share) for k, share in zip(left, shares, strict=True)]
        weights = {
            key: 1.0 / self._extent(group) ** 2 if self._turns(key) else 1.0
            for group in self.groups
            for key in group
        }
        normal = [[b.const(0.0) for _ in left] for _ in left]
        pull = [b.const(0.0) for _ in left]
        for key, column in adds.items():
            bare = weights[key] * reactions.bare(m, *key)
            for i, one in enumerate(column):
                pull[i] = pull[i] - one * bare
                for j, other in enumerate(column):
                    normal[i][j] = normal[i][j] + weights[key] * one * other
        (least,) = _solve(b, normal, [pull])
        self._shares = {key: _product(b, column, least) for key, column in adds.items()}

    def share(self, fn: str, name: str) -> Expr | None:
        """What is added to a reaction, or to the effort of a coupling; None where it is unique."""
        return self._shares.get((fn, name))

"""Random machines, in the plane and in space, for test_random_machines.py.

A machine is a tree of bodies on joints of every kind, which stiff bars or pins close to loops, with springs, dampers, forces,
torques, gears, drives and a motor in a circuit. What must come out is not known, so two sets of equations answer
(`formulation=absolute` shares no closure row, mass matrix or multiplier with joint coordinates), and what mechanics keeps:
energy where nothing takes or gives any, momentum and its moment where nothing holds the whole.
"""

from __future__ import annotations

import math
import random
from dataclasses import dataclass, field

SPAN = 0.5
GRID = 0.01
PLANE = ("pin", "pin", "pin", "slide", "pinslot")
SPACE = ("pin", "pin", "ball", "universal", "cylinder", "slide", "pinslot")
FREEDOMS = {"pin": 1, "slide": 1, "pinslot": 2, "universal": 2, "cylinder": 2, "ball": 3, "planar": 3}
SHAKEN = ("0.4*sin(7*time)", "0.3*(1-cos(9*time))", "0.5*time", "0.2*time^2-0.1*sin(5*time)")


@dataclass
class Machine:
    """`reads` are places, `speeds` theirs, `forces` what a joint transmits; `floats`: nothing holds it, and `masses` are the
    bodies' with their moments of inertia."""

    seed: int
    space: bool
    cards: list[str] = field(default_factory=list)
    reads: list[str] = field(default_factory=list)
    speeds: list[str] = field(default_factory=list)
    forces: list[str] = field(default_factory=list)
    keeps_energy: bool = True
    floats: bool = False
    masses: list[tuple[str, float, float]] = field(default_factory=list)

    gravity: tuple[float, float, float] | None = None

    def deck(self, options: str) -> str:
        return "\n".join(
            [
                f"machine {self.seed}",
                *([] if self.gravity is None else [".gravity " + " ".join(str(g) for g in self.gravity)]),
                *self.cards,
                f".options {options}",
                f".tran {GRID:g} {SPAN:g}",
                f".print tran {' '.join([*self.reads, *self.speeds, *self.forces])} energy()",
                ".end",
                "",
            ]
        )


def machine(seed: int) -> Machine:
    rng = random.Random(seed)
    m = Machine(seed, space=rng.random() < 0.5)
    _Maker(m, rng).make()
    return m


class _Maker:
    def __init__(self, m: Machine, rng: random.Random) -> None:
        self.m, self.rng = m, rng
        self.bodies: list[str] = []
        self.joints: list[tuple[str, str, str]] = []  # name, kind, carrier; of the bodies in turn
        self.loops: list[tuple[set[str], int]] = []  # joints of a loop, freedoms that it leaves them
        self.pose: dict[str, tuple[float, float, float] | None] = {
            "0": (0.0, 0.0, 0.0)
        }  # x, y, angle where known
        self.driven: set[str] = set()

    def number(self, low: float, high: float) -> float:
        return round(self.rng.uniform(low, high), 3)

    def triple(self, low: float, high: float) -> tuple[float, float, float]:
        return self.number(low, high), self.number(low, high), self.number(low, high)

    def point(self) -> tuple[float, ...]:
        return tuple(self.number(-0.3, 0.3) for _ in range(3 if self.m.space else 2))

    def make(self) -> None:
        m, rng = self.m, self.rng
        m.floats = not m.space and rng.random() < 0.2
        if not m.floats:
            m.gravity = (self.number(-4, 4), -9.81, self.number(-4, 4)) if m.space else (0.0, -9.81, 0.0)
        bodies = rng.randint(1, 4)
        closed = not m.floats and bodies > 1 and rng.random() < 0.5
        for k in range(bodies):
            self.body(f"b{k}", still=closed)
        if closed:
            self.close("shut")
            if bodies > 2 and rng.random() < 0.4:
                self.close("shut2")
        for k in range(rng.randint(0, 2)):
            self.spring(k)
        for maker in rng.sample(
            [self.damper, self.force, self.torque, self.gear, self.drive, self.motor], rng.randint(0, 2)
        ):
            maker(closed)
        self.forces()

    def forces(self) -> None:
        """What one joint transmits, by components that both formulations have."""
        name = self.rng.choice(self.joints)[0]
        words = ("fx", "fy", "fz", "mx", "my", "mz") if self.m.space else ("fx", "fy", "mz")
        self.m.forces += [f"{word}({name})" for word in words]

    def body(self, name: str, still: bool) -> None:
        m, rng = self.m, self.rng
        mass = self.number(0.2, 2)
        com = self.point()
        if m.space:
            a, b, c = sorted(self.triple(5, 30))
            c = min(c, 0.95 * (a + b))
            off = [round(self.number(-0.2, 0.2) * a, 3) for _ in range(3)]
            inertia = ",".join(f"{v}m" for v in (a, b, c, *off))
            m.cards.append(f"BODY {name} m={mass} j=({inertia}) com={_text(com)}")
        else:
            inertia = self.number(5, 30)
            m.cards.append(f"BODY {name} m={mass} j={inertia}m com={_text(com)}")
            m.masses.append((name, mass, inertia * 1e-3))
        root = not self.bodies
        carrier = "0" if root or (rng.random() < 0.15 and not m.floats) else rng.choice(self.bodies)
        kind = "planar" if root and m.floats else rng.choice(SPACE if m.space else PLANE)
        pa, pb = self.point(), self.point()
        first, second = f"{carrier}{_text(pa)}", f"{name}{_text(pb)}"
        count = FREEDOMS[kind]
        at = [self.number(-0.9, 0.9) for _ in range(count)]
        if kind in ("slide", "pinslot", "cylinder", "planar"):
            at[0] = self.number(-0.2, 0.2)
        speed = [0.0 if still else self.number(-3, 3) for _ in range(count)]
        axis = ""
        direction: tuple[float, ...] = (1.0, 0.0)
        if kind in ("slide", "pinslot"):
            direction = (1.0, self.number(-2, 2))
            axis = f" axis={_text(direction)}"
        if m.space and kind in ("pin", "cylinder", "universal", "slide"):
            axis = f" axis={_text((1.0, self.number(-2, 2), self.number(-2, 2)))}"
        start = ",".join(str(v) for v in (*at, *speed))
        joint = f"j{len(self.joints)}"
        m.cards.append(f"JOINT {joint} {first} {second} {kind}{axis} ic=({start})")
        self.joints.append((joint, kind, carrier))
        self.place(name, kind, carrier, pa, pb, at, direction)
        self.bodies.append(name)
        p = self.point()
        for word in ("x", "y", "z") if m.space else ("x", "y"):
            m.reads.append(f"{word}({name}{_text(p)})")
            m.speeds.append(f"v{word}({name}{_text(p)})")
        if m.floats:
            m.speeds += [
                f"{word}({name}{q})" for word in ("x", "y", "vx", "vy") for q in (".com", "(0,0)", "(1,0)")
            ]

    def place(
        self,
        name: str,
        kind: str,
        carrier: str,
        pa: tuple[float, ...],
        pb: tuple[float, ...],
        at: list[float],
        direction: tuple[float, ...],
    ) -> None:
        """Where a body of the plane is at the start."""
        base = self.pose[carrier]
        if self.m.space or base is None:
            self.pose[name] = None
            return
        x, y, turn = base
        along = at[0] if kind in ("slide", "pinslot") else 0.0
        size = math.hypot(*direction)
        px, py = pa[0] + along * direction[0] / size, pa[1] + along * direction[1] / size
        x, y = x + px * math.cos(turn) - py * math.sin(turn), y + px * math.sin(turn) + py * math.cos(turn)
        if kind != "slide":
            turn += at[0] if kind == "pin" else at[1]
        x, y = (
            x - pb[0] * math.cos(turn) + pb[1] * math.sin(turn),
            y - pb[0] * math.sin(turn) - pb[1] * math.cos(turn),
        )
        self.pose[name] = (x, y, turn)

    def close(self, name: str) -> None:
        """A bar, or a pin, of the last body on the ground or another body; and it need not be the joint that is cut."""
        m, rng = self.m, self.rng
        last, other = self.bodies[-1], rng.choice(["0", *self.bodies[:-1]])
        p = self.point()
        here, there = self.pose[last], self.pose[other]
        around = self.outwards(last) ^ self.outwards(other)
        freedoms = sum(FREEDOMS[kind] for name, kind, _ in self.joints if name in around)
        if (
            name == "shut"
            and here
            and there
            and freedoms >= 3
            and self.joints[-1][2] != other
            and rng.random() < 0.7
        ):
            x = here[0] + p[0] * math.cos(here[2]) - p[1] * math.sin(here[2]) - there[0]
            y = here[1] + p[0] * math.sin(here[2]) + p[1] * math.cos(here[2]) - there[1]
            q = (
                x * math.cos(there[2]) + y * math.sin(there[2]),
                -x * math.sin(there[2]) + y * math.cos(there[2]),
            )
            m.cards.append(f"JOINT {name} {last}{_text(p)} {other}({q[0]:.17g},{q[1]:.17g}) pin")
            self.loops.append((around, freedoms - 2))
        else:
            q3 = tuple(self.number(0.5, 0.9) for _ in p)
            m.cards.append(f"JOINT {name} {last}{_text(p)} {other}{_text(q3)} rod")
            self.loops.append((around, freedoms - 1))
        if name == "shut" and not m.space and rng.random() < 0.8:
            chosen = rng.choice(self.joints)[0]
            m.cards = [f"{line} cut=yes" if line.startswith(f"JOINT {chosen} ") else line for line in m.cards]

    # what acts -------------------------------------------------------------------------------------

    def turning(self) -> list[str]:
        return [name for name, kind, _ in self.joints if kind in ("pin", "slide") and name not in self.driven]

    def outwards(self, body: str) -> set[str]:
        """Joints from the ground to a body."""
        found: set[str] = set()
        while body != "0":
            name, _, carrier = self.joints[self.bodies.index(body)]
            found.add(name)
            body = carrier
        return found

    def free(self, joint: str) -> bool:
        """Is a motion of it left when it is given another law?"""
        return all(joint not in around or (len(self.loops) == 1 and left >= 2) for around, left in self.loops)

    def let_go(self, joints: list[str]) -> None:
        """Where they are at the start follows from others: near the pose that was drawn."""
        for k, line in enumerate(self.m.cards):
            if line.startswith("JOINT ") and line.split()[1] in joints and " ic=" in line:
                head, _, rest = line.partition(" ic=")
                values = _start(line)
                guess = values[: len(values) // 2]
                text = f"({','.join(guess)})" if len(guess) > 1 else guess[0]
                self.m.cards[k] = f"{head} guess={text}{rest.partition(')')[2]}"

    def spring(self, k: int) -> None:
        m, rng = self.m, self.rng
        joints = self.turning()
        if joints and rng.random() < 0.5:
            m.cards.append(
                f"SPRING s{k} {rng.choice(joints)} k={self.number(1, 30)} q0={self.number(-0.3, 0.3)}"
            )
            return
        body = rng.choice(self.bodies)
        others = [b for b in self.bodies if b != body]
        if not m.floats:
            others.append("0")
        if not others:
            return
        far = tuple(self.number(0.6, 1.0) for _ in self.point())
        m.cards.append(
            f"SPRING s{k} {body}{_text(self.point())} {rng.choice(others)}{_text(far)} "
            f"k={self.number(5, 60)} l0={self.number(0, 0.5)}"
        )

    def damper(self, closed: bool) -> None:
        joints = self.turning()
        if joints:
            self.m.cards.append(
                f"DAMPER d {self.rng.choice(joints)} c={self.number(0.01, 0.3)} c2={self.number(0, 0.1)}"
            )
            self.m.keeps_energy = False

    def force(self, closed: bool) -> None:
        m = self.m
        direction = self.triple(-1, 1) if m.space else (*self.triple(-1, 1)[:2],)
        m.cards.append(
            f"FORCE f {self.rng.choice(self.bodies)}{_text(self.point())} dir={_text(direction)} {{2*sin(11*time)}}"
        )
        m.keeps_energy = m.floats = False

    def torque(self, closed: bool) -> None:
        m = self.m
        axis = f" axis={_text(self.triple(-1, 1))}" if m.space else ""
        m.cards.append(f"TORQUE t {self.rng.choice(self.bodies)} tau={{0.3*cos(8*time)}}{axis}")
        m.keeps_energy = m.floats = False

    def gear(self, closed: bool) -> None:
        joints = [name for name in self.turning() if self.free(name)]
        if len(joints) >= 2:
            first, second = self.rng.sample(joints, 2)
            ratio = self.rng.choice((-2, -0.5, 0.7, 1.5))
            # the second moves as the first: positions and speeds at the start follow
            self.let_go([second] if not closed else [name for name, _, _ in self.joints])
            self.m.cards.append(f"GEAR g {first} {second} ratio={ratio}")
            self.driven |= {first, second}
            self.loops = [(around, left - len(around & {first, second})) for around, left in self.loops]

    def drive(self, closed: bool) -> None:
        joints = [name for name in self.turning() if self.free(name)]
        if joints:
            name = self.rng.choice(joints)
            self.driven.add(name)
            self.loops = [(around, left - (name in around)) for around, left in self.loops]
            motion = self.rng.choice(SHAKEN)
            begin = next(_start(line)[0] for line in self.m.cards if line.startswith(f"JOINT {name} "))
            self.let_go([name] if not closed else [name for name, _, _ in self.joints])
            for k, line in enumerate(self.m.cards):
                if line.startswith(f"JOINT {name} "):
                    self.m.cards[k] = line.partition(" guess=")[0]
            self.m.cards.append(f"DRIVE dr {name} q={{{begin}+{motion}}}")
            self.m.keeps_energy = self.m.floats = False

    def motor(self, closed: bool) -> None:
        joints = [name for name, kind, _ in self.joints if kind == "pin" and name not in self.driven]
        if joints:
            inertia = self.rng.choice(("", " j=1m gear=2"))
            self.m.cards += [
                f"MOTOR mo n 0 {self.rng.choice(joints)} kt=0.3 r=1.5 l=5m{inertia}",
                "Vmo n 0 SIN(0 4 2)",
            ]
            self.m.keeps_energy = False
            self.m.floats = self.m.floats and self.joints[0][1] == "planar" and not inertia


def _text(p: tuple[float, ...]) -> str:
    return "(" + ",".join(f"{v:g}" for v in p) + ")"


def _start(line: str) -> list[str]:
    return line.partition(" ic=(")[2].partition(")")[0].split(",")

"""Decks for the property that a drawing reads as its deck: small circuits made up of every letter, and those of netlists/ with
terminals moved, elements left out and put in twice. Seeded."""

from __future__ import annotations

from collections.abc import Iterator
from copy import copy
from pathlib import Path
from random import Random

from emsim import DeckError, pipeline
from emsim.elaborate.flat import FlatDeck

NETLISTS = Path(__file__).resolve().parents[3] / "netlists"
MODELS = """.model d d
.model z d bv=5
.model npn npn
.model pnp pnp
.model nm nmos vto=1
.model pm pmos vto=-1
.model nj njf
.model sw sw vt=1
.model cs csw it=1m
.model steel core
"""
# terminals of subcircuits as they are found in libraries
PINS = [
    "in out", "in out gnd", "in out vdd vss", "inp inn out", "inp inn vcc vee out", "in+ in- v+ v- out", "1 2 3 4 5",
    "a b y vdd vss",
    "d clk q qb vdd gnd", "vin sw gnd fb en", "gnd trig out reset ctrl thresh disch vcc", "p n", "c b e", "d g s", "a k g",
    "in adj out", "vp vn a b in", "vp vn a b c ga gb gc", "x1 x2 y1 y2 w z vpos vneg",
]  # fmt: skip


def mutants(count: int, seed: int) -> Iterator[tuple[str, FlatDeck]]:
    """(what it is, deck); those of netlists/ by turns with what is made up."""
    random = Random(seed)
    decks = sorted(p for p in NETLISTS.rglob("*.cir") if "mechanical" not in p.parts)
    for k in range(count):
        own = random.randrange(1 << 30)
        if k % 2:
            path = random.choice(decks)
            flat = _moved(pipeline.read(path), Random(own))
            yield f"{path.stem} {own}", flat
        else:
            text = made_up(Random(own))
            try:
                yield f"made up {own}", pipeline.read(text)
            except DeckError as error:
                raise AssertionError(text) from error


def _moved(flat: FlatDeck, random: Random) -> FlatDeck:
    """Terminals on other nets, elements left out and twice."""
    flat.elements = [copy(e) for e in flat.elements]
    top = [e for e in flat.elements if "." not in e.name and e.letter != "k"]
    coupled = {name for e in flat.elements for name in e.extra.get("inductors", ())}
    nets = sorted({net for e in top for net in e.nodes} | {"0"})
    for e in top:
        e.nodes = list(e.nodes)
        e.extra = {key: value for key, value in e.extra.items() if key != "ends"}
    for _ in range(random.randint(1, 4)):
        if not top:
            break
        e = random.choice(top)
        what = random.randrange(4)
        if what == 0 and e.name not in coupled and len(top) > 2:
            flat.elements.remove(e)
            top.remove(e)
        elif what == 1 and e.name not in coupled:
            twin = copy(e)
            twin.name, twin.nodes = f"{e.name}_{len(flat.elements)}", list(e.nodes)
            flat.elements.append(twin)
            top.append(twin)
        elif e.nodes:
            e.nodes[random.randrange(len(e.nodes))] = random.choice([*nets, "fresh"])
    return flat


def made_up(random: Random) -> str:
    """A deck of three to fourteen lines of any letter between a few nets."""
    n = random.randint(3, 14)
    nets = ["0", "in", "out", "vcc", *(f"n{k}" for k in range(random.randint(1, n)))]
    net = lambda: random.choice(nets)  # noqa: E731
    lines, subckts, coils, sources = (
        [f"V0 {net()} 0 {random.choice(['5', 'SIN(0 1 1k)', 'PWL(0 0 1 1)'])}"],
        [],
        [],
        ["v0"],
    )

    def formula() -> str:
        terms = [
            random.choice([f"v({net()})", f"v({net()},{net()})", f"i({random.choice(sources)})", "time", "2"])
            for _ in range(random.randint(1, 7))
        ]
        return random.choice("+*-").join(terms)

    for k in range(1, n + 1):
        letter = random.choice("rrrccllddqqmmmjvieghfbbsswtuxxxx")
        a = f"{letter}{k} {net()} {net()}"
        if letter in "rcl":
            lines.append(
                f"{a} {random.choice(['1k', f'{{1+abs({formula()})}}'])}" if letter != "l" else f"{a} 1m"
            )
            coils += [f"l{k}"] * (letter == "l")
        elif letter == "d":
            lines.append(f"{a} {random.choice('dz')}")
        elif letter in "qjm":
            extra = (
                random.choice(["", f" {net()}"])
                if letter == "q"
                else f" {random.choice(['0', 'vcc', net()])}"
                if letter == "m"
                else ""
            )
            lines.append(
                f"{a} {net()}{extra} {random.choice({'q': ['npn', 'pnp'], 'm': ['nm', 'pm'], 'j': ['nj']}[letter])}"
            )
        elif letter in "vi":
            lines.append(f"{a} {random.choice(['1', 'AC 1', 'PULSE(0 1 0 1n 1n 1u 2u)'])}")
            sources += [f"v{k}"] * (letter == "v")
        elif letter in "eg":
            forms = [
                f"{net()} {net()} 10",
                f"VALUE={{{formula()}}}",
                f"POLY(1) {net()} {net()} 0 1",
                f"TABLE {{{formula()}}}=(0,0) (1,1)",
            ]
            lines.append(f"{a} {random.choice(forms)}")
        elif letter in "hf":
            lines.append(f"{a} {random.choice(sources)} 3")
        elif letter == "b":
            lines.append(f"{a} {random.choice('vi')}={{{formula()}}}")
        elif letter == "s":
            lines.append(f"{a} {net()} {net()} sw")
        elif letter == "t":
            lines.append(f"{a} {net()} {net()} z0=50 td=1n")
        elif letter == "x":
            pins = random.choice(PINS).split()
            inner = "\n".join(f"R{j} {p} m {j + 1}" for j, p in enumerate(pins) if random.random() < 0.6)
            read = (
                f"B1 m 0 I={{{'+'.join(f'v({p})' for p in pins)}}}" if random.random() < 0.5 else "R99 m 0 1"
            )
            subckts.append(f".subckt s{k} {' '.join(pins)}\n{inner}\n{read}\n.ends")
            lines.append(f"x{k} {' '.join(net() for _ in pins)} s{k}")
    random.shuffle(coils)
    while len(coils) > 1:
        some, coils = coils[: random.randint(2, 4)], coils[random.randint(1, 4) :]
        if len(some) > 1:
            lines.append(f"K{len(lines)} {' '.join(some)} {random.choice(['0.9', '0.5'])}")
    return "\n".join(
        [
            "made up",
            *lines,
            *subckts,
            MODELS,
            f".print tran v({random.choice(nets[1:])})",
            ".tran 1u 1m",
            ".end",
        ]
    )

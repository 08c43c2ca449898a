"""emsim explain deck.cir: what is printed is what runs. Printed formulas are read back and evaluated at random states beside
the compiled system's Q and F."""

from __future__ import annotations

import math
import random
import re
from pathlib import Path
from typing import Any

import pytest

from emsim import pipeline
from emsim.reports import explained, notation
from emsim.reports.equations import Explained, explain
from emsim.system import System

ROOT = Path(__file__).resolve().parents[3]
FUNCTIONS = {
    **{f: getattr(math, f) for f in "sin cos tan exp log sqrt tanh atan atan2 floor ceil".split()},
    "min": min, "max": max, "abs": abs, "select": lambda c, a, b: a if c else b,
    "sign": lambda a: (a > 0) - (a < 0), "pow": lambda a, b: a**b, "sinh": math.sinh, "cosh": math.cosh,
    "asin": math.asin, "acos": math.acos, "asinh": math.asinh, "round": round,
}  # fmt: skip

SWITCHED = """pulse, switch, diode, B source, coupled coils
V1 in 0 PULSE(0 5 1m 1u 1u 4m 10m)
R1 in a 100
S1 a b ctl 0 sw
Vc ctl 0 SIN(0 2 50)
L1 b 0 1m
L2 c 0 4m
K1 L1 L2 0.9
D1 c out dd
C1 out 0 10u ic=1
R2 out 0 1k
B1 lim 0 V={min(max(v(out)*v(a), -3), 3) + abs(v(c)) + if(v(out) > v(a), 1, -1)*v(b)^3}
R3 lim 0 1k
G1 0 a b 0 1m
.model sw sw vt=1 vh=0.5 ron=1 roff=1meg
.model dd d is=1e-14 n=1.5 rs=0.1 cjo=1p
.tran 1m 20m
.end
"""
TEXTBOOK = """A bob on a rod without mass
.gravity 9.81
BODY bob m=2 j=0 com=(0.5,0)
JOINT p 0 bob pin zero=-90deg
.tran 1m 1
.end
"""


def read(source: Any) -> tuple[Explained, System]:
    flat = pipeline.read(source)
    assembly, planned = pipeline.prepare(flat, energy=True, recording=True)
    return explain(assembly, planned), System(assembly, planned)


class Reader:
    """Evaluates printed formulas at a state."""

    def __init__(self, x: Explained, state: list[float], t: float) -> None:
        self.x, self.state = x, state
        names = sorted(range(len(state)), key=lambda i: -len(x.names.unknown(i)))
        self.places = [(x.names.unknown(i), f" x[{i}] ") for i in names]
        waves = {
            f"{x.names.waves[k]}(t)": k for k, (kind, _, _) in enumerate(x.recorder.waves) if kind != "dc"
        }
        b = x.recorder
        values = x.system.values([b.wave_expr(k) for k in waves.values()], state, t) if waves else []
        self.places += [(name, f" ({value!r}) ") for name, value in zip(waves, values, strict=True)]
        self.scope: dict[str, Any] = {**FUNCTIONS, "x": state, "t": t}
        for name, up, down, _ in x.conditions:
            held = 0.0 if down is None else None
            above = self.poly(up) > 0
            if held is None:
                assert above or self.poly(down) < 0, "a state inside the hysteresis says nothing"
            self.scope[name] = above

    def read(self, formula: str) -> float:
        for name, place in self.places:
            formula = formula.replace(name, place)
        return float(eval(formula.replace("^", "**"), {"__builtins__": {}}, self.scope))

    def poly(self, poly: Any, quotient: bool = False) -> float:
        for name, atom in self.x.named:
            if name not in self.scope:
                self.scope[name] = self.read(notation.text(self.x.layout.written(atom), self.x.names, 17))
        return self.read(notation.text(self.x.layout.tree(poly, quotient), self.x.names, 17))


def check(source: Any, seed: int = 1, states: int = 3, spread: float = 0.4) -> Explained:
    """Every printed row, read back, is the row of the compiled system."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Explained, "MOST_WEIGHT", 10**9)
        x, system = read(source)
    x.layout.most = 10**9
    assert not x.left_out and sorted(row.index for row in x.rows) == list(range(system.n))
    rng = random.Random(seed)
    try:
        base = list(system.x0)
    except Exception:
        base = [0.0] * system.n
    for _ in range(states):
        state, t = [v + rng.uniform(-spread, spread) for v in base], rng.uniform(0.0, 2e-3)
        reader, q, f = Reader(x, state, t), system.Q(state, t), system.F(state, t)
        currents: dict[str, list[float]] = {}
        for row in x.rows:
            rates, rest, size, devices = 0.0, 0.0, 1e-9, {}
            for side, parts in ((1.0, row.left), (-1.0, row.right)):
                for part in parts:
                    text = [a.text for a in part.poly.atoms() if a.kind == "device"]
                    if text:
                        (c,) = part.poly.terms.values()
                        devices[text[0]] = c
                        continue
                    value = side * row.sign * reader.poly(part.poly, part.quotient)
                    size += abs(value)
                    if part.rate:
                        rates += value
                    else:
                        rest += value
            missing = {"i": f[row.index] - rest, "q": q[row.index] - rates}
            for kind in "iq":
                mine = [(name, c) for name, c in devices.items() if name[0] == kind]
                if not mine:
                    assert missing[kind] == pytest.approx(0.0, abs=1e-9 * size), (row.title, kind)
                elif len(mine) == 1:
                    currents.setdefault(mine[0][0], []).append(missing[kind] / mine[0][1])
        for name, found in currents.items():
            # what leaves one end of a junction enters the other
            scale = 1e-9 * max(1.0, *map(abs, found))
            assert max(found) - min(found) <= scale, (name, found)
    return x


DECKS = [
    "coupled/pendulum_servo.cir", "coupled/ref_comb_drive.cir", "coupled/slider_crank_hbridge.cir", "coupled/voice_coil.cir",
    "coupled/saturating_magnet.cir", "coupled/cart_pole.cir", "mechanical/ref_four_bar.cir", "mechanical/ref_double_pendulum.cir",
    "mechanical/bricard.cir", "mechanical/spring_pendulum.cir", "electrical/transformer.cir", "electrical/b_functions.cir",
    "electrical/poly_sources.cir", "electrical/subckt_nested.cir", "electrical/source_waves.cir", "electrical/diode_bridge.cir",
    "bench/two_link_arm.cir", "bench/slider_crank.cir",
]  # fmt: skip


@pytest.mark.parametrize("deck", DECKS)
def test_printed_rows_are_the_systems_rows(deck: str) -> None:
    check(str(ROOT / "netlists" / deck), spread=0.05)


def test_switches_diodes_coils_and_expressions() -> None:
    x = check(SWITCHED, spread=0.3)
    said = "\n".join(explained.page(x))
    assert "0.001*d/dt i(l1)" in said and "k1" in said, "flux linkage of the coil itself, and of the coupling"
    assert "min(max(" in said and "abs(v(c))" in said
    assert re.search(r"c\d+ +v\(ctl\) > 1.5, until v\(ctl\) < 0.5", said)
    assert "v1(t) = PULSE(v1=0 v2=5 td=0.001" in said


def test_a_pendulum_reads_as_in_a_textbook() -> None:
    """m l^2 theta'' = -m g l sin theta, with m = 2, l = 0.5: m l^2 = 0.5, m g l = 9.81."""
    x = check(TEXTBOOK)
    said = "\n".join(explained.page(x))
    assert "0.5*d/dt omega(p) = -9.81*sin(angle(p))" in said
    assert "d/dt angle(p) = omega(p)" in said
    assert "0.25*omega(p)^2" in said and "-9.81*cos(angle(p))" in said
    assert (x.freedom, x.index) == (1, 0)


def test_roots_and_magnitudes_of_squares_are_seen_through() -> None:
    """A spring along a line: its length is |x + 5|, whose square is (x + 5)^2."""
    x = check(
        "a slide\nBODY c m=1\nJOINT s 0 c slide axis=(0,1)\nSPRING b c(0,0) 0(0,5) k=100 l0=1\n.tran 1m 1\n.end\n"
    )
    (spring,) = (e for e in x.energies if e.kind == "V")
    written = notation.text(x.layout.tree(spring.poly), x.names)
    assert written == "50*pos(s)^2 - 500*pos(s) + 1300 - 100*abs(pos(s) - 5)"


def test_double_pendulum_has_its_mass_matrix_and_coriolis_terms() -> None:
    x = check(str(ROOT / "netlists/mechanical/ref_double_pendulum.cir"))
    said = "\n".join(explained.page(x))
    assert "(2*cos(angle(p2)) + 3)*omega(p1) + (cos(angle(p2)) + 1)*omega(p2)" in said
    assert "centrifugal, Coriolis" in said
    assert (x.freedom, x.index) == (2, 0)


@pytest.mark.parametrize(
    ("deck", "index"),
    [
        ("Rc\nV1 in 0 1\nR1 in a 1k\nC1 a 0 1u\n.tran 1u 1m\n.end\n", 1),
        ("capacitor across a source\nV1 in 0 SIN(0 1 1k)\nC1 in 0 1u\n.tran 1u 1m\n.end\n", 2),
        ("coil in series with a current source\nI1 0 a SIN(0 1 1k)\nL1 a 0 1m\n.tran 1u 1m\n.end\n", 2),
        ("no algebraic row\nI1 0 a 1m\nC1 a 0 1u\nR1 a 0 1k\n.tran 1u 1m\n.end\n", 0),
    ],
)
def test_index(deck: str, index: int) -> None:
    assert read(deck)[0].index == index


def test_closed_loop_is_of_index_two_and_says_what_folded() -> None:
    x, _ = read(str(ROOT / "netlists/mechanical/ref_four_bar.cir"))
    assert (x.freedom, x.index) == (1, 2)
    assert any("closure rows" in line for line in x.folded)
    rows = [row.title for row in x.rows if row.section == "closure"]
    assert len(rows) == 4


def test_terms_are_named_by_their_cards() -> None:
    x, _ = read(str(ROOT / "netlists/coupled/pendulum_servo.cir"))
    motion = next(row for row in x.rows if row.title.startswith("motion of hinge"))
    assert [part.note for part in motion.right] == ["weight of arm", "damping in hinge", "motor m1"]
    node = next(row for row in x.rows if row.title == "node wip")
    assert {part.owner for part in node.left} == {"rload", "p1"}


def test_a_big_deck_says_what_is_left_out() -> None:
    parts = "\n".join(f"R{k} n{k} n{k + 1} 1k\nC{k} n{k} 0 1u" for k in range(1, 300))
    x, _ = read(f"ladder\nV1 n1 0 1\n{parts}\n.tran 1u 1m\n.end\n")
    assert len(x.rows) == Explained.MOST_ROWS
    assert x.left_out == x.size - len(x.rows) > 0
    assert f"... and {x.left_out} more equations" in "\n".join(explained.page(x))


def test_latex_is_balanced() -> None:
    for deck in ("coupled/pendulum_servo.cir", "electrical/b_functions.cir", "mechanical/ref_four_bar.cir"):
        said = "\n".join(explained.latex(read(str(ROOT / "netlists" / deck))[0]))
        assert said.count("{") - said.count(r"\{") == said.count("}") - said.count(r"\}")
        assert said.count(r"\left") == said.count(r"\right")
        opened, closed = (sorted(re.findall(rf"\\{word}\{{(\w+\*?)\}}", said)) for word in ("begin", "end"))
        assert opened == closed
        assert said.startswith(r"\documentclass") and said.rstrip().endswith(r"\end{document}")
        assert "e-" not in re.sub(r"\\\w+|\\text\{[^}]*\}|\\mathrm\{[^}]*\}|[A-Za-z ]+-[a-z]+", "", said)


def test_numbers_in_latex_and_mathml() -> None:
    assert notation.latex_number(1e-6) == "10^{-6}"
    assert notation.latex_number(2.5e-7) == r"2.5\cdot 10^{-7}"
    assert notation.ml_number(0.6) == "<mn>0.6</mn>"
    assert "<msup><mn>10</mn><mn>\u22126</mn></msup>" in notation.ml_number(3e-6)


def test_sheet_is_well_formed() -> None:
    from xml.etree import ElementTree

    x, _ = read(SWITCHED)
    html = explained.sheet(x).replace("<p class=say>", '<p class="say">')
    ElementTree.fromstring(html)


@pytest.mark.parametrize(
    "deck", ["coupled/pendulum_servo.cir", "mechanical/ref_four_bar.cir", "coupled/ref_comb_drive.cir"]
)
def test_a_typesetter_reads_the_latex(deck: str) -> None:
    """Every line of every align, by Matplotlib's reader of TeX's mathematics."""
    from matplotlib.mathtext import MathTextParser

    reader = MathTextParser("path")
    said = "\n".join(explained.latex(read(str(ROOT / "netlists" / deck))[0]))
    lines = [
        line.removesuffix(r"\\[4pt]")
        .removesuffix(r"\\")
        .replace("&", " ")
        .replace(r"\quad", r"\;")
        .replace(r"\textstyle", "")
        for body in re.findall(r"\\begin\{align\*\}\n(.*?)\n\\end\{align\*\}", said, re.S)
        for line in (part.strip() for part in body.split("\n"))
    ]
    assert len(lines) > 10
    for line in lines:
        reader.parse(f"${line}$")


def test_nothing_is_divided_by_one() -> None:
    x, _ = read("one ohm\nV1 a 0 1\nR1 a b 1\nR2 b 0 2\n.op\n")
    said = "\n".join(explained.page(x))
    assert re.search(r"r1 +\(v\(a\) - v\(b\)\)\^2  ", said) and "/1 " not in said


def test_names_with_signs_of_tex_stay_names() -> None:
    """Accents are no characters within a formula; and a node of the deck may have a `#` in its name."""
    x, _ = read(
        "names\nVa^b p^q~ 0 SIN(0 1 1k)\nR1 p^q~ n#1 1k\nR2 n#1 0 1k\nD1 n#1 0 d\n.model d d rs=1\n.tran 1u 1m\n"
    )
    said = "\n".join(explained.latex(x))
    assert r"$v_{\mathrm{p\wedge q\sim }}$ & V & voltage of node p\^{}q\~{} \\" in said
    assert r"$v_{\mathrm{n\#1}}$ & V & voltage of node n\#1 \\" in said
    assert r"$v_{\mathrm{d1\#internal}}$ & V & voltage inside of d1 \\" in said
    formulas = "\n".join(
        re.findall(r"\\begin\{align\*\}\n(.*?)\n\\end\{align\*\}", re.sub(r"\\text\{[^}]*\}", "", said), re.S)
    )
    assert r"\mathrm{va\wedge b}(t)" in formulas and r"\^" not in formulas and r"\~" not in formulas


def test_a_long_formula_ends_with_how_much_more_there_is() -> None:
    """Of a machine in space: every row is shown, long ones in part, and the argument of a sine whole."""
    x, system = read(str(ROOT / "netlists/mechanical/bricard.cir"))
    assert len(x.rows) == system.n and not x.left_out
    said = "\n".join(explained.page(x))
    assert re.search(r"\.\.\. \d+ more", said)
    assert not re.search(r"(sin|cos)\((\w+\(\w+\)|[^().])*\.\.\.", said)
    assert len(said) < 250_000

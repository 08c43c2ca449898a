"""Patterns of circuits as textbooks draw them: 30 decks, each read back from its drawing (W351 where it is another)."""

from __future__ import annotations

from typing import Any

import pytest

import emsim
from emsim import pipeline
from emsim.cli import main
from emsim.schematic.circuit import Circuit
from emsim.schematic.picture import draw
from emsim.schematic.symbols import UNIT

MODELS = ".model d d\n.model n npn\n.model p pnp\n.model sw sw(vt=2.5)\n.model mn nmos(vto=1)\n.model mp pmos(vto=-1)\n"
LEG = "S{a} vb {m} g{a} 0 sw\nS{b} {m} 0 g{b} 0 sw\nD{a} {m} vb d\nD{b} 0 {m} d\n"
GATES = "".join(f"Vg{k} g{k} 0 PULSE(0 5 {k}u 1u 1u 50u 100u)\n" for k in range(1, 7))
SUPPLY = "Vb vb 0 24\n"
LEGS = [LEG.format(a=2 * k - 1, b=2 * k, m="abc"[k - 1]) for k in (1, 2, 3)]
BITS = "".join(f"V{k} d{k} 0 {5 * (k % 2)}\nR{10 + k} d{k} n{k} 20k\n" for k in range(4))
R2R = BITS + "R0 n0 0 20k\n" + "".join(f"R{20 + k} n{k} n{k + 1} 10k\n" for k in range(3))
GATED = (
    "M{a}h vb h{a} {a} {a} mn\nM{a}l {a} l{a} 0 0 mn\n"
    "Vh{a} h{a} {a} PULSE(0 9 0 1u 1u 50u 100u)\nVl{a} l{a} 0 PULSE(9 0 0 1u 1u 50u 100u)\n"
)
RAILS = "Vp vp 0 15\nVn vn 0 -15\n"
PAIR = "Q1 vp x out n\nQ2 vn y out p\nRL out 0 8\n"
VENDOR = ".subckt {name} 1 2 3 4 5\nE1 6 0 1 2 1e5\nR1 6 5 50\nR2 3 4 10k\n.ends\n"
DECKS = {
    "divider": "V1 a 0 1\nR1 a b 1k\nR2 b 0 1k\n",
    "low pass": "V1 a 0 SIN(0 1 1k)\nR1 a b 1k\nC1 b 0 1u\n",
    "wheatstone": "V1 s 0 5\nR1 s a 1k\nR2 a 0 1k\nR3 s b 1k\nR4 b 0 1k\nR5 a b 10k\n",
    "bridge rectifier": "V1 a b SIN(0 17 50)\nD1 a p d\nD2 b p d\nD3 0 a d\nD4 0 b d\nC1 p 0 1m\nR1 p 0 100\n",
    "half bridge": SUPPLY + GATES[: GATES.index("Vg3")] + LEGS[0] + "L1 a o 1m\nR1 o 0 2\n",
    "h bridge": SUPPLY + GATES[: GATES.index("Vg5")] + LEGS[0] + LEGS[1] + "L1 a o 1m\nR1 o b 2\n",
    "three legs": SUPPLY + GATES + "".join(LEGS) + "R1 a s 10\nR2 b s 10\nR3 c s 10\n",
    "three legs of mosfets": SUPPLY + "".join(GATED.format(a=a) for a in "abc") + "R1 a s 1\nR2 b s 1\nR3 c s 1\n",
    "r-2r ladder": R2R,
    "r-2r with a buffer": RAILS + R2R + "X1 n3 out vp vn out UA741\nRL out 0 1k\n" + VENDOR.format(name="ua741"),
    "class ab": RAILS + "Vin in 0 SIN(0 5 1k)\nR1 vp x 1k\nD1 x in d\nD2 in y d\nR2 y vn 1k\n" + PAIR,
    "class ab with emitter resistors": (
        RAILS + "Vin in 0 SIN(0 5 1k)\nI1 vp x 5m\nD1 x in d\nD2 in y d\nI2 y vn 5m\n"
        "Q1 vp x e n\nQ2 vn y f p\nR1 e out 1\nR2 out f 1\nRL out 0 8\n"
    ),
    "vbe multiplier": (
        RAILS + "Vin in 0 SIN(0 5 1k)\nI1 vp x 5m\nQ3 x m y n\nR1 x m 1k\nR2 m y 1k\nQ4 y in vn n\n" + PAIR
    ),
    "push-pull": RAILS + "Vin in 0 SIN(0 5 1k)\nQ1 vp in out n\nQ2 vn in out p\nRL out 0 8\n",
    "rc ladder": "V1 a 0 1\n" + "".join(f"R{k} {'abcde'[k]} {'abcde'[k + 1]} 1k\nC{k} {'abcde'[k + 1]} 0 1n\n" for k in range(4)),
    "two windings": "V1 p 0 SIN(0 100 50)\nL1 p 0 100m\nL2 a 0 10m\nR1 a 0 10\nK1 L1 L2 0.99\n",
    "three windings": "V1 p 0 SIN(0 100 50)\nL1 p 0 100m\nL2 a 0 10m\nL3 b 0 10m\nR1 a 0 10\nR2 b 0 10\nK1 L1 L2 L3 0.99\n",
    "four windings": (
        "V1 p 0 SIN(0 9 50)\nL1 p 0 1\nL2 a 0 1\nL3 b 0 1\nL4 c 0 1\nR1 a 0 1\nR2 b 0 1\nR3 c 0 1\n"
        "K1 L1 L2 L3 L4 0.9\n"
    ),
    "e inverts": "V1 in 0 SIN(0 1 1k)\nR1 in x 1k\nR2 x out 10k\nE1 out 0 0 x 1e5\nRL out 0 1k\n",
    "e follows": "V1 in 0 SIN(0 1 1k)\nE1 out 0 in out 1e5\nRL out 0 1k\n",
    "e with a negative gain": "V1 in 0 SIN(0 1 1k)\nR1 in x 1k\nR2 x out 10k\nE1 out 0 x 0 -1e5\nRL out 0 1k\n",
    "b inverts": "V1 in 0 SIN(0 1 1k)\nR1 in x 1k\nR2 x out 10k\nB1 out 0 V=-1e5*V(x)\nRL out 0 1k\n",
    "b compares": "V1 in 0 SIN(0 1 1k)\nV2 ref 0 SIN(0 1 50)\nR1 in x 1k\nB1 out 0 V={1e4*(v(x)-v(ref))}\nRL out 0 1k\n",
    "vendor's op amp": (
        RAILS + "V1 in 0 SIN(0 1 1k)\nR1 in x 1k\nR2 x out 2k\nX1 0 x vp vn out UA741\nRL out 0 1k\n"
        "" + VENDOR.format(name="ua741")
    ),
    "differential pair": RAILS + "V1 a 0 SIN(0 1m 1k)\nQ1 c a e n\nQ2 d 0 e n\nR1 vp c 1k\nR2 vp d 1k\nI1 e vn 2m\n",
    "mirror": "Vcc vcc 0 12\nR1 vcc a 10k\nQ1 a a 0 n\nQ2 b a 0 n\nR2 vcc b 1k\n",
    "cmos inverter": "Vdd vdd 0 5\nV1 in 0 PULSE(0 5 0 1n 1n 1u 2u)\nM1 out in vdd vdd mp\nM2 out in 0 0 mn\nC1 out 0 1p\n",
    "buck": "V1 s 0 12\nVg g 0 PULSE(0 5 0 1n 1n 5u 10u)\nS1 s a g 0 sw\nD1 0 a d\nL1 a o 100u\nC1 o 0 100u\nR1 o 0 2\n",
    "sallen-key": "V1 in 0 SIN(0 1 1k)\nR1 in a 1k\nR2 a b 1k\nC1 a out 10n\nC2 b 0 10n\nE1 out 0 b out 1e5\nRL out 0 1k\n",
    "a formula": "V1 in 0 SIN(0 1 1k)\nB1 q 0 V = 2*(3 + V(in)**2)\nR1 q 0 1k\n",
}  # fmt: skip


def drawn(name: str) -> dict[str, Any]:
    """By name the parts of the drawing of a deck, which is that deck."""
    flat = pipeline.read(f"{name}\n{DECKS[name]}{MODELS}.tran 1u 1m\n.end\n")
    picture = draw(flat, "ansi", "", flat.sink)
    assert picture is not None
    assert not [d for d in flat.sink.diagnostics if d.code in ("W351", "W352")]
    return {part["name"]: part for part in picture.data["parts"]}


def middle(part: dict[str, Any]) -> tuple[float, float]:
    x0, y0, x1, y1 = part["box"]
    return (x0 + x1) / 2, (y0 + y1) / 2


def words(part: dict[str, Any]) -> str:
    return " ".join(text[3] for text in part["texts"])


@pytest.mark.parametrize("name", DECKS)
def test_it_is_drawn_and_reads_as_its_deck(name: str) -> None:
    assert len(drawn(name)) >= 3
    assert len(DECKS) == 30


@pytest.mark.parametrize(("name", "legs"), [("half bridge", 1), ("h bridge", 2), ("three legs", 3)])
def test_the_switches_of_a_leg_stand_on_one_another_with_their_diodes_beside(name: str, legs: int) -> None:
    parts = drawn(name)
    for k in range(1, legs + 1):
        upper, lower = (middle(parts[f"s{n}"]) for n in (2 * k - 1, 2 * k))
        assert upper[0] == lower[0] and upper[1] < lower[1]
        assert middle(parts[f"d{2 * k - 1}"])[0] == middle(parts[f"d{2 * k}"])[0] != upper[0]
    heights = {middle(parts[f"s{n}"])[1] for n in range(1, 2 * legs, 2)}
    assert len(heights) == 1, "legs stand on one level"
    if legs == 2:
        between = sorted(middle(parts[f"s{n}"])[0] for n in (1, 3))
        assert between[0] < middle(parts["l1"])[0] < between[1], "the load is the bar of the H"


@pytest.mark.parametrize(
    ("name", "uppers"),
    [("three legs", ["s1", "s3", "s5"]), ("three legs of mosfets", ["mah", "mbh", "mch"])],
)
@pytest.mark.parametrize("turned", [False, True], ids=["forwards", "backwards"])
def test_legs_stand_in_the_order_of_the_deck(
    name: str, uppers: list[str], turned: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if turned:
        lines = DECKS[name].splitlines(keepends=True)
        monkeypatch.setitem(DECKS, name, "".join(reversed(lines)))
        uppers = uppers[::-1]
    parts = drawn(name)
    places = [middle(parts[upper]) for upper in uppers]
    assert [x for x, _ in places] == sorted(x for x, _ in places)
    assert len({y for _, y in places}) == 1
    # what lies beside a leg is left of the next leg
    for k, (left, _) in enumerate(places[:-1]) if name == "three legs" else ():
        number = int(uppers[k][1:])
        assert middle(parts[f"d{number}"])[0] < places[k + 1][0] and left < places[k + 1][0]


@pytest.mark.parametrize("name", ["r-2r ladder", "r-2r with a buffer"])
def test_an_r_2r_ladder_is_a_ladder(name: str) -> None:
    parts = drawn(name)
    rungs, legs, bits = (
        [middle(parts[f"{letter}{first + k}"]) for k in range(n)]
        for letter, first, n in (("r", 20, 3), ("r", 10, 4), ("v", 0, 4))
    )
    end = middle(parts["r0"])
    assert len({y for _, y in rungs}) == len({y for _, y in (*legs, end)}) == 1
    assert rungs[0][1] < legs[0][1] < min(y for _, y in bits)
    across = [end[0], legs[0][0]]
    for rung, leg in zip(rungs, legs[1:], strict=True):
        across += [rung[0], leg[0]]
    assert across == sorted(across), "from the end that is closed to the output"
    assert [x for x, _ in bits] == [x for x, _ in legs]


def test_resistors_of_other_values_are_no_ladder(monkeypatch: pytest.MonkeyPatch) -> None:
    for leg, there in (("20k", 1), ("19k", 1), ("10k", 0), ("100k", 0)):
        text = f"t\n{R2R.replace('20k', leg)}.op\n.end\n"
        flat = pipeline.read(text)
        assert len(Circuit(flat).ladders) == there, leg


@pytest.mark.parametrize(
    ("name", "bias", "output"),
    [
        ("class ab", "r1 d1 d2 r2", "q1 q2"),
        ("class ab with emitter resistors", "i1 d1 d2 i2", "q1 r1 r2 q2"),
        ("vbe multiplier", "i1 q3 q4", "q1 q2"),
    ],
)
def test_a_class_ab_stage_is_two_columns_between_its_rails(name: str, bias: str, output: str) -> None:
    parts = drawn(name)
    columns = [[middle(parts[part]) for part in column.split()] for column in (bias, output)]
    for column in columns:
        heights = [y for _, y in column]
        assert heights == sorted(heights) and len(set(heights)) == len(heights)
        xs = [x for x, _ in column]
        assert max(xs) - min(xs) <= 2 * UNIT, "one under the other, but for where a symbol has its pins"
    assert max(x for x, _ in columns[0]) < min(x for x, _ in columns[1]) < middle(parts["rl"])[0]
    nets = [{net for *_, net in parts[q]["pins"]} for q in ("q1", "q2")]
    assert name.endswith("resistors") or "out" in nets[0] & nets[1]


def test_a_bridge_has_its_diodes_at_four_corners() -> None:
    parts = drawn("bridge rectifier")
    places = [middle(parts[f"d{k}"]) for k in (1, 2, 3, 4)]
    assert places[0][0] == places[2][0] and places[1][0] == places[3][0] and places[0][1] == places[1][1]
    assert (
        places[0][0] < middle(parts["v1"])[0] < places[1][0] and places[2][1] == places[3][1] > places[0][1]
    )


def test_a_push_pull_stage_stands_between_its_rails() -> None:
    parts = drawn("push-pull")
    (x1, y1), (x2, y2) = middle(parts["q1"]), middle(parts["q2"])
    assert x1 == x2 and y1 < y2


@pytest.mark.parametrize(
    ("name", "coils"), [("two windings", 2), ("three windings", 3), ("four windings", 4)]
)
def test_coils_on_a_core_are_one_part(name: str, coils: int) -> None:
    (core,) = [part for part in drawn(name).values() if part["kind"] == "transformer"]
    assert len(core["pins"]) == 2 * coils


@pytest.mark.parametrize(
    ("name", "amplifier", "nets"),
    [
        ("e inverts", "e1", ["0", "x", "out"]),
        ("e follows", "e1", ["in", "out", "out"]),
        ("e with a negative gain", "e1", ["0", "x", "out"]),
        ("b inverts", "b1", ["0", "x", "out"]),
        ("b compares", "b1", ["x", "ref", "out"]),
        ("sallen-key", "e1", ["b", "out", "out"]),
        ("vendor's op amp", "x1", ["0", "x", "out", "vp", "vn"]),
    ],
)
def test_what_amplifies_is_a_triangle_whose_inputs_are_wired(
    name: str, amplifier: str, nets: list[str]
) -> None:
    part = drawn(name)[amplifier]
    assert part["kind"] == "amplifier" and [net for *_, net in part["pins"]] == nets
    assert amplifier == "x1" or ("gain 10" in words(part) and "v(" not in words(part))


@pytest.mark.parametrize(
    "line",
    [
        "E1 out 0 0 x 100",
        "E1 out y 0 x 1e5",
        "B1 out 0 V={1e5*v(x)+1}",
        "B1 out 0 V={1e5*v(x)**2}",
        "B1 out 0 V={1e5*v(x)-v(in)}",
    ],
)
def test_what_does_not_is_a_source(line: str) -> None:
    text = f"t\nV1 in 0 1\nR1 in x 1k\nR2 x out 1k\nR3 y 0 1k\nR4 out 0 1k\n{line}\n.op\n.end\n"
    picture = draw(pipeline.read(text), "ansi")
    assert picture is not None and {p["kind"] for p in picture.data["parts"]} & {"dependent"}


def test_numbers_that_are_no_vendors_are_terminals_of_a_box() -> None:
    deck = "t\nV1 a 0 1\nX1 a 0 b c d filter\nR1 b 0 1\nR2 c 0 1\nR3 d 0 1\n" + VENDOR.format(name="filter")
    picture = draw(pipeline.read(f"{deck}.op\n.end\n"), "ansi")
    assert picture is not None and {p["kind"] for p in picture.data["parts"] if p["name"] == "x1"} == {"use"}


def test_a_formula_stands_in_the_decks_own_letters() -> None:
    assert "2*(3+V(in)**2)" in words(drawn("a formula")["b1"]).replace(" ", "")


def test_the_current_of_an_amplifier_is_that_of_its_output() -> None:
    """A triangle's dots: what flows at the output, nothing at the inputs."""
    text = f"t\n{DECKS['e inverts']}.tran 10u 1m\n.end\n"
    table = emsim.run(text, scene=True).main
    assert table.circuit is not None
    (part,) = [p for p in table.circuit.data["pictures"][""]["parts"] if p["kind"] == "amplifier"]
    own = table.circuit.data["currents"]["e1"]
    (_, first), (_, second), (name, out) = part["sources"]
    assert name == "e1" and own[out] and first >= len(own) and second >= len(own)


def test_a_deck_of_another_dialect_is_drawn(tmp_path: Any, capsys: Any) -> None:
    deck = tmp_path / "lt.cir"
    deck.write_text("* LTspice\nV1 in 0 SINE(0 1 1k)\nR1 in out 1K\nC1 out 0 100n\n.tran 5m\n.end\n")
    assert main(["draw", str(deck)]) != 0 and "--dialect ltspice" in capsys.readouterr().err
    assert main(["draw", "--dialect", "ltspice", str(deck)]) == 0
    assert capsys.readouterr().out.startswith("<svg")
    assert main(["draw", "--dialect", "x", str(deck)]) == 2

"""Drawings of circuits: what must hold of every deck in netlists/, by geometry alone, and what textbooks do."""

from __future__ import annotations

import re
from functools import cache
from itertools import combinations, pairwise
from pathlib import Path

import pytest

from emsim import DeckError, pipeline
from emsim.schematic.back import differences
from emsim.schematic.picture import Picture, draw, writing

ROOT = Path(__file__).resolve().parents[3]
DECKS = sorted((ROOT / "netlists").rglob("*.cir"))
ELECTRICAL = [p for p in DECKS if "mechanical" not in p.parts]
CROSSINGS = 8  # of a drawing; the 741 has 22 transistors
# of what is inside subcircuits, once each
INSIDES = [
    ("electrical/opamp_741", "x1"),
    ("electrical/opamp_jfet", "x1"),
    ("electrical/sallen_key", "x1"),
    ("electrical/cmos_ring", "x1"),
]


@cache
def drawn(path: Path, inside: str = "") -> Picture | None:
    flat = pipeline.read(path)
    return draw(flat, "ansi", inside, flat.sink)


def pictures() -> list[tuple[Path, str]]:
    return [(p, "") for p in ELECTRICAL] + [
        (ROOT / "netlists" / f"{name}.cir", inside) for name, inside in INSIDES
    ]


def names(case: tuple[Path, str]) -> str:
    return case[0].stem + (":" + case[1] if case[1] else "")


@pytest.fixture(params=pictures(), ids=names)
def picture(request):
    found = drawn(*request.param)
    if found is None:
        # nothing electrical on it
        assert not pipeline.read(request.param[0]).elements
        return drawn(ROOT / "netlists" / "lessons" / "01_rc.cir")
    return found


def of(text: str, look: str = "ansi", inside: str = "") -> Picture:
    flat = pipeline.read(text)
    found = draw(flat, look, inside, flat.sink)
    assert found is not None
    return found


def part(picture: Picture, name: str) -> dict:
    return next(p for p in picture.data["parts"] if p["name"] == name)


def segments(picture: Picture):
    for wire in picture.data["wires"]:
        for a, b in pairwise(wire["points"]):
            yield wire["net"], a, b


def meet(a, b, gap=0.0):
    return a[0] < b[2] - gap and b[0] < a[2] - gap and a[1] < b[3] - gap and b[1] < a[3] - gap


def frame(text):
    x, y, anchor, words, *_ = text
    return [10 * v for v in writing(x / 10, y / 10, anchor, words)]


def test_no_symbol_lies_on_another(picture):
    for p, q in combinations(picture.data["parts"], 2):
        assert not meet(p["box"], q["box"]), (p["name"], q["name"])


def test_no_wire_runs_through_a_symbol(picture):
    for net, a, b in segments(picture):
        line = (min(a[0], b[0]) - 1, min(a[1], b[1]) - 1, max(a[0], b[0]) + 1, max(a[1], b[1]) + 1)
        for p in picture.data["parts"]:
            assert not meet(line, p["box"], 1.5), (net, p["name"])


def test_no_wire_touches_a_pin_of_another_net(picture):
    for net, a, b in segments(picture):
        for p in picture.data["parts"]:
            for x, y, own in p["pins"]:
                on = min(a[0], b[0]) <= x <= max(a[0], b[0]) and min(a[1], b[1]) <= y <= max(a[1], b[1])
                assert own == net or not on, (net, p["name"], own)


def test_no_writing_lies_on_a_symbol_a_wire_or_other_writing(picture):
    own = [(p["name"], t) for p in picture.data["parts"] for t in p["texts"]] + [
        ("", t) for t in picture.data["names"]
    ]
    for (p, a), (q, b) in combinations(own, 2):
        assert not meet(frame(a), frame(b), 1.5), (p, a[3], q, b[3])
    for name, text in own:
        for p in picture.data["parts"]:
            if p["name"] != name:
                assert not meet(frame(text), p["box"], 1.5), (text[3], p["name"])
        for net, a, b in segments(picture):
            line = (min(a[0], b[0]), min(a[1], b[1]) - 0.5, max(a[0], b[0]) + 0.5, max(a[1], b[1]) + 0.5)
            assert not meet(frame(text), line, 1.0), (text[3], net)


def test_every_pin_is_wired_to_its_net_and_to_no_other(picture):
    """By the lines alone: pieces of wire that share an end or a dot are one, and every net is one piece."""
    circuit, layout = picture.circuit, picture.layout
    assert layout.failed == []
    of_point: dict[tuple[float, float], str] = {}
    for wire in picture.data["wires"]:
        for point in (wire["points"][0], wire["points"][-1]):
            assert of_point.setdefault(tuple(point), wire["net"]) == wire["net"]
    for net, pins in circuit.pins.items():
        if not layout.wired(net):
            # a symbol or a name at every pin says which net it is
            continue
        places = [tuple(picture.data["parts"][k]["pins"][j][:2]) for k, j in pins]
        runs = [[tuple(p) for p in w["points"]] for w in picture.data["wires"] if w["net"] == net]
        reached, grew = {places[0]}, True
        while grew:
            grew = False
            for run in runs:
                if (run[0] in reached) != (run[-1] in reached):
                    reached |= {run[0], run[-1]}
                    grew = True
        assert set(places) <= reached, net


def test_it_reads_as_its_deck(picture):
    """From lines, dots and words alone; what does not is shown as a list (test_drawn_back.py tries the reader)."""
    assert differences(picture.data, picture.circuit) == []


def test_wires_are_upright_or_level_and_cross_rarely(picture):
    lines = list(segments(picture))
    assert all(a[0] == b[0] or a[1] == b[1] for _, a, b in lines)
    count = 0
    for (n, a, b), (m, c, d) in combinations(lines, 2):
        if n == m:
            continue
        ab = (min(a[0], b[0]), min(a[1], b[1]), max(a[0], b[0]), max(a[1], b[1]))
        cd = (min(c[0], d[0]), min(c[1], d[1]), max(c[0], d[0]), max(c[1], d[1]))
        if ab[0] <= cd[2] and cd[0] <= ab[2] and ab[1] <= cd[3] and cd[1] <= ab[3]:
            # never along one another
            assert (a[0] == b[0]) != (c[0] == d[0]), (n, m)
            count += 1
    assert count <= max(CROSSINGS, len(picture.circuit.parts)), count


def test_ground_is_below_and_positive_rails_above(picture):
    for laid, p in zip(picture.layout.laid, picture.circuit.parts, strict=True):
        for what, _, _, _, dy, _ in laid.decor:
            assert what != "ground" or dy >= 0, p


def test_all_current_that_flows_along_a_wire_flows_into_pins(picture):
    """What leaves through the pins on one side comes in through those on the other: the two together are the whole net."""
    for net in picture.edges:
        pins = {picture._pin(k, j): (k, j) for k, j in picture.circuit.pins[net]}
        for wire in (w for w in picture.data["wires"] if w["net"] == net):
            assert 0 < len(wire["flow"]) < len(pins), (net, wire)


@pytest.mark.parametrize(
    "name", ["electrical/bjt_amplifier", "coupled/pendulum_servo", "electrical/sallen_key"]
)
def test_a_drawing_comes_out_the_same_every_time(name):
    path = ROOT / "netlists" / f"{name}.cir"
    flat = pipeline.read(path)
    again = draw(flat, "ansi")
    assert again is not None and again.data == drawn(path).data


# ---- what textbooks do ----


def middle(p):
    return (p["box"][0] + p["box"][2]) / 2, (p["box"][1] + p["box"][3]) / 2


def lies(picture: Picture, name: str) -> bool:
    a, b = part(picture, name)["pins"][:2]
    return a[1] == b[1]


def test_a_low_pass_has_its_source_left_its_resistor_above_and_its_capacitor_right():
    p = drawn(ROOT / "netlists" / "lessons" / "01_rc.cir")
    v, r, c = (middle(part(p, name)) for name in ("v1", "r1", "c1"))
    assert v[0] < r[0] < c[0] and r[1] < v[1] and r[1] < c[1]
    assert lies(p, "r1") and not lies(p, "v1") and not lies(p, "c1")
    assert p.data["dots"] == []


def test_stages_that_repeat_stand_in_a_row():
    p = drawn(ROOT / "netlists" / "electrical" / "rc_ladder.cir")
    rows = {middle(part(p, f"c{k}"))[1] for k in range(1, 11)}
    tops = {middle(part(p, f"r{k}"))[1] for k in range(1, 11)}
    xs = [middle(part(p, f"r{k}"))[0] for k in range(1, 11)]
    assert len(tops) == 1 and len(rows) <= 3 and xs == sorted(xs)


def test_transistors_stand_on_one_another_between_rails():
    p = drawn(ROOT / "netlists" / "electrical" / "cmos_nand.cir")
    (_, y1), (x3, y3), (x4, y4) = (middle(part(p, m)) for m in ("m1", "m3", "m4"))
    assert y1 < y3 < y4 and x3 == x4
    assert middle(part(p, "m2"))[1] == y1


def test_an_amplifier_is_a_triangle_and_its_feedback_goes_over_it():
    p = drawn(ROOT / "netlists" / "electrical" / "opamp_741.cir")
    amp = part(p, "x1")
    assert amp["kind"] == "amplifier"
    top = min(y for w in p.data["wires"] if w["net"] == "out" for _, y in w["points"])
    assert top < amp["box"][1]


def test_parts_of_two_worlds_have_symbols_of_their_own():
    kinds = {
        p["kind"]
        for name in ("coupled/pendulum_servo", "coupled/relay")
        for p in drawn(ROOT / f"netlists/{name}.cir").data["parts"]
    }
    assert {"motor", "pot", "transducer"} <= kinds


def test_two_coupled_inductors_are_a_transformer():
    p = drawn(ROOT / "netlists" / "electrical" / "transformer.cir")
    assert len([q for q in p.data["parts"] if q["kind"] == "transformer"]) == 1
    assert not any(q["kind"] == "inductor" for q in p.data["parts"])


HINTED = """a divider
V1 in 0 10
R1 in out 1k
R2 out 0 1k
{hint}
.op
.end
"""


@pytest.mark.parametrize(
    ("hint", "axis", "sign"),
    [("R2 right of R1", 0, 1), ("R2 left of R1", 0, -1), ("R2 below R1", 1, 1), ("R2 above R1", 1, -1)],
)
def test_a_hint_says_where_a_part_goes(hint, axis, sign):
    p = of(HINTED.format(hint="*@ place " + hint))
    assert sign * (middle(part(p, "r2"))[axis] - middle(part(p, "r1"))[axis]) > 0


@pytest.mark.parametrize("hint", ["*@ place R3 right of R1", "*@ place R2 beside R1", "*@ put R2"])
def test_a_hint_that_is_not_understood_is_told(hint):
    flat = pipeline.read(HINTED.format(hint=hint))
    draw(flat, "ansi", "", flat.sink)
    assert [d.code for d in flat.sink.diagnostics] == ["W350"]
    assert flat.sink.diagnostics[0].span.in_deck.line == 5


def test_a_circuit_too_large_to_read_is_refused():
    lines = "\n".join(f"R{k} n{k} n{k + 1} 1k" for k in range(70))
    with pytest.raises(DeckError) as told:
        of(f"chain\nV1 n0 0 1\n{lines}\nR99 n70 0 1k\n.op\n.end\n")
    assert told.value.diagnostics[0].code == "E372"


def test_the_inside_of_a_subcircuit_has_its_terminals_named():
    p = drawn(ROOT / "netlists" / "electrical" / "opamp_741.cir", "x1")
    said = {t[3] for q in p.data["parts"] for t in q["texts"]} | {t[3] for t in p.data["names"]}
    assert {"inp", "inn", "vcc", "vee", "out"} <= said


def test_both_looks_differ_in_resistors_and_sources():
    text = HINTED.format(hint="*")
    ansi, iec = of(text, "ansi"), of(text, "iec")
    for name in ("r1", "v1"):
        assert part(ansi, name)["strokes"] != part(iec, name)["strokes"]
    assert part(ansi, "r1")["pins"] == part(iec, "r1")["pins"]


def test_svg_holds_every_part_and_value():
    from emsim.schematic.svg import svg

    p = drawn(ROOT / "netlists" / "lessons" / "01_rc.cir")
    text = svg(p.data)
    assert re.findall(r'data-part="(\w+)"', text) == ["v1", "r1", "c1"]
    assert "1 kΩ" in text and "1 µF" in text
    assert svg(p.data, dark=True) != text

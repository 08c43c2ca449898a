"""A drawing is read back from its lines, dots and words, and shows the deck's circuit or is not shown.

Issue: pins that only expressions read vanished from boxes, coils on one core were islands, nets that labels read bore no name.
"""

from __future__ import annotations

from copy import deepcopy
from itertools import pairwise, product

import pytest
from mutants import PINS, mutants
from test_circuit_drawing import ROOT, drawn, of, part

from emsim import pipeline
from emsim.schematic import picture as pictures
from emsim.schematic.back import differences

SEEDED, SMALL = 40, 7  # decks and parts of the property; tests/bench/drawn_back.py draws a thousand


def wrong(picture):
    return differences(picture.data, picture.circuit)


def said(picture) -> str:
    return " ".join(t[3] for p in picture.data["parts"] for t in p["texts"])


def test_mutated_decks_read_as_they_are_drawn():
    from emsim.schematic.circuit import Circuit

    judged = 0
    for name, flat in mutants(SEEDED, 2026):
        circuit = Circuit(flat)
        if 0 < len(circuit.parts) <= SMALL:
            assert wrong(pictures.Picture(circuit)) == [], name
            judged += 1
    assert judged > SEEDED // 4


# ---- what was drawn as another circuit ----

COMPARATOR = """a comparator whose inputs only a B source reads
.subckt comp inp inn out
B1 out 0 V={v(inp)>v(inn) ? 5 : 0}
.ends
V1 ref 0 2.5
R1 out cap 10k
C1 cap 0 100n
XU ref cap out comp
.tran 10u 5m
.end
"""


def test_terminals_that_only_expressions_read_are_pins():
    p = of(COMPARATOR)
    assert part(p, "xu")["kind"] == "amplifier" and len(part(p, "xu")["pins"]) == 3
    timer = ".subckt timer com trig out\nB1 out com V={v(trig)<1 ? 5 : 0}\n.ends"
    p = of(f"a timer\n{timer}\nV1 t 0 1\nX1 0 t q timer\nR1 q 0 1k\n.op\n.end\n")
    assert {t[3] for t in part(p, "x1")["texts"]} >= {"com", "trig", "out"}


def test_a_net_outside_that_a_box_reads_is_a_pin_of_it():
    p = of("global\n.global sup\nVs sup 0 5\n.subckt amp in out\nE1 out 0 VALUE={v(sup)*v(in)}\n.ends\n"
           "V1 a 0 1\nX1 a b amp\nR1 b 0 1\n.op\n.end\n")  # fmt: skip
    assert {net for *_, net in part(p, "x1")["pins"]} == {"a", "b", "sup"} and wrong(p) == []


THREE = """centre-tapped
V1 p 0 SIN(0 10 1k)
L1 p 0 10m
L2 s1 0 1m
L3 0 s2 1m
{k}
R1 s1 0 100
R2 s2 0 100
.tran 1u 5m
.end
"""


@pytest.mark.parametrize(
    ("k", "words"),
    [
        ("K1 L1 L2 L3 0.999", ["k = 0.999"]),
        (
            "K1 L1 L2 0.99\nK2 L2 L3 0.5\nK3 L1 L3 0.98",
            ["k(L1,L2) = 0.99", "k(L2,L3) = 0.5", "k(L1,L3) = 0.98"],
        ),
        ("K1 L1 L2 0.9\nK2 L2 L3 0.9", ["k(L1,L2) = 0.9", "k(L2,L3) = 0.9"]),
    ],
)
def test_coils_on_one_core_are_one_part_with_every_k(k, words):
    p = of(THREE.format(k=k))
    cores = [q for q in p.data["parts"] if q["kind"] == "transformer"]
    assert len(cores) == 1 and len(cores[0]["pins"]) == 6 and wrong(p) == []
    assert [t[3] for t in cores[0]["texts"] if t[3].startswith("k")] == words
    assert sum(s[0] == "dot" for s in cores[0]["strokes"]) == 3


def test_a_coupling_into_a_subcircuit_is_told_below():
    p = of(
        "coupled\n.subckt coil a b\nL1 a b 1m\n.ends\nV1 a 0 1\nL1 a 0 1m\nX1 b 0 coil\nR1 b 0 1\nK1 L1 x1.L1 0.5\n.op\n.end\n"
    )
    assert any(name[3] == "k(L1,x1.l1) = 0.5" for name in p.data["names"])


SALLEN = """E1 reads v(b,out)
Vin in 0 AC 1 SIN(0 1 1k)
R1 in a 10k
R2 a b 10k
C1 a out 22n
C2 b 0 11n
E1 out 0 b out 100
.tran 10u 5m
.end
"""


def test_nets_of_which_labels_speak_bear_their_names():
    p = of(SALLEN)
    assert {"b", "out"} <= {name[3] for name in p.data["names"]} | {
        t[3] for q in p.data["parts"] for t in q["texts"]
    }


def test_a_formula_that_is_too_long_tells_all_that_it_reads():
    read = [f"n{k}" for k in range(9)]
    nets = "\n".join(f"R{k} {net} 0 1" for k, net in enumerate(read))
    terms = "+".join(f"exp(sin({k + 2}*v({net})))" for k, net in enumerate(read))
    p = of(f"long\n{nets}\nB1 out 0 V={{{terms}+i(V1)}}\nV1 out 0 1\n.op\n.end\n")
    label = "".join(t[3] for t in part(p, "b1")["texts"]).replace(" ", "")
    assert label.startswith("B1f(") and all(f"v({net})" in label for net in read) and "i(v1)" in label


def test_a_table_is_not_drawn_as_its_input():
    p = of(
        "table\nV1 a 0 1\nE1 b 0 TABLE {v(a)} = (0,0) (1,2)\nR1 b 0 1\nE2 c 0 LAPLACE {v(a)} = {1/(1+s)}\nR2 c 0 1\n.op\n.end\n"
    )
    assert "TABLE of v(a)" in said(p) and "LAPLACE of v(a)" in said(p)


def test_bulks_that_are_not_drawn_are_told():
    p = of("bulks\n.model n nmos\nV1 d 0 5\nM1 d g a 0 n\nM2 a g 0 0 n\nVg g 0 3\n.op\n.end\n")
    assert "bulks of n-channel: 0" in {name[3] for name in p.data["names"]} and wrong(p) == []


@pytest.mark.parametrize("pins", PINS)
def test_a_box_has_room_for_its_label_whatever_its_terminals(pins):
    names = pins.split()
    inner = "\n".join(f"R{k} {name} m 1" for k, name in enumerate(names))
    for nets in ([f"n{k}" for k in range(len(names))], ["0" for _ in names]):
        p = of(
            f"box\n.subckt s {pins}\n{inner}\nRm m 0 1\n.ends\nV1 n0 0 1\nX1 {' '.join(nets)} s\n.op\n.end\n"
        )
        assert wrong(p) == [] and {"x1", "s"} <= {t[3] for t in part(p, "x1")["texts"]}


# ---- the reader itself: a drawing that is made wrong does not read as its deck ----


def amplifier():
    return drawn(ROOT / "netlists" / "electrical" / "bjt_amplifier.cir")


def spoilt(change) -> list[str]:
    picture = amplifier()
    data = deepcopy(picture.data)
    change(data)
    return differences(data, picture.circuit)


def test_a_wire_that_is_missing_is_seen():
    for k in range(len(amplifier().data["wires"])):
        assert spoilt(lambda data, k=k: data["wires"].pop(k)), k


def test_a_part_that_is_missing_or_has_another_name_is_seen():
    picture = amplifier()
    for k in range(len(picture.data["parts"])):
        data = deepcopy(picture.data)
        title = next(t for t in data["parts"][k]["texts"] if t[3].lower() == data["parts"][k]["name"])
        title[3] = "R99"
        assert differences(data, picture.circuit), k


def test_a_wire_to_another_net_is_seen():
    picture = amplifier()
    nets = [net for net in picture.circuit.pins if net != "0"]
    pins = {net: [q[:2] for p in picture.data["parts"] for q in p["pins"] if q[2] == net] for net in nets}
    for a, b in pairwise(nets):
        (x0, y0), (x1, y1) = pins[a][0], pins[b][0]
        data = deepcopy(picture.data)
        data["wires"].append({"net": a, "points": [[x0, y0], [x0, y1], [x1, y1]], "flow": []})
        assert differences(data, picture.circuit), (a, b)


def test_a_dot_on_a_crossing_is_seen():
    picture = drawn(ROOT / "netlists" / "electrical" / "cmos_nand.cir")
    lines = [(w["net"], a, b) for w in picture.data["wires"] for a, b in pairwise(w["points"])]
    upright, level = ([s for s in lines if s[1][k] == s[2][k]] for k in (0, 1))
    crossings = 0
    for (n, a, b), (m, c, d) in product(upright, level):
        ys, xs = sorted((a[1], b[1])), sorted((c[0], d[0]))
        if n != m and xs[0] < a[0] < xs[1] and ys[0] < c[1] < ys[1]:
            data = deepcopy(picture.data)
            data["dots"].append([a[0], c[1], n])
            assert differences(data, picture.circuit)
            crossings += 1
    assert crossings


def test_a_source_on_its_head_is_seen():
    def turn(data):
        source = next(p for p in data["parts"] if p["kind"] == "voltage")
        a, b = source["pins"]
        a[:2], b[:2] = b[:2], a[:2]

    assert spoilt(turn)


def test_a_drawing_that_does_not_read_as_the_deck_is_a_list(monkeypatch):
    monkeypatch.setattr(pictures, "differences", lambda *_: ["r1 is not drawn"])
    flat = pipeline.read(SALLEN)
    data = pictures.draw(flat, "ansi", "", flat.sink).data
    assert data["parts"] == data["wires"] == []
    words = [name[3] for name in data["names"]]
    assert "r1 is not drawn" in words[0] and "r2:  a  b" in words
    assert [d.code for d in flat.sink.diagnostics] == ["W351"]

"""Like pairs of shapes share one program: what is compiled grows with their kinds, and numbers are those of each alone."""

from __future__ import annotations

import numpy as np
import pytest

import emsim
from emsim import pipeline
from emsim.reports import explained

SPACE = {
    "ball": "shape=ball(0.05) omega=(1,2,-5)",
    "box": "shape=box(0.1,0.05,0.08) rot=(0.1,0.2,0.3) omega=(1,0,2)",
    "hull": "shape=hull(-0.08,-0.05,-0.06,0.08,-0.05,-0.06,0,-0.05,0.09,0,0.1,0) omega=(1,2,0)",
}
PLANE = {"disc": "shape=disc(0.05) omega=4", "box": "shape=box(0.1,0.06) angle=0.1 omega=2"}


def pairs(kind: str, count: int, cards: dict[str, str]) -> str:
    """So many pairs far from each other, of which the upper one falls on the lower one."""
    out = [f"{count} pairs of {kind}", ".gravity 9.81"]
    for k in range(count):
        out.append(f"BODY a{k} m=1 {cards[kind]} x={10 * k} y=1 vy=1")
        out.append(f"BODY b{k} m=2 {cards[kind]} x={10 * k + 0.02} y=1.25 vy=-2")
        out.append(f"CONTACT c{k} a{k} b{k} e=0.4 mu=0.3")
    saved = " ".join(f"y(a{k}) omega(b{k}) hits(c{k}) gap(c{k})" for k in range(count))
    return "\n".join([*out, ".options reltol=1e-7", ".tran 5m 0.2", f".save {saved}", ".end\n"])


def operations(text: str) -> int:
    """Of the equations with their derivatives; what is inside of a shared program does not count, its calls do."""
    flat = pipeline.flatten(pipeline.load(text), {})
    return pipeline.prepare(flat, {}, True)[0].system.operations[1]


@pytest.mark.parametrize(("kind", "cards"), [*((k, PLANE) for k in PLANE), *((k, SPACE) for k in SPACE)])
def test_like_pairs_have_the_numbers_of_each_alone(kind, cards):
    one, many = emsim.run(pairs(kind, 1, cards)), emsim.run(pairs(kind, 3, cards))
    at = np.linspace(0.0, 0.2, 41)
    assert one["hits(c0)"][-1] >= 1.0
    for name in ("y(a0)", "omega(b0)", "hits(c0)", "gap(c0)"):
        alone = np.interp(at, one.time, one[name])
        for k in range(3):
            like = np.interp(at, many.time, many[name.replace("0", str(k))])
            assert np.allclose(like, alone, rtol=1e-5, atol=1e-5), (name, k)


@pytest.mark.parametrize("kind", SPACE)
def test_a_pair_more_costs_its_call(kind):
    alone, two, three = (operations(pairs(kind, count, SPACE)) for count in (1, 2, 3))
    assert three - two < 0.5 * alone


def test_pairs_of_other_sizes_share_it_too():
    """Numbers go in as leaves do: a sweep over a size makes no program more."""
    cards = [SPACE["box"].replace("0.1,0.05,0.08", f"0.1,0.05,{depth}") for depth in (0.08, 0.07, 0.06)]
    alone, three = operations(pairs("box", 1, SPACE)), pairs("box", 3, SPACE).splitlines()
    for k, card in enumerate(cards):
        three = [
            line.replace(SPACE["box"], card) if line[5:7] in (f"a{k}", f"b{k}") else line for line in three
        ]
    assert operations("\n".join(three)) < 2.0 * alone


def test_equations_are_shown_as_those_of_each_alone():
    """Not as calls: friction's heat by what each lambda does with the speeds along its edge."""
    said = "\n".join(explained.page(pipeline.explain(pairs("box", 2, PLANE))))
    for k in range(2):
        heat = said.partition("heat P [W]")[2].partition(f"    c{k} ")[2].partition(f"    c{k + 1} ")[0]
        assert f"lambda(c{k},13)*cos(angle(a{k}))" in heat
    assert "join(" not in said

"""Instances that are alike are folded once: what differs in anything still has numbers of its own."""

from __future__ import annotations

import pytest

import emsim

LINES = {
    "one": "j1 d g 0 a", "alike": "j2 d g 0 a", "area": "j3 d g 0 a area=2", "warm": "j4 d g 0 a temp=80",
    "warmer": "j5 d g 0 a dtemp=40", "twice": "j6 d g 0 a m=2", "model": "j7 d g 0 b", "last": "j8 d g 0 a",
}  # fmt: skip
MODELS = (
    ".model a njf(vto=-1.7 beta=1m lambda=0.01 bex=-1)\n.model b njf(vto=-1.7 beta=2m lambda=0.01 bex=-1)\n"
)


def current(*lines: str) -> float:
    deck = "\n".join(["alike", "v1 d 0 3", "v2 g 0 -0.5", *lines, MODELS, ".op", ".end", ""])
    return -float(emsim.run(deck).op["i(v1)"][0])


def test_each_has_its_own_numbers():
    alone = {name: current(line) for name, line in LINES.items()}
    assert alone["one"] == alone["alike"] == alone["last"]
    assert len({round(i, 9) for i in alone.values()}) == 4  # area, twice and the other model come to the same
    together = current(*LINES.values())
    assert together == pytest.approx(sum(alone.values()), rel=1e-12)
    # and the other way round
    assert current(*reversed(LINES.values())) == pytest.approx(together, rel=1e-12)

"""Instances that are alike are folded once: what differs in anything still has numbers of its own."""

from __future__ import annotations

import numpy as np
import pytest

import emsim
from emsim._engine import Values

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


def test_a_model_is_read_once_for_all_of_its_elements(monkeypatch):
    read = []

    def values(given):
        read.append(given)
        return Values(given)

    monkeypatch.setattr("emsim._engine.Values", values)
    lines = [f"j{k} d g 0 {'ab'[k % 2]} area={1 + k % 3}" for k in range(60)]
    together = current(*lines)
    assert sorted(given["beta"] for given in read) == [1e-3, 2e-3]
    areas = [(1 + k % 3) * (1 + k % 2) for k in range(60)]
    assert together == pytest.approx(sum(areas) * current(LINES["one"]), rel=1e-8)  # gmin grows with no area


VARACTOR = """`include "disciplines.vams"
module varactor(a, k);
    inout a, k;
    electrical a, k;
    parameter real c = 1n;
    analog I(a, k) <+ c * (1.0 + 0.5 * tanh(V(a, k))) * ddt(V(a, k));
endmodule
"""


def test_instances_share_the_rates_of_their_nodes(tmp_path):
    """i = C(v) dv/dt has no charge; the rates that it reads are those of nodes, one each."""
    (tmp_path / "varactor.va").write_text(VARACTOR)
    (tmp_path / "deck.cir").write_text(
        "rates\n.hdl varactor.va\nv1 a 0 sin(0 2 1k)\nr1 a b 1\nn1 b 0 m\nn2 0 b m\nn3 b c m\nr3 c 0 1\nn4 b c m\n"
        ".model m varactor(c=1u)\n.options reltol=1e-6\n.tran 1u 2m\n.save v(b) v(c) i(r3)\n.end\n"
    )
    names = emsim.compile(tmp_path / "deck.cir").names
    assert sorted(n for n in names if "rate" in n or "ddt" in n) == ["b#rate", "c#rate"]
    r = emsim.run(tmp_path / "deck.cir")
    t = np.linspace(0.2e-3, 1.9e-3, 50)
    h = 1e-7
    v = r.at("v(b)", t) - r.at("v(c)", t)
    rate = (r.at("v(b)", t + h) - r.at("v(b)", t - h) - r.at("v(c)", t + h) + r.at("v(c)", t - h)) / (2 * h)
    both = 2e-6 * (1 + 0.5 * np.tanh(v)) * rate
    np.testing.assert_allclose(r.at("i(r3)", t), both, atol=2e-4 * np.abs(both).max())

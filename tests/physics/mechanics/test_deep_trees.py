"""Long chains: their work grows with the number of links, in coordinates that the run chooses by itself."""

from __future__ import annotations

import numpy as np
import pytest

import emsim
from emsim.diagnostics import DeckError


def chain(links: int, tran: str = "10m 0.3", options: str = "", end: str = "", last: str = "") -> str:
    """Uniform rods, one metre in all, let go from the horizontal."""
    length = 1.0 / links
    cards = ["a chain", ".gravity 9.81", f".options {options}" if options else "*"]
    before = "0"
    for k in range(1, links + 1):
        mass = end if k == links and end else f"shape=rod({length}) m={length}"
        cards += [
            f"BODY b{k} {mass}",
            f"JOINT p{k} {before} b{k} pin {'zero=-90deg ic=90deg' if k == 1 else ''}",
        ]
        before = f"b{k}({length},0)"
    shown = f"x({before}) y({before}) angle(p1) omega(p2) fx(p1) energy()"
    return "\n".join([*cards, last, f".print tran {shown}", f".tran {tran}", ".end", ""])


def formulation(text: str) -> str:
    return emsim.check(text)["machine"]["formulation"]


@pytest.mark.parametrize(
    ("links", "expected"), [(20, "joint"), (50, "joint"), (60, "absolute"), (200, "absolute")]
)
def test_long_chains_take_the_coordinates_of_bodies(links: int, expected: str):
    assert formulation(chain(links)) == expected


def test_the_deck_decides_otherwise():
    assert formulation(chain(70, options="formulation=joint")) == "joint"
    assert formulation(chain(5, options="formulation=absolute")) == "absolute"


def test_what_hangs_on_few_joints_keeps_theirs():
    """A thousand short arms: no body's inertia is anybody else's."""
    arms = [
        f"BODY a{k} shape=rod(0.1) m=1\nJOINT q{k} 0 a{k} pin\nBODY c{k} shape=rod(0.1) m=1\nJOINT r{k} a{k}(0.1,0) c{k} pin"
        for k in range(300)
    ]
    text = "\n".join(["arms", ".gravity 9.81", *arms, ".tran 1m 10m", ".print tran angle(q7)", ".end", ""])
    assert formulation(text) == "joint"


def ring(links: int, options: str = "") -> str:
    """A closed chain of uniform rods, three metres in all, let go as a regular polygon that hangs at one of its joints."""
    length, turn = 3.0 / links, 360.0 / links
    cards = ["a ring", ".gravity 9.81", f".options reltol=1e-8 {options}"]
    before = "0"
    for k in range(1, links + 1):
        cards += [
            f"BODY b{k} shape=rod({length}) m={length}",
            f"JOINT p{k} {before} b{k} pin guess={turn!r}deg",
        ]
        before = f"b{k}({length},0)"
    shown = f"y(b{links // 2}) angle(p1) omega(p2) angle(last) fx(last) fy(p1) energy()"
    return "\n".join(
        [*cards, f"JOINT last {before} 0 pin", f".print tran {shown}", ".tran 10m 0.3", ".end", ""]
    )


@pytest.mark.parametrize(("links", "expected"), [(40, "joint"), (60, "absolute"), (120, "absolute")])
def test_long_loops_take_the_coordinates_of_bodies(links: int, expected: str):
    facts = emsim.check(ring(links))["machine"]
    assert (facts["formulation"], facts["degrees_of_freedom"]) == (expected, links - 2)


def test_loops_of_short_links_keep_coordinates_of_joints():
    """72 bodies in four-bars side by side: none of them hangs on many joints."""
    bars = [
        f"BODY a{k} shape=rod(0.1) m=1\nBODY b{k} shape=rod(0.3) m=1\nBODY c{k} shape=rod(0.1) m=1\n"
        f"JOINT p{k} 0 a{k} pin guess=90deg\nJOINT q{k} a{k}(0.1,0) b{k} pin guess=-90deg\n"
        f"JOINT r{k} b{k}(0.3,0) c{k}(0.1,0) pin\nJOINT s{k} c{k} 0(0.3,0) pin guess=90deg"
        for k in range(24)
    ]
    text = "\n".join(["bars", *bars, ".tran 1m 10m", ".print tran angle(p7)", ".end", ""])
    assert formulation(text) == "joint"


def test_a_ring_moves_alike_in_both_coordinates():
    bodies, joints = (emsim.run(ring(24, f"formulation={f}")) for f in ("absolute", "joint"))
    times = np.linspace(0.0, 0.3, 31)
    for name in ("y(b12)", "angle(p1)", "omega(p2)", "angle(last)", "fx(last)", "fy(p1)"):
        a, b = bodies.at(name, times), joints.at(name, times)
        assert np.max(np.abs(a - b)) < 1e-5 * np.max(np.abs(b)), name
    assert np.ptp(bodies["energy()"]) < 1e-8 * 9.81 * 3


def test_a_long_loop_that_starts_at_a_change_point_is_asked_for_its_rows():
    """Stretched between two points: the row along the chain is lost there, in whatever coordinates."""
    stretched = chain(70, last="JOINT back b70(0.01428571428571428,0) 0(1,0) pin")
    found = emsim.check(stretched)
    assert found["machine"]["formulation"] == "absolute"


def test_both_coordinates_move_alike():
    by_choice = emsim.run(chain(52, "10m 0.15", "reltol=1e-8"))
    by_joints = emsim.run(chain(52, "10m 0.15", "reltol=1e-8 formulation=joint"))
    assert by_choice.stats["method"] != by_joints.stats["method"]
    times = np.linspace(0.0, 0.15, 16)
    for name in ("y(b52(0.019230769230769232,0))", "angle(p1)", "omega(p2)", "fx(p1)"):
        a, b = by_choice.at(name, times), by_joints.at(name, times)
        assert np.max(np.abs(a - b)) < 1e-6 * np.max(np.abs(b)), name


def test_a_chain_of_two_hundred_keeps_its_energy():
    """Nothing rubs: kinetic and potential energy add up to what they were."""
    r = emsim.run(chain(200, tran="10m 0.06", options="reltol=1e-6"))
    energy = r["energy()"]
    assert np.ptp(energy) < 1e-7 * 9.81
    # the free end of a chain let go from the horizontal falls freely at first
    y = r.at("y(b200(0.005,0))", np.array([0.05]))[0]
    assert y == pytest.approx(-0.5 * 9.81 * 0.05**2, rel=1e-2)


@pytest.mark.parametrize("scene", [chain, ring])
def test_work_and_memory_grow_with_the_number_of_links(scene):
    """Exponents of unknowns, nonzeros and operations over the number of links."""

    def counts(links: int) -> np.ndarray:
        facts = emsim.check(scene(links))
        cost = facts["formulations"]["absolute"]
        return np.array([cost["size"], cost["nonzeros"], cost["values"], cost["with_derivatives"]], float)

    few, many = counts(100), counts(400)
    assert np.all(np.log(many / few) / np.log(4.0) < 1.05)


def test_a_link_without_inertia_is_named_in_a_long_chain_too():
    with pytest.raises(DeckError) as caught:
        emsim.run(chain(80, end="m=0"))
    assert any(d.code == "E243" and "b80" in d.message for d in caught.value.diagnostics)


def test_a_mistake_in_a_long_chain_is_told_once():
    text = chain(80).replace("JOINT p7 ", "JOINT p7 nowhere ", 1)
    with pytest.raises(DeckError) as caught:
        emsim.run(text)
    assert len(caught.value.diagnostics) == len({(d.code, d.message) for d in caught.value.diagnostics})

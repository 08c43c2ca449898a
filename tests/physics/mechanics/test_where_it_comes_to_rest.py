"""`.op static` of many links: the hanging shape, not "no equilibrium, or is free to move"."""

from __future__ import annotations

import pytest

import emsim


def chain(links: int, length: float, hook: float | None, read: str) -> str:
    """Links from a pin at the origin along the level; the last one on a hook at x = `hook`, or free."""
    lines = ["links", ".gravity 9.81"]
    for k in range(1, links + 1):
        before = "0" if k == 1 else f"b{k - 1}({length},0)"
        lines += [f"BODY b{k} shape=rod({length}) m=0.1", f"JOINT j{k} {before} b{k} pin"]
    if hook is not None:
        lines.append(f"JOINT end b{links}({length},0) 0({hook},0) pin")
    return "\n".join([*lines, ".op static", f".save {read}", ".end", ""])


@pytest.mark.parametrize("links", [5, 30])
def test_an_open_chain_let_down_from_the_level_has_no_equilibrium(links):
    r = emsim.run(chain(links, 0.1, None, f"x(b{links}(0.1,0)) y(b{links}(0.1,0))"))
    assert float(r[f"y(b{links}(0.1,0))"][-1]) == pytest.approx(-0.1 * links, abs=1e-6)
    assert float(r[f"x(b{links}(0.1,0))"][-1]) == pytest.approx(0.0, abs=1e-4)


def test_a_cable_between_two_hooks_has_no_equilibrium():
    """Half its weight on each hook, and the same pull inwards; it hangs below them."""
    r = emsim.run(chain(20, 0.08, 1.0, "fx(j1) fy(j1) fx(end) fy(end) y(b10(0.08,0)) x(b10(0.08,0))"))
    at = {name: float(r[name][-1]) for name in r.names}
    assert abs(at["fy(j1)"]) == pytest.approx(9.81, rel=1e-5)
    assert abs(at["fy(end)"]) == pytest.approx(9.81, rel=1e-5)
    assert abs(at["fx(j1)"]) == pytest.approx(abs(at["fx(end)"]), rel=1e-6)
    assert at["x(b10(0.08,0))"] == pytest.approx(0.5, abs=1e-5)
    assert -0.65 < at["y(b10(0.08,0))"] < -0.5


PENDULUM = """t
.gravity 9.81
BODY arm shape=rod(0.3) m=0.2
JOINT hinge 0 arm pin ic={start}
SPRING s hinge k={k} q0={start}
.op static
.end
"""


@pytest.mark.parametrize(("k", "stays"), [(0.1, False), (0.5, True)])
def test_an_upright_pose_is_reported_as_rest(k, stays):
    """On its head a spring holds it from k = m g l/2 = 0.294 N m on."""
    r = emsim.run(PENDULUM.format(start="90deg", k=k))
    said = [d.message for d in r.diagnostics if d.code == "W241"]
    assert bool(said) is not stays
    assert stays or "angle(hinge)" in said[0]


def test_a_hanging_pose_is_stable():
    r = emsim.run(PENDULUM.format(start="-60deg", k=0.01))
    assert not [d for d in r.diagnostics if d.code == "W241"]

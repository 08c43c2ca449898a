"""Pages as axe-core sees them (MPL 2.0, fetched from npm for this test alone and part of nothing that is shipped)."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import emsim
from emsim import pipeline
from emsim.fmus import page as computing
from emsim.outputs import html
from emsim.reports import explained

ROOT = Path(__file__).resolve().parents[2]
STEPPED = """low passes
V1 a 0 PULSE(0 1 0 1u 1u 1 2)
R1 a b {r}
C1 b 0 1u
.param r=1k
.tran 10u 2m
.step param r list 1k 2k
.end
"""
# circuit and machine at a point of rest, values written beside the wires
REST = (
    "a servo at rest\n.gravity 9.81\nBODY arm shape=rod(0.3) m=0.2\nJOINT hinge 0 arm pin\nSPRING s hinge k=1\n"
    "MOTOR m1 a 0 hinge kt=20m r=2 l=1m j=2u\nV1 a 0 3\n.op static\n.end\n"
)


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("pages")
    deck = ROOT / "netlists/coupled/pendulum_servo.cir"
    result = pipeline.run(str(deck), scene=True)
    servo, still = folder / "servo.html", folder / "still.html"
    html.write(str(servo), result, deck.read_text(), explained.sheets(pipeline.explain(str(deck))))
    text = "divider\nV1 a 0 1\nR1 a b 1k\nC1 b 0 1n\nR2 b 0 1k\n.op\n.pz a 0 b 0 vol pz\n.end\n"
    computes = folder / "computes.html"
    engine = computing.engine(str(deck), result, {}, {}) if computing.there() else None
    html.write(str(computes), result, deck.read_text(), engine=engine)
    html.write(str(still), emsim.run(text), text)
    stepped, spatial, rest = (folder / f"{name}.html" for name in ("stepped", "spatial", "rest"))
    html.write(str(stepped), pipeline.run(STEPPED, scene=True), STEPPED)
    html.write(str(spatial), pipeline.run(str(ROOT / "netlists/mechanical/heavy_top.cir"), scene=True))
    html.write(str(rest), pipeline.run(REST, scene=True), REST)
    return {
        "servo": servo,
        "still": still,
        "stepped": stepped,
        "spatial": spatial,
        "rest": rest,
        "computes": computes,
    }


@pytest.mark.parametrize(("width", "scheme"), [(1300, "light"), (1300, "dark"), (390, "light")])
@pytest.mark.parametrize("name", ["servo", "still", "stepped", "spatial", "rest", "computes"])
def test_axe_finds_nothing(
    violations: Callable[[Any], list[Any]],
    chromium: Any,
    pages: dict[str, Path],
    name: str,
    width: int,
    scheme: str,
) -> None:
    context = chromium.new_context(
        viewport={"width": width, "height": 900}, color_scheme=scheme, bypass_csp=True
    )
    page = context.new_page()
    page.goto(pages[name].as_uri())
    page.wait_for_selector("#tabs button")
    if name == "computes" and computing.there():
        page.wait_for_function("window.engine")
        page.click("#knobs .fold")
        field = page.get_by_label("rload, as text")
        field.fill("50k")
        field.press("Enter")
        page.wait_for_function("!window.engine.busy")
        assert violations(page) == []
        page.click("text=runs on")
        page.wait_for_function("window.engine.running?.view")
        page.evaluate("window.engine.running.play(false)")
    for tab in page.locator("#tabs button").all():
        tab.click()
        assert violations(page) == [], tab.text_content()
    if name == "servo":
        page.click("#help")
        assert violations(page) == []
    context.close()

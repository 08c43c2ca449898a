"""A result in a notebook: the page in its frame draws and plays, the notebook around it stays out of its reach."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import emsim

ROOT = Path(__file__).resolve().parents[2]


def test_the_page_works_within_its_frame(chromium: Any, tmp_path: Path) -> None:
    result = emsim.run(ROOT / "netlists/coupled/pendulum_servo.cir", scene=True)
    path = tmp_path / "cell.html"
    path.write_text(f"<!doctype html><meta charset=utf-8><title>cell</title><body>{result._repr_html_()}")
    said: list[str] = []
    context = chromium.new_context(viewport={"width": 1000, "height": 900}, bypass_csp=True)
    page = context.new_page()
    page.on("console", lambda m: said.append(m.text))
    page.on("pageerror", lambda e: said.append(str(e)))
    page.goto(path.as_uri())
    frame = page.wait_for_selector("iframe").content_frame()
    frame.wait_for_function("window.emsim && window.emsim.waves.panels.length > 0", timeout=20_000)
    picture = "() => document.getElementById('machine').toDataURL()"
    before = frame.evaluate(picture)
    frame.evaluate("window.emsim.clock.set(0.2)")
    frame.wait_for_timeout(60)
    assert frame.evaluate(picture) != before
    # nothing of the page is wider than its frame
    assert frame.evaluate("document.documentElement.scrollWidth <= innerWidth")
    reach = "() => { try { return parent.document.title } catch (e) { return e.name } }"
    assert frame.evaluate(reach) == "SecurityError"
    assert [s for s in said if "SecurityError" not in s] == []
    context.close()

"""What a page says of the runs that it computes: measurements, energies, labels, and lines for the deck's text."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import emsim

RC = """an RC, measured
.param res=1k
V1 in 0 PULSE(0 5 0.1m 1u 1u 1 2)
R1 in out {res}
R2 out 0 1meg
C1 out 0 1u
.tran 20u 6m
.meas tran rise trig v(out) val=0.5 rise=1 targ v(out) val=3.5 rise=1
.meas tran tau when v(out)=5*(1-exp(-1)) rise=1
.meas tran top max v(out)
.meas tran mean avg v(out) from=1m to=3m
.meas tran effective rms v(out) from=1m to=3m
.meas tran charge integ i(v1)
.meas tran there find v(out) at=1.1m
.meas tran slope deriv v(out) at=1.1m
.meas tran half param='top/2'
.end
"""
BALL = """a ball that falls on an elastic floor
BODY ball m=0.1 shape=disc(0.05)
JOINT way 0 ball slide axis=(0,1) ic=1
STOP floor way min=0 k=1e4 c=1
.gravity 9.81
.tran 1m 1
.end
"""


def table(seen: Any, name: str) -> dict[str, list[str]]:
    rows = seen.evaluate(
        f"[...document.querySelectorAll('#sheet-{name} tr')].map(r => [...r.cells].map(c => c.textContent))"
    )
    return {row[0]: row[1:] for row in rows if row}


def test_measurements_are_those_of_the_run_that_is_shown(moved: Callable[..., Any]) -> None:
    seen = moved(RC, {"res": "2k"})
    found = table(seen, "measures")
    both = [{m.name: m for m in emsim.run(RC.replace("res=1k", f"res={r}")).measured} for r in ("2k", "1k")]
    assert len(both[0]) == 9
    for name, m in both[0].items():
        value, unit, of_deck = found[name]
        # straight lines between rows 20 us apart: h^2/8 of the bend 5/tau^2
        assert float(value) == pytest.approx(m.value, rel=3e-4), name
        assert unit == m.unit
        assert float(of_deck) == pytest.approx(both[1][name].value, rel=1e-5)
        assert abs(m.value - both[1][name].value) > 1e-3 * abs(m.value)


def test_energies_are_those_of_the_run_that_is_shown(moved: Callable[..., Any]) -> None:
    seen = moved(BALL, {"ball(m)": "0.3"})
    found = seen.evaluate("window.emsim.run.energy")
    known = emsim.run(BALL.replace("m=0.1", "m=0.3"), energy=True).energy.to_dict()
    turnover = known["turnover"]
    assert turnover > 2.9  # 0.3 kg from 1 m
    for kind in ("supplied", "dissipated", "stored", "residual"):
        assert found[kind] == pytest.approx(known[kind], abs=1e-4 * turnover), kind
    for mine, its in zip(found["accounts"], known["accounts"], strict=True):
        assert (mine["name"], mine["card"]) == (its["name"], its["card"])
        assert mine["dissipated"] == pytest.approx(its["dissipated"], abs=1e-4 * turnover)
    assert "J dissipated" in seen.inner_text("#sheet-energy") or seen.locator("#tab-energy").count() == 1


def test_a_label_follows_its_slider_and_its_line_goes_into_the_deck(moved: Callable[..., Any]) -> None:
    seen = moved(RC, {"c1": "4.7u"})
    labels = seen.evaluate(
        "[...document.querySelectorAll('#circuit [data-part=c1] text')].map(t => t.textContent)"
    )
    assert "4.7 µF" in labels
    seen.get_by_label("c1 into the deck's text").click()
    seen.locator("#computing", has_text="of the deck").wait_for()  # (a copy to the clipboard comes first)
    assert "line 6 of the deck: C1 out 0 4.7u" in seen.inner_text("#computing")
    seen.click("#tab-deck")
    assert seen.inner_text("#sheet-deck .picked") == "C1 out 0 4.7u"
    # the whole text, but for that line, is the deck's
    text = seen.evaluate(
        "[...document.querySelectorAll('#sheet-deck .deck span')].map(s => s.textContent).join('\\n')"
    )
    assert text.strip() == RC.replace("C1 out 0 1u", "C1 out 0 4.7u").strip()


def test_where_a_joint_starts_goes_into_its_line(moved: Callable[..., Any]) -> None:
    seen = moved(BALL, {"pos(way) at 0": "0.5"})
    seen.get_by_label("pos(way) at 0 into the deck's text").click()
    seen.locator("#computing", has_text="of the deck").wait_for()
    said = seen.inner_text("#computing")
    assert re.search(r"line 3 of the deck: JOINT way 0 ball slide axis=\(0,1\) ic=0\.5", said)
    table_ = emsim.run(BALL.replace("ic=1", "ic=0.5")).main
    mine = seen.evaluate("[...window.emsim.run.columns.find(c => c.name === 'pos(way)').values]")
    assert mine[0] == 0.5
    assert mine[-1] == pytest.approx(table_["pos(way)"][-1], abs=1e-4)


def test_the_page_stays_below_a_megabyte(moved: Callable[..., Any], tmp_path: Path) -> None:
    seen = moved(RC, {})
    assert (tmp_path / "page.html").stat().st_size < 1_000_000
    # what unpacks the engine gives a module, and the decks' run by it
    seen.evaluate("() => { window.engine.wish([]); }")
    seen.wait_for_function("!window.engine.busy")

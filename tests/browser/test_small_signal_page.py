"""Pages of frequency sweeps, of sweeps within sweeps, and of signals with rows that no scale shows."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import emsim
from emsim.functions import KNOWN
from emsim.outputs import html
from emsim.result import Result
from emsim.signals import WHOLE
from emsim.store import Columns
from emsim.table import Table

FILTER = "low pass\nV1 in 0 dc 1 ac 1\nR1 in out 1k\nC1 out 0 1u\n.ac dec 20 1 100k\n.print ac v(out)\n.end\n"
LEGEND = "() => [...document.querySelectorAll('.legend')].map((e) => e.textContent).join('|')"


@pytest.fixture
def page_of(tmp_path: Path, visit: Any) -> Callable[[Result], Any]:
    def show(result: Result) -> Any:
        path = tmp_path / "page.html"
        html.write(str(path), result)
        return visit(path)

    return show


def test_a_bode_plot_over_a_logarithmic_axis(page_of: Any) -> None:
    page = page_of(emsim.run(FILTER))
    drawn = "() => window.emsim.waves.panels.map((p) => [p.unit, p.columns.map((c) => c.name), p.plot.scales.x.distr])"
    assert page.evaluate(drawn) == [["dB", ["db(v(out))"], 3], ["\u00b0", ["ph(v(out))"], 3]]
    page.evaluate("() => window.emsim.clock.set(1e3 / (2 * Math.PI))")
    page.wait_for_timeout(100)
    said = page.evaluate(LEGEND)
    assert "db(v(out)) = -3.0" in said and "ph(v(out)) = -4" in said
    last = "() => { const c = window.emsim.run.columns.at(-1); return [c.name, c.values[0]]; }"
    page.fill("#expression", "mag(v(out))*2")
    page.keyboard.press("Enter")
    assert page.evaluate(last) == ["mag(v(out))*2", pytest.approx(2.0, rel=1e-3)]


def test_a_family_of_courses(page_of: Any) -> None:
    page = page_of(emsim.run("t\nV1 a 0 1\nV2 c 0 0\nR1 a b 1k\nR2 b c 1k\n.dc V1 0 2 0.1 V2 0 4 2\n.end\n"))
    assert page.evaluate("() => [window.emsim.waves.xname, window.emsim.run.blocks]") == ["v-sweep", [21, 42]]
    assert page.evaluate("() => document.querySelectorAll('#panels canvas').length") >= 1


def test_an_infinite_row_leaves_the_others_on_the_scale(page_of: Any) -> None:
    t = np.linspace(0, 1, 101)
    with np.errstate(divide="ignore"):
        y = 1 / t
    huge = np.where(t == 0.5, 1e27, np.sin(t))
    store = Columns([c.tobytes() for c in (t, y, huge)])
    page = page_of(Result("t", [Table("tran", ["time", "y", "z"], ["s", "V", "A"], store)]))
    low, high = page.evaluate(
        "() => { const s = window.emsim.waves.panels[0].plot.scales.y; return [s.min, s.max]; }"
    )
    assert low < 1 and 90 < high < 120
    low, high = page.evaluate(
        "() => { const s = window.emsim.waves.panels[1].plot.scales.y; return [s.min, s.max]; }"
    )
    assert -0.2 < low <= 0 and 0.8 < high < 1
    page.evaluate("() => window.emsim.clock.set(0.25)")
    page.wait_for_timeout(100)
    said = page.evaluate(LEGEND)
    assert "y = 4 V" in said and "z = 247.4 mA" in said  # they read 0
    assert "1 row off the scale, \u221e at 0 s" in said and "1 row off the scale, 1e+27 A at 500 ms" in said


def test_the_page_knows_the_functions_of_the_command_line(page_of: Any) -> None:
    page = page_of(emsim.run(FILTER))
    known = set(page.evaluate("() => Object.keys(FUNCTIONS)"))
    assert set(KNOWN) <= known
    assert set(page.evaluate("() => Object.keys(WHOLE)")) == set(WHOLE)


def test_functions_of_a_whole_course_are_those_of_the_command_line(page_of: Any) -> None:
    result = emsim.run(
        "t\nV1 a 0 SIN(1 2 1k)\nR1 a 0 {r}\n.tran 5u 3m\n.step param r list 1 2\n.meas tran x avg v(a)\n.end\n"
    )
    page = page_of(result)
    for text in ("avg(v(a))", "rms(v(a))", "pp(i(v1))", "integ(v(a))", "ddt(v(a))"):
        page.fill("#expression", text)
        page.keyboard.press("Enter")
        values = page.evaluate("() => [...window.emsim.run.columns.at(-1).values]")
        expected = result[text]
        assert values[-1] == pytest.approx(expected[-1], rel=2e-3), text
        assert values[0] == pytest.approx(expected[0], rel=2e-3, abs=1e-6), text
    assert "Measurements" in page.inner_text("#tabs")


def test_runs_of_a_stepped_deck_have_a_colour_and_a_name_each(page_of: Any) -> None:
    page = page_of(
        emsim.run(
            "t\nV1 a 0 ac 1\nR1 a b {r}\nC1 b 0 1u\n.ac dec 10 1 1meg\n.step param r list 1k 10k 100k\n.end\n"
        )
    )
    known = page.evaluate(
        "() => [window.emsim.run.courses, window.emsim.run.overLog, window.emsim.waves.xname]"
    )
    assert known == [["r = 1000", "r = 10000", "r = 100000"], True, "frequency"]
    colours = """() => {
      const c = document.querySelector('#panels canvas'), found = new Set();
      const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
      const hex = (v) => v.toString(16).padStart(2, '0');
      for (let k = 0; k < d.length; k += 4) found.add('#' + hex(d[k]) + hex(d[k + 1]) + hex(d[k + 2]));
      return COLOURS.filter((colour) => found.has(colour)).length;
    }"""
    assert page.evaluate(colours) >= 3

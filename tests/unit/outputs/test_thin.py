"""Pages of long runs: thinned columns stay within what they promise, and keep their extremes."""

from __future__ import annotations

import json
import math
import re
import zlib
from array import array
from base64 import b64decode
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from emsim import pipeline
from emsim.outputs import html, thin
from emsim.result import Result
from emsim.store import Columns
from emsim.table import Table

ROOT = Path(__file__).resolve().parents[3]


def ints(text: str, count: int) -> np.ndarray:
    planes = np.frombuffer(zlib.decompress(b64decode(text)), np.uint8)
    return planes.reshape(4, count).T.copy().view(np.int32).ravel()


def numbers(c: dict[str, Any]) -> np.ndarray:
    """The numbers of kept rows, as web/data.js has them."""
    if "step" in c:
        found = ints(c["packed"], c["count"]).astype(float)
        return c["low"] + c["step"] * (np.cumsum(found) if c["sums"] else found)
    raw = zlib.decompress(b64decode(c["packed"]))
    width = len(raw) // c["count"]
    planes = np.frombuffer(raw, np.uint8).reshape(width, c["count"]).T.copy()
    return planes.view(np.float32 if width == 4 else np.float64).ravel().astype(float)


def course(found: dict[str, Any], k: int, x: np.ndarray) -> np.ndarray:
    """Column k at any x."""
    axis, c = numbers(found["axis"]), found["packed"][k]
    with np.errstate(invalid="ignore"):
        return np.interp(x, axis[np.cumsum(ints(c["at"], c["count"]))], numbers(c))


def distance(found: dict[str, Any], k: int, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """How far rows are from column k; beside steep edges the rounding of the axis counts too."""
    tick, c = found["axis"]["step"], found["packed"][k]
    near = [course(found, k, x + shift) for shift in (-tick, 0.0, tick)]
    low, high = np.min(near, 0), np.max(near, 0)
    for t, v in zip(numbers(found["axis"])[np.cumsum(ints(c["at"], c["count"]))], numbers(c), strict=True):
        beside = slice(np.searchsorted(x, t - tick), np.searchsorted(x, t + tick, "right"))
        low[beside], high[beside] = np.minimum(low[beside], v), np.maximum(high[beside], v)
    with np.errstate(invalid="ignore"):
        return np.maximum(np.maximum(low - y, y - high), 0)


def pwm(rows: int) -> tuple[np.ndarray, list[array[float]]]:
    x = np.sort(np.concatenate([np.linspace(0, 1, rows), np.arange(1, 200) / 200 + 1e-9]))
    square = np.where((200 * x) % 1 < 0.3, 12.0, 0.0)
    ripple = np.sin(2 * np.pi * 3 * x) + 0.05 * np.abs((200 * x) % 1 - 0.5)
    flat = np.full_like(x, 5.0)
    return x, [array("d", c) for c in (square, ripple, flat)]


@pytest.mark.parametrize("most", [60_000, 25_000, 9_000])
def test_a_thinned_curve_is_nowhere_farther_off_than_it_says(most: int) -> None:
    x, columns = pwm(20_000)
    found = thin.thinned(x.tolist(), columns, (), most)
    assert found is not None and found["parts"] == 0
    for k, c in enumerate(columns):
        span = max(c) - min(c)
        off = distance(found, k, x, np.asarray(c))
        assert off.max() <= found["thinned"] * span * 1.001 + 1e-12
        if span:
            kept = numbers(found["packed"][k])
            assert kept.max() == pytest.approx(max(c), abs=found["thinned"] * span / 4)
            assert kept.min() == pytest.approx(min(c), abs=found["thinned"] * span / 4)


def test_a_row_that_no_scale_shows_leaves_the_others_as_fine() -> None:
    x = np.linspace(0, 1, 5000)
    y = np.sin(20 * x)
    y[2500] = 1e27
    z = np.cos(20 * x)
    z[100] = math.inf
    z[200] = math.nan
    found = thin.thinned(x.tolist(), [array("d", y), array("d", z)], (), 20_000)
    assert found is not None
    for k, (c, odd) in enumerate([(y, [2500]), (z, [100, 200])]):
        clear = np.array([all(abs(r - o) > 1 for o in odd) for r in range(5000)])
        assert distance(found, k, x, c)[clear].max() <= 2 * found["thinned"]
        kept = numbers(found["packed"][k])
        assert np.isinf(kept).any() or kept.max() > 1e26


def test_extremes_of_what_is_too_fast_for_lines_are_kept() -> None:
    x = np.sort(np.random.default_rng(1).uniform(0, 1, 60_000))
    y = np.sin(2 * np.pi * 10_000.3 * x)
    y[31_415] = 7.0
    found = thin.thinned(x.tolist(), [array("d", y), array("d", x)], (), 20_000)
    assert found is not None and found["parts"] and found["packed"][0]["extremes"]
    assert "extremes" not in found["packed"][1]
    assert course(found, 1, x) == pytest.approx(x, abs=1e-2)
    assert numbers(found["packed"][0]).max() == pytest.approx(7.0, abs=0.02)


def test_courses_of_a_sweep_keep_their_ends() -> None:
    one = np.linspace(0, 1, 4000)
    x, y = np.concatenate([one, one]), np.concatenate([np.sin(9 * one), 2 * np.sin(9 * one)])
    found = thin.thinned(x.tolist(), [array("d", y)], (4000,), 10_000)
    assert found is not None
    axis = numbers(found["axis"])
    (first,) = found["blocks"]
    assert axis[first] == pytest.approx(0, abs=1e-8) and axis[first - 1] == pytest.approx(1, abs=1e-8)


def test_what_is_small_in_a_frequency_response_is_never_thinned() -> None:
    """In parts of a thousandth of the range -100 dB is anything."""
    f = np.logspace(0, 6, 60_000)
    h = 1 / (1 + 1j * f / 10.0 + np.random.default_rng(1).normal(0, 1e-6, len(f)))
    store = Columns([f.tobytes(), h.tobytes()], complex=[False, True])
    run = html.document(Result("t", [Table("ac", ["frequency", "v(a)"], ["Hz", "V"], store)]), most=20_000)
    assert "thinned" not in run and run["rows"] == len(f) and all(isinstance(c, str) for c in run["packed"])


@pytest.mark.parametrize("deck", ["coupled/slider_crank_hbridge", "coupled/comb_drive"])
def test_pages_of_long_runs_stay_below_600_kb(deck: str, tmp_path: Path) -> None:
    """They came to 6 and 12 MB."""
    path = tmp_path / "page.html"
    result = pipeline.run(str(ROOT / "netlists" / f"{deck}.cir"), scene=True)
    html.write(str(path), result)
    text = path.read_text()
    assert len(text) < 600_000
    found = re.search(r'<script id="run" type="application/json">(.*?)</script>', text, re.DOTALL)
    assert found
    run = json.loads(found[1])
    table = result.main
    time = np.asarray(table.floats(0))
    assert run["rows"] < len(table) and run["thinned"] <= 1e-3
    for k, name in enumerate(run["names"][:8]):
        c = np.asarray(table.floats(name))
        off = distance(run, k, time, c)
        assert off.max(initial=0) <= run["thinned"] * np.ptp(c) * 1.01 + 1e-12, name

"""$table_model beside numpy's straight lines and scipy's splines."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from module_decks import run
from scipy.interpolate import CubicSpline

import emsim

X = [-1.0, -0.2, 0.5, 1.0, 2.5]
Y = [0.3, 1.0, -0.4, 0.2, 2.0]
AT = -2.0 + 0.15 * np.arange(37)


def swept(tmp_path: Path, call: str, more: str = "", second: float = 0.0) -> np.ndarray:
    rows = "".join(f"x[{k}] = {x}; y[{k}] = {y}; " for k, (x, y) in enumerate(zip(X, Y, strict=True)))
    module = (
        "module m(in, two, out); inout in, two, out; electrical in, two, out; real x[0:4], y[0:4];\n"
        f"analog begin {rows} {more} V(out) <+ {call}; end\nendmodule\n"
    )
    deck = f"V1 in 0 0\nV2 two 0 {second}\nN1 in two out n\nR1 out 0 1k\n.model n m\n.save v(out)\n.dc V1 -2 3.5 0.15"
    return np.asarray(run(tmp_path, module, deck)["v(out)"])


def beyond(inner: np.ndarray, low: tuple[bool, float, float], high: tuple[bool, float, float]) -> np.ndarray:
    """With straight lines, or constants, beyond both ends."""
    out = inner.copy()
    below, above = X[0] > AT, X[-1] < AT
    out[below] = low[1] + (0 if low[0] else low[2]) * (AT[below] - X[0])
    out[above] = high[1] + (0 if high[0] else high[2]) * (AT[above] - X[-1])
    return out


@pytest.mark.parametrize("control", ["", '"1L"', '"1C"', '"1CL"', '"1LC"', '"1"', '""'])
def test_straight_lines(control: str, tmp_path: Path) -> None:
    ends = [c == "C" for c in control.strip('"')[1:]] or [False]
    slopes = np.diff(Y) / np.diff(X)
    wanted = beyond(np.interp(AT, X, Y), (ends[0], Y[0], slopes[0]), (ends[-1], Y[-1], slopes[-1]))
    found = swept(tmp_path, f"$table_model(V(in), x, y{', ' + control if control else ''})")
    assert found == pytest.approx(wanted, abs=1e-12)


@pytest.mark.parametrize("control", ["3L", "3C", "3CL", "3LC", "3"])
def test_cubic_splines(control: str, tmp_path: Path) -> None:
    """Where it stays its slope is 0 at the end, elsewhere its bend."""
    ends = [c == "C" for c in control[1:]] or [False]
    conditions = tuple((1, 0.0) if stays else (2, 0.0) for stays in (ends[0], ends[-1]))
    spline = CubicSpline(X, Y, bc_type=conditions)
    wanted = beyond(spline(AT), (ends[0], Y[0], spline(X[0], 1)), (ends[-1], Y[-1], spline(X[-1], 1)))
    found = swept(tmp_path, f'$table_model(V(in), x, y, "{control}")')
    assert found == pytest.approx(wanted, abs=1e-12)


def test_the_nearest_point(tmp_path: Path) -> None:
    # half of the way between two points is of the one further from 0
    wanted = [Y[min(range(5), key=lambda k: (round(abs(X[k] - at), 9), -abs(X[k])))] for at in AT]
    assert swept(tmp_path, '$table_model(V(in), x, y, "D")') == pytest.approx(wanted)


SURFACE = [(u, x, float(np.sin(u) + x * x * u)) for u in (0.0, 1.0, 2.0, 4.0) for x in X]


@pytest.mark.parametrize("control", ["1L,1L", "3L,1C", "1C,3L", "3C,3C"])
@pytest.mark.parametrize("second", [-0.5, 0.4, 1.7, 5.0])
def test_two_inputs_from_a_file(control: str, second: float, tmp_path: Path) -> None:
    """Along the inner input on each line, then along the outer one."""
    (tmp_path / "surface.tbl").write_text(
        "# u x value twice\n" + "\n".join(f"{u} {x} {v!r} {2 * v!r}" for u, x, v in reversed(SURFACE)) + "\n"
    )

    def along(way: str, xs: list[float], ys: list[float], at: np.ndarray) -> np.ndarray:
        stays = way[1] == "C"
        if way[0] == "3":
            spline = CubicSpline(xs, ys, bc_type=((1, 0.0) if stays else (2, 0.0),) * 2)
            inner, slopes = spline(at), (spline(xs[0], 1), spline(xs[-1], 1))
        else:
            chords = np.diff(ys) / np.diff(xs)
            inner, slopes = np.interp(at, xs, ys), (chords[0], chords[-1])
        for k, outside in ((0, at < xs[0]), (-1, at > xs[-1])):
            inner[outside] = ys[k] + (0 if stays else slopes[k]) * (at[outside] - xs[k])
        return inner

    outer, inner = control.split(",")
    us = sorted({u for u, _, _ in SURFACE})
    lines = [along(inner, X, [v for w, _, v in SURFACE if w == u], AT) for u in us]
    wanted = [along(outer, us, [line[k] for line in lines], np.array([second]))[0] for k in range(len(AT))]
    found = swept(tmp_path, f'$table_model(V(two), V(in), "surface.tbl", "{control}")', second=second)
    assert found == pytest.approx(wanted, abs=1e-11)
    doubled = swept(tmp_path, f'$table_model(V(two), V(in), "surface.tbl", "{control};2")', second=second)
    assert doubled == pytest.approx(2 * np.array(wanted), abs=1e-11)


def test_its_slope_and_its_course(tmp_path: Path) -> None:
    """Small signals see the spline's slope, and a transient its values."""
    spline = CubicSpline(X, Y, bc_type="natural")
    rows = "".join(f"x[{k}] = {x}; y[{k}] = {y}; " for k, (x, y) in enumerate(zip(X, Y, strict=True)))
    module = (
        "module m(in, out); inout in, out; electrical in, out; real x[0:4], y[0:4];\n"
        f'analog begin {rows} V(out) <+ $table_model(V(in), x, y, "3L"); end\nendmodule\n'
    )
    deck = "V1 in 0 sin(0.7 1.2 1) dc 0.7 ac 1\nN1 in out n\nR1 out 0 1k\n.model n m\n.options reltol=1e-6\n.save v(out) v(in)\n"
    gain = run(tmp_path, module, deck + ".ac lin 1 1 1")["v(out)"][0]
    assert gain.real == pytest.approx(float(spline(0.7, 1)), rel=1e-9)
    course = run(tmp_path, module, deck + ".tran 5m 1")
    assert np.asarray(course["v(out)"]) == pytest.approx(spline(np.asarray(course["v(in)"])), abs=1e-6)


@pytest.mark.parametrize(
    ("call", "said"),
    [
        ('$table_model(V(in), x, y, "2L")', "splines of second order are not supported"),
        ('$table_model(V(in), x, y, "1Q")', "Q means nothing here"),
        ('$table_model(V(in), V(in), x, y, "1L,1L")', "2 inputs, and 2 columns"),
        ('$table_model(V(in), "nowhere.tbl", "1L")', "nowhere.tbl cannot be read"),
        ('$table_model(V(in), "words.tbl")', "words.tbl, line 2: two is no number"),
        ('$table_model(V(in), "twice.tbl")', "two values at 1"),
    ],
)
def test_tables_that_cannot_be(call: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "words.tbl").write_text("0 1\n1 two\n")
    (tmp_path / "twice.tbl").write_text("0 1\n1 2\n1 3\n")
    with pytest.raises(emsim.DeckError, match=said):
        swept(tmp_path, call)

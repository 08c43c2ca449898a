"""Numbers that no scale shows: an infinite row of db() or 1/v made the whole page read 0, and a row of 1e27 flattened every
curve without a word."""

from __future__ import annotations

import numpy as np
import pytest

import emsim
from emsim.outputs import html, picture, terminal
from emsim.outputs.panels import off_scale, panels
from emsim.result import Result
from emsim.store import Columns
from emsim.table import Table

T = np.linspace(0, 1, 201)


def result(y, name="v(out)") -> Result:
    table = Table(
        "tran",
        ["time", name, "v(b)"],
        ["s", "V", "V"],
        Columns([T.tobytes(), np.asarray(y, float).tobytes(), T.tobytes()]),
    )
    return Result("t", [table])


def test_a_zero_in_one_row_is_minus_infinity_in_decibel():
    r = result(T)
    assert r["db(v(out))"][0] == -np.inf and r["1/v(out)"][0] == np.inf
    (panel,) = panels(r.main, ["db(v(out))"])
    low, high = panel.scale
    assert low == pytest.approx(20 * np.log10(T[1]), abs=0.1) and high == 0
    assert panel.unseen == "db(v(out)): 1 row off the scale, -inf at 0 s"


def test_a_row_that_dwarfs_all_others_is_said_and_leaves_their_scale():
    y = np.sin(6 * T)
    y[77] = 1e27
    (panel,) = panels(result(y).main, ["v(out) v(b)"])
    assert panel.scale == pytest.approx((-1, 1), abs=0.05)
    assert "1e+27 at 0.385 s" in panel.unseen
    said = "\n".join(terminal.lines([panel], look=terminal.Look(100)))
    assert "off the scale" in said and "1e+27" in said
    (axis,) = picture.picture([panel]).axes
    assert axis.get_ylim()[1] < 2 and "off the scale" in axis.texts[0].get_text()


@pytest.mark.parametrize(
    "y", [np.sin(6 * T), 1e27 * np.sin(6 * T), np.zeros(201), np.where(T > 0.99, 1e3, 0.0), np.exp(30 * T)]
)
def test_what_has_a_scale_is_on_it(y):
    assert not off_scale(y).any()


def test_the_page_gets_what_is_there():
    y = np.array(T)
    y[3], y[4], y[5] = np.inf, 1e300, np.nan
    run = html.document(result(y))
    from base64 import b64decode
    from zlib import decompress

    planes = decompress(b64decode(run["packed"][0]))
    width = len(planes) // 201
    found = np.frombuffer(bytes(planes[k * 201 + i] for i in range(201) for k in range(width)), f"f{width}")
    assert width == 8  # float32 has no 1e300
    np.testing.assert_array_equal(found, y)


def test_expressions_are_columns_of_a_result():
    """r["deg(angle(hinge))"] was a KeyError where r.plot of it worked."""
    r = result(T, "angle(hinge)")
    assert "deg(angle(hinge))" in r and r.unit("deg(angle(hinge))") == "deg"
    np.testing.assert_allclose(r["deg(angle(hinge))"], np.degrees(T))
    assert r.at("deg(angle(hinge))", 0.5) == pytest.approx(np.degrees(0.5))
    assert "deg(angle(other))" not in r and "deg(" not in r
    with pytest.raises(KeyError):
        r["deg(angle(other))"]


def test_print_knows_the_functions_that_plot_knows():
    deck = "t\nV1 a 0 sin(0 1 1k)\nR1 a b 1k\nC1 b 0 1u\n.print tran db(v(a)) mag(v(a,b)) vdb(b) v(a)*2\n.tran 10u 1m\n.end\n"
    r = emsim.run(deck)
    assert r.prints[0][1] == ["db(v(a))", "mag(v(a,b))", "vdb(b)", "v(a)*2"]
    assert r["db(v(a))"][0] < -300 and r.units["db(v(a))"] == "dB"
    np.testing.assert_allclose(r["mag(v(a,b))"], abs(r["v(a)"] - r["v(b)"]))

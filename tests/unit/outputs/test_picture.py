"""Pictures by matplotlib: what is written in them, their colours, their formats."""

from __future__ import annotations

import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from emsim.outputs import picture
from emsim.outputs.panels import panels
from emsim.store import Columns
from emsim.table import Table

T = np.linspace(0, 2e-3, 400)


@pytest.fixture
def table():
    columns = [T, 0.005 * np.sin(5e3 * T), np.cos(5e3 * T), 0.02 * T / T[-1], np.pi * T / T[-1]]
    names, units = ["time", "v(out)", "v(in)", "i(v1)", "angle(hinge)"], ["s", "V", "V", "A", "rad"]
    return Table("tran", names, units, Columns(columns), title="a title")


def test_labels_units_and_scales(table):
    figure = picture.picture(panels(table, ["v(out) v(in) i(v1) angle(hinge)"], degrees=True), "a title")
    top, middle, bottom = figure.axes
    assert [a.get_ylabel() for a in figure.axes] == ["voltage [V]", "i(v1) [mA]", "angle(hinge) [deg]"]
    assert bottom.get_xlabel() == "time [ms]" and top.get_xlabel() == ""
    assert figure.get_suptitle() == "a title"
    assert [t.get_text() for t in top.get_legend().get_texts()] == ["v(out)", "v(in)"]
    assert middle.get_legend() is None
    (line,) = middle.lines
    assert line.get_xydata()[-1] == pytest.approx([2.0, 20.0])  # ms, mA
    assert bottom.lines[0].get_ydata()[-1] == pytest.approx(180)


def test_curves_of_a_panel_differ_in_colour_or_line():
    many = Table("tran", ["time", *(f"v({k})" for k in range(20))], ["s", *"V" * 20], Columns([T] * 21))
    (axis,) = picture.picture(panels(many, ["all"])).axes
    assert len({(line.get_color(), line.get_linestyle()) for line in axis.lines}) == 20


def luminances(colours):
    """Relative luminance as WCAG 2 has it."""
    rgb = np.array([[int(c[k : k + 2], 16) for k in (1, 3, 5)] for c in colours]) / 255
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    return linear


def test_colours_are_told_apart_without_red_or_green_cones():
    """Vienot, Brettel and Mollon (1999): linear RGB as protanopes and deuteranopes see it."""
    linear = luminances(picture.COLOURS[:4])
    for matrix in (
        [[0.11238, 0.88762, 0], [0.11238, 0.88762, 0], [0.00401, -0.00401, 1]],
        [[0.29275, 0.70725, 0], [0.29275, 0.70725, 0], [-0.02234, 0.02234, 1]],
    ):
        seen = linear @ np.array(matrix).T
        apart = [np.linalg.norm(a - b) for k, a in enumerate(seen) for b in seen[:k]]
        assert min(apart) > 0.08


def test_svg_is_text_and_the_same_every_time(table, tmp_path):
    found = panels(table, ["v(out) i(v1)"])
    for name in ("a.svg", "b.svg"):
        picture.write(str(tmp_path / name), found, "a title")
    text = (tmp_path / "a.svg").read_text()
    for word in ("v(out) [mV]", "i(v1) [mA]", "time [ms]", "a title"):
        assert f">{word}</text>" in text
    assert text == (tmp_path / "b.svg").read_text()


@pytest.mark.parametrize("width", [400, 1080])
def test_a_png_is_as_wide_as_asked_for(table, tmp_path, width):
    path = tmp_path / "a.png"
    picture.write(str(path), panels(table, ["v(out)"]), width=width)
    data = path.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n" and abs(struct.unpack(">I", data[16:20])[0] - width) <= 1


def test_a_million_points_make_a_small_svg(tmp_path):
    x = np.linspace(0, 1, 1_000_000)
    long = Table("tran", ["time", "v(a)"], ["s", "V"], Columns([x, np.sin(1e4 * x)]))
    picture.write(str(tmp_path / "a.svg"), panels(long, ["v(a)"]))
    assert (tmp_path / "a.svg").stat().st_size < 300_000


def test_curves_are_where_the_numbers_are(tmp_path):
    """The pixels of a rising line: its colour below left and above right, not in the other corners."""
    from PIL import Image

    line = Table("tran", ["time", "v(a)"], ["s", "V"], Columns([[0.0, 1.0], [0.0, 1.0]]))
    picture.write(str(tmp_path / "a.png"), panels(line, ["v(a)"]))
    pixels = np.asarray(Image.open(tmp_path / "a.png").convert("RGB")).astype(int)
    ink = tuple(int(picture.COLOURS[0][k : k + 2], 16) for k in (1, 3, 5))
    ys, xs = np.nonzero(np.abs(pixels - ink).sum(axis=2) < 30)
    assert np.corrcoef(xs, ys)[0, 1] < -0.99


def test_rounding_is_not_blown_up():
    flat = Table("tran", ["time", "v(a)"], ["s", "V"], Columns([[0.0, 1.0], [5.0, 5.000001]]))
    low, high = picture.picture(panels(flat, ["v(a)"])).axes[0].get_ylim()
    assert low < 4.6 and high > 5.4


def test_a_path_keeps_its_shape(tmp_path):
    turn = np.linspace(0, 2 * np.pi, 300)
    columns = Columns([turn, 0.02 * np.cos(turn), 0.02 * np.sin(turn)])
    circle = Table("tran", ["time", "x(a)", "y(a)"], ["s", "m", "m"], columns)
    figure = picture.picture(panels(circle, ["y(a) vs x(a)"]))
    figure.savefig(tmp_path / "a.png")
    (axis,) = figure.axes
    across, up = np.diff(axis.transData.transform([(-20, -20), (20, 20)]), axis=0)[0]
    assert across == pytest.approx(up, rel=1e-3) and axis.get_xlabel() == "x(a) [mm]"


def test_without_matplotlib_it_is_said_what_to_install():
    code = (
        "import sys; sys.modules['matplotlib'] = None\n"
        "from emsim.diagnostics import OutsideError\n"
        "try: import emsim.outputs.picture\n"
        "except OutsideError as error: print(error)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "E521" in done.stdout and "matplotlib" in done.stdout and "emsim[plot]" in done.stdout


def test_without_numpy_a_chart_says_so():
    code = (
        "import sys; sys.modules['numpy'] = None\n"
        "from emsim.cli import main\n"
        "sys.exit(main(['chart', 'netlists/bench/rc_pulses.cir']))\n"
    )
    root = Path(__file__).resolve().parents[3]
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=root)
    assert done.returncode == 5 and "E521" in done.stderr and "pip install numpy" in done.stderr

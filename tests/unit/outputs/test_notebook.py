"""What a notebook shows of results, tables, equations and errors, asked as IPython asks for it."""

from __future__ import annotations

import json
import re
import sys
from html import unescape
from types import ModuleType

import numpy as np
import pytest
from IPython.core.formatters import DisplayFormatter
from IPython.core.interactiveshell import InteractiveShell

import emsim
from emsim import tabular
from emsim.outputs import html, notebook
from emsim.result import Result
from emsim.store import Columns, Scene
from emsim.table import Table

ARM = (
    "arm <b>on</b> a pin\n.gravity 9.81\nBODY arm shape=rod(0.3) m=0.2\nJOINT hinge 0 arm pin zero=-90deg ic=60deg\n"
    "R1 a 0 1k\nV1 a 0 5m\n.tran 10m 1\n.end\n"
)


@pytest.fixture(scope="module")
def arm():
    return emsim.run(ARM, scene=True)


def page_in(text):
    """The page inside the frame."""
    return unescape(re.search(r'srcdoc="([^"]*)"', text)[1])


def cells(text, name):
    """The cells of a signal's line."""
    (row,) = [r for r in re.findall(r"<tr>(.*?)</tr>", text) if re.search(rf">{re.escape(name)}<", r)]
    return re.findall(r"<td[^>]*>([^<]*)</td>", row)


def test_a_result_is_a_table_and_the_page(arm):
    text = arm._repr_html_()
    assert cells(text, "angle(hinge)")[-2:] == [f"{arm['angle(hinge)'][-1]:.5g}", "rad"]
    assert cells(text, "v(a)") == ["v(a)", "5", "5", "5", "mV"]
    assert "<b>on</b>" not in text and "arm &lt;b&gt;on" in text
    page = page_in(text)
    assert page == html.page(html.document(arm, ARM))
    run = json.loads(re.search(r'<script id="run"[^>]*>(.*?)</script>', page, re.S)[1])
    assert run["rows"] == len(arm) and run["scene"]["bodies"][1]["name"] == "arm"
    assert any(name == "deck" and "JOINT hinge" in inner for name, _, inner in run["sheets"])


def test_the_frame_may_run_scripts_and_nothing_else(arm):
    assert re.findall(r'sandbox="([^"]*)"', arm._repr_html_()) == ["allow-scripts"]


def test_ipython_is_given_text_and_html_and_a_picture_on_request(arm):
    data, _ = DisplayFormatter().format(arm)
    assert set(data) == {"text/plain", "text/html"} and data["text/plain"] == repr(arm)
    data, _ = DisplayFormatter().format(arm, include={"image/png"})
    assert set(data) == {"image/png"} and bytes(data["image/png"]).startswith(b"\x89PNG")
    data, _ = DisplayFormatter().format(arm, exclude={"text/html"})
    assert set(data) == {"text/plain"}


def test_a_plot_is_a_figure_that_shows_itself_once(arm):
    from matplotlib.figure import Figure

    figure = arm.plot("v(a) 2*v(a)", "omega(hinge) vs angle(hinge)")
    assert isinstance(figure, Figure)
    top, bottom = figure.axes
    assert (top.get_ylabel(), bottom.get_xlabel()) == ("voltage [mV]", "angle(hinge) [deg]")
    assert bottom.get_ylabel() == "omega(hinge) [deg/s]"
    data, _ = DisplayFormatter().format(figure)
    assert bytes(data["image/png"]).startswith(b"\x89PNG")
    (axis,) = arm.plot("angle(hinge)", degrees=False, start=0.25, stop=0.5).axes
    assert axis.get_ylabel() == "angle(hinge) [rad]"
    assert axis.lines[0].get_xdata()[[0, -1]] == pytest.approx([250, 500])  # ms


def test_a_plot_of_nothing_in_particular_takes_what_print_asks_for():
    result = emsim.run(ARM.replace(".end", ".print tran v(a)\n.end"))
    assert [a.get_ylabel() for a in result.plot().axes] == ["v(a) [mV]"]


def test_in_a_notebook_the_machine_is_recorded(monkeypatch):
    assert emsim.run(ARM).main.scene is None
    monkeypatch.setitem(sys.modules, "ipykernel", ModuleType("ipykernel"))
    assert emsim.run(ARM).main.scene is not None
    assert emsim.run(ARM, scene=False).main.scene is None


def test_a_point_is_a_table_of_values():
    text = emsim.run("op\nV1 a 0 5\nR1 a 0 1k\n.op\n.end\n")._repr_html_()
    assert cells(text, "v(a)") == ["v(a)", "5", "V"] and cells(text, "i(v1)") == ["i(v1)", "-5", "mA"]
    assert "<iframe" not in text


def test_nothing_ran():
    assert "nothing ran" in Result("silence", [])._repr_html_()


def test_an_unfinished_run_says_so():
    t = Table("tran", ["time"], ["s"], Columns([[0.0, 1.0]]), status="interrupted")
    assert "(interrupted)" in t._repr_html_()


def test_many_signals_are_folded_away():
    names = ["time", *(f"v({k})" for k in range(30))]
    t = Table("tran", names, ["s", *"V" * 30], Columns([[0.0, 1.0]] * 31))
    text = t._repr_html_()
    assert f"<summary>{31 - tabular.LISTED} more</summary>" in text and cells(text, "v(29)")[2] == "1"


def test_rounding_noise_is_nothing():
    t = Table("tran", ["time", "x(a)"], ["s", "m"], Columns([[0.0, 1.0], [-1e-18, 2.0]]))
    assert cells(t._repr_html_(), "x(a)") == ["x(a)", "0", "2", "2", "m"]


@pytest.fixture
def long():
    n = 300_000
    x = np.linspace(0, 1, n)
    y = np.sin(40 * x)
    y[123_456], y[200_000] = 9.0, -9.0
    scene = Scene({"bodies": []}, Columns([x.tobytes(), (2 * x).tobytes()]))
    columns = Columns([x.tobytes(), y.tobytes(), np.cos(x).tobytes()])
    main = Table("tran", ["time", "v(a)", "v(b)"], ["s", "V", "V"], columns, scene=scene)
    return Result("long", [main])


def test_a_long_run_is_thinned_and_keeps_its_extremes(long):
    short = notebook.thinned(long, 30_000)
    main = short.main
    assert len(main) > 1000 and len(main) * 3 <= 30_000
    assert np.all(np.diff(main.time) > 0) and main.time[[0, -1]].tolist() == [0, 1]
    assert (main["v(a)"].min(), main["v(a)"].max()) == (-9, 9)
    # every row is one of the run's, and the drawing has the same rows
    rows = np.searchsorted(long.time, main.time)
    assert np.array_equal(long["v(a)"][rows], main["v(a)"])
    assert np.array_equal(np.frombuffer(main.scene.waves.column(1)), 2 * main.time)


def test_what_is_short_stays_as_it_is(arm):
    assert notebook.thinned(arm) is arm


def test_the_notebook_says_what_it_left_out(long):
    long.main.scene = None
    text = long._repr_html_()
    assert re.search(r"shows \d+ of 300000 points", text) and len(text) < 3_000_000


def test_a_page_is_saved_by_its_extension(arm, tmp_path):
    arm.save(tmp_path / "a.html")
    assert (tmp_path / "a.html").read_text() == html.page(html.document(arm, ARM))


def test_equations_are_a_table():
    text = emsim.compile(ARM)._repr_html_()
    assert cells(text, "angle(hinge)") == ["angle(hinge)", "coordinate", "rad", "dQ/dt + F = 0"]
    assert cells(text, "a")[-1] == "F = 0"


# ---- errors ---------------------------------------------------------------------------------------

SERVO = "servo\nBODY arm shape=rod(0.3) m=0.2\nJOINT hinge 0 arm pin\nSPRING s1 hnge k=1\n.tran 1m 1\n"
WRONG = f'import emsim\nemsim.run("""{SERVO}""")'


@pytest.fixture
def shell(monkeypatch):
    monkeypatch.setenv("NO_COLOR", "1")
    yield InteractiveShell.instance()
    InteractiveShell.clear_instance()


def test_a_wrong_deck_is_shown_with_its_caret_and_without_frames_of_emsim(shell, capsys):
    result = shell.run_cell(WRONG)
    assert isinstance(result.error_in_exec, emsim.DeckError)
    said = capsys.readouterr().out
    assert "DeckError in line 2: emsim.run(" in said
    assert " | SPRING s1 hnge k=1\n   |           ^^^^\n" in said and "did you mean hinge?" in said
    assert "pipeline.py" not in said and "Traceback" not in said


def test_messages_are_coloured_where_colour_is_wanted(shell, capsys, monkeypatch):
    monkeypatch.delenv("NO_COLOR")
    shell.run_cell(WRONG)
    assert "\033[1;31merror" in capsys.readouterr().out


def test_an_error_as_a_value_is_set_in_its_own_type():
    with pytest.raises(emsim.DeckError) as caught:
        emsim.run("x\nR1 a 0 <b>\n.op\n")
    text = caught.value._repr_html_()
    assert text.startswith("<pre>") and "&lt;b&gt;" in text and "^" in text

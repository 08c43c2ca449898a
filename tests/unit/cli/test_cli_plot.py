"""emsim run --plot, --gif and emsim plot: pictures, plots in the terminal, films, messages."""

from __future__ import annotations

import json
import os
import pty
import subprocess
import sys

import pytest

from emsim.cli import main
from emsim.outputs import load

RC = (
    "rc\nV1 in 0 PULSE(0 1 0 1n 1n 1 2)\nR1 in out {r}\nC1 out 0 1u\n.param r=1k\n.tran 0.1m 5m\n"
    ".save v(out)\n.print tran v(out)\n.end\n"
)
ARM = (
    "arm\n.gravity 9.81\nBODY arm shape=rod(0.3) m=0.2\nJOINT hinge 0 arm pin zero=-90deg ic=10deg\n"
    ".tran 10m 1\n.end\n"
)


@pytest.fixture(autouse=True)
def decks(scratch):
    (scratch / "rc.cir").write_text(RC)
    (scratch / "arm.cir").write_text(ARM)
    (scratch / "op.cir").write_text("op\nV1 a 0 5\nR1 a 0 1k\n.op\n.end\n")
    return scratch


def test_a_plot_in_the_terminal_stands_in_place_of_the_tables(capsys):
    assert main(["rc.cir", "--plot", "v(out) v(in)-v(out)"]) == 0
    said = capsys.readouterr().out
    assert "* v(out)  o v(in)-v(out)  [V]" in said and "time [ms]" in said and "Index" not in said


def test_what_is_drawn_is_recorded_whatever_save_says(decks):
    assert main(["rc.cir", "-q", "--plot", "i(r1)*r v(in,out)"]) == 0
    assert load("rc.raw").names == ["time", "v(out)", "i(r1)*r", "v(in,out)"]


def test_pictures_are_written_and_named(decks, capsys):
    code = main(
        ["rc.cir", "--plot", "v(out)", "--plot", "i(v1)", "--plot-file", "a.svg", "--plot-file", "b.png"]
    )
    said = capsys.readouterr()
    assert code == 0 and "-> rc.raw, a.svg, b.png" in said.err and "Index" in said.out
    text = (decks / "a.svg").read_text()
    assert "v(out) [V]" in text or "v(out) [mV]" in text
    assert "time [ms]" in text and "<!-- rc -->" not in text and ">rc</text>" in text
    assert (decks / "b.png").read_bytes().startswith(b"\x89PNG")


def test_json_names_the_picture(capsys):
    assert main(["rc.cir", "--no-files", "--json", "--plot", "v(out)", "--plot-file", "a.svg"]) == 0
    assert json.loads(capsys.readouterr().out)["files"] == ["a.svg"]


def test_without_signals_what_print_asks_for(capsys):
    assert main(["rc.cir", "--plot-file", "-"]) == 0
    assert "v(out)  [V]" in capsys.readouterr().out


def test_angles_are_in_degrees_where_the_deck_writes_degrees(capsys):
    assert main(["arm.cir", "--plot", "omega(hinge) vs angle(hinge)", "--width", "60"]) == 0
    said = capsys.readouterr().out
    assert "omega(hinge)  [deg/s]" in said and "angle(hinge) [deg]" in said
    assert max(map(len, said.splitlines())) <= 60


def test_a_part_of_the_run(capsys):
    assert main(["rc.cir", "--plot", "v(out)", "--from", "1m", "--to", "2ms", "--width", "80"]) == 0
    axis = capsys.readouterr().out.splitlines()[-2].split()
    assert (axis[0], axis[-1]) == ("1", "2")


def test_a_raw_file_is_drawn(decks, capsys):
    assert main(["-q", "rc.cir"]) == 0
    capsys.readouterr()
    assert main(["plot", "rc.raw", "1-out", "v(out)"]) == 0
    assert "1-out" in (said := capsys.readouterr().out) and "v(out)  [V]" in said
    assert main(["plot", "rc.raw", "-o", "c.pdf"]) == 0
    said = capsys.readouterr()
    assert said.out == "" and "-> c.pdf" in said.err
    assert (decks / "c.pdf").read_bytes().startswith(b"%PDF")


@pytest.mark.parametrize(
    ("args", "code", "said"),
    [
        (["rc.cir", "--plot", "v(oot)"], 2, "--> --plot:1:3"),
        (["rc.cir", "--plot", "v(out"], 2, "never closed"),
        (["rc.cir", "--plot", "v(out) vs"], 2, "omega(hinge) vs angle(hinge)"),
        (["rc.cir", "--plot", "out.png"], 2, "the file goes to --plot-file"),
        (["rc.cir", "--plot", " "], 2, "no signals"),
        (["rc.cir", "--plot-file", "out.gif"], 2, "a picture is one of .png, .svg, .pdf"),
        (["rc.cir", "--plot-file", "no/out.png"], 5, "there is no folder no"),
        (["rc.cir", "--plot", "v(out)", "--csv", "-"], 2, "draws on stdout"),
        (["rc.cir", "--plot", "v(out)", "--width", "3"], 2, "--width"),
        (["rc.cir", "--plot", "v(out)", "--from", "soon"], 2, "--from: 'soon' is not a number"),
        (["rc.cir", "--plot", "v(out)", "--from", "9"], 1, "time goes from 0 s to 0.005 s"),
        (
            ["rc.cir", "--from", "1m"],
            2,
            "--from is for what is drawn: --plot SIGNALS, --gif FILE, --frame FILE",
        ),
        (["rc.cir", "--width", "80", "--html", "a.html"], 2, "--width is for what is drawn"),
        (
            ["arm.cir", "--frame", "a.png", "--to", "1"],
            2,
            "--to is for what is drawn: --plot SIGNALS, --gif FILE",
        ),
        (["op.cir", "--plot", "v(a)"], 1, "E349"),
        (["plot"], 2, "emsim plot needs a result"),
        (["plot", "rc.cir", "v(out)"], 2, 'emsim rc.cir --plot "v(out)"'),
        (["plot", "none.raw"], 5, "none.raw"),
    ],
)
def test_what_is_wrong_is_said(args, code, said, capsys):
    assert main(args) == code
    assert said in capsys.readouterr().err


def test_a_wrong_signal_of_a_file_is_shown_with_the_nearest(capsys):
    main(["-q", "rc.cir"])
    assert main(["plot", "rc.raw", "v(out)+v(uot)"]) == 2
    said = capsys.readouterr().err
    assert "v(out)+v(uot)\n   |        ^^^^^^" in said and "did you mean `v(out)`" in said


def test_a_wrong_signal_costs_no_run(decks):
    assert main(["rc.cir", "--plot", "v(out) vs"]) == 2
    assert not (decks / "rc.raw").exists()


def test_nothing_to_draw_loses_no_results(decks, capsys):
    assert main(["op.cir", "--plot-file", "a.png"]) == 1
    assert (decks / "op.raw").exists() and not (decks / "a.png").exists()
    assert "-> op.raw\n" in capsys.readouterr().err


def test_the_machine_is_filmed(decks, capsys):
    from PIL import Image

    args = [
        "arm.cir",
        "--gif",
        "a.gif",
        "--frame",
        "b.png",
        "--duration",
        "2",
        "--fps",
        "10",
        "--width",
        "300",
    ]
    assert main([*args, "--trace", "arm.com", "--to", "0.5"]) == 0
    assert "-> arm.raw, a.gif, b.png" in capsys.readouterr().err
    film, frame = Image.open(decks / "a.gif"), Image.open(decks / "b.png")
    assert (film.n_frames, film.width, frame.width) == (21, 300, 300)


@pytest.mark.parametrize(
    ("args", "code", "said"),
    [
        (["arm.cir", "--gif", "a.png"], 2, "the file ends in .gif"),
        (["arm.cir", "--frame", "a.gif"], 2, "the file ends in .png"),
        (["arm.cir", "--gif", "a.gif", "--speed", "1", "--duration", "2"], 2, "give one"),
        (["arm.cir", "--gif", "a.gif", "--fps", "many"], 2, "--fps"),
        (["arm.cir", "--gif", "no/a.gif"], 5, "there is no folder no"),
        (["arm.cir", "--gif", "a.gif", "--trace", "tip"], 1, "there are arm.com"),
        (["arm.cir", "--gif", "a.gif", "--speed", "1u"], 1, "E355"),
        (["arm.cir", "--frame", "a.png", "--from", "9"], 1, "nothing to draw at 9 s"),
        (["rc.cir", "--gif", "a.gif"], 1, "there is no machine to draw"),
        (["rc.cir", "--frame", "a.png"], 1, "E354"),
    ],
)
def test_what_is_wrong_with_a_film_is_said(args, code, said, capsys):
    assert main(args) == code
    assert said in capsys.readouterr().err


def test_on_a_terminal_in_colour(decks):
    parent, child = pty.openpty()
    environment = {**os.environ, "TERM": "xterm-256color", "COLUMNS": "70", "LC_ALL": "C.UTF-8"}
    environment.pop("NO_COLOR", None)
    command = [sys.executable, "-m", "emsim", "rc.cir", "-q", "--plot", "v(out) v(in)"]
    with subprocess.Popen(command, stdout=child, stderr=subprocess.DEVNULL, env=environment) as process:
        os.close(child)
        said = b""
        try:
            while piece := os.read(parent, 65536):
                said += piece
        except OSError:  # the other end is closed
            pass
    os.close(parent)
    assert process.returncode == 0
    text = said.decode()
    assert "\033[38;5;32mv(out)\033[0m" in text and any("\u2800" < c <= "\u28ff" for c in text)


def test_a_run_without_pictures_loads_nothing_for_them():
    code = (
        "import sys\nfrom emsim.cli import main\nassert main(['-q', 'rc.cir', '--no-files']) == 0\n"
        "print([m for m in sys.modules if m in ('numpy', 'matplotlib', 'shutil', 're')])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.endswith("[]\n")

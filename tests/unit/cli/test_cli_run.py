"""`emsim run` as a person uses it: files, streams, exit codes. Each test runs the program itself."""

from __future__ import annotations

import json
import os
import pty
import select
import signal
import subprocess
import sys

import numpy as np
import pytest

from emsim.outputs import raw

RC = "rc\nV1 in 0 PULSE(0 1 0 1n 1n 1 2)\nR1 in out {r}\nC1 out 0 1u\n.param r=1k\n.tran 0.1m 5m\n.end\n"
PRINT = RC.replace(".end", ".print tran v(out) i(v1)\n.end")
LONG = "long\nV1 in 0 SIN(0 1 1meg)\nR1 in out 1k\nC1 out 0 1n\nD1 out 0 dm\n.model dm D\n.tran 1u 10 0 20n\n.end\n"
# v(b)^2 + v(b) + v(a) = 0 has no real solution once v(a) is above 1/4, which is at t = 1.25 ms
STUCK = (
    "stuck\nV1 a 0 PULSE(0 1 1m 1m 1m 1 2)\nR1 a 0 1\n"
    "B1 b 0 I={v(a)+v(b)*v(b)}\nR2 b 0 1\n.tran 10u 5m\n.end\n"
)


def emsim(*args, stdin="", **more):
    return subprocess.run(
        [sys.executable, "-m", "emsim", *args],
        input=stdin,
        capture_output=True,
        text=True,
        timeout=60,
        **more,
    )


@pytest.fixture(autouse=True)
def decks(scratch):
    for name, text in {"rc": RC, "print": PRINT, "long": LONG, "stuck": STUCK}.items():
        (scratch / f"{name}.cir").write_text(text)
    return scratch


def started(*args, **more):
    """The program as a child that can be interrupted, even where the parent runs in the background."""
    listen = lambda: signal.signal(signal.SIGINT, signal.SIG_DFL)  # noqa: E731
    return subprocess.Popen([sys.executable, "-m", "emsim", *args], preexec_fn=listen, **more)


def begun(*args):
    """(process, terminal) of a run that goes on: its line of progress has said so."""
    terminal, end = pty.openpty()
    process = started(*args, stdout=subprocess.PIPE, stderr=end, text=True)
    os.close(end)
    said = b""
    while b" steps " not in said:
        ready, _, _ = select.select([terminal], [], [], 60)
        assert ready, f"no progress: {said!r}"
        said += os.read(terminal, 100_000)
    return process, terminal, said.decode()


def everything(terminal):
    """What was written to a terminal that nobody writes to any more; one read may give a part of it."""
    parts = []
    try:
        while part := os.read(terminal, 100_000):
            parts.append(part)
    except OSError:  # that is its end
        pass
    os.close(terminal)
    return b"".join(parts).decode()


def final(path):
    return raw.read(str(path))["v(out)"][-1]


def test_a_deck_alone_is_run_and_writes_its_raw_file_here(decks):
    (decks / "elsewhere").mkdir()
    done = emsim("../rc.cir", cwd=decks / "elsewhere")
    assert done.returncode == 0 and done.stdout == "" and "-> rc.raw" in done.stderr
    assert os.listdir(decks / "elsewhere") == ["rc.raw"]
    assert final(decks / "elsewhere" / "rc.raw") == pytest.approx(1 - np.exp(-5), abs=1e-3)


def test_print_tables_go_to_stdout_and_notes_to_stderr():
    done = emsim("run", "print.cir")
    rows = [line.split() for line in done.stdout.splitlines() if line[:1].isdigit()]
    assert len(rows) == 51 and [float(w) for w in rows[-1][:2]] == [50, 5e-3]
    assert float(rows[-1][2]) == pytest.approx(1 - np.exp(-5), abs=1e-3)
    assert done.stderr.startswith("tran: ") and len(done.stderr.splitlines()) == 1


def test_quiet_says_nothing(decks):
    done = emsim("--quiet", "rc.cir")
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


@pytest.mark.parametrize("args", [["-o", "x.raw"], ["-b", "-r", "x.raw"], ["--output=x.raw", "--ascii"]])
def test_where_the_raw_file_goes(decks, args):
    assert emsim(*args, "rc.cir").returncode == 0
    assert not (decks / "rc.raw").exists() and final(decks / "x.raw") > 0.99
    assert (b"Values:" in (decks / "x.raw").read_bytes()) == ("--ascii" in args)


def test_tables_stand_in_the_file_that_r_names(decks):
    # as under ngspice -b -r; where the file cannot be written, on stdout
    assert "Index   time" in emsim("print.cir").stdout
    done = emsim("print.cir", "-r", "x.raw")
    assert done.returncode == 0 and done.stdout == "" and final(decks / "x.raw") > 0.99
    assert "Index   time" in emsim("print.cir", "-r", "/dev/full").stdout


def test_a_machine_s_page_beside_its_small_signals(decks):
    """The columns of its `.ac` are made in Python where the machine is drawn: its raw file ended in E499."""
    card = (
        "BODY m m=1\nJOINT j 0 m slide\nSPRING s j k=100\nV1 a 0 DC 0 AC 1\nR1 a 0 1\nFORCE f m fx={v(a)}\n"
    )
    (decks / "swing.cir").write_text(f"swing\n{card}.tran 10m 0.1\n.ac lin 5 1 2\n.save pos(j)\n.end\n")
    done = emsim("-q", "swing.cir", "--html", "page.html")
    assert (done.returncode, done.stderr) == (0, "")
    assert [t.kind for t in raw.read("swing.raw").plots] == ["tran", "ac"]


def test_no_files_and_csv(decks):
    assert emsim("--no-files", "--csv", "x.csv", "rc.cir").returncode == 0
    assert not (decks / "rc.raw").exists()
    lines = (decks / "x.csv").read_text().splitlines()
    assert lines[0].startswith("time,v(in),v(out)") and lines[-1].startswith("0.005,")


def test_energy_is_told_without_print_too():
    deck = "RC\nV1 a 0 1\nR1 a b 1k\nC1 b 0 1u\n.tran 10u 5m uic\n.end\n"
    done = emsim("-", "--energy", "--no-files", stdin=deck)
    assert done.returncode == 0 and done.stdout.strip().startswith("energy [J]") and "\nR " in done.stdout


def test_stdin(decks):
    assert emsim("-", stdin=RC).returncode == 0
    assert final(decks / "stdin.raw") > 0.99


def test_defines_stand_above_param(decks):
    assert emsim("-D", "r=10k", "rc.cir").returncode == 0
    assert final(decks / "rc.raw") == pytest.approx(1 - np.exp(-0.5), abs=1e-3)


def test_method_and_tolerance_reach_the_integrator(decks):
    def error(*args):
        assert emsim(*args, "rc.cir").returncode == 0
        result = raw.read(str(decks / "rc.raw"))
        t = result.time[result.time > 1e-6]
        return abs(result["v(out)"][result.time > 1e-6] - (1 - np.exp(-(t - 0.5e-9) / 1e-3))).max()

    loose, tight = error("--method", "trap"), error("--method", "radau", "--reltol", "1e-9")
    assert tight < 1e-8 < loose < 1e-2
    assert error("--method", "trap", "--tmax", "1u") < loose / 10


def test_json_is_one_document(decks):
    done = emsim("--json", "print.cir")
    document = json.loads(done.stdout)
    assert document["status"] == "ok" and document["exit_code"] == 0 and document["files"] == ["print.raw"]
    (analysis,) = document["analyses"]
    assert analysis["kind"] == "tran" and analysis["signals"][0] == "time" and analysis["units"][0] == "s"
    assert document["statistics"]["tran"]["steps"] > 10 and document["diagnostics"] == []


def test_json_of_a_wrong_deck():
    done = emsim("--json", "-", stdin="bad\nC1 a 0\n.end\n")
    document = json.loads(done.stdout)
    assert done.returncode == document["exit_code"] == 1 and document["status"] == "deck error"
    (error,) = [d for d in document["diagnostics"] if d["severity"] == "error"]
    assert error["span"]["line"] == 2 and "C1" in done.stderr


@pytest.mark.parametrize(
    ("args", "code", "says"),
    [
        ([], 2, "no deck"),
        (["nofile.cir"], 5, "nofile.cir"),
        (["--retol", "1", "rc.cir"], 2, "did you mean --reltol"),
        (["chekc", "rc.cir"], 2, "did you mean emsim check rc.cir"),
        (["rc.cir", "print.cir"], 2, "one deck at a time"),
        (["--reltol", "zero", "rc.cir"], 2, "not a positive number"),
        (["--method", "euler", "rc.cir"], 2, "trap, gear, radau"),
        (["-o", "nowhere/x.raw", "rc.cir"], 5, "nowhere"),
        (["-o", "rc.cir", "rc.cir"], 2, "is the deck"),
        (["--trace", "arm.com", "rc.cir"], 2, "--trace is for a film"),
        (["-o", "-", "rc.cir"], 2, "needs the name of a file"),
        (["-o", "x.csv", "rc.cir"], 2, "x.csv is not one by its name: --csv FILE"),
        (["-o", "x.raw", "--csv", "./x.raw", "rc.cir"], 2, "written twice"),
        (["--no-files", "-o", "x.raw", "rc.cir"], 2, "contradict"),
        (["help", "rum"], 2, "did you mean run"),
        (["."], 5, "directory"),
    ],
)
def test_mistakes_on_the_command_line(decks, args, code, says):
    done = emsim(*args)
    assert done.returncode == code and says in done.stderr and "Traceback" not in done.stderr, done.stderr
    assert done.stdout == "" and (decks / "rc.cir").read_text() == RC and not list(decks.glob("*.raw"))


def test_no_convergence_keeps_what_was_computed(decks):
    done = emsim("--json", "stuck.cir")
    document = json.loads(done.stdout)
    assert done.returncode == 3 and document["status"] == "no convergence", done.stderr
    result = raw.read(str(decks / "stuck.raw"))
    assert 1.2e-3 < result.time[-1] < 1.2501e-3
    assert "stuck.cir:4" in done.stderr and document["analyses"][0]["status"] == "failed"


def test_interrupt_keeps_what_was_computed(decks):
    process, terminal, _ = begun("--json", "--tmax", "20n", "long.cir")
    process.send_signal(signal.SIGINT)
    out, _ = process.communicate(timeout=20)
    assert process.returncode == 130 and "Traceback" not in everything(terminal)
    assert json.loads(out)["status"] == "interrupted"
    assert raw.read(str(decks / "long.raw")).time[-1] > 0


def test_progress_line_on_a_terminal_only(decks):
    process, terminal, said = begun("--no-files", "--tmax", "20n", "long.cir")
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=20)
    said += everything(terminal)
    assert "s/10s  step " in said and " steps  ETA " in said and "events 0" in said
    # wiped before the summary
    assert said.rsplit("\r", 3)[1].strip() == "" or "\r" + " " * 20 in said


def test_a_reader_that_leaves_is_no_error():
    done = subprocess.run(
        [
            "bash",
            "-c",
            f"set -o pipefail; {sys.executable} -m emsim print.cir --tmax 100n 2>err | head -1 >/dev/null",
        ]
    )
    assert done.returncode == 0 and "Broken" not in open("err").read()  # noqa: SIM115


def test_internal_errors_are_reported_without_a_traceback():
    code = (
        "import sys; from emsim import cli, pipeline\n"
        "def run(*a, **k): raise ZeroDivisionError('oops')\n"
        "pipeline.run = run\nsys.exit(cli.main(['--json', 'rc.cir']))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 70 and "E499" in done.stderr and "please report" in done.stderr
    assert "Traceback" not in done.stderr and json.loads(done.stdout)["status"] == "internal error"


def test_help_of_every_verb():
    overview = emsim("--help").stdout
    for verb in ("run", "check", "compare"):
        assert f"\n  {verb} " in overview
        text = emsim(verb, "--help").stdout
        assert text.startswith(f"usage: emsim {verb}") and text == emsim("help", verb).stdout
    version = emsim("--version").stdout
    assert version == emsim("version").stdout == emsim("-V").stdout
    first, engine, python = version.splitlines()
    assert first == "emsim 0.1.0" and python.startswith(f"Python {sys.version.split()[0]} ")
    assert engine.startswith("engine: ") and "code" in engine


def test_an_interrupted_run_prints_only_its_last_rows(decks):
    (decks / "long.cir").write_text(LONG.replace(".end", ".print tran v(out)\n.end"))
    process, terminal, _ = begun("--no-files", "--tmax", "20n", "long.cir")
    process.send_signal(signal.SIGINT)
    out, _ = process.communicate(timeout=20)
    everything(terminal)
    rows = [line for line in out.splitlines() if line[:1].isdigit()]
    assert process.returncode == 130 and len(rows) == 20 and "rows before these" in out


def test_csv_to_stdout(decks):
    done = emsim("--no-files", "--csv", "-", "print.cir")
    lines = done.stdout.splitlines()
    assert done.returncode == 0 and lines[0] == "time,v(in),v(out),i(v1)" and lines[-1].startswith("0.005,")
    assert not (decks / "-").exists() and emsim("--csv", "-", "--json", "rc.cir").returncode == 2


def test_json_of_a_wrong_command_line():
    done = emsim("--json", "--retol", "1", "rc.cir")
    document = json.loads(done.stdout)
    assert done.returncode == document["exit_code"] == 2 and document["status"] == "usage error"
    assert "--reltol" in document["diagnostics"][0]["message"]


def test_a_word_that_is_neither_verb_nor_deck():
    said = emsim("frob", "rc.cir").stderr
    assert "there is no verb and no deck `frob`" in said and "compare" in said


def test_a_define_of_a_deck_without_parameters(decks):
    (decks / "plain.cir").write_text("plain\nV1 a 0 1\nR1 a 0 1\n.op\n.end\n")
    said = emsim("--no-files", "-D", "nope=1", "plain.cir").stderr
    assert "W126" in said and "the deck has no .param" in said and "parameters:" not in said


def shell(command):
    """A line of sh, with `emsim` for the program."""
    line = command.replace("emsim ", f"{sys.executable} -m emsim ")
    return subprocess.run(["sh", "-c", line], capture_output=True, text=True, timeout=60)


@pytest.mark.parametrize(
    ("command", "code"),
    [
        ("emsim print.cir --json > /dev/full", 5),
        ("emsim wrong.cir --json > /dev/full", 1),
        ("emsim wrong.cir --jsn --json > /dev/full", 2),
        ("emsim print.cir >&-", 0),
        ("emsim print.cir --json >&-", 0),
        ("emsim wrong.cir 2>&-", 1),
        ("emsim - <&-", 5),
        ("emsim fmt - <&-", 5),
    ],
)
def test_streams_that_are_full_or_closed(decks, command, code):
    (decks / "wrong.cir").write_text("wrong\nC1 a 0\n.end\n")
    done = shell(command)
    assert done.returncode == code, done.stderr
    assert "Traceback" not in done.stderr and "E499" not in done.stderr


def test_stdin_is_decoded_as_a_file_is(decks):
    for encoding in ("utf-16", "latin-1", "utf-8-sig"):
        (decks / "d.cir").write_bytes(RC.replace("rc\n", "10 \xb5s\n").encode(encoding))
        assert shell("emsim - --csv - < d.cir").stdout == shell("emsim d.cir --csv - ").stdout != ""
    (decks / "d.cir").write_bytes(b"\0\1\2\n")
    for verb in ("run", "fmt"):
        done = shell(f"emsim {verb} - < d.cir")
        assert done.returncode == 1 and "E100" in done.stderr


def test_a_deck_without_an_analysis_says_so_even_where_notes_are_not_wanted(decks):
    (decks / "d.cir").write_text("nothing to do\nV1 a 0 1\nR1 a 0 1\n.end\n")
    done = emsim("d.cir", "-q", "--csv", "d.csv")
    assert not (decks / "d.csv").exists() and "no analysis that can run" in done.stderr


def test_a_file_that_cannot_be_written_loses_none_of_the_others(decks):
    done = emsim("print.cir", "-o", "/dev/full", "--csv", "out.csv", "--html", "page.html")
    assert done.returncode == 5 and "cannot write /dev/full: No space left on device\n" in done.stderr
    assert "-> out.csv, page.html" in done.stderr and "Index   time" in done.stdout
    assert (decks / "out.csv").exists() and (decks / "page.html").exists()


def test_the_page_of_a_run_that_failed_says_why(decks):
    done = emsim("stuck.cir", "--no-files", "--html", "page.html")
    assert done.returncode == 3 and done.stderr.count("error[") == 1
    code = done.stderr.split("error[")[1][:4]
    assert f"error[{code}]" in (decks / "page.html").read_text()

"""What a deck calls its things does not steer the terminal, the page or the machine that shows them."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys

import pytest

import emsim
from emsim.cli import main
from emsim.outputs import html

ESCAPE = "\x1b[2J\x1b]0;owned\x07"
NODES = "a\x1bcb"
DECK = (
    f"title {ESCAPE} end\nV1 {NODES} 0 SIN(0 1 1k)\nR1 {NODES} out\u202eb 1k\nC1 out\u202eb 0 1u\n"
    f".op\n.tran 0.1m 1m\n.print tran v({NODES})\n.end\n"
)
STEERS = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")


def steers(text: str) -> list[str]:
    return STEERS.findall(text.replace("\r\n", "\n"))


@pytest.mark.parametrize(
    "args",
    [
        ["deck.cir"],
        ["deck.cir", "--no-files", "--csv", "-"],
        ["check", "deck.cir"],
        ["explain", "deck.cir"],
        ["explain", "deck.cir:2"],
        ["analogue", "deck.cir"],
        ["deck.cir", "--no-files", "-D", f"{ESCAPE}=1"],
        ["wrong.cir"],
    ],
    ids=" ".join,
)
def test_names_do_not_steer_the_terminal(args, scratch, capsys):
    (scratch / "deck.cir").write_text(DECK)
    (scratch / "wrong.cir").write_text(DECK.replace("1k\nC1", f"{ESCAPE}\nC1").replace("0 1u", f"0 {ESCAPE}"))
    main(args)
    out, err = capsys.readouterr()
    assert out + err and not steers(out + err), repr(out + err)


def test_names_do_not_steer_who_prints_the_files(scratch):
    (scratch / "deck.cir").write_text(DECK)
    assert main(["deck.cir", "-q", "--ascii", "--csv", "deck.csv"]) == 0
    for name in ("deck.raw", "deck.csv"):
        assert not steers((scratch / name).read_text(encoding="utf-8")), name


def test_a_picture_in_the_terminal_keeps_its_own_colours_alone(scratch, capsys):
    from emsim.cli.console import print_lines

    print_lines([f"\x1b[38;5;12m---\x1b[0m {ESCAPE}"], painted=True)
    out = capsys.readouterr().out
    assert out.startswith("\x1b[38;5;12m---\x1b[0m ") and not steers(out[20:])


@pytest.mark.parametrize(
    "title", ["{{run}}", "{{script}} {{style}}", "</script><script>alert(1)</script>", "\\g<0> \\1"]
)
def test_a_title_like_the_pages_own_marks_does_not_break_it(title, scratch):
    result = emsim.run(f"{title}\nV1 a 0 SIN(0 1 1k)\nR1 a 0 1k\n.tran 10u 1m\n.end\n")
    result.save("page.html")
    text = (scratch / "page.html").read_text(encoding="utf-8")
    run = re.search(r'<script[^>]*type="application/json"[^>]*>(.*?)</script>', text, re.S)
    assert run and json.loads(run[1])["title"] == title
    assert text.count("<script>") == html.page({"title": "x"}).count("<script>")


def test_the_page_shows_the_deck_that_ran(scratch, monkeypatch):
    """Somebody saves another deck, and other parts, while it runs."""
    (scratch / "parts.inc").write_text("R1 a 0 1k\n")
    (scratch / "deck.cir").write_text("the deck that ran\n.include parts.inc\nV1 a 0 1\n.tran 10u 1m\n.end\n")
    from emsim import pipeline

    run, seen = pipeline.solve, []

    def solve(*args, **more):
        found = run(*args, **more)
        (scratch / "parts.inc").write_text("R77 a 0 1k\n")
        (scratch / "deck.cir").write_text("another deck\n.include parts.inc\nV88 a 0 1\n.tran 10u 1m\n.end\n")
        return found

    explain = pipeline.explain

    def explained(*args, **more):
        seen.append(explain(*args, **more))
        return seen[-1]

    monkeypatch.setattr(pipeline, "solve", solve)
    monkeypatch.setattr(pipeline, "explain", explained)
    assert main(["deck.cir", "-q", "--html", "page.html"]) == 0
    assert len(seen) == 1
    from emsim.reports.explained import page

    text = "\n".join(page(seen[0]))
    assert "r1" in text and "v88" not in text and "r77" not in text
    assert "another deck" not in (scratch / "page.html").read_text(encoding="utf-8")
    # and the next command reads what stands there now
    assert main(["check", "-q", "deck.cir"]) == 0
    assert emsim.check("deck.cir")["title"] == "another deck"


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="looks into /proc")
def test_machine_code_is_at_no_address_writable():
    code = (
        "import emsim\n"
        "emsim.run('t\\nV1 a 0 SIN(0 1 1k)\\nB1 b 0 V={sin(v(a))*exp(v(a))}\\nR1 b 0 1\\n.tran 1u 1m\\n.end\\n')\n"
        "print(open('/proc/self/maps').read())"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, env={**os.environ}, timeout=60
    )
    ways = {line.split()[1][:3] for line in done.stdout.splitlines() if "memfd:emsim" in line}
    assert ways <= {"r-x"}, done.stdout
    assert not [line for line in done.stdout.splitlines() if line and "wx" in line.split()[1]]

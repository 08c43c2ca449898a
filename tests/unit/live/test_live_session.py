"""Runs of a deck that is being edited: what is shown, what is ended, what stays."""

from __future__ import annotations

import json
import os
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from threading import Thread
from time import monotonic, sleep
from typing import Any

import pytest

from emsim.live.session import Session, pieces
from emsim.live.worker import explain, work

DECK = """divider
.param top=10 r=1k
V1 a 0 {top}
R1 a b {r}
R2 b 0 {2*r}
.tran 1m 10m
.print tran v(b)
.end
"""
# 10^10 steps, of which the last few are kept
ENDLESS = "endless\nV1 a 0 SIN(0 1 1k)\nR1 a b 1k\nC1 b 0 1n\n.tran 1u 1e4 9999.999 1u\n.end\n"


class Live:
    """A session in a thread and what its board says."""

    def __init__(self, deck: Path, **given: Any) -> None:
        self.deck, self.said = deck, []
        self.session = Session(str(deck), say=lambda head: self.said.append(head["text"]), **given)
        self.thread = Thread(target=self.session.serve, daemon=True)
        self.thread.start()

    def messages(self) -> dict[str, Any]:
        lines = map(json.loads, self.session.board.after(0, 0.0)[1])
        return {line["kind"]: line for line in lines}

    def state(self, wanted: Callable[[dict[str, Any]], object]) -> dict[str, Any]:
        """The first state of which this is true."""
        until(lambda: "state" in (m := self.messages()) and wanted(m["state"]))
        return self.messages()["state"]

    def value(self, name: str) -> float:
        return next(p["value"] for p in self.messages()["state"]["params"] if p["name"] == name)


def until(true: Callable[[], object], seconds: float = 120.0) -> None:
    """Waits for a condition; the time is only how long a broken one is waited for."""
    end = monotonic() + seconds
    while not true():
        assert monotonic() < end, "it never came"
        sleep(0.01)


@pytest.fixture
def live(tmp_path: Path) -> Iterator[Callable[..., Live]]:
    started: list[Live] = []

    def start(text: str, **given: Any) -> Live:
        deck = tmp_path / "deck.cir"
        deck.write_text(text)
        started.append(Live(deck, **given))
        return started[-1]

    yield start
    for found in started:
        found.session.stop()
        found.thread.join(60)
        assert not found.thread.is_alive()


def test_every_saved_version_is_shown(live: Callable[..., Live]):
    found = live(DECK)
    first = found.state(lambda s: s["ok"])
    run = found.messages()["run"]["run"]
    assert run["title"] == "divider"
    assert run["shown"] == ["v(b)"]
    assert run["rows"] > 1
    assert [p["text"] for p in first["params"]] == ["10", "1k"]
    found.deck.write_text(DECK.replace("divider", "second"))
    found.state(lambda s: s["number"] > first["number"] and s["ok"])
    assert found.messages()["run"]["run"]["title"] == "second"
    assert found.messages()["busy"]["share"] is None


def test_a_mistake_stands_at_its_line_and_the_last_run_stays(live: Callable[..., Live]):
    found = live(DECK)
    found.state(lambda s: s["ok"])
    found.deck.write_text(DECK.replace("R2 b 0 {2*r}", "R2 b 0 {2*rr}"))
    state = found.state(lambda s: not s["ok"])
    assert [line for line, _ in state["lines"]] == [5]
    text = "".join(part for _, part in state["said"])
    assert "deck.cir:5:" in text and "^^" in text and "help" in text
    assert state["said"][0][0] == "error"
    assert '<span id="line-5" class=bad>' in state["sheet"]
    assert not state["drawn"]
    # what is known of the parameters, and the run before, are still there
    assert [p["name"] for p in state["params"]] == ["top", "r"]
    assert found.messages()["run"]["run"]["title"] == "divider"
    found.deck.write_text(DECK)
    found.state(lambda s: s["ok"])
    assert any("rr" in text for text in found.said)


def test_a_run_that_a_newer_one_overtakes_is_ended(live: Callable[..., Live]):
    found = live(ENDLESS)
    until(lambda: (found.messages().get("busy") or {}).get("share") or 0 > 0)
    process = found.session.runs.pid
    assert process is not None and alive(process)
    assert "state" not in found.messages()
    found.deck.write_text(DECK)
    found.state(lambda s: s["ok"])
    until(lambda: not alive(process))
    assert found.messages()["run"]["run"]["title"] == "divider"


def test_a_parameter_overtakes_a_run_too(live: Callable[..., Live]):
    endless = ENDLESS.replace("C1 b 0 1n", "C1 b 0 1n\n.param until=10m\n").replace(
        "1e4 9999.999", "{until} {0.999*until}"
    )
    found = live(endless)
    found.state(lambda s: s["ok"])
    found.session.ask({"until": "10k"}, 1)
    until(lambda: (found.messages()["busy"]["share"] or 0) > 0)
    process = found.session.runs.pid
    found.session.ask({"until": "20m"}, 2)
    state = found.state(lambda s: s["asked"] == 2)
    assert state["ok"] and state["set"] == {"until": "20m"}
    until(lambda: not alive(process))


def test_no_run_is_left_at_the_end(live: Callable[..., Live]):
    found = live(ENDLESS)
    until(lambda: (found.messages().get("busy") or {}).get("share") or 0 > 0)
    process = found.session.runs.pid
    found.session.stop()
    found.thread.join(60)
    assert not alive(process)
    assert found.session.board.closed


def test_parameters_of_the_page(live: Callable[..., Live]):
    found = live(DECK)
    found.state(lambda s: s["ok"])
    found.session.ask({"top": "12", "nothing": "1"}, 1)
    state = found.state(lambda s: s["asked"] == 1)
    assert state["set"] == {"top": "12"}
    assert found.value("top") == 12
    assert state["said"] == []
    # an expression, and a mistake in one
    found.session.ask({"top": "2*6k"}, 2)
    found.state(lambda s: s["asked"] == 2)
    assert found.value("top") == 12000
    found.session.ask({"top": "2*"}, 3)
    state = found.state(lambda s: s["asked"] == 3)
    assert not state["ok"] and state["set"] == {"top": "2*"}
    assert "-D top" in "".join(part for _, part in state["said"])
    # back to the deck
    found.session.ask({"top": None}, 4)
    state = found.state(lambda s: s["asked"] == 4)
    assert state["ok"] and state["set"] == {}
    assert found.value("top") == 10


def test_an_edit_of_the_deck_stands_above_the_page(live: Callable[..., Live]):
    found = live(DECK)
    found.state(lambda s: s["ok"])
    found.session.ask({"top": "12", "r": "2k"}, 1)
    found.state(lambda s: s["asked"] == 1)
    found.deck.write_text(DECK.replace("top=10", "top=11"))
    state = found.state(lambda s: any(p["text"] == "11" for p in s["params"]))
    assert state["set"] == {"r": "2k"}
    assert (found.value("top"), found.value("r")) == (11, 2000)
    # a parameter that goes leaves no warning behind
    found.deck.write_text(
        DECK.replace(".param top=10 r=1k", ".param top=11").replace("{r}", "1").replace("{2*r}", "2")
    )
    state = found.state(lambda s: len(s["params"]) == 1 and s["ok"])
    assert (state["set"], state["said"]) == ({}, [])


def test_a_mistake_in_the_deck_keeps_the_pages_values(live: Callable[..., Live]):
    found = live(DECK)
    found.state(lambda s: s["ok"])
    found.session.ask({"top": "12"}, 1)
    found.state(lambda s: s["asked"] == 1)
    found.deck.write_text(DECK.replace(".param top=10", ".param =10"))
    found.state(lambda s: not s["ok"])
    found.deck.write_text(DECK)
    found.state(lambda s: s["ok"])
    assert found.value("top") == 12


def test_options_and_definitions_of_the_command_line(live: Callable[..., Live]):
    found = live(DECK, defines={"top": "5"}, options={"method": "radau"})
    state = found.state(lambda s: s["ok"])
    assert found.value("top") == 5
    assert "radau" in state["facts"]


def test_the_page_knows_what_the_command_line_sets(live: Callable[..., Live]):
    found = live(DECK, defines={"top": "5"})
    state = found.state(lambda s: s["ok"])
    assert [(p["name"], p["text"], p["given"], p["value"]) for p in state["params"]] == [
        ("top", "10", "5", 5.0), ("r", "1k", None, 1000.0),
    ]  # fmt: skip
    found.session.ask({"top": "6"}, 1)
    found.state(lambda s: s["asked"] == 1)
    assert found.value("top") == 6
    found.session.ask({"top": None}, 2)
    found.state(lambda s: s["asked"] == 2)
    assert found.value("top") == 5


def test_equations_follow_when_it_is_quiet(live: Callable[..., Live]):
    found = live(DECK)
    until(lambda: "sheets" in found.messages())
    first = found.messages()["sheets"]
    assert [name for name, _, _ in first["sheets"]] == ["equations"]
    assert first["number"] == found.messages()["state"]["number"]
    found.session.ask({"r": "7k"}, 1)
    found.state(lambda s: s["asked"] == 1)
    until(lambda: found.messages()["sheets"]["number"] == found.messages()["state"]["number"])
    assert found.messages()["sheets"]["sheets"] != first["sheets"]
    # what is wrong has none, and what was written of it stays
    kept = found.messages()["sheets"]
    found.deck.write_text(DECK.replace("{top}", "{tip}"))
    found.state(lambda s: not s["ok"])
    assert found.messages()["sheets"] == kept


def test_equations_of_a_deck_that_became_wrong(tmp_path: Path):
    deck = tmp_path / "deck.cir"
    deck.write_text(DECK.replace("{top}", "{<b>}"))
    ((name, title, text),) = explain({"deck": str(deck), "defines": {}, "set": {}, "options": {}})["sheets"]
    assert (name, title) == ("equations", "Equations")
    assert "error[E" in text and "<b>" not in text


def test_included_files_are_watched(live: Callable[..., Live], tmp_path: Path):
    parts, lib = tmp_path / "parts.inc", tmp_path / "sub.lib"
    found = live(DECK.replace("R2 b 0 {2*r}", ".include parts.inc"))
    state = found.state(lambda s: not s["ok"])
    assert [line for line, _ in state["lines"]] == [5]
    parts.write_text(".lib sub.lib two\n.param inner=3\n")
    found.state(lambda s: "sub.lib" in str(s["said"]))
    lib.write_text(".lib one\nR2 b 0 1k\n.endl\n.lib two\nR2 b 0 {inner}k\n.endl\n")
    found.state(lambda s: not s["ok"] and "sub.lib:5" in str(s["said"]))
    lib.write_text(".lib one\nR2 b 0 1k\n.endl\n.lib two\nR2 b 0 {inner*1k}\n.endl\n")
    state = found.state(lambda s: s["ok"])
    inner = next(p for p in state["params"] if p["name"] == "inner")
    assert (inner["file"], inner["line"], inner["text"], inner["source"]) == (
        "parts.inc",
        2,
        "3",
        ".param inner=3",
    )
    # a mistake in the library is told at the deck's own line too
    lib.write_text(".lib two\nC2 b 0\n.endl\n")
    state = found.state(lambda s: not s["ok"])
    assert [line for line, _ in state["lines"]] == [5]


def test_the_deck_goes_and_comes(live: Callable[..., Live]):
    found = live(DECK)
    found.state(lambda s: s["ok"])
    found.deck.unlink()
    state = found.state(lambda s: not s["ok"])
    assert "there is no file" in "".join(part for _, part in state["said"])
    found.deck.write_text("")
    found.state(lambda s: "empty" in str(s["said"]))
    fresh = found.deck.with_suffix(".new")
    fresh.write_text(DECK)
    fresh.rename(found.deck)
    found.state(lambda s: s["ok"])


def test_a_process_that_dies_is_told_and_replaced(live: Callable[..., Live]):
    found = live(ENDLESS)
    until(lambda: (found.messages().get("busy") or {}).get("share") or 0 > 0)
    assert found.session.runs.pid is not None
    os.kill(found.session.runs.pid, signal.SIGKILL)
    state = found.state(lambda s: not s["ok"])
    assert "by signal 9" in str(state["said"])
    found.deck.write_text(DECK)
    found.state(lambda s: s["ok"])


def test_what_was_computed_of_a_failed_run_is_drawn(tmp_path: Path):
    deck = tmp_path / "deck.cir"
    deck.write_text("blow up\nC1 a 0 1 ic=1\nB1 0 a I={v(a)^2}\n.tran 1m 2 uic\n.end\n")
    head, document = work({"deck": str(deck), "defines": {}, "set": {}, "options": {}})
    assert not head["ok"]
    assert "error[E4" in head["text"].replace("\033[1;31m", "")
    assert json.loads(document)["rows"] > 1


def test_a_deck_without_an_analysis_says_so(tmp_path: Path):
    deck = tmp_path / "deck.cir"
    deck.write_text("nothing\nR1 a 0 1\nV1 a 0 1\n.end\n")
    head, document = work({"deck": str(deck), "defines": {}, "set": {}, "options": {}})
    assert not head["ok"] and "N283" in head["text"] and document == b""


def test_places_of_parameters(tmp_path: Path):
    deck = tmp_path / "deck.cir"
    deck.write_text("t\n.param A=-5 b={2k}\n+ c = 4.7kohm d='3*a'\nV1 a 0 1\nR1 a 0 {b}\n.op\n.end\n")
    head, _ = work({"deck": str(deck), "defines": {}, "set": {}, "options": {}})
    found = {p["name"]: p for p in head["params"]}
    assert {n: (p["shown"], p["text"], p["literal"], p["value"]) for n, p in found.items()} == {
        "a": ("A", "-5", True, -5.0),
        "b": ("b", "2k", True, 2000.0),
        "c": ("c", "4.7kohm", True, 4700.0),
        "d": ("d", "3*a", False, -15.0),
    }
    for p in found.values():
        assert p["source"][p["col"] - 1 : p["end"] - 1] == p["text"]


def test_coloured_text_in_pieces():
    assert pieces("a \033[1;31merror\033[0m\033[1m: b\033[0m\n") == [
        ("", "a "), ("error", "error"), ("strong", ": b"), ("", "\n"),
    ]  # fmt: skip
    assert pieces("") == []


def alive(process: int | None) -> bool:
    assert process is not None
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    return True

"""Numbers of cards as sliders: which they are, and the text with others in their places."""

from __future__ import annotations

from emsim.live.values import altered, places
from emsim.live.worker import work

DECK = """title R9 a b 5
* R8 a b 5
V1 in 0 dc 12
R1 in out 4.7k ; R7 a b 5
C1 out 0 {c}
L1 out x 10uH
.param c=1u
BODY  sled  shape=box(20m,10m) m=0.5
JOINT guide 0 sled slide axis=(1,0)
SPRING s guide k=100N/m q0=2mm
R5 a b 1k
r5 a b 2k
.subckt x a b
R6 a b 1k
.ends
.tran 1m 1
.end
R4 a b 1k
"""


def test_what_is_a_slider() -> None:
    found = {name: (p.shown, p.text, p.line) for name, p in places(DECK).items()}
    assert found == {
        "v1:value": ("V1", "12", 3), "r1:value": ("R1", "4.7k", 4), "l1:value": ("L1", "10uH", 6),
        "sled:m": ("sled m", "0.5", 8), "s:k": ("s k", "100N/m", 10), "s:q0": ("s q0", "2mm", 10),
    }  # fmt: skip
    lines = DECK.split("\n")
    for p in places(DECK).values():
        assert lines[p.line - 1][p.col - 1 : p.end - 1] == p.text


def test_others_stand_in_their_places() -> None:
    text = altered(DECK, {"s:k": "7N/m", "s:q0": "31mm", "r1:value": "22", "gone:value": "1"})
    assert "SPRING s guide k=7N/m q0=31mm\n" in text and "R1 in out 22 ; R7 a b 5\n" in text
    assert altered(text, {"s:k": "100N/m", "s:q0": "2mm", "r1:value": "4.7k"}) == DECK


def test_a_run_with_values_of_cards(tmp_path) -> None:  # type: ignore[no-untyped-def]
    deck = tmp_path / "rc.cir"
    deck.write_text("divider\nV1 a 0 10\nR1 a b 1k\nR2 b 0 1k\n.tran 1m 2m\n.print tran v(b)\n.end\n")
    job = {"deck": str(deck), "defines": {}, "set": {"r2:value": ["3k", "1k"]}, "options": {}}
    head, document = work(job)
    assert head["ok"] and document and head["set"] == job["set"]
    assert "R2 b 0 1k" in head["source"] and "R2 b 0 1k" in head["sheet"]
    assert [p["name"] for p in head["values"]] == ["v1:value", "r1:value", "r2:value"]
    # edited since: the deck counts
    deck.write_text(deck.read_text().replace("R2 b 0 1k", "R2 b 0 9k"))
    assert work(job)[0]["set"] == {}

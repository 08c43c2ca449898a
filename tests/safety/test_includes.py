"""What a foreign deck can make emsim read by its .include: no more than files, no more of them than fits, and a file that is
no deck is not shown."""

from __future__ import annotations

import os
import time

import pytest

import emsim
from emsim.diagnostics import render_text

DECK = "t\n.include {}\nV1 a 0 1\nR1 a 0 1k\n.op\n.end\n"


def said(path) -> tuple[list[str], str]:
    with pytest.raises((emsim.DeckError, emsim.OutsideError)) as caught:
        emsim.check(path)
    return [d.code for d in caught.value.diagnostics], render_text(caught.value.diagnostics)


def test_a_file_that_is_no_deck_is_not_shown(scratch):
    (scratch / "letter.txt").write_text("".join(f"confidential {k}: nothing for others\n" for k in range(30)))
    (scratch / "deck.cir").write_text(DECK.format("letter.txt"))
    codes, text = said("deck.cir")
    assert codes == ["E100"]
    assert "letter.txt is no deck: 30 of its 30 lines" in text and "deck.cir:2:10" in text
    assert "confidential" not in text and "others" not in text


def test_a_slip_in_an_included_model_is_still_shown(scratch):
    (scratch / "models.inc").write_text(".modle de D(is=1n)\n")
    (scratch / "deck.cir").write_text(DECK.format("models.inc"))
    codes, text = said("deck.cir")
    assert codes == ["E105"] and "1 | .modle de D(is=1n)" in text


def test_includes_that_double_at_every_level_end(scratch):
    for k in range(45):
        (scratch / f"f{k}").write_text(f".include f{k + 1}\n" * 2)
    (scratch / "f45").write_text("C1 a 0 1u\n")
    (scratch / "deck.cir").write_text(DECK.format("f0"))
    began = time.monotonic()
    codes, text = said("deck.cir")
    assert codes == ["E153"] and "10,000 files" in text
    assert time.monotonic() - began < 10


def test_includes_that_go_too_deep_are_not_said_to_include_themselves(scratch):
    for k in range(60):
        (scratch / f"f{k}").write_text(f".include f{k + 1}\n")
    (scratch / "f60").write_text("C1 a 0 1u\n")
    (scratch / "deck.cir").write_text(DECK.format("f0"))
    codes, text = said("deck.cir")
    assert codes == ["E153"] and "50 files within files" in text


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes here")
@pytest.mark.parametrize("what", ["pipe", "/dev/zero"])
def test_a_pipe_or_a_device_is_not_included(scratch, what):
    os.mkfifo("pipe")
    (scratch / "deck.cir").write_text(DECK.format(what))
    codes, text = said("deck.cir")
    assert codes == ["E501"] and "a pipe or a device" in text


def test_a_deck_that_never_ends_is_refused(scratch):
    if not os.path.exists("/dev/zero"):
        pytest.skip("no such device here")
    codes, text = said("/dev/zero")
    assert codes == ["E500"] and "256 MiB" in text

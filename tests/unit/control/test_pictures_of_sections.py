"""plot in a section: told and checked, and drawn where pictures are asked for. hardcopy draws always."""

from __future__ import annotations

from pathlib import Path

import pytest

from emsim.cli import main

DECK = """rc
V1 a 0 1
R1 a b 1k
C1 b 0 1u
{options}
.control
tran 10u 5m
{command}
.endc
.end
"""


def written(folder: Path, command: str, *arguments: str, options: str = "") -> tuple[int, list[str]]:
    (folder / "p.cir").write_text(DECK.format(options=options, command=command))
    code = main(["p.cir", "--no-files", *arguments])
    return code, sorted(p.name for p in folder.iterdir() if p.suffix != ".cir")


def test_plot_draws_where_it_is_asked_to(scratch: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert written(scratch, "plot v(b)") == (0, [])
    assert "note[N160]: plot draws nothing by itself" in capsys.readouterr().err
    assert written(scratch, "plot v(b)\nplot v(a)", "--pictures") == (0, ["p-1.png", "p-2.png"])


def test_an_option_of_the_deck_asks_for_it_too(scratch: Path) -> None:
    assert written(scratch, "plot v(b)", options=".options pictures=1") == (0, ["p-1.png"])


def test_what_is_not_drawn_does_not_count(scratch: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert written(scratch, "repeat 201\nplot v(b)\nend\necho done") == (0, [])
    assert "done" in capsys.readouterr().out


def test_hardcopy_draws_always(scratch: Path) -> None:
    assert written(scratch, "hardcopy h.svg v(b)") == (0, ["h.svg"])


def test_a_name_that_is_not_there_is_told_without_a_picture_too(
    scratch: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, files = written(scratch, "plot v(zz)")
    assert code != 0 and files == []
    assert "E162" in capsys.readouterr().err

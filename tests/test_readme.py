"""What README.md shows is true: its deck and its Python run, its commands and files exist."""

from __future__ import annotations

import re
import shutil

import pytest
from PIL import Image, ImageChops, ImageStat
from support import ROOT

import emsim
from emsim.cli import main

TEXT = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", TEXT, re.M | re.S)


def test_its_deck_does_what_it_says():
    result = emsim.run(blocks("")[0])
    # 1.5 V asks for 45 degrees; a P controller droops under the arm's weight
    assert result["angle(hinge)"][-1] * 57.29578 == pytest.approx(43.4, abs=0.1)


def test_its_python_runs(scratch):
    (scratch / "netlists").mkdir()
    shutil.copytree(ROOT / "netlists" / "paper", scratch / "netlists" / "paper")
    (code,) = blocks("python")
    names: dict[str, object] = {}
    exec(compile(code, "README.md", "exec"), names)
    assert (scratch / "out.csv").stat().st_size > 1000
    assert len(names["s"].names) == names["s"].n  # type: ignore[attr-defined]


def test_its_commands_are_marked_for_ci():
    marked = re.findall(r"<!-- (\w+) command -->\n```sh\n(.*?)\n```", TEXT, re.S)
    assert [name for name, _ in marked] == ["run", "test"]
    for _, command in marked:
        assert command.startswith("python3 -m venv .venv && .venv/bin/pip install ") and "\n" not in command
        for path in re.findall(r"netlists/\S+", command):
            assert (ROOT / path).exists()


def test_its_links_and_pictures_exist():
    for path in re.findall(r"\]\(((?!http)[^)#]+)\)", TEXT):
        assert (ROOT / path).exists(), path


def test_its_pictures_are_small():
    sizes = {"png": 100_000, "gif": 250_000}
    found = {kind: (ROOT / f"netlists/coupled/pendulum_servo.{kind}").stat().st_size for kind in sizes}
    assert all(found[kind] < size for kind, size in sizes.items()), found


def test_its_film_is_what_its_command_makes(scratch):
    (command,) = re.findall(r"`emsim (\S+ --circuit --width \d+ --gif \S+)`", TEXT)
    deck, *options = command.split()
    assert main([str(ROOT / deck), "--no-files", "-q", *options]) == 0
    with Image.open(scratch / options[-1]) as new, Image.open(ROOT / deck.replace(".cir", ".gif")) as old:
        assert (new.size, new.n_frames) == (old.size, old.n_frames)
        for k in range(0, old.n_frames, 10):
            new.seek(k)
            old.seek(k)
            off = ImageChops.difference(new.convert("L"), old.convert("L"))
            assert ImageStat.Stat(off).mean[0] < 1.0, (
                k
            )  # of 255: letters may be of another version of the font's


def test_its_exit_codes_are_the_programs():
    from emsim.cli import console

    listed = {int(code) for code in re.findall(r"^\| (\d+) \|", TEXT, re.M)}
    assert listed == set(console.STATUS)

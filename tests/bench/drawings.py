"""Contact sheets of every deck's circuit and machine, to be looked at: `python tests/bench/drawings.py FOLDER [circuits|machines]
[name part]`.

A tile is the drawing with the deck's name below it; machines stand at a third of their run. What was seen is told in
tests/unit/schematic/judged.md, whose table a test holds to the decks that there are.
"""

from __future__ import annotations

import signal
import sys
from pathlib import Path
from typing import Any

from PIL import Image, ImageDraw

from emsim import ConvergenceError, DeckError, pipeline
from emsim.diagnostics import Interrupted
from emsim.outputs.film import Camera
from emsim.outputs.schematic import image
from emsim.schematic.picture import draw

ROOT = Path(__file__).resolve().parents[2] / "netlists"
TILE, ACROSS, DOWN = (620, 400), 3, 4  # px, tiles
SECONDS = 20  # for a run


def decks(part: str = "") -> list[Path]:
    return [p for p in sorted(ROOT.rglob("*.cir")) if part in str(p.relative_to(ROOT))]


def circuit(deck: Path) -> Image.Image | None:
    flat = pipeline.read(deck)
    found = draw(flat, "ansi", "", flat.sink)
    return None if found is None else image(found.data, min(1.6, (TILE[0] - 20) / found.data["width"]))


def machine(deck: Path) -> Image.Image | None:
    flat = pipeline.read(deck)
    if not flat.machine:
        return None
    try:
        result = pipeline.run(deck, scene=True)
    except ConvergenceError as error:
        if error.partial is None:
            return None
        result = error.partial
    except Interrupted as stop:
        result = stop.partial
    table: Any = result.main
    if table.scene is None or len(table) < 2:
        return None
    t = table.doubles(0)
    return Camera(table, 480, 2, None, t[0]).frame(t[0] + (t[-1] - t[0]) / 3)


def sheets(folder: Path, what: str, part: str) -> None:
    make, tiles = {"circuits": circuit, "machines": machine}[what], []

    def late(*_: object) -> None:
        raise TimeoutError

    signal.signal(signal.SIGALRM, late)
    for deck in decks(part):
        name = str(deck.relative_to(ROOT).with_suffix(""))
        signal.alarm(SECONDS)
        try:
            drawn = make(deck)
        except (DeckError, TimeoutError) as error:
            print(f"{name}: {type(error).__name__} {error}"[:150])
            continue
        finally:
            signal.alarm(0)
        if drawn is not None:
            tiles.append((name, drawn))
    for first in range(0, len(tiles), ACROSS * DOWN):
        whole = Image.new("RGB", (ACROSS * TILE[0], DOWN * TILE[1]), "#ffffff")
        pen = ImageDraw.Draw(whole)
        for k, (name, drawn) in enumerate(tiles[first : first + ACROSS * DOWN]):
            x, y = k % ACROSS * TILE[0], k // ACROSS * TILE[1]
            drawn.thumbnail((TILE[0] - 10, TILE[1] - 30), Image.Resampling.LANCZOS)
            whole.paste(drawn, (x + (TILE[0] - drawn.width) // 2, y + 4))
            pen.text((x + 8, y + TILE[1] - 20), name, fill="#c8341f", font_size=16)
            pen.rectangle((x, y, x + TILE[0] - 1, y + TILE[1] - 1), outline="#d0d0d0")
        whole.save(folder / f"{what}_{first // (ACROSS * DOWN):02d}.png")
    print(f"{len(tiles)} {what}")


if __name__ == "__main__":
    sheets(Path(sys.argv[1]), *(sys.argv[2:] + ["circuits", ""][len(sys.argv) - 2 :])[:2])

"""look=stl(file): text and binary are one surface, its outline is what an eye sees, what is wrong with a file is told."""

from __future__ import annotations

import math
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from emsim import DeckError, pipeline
from emsim.diagnostics import OutsideError
from emsim.outputs import film, html
from emsim.outputs.glyphs.mesh import sewn
from emsim.outputs.stage import Stage
from emsim.readers import stl
from emsim.readers.surface import welded

SIDES = 64


def ring(outer: float, inner: float, half: float) -> list[Any]:
    """The triangles of a tube along z."""

    def at(r: float, k: int, z: float) -> tuple[float, float, float]:
        return (r * math.cos(2 * math.pi * k / SIDES), r * math.sin(2 * math.pi * k / SIDES), z)

    found = []
    for k in range(SIDES):
        for a, b, c, d in (
            (at(outer, k, -half), at(outer, k + 1, -half), at(outer, k + 1, half), at(outer, k, half)),
            (at(inner, k + 1, -half), at(inner, k, -half), at(inner, k, half), at(inner, k + 1, half)),
            (at(outer, k, half), at(outer, k + 1, half), at(inner, k + 1, half), at(inner, k, half)),
            (at(outer, k + 1, -half), at(outer, k, -half), at(inner, k, -half), at(inner, k + 1, -half)),
        ):
            found += [(a, b, c), (a, c, d)]
    return found


def binary(triangles: list[Any]) -> bytes:
    flat = [struct.pack("<12fH", 0, 0, 0, *(v for p in t for v in p), 0) for t in triangles]
    return b"solid, says a binary file too".ljust(80) + struct.pack("<I", len(flat)) + b"".join(flat)


def text(triangles: list[Any]) -> bytes:
    lines = ["solid tube"]
    for t in triangles:
        lines += ["facet normal 0 0 0", "outer loop", *(f"vertex {x!r} {y!r} {z!r}" for x, y, z in t)]
        lines += ["endloop", "endfacet"]
    return "\n".join([*lines, "endsolid tube", ""]).encode()


TUBE = ring(50, 20, 10)
DECK = """look
BODY arm m=0.2 j=1m look=stl({look})
JOINT hinge 0 arm pin ic=(0,1)
.tran 10m 1
.end
"""


def test_text_and_binary_are_one_surface():
    one, other = stl.triangles(binary(TUBE)), stl.triangles(text(TUBE))
    assert one.shape == other.shape == (len(TUBE), 3, 3)
    assert np.allclose(one, other, atol=1e-5)


def test_faces_share_their_points():
    """Euler: a closed surface with one hole has as many points as it has edges less faces."""
    surface = welded(stl.triangles(binary(TUBE)))
    assert len(surface.points) == 4 * SIDES and len(surface.faces) == 8 * SIDES
    faces = surface.faces.tolist()
    found = sewn(surface.places(), faces)
    assert len(found["edges"]) == 3 * len(faces) / 2 == len(surface.points) + len(faces)
    far = np.abs(np.array(surface.places())[surface.faces] - stl.triangles(binary(TUBE)))
    assert far.max() <= 100 / 65534


def test_the_outline_is_what_an_eye_sees():
    """Two loops, of the outside and of the hole; what they wind about has the tube's area from above."""
    surface = welded(stl.triangles(binary(TUBE)))
    points = np.array(surface.places())
    loops = sewn(points.tolist(), surface.faces.tolist())["loops"]
    areas = []
    for loop in loops:
        x, y = points[loop][:, 0], points[loop][:, 1]
        areas.append(float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) / 2))
    area = SIDES / 2 * math.sin(2 * math.pi / SIDES)
    assert sorted(areas) == pytest.approx([-area * 20**2, area * 50**2], rel=1e-4)


def test_a_film_shows_it_in_metres(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "Tube-1.stl").write_bytes(binary(TUBE))
    deck = tmp_path / "deck.cir"
    deck.write_text(DECK.format(look="parts/Tube-1.stl,1m"))
    table = pipeline.run(str(deck), scene=True).main
    stage = Stage(table, 480)
    assert all(0.05 <= abs(side) <= 0.0708 for side in stage.box), "the corners of its box turn"
    camera = film.Camera(table, 480, 1, None, 0.0)
    picture = np.asarray(camera.frame(0.5).convert("RGB"))
    body = np.array([int(film.COLOURS["body"][k : k + 2], 16) for k in (1, 3, 5)])
    seen = int((picture == body).all(axis=2).sum()) / camera.stage.scale**2
    # less what outlines and the name cover
    assert math.pi * (0.05**2 - 0.02**2) * 0.85 < seen < math.pi * (0.05**2 - 0.02**2)


def test_it_is_looked_for_beside_the_file_that_names_it(tmp_path: Path) -> None:
    (tmp_path / "lib").mkdir()
    (tmp_path / "lib" / "tube.stl").write_bytes(text(TUBE))
    (tmp_path / "lib" / "arm.lib").write_text(
        ".subckt arm hub\nBODY b m=1 j=1m look=stl(tube.stl,1m)\n.ends\n"
    )
    deck = tmp_path / "deck.cir"
    deck.write_text("t\n.include lib/arm.lib\nX1 hub arm\nJOINT j 0 x1.b pin\n.tran 1m 2m\n.end\n")
    shapes = pipeline.run(str(deck), scene=True).main.scene.data["shapes"]  # type: ignore[union-attr]
    assert [s["name"] for s in shapes if s["kind"] == "mesh"] == ["x1.b"]


def test_a_look_changes_the_picture_alone(tmp_path: Path) -> None:
    (tmp_path / "tube.stl").write_bytes(binary(TUBE))
    deck = tmp_path / "deck.cir"
    deck.write_text(DECK.format(look="tube.stl"))
    plain = pipeline.run(DECK.replace(" look=stl({look})", "")).main
    assert list(pipeline.run(str(deck)).main.doubles(1)) == list(plain.doubles(1))


def test_the_page_holds_it_once_and_in_few_bytes(tmp_path: Path) -> None:
    (tmp_path / "tube.stl").write_bytes(binary(TUBE))
    deck = tmp_path / "deck.cir"
    sizes = []
    for look in ("look=ball(0.1)", "look=stl(tube.stl)"):
        deck.write_text(DECK.replace("look=stl({look})", look))
        path = tmp_path / "page.html"
        html.write(str(path), pipeline.run(str(deck), scene=True))
        sizes.append(path.stat().st_size)
    assert sizes[1] - sizes[0] < 9 * len(TUBE) < len(binary(TUBE)) / 5


TWO_CORNERS = (
    b"solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nendloop\nendfacet\nendsolid"
)
SHORT = b"8" + binary(TUBE)[1:-10]


@pytest.mark.parametrize(
    ("data", "code", "said"),
    [
        (None, "E501", "there is no file part.stl"),
        (SHORT, "E158", f"of {len(TUBE)} triangles it would have {len(SHORT) + 10} bytes"),
        (b"", "E158", "no STL file"),
        (TWO_CORNERS, "E158", "a facet has three"),
        (b"solid x\nendsolid x\n" + 80 * b" ", "E158", "it has no triangle"),
        (binary([((0, 0, 0), (1, 0, math.nan), (0, 1, 0))]), "E158", "infinite or no number"),
        (binary([((1, 1, 1), (1, 1, 1), (1, 1, 1))]), "E158", "one point"),
        (binary([((0, 0, 0), (1, 1, 1), (0, 0, 0))]), "E158", "lines"),
        (binary(TUBE[:1] * 20_001), "E158", "20,000 are the most"),
    ],
)  # fmt: skip
def test_a_file_that_cannot_be_shown_is_told(
    data: bytes | None, code: str, said: str, tmp_path: Path
) -> None:
    if data is not None:
        (tmp_path / "part.stl").write_bytes(data)
    (tmp_path / "parts.stl").write_bytes(binary(TUBE))
    deck = tmp_path / "deck.cir"
    deck.write_text(DECK.format(look="part.stl"))
    with pytest.raises((DeckError, OutsideError)) as told:
        pipeline.run(str(deck))
    (one,) = told.value.diagnostics
    assert one.code == code and said in one.message and one.span is not None and one.span.line == 2
    assert code == "E158" or "parts.stl" in (one.hint or "")


@pytest.mark.parametrize(
    ("look", "said"),
    [
        ("look=stl()", "stl(..) names a file"),
        ('look=stl("part.stl")', "without quotes"),
        ("look=stl(parts.stl,0)", "greater than zero"),
        ("look=stl(parts.stl,1,2)", "what one unit of the file is"),
        ("look=parts.stl", "write look=stl(parts.stl)"),
    ],
)
def test_what_stl_takes_is_told(look: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "parts.stl").write_bytes(binary(TUBE))
    deck = tmp_path / "deck.cir"
    deck.write_text(DECK.replace("look=stl({look})", look))
    with pytest.raises(DeckError) as told:
        pipeline.run(str(deck))
    assert said in str(told.value)

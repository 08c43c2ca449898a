"""What each kind of shape looks like: one file a glyph, run by Python for films, translated for the page. contract.py says what a
glyph may use, marks.py has what several share, paper.py what stands beside a machine, extent.py the room that it needs.

Layers: 0 bodies, 1 joints and what is passive, 2 what acts. A glyph: its file, its function here, its line in GLYPHS.
"""

from __future__ import annotations

from .beam import beam
from .belt import belt
from .bones import bones
from .box import box
from .cam import cam
from .contact import contact
from .disc import disc
from .drive import drive
from .elastic import elastic
from .force import force
from .friction import friction
from .gear import gear
from .joint import joint
from .knife import knife
from .latch import latch
from .looks import ball, spoked, toothed_body, wagon
from .mesh import mesh
from .motor import motor
from .polygon import polygon
from .pot import pot
from .ratio import ratio
from .rod import rod
from .rope import rope
from .solids import is_solid
from .stop import stop
from .torque import torque
from .transducer import transducer

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable

    from .contract import Pen, Scene, Shape

    Glyph = tuple[int, Callable[[Scene, Pen, Shape], None]]

GLYPHS: dict[str, Glyph] = {
    "rod": (0, rod), "box": (0, box), "disc": (0, disc), "polygon": (0, polygon), "bones": (0, bones),
    "ball": (0, ball), "wheel": (0, spoked), "toothed": (0, toothed_body), "wagon": (0, wagon),
    "mesh": (0, mesh),
    "joint": (1, joint), "spring": (1, elastic), "damper": (1, elastic), "gear": (0, gear), "belt": (1, belt), "cam": (0, cam),
    "stop": (1, stop), "contact": (1, contact), "ratio": (1, ratio), "knife": (1, knife), "rope": (1, rope), "beam": (0, beam),
    "friction": (1, friction), "latch": (1, latch),
    "motor": (2, motor), "pot": (2, pot), "force": (2, force), "torque": (2, torque), "drive": (2, drive),
    "transducer": (2, transducer),
}  # fmt: skip
PAGES = ("written", "rounded")  # of web/data.js; ours are in ../numbers.py
SHARED = ("marks", "meshes", "paper", "extent", "body", "solids", "mesh")


def drawn(m: Scene, pen: Pen) -> None:
    """All shapes, bodies first; beside solids those that are none."""
    for layer in (0, 1, 2):
        for shape in m.shapes:
            own, draw = GLYPHS.get(shape["kind"], (3, None))
            if own == layer and draw is not None and not (m.solid and is_solid(shape)):
                draw(m, pen, shape)


def script() -> str:
    """The same as the page's constant `drawn`: {GLYPHS: {kind: [layer, draw]}, paper, named, extents, solids, ..}."""
    from os.path import dirname, join

    from ..translate import script as translated

    functions = {draw.__name__: draw.__module__.rpartition(".")[2] for _, draw in GLYPHS.values()}
    sources = []
    for name in dict.fromkeys((*SHARED, *sorted(functions.values()))):
        with open(join(dirname(__file__), name + ".py"), encoding="utf-8") as file:
            sources.append(file.read())
    table = ", ".join(f"{kind}: [{layer}, {draw.__name__}]" for kind, (layer, draw) in GLYPHS.items())
    shared = "paper, called, named, extents, walled, solids, is_solid, across, cross, normals, sewn"
    return f"const drawn = {translated(sources, '{ GLYPHS: { ' + table + ' }, ' + shared + ' }', PAGES)};"

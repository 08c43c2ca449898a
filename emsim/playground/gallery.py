"""A gallery of decks as a folder of files, which any web server gives out or a browser opens as they are: a moving picture of
each deck, in subjects, and behind it the page of its run, which computes. What pages share stands once beside them (html.shared).
"""

from __future__ import annotations

import os
from html import escape
from os.path import basename, dirname, getsize, isdir, isfile, join, splitext
from shutil import copyfile

from .. import pipeline
from ..diagnostics import ConvergenceError, DeckError
from ..fmus import page
from ..outputs import html
from ..reports import explained
from ..source import SameFiles

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Sequence
    from typing import Any

    from ..elaborate.flat import FlatDeck
    from ..result import Result

INDEX = "index.html"
MARK = "gallery.js"  # a folder that has it is a gallery
# a deck is of those subjects of which it has a card or an element's letter
SUBJECTS: tuple[tuple[str, str, str], ...] = (
    ("motors", "MOTOR", ""),
    ("gears, belts, cams", "GEAR RATIO CAM BELT", ""),
    ("ropes", "ROPE", ""),
    ("rolling", "ROLL KNIFE TYRE", ""),
    ("contact and friction", "CONTACT STOP FRICTION FREEWHEEL", ""),
    ("magnets and sensors", "TRANSDUCER POT", ""),
    ("control", "BLOCK CLOCK PWM", ""),
    ("transistors", "", "qmjz"),
    ("diodes", "", "d"),
    ("switches", "", "sw"),
    ("transformers and cores", "", "k"),
    ("lines", "", "toyp"),
    ("formulas", "", "b"),
)
KINDS = ("circuit and machine", "machine", "circuit")
SMALL = {"ac", "noise", "sp", "pz", "tf", "disto", "modes"}  # analyses about a point


class Made:
    """A deck of the gallery: its title, what it is of, whether its page computes; `failed`: why it is not there."""

    def __init__(self, name: str) -> None:
        self.name, self.title, self.failed = name, name, ""
        self.subjects: list[str] = []
        self.computes = False


def decks(given: Sequence[str]) -> dict[str, str]:
    """Name in the gallery (its folder and its own) -> path, of decks and of the folders that hold some. FileNotFoundError."""
    found: dict[str, str] = {}
    for path in given:
        if not isdir(path):
            os.stat(path)
        for file in _below(path) if isdir(path) else [path]:
            stem = f"{basename(dirname(os.path.abspath(file)))}/{splitext(basename(file))[0]}"
            if found.setdefault(stem, file) != file:
                raise FileExistsError(17, "two decks have this folder and name", stem)
    return found


def _below(folder: str) -> Iterator[str]:
    for at, folders, names in os.walk(folder):
        folders.sort()
        yield from (
            join(at, name) for name in sorted(names) if splitext(name)[1].lower() in (".cir", ".sp", ".net")
        )


def build(target: str, found: dict[str, str], jobs: int, tell: Callable[[Made], object]) -> list[Made]:
    """Writes the folder, in so many processes; `tell` hears of each deck as it is done. OSError as open() raises it."""
    os.makedirs(join(target, "decks"), exist_ok=True)
    for name, text in html.shared().items():
        _put(join(target, name), text)
    for name in (MARK, "gallery.css"):
        copyfile(join(html.WEB, name), join(target, name))
    made = []
    for one in _all([(target, *item) for item in found.items()], jobs):
        tell(one)
        made.append(one)
    made.sort(key=lambda one: list(found).index(one.name))
    _put(
        join(target, INDEX),
        _index([one for one in made if not one.failed], isfile(join(target, "..", "decks.json"))),
    )
    return made


def size(target: str) -> int:
    """Of all its files [bytes]."""
    return sum(getsize(join(at, name)) for at, _, names in os.walk(target) for name in names)


def _all(tasks: list[tuple[str, str, str]], jobs: int) -> Iterator[Made]:
    if jobs == 1 or len(tasks) == 1:
        yield from map(_make, tasks)
        return
    from concurrent.futures import ProcessPoolExecutor, as_completed

    from ..sweeps.pool import belong, context

    with ProcessPoolExecutor(jobs, mp_context=context(), initializer=belong) as pool:
        running = [pool.submit(_make, task) for task in tasks]
        try:
            for done in as_completed(running):
                yield done.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _make(task: tuple[str, str, str]) -> Made:
    """Page and pictures of one deck."""
    from . import tile

    target, name, deck = task
    made, at = Made(name), join(target, "decks", name)
    try:
        with SameFiles():
            flat = pipeline.flatten(pipeline.load(deck))
            try:
                result = pipeline.run(deck, scene=True, energy=True)
            except ConvergenceError as error:
                if error.partial is None or not any(map(len, error.partial.plots)):
                    raise
                result = error.partial
            os.makedirs(dirname(at), exist_ok=True)
            tile.write(result, f"{at}.webp", f"{at}_still.webp")
            engine = page.engine(deck, result, {}, {})
            sheets = explained.sheets(pipeline.explain(deck))
            run = html.document(result, result.deck, sheets, html.MOST)
    except DeckError as error:
        made.failed = str(error).partition("\n")[0]
        return made
    except Exception as error:  # a bug in emsim must not cost the other decks
        made.failed = f"{type(error).__name__}: {error}"
        return made
    made.title, made.computes = result.title or name, engine is not None
    made.subjects = subjects(flat, {table.kind for table in result.plots}, result)
    whole = html.page(run if engine is None else {**run, "engine": engine}, beside="../../")
    back = '<header>\n  <a class="up" href="../../index.html">gallery</a>'
    _put(f"{at}.html", whole.replace("<header>", back, 1))
    return made


def subjects(flat: FlatDeck, analyses: Collection[str], result: Result) -> list[str]:
    """What a deck is of, the kind of it first."""
    cards = [card.kind for card in flat.machine]
    letters = {element.letter for element in flat.elements}
    kind = KINDS[0] if cards and letters else KINDS[1] if cards else KINDS[2]
    found = [kind]
    if cards.count("JOINT") > cards.count("BODY") > 0:
        found.append("linkages")
    for subject, words, own in SUBJECTS:
        if any(word in cards for word in words.split()) or letters & set(own):
            found.append(subject)
    if SMALL & set(analyses):
        found.append("frequencies and modes")
    if result.main.is_stepped:
        found.append("many runs")
    return found


def _index(made: Sequence[Made], in_playground: bool) -> str:
    """The page of all decks; it needs its script for filters and movement alone."""
    every = [s for one in made for s in one.subjects]
    names = sorted(set(every), key=lambda s: (s not in KINDS, -every.count(s), s))
    buttons = "".join(
        f'<button type="button" aria-pressed="false" data-subject="{escape(s)}">'
        f"{escape(s)} <small>{every.count(s)}</small></button>\n"
        for s in names
    )
    parts: dict[str, Any] = {
        "subjects": buttons,
        "decks": "".join(map(_item, made)),
        "count": len(made),
        "computing": sum(one.computes for one in made),
        "playground": '<a href="../index.html">write a deck of your own</a>' if in_playground else "",
    }
    with open(join(html.WEB, "gallery.html"), encoding="utf-8") as file:
        template = file.read()
    for name, text in parts.items():
        template = template.replace("{{" + name + "}}", str(text))
    return template


def _item(one: Made) -> str:
    at = escape(f"decks/{one.name}")
    return (
        f'<li data-subjects="{escape("|".join(one.subjects))}"><a href="{at}.html">'
        f'<img src="{at}_still.webp" data-film="{at}.webp" width="320" height="240" loading="lazy" alt="">'
        f"<span>{escape(one.title)}</span></a><p>{escape(', '.join(one.subjects))}</p></li>\n"
    )


def _put(path: str, text: str) -> None:
    with open(path, "w", encoding="utf-8", newline="\n") as file:
        file.write(text)

"""What the site takes from netlists/ and from emsim's own README: lessons, decks, the atlas, pages of runs."""

from __future__ import annotations

import re
from pathlib import Path
from posixpath import dirname, relpath

from edits import edits

ROOT = Path(__file__).resolve().parent.parent.parent
NETLISTS = ROOT / "netlists"

# decks whose runs and pictures the site shows; filled while pages are written
_runs: dict[tuple[str, int], None] = {}
_pictures: dict[tuple[str, str], None] = {}
# what a picture shows, the verb that draws it and its options; a ladder of four rungs, each run once, takes a second or two
PICTURES = {
    "circuit": ("the circuit of {}", "draw"),
    "chart": (
        "error against CPU time, every method on {}", "chart", "--alone", "--rounds", "1", "--budget", "1", "--limit", "1",
        "--tolerances", "1e-3,1e-5,1e-7,1e-9",
    ),
}  # fmt: skip


def pages() -> dict[str, str]:
    """Address in the site -> Markdown."""
    found = {
        "decks/index.md": (NETLISTS / "README.md").read_text(encoding="utf-8"),
        "decks/hard/index.md": (NETLISTS / "hard" / "README.md").read_text(encoding="utf-8"),
        "decks/lessons/index.md": (NETLISTS / "lessons" / "README.md").read_text(encoding="utf-8"),
        "internals/map.md": (ROOT / "emsim" / "README.md").read_text(encoding="utf-8"),
    }
    found = {address: text.replace("README.md)", "index.md)") for address, text in found.items()}
    found["internals/map.md"] = found["internals/map.md"].replace("(docs/pages/internals/", "(")
    for path in sorted((NETLISTS / "lessons").glob("[0-9]*.md")):
        found[f"decks/lessons/{path.name}"] = lesson(path)
    found["decks/lessons/answers.md"] = unmarked(
        (NETLISTS / "lessons" / "answers.md").read_text(encoding="utf-8")
    )
    return found


def unmarked(text: str) -> str:
    """Without the names of tested figures, which are for the tests."""
    return re.sub(r"<!--[\w:]+-->", "", text)


def lesson(path: Path) -> str:
    """A lesson's page, with its run and its deck; `<!-- run K -->` in it is the run of its K-th edit."""
    deck = f"lessons/{path.stem}.cir"
    text = unmarked(path.read_text(encoding="utf-8"))
    text = re.sub(r"<!-- run (\d+) -->", rf"<!-- run {deck} \1 -->", text)
    head, mark, rest = text.partition("## What to expect")
    number = path.name.partition("_")[0].lstrip("0")
    return (
        f'---\ntitle: "{number}. {title(text)}"\n---\n{head}<!-- run {deck} -->\n\n{mark}{rest}\n'
        f"## The deck\n\n<!-- deck {deck} -->\n"
    )


def title(text: str) -> str:
    """Of a lesson, as the menu shows it: up to the first comma."""
    found = re.match(r"# \d+\. ([^,:\n]*)", text)
    return found[1] if found else ""


def downloads() -> dict[str, Path]:
    """Address in the site -> deck."""
    return {
        f"decks/{path.relative_to(NETLISTS).as_posix()}": path for path in sorted(NETLISTS.rglob("*.cir"))
    }


def shown(deck: str) -> str:
    """A deck of netlists/ as a block of a page."""
    text = (NETLISTS / deck).read_text(encoding="utf-8").rstrip("\n")
    return f'``` {{ .spice title="netlists/{deck}" }}\n{text}\n```'


def frame(deck: str, edit: int, address: str) -> str:
    """A deck's run, or that of an edit of a lesson's deck (from 1), in a frame of a page at this address."""
    _runs[deck, edit] = None
    where = relpath(run_address(deck, edit), dirname(address) or ".")
    what = f"`netlists/{deck}` with this edit" if edit else f"`netlists/{deck}`"
    how = "The cursor reads the curves" if edit else "Space plays, the cursor moves the machine"
    return (
        f'<iframe class="run" src="{where}" title="run of {deck}{", edited" if edit else ""}" loading="lazy"></iframe>\n\n'
        f'*The run of {what}: <a href="{where}">open it as a page</a>. {how}.*'
    )


def picture(kind: str, deck: str, address: str) -> str:
    """A deck's picture on a page at this address, drawn anew in every build."""
    _pictures[kind, deck] = None
    where = relpath(picture_address(kind, deck), dirname(address) or ".")
    return f'<img class="chart" src="{where}" alt="{PICTURES[kind][0].format(deck)}">'


def picture_address(kind: str, deck: str) -> str:
    return f"{kind}s/" + deck.removesuffix(".cir") + ".svg"


def write_pictures(site: Path) -> None:
    """Draws the pictures shown. Raises RuntimeError where one does not come out."""
    from contextlib import redirect_stdout
    from io import StringIO

    from emsim.cli import main

    for kind, deck in _pictures:
        verb, *options = PICTURES[kind][1:]
        target = site / picture_address(kind, deck)
        target.parent.mkdir(parents=True, exist_ok=True)
        with redirect_stdout(StringIO()):
            code = main([verb, str(NETLISTS / deck), *options, "-q", "-o", str(target)])
        if code:
            raise RuntimeError(f"emsim {verb} {deck}: exit code {code}")
    _pictures.clear()


def run_address(deck: str, edit: int) -> str:
    return "runs/" + deck.removesuffix(".cir") + (f"_edit{edit}" if edit else "") + ".html"


def edited(deck: str, edit: int) -> str:
    """The text of a lesson's deck with its page's edit, from 1."""
    path = NETLISTS / deck
    page = path.with_suffix(".md").read_text(encoding="utf-8")
    return edits(page)[edit - 1].apply(path.read_text(encoding="utf-8"))


def write_runs(site: Path) -> None:
    """Runs the decks shown and writes their pages."""
    from emsim import pipeline
    from emsim.cli.run import source_of
    from emsim.outputs import html
    from emsim.reports import explained

    for deck, edit in _runs:
        source = source_of(str(NETLISTS / deck)) if not edit else edited(deck, edit)
        target = site / run_address(deck, edit)
        target.parent.mkdir(parents=True, exist_ok=True)
        result, equations = pipeline.run(source, scene=True, energy=True), pipeline.explain(source)
        html.write(str(target), result, sheets=explained.sheets(equations))
    _runs.clear()

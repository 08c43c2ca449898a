"""Every lesson does what its page says: figures, edits, commands, output."""

from __future__ import annotations

import re

import forms_answers  # noqa: F401
import forms_circuits  # noqa: F401  (registers its lessons)
import forms_control  # noqa: F401
import forms_couplings  # noqa: F401
import forms_numerics  # noqa: F401
import pytest
from pages import ANSWERS, FOLDER, FORMS, HEADINGS, NAMES, Answers, Page, Runs
from support import NETLISTS, ROOT

from emsim.cli import main

PAGES = {name: Page(name) for name in NAMES}
TEXTS = {**PAGES, **{f"{name}_answers": Answers(name) for name in NAMES}}


@pytest.fixture(params=NAMES)
def page(request) -> Page:
    return PAGES[request.param]


@pytest.fixture(params=TEXTS)
def text(request) -> Page:
    return TEXTS[request.param]


def test_there_is_a_page_and_a_form_for_every_deck():
    assert len(NAMES) >= 12
    assert [p.stem for p in sorted(FOLDER.glob("[0-9]*.md"))] == NAMES == sorted(FORMS)
    assert [int(name[:2]) for name in NAMES] == list(range(1, len(NAMES) + 1))


def test_a_page_has_its_sections(page):
    assert page.headings == HEADINGS
    assert len(page.edits) >= 3
    assert page.deck.splitlines()[0].lower().startswith(f"lesson {int(page.name[:2])}:")


def test_every_exercise_has_an_answer_elsewhere(page):
    number = int(page.name[:2])
    assert len(page.exercises) >= 2
    assert page.exercises == [f"{number}.{k + 1}" for k in range(len(page.exercises))]
    assert TEXTS[f"{page.name}_answers"].exercises == page.exercises
    assert f"(answers.md#{number}-" in page.text


def test_every_number_of_the_text_is_held_by_something(text):
    assert text.unaccounted == []
    assert text.bad_formulas == []


def test_figures(text):
    forms, step = (ANSWERS if isinstance(text, Answers) else FORMS)[text.name]
    figures = {f.key: f for f in forms(Runs(text, step))}
    for f in figures.values():
        if f.closed is not None and f.measured is not None:
            assert f.measured == pytest.approx(f.closed, rel=f.rel, abs=f.off), f.key
    stated = text.stated
    assert {s.key for s in stated} == set(figures), "figures of the text and of the forms"
    for s in stated:
        f = figures[s.key]
        for value in (f.closed, f.measured):
            assert value is None or s.holds(value), (s.text, s.key, value)


def test_commands_and_what_they_print(page, scratch, capsys):
    (scratch / "netlists").symlink_to(NETLISTS)
    found = re.findall(r"^```(sh|output)\n(.*?)^```$", page.text, re.M | re.S)
    assert found and found[0][0] == "sh"
    printed = ""
    for kind, block in found:
        if kind == "output":
            assert_printed(block, printed)
            continue
        capsys.readouterr()
        for line in block.splitlines():
            program, *words = line.split("#")[0].split()
            assert program == "emsim"
            assert main(words) == 0, line
        printed = "\n".join(capsys.readouterr())


def assert_printed(block: str, printed: str) -> None:
    """Each line of the block stands in what was printed, in this order; `...` stands for lines left out."""
    lines = iter(line.split() for line in printed.splitlines())
    for line in block.splitlines():
        if line.strip() not in ("", "..."):
            assert any(same(line.split(), other) for other in lines), f"not printed: {line}"


def same(stated: list[str], printed: list[str]) -> bool:
    return len(stated) == len(printed) and all(map(alike, stated, printed))


def alike(stated: str, printed: str) -> bool:
    try:
        a, b = float(stated), float(printed)
    except ValueError:
        return stated == printed
    return abs(a - b) <= 1e-3 * max(abs(a), abs(b))


def test_the_index_names_every_lesson():
    text = (FOLDER / "README.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (\d+) \| \[[^\]]+\]\((\d\d_\w+)\.md\)", text, re.M)
    assert [name for _, name in rows] == NAMES
    assert [int(number) for number, _ in rows] == [int(name[:2]) for name in NAMES]
    for readme in (ROOT / "README.md", NETLISTS / "README.md"):
        assert "lessons/README.md" in readme.read_text(encoding="utf-8")


def test_links_of_the_pages():
    for path in FOLDER.glob("*.md"):
        for link in re.findall(r"\]\(((?!http)[^)#]+)", path.read_text(encoding="utf-8")):
            assert (path.parent / link).exists(), (path.name, link)

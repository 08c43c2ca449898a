"""The stability atlas, cell by cell: `auto` meets every criterion, and what theory says must fail does fail.

The table itself is emsim/reports/hard.py; `emsim chart --hard` prints it.
"""

from __future__ import annotations

import csv
import json
import re

import numpy as np
import pytest
from support import NETLISTS

from emsim import pipeline
from emsim.cli import main
from emsim.reports import atlas, criteria, hard
from emsim.reports.hard import AUTO, CASES, METHODS

CELLS = [
    pytest.param(case, method, id=f"{case.name}-{method}", marks=[pytest.mark.slow] if case.slow else [])
    for case in CASES
    for method in atlas.methods()
    if method == AUTO or method in case.must
]


@pytest.mark.parametrize("case, method", CELLS)
def test_cell(case, method):
    cell = atlas.measure(case, method, pipeline.run)
    wanted = (criteria.OK,) if method == AUTO else case.must[method]
    assert cell.verdict.word in wanted, cell.verdict


def test_every_case_is_hard_for_somebody():
    """A case that every method passes is too easy."""
    assert not [case.name for case in CASES if not case.must]


def test_known_edges_beat_blind_ones():
    """The same pulses as corners of a source: nearer, in fewer steps."""
    for method in ("trap", "radau", "esdirk"):
        known, blind = (
            pipeline.run(NETLISTS / f"hard/pwm_{which}.cir", options={"method": method})
            for which in ("known", "blind")
        )
        off = [abs(r["i(l1)"][-1] - hard.chopped()) for r in (known, blind)]
        assert off[0] < 0.1 * off[1] and known.stats["steps"] < blind.stats["steps"], (method, off)


def test_the_page_tells_what_is_asked(tmp_path):
    """netlists/hard/README.md is that of the cases: `emsim chart --hard --readme` writes it."""
    page = (NETLISTS / "hard" / "README.md").read_text()
    told = page[page.index(atlas.BEGIN) : page.index(atlas.END)].splitlines()
    cells = [[atlas.Cell(case, m, criteria.Verdict("ok", "", ""), 0, 0.0) for m in METHODS] for case in CASES]
    first = atlas.markdown_lines(cells)[: len(CASES) + 2]
    assert told[1 : len(first) + 1] == first
    for case, row in zip(CASES, told[len(first) + 4 :], strict=True):
        words = dict(zip(METHODS, (cell.split()[0] for cell in row.split("|")[2:-1]), strict=True))
        assert words[AUTO] == "ok" and all(words[m] in case.must[m] for m in case.must), row
    copy = tmp_path / "README.md"
    copy.write_text(page)
    atlas.write_readme(cells, copy)
    assert copy.read_text().count("| chaos | ok") == 1 and copy.read_text().startswith(page[:500])


def test_methods_and_words_of_the_table_exist():
    for case in CASES:
        assert set(case.must) <= set(METHODS) - {AUTO}
        assert {w for words in case.must.values() for w in words} <= set(criteria.VERDICTS) - {criteria.OK}
        assert (NETLISTS / case.deck).exists()
    assert len({case.name for case in CASES}) == len(CASES)


# ---- the criteria themselves ---------------------------------------------------------------------


def test_errors_are_named_by_their_kind():
    k = np.arange(40)
    assert criteria.judged(1e-4 * np.sin(k), 1e-3) is None
    assert criteria.judged(0.1 * (-1.0) ** k, 1e-3).word == "rings"
    assert criteria.judged(0.01 * k, 1e-3).word == "drifts"
    assert criteria.judged(np.exp(k.astype(float)), 1e-3).word == "explodes"
    assert criteria.judged(np.full(40, np.nan), 1e-3).word == "explodes"


class Fake:
    """Columns in place of a run."""

    def __init__(self, **columns):
        self.columns = columns

    def __getitem__(self, name):
        return self.columns[name]


@pytest.mark.parametrize(
    "decay, late, word", [(0, 0, "ok"), (2e-4, 0, "damped"), (-2e-4, 0, "drifts"), (0, 2e-4, "drifts")]
)
def test_oscillations_are_kept_or_not(decay, late, word):
    f, cap = 1e5, 1e-8
    t = np.linspace(0, 100 / f, 3001)
    size, angle = np.exp(-decay * f * t), 2 * np.pi * f * t * (1 - late)
    z = 1 / (2 * np.pi * f * cap)
    trial = Fake(**{"time": t, "v(a)": size * np.cos(angle), "i(l1)": size * np.sin(angle) / z})
    assert criteria.kept(criteria.tank(f, cap), 1 / f, 100)(trial).word == word


# ---- the reports ---------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def rows():
    return atlas.atlas(pipeline.run, ["gain", "ringing", "trap", "gear", "auto"])


def test_names_narrow_rows_and_columns(rows):
    assert [row[0].case.name for row in rows] == ["ringing", "gain 1 - 1e-9", "gain 1"]
    assert [cell.method for cell in rows[0]] == ["trap", "gear", "auto"]


def test_table(rows):
    lines = atlas.table_lines(rows)
    assert lines[0].split() == ["trap", "gear", "auto"]
    assert lines[1].split() == ["ringing", "rings", "ok", "ok"]
    assert re.match(r"3 cases, 0 not as", lines[-1])
    assert "\x1b[35m     rings\x1b[0m" in atlas.table_lines(rows, colour=True)[1]


def test_files(rows, tmp_path):
    for name in ("a.csv", "a.md", "a.png", "a.svg"):
        atlas.write(str(tmp_path / name), rows)
    with open(tmp_path / "a.csv", newline="") as file:
        table = list(csv.DictReader(file))
    assert len(table) == 9 and table[0]["verdict"] == "rings" and float(table[0]["steps"]) == 60
    assert "| ringing | rings 40 % | ok" in (tmp_path / "a.md").read_text()
    assert (tmp_path / "a.png").read_bytes()[:4] == b"\x89PNG" and "<svg" in (tmp_path / "a.svg").read_text()


def test_the_verb(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(NETLISTS)  # decks are those of the tree one stands in
    page, table = tmp_path / "atlas.md", tmp_path / "atlas.csv"
    given = ["chart", "--hard", "gain", "trap", "auto", "-q", "-o", str(page), "--csv", str(table)]
    assert main(given) == 0
    assert capsys.readouterr().out.splitlines()[0].split() == ["trap", "auto"]
    assert page.exists() and table.exists()
    assert main(["chart", "--hard", "gain 1", "auto", "--json"]) == 0
    cells = json.loads(capsys.readouterr().out)["cells"]
    assert {cell["verdict"] for cell in cells} == {"ok"}
    capsys.readouterr()
    # before minutes are spent on it; the known words are not blamed
    assert main(["chart", "--hard", "no such case", "trap", "tank"]) == 2
    said = capsys.readouterr().err
    assert "is called no such case;" in said and "tank 100 kHz" in said
    assert main(["chart", "--hard", "-o", "atlas.foo"]) == 2


def test_a_case_is_found_by_its_deck():
    """`hard/ramp_capacitor.cir` is the deck of the case `ringing`."""
    assert not atlas.strangers(["ramp_capacitor", "trap", "Tank"])
    assert [case.name for case in CASES if atlas.called(case, "ramp_capacitor")] == ["ringing"]

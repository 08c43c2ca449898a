"""References, renaming, signature help and hover on waveforms: what the language server answers, asked of its functions."""

from __future__ import annotations

import pytest

import emsim
from emsim.editor.document import Document
from emsim.editor.hover import hover
from emsim.editor.signature import signature
from emsim.editor.uses import NotRenamed, rename, uses

DECK = """a servo, whose arm swings: arm
.param gain=8 limit={gain+4}
.func clip(x) {min(max(x, -limit), limit)}
.gravity 9.81
BODY   arm    shape=rod(0.30) m=0.20  ; the arm
POINT  arm.tip 0.3 0
JOINT  hinge  0 arm pin zero=-90deg damp=2m
SPRING s1     arm.tip 0(1,1) k=1
MOTOR  m1     drive 0 hinge kt=20m r=2 l=1m j=2u gear=30
Vset   set    0 PULSE(0 1.5 10m 1m 1m 1 2)
Bamp   drive 0 V={clip(gain*v(set))}
.subckt filter in out r=1k
R1 in out {r}
C1 out 0 1u
.ends
Xf set out filter r=2k
R1 out 0 10k
D1 out 0 dm
.model dm D(is=1n tt=2n)
.tran 1m 10m
.step param gain list 8 9
.print tran angle(hinge) v(out) x(arm) i(r1)
.end
"""


def place(text: str, mark: str, inside: int = 0) -> tuple[int, int]:
    row, line = next((k, line) for k, line in enumerate(text.split("\n")) if mark in line)
    return row, line.index(mark) + inside


def words(text: str, mark: str, inside: int = 0) -> list[str]:
    """The lines' first words in which the name at a mark is used, as often as it is."""
    document = Document(text)
    assert not [d for d in document.diagnostics if d.severity == "error"]
    return [document.lines[row].split()[0] for row, _, _ in uses(document, *place(text, mark, inside))]


@pytest.mark.parametrize(
    ("mark", "inside", "where"),
    [
        ("gain=8", 0, [".param", ".param", "Bamp", ".step"]),
        ("limit), limit", 8, [".param", ".func", ".func"]),
        ("clip(gain", 0, [".func", "Bamp"]),
        ("arm pin", 0, ["BODY", "POINT", "JOINT", "SPRING", ".print"]),
        ("hinge  0", 0, ["JOINT", "MOTOR", ".print"]),
        ("Vset", 0, ["Vset"]),
        ("set out filter", 0, ["Vset", "Bamp", "Xf"]),
        ("in out {r}", 0, [".subckt", "R1"]),
        ("C1 out", 3, [".subckt", "R1", "C1"]),
        ("Xf set out", 7, ["Xf", "R1", "D1", ".print"]),
        ("filter r=2k", 0, [".subckt", "Xf"]),
        ("dm D", 0, ["D1", ".model"]),
        ("i(r1)", 2, ["R1", ".print"]),
        ("R1 in", 0, ["R1"]),
        ("the arm", 5, []),
        ("tran 1m", 0, []),
    ],
)
def test_a_name_is_found_where_it_is_used_and_nowhere_else(mark: str, inside: int, where: list[str]) -> None:
    assert words(DECK, mark, inside) == where


@pytest.mark.parametrize(
    ("mark", "inside", "old", "new"),
    [
        ("gain=8", 0, "gain", "amplify"),
        ("BODY   arm", 8, "arm", "lever"),
        ("Xf set out", 7, "out", "17"),
        ("hinge  0", 0, "hinge", "axle"),
    ],
)
def test_a_deck_with_another_name_runs_as_before(mark: str, inside: int, old: str, new: str) -> None:
    document = Document(DECK)
    lines = list(document.lines)
    for row, start, end in reversed(rename(document, *place(DECK, mark, inside), new)):
        assert lines[row][start:end].lower() == old
        lines[row] = lines[row][:start] + new + lines[row][end:]
    before, after = emsim.run(DECK).main, emsim.run("\n".join(lines)).main
    assert [name.replace(old, new) for name in before.names] == after.names
    assert all(list(before[a]) == list(after[b]) for a, b in zip(before.names, after.names, strict=True))
    assert lines[0] == document.lines[0], "the title is nobody's name"


@pytest.mark.parametrize(
    ("mark", "inside", "new", "why"),
    [
        ("R1 out", 0, "C7", "the first letter of r1 says what it is"),
        ("gain=8", 0, "limit", "there is a param limit already"),
        ("gain=8", 0, "2x", "is no name for a param"),
        ("out {r}", 5, "value", "lines that use subcircuit filter give r="),
        ("0 PULSE", 0, "earth", "ground is 0"),
        ("arm.tip 0(", 5, "leg.tip", "is a point of arm"),
        (".tran", 1, "x", "there is no name here"),
    ],
)
def test_what_would_change_the_deck_is_refused(mark: str, inside: int, new: str, why: str) -> None:
    with pytest.raises(NotRenamed, match=why):
        rename(Document(DECK), *place(DECK, mark, inside), new)


@pytest.mark.parametrize(
    ("text", "due", "about"),
    [
        ("V1 a 0 PULSE(", "v1", "v1 [V]"),
        ("V1 a 0 PULSE(0 1 ", "td", "td [s], if left out 0"),
        ("V1 a 0 PULSE(0, {2*(3+k)} 1m ", "tr", "tr [s], if left out tstep, or 0"),
        ("V1 a 0 PWL(0 0 1m ", "v1", "v1 [V]"),
        ("B1 a 0 V={clip(1, ", None, ""),
        ("B1 a 0 V={pow(2, ", "y", ""),
        ("R1 a ", "n-", ""),
        ("MOTOR m1 a ", "n-", ""),
        (".tran 1m ", "tstop", ""),
    ],
)
def test_signature_help_says_what_is_due(text: str, due: str | None, about: str) -> None:
    deck = f"title\n.func clip(x) {{x}}\n{text}\n.end"
    found = signature(Document(deck), 2, len(text))
    assert found is not None
    assert (found.label[slice(*found.parts[found.active])] if found.active >= 0 else None) == due
    assert found.about == about


def test_where_nothing_is_due_nothing_is_said() -> None:
    document = Document("title\n* PULSE(\nR1 a 0 1k\n.end")
    assert (
        signature(document, 0, 3) is None
        and signature(document, 1, 8) is None
        and signature(document, 2, 1) is None
    )


def test_hover_on_a_waveform_and_on_its_numbers() -> None:
    document = Document(DECK)
    said = hover(document, *place(DECK, "PULSE"))
    assert said is not None and "PULSE(v1 v2 td tr tf pw per n)" in said and "| `td` | s | 0 |" in said
    said = hover(document, *place(DECK, "10m 1m"))
    assert said == "`10m` is 0.01\n\ntd [s], if left out 0"

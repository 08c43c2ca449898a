"""The catalogue of messages, emsim/messages/: every code of the sources has its entry, every example gives its code, every
mended deck runs without it, and every message reads as it was last looked at.

The messages stand in golden/, one file a family; after a change, look at what `git diff` shows of

    python tests/messages/test_catalogue.py --write
"""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Callable
from concurrent.futures import BrokenExecutor
from functools import cache
from pathlib import Path

import pytest

from emsim.cli.explain import blocks, perform, text_of
from emsim.reports.codes import FAMILIES, FOLDER, Entry, catalogue

ROOT = Path(__file__).resolve().parent.parent.parent
GOLDEN = Path(__file__).resolve().parent / "golden"
CODE = re.compile(r"[EWN]\d{3}")
ENTRIES = catalogue()
WITH_DECK = [code for code, entry in ENTRIES.items() if entry.command]
CODES_WITH_DECK = [code for code in WITH_DECK if CODE.fullmatch(code)]


def codes_of_the_sources() -> set[str]:
    """Every string of the Python sources that is a code; the engine writes none."""
    found = set()
    for path in (ROOT / "emsim").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Constant) and isinstance(node.value, str) and CODE.fullmatch(node.value):
                found.add(node.value)
    return found


def test_every_code_has_an_entry_and_every_entry_a_code():
    known = {code for code in ENTRIES if CODE.fullmatch(code)}
    assert codes_of_the_sources() - known == set(), "codes without an entry in emsim/messages/"
    assert known - codes_of_the_sources() == set(), "entries of codes that nothing says"


def test_the_engine_writes_no_code():
    for path in (ROOT / "emsim" / "engine").rglob("*.rs"):
        assert not re.search(r'"[EWN]\d{3}', path.read_text(encoding="utf-8")), path


# one defect in two worlds: a voltage or a motion prescribed twice, or around a ring; something undetermined; a current or a
# force that nothing takes up
TWO_WORLDS = [("E301", "E245"), ("E301", "E242"), ("W302", "E243"), ("E303", "E243"), ("E303", "E410")]


@pytest.mark.parametrize(("circuit", "machine"), TWO_WORLDS)
def test_what_is_one_defect_in_two_worlds_is_told_in_both(circuit, machine):
    assert re.search("same|nowhere", ENTRIES[circuit].meaning) and machine in ENTRIES[circuit].meaning
    assert circuit in ENTRIES[machine].meaning


def test_every_file_is_read():
    assert sorted(path.stem for path in Path(FOLDER).glob("*.md")) == sorted(FAMILIES)


@cache
def ran(code: str, fixed: bool) -> tuple[int, str]:
    entry = ENTRIES[code]
    if fixed:
        return perform(entry.fixed_command, entry.fixed)
    return perform(entry.command, entry.example)


def steady(code: str, said: str) -> str:
    """Without what differs from machine to machine: how long something takes, the last digits of rounding. How a run went in
    numbers (E410, W410, E516 and the like) is for test_failures.py and tests/stability/test_watch.py; here they are #."""
    said = re.sub(r"met to [\d.e-]+ by", "met to .. by", said)
    said = re.sub(r"about [\d.e+]+ (s|minutes|hours|days) at this speed", "about .. at this speed", said)
    if code[1] == "4" or code == "E516":
        lines = [
            re.sub(r"(?<![\w`(])-?\d[\d.]*(e[+-]?\d+)?\b", "#", line)
            if re.match(r"error|warn| += help", line)
            else line
            for line in said.split("\n")
        ]
        said = "\n".join(lines)
    return re.sub(r"\S*/tmp\S*/(?=\w)|/private\S*/", "", said)


def message(code: str) -> str:
    if code in FORCED:
        return steady(code, forced(code))
    said = ran(code, False)[1]
    return steady(
        code, "\n\n".join(text for found, text in blocks(said) if found == code) or said.rstrip("\n")
    )


# ---- what no deck gives: the machine that it runs on is changed ----------------------------------

RC = "low-pass\nV1 in 0 SIN(0 1 1k)\nR1 in out 1k\nC1 out 0 1u\n.tran 10u 2m\n.end\n"
HERE, WRONG, COMPARE = "emsim deck.cir", "emsim wrong.cir", "emsim compare deck.cir"
SHARED = COMPARE + " --engine shared"
LIBRARY = "PySpice.Spice.NgSpice.Shared.NgSpiceShared.new_instance"


def raising(error: BaseException):
    def fails(*_: object, **__: object) -> object:
        raise error

    return fails


def refused(*_: object, **__: object) -> object:
    from emsim.interop.ngspice import NgspiceError

    raise NgspiceError("Error: no such function")


def with_ngspice(patch: pytest.MonkeyPatch, run: Callable[..., object]) -> None:
    """As if the program were there, whether it is or not."""
    patch.setattr("emsim.interop.ngspice.find", lambda: "ngspice")
    patch.setattr("emsim.interop.ngspice.run", run)


def without_grammar(patch: pytest.MonkeyPatch) -> None:
    """The grammar is read where a line is wrong."""
    from emsim import lark_grammar

    patch.setattr(lark_grammar, "_parser", None)
    patch.setattr(lark_grammar.os.path, "exists", lambda path: False)


def with_a_stuck_flag(patch: pytest.MonkeyPatch) -> None:
    """The first condition does not turn."""
    from emsim.assemble import options

    resolve = options.resolve
    patch.setattr(options, "resolve", lambda *a, **k: {**resolve(*a, **k), "stuck_flag": 0})


def with_a_spoiled(place: int):
    """Rows show this unknown wrongly by a tenth."""

    def change(patch: pytest.MonkeyPatch) -> None:
        from emsim.assemble import options

        resolve = options.resolve
        patch.setattr(options, "resolve", lambda *a, **k: {**resolve(*a, **k), "spoiled": place})

    return change


TWO_PEAKS = "two peaks\n.param a=1\nV1 x 0 PWL(0 0 1m {a} 2m 0 3m 1 4m 0)\n.tran 20u 4m\n.meas tran top max v(x)\n.end\n"


def with_a_gradient(patch: pytest.MonkeyPatch) -> None:
    """Derivatives are asked for by Python alone."""
    import emsim

    patch.setattr("emsim.pipeline.solve", lambda *_, **__: emsim.Deck(TWO_PEAKS).gradient())


def with_crowded_events(patch: pytest.MonkeyPatch) -> None:
    """What a gradient says of events all but at one instant."""
    from emsim import pipeline
    from emsim.gradients.moved import at_one_instant

    solve = pipeline.solve

    def told(assembly, *given, **more):
        assembly.flat.sink.add(at_one_instant("r1", 1e-3))
        return solve(assembly, *given, **more)

    patch.setattr(pipeline, "solve", told)


# code: (command, what is changed)
FORCED = {
    "E443": (HERE, with_a_gradient),
    "W443": (HERE, with_crowded_events),
    "E153": ("emsim including.cir", lambda p: p.setattr("emsim.elaborate.files.MAX_INCLUDES", 0)),
    "E372": ("emsim draw deck.cir", lambda p: p.setattr("emsim.schematic.picture.MOST", 2)),
    "W351": (
        "emsim draw deck.cir",
        lambda p: p.setattr("emsim.schematic.picture.differences", lambda *_: ["r1 is not drawn"]),
    ),
    "W352": (
        "emsim --html page.html deck.cir",
        lambda p: p.setattr("emsim._engine.arrange_diagram", raising(ValueError("no place"))),
    ),
    "E421": ("emsim chart --alone deck.cir", lambda p: p.setattr("emsim.reports.reference.WORST", 0.0)),
    "E499": (HERE, lambda p: p.setattr("emsim.pipeline.solve", raising(RuntimeError("a bug")))),
    "E502": (WRONG, without_grammar),
    "E433": (
        "emsim sweep deck.cir -D c1=1u,2u -j 1",
        lambda p: p.setattr("emsim.sweeps.runs.Runner.run", raising(KeyboardInterrupt())),
    ),
    "E522": ("emsim sweep deck.cir -D c1=1u,2u --dask tcp://127.0.0.1:9", lambda p: None),
    "E523": (
        "emsim sweep deck.cir -D c1=1u,2u -j 2",
        lambda p: p.setattr("concurrent.futures.ProcessPoolExecutor.submit", raising(BrokenExecutor())),
    ),
    "W404": ("emsim gate.cir", with_a_stuck_flag),
    "W420": ("emsim bar.cir", lambda p: p.setattr("emsim.analyses.afterwards.stepped", lambda run: [1e-3])),
    "W433": (
        "emsim fit deck.cir data.csv -p c1",
        lambda p: p.setattr("emsim.fits.fitted.RUNS", 1),
    ),
    "W406": ("emsim divider.cir", with_a_spoiled(1)),
    "W407": ("emsim bar.cir", with_a_spoiled(0)),
    "E505": ("emsim chart --hard", lambda p: p.setattr("pathlib.Path.is_file", lambda path: False)),
    "E508": (
        "emsim view --live --no-open --port 8123 deck.cir",
        lambda p: p.setattr(
            "emsim.live.server.Server.__init__", raising(OSError(98, "Address already in use"))
        ),
    ),
    "E509": (HERE, lambda p: p.setattr("emsim.pipeline.solve", raising(MemoryError()))),
    "E511": (COMPARE, lambda p: with_ngspice(p, refused)),
    "E512": (SHARED, lambda p: p.setitem(sys.modules, "PySpice.Spice.NgSpice.Shared", None)),
    "E513": (SHARED, lambda p: p.setattr(LIBRARY, raising(OSError("cannot open libngspice.so")))),
    "E521": ("emsim chart --alone -o out.png deck.cir", lambda p: p.setitem(sys.modules, "matplotlib", None)),
}


@cache
def forced(code: str) -> str:
    command, change = FORCED[code]
    with pytest.MonkeyPatch.context() as patch:
        change(patch)
        files = {
            "wrong.cir": RC.replace("out 1k", "out {1k"),
            "including.cir": "t\n.include parts.inc\n",
            "parts.inc": "* none\n",
            "divider.cir": "divider\nV1 a 0 SIN(0 1 1k)\nR1 a b 1k\nR2 b 0 1k\n.tran 10u 1m\n.end\n",
            "bar.cir": BAR,
            "data.csv": "time,v(out)\n0,0\n5e-4,0.4\n1e-3,0.6\n1.5e-3,0.7\n2e-3,0.8\n",
            "gate.cir": "gate\nV1 d 0 PULSE(0 1 1m 1u 1u 1m 3m)\nB1 o 0 V={v(d)>0 ? 5 : 0}\n.tran 10u 5m\n.end\n",
        }
        _, said = perform(command, {"deck.cir": RC, **files})
    return "\n\n".join(text for found, text in blocks(said) if found == code)


BAR = """four-bar linkage
BODY crank shape=rod(0.10) m=0.10
BODY coupler shape=rod(0.24) m=0.24
BODY rocker shape=rod(0.20) m=0.20
JOINT a 0 crank pin ic=(0,10)
JOINT b crank(0.10,0) coupler pin guess=56deg
JOINT d 0(0.22,0) rocker pin guess=86deg
JOINT close coupler(0.24,0) rocker(0.20,0) pin
.tran 10m 0.5
.end
"""

# what stands beside the code, and why
ALSO = {
    "N137": {"E307"},  # no transistor has a kt=
    "W236": {"N231"},  # what only can stand still has no degree of freedom
}


@pytest.mark.parametrize("code", CODES_WITH_DECK)
def test_the_example_gives_its_code_and_no_other(code):
    exit, said = ran(code, False)
    if code == "E520":  # written without a code, for who typed it is there
        assert exit == 2 and said.startswith("emsim: "), said
        return
    assert {found for found, _ in blocks(said)} == {code} | ALSO.get(code, set()), said
    assert (exit == 0) == (code[0] != "E" and code != "N137"), said


@pytest.mark.parametrize("code", [code for code in ENTRIES if ENTRIES[code].fixed_command])
def test_the_mended_deck_runs_and_says_nothing(code):
    exit, said = ran(code, True)
    assert exit == 0 and not list(blocks(said)), said


@pytest.mark.parametrize("code", [code for code in WITH_DECK if code.startswith("exit")])
def test_an_exit_code_is_what_its_example_ends_with(code):
    assert f"exit {ran(code, False)[0]}" == code


@cache
def golden() -> dict[str, str]:
    found: dict[str, str] = {}
    for path in GOLDEN.glob("*.txt"):
        for part in path.read_text(encoding="utf-8").split("==== ")[1:]:
            code, _, text = part.partition("\n")
            found[code] = text.strip("\n")
    return found


@pytest.mark.parametrize("code", [*CODES_WITH_DECK, *FORCED])
def test_the_message_reads_as_it_was_looked_at(code):
    assert message(code) == golden().get(code), "python tests/messages/test_catalogue.py --write"


def test_every_code_has_its_message():
    assert set(golden()) == {code for code in ENTRIES if CODE.fullmatch(code)} == {*CODES_WITH_DECK, *FORCED}


@pytest.mark.parametrize("code", ENTRIES)
def test_an_entry_is_whole(code):
    entry = ENTRIES[code]
    assert entry.title[0].isupper() or entry.title[0] in ".-`", entry.title
    assert len(entry.title) < 70 and entry.meaning and entry.remedy, code
    assert "".join(text_of(entry, "")).startswith(code)


def write() -> None:
    GOLDEN.mkdir(exist_ok=True)
    families: dict[str, list[Entry]] = {}
    for path in sorted(Path(FOLDER).glob("*.md")):
        heads = re.findall(r"^## ([EWN]\d{3}) ", path.read_text(encoding="utf-8"), re.M)
        families[path.stem] = [ENTRIES[code] for code in heads]
    for name, entries in families.items():
        text = "\n\n\n".join(f"==== {e.code}\n{message(e.code)}" for e in entries)
        if text:
            (GOLDEN / f"{name}.txt").write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    if sys.argv[1:] != ["--write"]:
        sys.exit(__doc__)
    write()

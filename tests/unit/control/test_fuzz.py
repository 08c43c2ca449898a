"""Short programs made at random: none ends in an internal error, hangs, or writes a file outside of its folder."""

from __future__ import annotations

import os
import random
import time
from pathlib import Path

import pytest

import emsim
from emsim import pipeline
from emsim.control import COMMANDS, Section
from emsim.control.program import FLOW
from emsim.elaborate.altered import Altered
from emsim.result import Result

TEXT = "t\n.param r=1k\nV1 in 0 DC 1 AC 1\nR1 in out {r}\nC1 out 0 1u\nD1 out 0 dm\n.model dm d\n.op\n.control\n{}\n.endc\n.end\n"
WORDS = [*COMMANDS, *FLOW, "bogus"]
PIECES = """
    v(out) v(in) i(v1) out v1#branch @r1[i] @r1[resistance] time frequency all op1 op1.v(out) const.pi a b c x y 1 2 3
    0 -1 1k 1e-3 1e300 nan inf + - * / ^ % , ( ) [ ] [[ ]] { } = == <> < > >= <= ? : & | ~ not and or eq gt mag( db(
    ph( avg( deriv( integ( vector( length( sgauss( interpolate( group_delay( fft( $a $b $&a $&x $curplot $plots $#b
    $?a $a[1] $a[9] $$ ` ' " \\ ; // $ vs values start= stop= step= lin= dec= r1 r9 v1 dc dm is 1u 1m 10 dec lin oct
    uic new const tran1 ac1 ../x.txt /tmp/emsim_fuzz_outside ~/x x.raw x.txt x.png all none voltage xlimit title {a,b}
    break 2 top label goto hamming µ é \t # @ @@ @r1 @r1[ v( ) ))
""".split()
MOST = 3000  # programs
LIMIT = 300  # commands of each


def programs(seed: int, count: int):
    rng = random.Random(seed)
    for _ in range(count):
        lines, depth = [], 0
        for _ in range(rng.randint(1, 8)):
            word = rng.choice(WORDS)
            lines.append(" ".join([word, *(rng.choice(PIECES) for _ in range(rng.randint(0, 6)))]))
            depth += (word in ("if", "while", "dowhile", "repeat", "foreach")) - (word == "end")
        # most programs close their blocks, so that they are carried out
        lines += ["end"] * max(depth, 0) if rng.random() < 0.9 else []
        yield "\n".join(lines)


def carried_out(commands: str) -> Section:
    """The section, with the analyses of a deck that is computed once: thousands of programs in a short time."""
    text = TEXT.replace("{}", commands, 1)
    deck = pipeline.load(text)
    flat = pipeline.flatten(deck)

    def analyse(flat, cards) -> Result:
        flat.analyses = cards
        assembly, planned = pipeline.prepare(flat)
        return pipeline.deliver(assembly, pipeline.solve(assembly, planned))

    session = Section(COMMANDS, Altered(deck, flat), analyse, lambda text: None, most=LIMIT)
    session.run(flat.commands)
    session.tables()
    return session


@pytest.fixture
def folder(tmp_path, monkeypatch):
    inner = tmp_path / "inner"
    inner.mkdir()
    (tmp_path / "home").mkdir()
    monkeypatch.chdir(inner)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    return inner


@pytest.mark.parametrize("seed", range(6))
def test_no_program_ends_in_an_internal_error(seed, folder):
    outside = Path("/tmp/emsim_fuzz_outside")
    outside.unlink(missing_ok=True)
    began = set(os.listdir(folder.parent))
    for commands in programs(seed, MOST // 6):
        start = time.monotonic()
        try:
            carried_out(commands)
        except (emsim.DeckError, emsim.ConvergenceError, emsim.OutsideError):
            pass
        except Exception as error:
            raise AssertionError(f"{type(error).__name__}: {error}\n{commands}") from error
        assert time.monotonic() - start < 20, commands
    assert set(os.listdir(folder.parent)) == began and not outside.exists()


REFUSED = [
    "wrdata ../x.txt v(out)",
    "write /tmp/emsim_fuzz_outside.raw",
    "hardcopy ../../x.png v(out)",
    "wrdata ~/x v(out)",
]


@pytest.mark.parametrize("command", REFUSED)
def test_nothing_outside_is_written_or_read(command, folder):
    result = emsim.run(TEXT.replace("{}", f"op\n{command}", 1))
    assert {d.code for d in result.diagnostics if d.severity == "error"} <= {"E163", "E166"}
    assert any(d.severity == "error" for d in result.diagnostics)
    assert os.listdir(folder) == [] and not Path("/tmp/emsim_fuzz_outside.raw").exists()


def test_a_link_does_not_lead_outside(folder):
    os.symlink("/tmp", folder / "out")
    result = emsim.run(TEXT.replace("{}", "op\nwrdata out/emsim_fuzz_outside v(out)", 1))
    assert [d.code for d in result.diagnostics if d.severity == "error"] == ["E163"]


def test_a_loop_that_never_ends_is_an_error(folder):
    session = carried_out("while 1\nend")
    assert [d.code for d in session.sink.diagnostics] == ["E165"]


def test_a_file_that_sources_itself_is_an_error(folder):
    (folder / "again.txt").write_text("echo x\nsource again.txt\n")
    session = carried_out("source again.txt")
    assert [d.code for d in session.sink.diagnostics] == ["E165"]

"""The grammar and its tables: where they come from, how they are kept, and that the first use does not matter."""

from __future__ import annotations

import os
import subprocess
import sys
import time

import pytest

from emsim import lark_grammar, parsed
from emsim.source import Line, SourceFile


def line(text: str) -> Line:
    return Line(SourceFile("x", text), 1, 1, 0, len(text))


def tree(text: str, start: str = "element"):
    return parsed.parse_line(line(text), start)


def test_a_tree_is_rule_and_leaves_with_places():
    rule, (name, p, n, value) = tree("Rload in out 10k")
    assert rule == "resistor"
    assert [(str(leaf), leaf.type, leaf.start_pos, leaf.end_pos) for leaf in (name, p, n, value)] == [
        ("Rload", "R_NAME", 0, 5),
        ("in", "WORD", 6, 8),
        ("out", "WORD", 9, 12),
        ("10k", "WORD", 13, 16),
    ]


CORPUS = [
    ("R1 a b R={v(a)*2} tc1=1m", "element"),
    ("V1 a 0 DC 1 AC 1 90 SIN(0 1 1k)", "element"),
    ("E1 a b TABLE {v(c)} = (0,0) (1,2)", "element"),
    ("JOINT h 0 arm(0.3,0) pin zero=-90deg ic=(0,1)", "machine_card"),
    (".param a=1 b={a*2} f(x)=x^2", "dot"),
    (".model d D(is=1n rs={x})", "dot"),
    ("a>1?-b^2:v(c,d)", "expression"),
]


@pytest.fixture(scope="module")
def fresh_and_kept(tmp_path_factory):
    """The parser of the grammar's text, and the one of its tables after they were written and read."""
    import lark

    text = lark_grammar.grammar_text()
    fresh = lark_grammar.build_parser(text)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        lark_grammar._write_cache(lark_grammar._cache_file(text, "x"), fresh)
        tables = lark_grammar._read_cache(lark_grammar._cache_file(text, "x"))
    return fresh, lark.Lark._load_from_dict(*tables, transformer=lark_grammar._Trees())


@pytest.mark.parametrize(("text", "start"), CORPUS)
def test_cached_tables_give_the_tree_of_the_grammar(text, start, fresh_and_kept):
    fresh, kept = fresh_and_kept
    assert kept.parse(text, start) == fresh.parse(text, start)


def run(code: str, **env: str) -> str:
    here = os.path.dirname(os.path.dirname(os.path.abspath(parsed.__file__)))
    result = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "PYTHONPATH": here, **env},
    )
    return result.stdout


# a line with an error is Lark's
READ = "from emsim.build import read; print(read('t\\nR1 a\\n').sink.diagnostics)"


def test_tables_are_kept_for_the_user_alone(tmp_path):
    expected = "[<error[E103] at <text>:2:5: the line ends too early: a name or value is missing>]\n"
    assert run(READ, XDG_CACHE_HOME=str(tmp_path)) == expected
    (kept,) = os.listdir(tmp_path / "emsim")
    assert os.stat(tmp_path / "emsim").st_mode & 0o077 == 0
    assert os.stat(tmp_path / "emsim" / kept).st_mode & 0o077 == 0
    assert run(READ, XDG_CACHE_HOME=str(tmp_path)) == expected
    # a damaged file is built anew
    (tmp_path / "emsim" / kept).write_bytes(b"\x00nonsense")
    assert run(READ, XDG_CACHE_HOME=str(tmp_path)) == expected


def test_a_folder_that_others_can_write_is_not_used(tmp_path):
    (tmp_path / "emsim").mkdir()
    os.chmod(tmp_path / "emsim", 0o777)
    run(READ, XDG_CACHE_HOME=str(tmp_path))
    assert os.listdir(tmp_path / "emsim") == []


def test_a_link_is_not_followed(tmp_path):
    (tmp_path / "elsewhere").mkdir(mode=0o700)
    os.symlink(tmp_path / "elsewhere", tmp_path / "emsim")
    run(READ, XDG_CACHE_HOME=str(tmp_path))
    assert os.listdir(tmp_path / "elsewhere") == []


def test_no_cache_is_no_trouble(tmp_path):
    (tmp_path / "file").write_text("")
    assert "E103" in run(READ, XDG_CACHE_HOME=str(tmp_path / "file"))
    assert "E103" in run(READ, XDG_CACHE_HOME="relative/path")


def test_importing_the_front_end_imports_no_lark():
    code = (
        "import emsim.build, emsim.elaborate, sys; "
        "print([m for m in ('lark', 'numpy', 'argparse', 'dataclasses', 'typing', 're') if m in sys.modules])"
    )
    assert run(code) == "[]\n"


def test_fifty_thousand_cards_stay_within_the_budget():
    """A tenth of the benchmark, in processor time, with room for a busy machine; see tests/bench/frontend.py."""
    from emsim.build import read
    from emsim.elaborate import flatten

    text = (
        "t\n"
        + "\n".join(f"R{k} n{k} n{k + 1} 1k\nC{k} n{k + 1} 0 {{c0*2}}" for k in range(2500))
        + "\n.param c0=1p\n"
    )
    flatten(read("t\nR1 a 0 1\n"))
    start = time.process_time()
    deck = flatten(read(text))
    assert len(deck.elements) == 5000
    assert time.process_time() - start < 1.2

"""The command line's own parser."""

from __future__ import annotations

import pytest

from emsim.cli.arguments import DEFINE, QUIET, Option, UsageError, defines, describe, number, parse

OPTIONS = [
    Option("-o --output", "file", "FILE"),
    Option("--ascii", "text"),
    Option("--reltol", "x", "X"),
    DEFINE,
    QUIET,
]


@pytest.mark.parametrize(
    "args",
    [
        ["-o", "x.raw", "d.cir"],
        ["-ox.raw", "d.cir"],
        ["d.cir", "--output=x.raw"],
        ["d.cir", "--output", "x.raw"],
    ],
)
def test_spellings_of_a_value(args):
    given = parse(args, OPTIONS)
    assert given.text("output") == "x.raw" and given.words == ["d.cir"]


def test_the_last_value_wins_but_defines_add_up():
    given = parse(["-o", "a", "-o", "b", "-Dr=1k", "-D", "C=2u", "--define=x={r*2}"], OPTIONS)
    assert given.text("output") == "b" and defines(given) == {"r": "1k", "c": "2u", "x": "{r*2}"}


def test_dash_is_a_word_and_two_dashes_end_the_options():
    assert parse(["-"], OPTIONS).words == ["-"]
    assert parse(["--", "--ascii"], OPTIONS).words == ["--ascii"]


@pytest.mark.parametrize(
    ("args", "says"),
    [
        (["--asci"], "did you mean --ascii"),
        (["--retol=1"], "unknown option --retol, did you mean --reltol"),
        (["-x"], "unknown option -x"),
        (["-q1"], "unknown option -q1"),
        (["--output"], "--output needs a value: --output FILE"),
        (["--ascii=yes"], "--ascii takes no value"),
    ],
)
def test_mistakes_are_named(args, says):
    with pytest.raises(UsageError, match=says):
        parse(args, OPTIONS)


@pytest.mark.parametrize(
    ("text", "value"), [("10u", 1e-5), ("1meg", 1e6), ("0.5%", 0.005), ("1e-3", 1e-3), ("2ms", 2e-3)]
)
def test_numbers(text, value):
    assert number(text) == value


@pytest.mark.parametrize("text", ["", "x", "5kg", "10u%", "%", "1..2"])
def test_what_is_no_number(text):
    assert number(text) is None


@pytest.mark.parametrize("text", ["0", "-1", "nan", "1e999", "abc"])
def test_numbers_of_options_are_positive(text):
    with pytest.raises(UsageError, match="not a positive number"):
        parse([f"--reltol={text}"], OPTIONS).number("reltol")


@pytest.mark.parametrize("text", ["r", "=1", "r=", " = "])
def test_a_define_has_a_name_and_a_value(text):
    with pytest.raises(UsageError, match="write -D name=value"):
        defines(parse(["-D", text], OPTIONS))


def test_one_deck():
    for words, says in ([], "needs a deck"), (["a.cir", "b.cir"], "one deck at a time"):
        with pytest.raises(UsageError, match=says):
            parse(words, OPTIONS).deck("run")


def test_help_lists_every_option():
    text = describe(OPTIONS)
    assert all(name in text for option in OPTIONS for name in option.names) and "-o, --output FILE" in text

"""Broken texts: every one is told with its line, what is wrong, and the cure; texts that nobody wrote end without a panic."""

from __future__ import annotations

import random
import time
from pathlib import Path

import pytest

from emsim import _engine

HEAD = '`include "disciplines.vams"\nmodule m(a, b);\ninout a, b;\nelectrical a, b;\n'
TAIL = "endmodule\n"


def body(line, declared="parameter real r = 1 from (0:inf); real x;"):
    """Line 7 of the text is what is looked at."""
    return f"{HEAD}{declared}\nanalog begin\n{line}\nend\n{TAIL}"


# name: text, line, a part of what is said, a part of the cure
BROKEN = {
    "no semicolon": (body("x = 1\nI(a, b) <+ x;"), 7, "a ; is missing before I", "end with ;"),
    "assigned branch": (body("I(a, b) = V(a, b);"), 7, "cannot be assigned to", "<+"),
    "unknown variable": (body("y = 1;"), 7, "there is no variable y", "declare it"),
    "variable misspelled": (
        body("I(a, b) <+ curent;", "real current;"), 7, "curent is not declared", "did you mean current?",
    ),
    "parameter assigned": (body("r = 2;"), 7, "r is a parameter", "declare a variable"),
    "multiplicity misspelled": (
        body("x = 1;", '(* desc="x", multiplicity="multiplied" *) real x;'),
        5, 'there is no multiplicity "multiplied"', '"multiply", "divide"',
    ),
    "unknown function": (body("x = sqr(2);"), 7, "there is no function sqr", "sqrt"),
    "too many arguments": (body("x = sin(1, 2);"), 7, "sin takes 1 arguments, here are 2", ""),
    "unknown node": (body("I(a, c) <+ 1;"), 7, "there is no node or branch c", "electrical"),
    "node as a value": (body("x = a;"), 7, "a is not declared", ""),
    "unknown macro": (body("x = `M_PJ;"), 7, "the macro `M_PJ is not defined", "`define"),
    "constants not included": (body("x = `M_PI;"), 7, "the macro `M_PI is not defined", "`include"),
    "macro without arguments": ("`define F(x) x\n" + body("x = `F;"), 8, "`F takes arguments", "`F(...)"),
    "macro with one argument too few": (
        "`define F(x, y) x\n" + body("x = `F(1);"), 8, "`F takes 2 arguments, here are 1", "commas",
    ),
    "macro that uses itself": ("`define F `F\n" + body("x = `F;"), 1, "uses itself", "never end"),
    "endif missing": ("`ifdef F\n" + body("x = 1;"), 1, "has no `endif", "`endif"),
    "endif too many": (body("`endif"), 7, "`endif without its `ifdef", "take it out"),
    "include of no file": (body('`include "nowhere.va"'), 7, "there is no file nowhere.va", "include folders"),
    "string not closed": (body('$strobe("x);'), 7, "this string has no end", '"'),
    "comment not closed": (body("/* x = 1;"), 7, "this comment has no end", "*/"),
    "number with a unit": (body("x = 10kOhm;"), 7, "10kOhm is no number", "units are not written"),
    "strange character": (body("x = 1 § 2;"), 7, "means nothing", ""),
    "end missing": (HEAD + "analog begin\nI(a, b) <+ 1;\n" + TAIL, 7, "endmodule is not expected", "end"),
    "endmodule missing": (HEAD + "analog I(a, b) <+ 1;\n", 5, "the text ends too early", "endmodule"),
    "bracket missing": (body("x = (1 + 2;"), 7, "; is not expected here", ")"),
    "digital parts": (HEAD + "always begin end\n" + TAIL, 5, "always belongs to digital", "analog begin"),
    "unknown discipline": (
        "module m(a);\ninout a;\nelectrical a;\n" + TAIL, 3, "there is no discipline electrical", "disciplines.vams",
    ),
    "port without discipline": (
        HEAD.replace("electrical a, b", "electrical a") + TAIL, 2, "the port b has no discipline", "electrical",
    ),
    "net that is no port": (HEAD + "input c;\n" + TAIL, 5, "c is no port", "brackets"),
    "declared twice": (HEAD + "real x;\ninteger x;\n" + TAIL, 6, "x is declared twice", "another name"),
    "alias of nothing": (HEAD + "aliasparam s = t;\n" + TAIL, 5, "there is no parameter t", ""),
    "unknown task": (body('$strob("x");'), 7, "$strob is not supported", "$strobe"),
    "contribution to a number": (body("sin(1) <+ 2;"), 7, "only potentials and flows", "I(a, b) <+"),
}  # fmt: skip

# told when the module is run with its parameters
REFUSED = {
    "heat of an electrical node": (body("I(a, b) <+ Temp(a);"), 7, "does not fit the discipline electrical", "V()"),
    "whole division by zero": (body("x = 1 / 0; I(a, b) <+ x;"), 7, "by 0", "1.0"),
    "root of a negative number": (body("I(a, b) <+ sqrt(-r);"), 7, "sqrt(-1) has no value", "parameters"),
    "index outside": (body("w[5] = 1; I(a, b) <+ w[5];", "real w[0:3];"), 7, "5 is outside of 0:3", ""),
    "endless loop": (body("x = 1; while (x > 0) x = x + 1; I(a, b) <+ x;"), 7, "too many steps", "loop"),
    "two kinds of contribution": (body("V(a) : V(b) == 0; V(a) <+ 1;"), 7, "given indirectly already", "keep one"),
    "limiting that is not known": (
        body('I(a, b) <+ $limit(V(a, b), "pnjlin", 1, 1);'), 7, "no limiting function pnjlin", "pnjlim",
    ),
    "default of itself": (body("I(a, b) <+ s;", "parameter real s = 2 * s;"), 5, "hangs on s itself", "number"),
    "no such simulation parameter": (body('I(a, b) <+ $simparam("x");'), 7, "no simulation parameter x", "default"),
    "the module refuses": (body('$error("no"); I(a, b) <+ 1;'), 7, "no", "refuses"),
    "not a number": (body("I(a, b) <+ (r - 1) / (r - 1.0);"), 2, "is no number for these parameters", "0/0"),
}  # fmt: skip


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_text_is_told_with_line_and_cure(name):
    text, line, said, cure = BROKEN[name]
    message = _engine.veriloga(text, "broken.va").messages[0]
    assert said in message["text"] and cure in message["hint"], message
    assert message["line"] == line and message["file"] == "broken.va"
    source = text.splitlines()[line - 1]
    assert message["source"] == source
    assert 1 <= message["column"] <= len(source) and message["length"] >= 1


@pytest.mark.parametrize("name", REFUSED)
def test_what_a_module_cannot_be_is_told_with_line_and_cure(name):
    text, line, said, cure = REFUSED[name]
    reading = _engine.veriloga(text, "broken.va")
    assert reading.messages == []
    with pytest.raises(ValueError) as error:
        reading.evaluate("m")
    [message] = error.value.args[0]
    assert said in message["text"] and cure in message["hint"] and message["line"] == line, message


def test_several_mistakes_are_told_at_once():
    messages = _engine.veriloga(body("x = y;\nx = z;\nI(a, q) <+ x;"), "broken.va").messages
    assert [m["line"] for m in messages] == [7, 8, 9]


def test_files_outside_of_the_include_folders_are_not_read(tmp_path):
    inside, secret = tmp_path / "inside", tmp_path / "secret.va"
    inside.mkdir()
    secret.write_text("`define SECRET 1\n")
    (inside / "link.va").symlink_to(secret)
    for name in ("../secret.va", str(secret), "link.va"):
        text = f'`include "{name}"\n'
        [message] = _engine.veriloga(text, str(inside / "m.va")).messages
        assert "outside of the include folders" in message["text"]
    [message] = _engine.veriloga('`include "inside"\n', str(tmp_path / "m.va")).messages
    assert "is no file of text" in message["text"]


@pytest.mark.parametrize(
    "text",
    [
        body("x = " + "(" * 20000 + "1" + ")" * 20000 + ";"),
        body("x = " + "-" * 20000 + "1;"),
        body("x = " + "1 + " * 20000 + "1;"),
        body("if (x) " * 5000 + "x = 1;"),
        body("begin " * 5000 + "end " * 5000),
        "".join(f"`define F{k} `F{k + 1} `F{k + 1}\n" for k in range(60)) + "`define F60 x\n`F0",
        "".join(f"`define F{k}(x) `F{k + 1}(x x)\n" for k in range(60)) + "`define F60(x) x\n`F0(1)",
        "`define F(x) x\n" + "`F(" * 5000 + ")" * 5000,
        "`ifdef A\n" * 100000,
        "`ifdef A\n" + "`\\\"" * 100000 + "\n`endif",
        body("x = f(1);", "real x; analog function real f; input x; real x; f = f(x); endfunction"),
        body("", "m inner(a, b);"),
    ],
    ids=[
        "brackets", "signs", "sum", "ifs", "blocks", "macros", "arguments", "nested arguments", "conditions", "garbage",
        "recursive function", "module in itself",
    ],
)  # fmt: skip
def test_deep_and_endless_texts_are_refused(text):
    begun = time.process_time()
    reading = _engine.veriloga(text, "deep.va")
    if not reading.messages and reading.modules:
        try:
            reading.evaluate("m")
        except ValueError as error:
            assert error.args[0]
    assert time.process_time() - begun < 20


def test_a_text_that_nobody_wrote_is_told_or_read():
    """Parts of texts cut, doubled, exchanged: messages or modules, never a panic (which would be no ValueError)."""
    folder = Path(_engine.__file__).parent / "devices"
    seeds = [t for t, *_ in (*BROKEN.values(), *REFUSED.values())]
    seeds += [f.read_text(encoding="utf-8") for f in sorted(folder.glob("*.va"))[:3]]
    words = [
        *(
            "`define F(x) x",
            "`F(",
            "begin",
            "end",
            "<+",
            "V(a,b)",
            "I(a)",
            "ddt(",
            "[",
            "]",
            "(*",
            "*)",
            "1e999",
            '"',
            "§",
        ),
        *(
            "if",
            "else",
            "`ifdef",
            "`endif",
            "while(1)",
            "repeat(1e9)",
            "x",
            "-",
            "/0",
            "analog",
            "branch",
            "$limit(",
        ),
        *("case", "endcase", "'{"),
    ]
    draw = random.Random(1)
    begun = time.process_time()
    for _ in range(400):
        text = draw.choice(seeds)
        for _ in range(draw.randint(1, 6)):
            i = draw.randrange(len(text) + 1)
            j = min(len(text), i + draw.randint(0, 40))
            k = draw.randrange(len(text) + 1)
            cut = text[i:j]
            text = draw.choice(
                [
                    text[:i] + text[j:],
                    text[:i] + cut + cut + text[j:],
                    text[:k] + cut + text[k:],
                    text[:i] + draw.choice(words) + text[i:],
                ]
            )
        reading = _engine.veriloga(text, str(folder / "m.va"))
        for name in reading.modules:
            try:
                reading.describe(name)
                reading.evaluate(name)
            except ValueError as error:
                assert error.args[0][0]["text"]
        if time.process_time() - begun > 60:
            break

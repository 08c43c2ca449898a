"""`emsim completion`: each shell reads its script and offers what the verbs' own tables hold."""

from __future__ import annotations

import shutil
import subprocess

import pytest

from emsim.assemble.options import METHODS
from emsim.cli import VERBS, completion, main
from emsim.cli.new import templates

SHELLS = [
    pytest.param(s, marks=pytest.mark.skipif(shutil.which(s) is None, reason=f"needs {s}"))
    for s in completion.SHELLS
]
# the function that zsh's own completion would call, told what it was called with
ZSH = """
compdef() { : }
_describe() { print -l ${(P)2} }
_files() { print -l -- files "$@" }
_arguments() { print -l -- "$@" "at $CURRENT of $#words" }
source ./script
words=(%s)
CURRENT=%d
_emsim
"""


@pytest.fixture
def folder(scratch, capsys):
    for shell in completion.SHELLS:
        assert main(["completion", shell]) == 0
        (scratch / f"script.{shell}").write_text(capsys.readouterr().out)
    for name in "one.cir", "two.net", "note.txt", "run.raw", "a b.cir":
        (scratch / name).write_text("x\n")
    (scratch / "folder").mkdir()
    return scratch


def offered(shell: str, line: str, folder) -> set[str]:
    """What the shell offers at the end of a command line."""
    words = line.split(" ")
    if shell == "bash":
        code = f"source script.bash; COMP_WORDS=({' '.join(repr(w) for w in words)}); COMP_CWORD={len(words) - 1}; _emsim"
        code += '; printf "%s\\n" "${COMPREPLY[@]}"'
    elif shell == "fish":
        code = f'source script.fish; complete -C "{line}"'
    else:
        shutil.copy(folder / "script.zsh", folder / "script")
        code = ZSH % (" ".join(repr(w) for w in words), len(words))
    flags = {"bash": ["--norc"], "fish": ["--no-config"], "zsh": ["-f"]}[shell]
    done = subprocess.run([shell, *flags, "-c", code], capture_output=True, text=True, cwd=folder, timeout=60)
    assert done.returncode in (0, 1) and not done.stderr, done.stderr
    return {row.split("\t")[0] for row in done.stdout.splitlines()}


@pytest.mark.parametrize("shell", ["bash", "fish"])
@pytest.mark.parametrize(
    ("line", "there", "absent"),
    [
        ("emsim ", {"run", "convert", "one.cir", "two.net"}, {"note.txt", "run.raw"}),
        ("emsim ch", {"chart", "check"}, {"run"}),
        ("emsim one.cir --cs", {"--csv"}, {"--tol"}),
        ("emsim check one.cir --", {"--method", "--json"}, {"--csv"}),
        ("emsim compare --method ", set(METHODS), {"one.cir"}),
        ("emsim new x --template ", set(templates()), {"one.cir"}),
        ("emsim completion ", set(completion.SHELLS), {"one.cir"}),
        ("emsim help co", {"compare", "convert", "completion"}, {"run"}),
        ("emsim convert ", {"run.raw"}, {"one.cir", "note.txt"}),
        ("emsim run --csv ", {"note.txt"}, {"run"}),
        ("emsim run a", {"a b.cir"}, set()),
    ],
)
def test_offers(shell, line, there, absent, folder):
    if shutil.which(shell) is None:
        pytest.skip(f"needs {shell}")
    found = {word.rstrip("/").replace("\\ ", " ") for word in offered(shell, line, folder)}
    assert there <= found and not absent & found


@pytest.mark.skipif(shutil.which("zsh") is None, reason="needs zsh")
def test_zsh(folder):
    first = offered("zsh", "emsim ", folder)
    assert {f"{verb}:{text}" for verb, text in VERBS.items()} <= first and "*.(cir|net|sp|spice|ckt)" in first
    run = offered("zsh", "emsim one.cir --", folder)
    assert "--csv[write a CSV file too; - is stdout, in place of the .print tables]:FILE:_files" in run
    assert f"--method[{METHOD_HELP}]:NAME:({' '.join(METHODS)})" in run
    # a pair of names excludes each other, a repeated one does not
    assert any(row.startswith("(-q --quiet)-q[") for row in run) and any(
        row.startswith("*-D[") for row in run
    )
    # an empty word at the end is a word
    assert {"1:word:(bash zsh fish)", "at 2 of 2"} <= offered("zsh", "emsim completion ", folder)
    assert "at 3 of 3" in run
    assert '*:file:_files -g "*.(raw|csv|parquet|nc)"' in offered("zsh", "emsim convert x", folder)


METHOD_HELP = next(o.help for o in completion.options_of("run") if o.key == "method")


@pytest.mark.parametrize("shell", SHELLS)
def test_scripts_hold_every_verb_and_option(shell, folder):
    text = (folder / f"script.{shell}").read_text()
    for verb in VERBS:
        assert verb in text
        for option in completion.options_of(verb):
            for name in option.names:
                spelled = {"fish": f"-l {name[2:]}" if name.startswith("--") else f"-s {name[1:]}"}.get(
                    shell, name
                )
                assert spelled in text
    parsed = subprocess.run([shell, "-n", f"script.{shell}"], cwd=folder, capture_output=True, text=True)
    assert parsed.returncode == 0, parsed.stderr


@pytest.mark.parametrize("args", [[], ["ksh"], ["bash", "zsh"]])
def test_wrong_shells(args, capsys):
    assert main(["completion", *args]) == 2
    assert "bash, zsh, fish" in capsys.readouterr().err


def test_every_verb_has_help_and_its_options(capsys):
    for verb in VERBS:
        assert main(["help", verb]) == 0
        said = capsys.readouterr().out
        assert verb in said and all(o.help.split(":")[0] in said for o in completion.options_of(verb))

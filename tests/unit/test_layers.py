"""The order of the house: who may import whom, what start-up may load, how long a file may grow.

The same order stands in emsim/README.md. Imports inside functions and for types count too.
"""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

from emsim.analyses import ANALYSES
from emsim.cards import CARDS
from emsim.elements import LETTERS, MODEL_TYPES
from emsim.source import PLAIN

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "emsim"
ENGINE = PACKAGE / "engine"

# a module may import from rows further down, and from its own package
ROWS = [
    ["docs"],
    ["__main__"],
    ["cli"],
    ["playground"],
    ["live"],
    ["editor"],
    ["__init__"],
    ["environments"],
    ["jax", "torch"],
    ["differentiable", "fits", "fmus"],
    ["alterable", "sweeps"],
    ["gradients"],
    ["pipeline"],
    ["control"],
    ["reports"],
    ["system"],
    ["interop"],
    ["stepped"],
    ["result"],
    ["outputs"],
    ["outcome"],
    ["measures"],
    ["frames", "table", "tabular"],
    ["store"],
    ["signals"],
    ["columns"],
    ["interpolate", "spectrum"],
    ["analyses"],
    ["assemble"],
    ["schematic"],
    ["elaborate"],
    ["build"],
    [
        "build_control",
        "build_dots",
        "build_elements",
        "build_fmu",
        "build_machine",
        "build_measure",
        "build_unit",
    ],
    ["parsed"],
    ["elements", "mistakes"],
    ["build_expr"],
    ["sheets"],
    ["dialects"],
    ["dots", "marks", "slips"],
    ["robots"],
    ["cards"],
    ["deck", "expr", "opened", "syntax", "lark_grammar", "source"],
    ["described", "tables"],
    ["readers"],
    ["draws", "functions", "units"],
    ["diagnostics", "registry", "traced"],
    ["_engine"],
]
LEVEL = {name: level for level, row in enumerate(ROWS) for name in row}
CARDS_MAY_IMPORT = {"cards", "diagnostics", "registry", "units", "expr", "opened", "deck", "_engine"}
UPWARD = {
    ("diagnostics", "source"): "the type of a span's file",
    ("source", "dialects"): "the type of what a file is read in",
}

RUST_ROWS = [
    ["lib"],
    ["py"],
    ["fmi", "page"],
    ["packed"],
    ["curve", "schematic"],
    ["interpolate"],
    ["integrate"],
    ["record", "smallsignal"],
    ["tangent"],
    ["events", "modes", "op"],
    ["invariants", "ledger", "raw"],
    ["newton"],
    ["tolerances"],
    ["system", "assembly"],
    ["passive", "edges", "reduced"],
    ["floating_groups", "hidden"],
    ["conditions", "bounds"],
    ["model"],
    ["clocked", "devices", "logic"],
    ["sparse", "waves"],
    ["multiversion"],
    ["tape"],
    ["repeat"],
    ["alike"],
    ["lanes"],
    ["veriloga"],
    ["derive"],
    ["graph"],
    ["interrupt", "foreign"],
    ["rounding", "syntax", "stopwatch"],
]
RUST_LEVEL = {name: level for level, row in enumerate(RUST_ROWS) for name in row}

HEAVY = [
    "lark",
    "numpy",
    "scipy",
    "matplotlib",
    "argparse",
    "pandas",
    "xarray",
    "PySpice",
    "rich",
    "pyarrow",
    "h5netcdf",
    "pygls",
]
# files are split by meaning; this only stops what has plainly become several things
LONGEST = 1200


def modules() -> list[Path]:
    return sorted(PACKAGE.rglob("*.py"))


def name_of(path: Path) -> str:
    """emsim/cli/run.py -> cli.run, emsim/cli/__init__.py -> cli, emsim/__init__.py -> __init__."""
    parts = list(path.relative_to(PACKAGE).with_suffix("").parts)
    return ".".join(parts[:-1] if parts[-1] == "__init__" and len(parts) > 1 else parts)


NAMES = {name_of(p) for p in modules()} | {"_engine"}


def imports(path: Path, lazy: bool) -> set[str]:
    """Modules of emsim that a file imports, with those inside functions and for types when `lazy`."""
    package = list(path.relative_to(PACKAGE).parent.parts)
    found: set[str] = set()

    def visit(node: ast.AST) -> None:
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test) and not lazy:
            return
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)) and not lazy:
            return
        if isinstance(node, ast.ImportFrom):
            add(node)
        elif isinstance(node, ast.Import):
            found.update(a.name[6:] for a in node.names if a.name.startswith("emsim."))
        for child in ast.iter_child_nodes(node):
            visit(child)

    def add(node: ast.ImportFrom) -> None:
        if node.level:
            base = package[: len(package) - node.level + 1] + (node.module.split(".") if node.module else [])
        elif node.module and node.module.split(".")[0] == "emsim":
            base = node.module.split(".")[1:]
        else:
            return
        for alias in node.names:
            full = ".".join([*base, alias.name])
            found.add(full if full in NAMES else ".".join(base) or "__init__")

    visit(ast.parse(path.read_text(encoding="utf-8")))
    return found


@pytest.mark.parametrize("path", modules(), ids=name_of)
def test_imports_run_down_the_rows(path):
    own = name_of(path).split(".")[0]
    assert own in LEVEL, f"{own} has no row: give it one here and in emsim/README.md"
    for target in imports(path, lazy=True):
        other = target.split(".")[0]
        if other == own or (own, other) in UPWARD:
            continue
        assert LEVEL[other] > LEVEL[own] or (LEVEL[other] == LEVEL[own]), f"{name_of(path)} imports {target}"
        if own == "cards":
            assert other in CARDS_MAY_IMPORT, f"{name_of(path)} imports {target}"


def test_exceptions_are_used():
    used = {
        (name_of(p).split(".")[0], target.split(".")[0])
        for p in modules()
        for target in imports(p, lazy=True)
    }
    assert set(UPWARD) <= used


def test_no_module_imports_itself_in_a_circle():
    graph = {name_of(p): imports(p, lazy=False) - {name_of(p)} for p in modules()}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(" -> ".join(error.args[1]))


def test_only_one_file_imports_pyspice():
    # what a file says in comments and strings does not matter
    users = [name_of(p) for p in modules() if re.search(r"^\s*(from|import) PySpice\b", p.read_text(), re.M)]
    assert users == ["interop.pyspice"]


@pytest.mark.parametrize(
    "path", [*modules(), *sorted(ENGINE.rglob("*.rs"))], ids=lambda p: str(p.relative_to(PACKAGE))
)
def test_no_file_grows_long(path):
    assert len(path.read_text(encoding="utf-8").splitlines()) <= LONGEST


def loaded_by(code: str) -> set[str]:
    done = subprocess.run(
        [sys.executable, "-c", f"import sys\n{code}\nprint('\\n'.join(sys.modules), file=sys.stderr)"],
        capture_output=True, text=True, check=True, cwd=ROOT,
    )  # fmt: skip
    return {name.split(".")[0] for name in done.stderr.split()}


@pytest.mark.parametrize(
    "code",
    [
        "import emsim",
        "from emsim.cli import main; main(['--version'])",
        "from emsim.cli import main; main(['--help'])",
        "from emsim.cli import main; main(['run', '--help'])",
    ],
)
def test_start_up_loads_nothing_heavy(code):
    assert not loaded_by(code) & {*HEAVY, "dataclasses", "json", "typing"}


def test_a_run_needs_nothing_heavy(tmp_path):
    deck = tmp_path / "rc.cir"
    deck.write_text("rc\nV1 in 0 1\nR1 in out 1k\nC1 out 0 1u\n.tran 10u 1m uic\n.print tran v(out)\n.end\n")
    run = f"from emsim.cli import main; assert main([{str(deck)!r}, '-o', {str(tmp_path / 'rc.raw')!r}]) == 0"
    heavy = {
        *HEAVY,
        "array",
        "collections",
        "dataclasses",
        "enum",
        "functools",
        "inspect",
        "json",
        "re",
        "typing",
    }
    assert not (loaded_by(run) - loaded_by("")) & heavy


def rust_files() -> list[Path]:
    """Of the crates that hold several rooms; among crates the manifests say who may use whom, and cargo sees to it."""
    several = [ENGINE / "src", ENGINE / "dae" / "src", ENGINE / "expr" / "src"]
    return sorted(p for crate in several for p in crate.rglob("*.rs") if "tests" not in p.stem)


@pytest.mark.parametrize("path", rust_files(), ids=lambda p: str(p.relative_to(ENGINE)))
def test_rust_modules_use_lower_rows(path):
    parts = path.relative_to(ENGINE).parts
    own = parts[parts.index("src") + 1].removesuffix(".rs")
    assert own in RUST_LEVEL, f"{own} has no row: give it one here and in emsim/README.md"
    # unit tests at the end of a file may use anything
    text = path.read_text(encoding="utf-8").partition("#[cfg(test)]")[0]
    for other in set(re.findall(r"\bcrate::(\w+)", text)) - {own}:
        assert RUST_LEVEL[other] > RUST_LEVEL[own], f"{own} uses crate::{other}"


def test_the_table_of_decks_is_up_to_date():
    done = subprocess.run([sys.executable, ROOT / "netlists" / "index.py", "--check"])
    assert done.returncode == 0, "run python netlists/index.py"


def test_the_code_map_names_files_that_exist():
    text = (PACKAGE / "README.md").read_text(encoding="utf-8")
    named = re.findall(r"`((?:\w+/)*\w+\.(?:py|rs|pyi|lark))`", text)
    places = [PACKAGE, PACKAGE / "assemble", ROOT]
    assert len(named) > 50
    assert [name for name in named if not any((place / name).exists() for place in places)] == []


def modules_of(deck: str, tmp_path: Path) -> set[str]:
    """Those of emsim that a run of a deck imports."""
    path = tmp_path / "deck.cir"
    path.write_text(deck)
    run = f"from emsim.cli import main; assert main([{str(path)!r}, '-q', '-o', {str(tmp_path / 'deck.raw')!r}]) == 0"
    done = subprocess.run(
        [sys.executable, "-c", f"import sys\n{run}\nprint('\\n'.join(sys.modules), file=sys.stderr)"],
        capture_output=True, text=True, check=True, cwd=ROOT,
    )  # fmt: skip
    return {name for name in done.stderr.split() if name.startswith("emsim.")}


def test_a_run_imports_what_its_deck_names(tmp_path):
    found = modules_of("rc\nV1 in 0 1\nR1 in out 1k\nC1 out 0 1u\n.tran 10u 1m uic\n.end\n", tmp_path)
    letters = {name[15:] for name in found if re.fullmatch(r"emsim\.elements\.\w", name)}
    assert letters == {"v", "r", "c"}
    assert {name for name in found if name.startswith("emsim.cards.")} == set()
    assert not found & {f"emsim.analyses.{word}" for word in ANALYSES if word != "tran"}
    assert len(found) <= 60  # of 466


@pytest.mark.parametrize("letter", LETTERS)
def test_the_index_of_elements_says_what_their_classes_say(letter):
    kind = LETTERS[letter]
    assert kind.letter == letter
    words = [word for word, to in MODEL_TYPES.index.items() if to == LETTERS.index[letter]]
    assert sorted(words) == sorted(kind.model_types if letter != "a" else words)
    if kind.plain is not None:
        rule, *told = kind.plain
        assert PLAIN[rule] == tuple(told)


def test_code_models_are_types_of_models():
    assert all(
        MODEL_TYPES[name] is LETTERS["a"] for name in LETTERS["a"].model_types if name not in ("core",)
    )
    assert MODEL_TYPES["core"] is LETTERS["k"] and MODEL_TYPES.get("nothing") is None


@pytest.mark.parametrize("word", CARDS)
def test_the_index_of_cards_says_what_their_specs_say(word):
    assert CARDS[word].spec.word == word


@pytest.mark.parametrize("word", ANALYSES)
def test_the_index_of_analyses_says_what_their_classes_say(word):
    assert ANALYSES[word].word == word

"""A wheel of the tree and a wheel of the source distribution, each in an empty environment, run a deck.

Compiles the engine twice, in the dev profile: what is packed does not hang on it, and the command of the README installs the
optimised one. Needs cargo and a package index, as installing emsim does.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from support import NETLISTS, ROOT, compiled_parts

pytestmark = pytest.mark.builds

MACHINE = NETLISTS / "paper" / "motor_pendulum_kp30.cir"


def sh(*command: object, cwd: Path, **env: str) -> str:
    done = subprocess.run(
        [str(word) for word in command], cwd=cwd, capture_output=True, text=True, env={**os.environ, **env},
        stdin=subprocess.DEVNULL, timeout=1200,
    )  # fmt: skip
    assert done.returncode == 0, (
        f"{' '.join(map(str, command))}\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}"
    )
    return done.stdout


def environment(folder: Path) -> Path:
    """A fresh virtual environment; its bin folder."""
    sh(sys.executable, "-m", "venv", folder, cwd=folder.parent)
    return folder / ("Scripts" if os.name == "nt" else "bin")


@pytest.fixture(scope="module", params=["tree", "sdist"])
def wheel(request, tmp_path_factory):
    work = tmp_path_factory.mktemp(request.param)
    tools = environment(work / "tools")
    sh(tools / "pip", "install", "-q", "maturin>=1.9,<2", cwd=work)
    source: Path = ROOT
    if request.param == "sdist":
        sh(tools / "maturin", "sdist", "-o", work / "sdist", cwd=ROOT)
        (source,) = (work / "sdist").glob("*.tar.gz")
    with compiled_parts() as shared:
        sh(
            tools / "pip", "wheel", "-q", "--no-deps", "--no-build-isolation", "-w", work / "dist", source,
            cwd=work, CARGO_TARGET_DIR=str(shared), MATURIN_PEP517_ARGS="--profile dev",
            PATH=f"{tools}{os.pathsep}{os.environ['PATH']}",
        )  # fmt: skip
    (built,) = (work / "dist").glob("*.whl")
    return built


def test_runs_in_an_empty_environment(wheel, tmp_path):
    bin = environment(tmp_path / "empty")
    sh(bin / "pip", "install", "-q", wheel, cwd=tmp_path)
    (tmp_path / "work").mkdir()
    said = sh(bin / "emsim", "--json", MACHINE, cwd=tmp_path / "work")
    document = json.loads(said)
    assert document["status"] == "ok" and document["files"] == ["motor_pendulum_kp30.raw"]
    assert (tmp_path / "work" / "motor_pendulum_kp30.raw").stat().st_size > 10_000
    code = f"import emsim; print(emsim.run({str(MACHINE)!r}).time[-1], emsim.__version__)"
    assert sh(bin / "python", "-c", code, cwd=tmp_path / "work").split() == ["10.0", "0.1.0"]


# where a wheel has decks: those that `emsim new`, the lessons and the environments start from
PLACES = ("emsim/templates/", "emsim/lessons/", "emsim/environments/")


def test_wheel_holds_grammar_types_and_licences_and_no_sources(wheel):
    names = zipfile.ZipFile(wheel).namelist()
    for needed in (
        "emsim/grammar/deck.lark", "emsim/py.typed", "emsim/_engine.pyi", "emsim/editor/vscode/extension.js",
        "emsim/messages/running.md",
    ):  # fmt: skip
        assert needed in names
    assert sum("dist-info" in name and "LICENSE" in name for name in names) == 2
    assert any(name.endswith("web/vendor/LICENSE-uPlot") for name in names)
    assert not [
        name
        for name in names
        if name.endswith((".rs", "Cargo.toml")) or "tests/" in name or "emsim/docs/" in name
    ]
    decks = [name for name in names if name.endswith(".cir")]
    assert decks and all(name.startswith(PLACES) for name in decks)
    lessons = {path.name for path in (NETLISTS / "lessons").iterdir() if path.suffix in (".cir", ".md")}
    assert {name.rpartition("/")[2] for name in names if name.startswith("emsim/lessons/")} == lessons
    assert "abi3" in wheel.name

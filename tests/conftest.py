"""Shared by all tests: a scratch directory as the working directory, headless Chromium."""

from __future__ import annotations

import os
import shutil
import sys
import warnings
from collections.abc import Iterator
from ctypes.util import find_library
from typing import Any

import pytest

# linear algebra in one thread a process: matrices are small here, and threads that wait for each other take many times the
# processor's time of the work. Said before numpy is loaded, which is why pyproject.toml leaves out zarr's plugin
if "numpy" in sys.modules and "OPENBLAS_NUM_THREADS" not in os.environ:
    warnings.warn(
        "a plugin loads numpy before tests/conftest.py: linear algebra takes all threads", stacklevel=1
    )
for variable in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(variable, "1")
# programs that tests start must find the installed emsim, not the source tree they are started in
os.environ["PYTHONSAFEPATH"] = "1"
# ... and its modules compiled: tests start thousands of programs, and compiling the sources is most of what each takes
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
# no test finds models that its user has added
os.environ["EMSIM_MODELS"] = os.devnull
# PySpice looks for libngspice.so alone, which only -dev packages have
if library := find_library("ngspice"):
    os.environ.setdefault("NGSPICE_LIBRARY_PATH", library)


@pytest.fixture
def scratch(tmp_path, monkeypatch):
    """An empty working directory, for whatever writes its files beside the caller."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


CHROMIUM = next(
    (p for n in ("chromium", "chromium-browser", "google-chrome", "chrome") if (p := shutil.which(n))), None
)


@pytest.fixture(scope="session")
def chromium() -> Iterator[Any]:
    """The browser, one for all tests. Where none is installed they are skipped; .ci/run installs one."""
    if CHROMIUM is None:
        pytest.skip("no Chromium on this machine")
    sync_api = pytest.importorskip("playwright.sync_api")
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield browser
        browser.close()

"""Shared by all tests: a scratch directory as the working directory, headless Chromium."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from ctypes.util import find_library
from typing import Any

import pytest

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

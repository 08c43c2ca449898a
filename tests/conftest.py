"""Shared by all tests: a scratch directory as the working directory."""

from __future__ import annotations

import os
from ctypes.util import find_library

import pytest

# programs that tests start must find the installed emsim, not the source tree they are started in
os.environ["PYTHONSAFEPATH"] = "1"
# PySpice looks for libngspice.so alone, which only -dev packages have
if library := find_library("ngspice"):
    os.environ.setdefault("NGSPICE_LIBRARY_PATH", library)


@pytest.fixture
def scratch(tmp_path, monkeypatch):
    """An empty working directory, for whatever writes its files beside the caller."""
    monkeypatch.chdir(tmp_path)
    return tmp_path

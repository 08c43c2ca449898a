"""FMUs of these tests are archives without compression: it is most of what writing one takes, for every deck anew."""

from __future__ import annotations

import sys
import zipfile
from types import SimpleNamespace

import pytest

import emsim.fmus.export  # noqa: F401  # the name in the package is its function


@pytest.fixture(autouse=True)
def uncompressed(request, monkeypatch):
    if request.path.stem == "test_fmu_library":  # of the archive itself
        return
    stored = SimpleNamespace(
        ZipFile=zipfile.ZipFile, ZipInfo=zipfile.ZipInfo, ZIP_DEFLATED=zipfile.ZIP_STORED
    )
    monkeypatch.setattr(sys.modules["emsim.fmus.export"], "zipfile", stored)

"""Shared by all tests: a scratch directory as the working directory."""

from __future__ import annotations

import pytest


@pytest.fixture
def scratch(tmp_path, monkeypatch):
    """An empty working directory, for whatever writes its files beside the caller."""
    monkeypatch.chdir(tmp_path)
    return tmp_path

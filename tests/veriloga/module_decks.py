"""A module and the deck that names it, run together: for the tests of what behaving modules do."""

from __future__ import annotations

from pathlib import Path

import emsim

HEAD = '`include "disciplines.vams"\n'


def run(tmp_path: Path, module: str, deck: str) -> emsim.Result:
    (tmp_path / "m.va").write_text(HEAD + module)
    (tmp_path / "deck.cir").write_text(f"title\n.hdl m.va\n{deck}\n.end\n")
    return emsim.run(tmp_path / "deck.cir")

"""The grammar in grammar/*.lark by Lark itself: for wrong lines, and for the export of its tables.

Lark's own tables are kept in the user's cache directory, written as plain data (marshal, nothing that could
execute), in a directory that only the user can write.
"""

from __future__ import annotations

import os
import sys

from .diagnostics import Diagnostic, OutsideError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    from .syntax import Tree

PARTS = ("deck", "lexical", "spice", "mechanics", "expression", "control")
STARTS = ("dot", "machine_card", "element", "command", "expression", "vectors", "let")

_parser: Any = None


def grammar_folder() -> str:
    """grammar/ of the source checkout, or the copy inside an installed package."""
    package = os.path.dirname(os.path.abspath(__file__))
    checkout = os.path.dirname(package)
    # a build leaves a copy in the package folder; in a checkout the originals are the truth
    if os.path.exists(os.path.join(checkout, "pyproject.toml")):
        folders = [os.path.join(checkout, "grammar"), os.path.join(package, "grammar")]
    else:
        folders = [os.path.join(package, "grammar")]
    for folder in folders:
        if os.path.exists(os.path.join(folder, "deck.lark")):
            return folder
    raise OutsideError(
        Diagnostic(
            "error",
            "E502",
            "the grammar files of emsim are missing from its installation",
            None,
            "install it again",
        )
    )


def grammar_text() -> str:
    """All parts as one grammar."""
    parts = []
    for name in PARTS:
        with open(os.path.join(grammar_folder(), name + ".lark"), encoding="utf-8") as handle:
            parts.append(handle.read())
    return "\n".join(parts)


class _Trees:
    """Lark's inline transformer: every rule becomes the tuple (rule, children) as soon as it is complete."""

    def __getattr__(self, rule: str) -> Callable[[list[Any]], Tree]:
        if not rule[0].islower():  # terminals stay as they are
            raise AttributeError(rule)
        name = sys.intern(str(rule))
        return lambda children: (name, children)


def parser() -> Any:
    """The Lark parser, from the cached tables or built from the grammar."""
    global _parser
    if _parser is None:
        _parser = _load_parser()
    return _parser


def _load_parser() -> Any:
    import lark

    text = grammar_text()
    path = _cache_file(text, lark.__version__)
    if path is not None:
        tables = _read_cache(path)
        if tables is not None:
            try:
                return lark.Lark._load_from_dict(tables[0], tables[1], transformer=_Trees())
            except Exception:  # a damaged file: build anew
                pass
    built = build_parser(text)
    if path is not None:
        _write_cache(path, built)
        return built
    return built


def build_parser(text: str) -> Any:
    """Lark's LALR parser with the contextual lexer, from the grammar's text."""
    import lark

    return lark.Lark(
        text,
        parser="lalr",
        lexer="contextual",
        start=list(STARTS),
        maybe_placeholders=False,
        transformer=_Trees(),
    )


# ---- the cache of tables ----


def _cache_file(text: str, version: str) -> str | None:
    """Where the tables of this grammar are kept; None where no safe place exists."""
    import hashlib

    key = "\n".join((version, sys.version, sys.implementation.cache_tag or "", text))
    name = "grammar-" + hashlib.sha256(key.encode()).hexdigest()[:24] + ".tables"
    base = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    if not os.path.isabs(base):
        return None
    folder = os.path.join(base, "emsim")
    try:
        os.makedirs(folder, mode=0o700, exist_ok=True)
        status = os.lstat(folder)
    except OSError:
        return None
    if hasattr(os, "getuid") and (status.st_uid != os.getuid() or status.st_mode & 0o077):
        return None  # someone else could have planted tables here
    return os.path.join(folder, name)


def _read_cache(path: str) -> Any:
    import marshal

    try:
        with open(path, "rb") as handle:
            if hasattr(os, "getuid") and os.fstat(handle.fileno()).st_uid != os.getuid():
                return None
            return marshal.loads(handle.read())
    except (OSError, ValueError, EOFError, TypeError):
        return None


def _write_cache(path: str, built: Any) -> None:
    import marshal

    from lark.grammar import Rule
    from lark.lexer import TerminalDef

    data, memo = built.memo_serialize([TerminalDef, Rule])
    data["options"] = {k: v for k, v in data["options"].items() if k != "transformer"}
    temporary = f"{path}.{os.getpid()}"
    try:
        blob = marshal.dumps(_plain((data, memo)))
        with open(os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as handle:
            handle.write(blob)
        os.replace(temporary, path)
    except (OSError, ValueError):
        pass  # the cache is a convenience


def _plain(value: Any) -> Any:
    """Lark's tables with its own kinds of str made plain ones."""
    if isinstance(value, dict):
        return {_plain(k): _plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return type(value)(_plain(v) for v in value)
    return str(value) if isinstance(value, str) else value

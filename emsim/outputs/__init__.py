"""Output formats, one file each. Each module has `write(path, result, ...)`; raw also reads."""

from __future__ import annotations

from os import fspath
from os.path import abspath, dirname, isdir, splitext

TYPE_CHECKING = False
if TYPE_CHECKING:
    from os import PathLike
    from typing import Any

    from ..result import Result

FORMATS = {".raw": "raw", ".csv": "csv", ".txt": "text"}


def save(result: Result, path: str | PathLike[str], **options: Any) -> None:
    """Writes in the format of the path's extension. ValueError for an extension that has no writer,
    OutsideError where the file cannot be written."""
    path = fspath(path)
    extension = splitext(path)[1].lower()
    if extension not in FORMATS:
        raise ValueError(f"{path}: the extension says no format; there is {', '.join(FORMATS)}")
    from importlib import import_module

    try:
        import_module("." + FORMATS[extension], __name__).write(path, result, **options)
    except OSError as error:
        folder = dirname(abspath(path))
        from ..diagnostics import Diagnostic, OutsideError

        why = error.strerror or str(error) if isdir(folder) else f"there is no folder {folder}"
        raise OutsideError(Diagnostic("error", "E503", f"cannot write {path}: {why}")) from None

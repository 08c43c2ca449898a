"""Output formats, one file each. Each module has `write(path, result, ...)`; raw also reads."""

from __future__ import annotations

from os.path import splitext

from ..result import Result

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

FORMATS = {".raw": "raw", ".csv": "csv", ".txt": "text"}


def save(result: Result, path: str, **options: Any) -> None:
    """Writes in the format of the path's extension. ValueError for an extension that has no writer."""
    extension = splitext(path)[1].lower()
    if extension not in FORMATS:
        raise ValueError(f"{path}: the extension says no format; there is {', '.join(FORMATS)}")
    from importlib import import_module

    import_module("." + FORMATS[extension], __name__).write(path, result, **options)

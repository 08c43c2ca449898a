"""Output formats, one file each. Each module has `write(path, result, ...)`; those of READERS have `read(path)` too."""

from __future__ import annotations

from os import fspath
from os.path import abspath, dirname, isdir, splitext

TYPE_CHECKING = False
if TYPE_CHECKING:
    from os import PathLike
    from typing import Any

    from ..diagnostics import OutsideError
    from ..outcome import Outcome

FORMATS = {
    ".raw": "raw",
    ".csv": "csv",
    ".txt": "text",
    ".parquet": "parquet",
    ".nc": "netcdf",
    ".html": "html",
}
READERS = {extension: name for extension, name in FORMATS.items() if name not in ("text", "html")}


def save(result: Outcome, path: str | PathLike[str], **options: Any) -> None:
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


def load(path: str | PathLike[str]) -> Outcome:
    """Reads a file in the format of its extension. ValueError for an extension that has no reader, OutsideError
    where the file cannot be read or is something else."""
    path = fspath(path)
    extension = splitext(path)[1].lower()
    if extension not in READERS:
        raise ValueError(f"{path}: the extension says no format; there is {', '.join(READERS)}")
    from importlib import import_module

    from ..diagnostics import Diagnostic, OutsideError

    try:
        result: Outcome = import_module("." + READERS[extension], __name__).read(path)
    except OSError as error:
        said = f"cannot read {path}: {error.strerror or error}"
        raise OutsideError(Diagnostic("error", "E500", said)) from None
    except ValueError as error:
        said = str(error) if str(error).startswith(path) else f"{path}: {error}"
        raise OutsideError(Diagnostic("error", "E506", said)) from None
    return result


def missing_package(what: str, package: str, extra: str) -> OutsideError:
    """The error of something whose library is not installed: "Parquet files need", "pyarrow", "files"."""
    from ..diagnostics import Diagnostic, OutsideError

    said = f"{what} {package}, which is not installed"
    return OutsideError(Diagnostic("error", "E521", said, None, f"pip install 'emsim[{extra}]'"))

"""usage: emsim lsp

The language server, for editors: diagnostics as `emsim check` gives them, what cards, parameters, names and numbers mean,
completion, definitions, an outline, formatting. Speaks the Language Server Protocol on stdin and stdout. Needs the extra
`lsp`: pip install 'emsim[lsp]'."""

from __future__ import annotations

from .. import __version__
from ..diagnostics import Diagnostic, OutsideError
from .arguments import HELP, Option, UsageError, parse
from .console import OK

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

OPTIONS = [Option("--stdio", "accepted: the server always speaks on stdin and stdout"), HELP]


def main(args: Sequence[str]) -> int:
    given = parse(args, OPTIONS)
    if given.words:
        raise UsageError("emsim lsp takes no deck: the editor sends them")
    try:
        from ..editor.server import make
    except ModuleNotFoundError as error:
        if error.name is None or error.name.partition(".")[0] not in ("pygls", "lsprotocol"):
            raise
        said = f"the language server needs {error.name}, which is not installed"
        raise OutsideError(Diagnostic("error", "E521", said, None, "pip install 'emsim[lsp]'")) from None
    make(__version__).start_io()
    return OK

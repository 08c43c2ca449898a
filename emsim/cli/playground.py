"""usage: emsim playground [options] -o FOLDER

Writes the playground, a page in which decks are written and run with nothing installed: an editor at the left, circuit,
machine and curves at the right, emsim itself running in the browser. The folder holds all that it needs and is put on any web
server; nothing is computed there and nothing is loaded from elsewhere. A deck travels in the page's address, behind #deck=.

With --serve the folder is given out on this machine's loopback address until Ctrl-C."""

from __future__ import annotations

import sys
from os import listdir
from os.path import abspath, isdir, isfile, join

from ..diagnostics import Diagnostic, OutsideError
from . import lessons, new
from .arguments import HELP, QUIET, Option, UsageError, parse
from .console import OK

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

OPTIONS = [
    Option("-o --output", "the folder to write", "FOLDER"),
    Option("--serve", "give it out here, to be looked at; Ctrl-C ends it"),
    Option("--port", "with --serve: the port to listen on; otherwise a free one", "N"),
    QUIET,
    HELP,
]
FIRST = "pendulum"  # the template that the page opens with


def main(args: Sequence[str]) -> int:
    given = parse(args, OPTIONS)
    target = given.text("output")
    if given.words or target is None:
        raise UsageError("emsim playground takes a folder alone: emsim playground -o site")
    if given.has("port") and not given.has("serve"):
        raise UsageError("--port is for --serve")
    if isdir(target) and listdir(target) and not isfile(join(target, "decks.json")):
        said = f"{target} is a folder with other files in it"
        raise OutsideError(Diagnostic("error", "E507", said, None, "choose one that is new or empty"))
    from ..playground import site

    size = site.build(target, decks())
    if not given.has("quiet"):
        print(f"playground: {abspath(target)}, {size / 1e6:.1f} MB", file=sys.stderr)
    return serve(target, given.text("port")) if given.has("serve") else OK


def decks() -> list[tuple[str, str, str]]:
    """(group, name, text) of what the page's menu holds, the one that it opens with first."""
    names = sorted(new.templates(), key=lambda name: name != FIRST)
    found = [("templates", name, new.text_of(name)) for name in names]
    return found + [("lessons", name, lessons.text_of(f"{name}.cir")) for name in lessons.names()]


def serve(folder: str, port: str | None) -> int:
    from functools import partial
    from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer

    from .live import cannot_listen, port_of

    class Quiet(SimpleHTTPRequestHandler):
        def log_message(self, format: str, *args: object) -> None:
            """The terminal is for what matters."""

    # what Python does not know, or an odd registry of the machine tells otherwise
    types = {".wasm": "application/wasm", ".mjs": "text/javascript", ".js": "text/javascript"}
    Quiet.extensions_map = {**SimpleHTTPRequestHandler.extensions_map, **types}
    try:
        server = ThreadingHTTPServer(("127.0.0.1", number := port_of(port)), partial(Quiet, directory=folder))
    except OSError as error:
        raise cannot_listen(number, error) from None
    print(f"page: http://127.0.0.1:{server.server_address[1]}/\nCtrl-C to end", file=sys.stderr)
    try:
        server.serve_forever()
    except KeyboardInterrupt:
        print(file=sys.stderr)
    finally:
        server.server_close()
    return OK

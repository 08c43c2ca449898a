"""`emsim view --live`: the page stays open while the deck is edited."""

from __future__ import annotations

import os
import re
import signal
import sys

from ..diagnostics import Diagnostic, OutsideError
from .arguments import Arguments, UsageError, defines, overrides
from .console import OK, engineering

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any


def serve(given: Arguments) -> int:
    """Until Ctrl-C or SIGTERM, which end it with exit code 0."""
    from ..live.server import Server
    from ..live.session import Session

    deck = given.deck("view")
    if deck == "-":
        raise UsageError("--live watches a file; stdin is none")
    if given.has("output"):
        raise UsageError("--live writes no file; leave -o away")
    port = port_of(given.text("port"))
    _readable(deck)
    session = Session(deck, defines(given), overrides(given), _Teller(given.has("quiet")).say)
    try:
        server = Server(session.board, session.ask, port, session.edit, deck)
    except OSError as error:
        raise cannot_listen(port, error) from None
    from threading import Thread

    signal.signal(signal.SIGTERM, lambda *_: session.stop())
    Thread(target=server.serve_forever, daemon=True).start()
    print(f"page: {server.url}\nsave the deck to see it anew, Ctrl-C to end", file=sys.stderr)
    if not given.has("no-open"):
        import webbrowser

        # a browser of the terminal would not return
        Thread(target=webbrowser.open, args=(server.url,), daemon=True).start()
    try:
        session.serve()
    except KeyboardInterrupt:
        print(file=sys.stderr)
    finally:
        server.shutdown()
        server.server_close()
    return OK


def cannot_listen(port: int, error: OSError) -> OutsideError:
    said = f"cannot listen on port {port}: {error.strerror or error}"
    hint = "another program may use it; without --port a free one is taken"
    return OutsideError(Diagnostic("error", "E508", said, None, hint))


def port_of(text: str | None) -> int:
    if text is None:
        return 0
    if not text.isdecimal() or not 0 < int(text) < 65536:
        raise UsageError(f"--port: {text!r} is no port number, 1 to 65535")
    return int(text)


def _readable(deck: str) -> None:
    """Raises OutsideError: later the file may come and go, now its name is probably wrong."""
    from ..build import cannot_read

    try:
        with open(deck, "rb"):
            pass
    except OSError as error:
        raise cannot_read(deck, error) from None


class _Teller:
    """What happened, on stderr: messages as of a run in the terminal, else one line."""

    def __init__(self, quiet: bool) -> None:
        self.quiet = quiet
        self.coloured = sys.stderr.isatty() and not os.environ.get("NO_COLOR")

    def say(self, head: dict[str, Any]) -> None:
        text: str = head["text"] if self.coloured else re.sub("\033\\[[\\d;]*m", "", head["text"])
        if text and not (self.quiet and head["ok"]):
            print(text, end="\n\n", file=sys.stderr)
        if head["facts"] and not self.quiet:
            print(f"{head['facts']}, {engineering(head['seconds'])}s", file=sys.stderr)

"""The live page and its data, for browsers on this machine alone.

    GET  /        the page; it holds nothing of the deck
    GET  /events  what the page is to know, a line of JSON each, for as long as the reader stays
    POST /set     {"set": {name: text, or null for the deck's own}, "number": n}
    POST /deck    {"text": the deck, "was": the deck before}: it is written to its file
    POST /help    {"what": "complete" or "hover", "text": the deck, "row": n, "col": n}: what the language server says there

These are all there is: a request chooses no file. The socket is bound to the loopback address. A request must name
this server in Host (a foreign name that resolves to this machine is refused) and, where a browser says whose page asks,
in Origin. Data and changes need the token, which stands behind # in the page's address: browsers do not send that part
to anybody, and the page's script puts it into a header, which pages of other origins may not do.
"""

from __future__ import annotations

import base64
import hashlib
import hmac
import json
import os
import re
import secrets
import socketserver
from contextlib import suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from os.path import dirname, exists, join
from socket import SHUT_RDWR
from threading import Lock

from ..cards import CARDS
from ..editor.textmate import card_pattern
from ..outputs import html
from .helping import Helper

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    from .session import Board

ADDRESS = "127.0.0.1"
EDITOR = join(
    dirname(html.WEB), "..", "playground", "parts", "editor.js"
)  # where playground/build.sh has made it
TOKEN = "X-Emsim-Token"
MOST_BYTES = 64 * 1024  # of a request's body
MOST_DECK = 4 * 1024 * 1024  # of one with a deck in it, twice
MOST_READERS = 32  # connections at a time
ALIVE = 10.0  # seconds of silence after which a reader gets an empty line
TIMEOUT = 30.0  # seconds that a client may take to send or to take something
_NAME, _TEXT = re.compile(r"[^\s=]{1,100}"), re.compile(r"[^\r\n\0]{1,200}")


def page() -> str:
    """The page of a run with nothing in it yet, and the live script."""
    nothing: dict[str, Any] = {
        "title": "emsim", "facts": "", "error": None, "rows": 0, "names": [], "units": [], "shown": [],
        "axisName": "", "axisUnit": "", "sheets": [], "scene": None,
    }  # fmt: skip
    cards = {"cards": [card_pattern(word) for word in CARDS]}
    scripts = (*html.SCRIPTS, *([EDITOR] if exists(EDITOR) else []), "live.js")
    return html.page({**nothing, **cards}, scripts, (*html.STYLES, "live.css"))


class Server(ThreadingHTTPServer):
    """`ask(change, number)` is called for every POST /set, `edit(text, was)` for every POST /deck. `url` is the page's address
    with the token.

    port 0 takes a free one. Raises OSError where the port is taken."""

    daemon_threads = True
    # elsewhere it lets a restarted server have its port again at once; on Windows it would share the port with anybody
    allow_reuse_address = os.name != "nt"

    def __init__(
        self,
        board: Board,
        ask: Callable[[dict[str, str | None], int], object],
        port: int = 0,
        edit: Callable[[str, str], bool] | None = None,
        deck: str | None = None,
    ) -> None:
        self.board, self.ask, self.edit = board, ask, edit
        self.helper = Helper(deck)
        self.token = secrets.token_urlsafe(24)
        self._open: dict[Any, bool] = {}  # connections, oldest first: have they shown the token?
        self._lock = Lock()
        super().__init__((ADDRESS, port), Handler)
        self.port = int(self.server_address[1])
        hosts = [f"{name}:{self.port}" for name in (ADDRESS, "localhost")]
        # browsers leave the port of http away
        self.hosts = frozenset(hosts + ([ADDRESS, "localhost"] if self.port == 80 else []))
        self.origins = frozenset(f"http://{host}" for host in self.hosts)
        text = page()
        self.page = text.encode()
        self.policy = _policy(text)

    def server_bind(self) -> None:
        # without asking any name server for the name of this machine
        socketserver.TCPServer.server_bind(self)
        self.server_name, self.server_port = ADDRESS, self.server_address[1]

    @property
    def url(self) -> str:
        return f"http://{ADDRESS}:{self.port}/#{self.token}"

    def process_request(self, request: Any, client_address: Any) -> None:
        with self._lock:
            full = len(self._open) >= MOST_READERS
            # whoever has been at it longest without the token makes room
            slow = next((r for r, trusted in self._open.items() if not trusted), None) if full else None
            if slow is not None:
                del self._open[slow]
                with suppress(OSError):
                    slow.shutdown(SHUT_RDWR)
            welcome = slow is not None or not full
            if welcome:
                self._open[request] = False
        if welcome:
            super().process_request(request, client_address)
        else:
            self.shutdown_request(request)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        try:
            super().process_request_thread(request, client_address)
        finally:
            with self._lock:
                self._open.pop(request, None)

    def trust(self, request: Any) -> None:
        """The connection has shown the token."""
        with self._lock:
            if request in self._open:
                self._open[request] = True

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A client that goes away is no error."""


def _policy(text: str) -> str:
    """The page's own scripts by their hashes and connections to this server; nothing else, and in no frame."""
    scripts = re.findall(r"<script>(.*?)</script>", text, re.S)
    scripts += map(html.inflated, re.findall(r'<script id="code" type="text/plain">(.*?)</script>', text))
    hashes = [base64.b64encode(hashlib.sha256(s.encode()).digest()).decode() for s in scripts]
    allowed = " ".join(f"'sha256-{h}'" for h in hashes)
    return (
        f"default-src 'none'; script-src {allowed}; style-src 'unsafe-inline'; img-src data: blob:; "
        "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )


class Handler(BaseHTTPRequestHandler):
    server: Server
    timeout = TIMEOUT
    server_version, sys_version = "emsim", ""

    def answer(self) -> None:
        if self.headers.get_all("Host", []) not in [[host] for host in self.server.hosts]:
            return self.refuse(403, "this server has another name")
        if any(origin not in self.server.origins for origin in self.headers.get_all("Origin", [])):
            return self.refuse(403, "a page of another origin asks")
        if self.path not in ROUTES:
            return self.refuse(404, "there is nothing here")
        method, needs_token, act = ROUTES[self.path]
        if self.command != method:
            return self.refuse(405, f"only {method}", {"Allow": method})
        given = self.headers.get(TOKEN, "")
        if needs_token and not hmac.compare_digest(given.encode(), self.server.token.encode()):
            return self.refuse(403, "the token is missing or of another run of emsim")
        if needs_token:
            self.server.trust(self.connection)
        act(self)

    do_GET = do_HEAD = do_POST = do_PUT = do_DELETE = do_PATCH = do_OPTIONS = do_TRACE = answer

    # ---- what there is to ask for ----

    def give_page(self) -> None:
        self.give(200, self.server.page, {"Content-Type": "text/html; charset=utf-8"})

    def give_events(self) -> None:
        self.start(200, {"Content-Type": "application/x-ndjson; charset=utf-8"})
        version, board = 0, self.server.board
        while not board.closed:
            version, lines = board.after(version, ALIVE)
            self.wfile.write(b"".join(lines) or b"\n")

    def take_values(self) -> None:
        if (body := self.body(MOST_BYTES)) is None:
            return
        try:
            change, number = _wish(json.loads(body))
        except (ValueError, RecursionError):
            return self.refuse(400, 'the body is to be {"set": {name: text or null}, "number": n}')
        self.server.ask(change, number)
        self.give(204, b"", {})

    def take_deck(self) -> None:
        if self.server.edit is None:
            return self.refuse(404, "this deck is not edited here")
        if (body := self.body(MOST_DECK)) is None:
            return
        try:
            text, was = _edit(json.loads(body))
        except (ValueError, RecursionError):
            return self.refuse(400, 'the body is to be {"text": the deck, "was": the deck before}')
        try:
            written = self.server.edit(text, was)
        except (OSError, UnicodeError) as error:
            return self.refuse(500, f"the deck cannot be written: {error}")
        if not written:
            return self.give(
                200, b"the deck's file was changed meanwhile", {"Content-Type": "text/plain; charset=utf-8"}
            )
        self.give(204, b"", {})

    def give_help(self) -> None:
        if (body := self.body(MOST_DECK)) is None:
            return
        try:
            what, *place = _question(json.loads(body))
        except (ValueError, RecursionError):
            form = '{"what": "complete" or "hover", "text": the deck, "row": n, "col": n}'
            return self.refuse(400, f"the body is to be {form}")
        said = json.dumps(getattr(self.server.helper, what)(*place), separators=(",", ":"))
        self.give(200, said.encode(), {"Content-Type": "application/json; charset=utf-8"})

    def body(self, most: int) -> bytes | None:
        """The body of a request; None where it was refused."""
        if self.headers.get_content_type() != "application/json":
            self.refuse(415, "the body is to be JSON")
            return None
        length = self.headers.get("Content-Length", "")
        if not length.isdecimal():
            self.refuse(411, "the length of the body is missing")
            return None
        if len(length) > 9 or int(length) > most:
            self.refuse(413, f"the body may have {most} bytes")
            return None
        return self.rfile.read(int(length))

    # ---- answers ----

    def start(self, code: int, headers: dict[str, str]) -> None:
        self.send_response(code)
        for name, value in {**headers, **ALWAYS, "Content-Security-Policy": self.server.policy}.items():
            self.send_header(name, value)
        self.end_headers()

    def give(self, code: int, body: bytes, headers: dict[str, str]) -> None:
        self.start(code, {**headers, "Content-Length": str(len(body))})
        if self.command != "HEAD":
            self.wfile.write(body)

    def refuse(self, code: int, why: str, headers: dict[str, str] | None = None) -> None:
        body = (why + "\n").encode()
        self.give(code, body, {"Content-Type": "text/plain; charset=utf-8", **(headers or {})})

    def send_error(self, code: int, message: str | None = None, explain: str | None = None) -> None:
        """What http.server itself refuses: malformed requests, methods that nobody knows."""
        if not hasattr(self, "command") or self.command is None:
            self.command = ""
        self.refuse(int(code), message or "refused")

    def log_message(self, format: str, *args: Any) -> None:
        """The terminal is for the deck."""


ALWAYS = {
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
}
# path -> (method, needs the token?, what is done)
ROUTES: dict[str, tuple[str, bool, Callable[[Handler], None]]] = {
    "/": ("GET", False, Handler.give_page),
    "/events": ("GET", True, Handler.give_events),
    "/set": ("POST", True, Handler.take_values),
    "/deck": ("POST", True, Handler.take_deck),
    "/help": ("POST", True, Handler.give_help),
}


def _edit(body: Any) -> tuple[str, str]:
    """Raises ValueError for anything but the form above."""
    if not isinstance(body, dict) or set(body) != {"text", "was"}:
        raise ValueError
    text, was = body["text"], body["was"]
    if not isinstance(text, str) or not isinstance(was, str) or "\0" in text:
        raise ValueError
    return text, was


def _question(body: Any) -> tuple[str, str, int, int]:
    """Raises ValueError for anything but the form above."""
    if not isinstance(body, dict) or set(body) != {"what", "text", "row", "col"}:
        raise ValueError
    what, text, row, col = (body[key] for key in ("what", "text", "row", "col"))
    if what not in ("complete", "hover") or not isinstance(text, str):
        raise ValueError
    if type(row) is not int or type(col) is not int or not 0 <= row < len(text.split("\n")) or col < 0:
        raise ValueError
    return what, text, row, col


def _wish(body: Any) -> tuple[dict[str, str | None], int]:
    """Raises ValueError for anything but the form above."""
    if not isinstance(body, dict) or set(body) != {"set", "number"}:
        raise ValueError
    change, number = body["set"], body["number"]
    if not isinstance(change, dict) or type(number) is not int:
        raise ValueError
    for name, text in change.items():
        if not _NAME.fullmatch(name) or not (
            text is None or (isinstance(text, str) and _TEXT.fullmatch(text))
        ):
            raise ValueError
    return change, number

"""The live page's server: it answers its own page on this machine, and nobody else."""

from __future__ import annotations

import json
import re
import socket
from collections.abc import Callable, Iterator
from http.client import HTTPConnection, HTTPResponse
from pathlib import Path
from threading import Thread
from typing import Any

import pytest

from emsim.live.server import MOST_BYTES, MOST_READERS, Server
from emsim.live.session import Board, Session
from emsim.outputs import html


class Asked:
    """A server without a session, and what it was asked."""

    def __init__(self) -> None:
        self.board = Board()
        self.changes: list[tuple[dict[str, Any], int]] = []
        self.server = Server(self.board, lambda *change: self.changes.append(change))
        self.host = f"127.0.0.1:{self.server.port}"
        Thread(target=self.server.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True).start()

    def request(
        self, method: str, path: str, body: bytes | str | None = None, token: bool = True, **headers: str
    ) -> HTTPResponse:
        connection = HTTPConnection("127.0.0.1", self.server.port, timeout=30)
        given = {name.replace("_", "-"): value for name, value in headers.items()}
        if token:
            given.setdefault("X-Emsim-Token", self.server.token)
        connection.request(method, path, body, given)
        return connection.getresponse()

    def post(self, body: Any, **headers: str) -> HTTPResponse:
        text = body if isinstance(body, (str, bytes)) else json.dumps(body)
        return self.request("POST", "/set", text, **{"Content_Type": "application/json", **headers})

    def raw(self, text: str) -> str:
        """The answer to these very bytes."""
        with socket.create_connection(("127.0.0.1", self.server.port), timeout=30) as s:
            s.sendall(text.encode("latin-1"))
            s.shutdown(socket.SHUT_WR)
            parts = []
            while part := s.recv(65536):
                parts.append(part)
        return b"".join(parts).decode("latin-1")


@pytest.fixture
def asked() -> Iterator[Asked]:
    found = Asked()
    yield found
    found.board.close()
    found.server.shutdown()
    found.server.server_close()


WISH = {"set": {"kp": "12"}, "number": 7}


def test_it_listens_on_loopback_alone(asked: Asked):
    assert asked.server.socket.getsockname()[0] == "127.0.0.1"
    assert asked.server.url.startswith(f"http://127.0.0.1:{asked.server.port}/#")
    assert len(asked.server.token) >= 30
    assert Asked().server.token != asked.server.token


def test_a_taken_port_is_an_error(asked: Asked):
    with pytest.raises(OSError, match="in use"):
        Server(asked.board, lambda *_: None, asked.server.port)


def test_the_page_comes_with_strict_headers(asked: Asked):
    answer = asked.request("GET", "/", token=False)
    text = answer.read().decode()
    assert answer.status == 200
    assert answer.headers["Content-Type"] == "text/html; charset=utf-8"
    assert answer.headers["X-Content-Type-Options"] == "nosniff"
    assert answer.headers["X-Frame-Options"] == "DENY"
    assert answer.headers["Referrer-Policy"] == "no-referrer"
    assert answer.headers["Cache-Control"] == "no-store"
    assert answer.headers["Access-Control-Allow-Origin"] is None
    policy = answer.headers["Content-Security-Policy"]
    assert "default-src 'none'" in policy and "frame-ancestors 'none'" in policy
    assert "unsafe" not in re.search(r"script-src [^;]*", policy)[0]  # type: ignore[index]
    # the page without a token knows nothing: neither the token nor the deck
    code = re.search(r'<script id="code" type="text/plain">(.*?)</script>', text)
    assert code
    scripts = html.inflated(code[1])
    assert asked.server.token not in text + scripts
    assert "emsim-token" in scripts.lower()


@pytest.mark.parametrize(
    "host",
    ["evil.example", "evil.example:{port}", "127.0.0.1", "127.0.0.1:1", "localhost", "[::1]:{port}", "0.0.0.0:{port}",
     "127.0.0.1:{port}.evil.example", "127.0.0.1:{port}, evil.example", ""],
)  # fmt: skip
@pytest.mark.parametrize("path", ["/", "/events", "/set"])
def test_another_name_in_host_is_refused(asked: Asked, path: str, host: str):
    """DNS rebinding: a foreign name that resolves to this machine."""
    answer = asked.request(
        "POST" if path == "/set" else "GET", path, Host=host.format(port=asked.server.port)
    )
    assert answer.status == 403
    assert b"another name" in answer.read()
    assert asked.changes == []


def test_two_hosts_or_none_are_refused(asked: Asked):
    assert " 403 " in asked.raw(f"GET / HTTP/1.1\r\nHost: {asked.host}\r\nHost: evil.example\r\n\r\n")
    assert " 403 " in asked.raw("GET / HTTP/1.0\r\n\r\n")
    assert " 200 " in asked.raw(f"GET / HTTP/1.0\r\nHost: localhost:{asked.server.port}\r\n\r\n")


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "null", "https://127.0.0.1:{port}", "http://127.0.0.1:1", "http://localhost"]
)  # fmt: skip
def test_pages_of_other_origins_are_refused(asked: Asked, origin: str):
    origin = origin.format(port=asked.server.port)
    assert asked.post(WISH, Origin=origin).status == 403
    assert asked.request("GET", "/events", Origin=origin).status == 403
    assert asked.changes == []


def test_the_token_is_needed_for_data_and_changes(asked: Asked):
    for wrong in ({"token": False}, {"X_Emsim_Token": "x"}, {"X_Emsim_Token": asked.server.token[:-1]}):
        assert asked.request("GET", "/events", **wrong).status == 403  # type: ignore[arg-type]
        assert asked.post(WISH, **wrong).status == 403  # type: ignore[arg-type]
    # it is not taken from the address, which may be written down anywhere
    assert asked.request("GET", f"/events?token={asked.server.token}", token=False).status == 404
    assert asked.changes == []


def test_values_are_taken(asked: Asked):
    for origin in (f"http://{asked.host}", f"http://localhost:{asked.server.port}"):
        assert asked.post(WISH, Origin=origin).status == 204
    assert asked.post({"set": {"kp": None, "r1": "4.7kohm"}, "number": 1}).status == 204
    assert asked.changes == [({"kp": "12"}, 7), ({"kp": "12"}, 7), ({"kp": None, "r1": "4.7kohm"}, 1)]


@pytest.mark.parametrize(
    "path",
    ["/favicon.ico", "/set/", "//", "/..", "/../../etc/passwd", "/%2e%2e/%2e%2e/etc/passwd", "/?", "/?file=/etc/passwd",
     "/events?x", "/./", "/deck.cir", "/live.js", "http://127.0.0.1/", "http://{host}/", "*", "/\\..\\..", "/%00"],
)  # fmt: skip
@pytest.mark.parametrize("method", ["GET", "POST"])
def test_there_is_nothing_else(asked: Asked, method: str, path: str):
    answer = asked.raw(
        f"{method} {path.format(host=asked.host)} HTTP/1.1\r\nHost: {asked.host}\r\n"
        f"X-Emsim-Token: {asked.server.token}\r\n\r\n"
    )
    # "//" is read as "/" by http.server, against open redirects
    assert " 404 " in answer or (path == "//" and (" 200 " in answer or " 405 " in answer))
    assert "root:" not in answer


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "PATCH", "OPTIONS", "TRACE", "HEAD"])
def test_other_methods_are_refused(asked: Asked, method: str):
    for path in ("/", "/events"):
        answer = asked.request(method, path)
        assert (answer.status, answer.headers["Allow"]) == (405, "GET")
        assert answer.headers["Access-Control-Allow-Origin"] is None
    if method != "POST":
        assert asked.request(method, "/set").status == 405
    assert asked.changes == []


@pytest.mark.parametrize("method", ["FROB", "get", "CONNECT"])
def test_unknown_methods_are_refused_with_the_same_headers(asked: Asked, method: str):
    answer = asked.raw(f"{method} / HTTP/1.1\r\nHost: {asked.host}\r\n\r\n")
    assert " 501 " in answer
    assert "nosniff" in answer
    assert "<" not in answer.partition("\r\n\r\n")[2]


def test_malformed_requests_are_refused(asked: Asked):
    assert " 400 " in asked.raw("nonsense\r\n\r\n") or asked.raw("nonsense\r\n\r\n")
    assert " 414 " in asked.raw(f"GET /{'x' * 70_000} HTTP/1.1\r\nHost: {asked.host}\r\n\r\n")
    assert " 431 " in asked.raw(f"GET / HTTP/1.1\r\nHost: {asked.host}\r\nX: {'x' * 70_000}\r\n\r\n")
    assert asked.request("GET", "/").status == 200


@pytest.mark.parametrize(
    "body",
    ["", "x", "[]", "{}", '{"set": {}}', '{"set": [], "number": 1}', '{"set": {}, "number": "1"}',
     '{"set": {}, "number": true}', '{"set": {"a": 1}, "number": 1}', '{"set": {"a": "1\\n.include /etc/passwd"}, "number": 1}',
     '{"set": {"a b": "1"}, "number": 1}', '{"set": {"": "1"}, "number": 1}', '{"set": {"a": ""}, "number": 1}',
     '{"set": {}, "number": 1, "deck": "/etc/passwd"}', b"\xff\xfe", "[" * 50_000],
)  # fmt: skip
def test_other_bodies_are_refused(asked: Asked, body: str | bytes):
    assert asked.post(body).status == 400
    assert asked.changes == []


def test_bodies_have_a_length_a_kind_and_a_limit(asked: Asked):
    assert asked.post(" " * (MOST_BYTES + 1)).status == 413
    head = f"POST /set HTTP/1.1\r\nHost: {asked.host}\r\nX-Emsim-Token: {asked.server.token}\r\n"
    kind = "Content-Type: application/json\r\n"
    assert " 413 " in asked.raw(f"{head}{kind}Content-Length: {10**30}\r\n\r\n")
    assert " 411 " in asked.raw(f"{head}{kind}Content-Length: -1\r\n\r\n")
    assert " 411 " in asked.raw(f"{head}{kind}Transfer-Encoding: chunked\r\n\r\n0\r\n\r\n")
    # what a form of a foreign page could send without asking first
    assert asked.post(WISH, Content_Type="text/plain").status == 415
    assert asked.changes == []


def test_readers_get_the_newest_of_each_kind(asked: Asked):
    asked.board.put(run=b'"run 1"\n', state=b'"state 1"\n')
    asked.board.put(run=b'"run 2"\n', state=b'"state 2"\n')
    first = asked.request("GET", "/events")
    assert [message(first), message(first)] == [b'"run 2"\n', b'"state 2"\n']
    asked.board.put(state=b'"state 3"\n')
    assert message(first) == b'"state 3"\n'
    # a second reader, at the same time
    second = asked.request("GET", "/events")
    assert [message(second), message(second)] == [b'"run 2"\n', b'"state 3"\n']
    asked.board.put(run=b'"run 4"\n')
    assert message(first) == message(second) == b'"run 4"\n'
    asked.board.close()
    assert first.read().strip() == second.read().strip() == b""


def test_silent_connections_cannot_keep_others_out_for_ever(asked: Asked, monkeypatch: pytest.MonkeyPatch):
    from emsim.live import server

    monkeypatch.setattr(server.Handler, "timeout", 0.2)
    silent = [socket.create_connection(("127.0.0.1", asked.server.port)) for _ in range(MOST_READERS + 8)]
    until(lambda: _status(asked) == 200)
    for s in silent:
        s.close()


def _status(asked: Asked) -> int:
    try:
        return asked.request("GET", "/").status
    except OSError:
        return 0


def message(reader: HTTPResponse) -> bytes:
    """The next line that is a message; on a slow machine empty ones, which keep the connection, come between."""
    while (line := reader.readline()) == b"\n":
        pass
    return line


def until(true: Callable[[], object], seconds: float = 60.0) -> None:
    """Waits for a condition; the time is only how long a broken one is waited for."""
    from time import monotonic, sleep

    end = monotonic() + seconds
    while not true():
        assert monotonic() < end, "it never came"
        sleep(0.01)


def test_slow_connections_make_room_for_others(asked: Asked):
    """They send a byte now and then, and would be within every limit of time; who has shown the token stays."""
    reader = asked.request("GET", "/events")
    assert reader.status == 200
    slow = []
    for _ in range(2 * MOST_READERS):
        s = socket.create_connection(("127.0.0.1", asked.server.port))
        s.sendall(b"GET / HT")
        slow.append(s)
    for _ in range(5):
        answer = asked.request("GET", "/", token=False)
        assert answer.status == 200 and answer.read()
    asked.board.put(hello=b'{"kind": "hello"}\n')
    assert message(reader) == b'{"kind": "hello"}\n'
    for s in slow:
        s.close()


def test_the_deck_is_written_for_the_page_alone(tmp_path: Path) -> None:
    deck = tmp_path / "a.cir"
    deck.write_bytes(b"title\r\nR1 a 0 1\r\n")
    session = Session(str(deck))
    server = Server(session.board, session.ask, edit=session.edit)
    Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True).start()

    def post(body: Any, **headers: str) -> int:
        connection = HTTPConnection("127.0.0.1", server.port, timeout=30)
        known = {"X-Emsim-Token": server.token, "Content-Type": "application/json"}
        given = {**known, **{k.replace("_", "-"): v for k, v in headers.items()}}
        connection.request("POST", "/deck", json.dumps(body), given)
        return connection.getresponse().status

    was, text = "title\nR1 a 0 1\n", "title\nR1 a 0 2\n"
    try:
        assert post({"text": text, "was": was}, X_Emsim_Token="x") == 403
        assert post({"text": text, "was": was}, Origin="http://evil.example") == 403
        assert post({"text": text, "was": was}, Content_Type="text/plain") == 415
        for wrong in ({"text": text}, {"text": 1, "was": was}, [], {"text": "\0", "was": was}):
            assert post(wrong) == 400
        assert post({"text": text, "was": "another"}) == 200  # said, not written
        assert deck.read_bytes() == b"title\r\nR1 a 0 1\r\n"
        assert post({"text": text, "was": was}) == 204
        assert deck.read_bytes() == b"title\r\nR1 a 0 2\r\n"
    finally:
        server.shutdown()
        server.server_close()
        session.board.close()

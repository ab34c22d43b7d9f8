"""A page on 127.0.0.1 that turns an object: the standard library's server, and nothing from elsewhere."""

import errno
import json
import sys
from collections.abc import Mapping
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from typing import Any
from urllib.parse import parse_qsl, urlsplit

from harness.basics.errors import TouchstoneError, WrongUse
from harness.live_view.frames import LiveFrames, asked_from

HOST = "127.0.0.1"
"""Nobody beyond this machine is answered."""

SAID = "X-Touchstone"
"""Header that carries what is said of a frame, one JSON object."""

_IDLE = 30.0
"""s after which a silent connection is closed."""

_POLL = 0.1
"""s, at most, until a server that is told to stop has stopped."""

_PATHS = ("/", "/frame.png", "/start.json")


class LiveServer(ThreadingHTTPServer):
    """Serves an object's page and pictures; ``run`` until ``shutdown`` or Ctrl-C.

    Args:
        frames: of the object.
        port: 0 for any that is free.

    Raises:
        WrongUse: the port is taken, or not ours to take.
    """

    daemon_threads = True
    # A port that was just closed may be taken again; one in use may not.
    allow_reuse_address = True

    def __init__(self, frames: LiveFrames, port: int = 0) -> None:
        self.frames = frames
        try:
            super().__init__((HOST, port), _Answer)
        except OSError as error:
            reasons = {errno.EADDRINUSE: "taken by another program", errno.EACCES: "the system's own"}
            said = reasons.get(error.errno or 0, str(error))
            raise WrongUse(
                f"--port {port} of {HOST} is {said}; say another, or 0 for any that is free"
            ) from error

    @property
    def url(self) -> str:
        """Of the page."""
        return f"http://{HOST}:{self.server_port}/"

    def run(self) -> None:
        """Answer until told to stop; the port is free afterwards."""
        try:
            self.serve_forever(_POLL)
        finally:
            self.server_close()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A page that was closed in the middle of a picture is no failure of this program's."""
        if not isinstance(sys.exc_info()[1], ConnectionError | TimeoutError):
            super().handle_error(request, client_address)

    def hosts(self) -> tuple[str, ...]:
        """Names under which a page may ask: others are another site's, pointed here."""
        return tuple(f"{name}:{self.server_port}" for name in (HOST, "localhost"))


class _Answer(BaseHTTPRequestHandler):
    """One connection."""

    server: LiveServer
    protocol_version = "HTTP/1.1"  # connections are kept: a new one for every frame costs milliseconds
    server_version = "Touchstone"
    timeout = _IDLE
    disable_nagle_algorithm = True

    def do_GET(self) -> None:
        """Answer with the page, what it starts from, or a picture."""
        if self.headers.get("Host") not in self.server.hosts():
            self._refuse(HTTPStatus.FORBIDDEN, f"ask for {self.server.url}; no other name is answered")
            return
        address = urlsplit(self.path)
        match address.path:
            case "/":
                self._send("text/html; charset=utf-8", page().encode())
            case "/start.json":
                self._send("application/json", json.dumps(self.server.frames.start()).encode())
            case "/frame.png":
                self._frame(address.query)
            case other:
                self._refuse(HTTPStatus.NOT_FOUND, f"nothing is at {other}; there are {', '.join(_PATHS)}")

    def _frame(self, query: str) -> None:
        pairs = parse_qsl(query, keep_blank_values=True)
        try:
            if len(dict(pairs)) < len(pairs):
                raise WrongUse("a name is given twice; give each once")
            frame = self.server.frames.frame(asked_from(dict(pairs)))
        except TouchstoneError as refused:
            self._refuse(HTTPStatus.BAD_REQUEST, str(refused))
            return
        self._send("image/png", frame.png, {SAID: json.dumps(frame.said)})

    def _send(
        self,
        kind: str,
        body: bytes,
        more: Mapping[str, str] | None = None,
        status: HTTPStatus = HTTPStatus.OK,
    ) -> None:
        self.send_response(status)
        headers = {"Content-Type": kind, "Content-Length": str(len(body)), "Cache-Control": "no-store"}
        for name, value in {**headers, **(more or {})}.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(body)

    def _refuse(self, status: HTTPStatus, reason: str) -> None:
        said = {"schema": 1, "error": reason}
        self._send("application/json", json.dumps(said).encode(), status=status)

    def send_error(self, code: int, message: str | None = None, explain: str | None = None) -> None:
        """What the library refuses of itself, as another method, said as everything else is."""
        self.close_connection = True
        status = HTTPStatus(code)
        reason = message or explain or status.description
        self._refuse(status, f"{reason}; only GET of {', '.join(_PATHS)} is answered")

    def log_message(self, format: str, *args: Any) -> None:  # noqa: A002  # the library's name
        """Keep quiet: a line a frame would bury everything else."""


def page() -> str:
    """The page, which refers to nothing outside itself."""
    return (files("harness.live_view") / "page.html").read_text(encoding="utf-8")

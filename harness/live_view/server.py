"""A page on 127.0.0.1 that turns an object: the standard library's server, and nothing from elsewhere."""

import errno
import json
import sys
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from typing import Any
from urllib.parse import parse_qsl, urlsplit

import numpy as np

from harness.basics.errors import TouchstoneError, WrongUse
from harness.basics.files.named_file import nearest
from harness.objectfile.vision.render import ObjectVision
from harness.objectfile.vision.view import FIELD_OF_VIEW, camera_for, light_for
from harness.picture.image_file import png_bytes
from harness.picture.pinhole import DirectionalLight

HOST = "127.0.0.1"
"""Nobody beyond this machine is answered."""

SAID = "X-Touchstone"
"""Header that carries what is said of a frame, one JSON object."""

_IDLE = 30.0
"""s after which a silent connection is closed."""

_POLL = 0.1
"""s, at most, until a server that is told to stop has stopped."""

_PATHS = ("/", "/frame.png", "/start.json")

Three = tuple[float, float, float]

_START = 256
"""Pixels along a side, where a page does not say."""


@dataclass(frozen=True)
class ViewRequest:
    """A picture that is asked for; lengths in m, object's frame. None is what ``camera_for`` chooses."""

    camera: Three | None = None  #: where it is.
    look_at: Three | None = None  #: what is in the middle.
    up: Three | None = None  #: in the picture.
    light: Three | None = None  #: towards the lamp; None for over the left shoulder.
    field_of_view: float = FIELD_OF_VIEW  #: rad across the picture's width.
    width: int = _START  #: pixels.
    height: int = _START  #: pixels.


NAMES = tuple(field.name for field in fields(ViewRequest))
_VECTORS, _COUNTS = ("camera", "look_at", "up", "light"), ("width", "height")


def _three(text: str) -> Three:
    x, y, z = (float(part) for part in text.split(","))
    return x, y, z


_READ: Mapping[str, Callable[[str], Any]] = {
    **dict.fromkeys(_VECTORS, _three),
    **dict.fromkeys(_COUNTS, int),
    "field_of_view": float,
}
_MEANT = {
    **dict.fromkeys(_VECTORS, "three numbers with commas between them"),
    **dict.fromkeys(_COUNTS, "a whole number of pixels"),
    "field_of_view": "a number of radians",
}


@dataclass(frozen=True, eq=False)
class ViewFrame:
    """A picture for a page."""

    png: bytes  #: of it, before white.
    said: Mapping[str, Any]  #: of how it was made: samples, rays, and seconds by stage.


class LiveFrames:
    """Pictures of one object, one at a time, for any number of threads that ask.

    Args:
        name: of the object.
        vision: its look.
    """

    def __init__(self, name: str, vision: ObjectVision) -> None:
        self.name = name
        self._vision = vision
        self._drawing = threading.Lock()

    def start(self) -> Mapping[str, Any]:
        """Return the first state of a page: the object's name, and the default camera and lamp."""
        camera = camera_for(self._vision.surface, _START, _START)
        return {
            "object": self.name,
            "networks": self._vision.entry.level,
            "camera": camera.eye.tolist(),
            "look_at": self._vision.surface.bounds.mean(axis=0).tolist(),
            "light": light_for(camera).direction.tolist(),
            "field_of_view": FIELD_OF_VIEW,
            "size": _START,
            "diagonal_m": self._vision.surface.diagonal,
        }

    def frame(self, asked: ViewRequest) -> ViewFrame:
        """Draw a picture.

        Raises:
            OutOfDomain: a camera within the object or without a direction, a light without one, or a picture
                larger than is drawn.
        """
        begun = time.perf_counter()
        camera = camera_for(
            self._vision.surface,
            asked.width,
            asked.height,
            asked.camera,
            asked.look_at,
            asked.up,
            asked.field_of_view,
        )
        light = light_for(camera) if asked.light is None else DirectionalLight(np.array(asked.light))
        with self._drawing:
            waited = time.perf_counter()
            found = self._vision.picture(camera, light)
            drawn = time.perf_counter()
        png = png_bytes(found.image.display())
        ended = time.perf_counter()
        return ViewFrame(
            png,
            {
                "samples": found.samples,
                "rays": found.rays,
                "seconds": {"wait": waited - begun, "render": drawn - waited, "encode": ended - drawn},
            },
        )


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


def asked_from(query: Mapping[str, str]) -> ViewRequest:
    """What an address asks for.

    Args:
        query: text by name; what is left out is chosen.

    Raises:
        WrongUse: a name that means nothing, or text that is not what the name stands for.
    """
    read: dict[str, Any] = {}
    for name, text in query.items():
        if name not in _READ:
            raise WrongUse(f"no picture has a {name!r}; {nearest(name, NAMES)}")
        try:
            read[name] = _READ[name](text)
        except ValueError:
            raise WrongUse(f"{name}={text}: {_MEANT[name]} is wanted") from None
    return ViewRequest(**read)

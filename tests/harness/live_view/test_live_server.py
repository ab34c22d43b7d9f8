"""The page that turns an object: its frames are the command's, and wrong requests are told what is wrong."""

import json
import socket
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from http.client import HTTPConnection, HTTPResponse
from pathlib import Path
from urllib.parse import urlencode

import pytest

from harness.basics.errors import WrongUse
from harness.cli import invoke
from harness.live_view.server import NAMES, SAID, LiveFrames, LiveServer, page
from harness.objectfile.file import ObjectFile
from harness.objectfile.vision.render import open_vision
from tests.samples.look_bench import box_file, told_look
from tests.support.served_look import served


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """White where the light is seen."""
    return box_file(tmp_path_factory.mktemp("objects") / "box", told_look()).folder


@pytest.fixture(scope="module")
def server(folder: Path) -> Iterator[LiveServer]:
    with served(LiveFrames("box", open_vision(ObjectFile.open(folder), 1))) as running:
        yield running


class Answer:
    """Status, headers and body."""

    def __init__(self, response: HTTPResponse) -> None:
        self.status, self.headers, self.body = response.status, response.headers, response.read()

    @property
    def error(self) -> str:
        said: str = json.loads(self.body)["error"]
        return said


def get(server: LiveServer, path: str, method: str = "GET", host: str | None = None) -> Answer:
    connection = HTTPConnection("127.0.0.1", server.server_port, timeout=120.0)
    try:
        connection.request(method, path, headers={} if host is None else {"Host": host})
        return Answer(connection.getresponse())
    finally:
        connection.close()


def frame(server: LiveServer, **asked: object) -> Answer:
    return get(server, "/frame.png?" + urlencode(asked))


def test_a_frame_is_the_command_s_picture_bit_for_bit(
    server: LiveServer, folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "a.png"
    eye, light = ("0.25", "-0.2", "0.2"), ("1", "-1", "2")
    told = ["--camera", *eye, "--light", *light, "--size", "48x36", "--threads", "1"]
    assert invoke(["object", "render", "vision", str(folder), *told, "--out", str(out), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    asked = {"camera": ",".join(eye), "light": ",".join(light), "width": 48, "height": 36}
    for _ in range(2):  # another picture between them leaves nothing behind
        seen = frame(server, **asked)
        assert (seen.status, seen.headers["Content-Type"]) == (200, "image/png")
        assert seen.body == out.read_bytes()
        made = json.loads(seen.headers[SAID])
        assert (made["samples"], made["rays"]) == (said["samples"], said["rays"])
        assert set(made["seconds"]) == {"wait", "render", "encode"}
        assert frame(server, width=20, height=31, camera="-0.3,0.1,0").status == 200


def test_what_nobody_chose_is_what_the_command_chooses(
    server: LiveServer, folder: Path, tmp_path: Path
) -> None:
    out = tmp_path / "a.png"
    assert invoke(["object", "render", "vision", str(folder), "--out", str(out)]) == 0
    assert frame(server).body == out.read_bytes()
    start = json.loads(get(server, "/start.json").body)
    again = {name: ",".join(map(str, start[name])) for name in ("camera", "look_at", "light")}
    assert frame(server, **again, up="0,0,1", field_of_view=start["field_of_view"]).body == out.read_bytes()


def test_another_light_is_another_picture(server: LiveServer) -> None:
    lit, dark = (frame(server, light=way, width=32, height=32) for way in ("0,0,1", "0,0,-1"))
    assert lit.body != dark.body
    assert json.loads(lit.headers[SAID])["samples"] == json.loads(dark.headers[SAID])["samples"]


def test_frames_asked_for_at_once_do_not_mix(server: LiveServer) -> None:
    """The renderer has one room for its arrays; many may ask."""
    asked = [{"camera": f"0.3,{0.05 * k},0.1", "width": 24 + k, "height": 24} for k in range(6)]
    alone = [frame(server, **each).body for each in asked]
    with ThreadPoolExecutor(6) as crowd:
        together = list(crowd.map(lambda each: frame(server, **each).body, asked))
    assert together == alone
    assert len(set(alone)) == len(alone)


def test_the_page_needs_nothing_from_elsewhere(server: LiveServer) -> None:
    found = get(server, "/")
    assert found.headers["Content-Type"].startswith("text/html")
    text = found.body.decode()
    assert text == page()
    for outside in ("http:", "https:", "//cdn", "src=", "@import"):
        assert outside not in text.replace("view.src =", "")
    # Every name that the page sends is one that is understood.
    sent = text.split("new URLSearchParams({")[1].split("})")[0]
    assert all(f"{name}:" in sent for name in NAMES)


@pytest.mark.parametrize(
    ("path", "status", "said"),
    [
        ("/frame.jpg", 404, "nothing is at /frame.jpg; there are /, /frame.png, /start.json"),
        ("/../etc/passwd", 404, "nothing is at"),
        ("/frame.png?camra=1,2,3", 400, "did you mean 'camera'?"),
        ("/frame.png?camera=1,2", 400, "camera=1,2: three numbers with commas between them"),
        ("/frame.png?camera=1,2,x", 400, "three numbers"),
        ("/frame.png?camera=", 400, "three numbers"),
        ("/frame.png?camera=0,0,nan", 400, "give three finite numbers"),
        ("/frame.png?camera=0,0,0.01", 400, "within the object, whose box of 100 x 80 x 60 mm"),
        ("/frame.png?light=0,0,0", 400, "the way to the light is zero"),
        ("/frame.png?camera=0.3,0,0&up=1,0,0", 400, "give another direction for up"),
        ("/frame.png?width=big", 400, "a whole number of pixels"),
        ("/frame.png?width=0", 400, "a picture of 0 x 256 pixels"),
        ("/frame.png?width=8192&height=8192", 400, "at most 4194304"),
        ("/frame.png?width=64&width=65", 400, "given twice"),
        ("/frame.png?level=fused", 400, "no picture has a 'level'"),
        ("/frame.png?field_of_view=wide", 400, "a number of radians"),
        ("/frame.png?field_of_view=nan", 400, "between 0 and 180 deg"),
        ("/frame.png?field_of_view=4", 400, "between 0 and 180 deg"),
    ],
)
def test_wrong_requests_are_told_what_is_wrong(server: LiveServer, path: str, status: int, said: str) -> None:
    found = get(server, path)
    assert found.status == status
    assert said in found.error
    assert frame(server, width=8, height=8).status == 200


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "OPTIONS"])
def test_only_questions_are_answered(server: LiveServer, method: str) -> None:
    found = get(server, "/frame.png", method)
    assert found.status == 501
    assert "only GET" in found.error


@pytest.mark.parametrize("host", ["example.org", "192.168.0.7:8765", ""])
def test_a_page_of_another_site_is_refused(server: LiveServer, host: str) -> None:
    """A name that resolves to this machine lets a stranger's page read what it shows."""
    found = get(server, "/start.json", host=host)
    assert found.status == 403
    assert server.url in found.error
    assert get(server, "/start.json", host=f"localhost:{server.server_port}").status == 200


def test_nobody_beyond_this_machine_is_answered(server: LiveServer) -> None:
    assert server.server_address[0] == "127.0.0.1"
    with socket.socket() as elsewhere:
        elsewhere.settimeout(1.0)
        # All of 127/8 is this machine; a server on every address would answer here.
        assert elsewhere.connect_ex(("127.0.0.2", server.server_port)) != 0


def test_a_port_in_use_is_refused_with_what_to_say(server: LiveServer) -> None:
    with pytest.raises(WrongUse, match=rf"--port {server.server_port} .*127\.0\.0\.1"):
        LiveServer(server.frames, server.server_port)


def test_what_is_stopped_frees_its_port(server: LiveServer) -> None:
    other = LiveServer(server.frames)
    thread = threading.Thread(target=other.run)
    thread.start()
    assert get(other, "/start.json").status == 200
    other.shutdown()
    thread.join(60.0)
    assert not thread.is_alive()
    LiveServer(server.frames, other.server_port).server_close()

"""``touchstone object view``: says where it is, answers, ends with Ctrl-C; refuses what it cannot show."""

import json
import signal
import socket
import subprocess
import sys
from http.client import HTTPConnection
from pathlib import Path

import pytest

from harness.basics.materials import MATERIALS
from harness.cli import invoke
from harness.objectfile.file import create_object
from tests.samples.look_bench import BOX, box_file
from tests.samples.object_bench import PROVENANCE


@pytest.fixture(scope="module")
def box(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return box_file(tmp_path_factory.mktemp("objects") / "box").folder


def test_ctrl_c_ends_it_and_frees_its_port(box: Path) -> None:
    # As at a terminal: a test run in the background hands on that Ctrl-C is ignored.
    heed = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"
    program = f"{heed}; import sys; from harness.cli import invoke; sys.exit(invoke(sys.argv[1:]))"
    asked = ["object", "view", str(box), "--port", "0", "--threads", "1", "--json"]
    with subprocess.Popen(
        [sys.executable, "-c", program, *asked], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as running:
        try:
            assert running.stdout is not None
            said = json.loads(running.stdout.readline())
            assert said["url"] == f"http://127.0.0.1:{said['port']}/"
            connection = HTTPConnection("127.0.0.1", said["port"], timeout=120.0)
            connection.request("GET", "/frame.png?width=8&height=8")
            assert connection.getresponse().read().startswith(b"\x89PNG")
            running.send_signal(signal.SIGINT)  # with a page still connected
            out, complaints = running.communicate(timeout=300.0)
            connection.close()
        finally:
            running.kill()
    assert (running.returncode, out) == (0, "")
    assert "Traceback" not in complaints
    with socket.create_server(("127.0.0.1", said["port"])):
        pass


def test_what_cannot_be_shown_is_refused(
    box: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert invoke(["object", "view", str(box), "--port", str(port), "--json"]) == 2
        assert f"--port {port} " in json.loads(capsys.readouterr().out)["error"]
    blind = create_object(tmp_path / "blind", "box", BOX, MATERIALS["wood"], PROVENANCE).folder
    assert invoke(["object", "view", str(blind)]) == 1
    assert "--only vision" in capsys.readouterr().err
    assert invoke(["object", "view", str(box), "--port", "65536"]) == 2

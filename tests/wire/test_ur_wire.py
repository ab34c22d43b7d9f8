"""The mocked controller's ports, byte by byte."""

import itertools
import random
import socket
import struct
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from mocks.ur.rtde_server import OUTPUTS
from tests.support.ur_process import PORTS, UrProcess, is_free, wait_until

ROOT = str(Path(__file__).resolve().parents[2])
NORMAL = (86, 118, 77, 85, 79, 73, 83, 80)


class Client:
    """A bare client of port 30004."""

    def __init__(self, host: str) -> None:
        self.link = socket.create_connection((host, 30004), timeout=3.0)
        self.bytes = self.link.makefile("rb")

    def ask(self, kind: int, payload: bytes = b"") -> bytes:
        """Send one packet; the payload of the answer of its kind."""
        self.send(kind, payload)
        return self.receive(kind)

    def send(self, kind: int, payload: bytes = b"") -> None:
        self.link.sendall(struct.pack(">HB", 3 + len(payload), kind) + payload)

    def receive(self, kind: int) -> bytes:
        while True:
            size, found = struct.unpack(">HB", self.bytes.read(3))
            payload = self.bytes.read(size - 3)
            if found == kind:
                return payload

    def outputs(self, names: str, frequency: float = 125.0) -> bytes:
        return self.ask(ord("O"), struct.pack(">d", frequency) + names.encode())

    def close(self) -> None:
        self.bytes.close()
        self.link.close()


@pytest.fixture(scope="module")
def mock() -> Iterator[UrProcess]:
    with UrProcess() as process:
        yield process


@pytest.fixture
def client(mock: UrProcess) -> Iterator[Client]:
    client = Client(mock.host)
    assert client.ask(ord("V"), b"\0\2") == b"\1"
    yield client
    client.close()


def test_versions(client: Client) -> None:
    assert client.ask(ord("V"), b"\0\3") == b"\0"
    assert struct.unpack(">4I", client.ask(ord("v")))[:2] == (5, 12)


@pytest.mark.parametrize("comma", ["", ","])
def test_outputs_are_set_up_by_name(client: Client, comma: str) -> None:
    assert client.outputs("timestamp,actual_q,robot_mode" + comma) == b"\1DOUBLE,VECTOR6D,INT32"


def test_a_name_that_is_not_known_is_said_in_its_place(client: Client) -> None:
    assert client.outputs("timestamp,nonsense") == b"\0DOUBLE,NOT_FOUND"
    assert client.ask(ord("S")) == b"\0"


def test_starting_without_outputs_is_refused(client: Client) -> None:
    assert client.ask(ord("S")) == b"\0"


@pytest.mark.parametrize(("frequency", "cycles"), [(500.0, {1}), (125.0, {4}), (60.0, {8, 9})])
def test_packets_come_on_the_grid_of_cycles(client: Client, frequency: float, cycles: set[int]) -> None:
    client.outputs("timestamp", frequency)
    assert client.ask(ord("S")) == b"\1"
    stamps = []
    for _ in range(60):
        payload = client.receive(ord("U"))
        assert payload[0] == 1
        stamps.append(struct.unpack(">d", payload[1:])[0])
    steps = {round((b - a) / 0.002, 6) for a, b in itertools.pairwise(stamps)}
    assert steps == cycles
    assert stamps[0] > 100.0
    assert client.ask(ord("P")) == b"\1"


@pytest.mark.parametrize(
    ("kind", "name"), [("O", "actual_q"), ("O", "no_such_variable"), ("I", "input_double_register_1")]
)
def test_a_recipe_that_fits_no_packet_ends_its_connection_and_nothing_else(
    mock: UrProcess, client: Client, kind: str, name: str
) -> None:
    greedy = Client(mock.host)
    greedy.ask(ord("V"), b"\0\2")
    names = ",".join([name] * min(1500, 65_000 // (1 + len(name)))).encode()
    # 1,500 vectors make a packet of 72,000 bytes; a header counts to 65,535.
    greedy.send(ord(kind), (struct.pack(">d", 500.0) if kind == "O" else b"") + names)
    assert b"fit a packet" in greedy.bytes.read()
    greedy.close()
    _assert_alive(client)


def test_a_recipe_of_every_variable_is_served(client: Client) -> None:
    types = client.outputs(",".join(OUTPUTS)).split(b",")
    assert len(types) == len(OUTPUTS)
    assert client.ask(ord("S")) == b"\1"
    assert client.receive(ord("U"))[0] == 1


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "10.0.0.1", "localhost.example"])  # noqa: S104
def test_an_address_that_others_can_reach_is_not_served(host: str) -> None:
    command = [sys.executable, "-m", "tests.support.ur_controller", "--host", host]
    done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
    assert done.returncode != 0
    assert f"'{host}'" in done.stderr
    assert "loopback" in done.stderr


@pytest.mark.parametrize("frequency", [0.0, -1.0, 501.0, float("nan")])
def test_a_frequency_out_of_range_is_refused(client: Client, frequency: float) -> None:
    assert client.outputs("timestamp", frequency)[0] == 0


def test_inputs_are_numbered_from_one_and_belong_to_one_client(mock: UrProcess, client: Client) -> None:
    assert client.ask(ord("I"), b"input_int_register_5") == b"\1INT32"
    assert client.ask(ord("I"), b"input_int_register_5,input_double_register_5") == b"\2INT32,DOUBLE"
    other = Client(mock.host)
    other.ask(ord("V"), b"\0\2")
    assert other.ask(ord("I"), b"input_int_register_5,input_int_register_6") == b"\0IN_USE,INT32"
    assert other.ask(ord("I"), b"input_int_register_6,nonsense") == b"\0INT32,NOT_FOUND"
    assert other.ask(ord("I"), b"input_int_register_6") == b"\1INT32"
    other.close()

    def free_again() -> bool:
        return client.ask(ord("I"), b"input_int_register_6")[0] > 0

    wait_until(free_again)


def test_inputs_keep_what_was_written_and_can_be_read_back(client: Client) -> None:
    names = b"input_int_register_7,input_double_register_7,input_bit_register_70"
    assert client.ask(ord("I"), names)[0] == 1
    client.outputs(names.decode(), 500.0)
    client.send(ord("U"), b"\1" + struct.pack(">id?", -42, 2.5, True))
    client.ask(ord("S"))
    wait_until(lambda: client.receive(ord("U"))[1:] == struct.pack(">id?", -42, 2.5, True))


def test_data_of_a_wrong_length_ends_the_connection(client: Client) -> None:
    assert client.ask(ord("I"), b"input_int_register_8")[0] == 1
    client.send(ord("U"), b"\1\0\0")
    assert b"bytes of data" in client.bytes.read()


def test_masked_outputs_ignore_what_is_not_masked(client: Client) -> None:
    names = ",".join(f"standard_analog_output_{name}" for name in ("mask", "type", "0", "1"))
    assert client.ask(ord("I"), names.encode()) == b"\1UINT8,UINT8,DOUBLE,DOUBLE"
    client.outputs("standard_analog_output0,standard_analog_output1", 500.0)
    client.send(ord("U"), b"\1" + struct.pack(">BBdd", 1, 0, 0.25, 6.9e-310))
    client.ask(ord("S"))
    wait_until(lambda: client.receive(ord("U"))[1:] == struct.pack(">dd", 0.25, 0.0))


@pytest.mark.parametrize("port", PORTS)
def test_random_bytes_never_stop_the_cycle(mock: UrProcess, client: Client, port: int) -> None:
    noise = random.Random(port)
    for size in (1, 3, 17, 400, 5000):
        with socket.create_connection((mock.host, port), timeout=3.0) as link:
            link.sendall(noise.randbytes(size))
            for kind in NORMAL:
                payload = noise.randbytes(noise.randrange(40))
                try:
                    link.sendall(struct.pack(">HB", 3 + len(payload), kind) + payload)
                except ConnectionError:
                    break
    _assert_alive(client)


@pytest.mark.parametrize(
    "script",
    [
        "def f(:\nend\n",
        "def f():\n while True:\n end\nend\n",
        "def f():\n f()\nend\n",
        "def f():\n x = " + "(" * 3000 + "1" + ")" * 3000 + "\nend\n",
        "def f():\n x = 2\n while True:\n  x = x * x\n end\nend\n",
        'def f():\n x = "ab"\n while True:\n  x = x + x\n end\nend\n',
        "def f():\n movej(7)\nend\n",
        "def f():\n x = [1, 2]\n x[2] = 0\nend\n",
        "def f():\n write_output_integer_register(0, 3000000000)\nend\n",
        "def f():\n x = [1, 2]\n while True:\n  x = [x, x]\n  sync()\n end\nend\n",
        "import os\n",
        "__import__('os')\n",
        "open('x')\n",
    ],
)
def test_bad_programs_stop_and_nothing_else(mock: UrProcess, client: Client, script: str) -> None:
    with socket.create_connection((mock.host, 30002), timeout=3.0) as link:
        link.sendall(script.encode())
    _assert_alive(client)
    wait_until(lambda: mock.ask("running") == "Program running: false")


def _assert_alive(client: Client) -> None:
    client.outputs("timestamp", 500.0)
    assert client.ask(ord("S")) == b"\1"
    first = struct.unpack(">d", client.receive(ord("U"))[1:])[0]
    for _ in range(100):
        last = struct.unpack(">d", client.receive(ord("U"))[1:])[0]
    assert last - first == pytest.approx(0.2, abs=1e-6)
    client.ask(ord("P"))


def test_end_of_input_ends_the_process_and_frees_the_ports() -> None:
    mock = UrProcess()
    with mock:
        held = socket.create_connection((mock.host, 30004), timeout=3.0)
        assert not any(is_free(mock.host, port) for port in PORTS)
        assert mock.end() == 0
        held.close()
    wait_until(lambda: all(is_free(mock.host, port) for port in PORTS))


def test_the_process_ends_with_the_parent_that_was_killed() -> None:
    """The parent is killed with -9; its pipe's end of file is all the controller sees."""
    parent = subprocess.Popen(
        [
            sys.executable,
            "-c",
            f"import sys, time; sys.path.insert(0, {ROOT!r})\n"
            "from tests.support.ur_process import UrProcess\n"
            "mock = UrProcess().__enter__(); print(mock.host, mock.process.pid, flush=True); time.sleep(60)",
        ],
        stdout=subprocess.PIPE,
    )
    assert parent.stdout is not None
    host, _ = parent.stdout.readline().decode().split()
    assert not is_free(host, 30004)
    parent.kill()
    parent.communicate()
    wait_until(lambda: all(is_free(host, port) for port in PORTS))

"""Public data is fetched from a local server: once, whole, verified, and found by the tests afterwards."""

import hashlib
import threading
from collections import Counter
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path, PurePosixPath

import pytest

from harness.experiment import subjects
from tests.support.fetch_data import MANIFEST, PublicFile, fetch_data, main, read_table
from tests.support.real_data import find_shared_data

CONTENT = {"a/beam.npy": b"beam" * 9000, "b/mug's scan.obj": b"mug", "b/bowl.obj": b"bowl"}


class Server(ThreadingHTTPServer):
    """Serve CONTENT as a host of repositories does."""

    def __init__(self) -> None:
        super().__init__(("127.0.0.1", 0), Handler)
        self.content = dict(CONTENT)
        self.requests: Counter[str] = Counter()
        self.interrupted = 0  #: how many of the next answers end halfway.

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self.server_port}"


class Handler(BaseHTTPRequestHandler):
    server: Server

    def do_GET(self) -> None:
        name = self.path.removeprefix("/lab/data/c0ffee/").replace("%20", " ").replace("%27", "'")
        self.server.requests[name] += 1
        if name not in self.server.content:
            self.send_error(404)
            return
        content = self.server.content[name]
        self.send_response(200)
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        if self.server.interrupted:
            self.server.interrupted -= 1
            content = content[: len(content) // 2]
        self.wfile.write(content)

    def log_request(self, code: object = "", size: object = "") -> None:
        pass

    def log_error(self, *args: object) -> None:
        pass


@pytest.fixture
def server() -> Iterator[Server]:
    server = Server()
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
    thread.start()
    yield server
    server.shutdown()
    thread.join()
    server.server_close()


@pytest.fixture
def table(tmp_path: Path) -> Path:
    header = "file,repository,commit,path,sha256,size,licence\n"
    rows = [
        f"{name},lab/data,c0ffee,{name},{hashlib.sha256(content).hexdigest()},{len(content)},MIT\n"
        for name, content in CONTENT.items()
    ]
    path = tmp_path / "table.csv"
    path.write_text(header + "".join(rows))
    return path


@pytest.fixture
def files(table: Path) -> list[PublicFile]:
    return read_table(table)


def files_in(folder: Path) -> dict[str, bytes]:
    """Contents of the files below a folder, without the manifest."""
    paths = (path for path in folder.rglob("*") if path.is_file() and path.name != MANIFEST)
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in paths}


def test_each_file_is_fetched_once_and_the_folder_is_found(
    server: Server, files: list[PublicFile], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "data"
    monkeypatch.setenv("TOUCHSTONE_DATA", str(folder))
    assert find_shared_data() is None
    for _ in range(2):
        assert fetch_data(folder, files, server.address) == []
    assert files_in(folder) == CONTENT
    assert server.requests == dict.fromkeys(CONTENT, 1)
    assert find_shared_data() == folder
    assert all(f"| {file.file} | lab/data @ c0ffee |" in (folder / MANIFEST).read_text() for file in files)


def test_a_wrong_or_missing_file_is_named_and_the_others_are_kept(
    server: Server, table: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    server.content["b/bowl.obj"] = b"another bowl"
    del server.content["a/beam.npy"]
    arguments = [str(tmp_path / "data"), "--table", str(table), "--host", server.address]
    assert main(arguments) == 1
    missing, wrong, advice = capsys.readouterr().err.splitlines()
    assert missing.startswith("a/beam.npy: 404")
    assert wrong.startswith("b/bowl.obj: not kept, its SHA-256 is not ")
    assert all(f"{server.address}/lab/data/c0ffee/" in line for line in (missing, wrong))
    assert "make data" in advice
    assert files_in(tmp_path / "data") == {"b/mug's scan.obj": b"mug"}
    server.content = dict(CONTENT)
    assert main(arguments) == 0
    assert files_in(tmp_path / "data") == CONTENT
    assert server.requests["b/mug's scan.obj"] == 1


def test_an_interrupted_download_is_repeated_and_never_kept(
    server: Server, files: list[PublicFile], tmp_path: Path
) -> None:
    server.interrupted = 1
    assert fetch_data(tmp_path / "once", files, server.address) == []
    assert files_in(tmp_path / "once") == CONTENT
    server.interrupted = 2
    (failure,) = fetch_data(tmp_path / "twice", files[:1], server.address)
    assert failure.startswith("a/beam.npy: ")
    assert not any(path.is_file() for path in (tmp_path / "twice").rglob("*"))


def test_without_a_network_the_first_file_says_so(
    table: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    closed = Server()
    closed.server_close()
    folder = tmp_path / "data"
    assert main([str(folder), "--table", str(table), "--host", closed.address]) == 1
    said = capsys.readouterr().err
    assert f"cannot reach {closed.address}/lab/data/c0ffee/a/beam.npy" in said
    assert "0 of 3 files are in" in said
    assert "make data" in said
    assert not (folder / MANIFEST).exists()


def test_a_manifest_of_another_author_is_kept(
    server: Server, files: list[PublicFile], tmp_path: Path
) -> None:
    (tmp_path / MANIFEST).write_text("# Real data\n")
    assert fetch_data(tmp_path, files, server.address) == []
    assert (tmp_path / MANIFEST).read_text() == "# Real data\n"


def test_without_a_named_folder_data_is_in_the_users_cache(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("TOUCHSTONE_DATA", raising=False)
    monkeypatch.setenv("TOUCHSTONE_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(subjects, "__file__", str(tmp_path / "code/harness/experiment/subjects.py"))
    assert subjects.find_data_folder() == tmp_path / "cache/data"
    (tmp_path / "shared/data").mkdir(parents=True)
    assert subjects.find_data_folder() == tmp_path / "shared/data"


def test_the_table_is_sorted_and_stays_in_its_folder() -> None:
    rows = read_table()
    names = [row.file for row in rows]
    assert names == sorted(set(names))
    assert all(len(row.sha256) == 64 and len(row.commit) == 40 and row.licence for row in rows)
    assert not any(PurePosixPath(name).is_absolute() or ".." in name for name in names)


def test_the_tables_hashes_are_those_of_the_data(shared_data: Path) -> None:
    present = [row for row in read_table() if (shared_data / row.file).exists()]
    assert len(present) > 300
    for row in present:
        content = (shared_data / row.file).read_bytes()
        assert (hashlib.sha256(content).hexdigest(), len(content)) == (row.sha256, row.size), row.file

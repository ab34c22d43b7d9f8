"""Fetch the public test data: ``make data``, or ``python -m tests.support.fetch_data [FOLDER]``.

``public_data.csv`` lists repository, commit, path and SHA-256 of each file. A file that is present with the
right hash is not fetched again, so a second call resumes an interrupted one.
"""

import argparse
import csv
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

import pooch
import requests

from harness.experiment.subjects import find_data_folder

TABLE = Path(__file__).with_name("public_data.csv")
HOST = "https://raw.githubusercontent.com"
MANIFEST = "MANIFEST.md"
HEADING = "# Public test data, fetched by `make data`\n"


@dataclass(frozen=True)
class PublicFile:
    """A row of ``public_data.csv``."""

    file: str  #: path below the data folder.
    repository: str  #: owner/name.
    commit: str  #: full hash.
    path: str  #: path inside the repository.
    sha256: str
    size: int  #: in bytes.
    licence: str

    def url(self, host: str) -> str:
        """Return the address of the file on a host that serves repositories as HOST does."""
        return f"{host}/{self.repository}/{self.commit}/{quote(self.path)}"


def read_table(path: Path = TABLE) -> list[PublicFile]:
    """Read the rows of a table such as ``public_data.csv``."""
    with path.open(encoding="utf-8", newline="") as lines:
        return [PublicFile(size=int(row.pop("size")), **row) for row in csv.DictReader(lines)]


def fetch_data(folder: Path, files: Sequence[PublicFile], host: str = HOST) -> list[str]:
    """Fetch the files that are missing or differ, then list in ``MANIFEST.md`` what the folder holds.

    A manifest that this function did not write is kept.

    Returns:
        A message for each file that could not be fetched.

    Raises:
        ConnectionError: the host cannot be reached; no manifest is written.
    """
    pooch.get_logger().setLevel("ERROR")
    urls = {file.file: file.url(host) for file in files}
    hashes = {file.file: f"sha256:{file.sha256}" for file in files}
    fetcher = pooch.create(folder, base_url="", registry=hashes, urls=urls, retry_if_failed=1)
    present, failures = [], []
    for number, file in enumerate(files, start=1):
        sys.stdout.write(f"[{number}/{len(files)}] {file.file}, {file.size / 1e6:.1f} MB\n")
        try:
            fetcher.fetch(file.file)
            present.append(file)
        except requests.ConnectionError as error:
            raise ConnectionError(
                f"{file.file}: cannot reach {urls[file.file]} ({error}).\n"
                f"{len(present)} of {len(files)} files are in {folder}. Connect to the network and run "
                "`make data` again; it resumes there."
            ) from error
        except requests.RequestException as error:
            failures.append(f"{file.file}: {error} ({urls[file.file]})")
        except ValueError:
            failures.append(f"{file.file}: not kept, its SHA-256 is not {file.sha256} ({urls[file.file]})")
    manifest = folder / MANIFEST
    if present and (not manifest.exists() or manifest.read_text(encoding="utf-8").startswith(HEADING)):
        rows = [f"| {f.file} | {f.repository} @ {f.commit} | {f.path} | {f.licence} |\n" for f in present]
        table = "\n| file | repository | path | licence |\n|---|---|---|---|\n"
        part = folder / f"{MANIFEST}.part"
        part.write_text(HEADING + table + "".join(rows), encoding="utf-8")
        part.replace(manifest)
    return failures


def main(arguments: Sequence[str] | None = None) -> int:
    """Fetch the data as the command line says, and return the exit code."""
    parser = argparse.ArgumentParser(description="Fetch the public test data.")
    parser.add_argument("folder", nargs="?", type=Path, default=find_data_folder())
    parser.add_argument("--table", type=Path, default=TABLE, help="table of the files")
    parser.add_argument("--host", default=HOST, help="server of the repositories, or a mirror of it")
    options = parser.parse_args(arguments)
    try:
        failures = fetch_data(options.folder, read_table(options.table), options.host)
    except OSError as error:
        sys.stderr.write(f"{error}\n")
        return 1
    for failure in failures:
        sys.stderr.write(f"{failure}\n")
    if failures:
        sys.stderr.write(
            f"{len(failures)} of the files were not fetched. Run `make data` again; if that fails too, the "
            f"source has changed: correct their rows in {options.table}.\n"
        )
        return 1
    sys.stdout.write(f"The public test data is complete in {options.folder}.\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())

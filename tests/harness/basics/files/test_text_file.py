"""Text of any encoding, line end and compression reads as the same lines, or the cause is named."""

import codecs
import gzip
import time
from pathlib import Path

import pytest

from harness.basics.errors import DataRefused, WrongUse
from harness.basics.files.text_file import read_text, read_text_bytes

TEXT = "size = 1.5 \N{MICRO SIGN}m\nnext\n"

WRITTEN = {
    "plain": TEXT.encode(),
    "UTF-8 mark": codecs.BOM_UTF8 + TEXT.encode(),
    "UTF-16 LE mark": codecs.BOM_UTF16_LE + TEXT.encode("utf-16-le"),
    "UTF-16 BE mark": codecs.BOM_UTF16_BE + TEXT.encode("utf-16-be"),
    "UTF-32 LE mark": codecs.BOM_UTF32_LE + TEXT.encode("utf-32-le"),
    "UTF-32 BE mark": codecs.BOM_UTF32_BE + TEXT.encode("utf-32-be"),
    "UTF-16 LE": TEXT.encode("utf-16-le"),
    "UTF-16 BE": TEXT.encode("utf-16-be"),
    "CRLF": TEXT.replace("\n", "\r\n").encode(),
    "CR": TEXT.replace("\n", "\r").encode(),
    "mixed": TEXT.replace("m\n", "m\r").replace("t\n", "t\r\n").encode(),
    "gzip": gzip.compress(TEXT.encode()),
    "gzip of UTF-16": gzip.compress(TEXT.encode("utf-16")),
    "gzip of two members": gzip.compress(TEXT[:5].encode()) + gzip.compress(TEXT[5:].encode()),
}


@pytest.mark.parametrize("written", WRITTEN)
def test_a_text_is_the_same_however_it_was_written(written: str, tmp_path: Path) -> None:
    (tmp_path / "some.txt").write_bytes(WRITTEN[written])
    assert read_text(tmp_path / "some.txt", "a text") == TEXT


def test_text_that_is_not_utf_8_is_refused_with_its_line(tmp_path: Path) -> None:
    (tmp_path / "some.txt").write_bytes(
        "one\rtwo\rM\N{LATIN SMALL LETTER U WITH DIAERESIS}ller".encode("latin-1")
    )
    with pytest.raises(DataRefused, match=r"some\.txt, line 3: .*0xfc .*UTF-8"):
        read_text(tmp_path / "some.txt", "a text")
    assert read_text_bytes(tmp_path / "some.txt", "a text").endswith(b"\nM\xfcller")


@pytest.mark.parametrize("cut", [4, 12, 40])
def test_a_damaged_gzip_file_is_refused(cut: int, tmp_path: Path) -> None:
    data = gzip.compress(bytes(range(256)) * 40)
    (tmp_path / "some.gz").write_bytes(data[:-cut])
    with pytest.raises(DataRefused, match=r"some\.gz .*gzip"):
        read_text(tmp_path / "some.gz", "a text")


def test_a_gzip_bomb_is_refused_before_it_is_unpacked(tmp_path: Path) -> None:
    member = gzip.compress(bytes(2**24))
    (tmp_path / "some.gz").write_bytes(member * 64)  # 1 GiB in 1 MiB
    begun = time.process_time()
    with pytest.raises(WrongUse, match=r"some\.gz .*1 MiB"):
        read_text(tmp_path / "some.gz", "a scene", 2**20, WrongUse)
    assert time.process_time() - begun < 1.0


def test_damaged_utf_16_is_refused(tmp_path: Path) -> None:
    (tmp_path / "some.txt").write_bytes(codecs.BOM_UTF16_LE + b"a\0b")
    with pytest.raises(DataRefused, match="UTF-16-LE"):
        read_text(tmp_path / "some.txt", "a text")

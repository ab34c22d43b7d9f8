"""XML of other programs, streamed through handlers, so that memory follows what is kept of it."""

import zipfile
from typing import IO, Any
from xml.parsers import expat

from harness.basics.errors import MeshRefused

_CHUNK = 2**16
_MAX_DEPTH = 500
_MAX_TOKEN = 2**20
"""Bytes of one tag with its attributes: the parser scans a tag from its start for every chunk of it."""


def parse_xml(
    stream: IO[bytes], start: Any, end: Any, where: str, declare: Any = None, text: Any = None
) -> None:
    """Stream XML through handlers, without any document type: entities can multiply without end.

    Args:
        stream: of the bytes.
        start: called with a tag, as ``"namespace name"``, and its attributes.
        end: called with a tag.
        where: the file, for messages.
        declare: called with each namespace's prefix and address; None to ignore them.
        text: called with the text between tags; None to ignore it.

    Raises:
        MeshRefused: XML that is cut short or damaged, or declares a document type.
    """

    def refuse(*_: Any) -> None:
        raise MeshRefused(
            f"{where} declares a document type (DTD), whose entities are not read; export it again"
        )

    depth = 0

    def count_start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += 1
        if depth > _MAX_DEPTH:
            raise MeshRefused(f"{where} nests more than {_MAX_DEPTH} XML elements, the most that are read")
        start(tag, attributes)

    def count_end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        end(tag)

    parser = expat.ParserCreate(namespace_separator=" ")
    parser.buffer_text = True
    parser.StartElementHandler, parser.EndElementHandler = count_start, count_end
    parser.StartDoctypeDeclHandler = refuse
    parser.CharacterDataHandler = text
    if declare is not None:
        parser.StartNamespaceDeclHandler = declare
    read = 0
    try:
        while chunk := stream.read(_CHUNK):
            parser.Parse(chunk, False)
            read += len(chunk)
            if read - parser.CurrentByteIndex > _MAX_TOKEN:
                raise MeshRefused(
                    f"{where} holds an XML tag of over {_MAX_TOKEN / 2**20:g} MiB; export it again"
                )
        parser.Parse(b"", True)
    except (expat.ExpatError, zipfile.BadZipFile, EOFError, UnicodeDecodeError, LookupError) as error:
        raise MeshRefused(
            f"{where} is no readable XML ({error}); it is cut short or damaged, export it again"
        ) from error

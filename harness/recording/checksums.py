"""Checksums of a run's step files: any change of their bytes is noticed before they are read.

MCAP's checksums cover the messages alone: not what a step was asked to do, nor what its channels mean. So a
step file carries the SHA-256 of all of its bytes in its head, where viewers show it as the library's name;
the checksum's own place counts as zeros.
"""

from hashlib import sha256

_TITLE = "touchstone step 2 sha256 "
_BLANK = "0" * 64
UNSUMMED_LIBRARY = _TITLE + _BLANK
"""The library's name of a step file whose checksum is still to be filled in."""

_TITLE_AT = 25
"""Bytes of an MCAP file before the library's name: magic, the head's opcode and length, an empty profile."""
_SUM_AT = slice(_TITLE_AT + len(_TITLE), _TITLE_AT + len(UNSUMMED_LIBRARY))


def with_checksum(step_file: bytes) -> bytes:
    """The bytes of a step file with its checksum filled in."""
    return step_file[: _SUM_AT.start] + _sum_of(step_file) + step_file[_SUM_AT.stop :]


def has_checksum(step_file: bytes) -> bool:
    """Whether a step file was written with a checksum; those of schema 1 were not."""
    return step_file[_TITLE_AT : _SUM_AT.start] == _TITLE.encode()


def is_intact(step_file: bytes) -> bool:
    """Whether a step file's bytes agree with the checksum in its head."""
    return has_checksum(step_file) and step_file[_SUM_AT] == _sum_of(step_file)


def _sum_of(step_file: bytes) -> bytes:
    state = sha256(step_file[: _SUM_AT.start])
    state.update(_BLANK.encode())
    state.update(memoryview(step_file)[_SUM_AT.stop :])
    return state.hexdigest().encode()

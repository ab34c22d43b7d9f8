"""PortAudio, loaded when a sound card is opened; and devices chosen by name."""

import threading
from typing import Any

from harness.basics.errors import BenchFault

_lock = threading.Lock()
_users = 0


def acquire() -> Any:
    """The ``sounddevice`` module, with the list of devices as it is now; `release` it after use.

    PortAudio lists devices when it starts, and a microphone may have been plugged in since:
    it is started again unless this process is using it.

    Raises:
        BenchFault: sounddevice or the PortAudio library is not installed.
    """
    global _users
    with _lock:
        library = _load()
        if _users == 0:
            _list_again(library)
        _users += 1
        return library


def release() -> None:
    """Say that a stream opened after `acquire` is closed."""
    global _users
    with _lock:
        _users -= 1


def _load() -> Any:
    try:
        import sounddevice
    except ImportError as missing:
        raise BenchFault(
            "a microphone needs the Python package sounddevice; say: pip install sounddevice"
        ) from missing
    except OSError as missing:  # the package looks for the library when it is imported
        raise BenchFault(
            "a microphone needs the PortAudio library, and it is not installed; "
            "on Debian or Ubuntu say: apt-get install libportaudio2"
        ) from missing
    return sounddevice


def _list_again(library: Any) -> None:
    """Start PortAudio anew; sounddevice documents no other way to see new devices."""
    try:
        library._terminate()  # noqa: SLF001
        library._initialize()  # noqa: SLF001
    except library.PortAudioError as error:
        raise BenchFault(
            f"PortAudio did not start: {_reason(error)}; check the system's sound settings"
        ) from error


def find_input(library: Any, device: str, channels: int) -> dict[str, Any]:
    """The one input device of that name, which must have just so many channels.

    A device is named as PortAudio names it, or by its name, a comma, a space and its host API
    (``"Scarlett 2i2 USB: Audio (hw:1,0), ALSA"``), or by a part of one name only.

    Raises:
        BenchFault: there is none, or more than one; lists those that there are. Or it has another
            number of channels.
    """
    interfaces = library.query_hostapis()
    inputs = [dict(found) for found in library.query_devices() if found["max_input_channels"] > 0]
    full = {f"{each['name']}, {interfaces[each['hostapi']]['name']}": each for each in inputs}
    chosen = [each for name, each in full.items() if device in (name, each["name"])]
    chosen = chosen or [each for name, each in full.items() if device and device in name]
    if len(chosen) == 1:
        return _with_channels(chosen[0], channels)
    there = "; ".join(repr(name) for name in full) or "none at all"
    problem = "is no sound input here" if not chosen else f"fits {len(chosen)} sound inputs"
    raise BenchFault(
        f"microphone: {device!r} {problem}; plug it in or name one of these in the station: {there}"
    )


def _with_channels(found: dict[str, Any], channels: int) -> dict[str, Any]:
    if found["max_input_channels"] != channels:
        raise BenchFault(
            f"microphone: {found['name']!r} has {found['max_input_channels']} input channels and the station "
            f"says {channels}; another number would be mixed without a word: set the station's channels to "
            "the device's"
        )
    return found


def _reason(error: Exception) -> str:
    return str(error.args[0]) if error.args else type(error).__name__

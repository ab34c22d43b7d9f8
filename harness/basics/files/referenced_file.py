"""Files that another file names: regular ones inside its own folder, and no others."""

import os
import re
from pathlib import Path, PureWindowsPath
from urllib.parse import unquote

from harness.basics.errors import DataRefused, TouchstoneError

_SCHEME = re.compile(r"[A-Za-z][A-Za-z0-9+.\-]+:")


def referenced_path(of: Path, name: str, refused: type[TouchstoneError] = DataRefused) -> Path | None:
    """Find the file that another file refers to.

    Backslashes separate folders as slashes do, since many exporters write the paths of Windows. A name that
    matches no file is tried again with its percent signs decoded.

    Args:
        of: the file that contains the name.
        name: relative to the folder of ``of``, as written there.
        refused: class of the error.

    Returns:
        The file's path; None if nothing has that name.

    Raises:
        TouchstoneError: of the class ``refused``, for an absolute path, a URL, a path or link that leaves the
            folder, and for a pipe, a device or a folder.
    """
    folder = Path(os.path.realpath(of.parent))
    for candidate in dict.fromkeys((name, unquote(name))):
        plain = candidate.replace("\\", "/")
        windows = PureWindowsPath(candidate)
        outside = windows.drive or windows.root or _SCHEME.match(plain) or ".." in plain.split("/")
        if outside or "\0" in candidate or not plain.strip():
            raise refused(
                f"{of.name} refers to {name!r}; only files inside its folder are read: put the file there "
                "and name it by a relative path"
            )
        # A name too long for the system is nobody's.
        try:
            path = Path(os.path.realpath(folder / plain))
            there, regular = path.exists(), path.is_file()
        except (OSError, ValueError):
            continue
        if not path.is_relative_to(folder):
            raise refused(
                f"{of.name} refers to {name!r}, a link out of its folder; put the file itself there"
            )
        if there and not regular:
            raise refused(f"{of.name} refers to {name!r}, which is a folder, a device or a pipe, and no file")
        if there:
            return path
    return None

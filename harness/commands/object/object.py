"""``touchstone object``: what an ObjectFile holds, and whether it is what it says."""

from harness.commands import options
from harness.commands.output import print_result


def info(folder: options.ObjectFolder, json: options.Json = False) -> int:
    """Say what an ObjectFile holds: the object, its modes, its networks, where they come from.

    Only object.json is read; whether the files are what it says is asked of `touchstone object verify`.

    Try: touchstone object info objects/mug
    """
    from harness import api
    from harness.tasks.objects import ObjectInfo

    print_result(ObjectInfo(folder, api.load_object(folder).description), json)
    return 0


def verify(folder: options.ObjectFolder, json: options.Json = False) -> int:
    """Check an ObjectFile: hashes, graphs, shapes, finite answers, and the answers it was made with.

    Nothing is written, nothing outside of the folder is read, and nothing in it can run code: a graph
    whose weights lie elsewhere, or that asks for an unknown operation, is refused before it is opened.
    Exit code 0 where all holds, 1 where anything does not; every line that fails says what to do.

    Try: touchstone object verify objects/mug
    """
    from harness import api

    verified = api.verify_object(folder)
    print_result(verified, json)
    return 0 if verified.verified else 1

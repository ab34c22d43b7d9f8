"""``touchstone catalogue publish``: what a build made is copied to a folder or an object store."""

from collections import Counter
from typing import Annotated

import typer

from harness.commands import options
from harness.commands.catalogue.status import BuiltFolder
from harness.commands.output import ANSWERS, emit, share_progress


def publish(
    folder: BuiltFolder,
    to: Annotated[
        str,
        typer.Argument(
            help="A folder, or a URL that fsspec has a driver for: s3://bucket/objects, sftp://host/objects.",
            metavar="URL",
        ),
    ],
    json: options.Json = False,
) -> int:
    """Copy the ObjectFiles of a build to another folder or an object store.

    What is there already is not sent again, and a copy that was stopped goes on. An object is whole there
    once its object.json is. Drivers are packages of their own, as s3fs for s3://. A build may be running
    meanwhile. Exit code 0 where every object of the catalogue is there, else 1.

    Try: touchstone catalogue publish built s3://bucket/objects
    """
    from harness.authoring.catalogue.layout import BuildFolder
    from harness.authoring.catalogue.publish import ObjectStore, publish

    store = ObjectStore(to)
    with share_progress(quiet=json) as report:
        found = publish(BuildFolder(folder), store, report)
    counts = Counter(each.outcome for each in found)
    sent = sum(each.sent for each in found)
    if json:
        objects = [{"name": e.name, "outcome": e.outcome, "bytes": e.sent} for e in found]
        emit({"schema": 1, "url": to, "counts": dict(counts), "bytes": sent, "objects": objects})
    else:
        said = ", ".join(f"{count} {outcome}" for outcome, count in counts.most_common())
        ANSWERS.print(f"{len(found)} objects: {said}; {sent / 1e6:.3g} MB sent to {to}", markup=False)
    return 1 if counts["not built"] else 0

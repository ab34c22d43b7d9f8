"""``touchstone catalogue publish``: what a build made is copied to a folder or an object store."""

from typing import Annotated

import typer

from harness.commands import options
from harness.commands.catalogue.status import BuiltFolder
from harness.commands.output import print_result, share_progress


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
    from harness.tasks.catalogue import publish_catalogue

    with share_progress(quiet=json) as report:
        published = publish_catalogue(folder, to, report)
    print_result(published, json)
    return 1 if published.counts.get("not built") else 0

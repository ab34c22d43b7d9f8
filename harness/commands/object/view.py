"""``touchstone object view``: turn an object with the mouse, in a browser on this machine."""

from typing import Annotated

import typer

from harness.commands import options
from harness.commands.object import vision_options
from harness.commands.output import ANSWERS, CONSOLE, emit

PORT = 8765


def view(
    folder: options.ObjectFolder,
    port: Annotated[int, typer.Option(help="Of 127.0.0.1; 0 for any that is free.", min=0, max=65535)] = PORT,
    threads: vision_options.Threads = None,
    json: options.Json = False,
) -> int:
    """Turn an object with the mouse: a page on 127.0.0.1, drawn by the networks of its ObjectFile.

    Level, size and light are chosen on the page, which shows what each frame takes. Nobody beyond this
    machine is answered. Ctrl-C ends it.

    Try: touchstone object view objects/mug
    """
    from harness.live_view.server import LiveFrames, LiveServer, ViewRequest
    from harness.objectfile.file import ObjectFile
    from harness.objectfile.vision.render import open_vision

    of = ObjectFile.open(folder)
    frames = LiveFrames(of.description.name, open_vision(of, threads))
    server = LiveServer(frames, port)
    try:
        # The first picture, which nobody sees, loads the compiled loops.
        frames.frame(ViewRequest())
        if json:
            emit({"schema": 1, "object": frames.name, "url": server.url, "port": server.server_port})
        else:
            ANSWERS.print(f"{frames.name}: {server.url}", markup=False)
        CONSOLE.print("Ctrl-C ends it")
        server.run()
    except KeyboardInterrupt:
        return 0
    finally:
        server.server_close()
    return 0

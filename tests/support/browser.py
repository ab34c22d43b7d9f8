"""A real browser without a window, told what to do by its own protocol, through two pipes of its process.

Chromium or Chrome, where one is installed; nothing of the project needs one but to look at its pages.
"""

import json
import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

from harness.basics.clock import now

_NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
_PATIENCE = 30.0
"""s that a page has for anything."""

SHIFT = 8
"""Of ``modifiers``."""


def found() -> str | None:
    """The browser that is installed; None for none."""
    return next((path for path in map(shutil.which, _NAMES) if path), None)


class Page:
    """A page that is shown, 1000 x 800 pixels.

    Args:
        to: file descriptor, of what the browser reads.
        of: file descriptor, of what it says.
        url: of the page.
    """

    def __init__(self, to: int, of: int, url: str) -> None:
        self._to, self._of, self._rest = to, of, b""
        self._asked, self._session = 0, ""
        target = self.call("Target.createTarget", url=url)["targetId"]
        self._session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]

    def call(self, method: str, **params: Any) -> dict[str, Any]:
        """Ask for anything that the protocol has; what it answers is returned."""
        self._asked += 1
        message: dict[str, Any] = {"id": self._asked, "method": method, "params": params}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._to, json.dumps(message).encode() + b"\0")
        for answer in self._said():
            if answer.get("id") == self._asked:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']}")
                result: dict[str, Any] = answer["result"]
                return result
        raise RuntimeError(f"the browser ended during {method}")

    def tell(self, expression: str) -> Any:
        """What a line of the page's own language is worth."""
        return self.call("Runtime.evaluate", expression=expression, returnByValue=True)["result"].get("value")

    def wait(self, expression: str) -> None:
        """Until it is true.

        Raises:
            TimeoutError: that took too long.
        """
        end = now() + _PATIENCE
        while not self.tell(f"Boolean({expression})"):
            if now() > end:
                raise TimeoutError(f"the page did not come to {expression} within {_PATIENCE:g} s")

    def drag(self, begin: tuple[int, int], by: tuple[float, float], steps: int, modifiers: int = 0) -> None:
        """Press the mouse, move it in as many steps, and let it go."""
        self._mouse("mousePressed", *begin, modifiers)
        for step in range(1, steps + 1):
            share = step / steps
            self._mouse("mouseMoved", begin[0] + share * by[0], begin[1] + share * by[1], modifiers)
        self._mouse("mouseReleased", begin[0] + by[0], begin[1] + by[1], modifiers)

    def _mouse(self, kind: str, x: float, y: float, modifiers: int) -> None:
        held = {"button": "left", "buttons": 0 if kind == "mouseReleased" else 1, "clickCount": 1}
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, modifiers=modifiers, **held)

    def _said(self) -> Iterator[dict[str, Any]]:
        while True:
            while b"\0" in self._rest:
                whole, _, self._rest = self._rest.partition(b"\0")
                yield json.loads(whole)
            some = os.read(self._of, 1 << 16)
            if not some:
                return
            self._rest += some


@contextmanager
def shown(url: str) -> Iterator[Page]:
    """A page in a browser that ends with it.

    Raises:
        FileNotFoundError: no browser is installed.
    """
    program = found()
    if program is None:
        raise FileNotFoundError(f"none of {', '.join(_NAMES)} is installed; say: apt install chromium")
    (their_in, to), (of, their_out) = os.pipe(), os.pipe()
    # It reads descriptor 3 and writes 4, whatever they are here.
    redirect = f'exec "$0" "$@" 3<&{their_in} 4>&{their_out}'
    options = ("--headless", "--no-sandbox", "--disable-gpu", "--window-size=1000,800")
    process = subprocess.Popen(
        ("/bin/bash", "-c", redirect, program, *options, "--remote-debugging-pipe", "about:blank"),
        pass_fds=(their_in, their_out), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    os.close(their_in)
    os.close(their_out)
    try:
        yield Page(to, of, url)
    finally:
        process.terminate()
        with suppress(subprocess.TimeoutExpired):
            process.wait(60.0)
        process.kill()
        os.close(to)
        os.close(of)

"""Pictures a second of the page that turns an object, in a real browser, while a mouse drags.

``PYTHONPATH=. python tests/benchmarks/vision/bench_vision_browser.py OBJECT``; it needs Chromium (``apt
install chromium``). The browser, the server and what drags share the machine's cores. A picture counts when
the page has decoded it and shows it.
"""

import argparse
from pathlib import Path

import numpy as np

from harness.basics.clock import now
from harness.commands.output import ANSWERS
from harness.live_view.server import LiveFrames
from harness.objectfile.file import ObjectFile
from harness.objectfile.vision.render import open_vision
from tests.support import browser
from tests.support.served_look import served

_SIZES = (128, 256, 400)
_COUNT = "window.shown = 0;new MutationObserver(() => window.shown++).observe(by('frame'), {childList: true})"
_MILLISECONDS = "parseFloat(by('frame').textContent)"


def main() -> None:
    """Print a line for each size."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--drags", type=int, default=5, help="of 40 steps, each there and back")
    asked = parser.parse_args()
    of = ObjectFile.open(asked.folder)
    frames = LiveFrames(of.description.name, open_vision(of))
    with served(frames) as server, browser.shown(server.url) as page:
        page.wait("by('samples').textContent")
        page.tell(_COUNT)
        for size in _SIZES:
            page.tell(f"by('size').value = '{size}'; ask()")
            page.drag((300, 300), (80, 10), 20)
            rates, took = [], []
            for k in range(asked.drags):
                page.tell("window.shown = 0")
                begun = now()
                page.drag((300, 300), (160 if k % 2 else -160, 20), 40)
                rates.append(page.tell("window.shown") / (now() - begun))
                took.append(page.tell(_MILLISECONDS))
            low, middle, high = np.quantile(rates, [0.0, 0.5, 1.0])
            ANSWERS.print(
                f"{size} a side: {middle:.0f} ({low:.0f} to {high:.0f}) pictures a second; "
                f"the last of each drag took {np.median(took):.0f} ms from asked for to shown"
            )


if __name__ == "__main__":
    main()

"""Check the instruments of a bench, and take a picture: python examples/instruments_of_a_bench.py OUT.png."""

import sys
from pathlib import Path

import touchstone

checked = touchstone.check_station("mock", duration=0.5)
print("\n".join(checked.summary()))
with touchstone.open_station("mock", only=["arm"]) as bench:
    print(bench.arm.state().base_from_flange[:3, 3], "m: the flange")
print(touchstone.take_picture("gel", Path(sys.argv[1])).identity)

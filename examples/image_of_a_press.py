"""Render the tactile image of a press, and read its depth: python examples/image_of_a_press.py OUT.png."""

import sys
from pathlib import Path

import touchstone

out = Path(sys.argv[1])
touch = touchstone.render_touch("builtin:wrench", vertex=50, depth=0.5e-3, out=out)
print("\n".join(touch.summary()))
print(f"{touch.press.image.shape}, error of the colours {touch.error_estimate.held_out_table_db:.0f} dB")
print("\n".join(touchstone.depth([out], calibration="gelsight_r15_bench").summary()))

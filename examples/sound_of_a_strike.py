"""Render the sound of a strike: python examples/sound_of_a_strike.py OUT.wav [OBJECTFILE]."""

import sys
from pathlib import Path

import touchstone

folder = sys.argv[2] if len(sys.argv) > 2 else "objects/mug"
struck = touchstone.render_audio(folder, vertex=100, hammer_name="nylon", duration=0.5, out=Path(sys.argv[1]))
print("\n".join(struck.summary()))
print(f"peak {struck.peak:.3g} {struck.unit}, sum of modes to {struck.error_estimate.synthesis_db:.0f} dB")

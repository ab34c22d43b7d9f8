"""Answer a recorded run: python examples/answer_of_a_recording.py RUN."""

import sys

import touchstone

found = touchstone.answer(sys.argv[1])
for sense, estimate in found["estimates"].items():
    if "refused" in estimate:
        print(f"{sense}: refused: {estimate['refused']}")
        continue
    x, y, z = (1e3 * value for value in estimate["position_m"])
    print(f"{sense}: ({x:.1f}, {y:.1f}, {z:.1f}) mm, 90 % within {1e3 * estimate['credible90_m']:.1f} mm")

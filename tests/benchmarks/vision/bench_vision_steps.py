"""How many samples a second one tiny network of a look learns from, after few steps and after many.

python tests/benchmarks/vision/bench_vision_steps.py builtin:wrench --steps 1000 4000 20000

One core; CPU seconds. What is learned from is drawn once. A rate that falls with the steps means numbers that
the processor has no fast way for.
"""

import argparse
import time
from dataclasses import replace

import numpy as np

from harness.authoring.vision.cells import CellTraining
from harness.authoring.vision.data import HeldOutViews
from harness.authoring.vision.lessons import OPAQUE, draw_for
from harness.authoring.vision.profiles import vision_profile
from harness.authoring.vision.surface_cells import surface_cells
from harness.commands.output import ANSWERS
from harness.objectfile.vision.network import PER_CELL, VisionGrid
from harness.sim.light.appearance_source import appearance_of
from harness.sim.light.direct_image import LitObject


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("mesh", nargs="?", default="builtin:wrench")
    parser.add_argument("--profile", default="standard")
    parser.add_argument("--steps", type=int, nargs="*", default=[1000, 4000, 20_000])
    parser.add_argument("--places", type=int, default=400_000)
    parser.add_argument("--repeat", type=int, default=3)
    given = parser.parse_args()
    spec = replace(vision_profile(given.profile).networks, places=given.places)
    lit = LitObject(appearance_of(given.mesh, "m"))
    grid = surface_cells(lit.appearance.mesh, spec.cells)
    voxel = grid.cell / PER_CELL
    lessons, lamps = draw_for(spec.size.kind, lit, spec.places, voxel, 0, HeldOutViews((), ()))
    middle = grid.cells[len(grid) // 2 :][:1]
    for steps in (1, *given.steps):
        chosen = replace(spec, steps=steps)
        rates = []
        for _ in range(given.repeat if steps > 1 else 1):
            alone = VisionGrid(grid.low, grid.cell, middle)
            training = CellTraining(chosen, alone, lessons, lamps, OPAQUE / voxel, 0, 1)
            begun = time.process_time()
            training.step_epoch()
            rates.append(steps * spec.batch / (time.process_time() - begun) / 1e6)
        # One step compiles the kernel, and says nothing.
        if steps > 1:
            low, half, high = np.quantile(rates, (0.0, 0.5, 1.0))
            said = f"{half:.2f} ({low:.2f} to {high:.2f}) million samples a second"
            ANSWERS.print(f"{steps:6} steps of {spec.batch}: {said}")


if __name__ == "__main__":
    main()

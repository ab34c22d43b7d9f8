"""Sensors drawn on the mocked bench, measured by the arm in process: errors beside what is stated of them.

    PYTHONPATH=. python tests/benchmarks/touch/bench_arm_calibration.py 1 2 3 [--presses 49] [--colours]

The gap is ``target``: an arm that repeats to 0.03 mm, a sensor whose pitch is off by 1 %, its aspect by
0.5 %, its mounting by 1 deg. With ``--colours`` the colours are fitted
too, which takes minutes of the processor.
"""

import argparse
import json
import sys
import tempfile
from pathlib import Path
from time import process_time

import numpy as np

from calibration.taxim.arm.record import ArmPresses, read_arm_run
from harness.recording.recording import Recording
from tests.support.arm_presses import gap_of_aspect, performed


def main() -> None:
    """A line a seed, and what all of them say of the stated errors."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("seeds", type=int, nargs="+")
    options.add_argument("--presses", type=int, default=49)
    options.add_argument("--gap", default="target")
    options.add_argument("--aspect", type=float, help="pixels drawn so many times as high as wide")
    options.add_argument("--colours", action="store_true")
    asked = options.parse_args()
    over = []
    for seed in asked.seeds:
        with tempfile.TemporaryDirectory() as folder:
            began = process_time()
            gap = asked.gap
            if asked.aspect is not None:
                gap = str(gap_of_aspect(Path(folder), asked.aspect, seed))
            recording = performed(Path(folder) / "run", asked.presses, seed, gap)
            pressed = process_time() - began
            run = read_arm_run(recording.folder)
            over.append(line(seed, run, recording, pressed))
            if asked.colours:
                colours(run)
    rms = np.sqrt(np.mean(np.square(over), axis=0))
    names = ("pitch", "aspect", "rotation", "skew")
    told = ", ".join(f"{name} {value:.2f}" for name, value in zip(names, rms, strict=True))
    sys.stdout.write(f"errors over stated sigmas, rms of {len(over)} seeds (mock): {told}\n")


def line(seed: int, run: ArmPresses, recording: Recording, pressed: float) -> list[float]:
    """Print one seed; the errors over their sigmas."""
    true = json.loads(recording.truth_path.read_text())["differences"]
    began = process_time()
    found = run.scale()
    seconds = process_time() - began
    pitch = run.pitch * true["pitch_over_nominal"] * np.sqrt(true["aspect"])
    pairs = (
        (found.pitch, pitch),
        (found.aspect, true["aspect"]),
        (found.rotation, true["image_yaw_rad"]),
        (found.skew, 0.0),
    )
    off = [one.value - right for one, right in pairs]
    sigma = [one.sigma for one, _ in pairs]
    sys.stdout.write(
        f"seed {seed}, {len(run.taken)} presses (mock): pitch {100 * off[0] / pitch:+.2f} % "
        f"(sigma {100 * sigma[0] / pitch:.2f}), aspect {100 * off[1]:+.2f} % ({100 * sigma[1]:.2f}), "
        f"rotation {np.degrees(off[2]):+.3f} deg ({np.degrees(sigma[2]):.3f}), skew "
        f"{np.degrees(off[3]):+.3f} deg ({np.degrees(sigma[3]):.3f}), scatter {1e3 * found.scatter:.3f} mm; "
        f"processor {pressed:.1f} s pressed, {seconds:.1f} s measured\n"
    )
    sys.stdout.flush()
    return [one / by for one, by in zip(off, sigma, strict=True)]


def colours(run: ArmPresses) -> None:
    """Print how well presses are predicted that the colours were not fitted to."""
    from calibration.taxim.mark_free import Identity, calibrate
    from calibration.taxim.pictures import squared

    scale = run.scale()
    who = Identity(run.sensor, run.serial, "mock", "2026-01-01", scale.pitch.value, run.ball_radius)
    made = calibrate(squared(run.pictures, scale.aspect_taken), who)
    sys.stdout.write(
        f"  colours: {made.median('table'):.2f} dB held out, centre refitted; {made.median('unrefitted'):.2f}"
        f" as detected; {made.median('nothing'):.2f} untouched; {len(made.used)} presses, "
        f"{made.seconds:.0f} s\n"
    )
    sys.stdout.flush()


if __name__ == "__main__":
    main()

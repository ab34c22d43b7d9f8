"""Sensors drawn on the mocked bench, measured by the arm in process: errors beside what is stated of them.

    PYTHONPATH=. python tests/benchmarks/touch/bench_arm_calibration.py 1 2 3 [--presses 49] [--colours]

The gap is ``target``: an arm that repeats to 0.03 mm, a sensor whose pitch is off by 1 %, its aspect by
0.5 %, its mounting by 1 deg. With ``--colours`` the colours are fitted
too, which takes minutes of the processor.
"""

import json
import tempfile
from pathlib import Path
from time import process_time

import numpy as np

from calibration.taxim.arm.record import ArmPresses, read_arm_run
from harness.recording.recording import Recording
from tests.benchmarks.results import benchmark_parser, finish_figure
from tests.docs.results import Cell
from tests.support.arm_presses import gap_of_aspect, performed


def main() -> None:
    """Print or write a row a seed, and the errors relative to the stated ones."""
    options = benchmark_parser(__doc__)
    options.add_argument("seeds", type=int, nargs="+")
    options.add_argument("--presses", type=int, default=49)
    options.add_argument("--gap", default="target")
    options.add_argument("--aspect", type=float, help="pixels drawn so many times as high as wide")
    options.add_argument("--colours", action="store_true")
    asked = options.parse_args()
    over: list[list[float]] = []
    rows: list[list[Cell]] = []
    for seed in asked.seeds:
        with tempfile.TemporaryDirectory() as folder:
            began = process_time()
            gap = asked.gap
            if asked.aspect is not None:
                gap = str(gap_of_aspect(Path(folder), asked.aspect, seed))
            recording = performed(Path(folder) / "run", asked.presses, seed, gap)
            pressed = process_time() - began
            run = read_arm_run(recording.folder)
            relative, row = measure(seed, run, recording, pressed)
            over.append(relative)
            rows.append([*row, colours(run) if asked.colours else None])
    rms = np.sqrt(np.mean(np.square(over), axis=0))
    texts = [f"{value:.2f}" for value in rms]
    rows.append(["rms of the errors over stated sigmas", *texts, None, None, None])
    heads = "seed; pitch error (sigma) [%]; aspect error (sigma) [%]; rotation error (sigma) [deg]"
    more = "skew (sigma) [deg]; residual [mm] .3f; time [CPU s] .1f; colours held out [dB]"
    finish_figure("touch_calibration", "arm", f"{heads}; {more}", rows)


def measure(
    seed: int, run: ArmPresses, recording: Recording, pressed: float
) -> tuple[list[float], list[Cell]]:
    """Measure one seed: the errors over their sigmas, and its row."""
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
    row: list[Cell] = [
        f"{seed}, {len(run.taken)} presses",
        f"{100 * off[0] / pitch:+.2f} ({100 * sigma[0] / pitch:.2f})",
        f"{100 * off[1]:+.2f} ({100 * sigma[1]:.2f})",
        *(f"{np.degrees(off[k]):+.3f} ({np.degrees(sigma[k]):.3f})" for k in (2, 3)),
        1e3 * found.scatter,
        pressed + seconds,
    ]
    return [one / by for one, by in zip(off, sigma, strict=True)], row


def colours(run: ArmPresses) -> str:
    """Score presses that the colours were not fitted to: centre refitted; as detected; untouched gel."""
    from calibration.taxim.mark_free import Identity, calibrate
    from calibration.taxim.pictures import squared

    scale = run.scale()
    who = Identity(run.sensor, run.serial, "mock", "2026-01-01", scale.pitch.value, run.ball_radius)
    made = calibrate(squared(run.pictures, scale.aspect_taken), who)
    return "; ".join(f"{made.median(of):.2f}" for of in ("table", "unrefitted", "nothing"))


if __name__ == "__main__":
    main()

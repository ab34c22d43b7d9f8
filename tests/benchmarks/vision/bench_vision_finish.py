"""What pictures bring to tiny networks that know the surface: errors and CPU seconds by how many there are.

python tests/benchmarks/vision/bench_vision_finish.py builtin:mug \
    --kind osf --profile standard --pictures 0 24 96
python tests/benchmarks/vision/bench_vision_finish.py FILE.obj \
    --units cm --pictures 96 --share 0.25 0.5 --folder F

0 pictures is as many steps more of what the surface says. Networks are taught once and kept in the folder.
"""

import argparse
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from rich.console import Console

from harness.authoring.training import train
from harness.authoring.vision.cells import CellTraining
from harness.authoring.vision.data import HeldOutViews, held_out_pictures
from harness.authoring.vision.finish import CellFinishing
from harness.authoring.vision.finish_profiles import CellsFinish
from harness.authoring.vision.metrics import network_pictures, picture_errors, reference_pictures
from harness.authoring.vision.profiles import CellsSpec, vision_profile
from harness.authoring.vision.seen import Exact, pictures_to_learn
from harness.authoring.vision.vision import cells_to_train
from harness.objectfile.vision.network.graph import vision_graph
from harness.objectfile.vision.network.network import VisionModel
from harness.objectfile.vision.render import VisionRenderer
from harness.objectfile.vision.settings import RenderSettings
from harness.picture.linear_image import LinearImage
from harness.sim.light.appearance_source import appearance_of
from harness.sim.light.direct_image import LitObject

CONSOLE = Console(width=140, highlight=False, emoji=False)
WAYS = {
    "default": RenderSettings(),
    "rays 2": RenderSettings(rays=2),
    "one sample": RenderSettings(level="one_sample"),
}


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser()
    parser.add_argument("objects", nargs="*", default=["builtin:mug"])
    parser.add_argument("--units", default="m")
    parser.add_argument("--profile", default="smoke")
    parser.add_argument("--kind", default="osf-v", choices=("osf-v", "osf"))
    parser.add_argument("--pictures", type=int, nargs="*", default=[0, 24, 96])
    parser.add_argument("--share", type=float, nargs="*", default=[CellsFinish.share])
    parser.add_argument("--slower", type=float, default=CellsFinish.slower)
    parser.add_argument("--judges", type=int, default=12, help="pictures kept back")
    parser.add_argument("--threads", type=int)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--folder", type=Path, default=Path("runs/finish"), help="of taught networks")
    given = parser.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    for name in given.objects:
        measure(name, given)


def measure(name: str, given: argparse.Namespace) -> None:
    """One object: taught by the surface, then finished in every way that was asked for."""
    lit = LitObject(appearance_of(name, given.units))
    held_out = held_out_pictures(lit.appearance.mesh, given.judges, 256, 256, given.seed)
    exact = reference_pictures(lit, held_out, 4)
    training, spent = taught(lit, held_out, name, given)
    judged("taught", training.finish(), lit, held_out, exact, f"{spent:.0f} s")
    begin, drawn = training.flats.copy(), dict[int, tuple[list[Exact], float]]()
    for count in given.pictures:
        if (count or 1) not in drawn:
            since = time.process_time()
            wanted = CellsFinish(pictures=count or 1)
            found = pictures_to_learn(lit, wanted, given.seed, held_out, unsaid, given.threads)
            drawn[count or 1] = found, time.process_time() - since
        pictures, to_draw = drawn[count or 1]
        for share in given.share if count else [0.0]:
            training.flats[:] = begin
            finish = CellsFinish(pictures=count or 1, slower=given.slower, share=share)
            since = time.process_time()
            finishing = CellFinishing(training, finish, lit.appearance.mesh, pictures)
            while not finishing.done:
                finishing.step_epoch()
            spent = time.process_time() - since
            took = f"{spent:.0f} s" + (f", pictures {to_draw:.0f} s" if count else "")
            judged(f"{count} pictures, share {share:g}", finishing.finish(), lit, held_out, exact, took)


def taught(
    lit: LitObject, held_out: HeldOutViews, name: str, given: argparse.Namespace
) -> tuple[CellTraining, float]:
    """By the surface, to its end, as ``author_vision`` does; CPU seconds."""
    since = time.process_time()
    training = cells_to_train(lit, held_out, spec_of(given), given.seed, given.threads)
    stem = Path(name).stem.removeprefix("builtin:")
    train(training, training.epochs, given.folder / f"{stem}-{given.kind}-{given.profile}.npz", unsaid)
    return training, time.process_time() - since


def spec_of(given: argparse.Namespace) -> CellsSpec:
    """The profile's networks of a kind."""
    profile = vision_profile(given.profile)
    if given.kind == "osf-v":
        return profile.networks
    return profile.strict or replace(profile.networks, size=replace(profile.networks.size, kind="osf"))


def judged(
    word: str,
    model: VisionModel,
    lit: LitObject,
    held_out: HeldOutViews,
    exact: Sequence[LinearImage],
    took: str,
) -> None:
    """Print what pictures kept back say."""
    data = vision_graph(model).SerializeToString()
    renderer = VisionRenderer(data, lit.appearance.mesh)
    CONSOLE.print(f"{word}: {took} of a core, {len(model.grid)} networks")
    for way, settings in WAYS.items():
        found = picture_errors(exact, network_pictures(renderer, held_out, settings))
        whole, worst, alone, alike, least = (found[each] for each in ERRORS)
        CONSOLE.print(
            f"  {way:12} {whole:6.2f} dB, worst {worst:6.2f}, object alone {alone:6.2f}, "
            f"ssim {alike:.4f}, worst {least:.4f}"
        )


ERRORS = ("psnr_db", "psnr_db_worst", "psnr_db_object", "ssim", "ssim_worst")


def unsaid(_what: str, _share: float) -> None:
    """Progress that nobody is told of."""


if __name__ == "__main__":
    main()

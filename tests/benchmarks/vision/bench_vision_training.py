"""What networks of vision err by and cost to train: pictures kept back, steps.

python tests/benchmarks/vision/bench_vision_training.py builtin:mug builtin:bowl --profile smoke
python tests/benchmarks/vision/bench_vision_training.py FILE.obj \
    --units m --steps 1000 4000 --sheet pictures.png
python tests/benchmarks/vision/bench_vision_training.py builtin:mug \
    --profile standard --built OBJECT   (trained)
"""

import argparse
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from harness.authoring.vision.data import HeldOutViews, held_out_pictures
from harness.authoring.vision.metrics import BEHIND, picture_errors, reference_pictures
from harness.authoring.vision.profiles import VisionProfile, vision_profile
from harness.authoring.vision.vision import AuthoredVision, author_vision
from harness.basics.arrays import ByteArray
from harness.objectfile.vision.coverage import Contours, mesh_outline
from harness.objectfile.vision.graph import FILE, vision_graph
from harness.objectfile.vision.render import RenderSettings, VisionRenderer
from harness.picture.image_file import write_png
from harness.picture.linear_image import LinearImage
from harness.picture.pinhole import DirectionalLight, Pinhole
from harness.sim.light.appearance import Appearance
from harness.sim.light.appearance_source import appearance_of
from harness.sim.light.direct_image import LitObject, irradiance, sees_light
from harness.sim.light.lambert import places_seen, radiance
from tests.benchmarks.results import benchmark_parser, finish_figure
from tests.docs.results import Cell

STRICT_PLACES = 8_000_000
"""Places that networks with the paper's inputs learn from, at least."""

WAYS = {
    "default": RenderSettings(),
    "coverage 5": RenderSettings(coverage=5),
    "rays 2": RenderSettings(rays=2),
}


def main() -> None:
    """Measure and print."""
    parser = benchmark_parser(__doc__)
    parser.add_argument("objects", nargs="*", default=["builtin:mug"])
    parser.add_argument("--units", default="m")
    parser.add_argument("--profile", default="smoke")
    parser.add_argument("--steps", type=int, nargs="*", default=[])
    parser.add_argument("--batch", type=int)
    parser.add_argument("--rate", type=float)
    parser.add_argument("--pictures", type=int)
    parser.add_argument("--threads", type=int)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--strict", action="store_true", help="and networks told what the paper's are")
    parser.add_argument("--built", type=Path, help="an ObjectFile of the object: nothing is trained")
    parser.add_argument("--sheet", type=Path)
    given = parser.parse_args()
    table: list[list[Cell]] = []
    rows = [measure(name, steps, given, table) for name in given.objects for steps in given.steps or [None]]
    heads = "object; networks; time [CPU s] .0f; mean PSNR [dB] .1f; worst [dB] .1f; object alone [dB] .1f"
    figure = "smoke" if given.profile == "smoke" else f"profile {given.profile}"
    finish_figure("vision_training", figure, f"{heads}; SSIM .3f", table)
    if given.sheet:
        write_png(given.sheet, np.vstack(rows))


def measure(name: str, steps: int | None, given: argparse.Namespace, table: list[list[Cell]]) -> ByteArray:
    """Train or read the networks of one object, and compare their pictures with exact ones."""
    look, profile = appearance_of(name, given.units), chosen(steps, given)
    if given.built:
        rows, shown = by_ways(look, (given.built / FILE).read_bytes(), profile, given)
        table += [[f"{Path(name).stem}, {row[0]}", None, None, *row[1:]] for row in rows]
        return shown
    on_core = time.process_time()
    made = trained(look, profile, given)
    on_core = time.process_time() - on_core
    stem, count = f"{Path(name).stem}, {profile.networks.steps} steps", len(made.model.grid)
    if given.strict:
        of = profile.networks
        size = replace(of.size, kind="osf")
        strict = replace(profile, networks=replace(of, size=size, places=max(of.places, STRICT_PLACES)))
        errors = quality(trained(look, strict, given).errors)
        table.append([f"{stem}, the paper's inputs", count, None, *errors])
    rows, shown = by_ways(look, vision_graph(made.model).SerializeToString(), profile, given)
    table += [[f"{stem}, {row[0]}", count, on_core, *row[1:]] for row in rows]
    return shown


def trained(look: Appearance, profile: VisionProfile, given: argparse.Namespace) -> AuthoredVision:
    """Networks of a profile, measured."""
    with TemporaryDirectory() as folder:
        return author_vision(look, profile, given.seed, Path(folder), unsaid, given.threads)


def unsaid(_what: str, _share: float) -> None:
    """Progress that nobody is told of."""


def chosen(steps: int | None, given: argparse.Namespace) -> VisionProfile:
    """The profile that was asked for."""
    profile = vision_profile(given.profile)
    if given.pictures:
        profile = replace(profile, pictures=given.pictures)
    asked = {"steps": steps, "batch": given.batch, "rate": given.rate}
    others = {name: value for name, value in asked.items() if value}
    return replace(profile, networks=replace(profile.networks, **others))


def quality(errors: Mapping[str, float]) -> list[float]:
    """List PSNR, worst PSNR and PSNR of the object alone in dB, and SSIM."""
    return [errors[name] for name in ("psnr_db", "psnr_db_worst", "psnr_db_object", "ssim")]


def by_ways(
    look: Appearance, data: bytes, profile: VisionProfile, given: argparse.Namespace
) -> tuple[list[list[Cell]], ByteArray]:
    """Measure the same networks by every setting of the renderer; pictures of the default."""
    rows: list[list[Cell]] = []
    lit = LitObject(look)
    held_out = held_out_pictures(look.mesh, profile.pictures, profile.side, profile.side, given.seed)
    exact = reference_pictures(lit, held_out, profile.samples)
    renderer = VisionRenderer(data, look.mesh, given.threads)
    drawn: dict[str, list[LinearImage]] = {}
    for way, settings in WAYS.items():
        views = zip(held_out.cameras, held_out.lights, strict=True)
        drawn[way] = [renderer.render(camera, light, settings).image for camera, light in views]
        rows.append([way, *quality(picture_errors(exact, drawn[way]))])
    for side in (3, 5):
        limit = [one_ray(lit, camera, light, side) for camera, light in _pairs(held_out)]
        rows.append([f"exact light, coverage {side}", *quality(picture_errors(exact, limit))])
    shown = np.hstack([beside(exact[0], drawn["default"][0]), beside(exact[-1], drawn["default"][-1])])
    return rows, shown


def one_ray(lit: LitObject, camera: Pinhole, light: DirectionalLight, side: int) -> LinearImage:
    """What networks without error would give: exact light where the renderer's outline asks for it."""
    mesh, (x, y) = lit.appearance.mesh, camera.centre_px
    outline = mesh_outline(Contours.of(mesh), camera, side)
    across, down = (outline.places[:, k] - centre for k, centre in enumerate((x, y)))
    ways = np.stack([across, down, np.full(len(down), camera.focal_px)], axis=1).astype(np.float64)
    ways = ways / np.linalg.norm(ways, axis=1, keepdims=True) @ camera.object_from_camera[:3, :3].T
    hits = lit.rays.first_hits(camera.eye, ways)
    met = np.flatnonzero(hits.face >= 0)
    places = places_seen(lit.appearance, hits.face[met], hits.weights[met], ways[met])
    falling = irradiance(places, light, mesh.diagonal)
    falling = falling * sees_light(lit.rays, places, light, falling > 0.0)
    colour, alpha = np.zeros((camera.pixels, 3)), np.zeros(camera.pixels)
    colour[outline.pixels[met]] = radiance(places, falling) * outline.cover[met, None]
    alpha[outline.pixels] = outline.cover
    shape = (camera.height, camera.width)
    return LinearImage(colour.reshape(*shape, 3), alpha.reshape(shape), np.full(shape, np.inf))


def _pairs(held_out: HeldOutViews) -> list[tuple[Pinhole, DirectionalLight]]:
    return list(zip(held_out.cameras, held_out.lights, strict=True))


def beside(exact: LinearImage, found: LinearImage) -> ByteArray:
    """The exact picture, the networks', and four times what they differ by."""
    wanted, got = exact.display(BEHIND), found.display(BEHIND)
    apart = np.clip(128 + 4 * (got.astype(np.int64) - wanted), 0, 255).astype(np.uint8)
    return np.hstack([wanted, got, apart])


if __name__ == "__main__":
    main()

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
from rich.console import Console

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

CONSOLE = Console(width=140, highlight=False, emoji=False)

STRICT_PLACES = 8_000_000
"""Places that networks with the paper's inputs learn from, at least."""

WAYS = {
    "default": RenderSettings(),
    "coverage 5": RenderSettings(coverage=5),
    "rays 2": RenderSettings(rays=2),
}


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser()
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
    rows = [measure(name, steps, given) for name in given.objects for steps in given.steps or [None]]
    if given.sheet:
        write_png(given.sheet, np.vstack(rows))


def measure(name: str, steps: int | None, given: argparse.Namespace) -> ByteArray:
    """One object: its networks, and their pictures beside the exact ones."""
    look, profile = appearance_of(name, given.units), chosen(steps, given)
    if given.built:
        CONSOLE.print(f"{Path(name).stem}, as {given.built} has it")
        return by_ways(look, (given.built / FILE).read_bytes(), profile, given)
    on_core = time.process_time()
    made = trained(look, profile, given)
    on_core = time.process_time() - on_core
    CONSOLE.print(
        f"{Path(name).stem}: {len(made.model.grid)} networks, {profile.networks.steps} steps of "
        f"{profile.networks.batch}, "
        f"{on_core:.0f} s of one core; on the clock "
        + ", ".join(f"{part} {seconds:.0f} s" for part, seconds in made.seconds.items())
    )
    if given.strict:
        of = profile.networks
        size = replace(of.size, kind="osf")
        strict = replace(profile, networks=replace(of, size=size, places=max(of.places, STRICT_PLACES)))
        CONSOLE.print(f"  told no more than the paper's {line(trained(look, strict, given).errors)}")
    return by_ways(look, vision_graph(made.model).SerializeToString(), profile, given)


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


def line(errors: Mapping[str, float]) -> str:
    """Errors as they are printed."""
    whole, worst, alone, alike = (
        errors[name] for name in ("psnr_db", "psnr_db_worst", "psnr_db_object", "ssim")
    )
    return f"{whole:6.2f} dB, worst {worst:6.2f}, object alone {alone:6.2f}, ssim {alike:.4f}"


def by_ways(look: Appearance, data: bytes, profile: VisionProfile, given: argparse.Namespace) -> ByteArray:
    """What settings of the renderer make of the same networks; pictures of the default."""
    lit = LitObject(look)
    held_out = held_out_pictures(look.mesh, profile.pictures, profile.side, profile.side, given.seed)
    exact = reference_pictures(lit, held_out, profile.samples)
    renderer = VisionRenderer(data, look.mesh, given.threads)
    drawn: dict[str, list[LinearImage]] = {}
    for way, settings in WAYS.items():
        views = zip(held_out.cameras, held_out.lights, strict=True)
        drawn[way] = [renderer.render(camera, light, settings).image for camera, light in views]
        each = [difference(a, b) for a, b in zip(drawn[way], drawn["default"], strict=True)]
        apart = 255.0 * np.sqrt(np.mean(each))
        errors = picture_errors(exact, drawn[way])
        CONSOLE.print(f"  {way:12} {line(errors)}, from the default {apart:.2f}/255")
    for side in (3, 5):
        limit = [one_ray(lit, camera, light, side) for camera, light in _pairs(held_out)]
        CONSOLE.print(
            f"  exact colours, one ray a pixel, coverage {side}: {line(picture_errors(exact, limit))}"
        )
    return np.hstack([beside(exact[0], drawn["default"][0]), beside(exact[-1], drawn["default"][-1])])


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


def difference(one: LinearImage, other: LinearImage) -> float:
    """Mean square over pixels and channels, of light as shown before white, 0 to 1."""
    apart = one.display(BEHIND).astype(np.float64) - other.display(BEHIND)
    return float(np.mean((apart / 255.0) ** 2))


def beside(exact: LinearImage, found: LinearImage) -> ByteArray:
    """The exact picture, the networks', and four times what they differ by."""
    wanted, got = exact.display(BEHIND), found.display(BEHIND)
    apart = np.clip(128 + 4 * (got.astype(np.int64) - wanted), 0, 255).astype(np.uint8)
    return np.hstack([wanted, got, apart])


if __name__ == "__main__":
    main()

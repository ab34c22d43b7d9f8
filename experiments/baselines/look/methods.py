"""Ways from a view to its picture: 1.0's, the paper's cells, ours at three settings, and white alone."""

from dataclasses import asdict, astuple
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from experiments.baselines.bench import Column, MadeMethod, Render, RenderingMethod, RenderingWork
from experiments.baselines.look.bench import ViewBench, shown
from experiments.baselines.look.field import opened_field
from experiments.baselines.settings import FIELD, KILO_OSF
from experiments.baselines.stored_graph import stored_graph
from harness.authoring.vision.vision import networks_alone
from harness.basics.arrays import AnyArray
from harness.objectfile.file import ObjectFile
from harness.objectfile.published.camera import SIZE
from harness.objectfile.vision.graph import vision_graph
from harness.objectfile.vision.render import RenderSettings, VisionRenderer, open_vision

_SEED = 0

_SETTINGS: tuple[tuple[str, Column, RenderSettings], ...] = (
    ("coverage at pixel centres", "ours, smallest", RenderSettings(coverage=1)),
    ("default", "ours", RenderSettings()),
    ("four rays a pixel", "ours, largest", RenderSettings(rays=2)),
)


def look_methods(bench: ViewBench, of: ObjectFile, work: RenderingWork) -> list[RenderingMethod]:
    """Every row of vision.

    Args:
        bench: of the views.
        of: the object; its own networks are rows where it has some.
        work: where networks are stored.
    """
    return [
        RenderingMethod("white alone", "other", (), _white, "costs nothing"),
        RenderingMethod(
            "one field, samples evenly (1.0)",
            "1.0 here",
            ("within the ball", *astuple(FIELD)),
            lambda: _by_field(bench, work),
            f"{FIELD.samples} samples a ray, {FIELD.depth} x {FIELD.width}",
        ),
        RenderingMethod(
            "KiloOSF (2.0)",
            "2.0 here",
            (asdict(KILO_OSF.size), *astuple(KILO_OSF)[1:]),
            lambda: _by_cells(bench, work),
            f"its networks and inputs, {KILO_OSF.steps} steps each, in our renderer",
        ),
        *_own(bench, of),
        RenderingMethod(
            "the mesh itself, 2 x 2 rays a pixel",
            "other",
            (),
            lambda: _by_mesh(bench),
            "as the reference, with fewer rays",
        ),
    ]  # fmt: skip


def _white() -> MadeMethod:
    return MadeMethod(lambda _: np.full((SIZE, SIZE, 3), 255, np.uint8))


def _by_field(bench: ViewBench, work: RenderingWork) -> MadeMethod:
    def train() -> bytes:
        from experiments.baselines.training.field import train_field

        return train_field(bench, FIELD, work.report)

    identity = ("field", bench.identity, astuple(FIELD))
    data, seconds = stored_graph(work.store, identity, "the field of 1.0", train)
    field = opened_field(data, bench.lit.appearance.mesh, FIELD.samples)

    def observe(number: int) -> AnyArray:
        return field.picture(bench.views.cameras[number], bench.views.lights[number])

    return MadeMethod(observe, seconds)


def _by_cells(bench: ViewBench, work: RenderingWork) -> MadeMethod:
    def train() -> bytes:
        with TemporaryDirectory() as folder:
            checkpoint = Path(folder) / "cells.npz"
            model = networks_alone(bench.lit, bench.views, KILO_OSF, _SEED, checkpoint, work.report, 1)
        return vision_graph(model).SerializeToString()

    identity = ("kilo osf", bench.identity, asdict(KILO_OSF.size), *astuple(KILO_OSF)[1:])
    data, seconds = stored_graph(work.store, identity, "KiloOSF", train, torch=False)
    renderer = VisionRenderer(data, bench.lit.appearance.mesh, 1)
    return MadeMethod(_pictures(bench, renderer, RenderSettings()), seconds)


def _own(bench: ViewBench, of: ObjectFile) -> list[RenderingMethod]:
    entry = of.description.vision
    if entry is None:
        return []
    rows = []
    for name, column, settings in _SETTINGS:

        def make(settings: RenderSettings = settings) -> MadeMethod:
            return MadeMethod(_pictures(bench, open_vision(of, 1).renderer, settings))

        identity = (entry.network.sha256, asdict(settings))
        rows.append(RenderingMethod(f"networks of the ObjectFile, {name}", column, identity, make))
    return rows


def _pictures(bench: ViewBench, renderer: VisionRenderer, settings: RenderSettings) -> Render:
    def observe(number: int) -> AnyArray:
        camera, light = bench.views.cameras[number], bench.views.lights[number]
        return shown(renderer.render(camera, light, settings).image)

    return observe


def _by_mesh(bench: ViewBench) -> MadeMethod:
    def observe(number: int) -> AnyArray:
        camera, light = bench.views.cameras[number], bench.views.lights[number]
        return shown(bench.lit.render(camera, [light], 2).image)

    return MadeMethod(observe)

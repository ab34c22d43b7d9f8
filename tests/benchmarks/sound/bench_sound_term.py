"""What sound says of simulated objects: ``python tests/benchmarks/sound/bench_sound_term.py [options]``.

A run is struck six times in the mocks' world, gap and all, and answered by places and tool axes alone, by
sound added to them, and by the paper's MFCC filter. No image is simulated. Printed for each object: errors
of the last contact (median / mean / share above 20 mm), nats that the sounds give the truth over the
places that translations and axes leave, milliseconds of one thread, and how many places were weighed.

The true object's modes are computed for three variants and shared between seeds; the shape, the frequencies,
the microphone and everything else are each seed's own. The first use of an object takes minutes.
"""

import argparse
import time
from dataclasses import dataclass

import numpy as np

from experiments.contact_localization.model import Model, Prior
from experiments.contact_localization.posterior.baselines import MfccTable, mfcc_filter, without_images
from experiments.contact_localization.posterior.noise import Noise
from experiments.contact_localization.posterior.posterior import best_point
from experiments.contact_localization.posterior.search import Search
from experiments.contact_localization.sound.evidence import by_sound, sound_nats
from experiments.contact_localization.sound.gains import GainTable, gain_table
from experiments.contact_localization.sound.likelihood import SoundNoise, SoundTerm
from experiments.contact_localization.touch.touch import Contact
from harness.basics.arrays import FloatArray
from harness.basics.faces.nearest import nearest_point
from harness.basics.geometry import rotation_about, transform, translation
from harness.basics.materials import Material, material
from harness.basics.mesh import Mesh
from harness.basics.store import Store, default_folder
from harness.bench.acquisition import Strike
from harness.bench.gap import Gap, load_gap
from harness.bench.sensor import GELSIGHT_R15
from harness.objects.household import MATERIALS, build
from harness.sim.modal.modal import modes_of
from harness.sim.modal.modes import Modes, dampings
from harness.sim.optics.tactile_calibration import shipped_calibration
from harness.sim.solid.surface_measure import thin_wall
from harness.sim.sound.modal_radiation import radiation
from harness.skills.sites import Steps, plan_sites
from harness.strikes.peaks import analyse
from harness.strikes.spectra import Analysis
from mocks.world.sound import SoundingObject, WorldSound
from mocks.world.world import NominalBench, World

SPACING = 2.0e-3
RATE = 50_000.0
CALIBRATION = "gelsight_r15_bench"
STAND_OFF = 5.0e-3
LIMIT = 9.0e3
CONTACTS = 6
DISTANCE = 0.5


@dataclass(frozen=True, eq=False)
class Thing:
    """An object as the estimator knows it."""

    name: str
    model: Model
    material: Material
    modes: Modes
    table: GainTable
    mfcc: MfccTable


@dataclass(frozen=True, eq=False)
class Run:
    """One run as an estimator sees it, and its truth."""

    poses: tuple[FloatArray, ...]
    strikes: tuple[Strike, ...]
    prior: Prior
    true: FloatArray
    struck: FloatArray
    directions: FloatArray
    frequencies: FloatArray


def thing_of(name: str, modes: Modes) -> Thing:
    """An object with what is made of it once."""
    model = Model(build(name, 3e-3), GELSIGHT_R15, shipped_calibration(CALIBRATION))
    made_of = material(MATERIALS[name])
    table = gain_table(modes, model.surface(SPACING))
    return Thing(name, model, made_of, modes, table, MfccTable(table, modes, made_of, RATE))


def run_of(thing: Thing, true_modes: Modes, gap: Gap, seed: int, steps: Steps, count: int, yaw: str) -> Run:
    """Perform a run in the mocks' world: presses and strikes, no pictures.

    Args:
        thing: the object as it is believed to be.
        true_modes: as it is, but for what the gap's draw changes.
        gap: of the world.
        seed: of the run.
        steps: between contacts.
        count: of contacts.
        yaw: ``"known"`` to the estimator or ``"unknown"``.
    """
    turned = np.random.default_rng((seed, 7)).uniform(0.0, 2.0 * np.pi)
    base_from_object = transform(rotation_about(np.array([0.0, 0.0, 1.0]), turned), np.array([0.4, 0.1, 0.2]))
    sites = plan_sites(thing.model.raster, GELSIGHT_R15, base_from_object, count, steps, seed)
    flange_from_tool = translation(np.array([0.0, 0.0, 0.1]))
    bench = NominalBench(
        build(thing.name, 2.2e-3),
        base_from_object,
        flange_from_tool,
        GELSIGHT_R15,
        CALIBRATION,
        "gelsight_r15_world",
    )
    world = World(bench, gap, seed)
    heard = SoundingObject(
        true_modes, dampings(true_modes.frequencies, thing.material), radiation(true_modes, DISTANCE)
    )
    sound = WorldSound(world, heard, gap, seed, flange_from_tool, RATE)
    back = translation(np.array([0.0, 0.0, -STAND_OFF]))
    poses, strikes, struck, directions = [], [], [], []
    for step, site in enumerate(sites):
        base_from_flange = site.base_from_gel @ np.linalg.inv(flange_from_tool)
        found = sound.strike(site.base_from_gel @ back @ np.linalg.inv(flange_from_tool), step, 0)
        poses.append(site.base_from_gel)
        strikes.append(_as_captured(found.force * sound.force_gain, found.pressure, found.aim.met is None))
        true = world.true_contact(base_from_flange, step)
        directions.append(found.aim.direction_in_object)
        struck.append(true if found.aim.met is None else found.aim.met.nominal)
    rotation = base_from_object[:3, :3]
    if yaw == "known":
        prior = Prior(rotation)
    else:
        angle = float(np.random.default_rng((seed, 11)).uniform(0.0, 2.0 * np.pi))
        prior = Prior(rotation_about(np.array([0.0, 0.0, 1.0]), angle) @ rotation, "unknown")
    return Run(
        tuple(poses),
        tuple(strikes),
        prior,
        true,
        np.array(struck),
        np.array(directions),
        sound.frequencies,
    )


def _as_captured(force: FloatArray, pressure: FloatArray, silent: bool) -> Strike:
    onset = int(np.argmax(force > 1.0)) if not silent else 0
    return Strike(RATE, force, pressure, onset, 0.0, overload=False, double_hit=False, silent=silent)


@dataclass(frozen=True)
class Score:
    """What one run gave."""

    geometry: float
    geometry_axis: float
    sound: float
    sound_axis: float
    mfcc: float
    nats: float
    peaks: int
    rejected: int
    seconds_analysis: float
    seconds_weighing: float
    hypotheses: int


def score_of(thing: Thing, run: Run, settings: Analysis, noise: SoundNoise, seed: int) -> Score:
    """Answer a run by every method without images."""
    last, everyone = len(run.poses) - 1, np.arange(len(run.poses))
    search = Search([Contact(pose) for pose in run.poses], thing.model, run.prior, SPACING, Noise())

    def off(point: FloatArray) -> float:
        return float(np.linalg.norm(nearest_point(thing.model.mesh, point) - run.true))

    start = time.thread_time()
    evidence = analyse(run.strikes, settings)
    term = SoundTerm(evidence, thing.table, thing.modes, thing.material, noise)
    analysed = time.thread_time()
    answers = {}
    for use_axis in (False, True):
        found = by_sound(search, term, everyone, everyone, use_axis)
        answers[use_axis] = off(best_point(search.contact_places(last, found), found.weights))
    places = search.grid(everyone, last)
    before = time.thread_time()
    nats = sound_nats(search, term, everyone, places)
    weighed = time.thread_time() - before
    points = search.contact_places(last, places)
    near = np.linalg.norm(points - run.true, axis=1) < 4e-3
    gained = np.nan
    if near.any():
        weights = places.weights
        at_truth = np.log(weights[near] @ np.exp(nats[near]) / weights[near].sum())
        gained = at_truth - np.log(weights @ np.exp(nats))
    particles = mfcc_filter(search, thing.mfcc, run.strikes, 1000, seed)
    poses = list(run.poses)
    return Score(
        off(without_images(poses, thing.model, run.prior, SPACING)),
        off(without_images(poses, thing.model, run.prior, SPACING, use_axis=True)),
        answers[False],
        answers[True],
        off(particles.candidates().mean(axis=0)),
        float(gained),
        len(evidence.peaks),
        len(evidence.rejected),
        analysed - start,
        weighed,
        len(places.gels),
    )


def true_modes_of(thing: Thing, variant: int) -> Modes:
    """The modes of the object on another tessellation, its wall up to 6 % from nominal."""
    share = (0.0, -0.04, 0.05)[variant % 3]
    mesh = build(thing.name, (2.2e-3, 2.5e-3, 2.8e-3)[variant % 3])
    grown = Mesh(mesh.vertices + 0.5 * share * thin_wall(mesh) * mesh.vertex_normals, mesh.faces)
    return modes_of(grown, thing.material, LIMIT, store=Store(default_folder()))


def _line(name: str, scores: list[Score]) -> str:
    def errors(values: list[float]) -> str:
        in_mm = 1e3 * np.array(values)
        return f"{np.median(in_mm):.1f}/{in_mm.mean():.1f}/{np.mean(in_mm > 20.0):.0%}"

    columns = [
        errors([s.geometry for s in scores]),
        errors([s.geometry_axis for s in scores]),
        errors([s.sound for s in scores]),
        errors([s.sound_axis for s in scores]),
        errors([s.mfcc for s in scores]),
        f"{np.nanmean([s.nats for s in scores]):.1f}",
        f"{np.mean([s.peaks for s in scores]):.1f}",
        f"{1e3 * np.median([s.seconds_analysis for s in scores]):.0f}",
        f"{1e3 * np.median([s.seconds_weighing for s in scores]):.1f}",
        f"{np.median([s.hypotheses for s in scores]):.0f}",
    ]
    return f"{name:8}" + "".join(f"{column:>15}" for column in columns)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--objects", nargs="+", default=["mug", "wrench", "bowl", "plate", "tray"])
    parser.add_argument("--seeds", type=int, default=6)
    parser.add_argument("--steps", choices=["close", "spread"], default="close")
    parser.add_argument("--gap", default="default")
    parser.add_argument("--yaw", choices=["known", "unknown"], default="known")
    asked = parser.parse_args()
    gap = load_gap(asked.gap)
    titles = (
        "geometry",
        "+ axis",
        "sound",
        "sound + axis",
        "MFCC",
        "nats",
        "peaks",
        "analysis ms",
        "ms",
        "places",
    )
    print("        " + "".join(f"{title:>15}" for title in titles))  # noqa: T201
    everything = []
    for name in asked.objects:
        nominal = modes_of(build(name, 3e-3), material(MATERIALS[name]), LIMIT, store=Store(default_folder()))
        thing = thing_of(name, nominal)
        scores = []
        for seed in range(asked.seeds):
            real = true_modes_of(thing, seed)
            run = run_of(thing, real, gap, seed, asked.steps, CONTACTS, asked.yaw)
            scores.append(score_of(thing, run, Analysis(), SoundNoise(), seed))
        everything += scores
        print(_line(name, scores), flush=True)  # noqa: T201
    print(_line("all", everything))  # noqa: T201


if __name__ == "__main__":
    main()

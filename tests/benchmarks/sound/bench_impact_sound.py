"""Milliseconds from a place of an object to the sound of a strike there, all the way that a user goes.

``PYTHONPATH=. python tests/benchmarks/sound/bench_impact_sound.py [--repeats N] [modes ...]`` writes
ObjectFiles whose networks have the greatest sizes of the profiles and random weights (what a run costs
does not depend on them), opens them, and times ``strike``: the check that the place is on the surface,
``audio.onnx`` by onnxruntime, and the sum of the modes into 3 s at 44.1 kHz. Opening is not counted, for
a bench opens an object once. On one core. The error is that of the sound beside the sum of the same gains
in double precision, term by term.
"""

import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from onnx import ModelProto
from threadpoolctl import threadpool_limits

from harness.authoring.audio.audio import waves_graph
from harness.authoring.audio.profiles import PROFILES
from harness.authoring.audio.waves import Waves
from harness.basics.materials import MATERIALS
from harness.basics.mesh import Mesh
from harness.objectfile.audio.audio import ObjectAudio, open_audio
from harness.objectfile.audio.blow import HammerBlow
from harness.objectfile.audio.part import AudioPart, with_audio
from harness.objectfile.audio.strike import Place, place_of_vertex, strike
from harness.objectfile.file import create_object
from tests.benchmarks.results import benchmark_parser, finish_figure
from tests.oracles.summed_modes import COUNTS, DURATION, RATE, RATES, Case, case, error, outer, said, timed
from tests.samples.object_bench import PROVENANCE, egg, egg_modes

NEAR = 2e-3
SUBDIVISIONS = 5
"""An egg of 20 480 faces: as many as a filled object has on its surface."""


def graph(profile: str, modes: int, mesh: Mesh) -> ModelProto:
    """A network of a profile's size, with random weights."""
    spec = PROFILES[profile].network
    random = np.random.default_rng(modes)
    width = max(spec.width, spec.widest)
    weights = random.standard_normal((width + 4, 3 * modes))
    vectors, phases = random.standard_normal((3, width)), random.uniform(0.0, 6.0, width)
    low, high = mesh.bounds
    return waves_graph(Waves(0.5 * (low + high), 20.0, 6.0 * vectors, phases, weights))


def opened(folder: Path, profile: str, one: Case) -> ObjectAudio:
    """An object of these modes with a network of that profile, read from its folder."""
    mesh = egg(SUBDIVISIONS)
    shapes = np.zeros((len(mesh.vertices), len(one.frequencies), 3))
    modes = replace(egg_modes(mesh), frequencies=one.frequencies, shapes=shapes, limit=RATE / 2.0)
    asked = graph(profile, len(one.frequencies), mesh)
    part = AudioPart(modes, one.decays, NEAR, PROVENANCE, asked, table=False)
    made = create_object(folder, "egg", mesh, MATERIALS["ceramic"], PROVENANCE)
    return open_audio(with_audio(made, part))


def row(audio: ObjectAudio, place: Place, one: Case, repeats: int) -> list[str]:
    """Milliseconds of the whole and of its parts, and its error."""
    blow = HammerBlow.instant(-place.normal)
    made = strike(audio, place, blow, DURATION, RATE)
    found: list[float] = []

    def once() -> None:
        found.append(1e3 * strike(audio, place, blow, DURATION, RATE).seconds["gains"])

    clock, process = timed(once, repeats)
    exact = outer(replace(one, amplitudes=made.gains[None]), np.float64)
    return [said(process), said(clock), said(found[1:]), error(made.sound, exact), f"{made.error:.0f}"]


def rows(modes: int, profile: str, repeats: int) -> Iterator[list[str]]:
    """Of each kind of decay."""
    for of in ("ceramic", "steel", *RATES):
        one = case(modes, of)
        with tempfile.TemporaryDirectory(prefix="touchstone-impact-") as folder:
            audio = opened(Path(folder) / "egg", profile, one)
            place = place_of_vertex(audio.surface.mesh, 4321)
            yield [f"{modes} {of}", profile, *row(audio, place, one, repeats)]


def main() -> None:
    """Measure what the command line asks for."""
    parser = benchmark_parser(__doc__)
    parser.add_argument("modes", type=int, nargs="*", default=COUNTS)
    parser.add_argument("--profile", action="append", choices=list(PROFILES))
    parser.add_argument("--repeats", type=int, default=30)
    asked = parser.parse_args()
    heads = (
        "modes; network profile; CPU time [ms]; wall time [ms]; network alone [ms]; error [dB]; stated [dB]"
    )
    with threadpool_limits(limits=1):
        every = [
            each
            for modes in asked.modes
            for profile in asked.profile or ["standard"]
            for each in rows(modes, profile, asked.repeats)
        ]
    finish_figure("audionet", "strike", heads, every)


if __name__ == "__main__":
    main()

"""A strike's sound is the sum of the object's modes at that place, along that force; else it is refused."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.basics.arrays import FloatArray
from harness.basics.errors import OutOfDomain, WrongUse
from harness.basics.materials import MATERIALS
from harness.basics.mesh import Mesh
from harness.objectfile.audio.audio import ObjectAudio, open_audio
from harness.objectfile.audio.blow import HammerBlow, pulse_lasting
from harness.objectfile.audio.part import with_audio
from harness.objectfile.audio.strike import MOST_SAMPLES, Place, place_near, place_of_vertex, pushes, strike
from harness.objectfile.entries import Provenance
from harness.objectfile.file import ObjectFile, create_object
from harness.sim.sound.modal_sound import impulse_response, radiation
from tests.samples.object_bench import MODES, NEAR, egg, egg_modes, egg_part

RATE = 44_100.0
DURATION = 0.4
SINGLE = 1e-5
"""Of a sound's peak: what single precision's tables and a network in it leave."""


@pytest.fixture(scope="module")
def audio(egg_object: ObjectFile) -> ObjectAudio:
    return open_audio(egg_object, "network")


def place(audio: ObjectAudio, vertex: int = 17) -> Place:
    return place_of_vertex(audio.surface.mesh, vertex)


def summed(audio: ObjectAudio, amplitudes: FloatArray, samples: int, rate: float = RATE) -> FloatArray:
    """Every mode's own answer to an impulse, one after the other."""
    times = np.arange(samples) / rate
    return amplitudes @ impulse_response(times, audio.frequencies, audio.dampings)


@settings(deadline=None)  # the first case loads compiled code
@given(st.tuples(*3 * [st.floats(-5.0, 5.0)]).filter(lambda force: np.linalg.norm(force) > 0.1))
def test_the_sound_is_the_direct_sum_of_the_modes_to_the_error_it_states(
    audio: ObjectAudio, force: tuple[float, float, float]
) -> None:
    struck = strike(audio, place(audio), HammerBlow.instant(force), DURATION, RATE)
    shapes = audio.at(place(audio).point[None])[0]
    wanted = summed(audio, shapes @ np.array(force), len(struck.sound))
    gap = np.abs(struck.sound - wanted).max() / np.abs(wanted).max()
    assert 20.0 * np.log10(gap) <= struck.error < -100.0
    assert struck.peak == np.abs(struck.sound).max()
    assert len(struck.sound) == round(DURATION * RATE)


@settings(deadline=None)
@given(st.floats(-3.0, 3.0), st.floats(0.1, 3.0), st.integers(0, 600))
def test_the_sound_is_linear_in_the_force(audio: ObjectAudio, a: float, b: float, vertex: int) -> None:
    one, other = np.array([0.3, -1.0, 0.4]), np.array([1.0, 0.2, 0.7])
    at = place(audio, vertex)

    def sound(force: FloatArray) -> FloatArray:
        return strike(audio, at, HammerBlow.instant(force), 0.05, RATE, level="double").sound

    parts = a * sound(one) + b * sound(other)
    size = abs(a) * np.abs(sound(one)).max() + b * np.abs(sound(other)).max()
    assert np.abs(sound(a * one + b * other) - parts).max() <= 1e-11 * size


def test_the_table_and_the_network_sound_alike_where_both_know_the_same(egg_object: ObjectFile) -> None:
    """At the table's nodes this network is exact, so half precision alone tells them apart."""
    network, table = (open_audio(egg_object, level) for level in ("network", "table"))
    greatest = np.abs(egg_modes(egg()).shapes).max(axis=(0, 2))
    for vertex in (0, 100, 333):
        at, blow = place(network, vertex), HammerBlow.instant(np.array([0.0, 0.6, 0.8]))
        heard, known = (strike(audio, at, blow, DURATION, RATE) for audio in (network, table))
        allowed = 2.0**-10 * 1.4 * greatest.sum() + SINGLE * known.peak
        assert np.abs(heard.sound - known.sound).max() <= allowed


def test_modes_at_or_above_half_of_the_rate_are_left_out_and_named(audio: ObjectAudio) -> None:
    rate = 2.0 * audio.frequencies[3]
    struck = strike(audio, place(audio), HammerBlow.instant([1.0, 1.0, 0.0]), DURATION, rate)
    assert struck.left_out.tolist() == [False] * 3 + [True] * (MODES - 3)
    wanted = summed(
        audio, np.where(struck.left_out, 0.0, struck.gains) * np.sqrt(2.0), len(struck.sound), rate
    )
    assert np.abs(struck.sound - wanted).max() <= SINGLE * struck.peak


def test_no_mode_below_half_of_the_rate_is_refused(audio: ObjectAudio) -> None:
    with pytest.raises(WrongUse, match=r"900 Hz.* 1800"):
        strike(audio, place(audio), HammerBlow.instant([1.0, 0.0, 0.0]), DURATION, 1800.0)


def test_a_force_that_moves_no_mode_is_refused_as_silent(tmp_path: Path) -> None:
    mesh = egg(2)
    part = egg_part(mesh)
    shapes = part.modes.shapes.copy()
    shapes[:, :, 2] = 0.0
    flat = replace(part, modes=replace(part.modes, shapes=shapes), graph=None)
    of = create_object(tmp_path / "flat", "flat", mesh, MATERIALS["ceramic"], Provenance(licence="CC0-1.0"))
    audio = open_audio(with_audio(of, flat), "table")
    with pytest.raises(WrongUse, match="mode"):
        strike(audio, place(audio), HammerBlow.instant([0.0, 0.0, 1.0]), DURATION, RATE)
    assert strike(audio, place(audio), HammerBlow.instant([0.0, 1e-3, 1.0]), DURATION, RATE).peak > 0.0


def test_a_short_pulse_sounds_as_its_impulse_and_a_long_one_spares_the_high_modes(audio: ObjectAudio) -> None:
    along = np.array([0.0, 0.0, -1.0])
    short = HammerBlow.lasting(along, pulse_lasting(1e-6, 0.01, 0.5))
    struck = strike(audio, place(audio), short, DURATION, RATE)
    instant = strike(audio, place(audio), HammerBlow.instant(0.01 * along), DURATION, RATE)
    late = slice(2, None)
    assert np.abs(struck.sound - instant.sound)[late].max() < 0.05 * instant.peak
    assert struck.amplitudes == pytest.approx(instant.amplitudes, rel=1e-3)
    long = strike(
        audio, place(audio), HammerBlow.lasting(along, pulse_lasting(1e-3, 0.01, 0.5)), DURATION, RATE
    )
    share = np.abs(long.amplitudes / instant.amplitudes)
    assert share[0] > 0.3
    assert share[-1] < 0.01


def test_a_pulse_leaves_each_mode_with_the_amplitude_that_is_said(audio: ObjectAudio) -> None:
    """One mode at a time is read from the spectrum of what rings on after the contact."""
    pulse = pulse_lasting(0.4e-3, 0.01, 0.5)
    struck = strike(
        audio, place(audio), HammerBlow.lasting([0.0, 0.0, -1.0], pulse), 1.0, RATE, level="double"
    )
    times = np.arange(len(struck.sound)) / RATE
    after = times >= pulse.duration
    decay = np.exp(-audio.dampings[:, None] * times[after])
    turns = 2.0 * np.pi * audio.frequencies[:, None] * times[after]
    basis = np.concatenate([decay * np.sin(turns), decay * np.cos(turns)])
    fitted = np.linalg.lstsq(basis.T, struck.sound[after], rcond=None)[0]
    sizes = np.hypot(fitted[:MODES], fitted[MODES:])
    assert sizes == pytest.approx(np.abs(struck.amplitudes), rel=0.05)


def test_loudness_turns_modes_into_pressure(audio: ObjectAudio) -> None:
    blow = HammerBlow.instant([0.0, 0.0, -1.0])
    near, far = (radiation(audio.as_modes(), metres) for metres in (0.5, 1.0))
    loud = strike(audio, place(audio), blow, DURATION, RATE, near)
    faint = strike(audio, place(audio), blow, DURATION, RATE, far)
    assert faint.sound == pytest.approx(0.5 * loud.sound, rel=1e-5, abs=1e-6 * loud.peak)
    wanted = summed(audio, loud.gains * near, len(loud.sound))
    assert np.abs(loud.sound - wanted).max() <= SINGLE * loud.peak


@pytest.mark.parametrize(
    ("duration", "rate", "said"),
    [
        (0.0, RATE, "0 s "),
        (-1.0, RATE, "-1 s "),
        (float("nan"), RATE, "nan s "),
        (1e-6, RATE, "sample"),
        (1.0, 0.0, "0 samples per second"),
        (1.0, float("inf"), "inf samples per second"),
        (1e9, RATE, f" {MOST_SAMPLES} samples"),
    ],
)
def test_lengths_and_rates_that_make_no_sound_are_refused(
    audio: ObjectAudio, duration: float, rate: float, said: str
) -> None:
    with pytest.raises(WrongUse, match=said):
        strike(audio, place(audio), HammerBlow.instant([1.0, 0.0, 0.0]), duration, rate)


def test_a_contact_of_too_many_samples_is_refused(audio: ObjectAudio) -> None:
    long = HammerBlow.lasting([0.0, 0.0, -1.0], pulse_lasting(0.1, 0.01, 0.5))
    with pytest.raises(WrongUse, match=r"0\.1 s .*65536 .*1e"):
        strike(audio, place(audio), long, 0.2, 1e6)


def test_a_point_is_moved_onto_the_surface_and_says_how_far(audio: ObjectAudio) -> None:
    points, normals = audio.surface.spread(40, seed=3)
    for point, normal in zip(points, normals, strict=True):
        found = place_near(audio.surface, point + 0.4 * NEAR * normal, NEAR)
        assert found.moved == pytest.approx(0.4 * NEAR, rel=0.05)
        assert np.linalg.norm(found.point - point) < 0.2 * NEAR
        assert found.normal @ normal > 0.9
    exact = place_near(audio.surface, points[0], NEAR)
    assert exact.moved < 1e-12
    assert exact.normal == pytest.approx(normals[0])


@pytest.mark.parametrize("off", [1.5 * NEAR, 0.5, 1e6, 1e300])
def test_a_point_too_far_off_is_refused_with_the_limit(audio: ObjectAudio, off: float) -> None:
    with pytest.raises(OutOfDomain, match=r" mm .*2 mm"):
        place_near(audio.surface, np.array([0.11 - 0.03 - off, -0.02, 0.05]), NEAR)


def test_a_point_off_the_surface_is_answered_with_the_nearest_that_is_taken(audio: ObjectAudio) -> None:
    with pytest.raises(OutOfDomain, match="nearest") as refused:
        place_near(audio.surface, np.array([0.11 - 0.03 - 5.0 * NEAR, -0.02, 0.05]), NEAR)
    nearest = [float(text) for text in str(refused.value).split("place, ")[1].split()]
    assert place_near(audio.surface, np.array(nearest), NEAR).moved < 1e-6


def test_a_point_that_is_no_number_is_refused(audio: ObjectAudio) -> None:
    with pytest.raises(WrongUse, match="finite"):
        place_near(audio.surface, np.array([0.1, float("nan"), 0.05]), NEAR)


@pytest.mark.parametrize("vertex", [-1, 642, 10**9])
def test_a_vertex_that_the_mesh_has_not_is_refused(audio: ObjectAudio, vertex: int) -> None:
    with pytest.raises(OutOfDomain, match=r"642.* 0 to 641"):
        place_of_vertex(audio.surface.mesh, vertex)


def test_a_vertex_without_a_face_has_no_normal() -> None:
    mesh = egg(1)
    lonely = Mesh(np.vstack([mesh.vertices, [[0.11, -0.02, 0.05]]]), mesh.faces)
    with pytest.raises(OutOfDomain, match=r"vertex 42 .*area"):
        place_of_vertex(lonely, len(mesh.vertices))


def test_pushes_are_gains_of_a_force_into_the_surface(audio: ObjectAudio) -> None:
    mesh = audio.surface.mesh
    found = pushes(audio, mesh, 3)
    assert found.shape == (len(mesh.faces), 3, 3)
    for face in (0, 77, 900):
        for corner in range(3):
            vertex = mesh.faces[face, corner]
            inward = -mesh.vertex_normals[vertex][None]
            gains = audio.gains(mesh.vertices[vertex][None], inward)[0, :3]
            assert found[face, corner] == pytest.approx(gains, rel=1e-4, abs=1e-5)

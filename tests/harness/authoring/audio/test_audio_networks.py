from dataclasses import replace

import numpy as np
import pytest
from numpy.random import default_rng

from harness.authoring.audio.audio import author_audio, opened, waves_graph
from harness.authoring.audio.data import SoundSamples, split_nodes, wave_number
from harness.authoring.audio.metrics import interpolated, relative_errors
from harness.authoring.audio.profiles import AudioProfile, WavesSpec, profile
from harness.authoring.audio.waves import (
    ENOUGH,
    FittedWaves,
    error_shares,
    fit_enough_waves,
    fit_waves,
    solve_readout,
)
from harness.basics.errors import WrongUse
from harness.objectfile.graph import Storage
from harness.sim.modal.modes import Modes
from tests.samples.object_bench import egg_waves

STORAGES: tuple[Storage, ...] = ("float16", "float32")

SINGLE = 1e-5
"""Relative to the greatest number: what float32 loses where a graph and its arrays are the same."""


def fitted(modes: Modes, width: int = 300) -> FittedWaves:
    split = split_nodes(len(modes.points))
    samples = SoundSamples(modes.points[split.trained], modes.shapes[split.trained])
    return fit_waves(samples, np.arange(len(samples.points)), wave_number(modes), width, 0, (1.0, 1.4))


def test_waves_predict_smooth_shapes_where_they_never_looked(egg: Modes) -> None:
    split = split_nodes(len(egg.points))
    truth = egg.shapes[split.held_out]
    errors = relative_errors(fitted(egg).network(egg.points[split.held_out]), truth)
    assert np.quantile(errors, 0.95) < 0.1 * np.median(relative_errors(interpolated(egg, split), truth))


def test_the_error_foretold_is_the_error_found(egg: Modes) -> None:
    split = split_nodes(len(egg.points))
    found = fitted(egg, 120)
    errors = relative_errors(found.network(egg.points[split.held_out]), egg.shapes[split.held_out])
    assert 0.5 < found.readout.expected / errors.mean() < 2.0


def test_more_waves_err_less(egg: Modes) -> None:
    few, some, many = (fitted(egg, width).readout.expected for width in (40, 100, 300))
    assert few > 2.0 * some > 4.0 * many


def test_waves_are_doubled_until_they_are_enough_or_as_many_as_may_be(egg: Modes) -> None:
    samples = SoundSamples(egg.points, egg.shapes)

    def fitted_within(widest: int) -> FittedWaves:
        spec = WavesSpec(10, (1.0,), widest)
        return fit_enough_waves(samples, np.arange(len(samples.points)), wave_number(egg), spec, 0)

    made = {widest: fitted_within(widest) for widest in (0, 19, 20, 640)}
    assert [len(made[widest].network.phases) for widest in (0, 19, 20)] == [10, 10, 20]
    assert made[20].readout.expected > ENOUGH >= made[640].readout.expected
    enough = len(made[640].network.phases)
    assert fitted_within(enough - 1).readout.expected > ENOUGH


@pytest.mark.parametrize("storage", STORAGES)
def test_the_error_foretold_is_of_weights_as_the_file_holds_them(egg: Modes, storage: Storage) -> None:
    split = split_nodes(len(egg.points))
    samples = SoundSamples(egg.points[split.trained], egg.shapes[split.trained])
    measured = np.arange(len(samples.points))
    found = fit_waves(samples, measured, wave_number(egg), 300, 0, (1.0, 1.4), storage)
    gains = opened(waves_graph(found.network, storage), 6)({"points": egg.points[split.held_out]})["gains"]
    errors = relative_errors(gains, egg.shapes[split.held_out])
    assert 0.5 < found.readout.expected / errors.mean() < 2.0


def test_the_graph_of_waves_is_the_waves(egg: Modes) -> None:
    network = fitted(egg).network
    points = egg.points + 1e-3 * default_rng(0).normal(size=egg.points.shape)
    found = opened(waves_graph(network), 6)({"points": points})["gains"]
    wanted = network(points)
    assert np.abs(found - wanted).max() < SINGLE * np.abs(wanted).max()


def test_an_object_far_from_its_origin_has_the_same_network(egg: Modes) -> None:
    far = replace(egg, points=egg.points + np.array([10.0, -20.0, 5.0]))
    split = split_nodes(len(egg.points))
    near_ = fitted(egg).network(egg.points[split.held_out])
    far_ = opened(waves_graph(fitted(far).network), 6)({"points": far.points[split.held_out]})["gains"]
    assert np.abs(near_ - far_).max() < 1e-3 * np.abs(near_).max()


def test_a_readout_solves_what_is_linear() -> None:
    random = default_rng(1)
    points = random.normal(size=(200, 3))
    weights = random.normal(size=(4, 5))

    def features(at: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> object:
        return np.concatenate([at, np.ones((len(at), 1))], axis=1)

    targets = np.asarray(features(points)) @ weights
    found = solve_readout(
        features,  # type: ignore[arg-type]
        points,
        targets,
        np.arange(200),
        error_shares(targets),
    )
    # The ridge is judged in single precision, and so chosen no finer.
    assert found.weights == pytest.approx(weights, abs=1e-7)


def test_a_node_at_rest_does_not_rule_the_fit() -> None:
    shares = error_shares(np.array([[1.0, 0.0], [0.0, 1.0], [1e-30, 0.0], [0.0, 0.0]]))
    assert shares[0] == 1.0
    assert np.isfinite(shares).all()
    assert shares.max() < 2e3


@pytest.mark.parametrize(
    ("name", "said"),
    [("standart", r"'standart'.*standard"), ("paper", r"'paper'.*standard")],
)
def test_an_unknown_or_removed_profile_is_refused_by_name(name: str, said: str) -> None:
    with pytest.raises(WrongUse, match=said):
        profile(name)


def test_the_same_waves_give_the_same_bytes() -> None:
    first, second = (waves_graph(egg_waves()) for _ in range(2))
    assert first.SerializeToString(deterministic=True) == second.SerializeToString(deterministic=True)


def test_half_precision_weights_take_half_the_file() -> None:
    waves = egg_waves(modes=100)
    assert waves_graph(waves, "float16").ByteSize() < 0.6 * waves_graph(waves).ByteSize()


def test_subnormal_weights_are_written_as_zero() -> None:
    weights = np.full((28, 21), 1e-40)
    weights[-1] = np.arange(1.0, 22.0)
    found = opened(waves_graph(replace(egg_waves(), weights=weights)), 7)({"points": np.zeros((5, 3))})
    assert found["gains"].reshape(5, -1) == pytest.approx(np.tile(weights[-1], (5, 1)), abs=0.0)


@pytest.mark.parametrize(
    ("bad", "storage"), [(np.nan, "float32"), (np.inf, "float32"), (1e39, "float32"), (1e5, "float16")]
)
def test_weights_that_the_file_cannot_hold_are_refused(bad: float, storage: Storage) -> None:
    waves = egg_waves()
    waves.weights[2, 3] = bad
    with pytest.raises(WrongUse, match=f"the linear layer has 1 numbers that are not finite in {storage}"):
        waves_graph(waves, storage)


def test_silent_modes_do_not_stop_the_waves(egg: Modes) -> None:
    shapes = egg.shapes.copy()
    shapes[:, 2] = 0.0
    network = fitted(replace(egg, shapes=shapes)).network
    assert np.abs(network(egg.points)[:, 2]).max() < 1e-12


def test_authoring_measures_on_nodes_it_never_saw(egg: Modes) -> None:
    said = []
    made = author_audio(
        egg,
        np.full(6, 20.0),
        AudioProfile(WavesSpec(200), sounds=2),
        0,
        lambda doing, share: said.append((doing, share)),
    )
    assert len(made.split.held_out) == 64
    assert all(0.0 <= share <= 1.0 for _, share in said)
    assert set(made.errors) == {"network", "nearest_trained", "linear", "table_float16"}
    assert made.errors["table_float16"]["gain_error_p95"] < 2.0**-10
    assert made.errors["network"]["bytes"] == len(made.graph.SerializeToString())
    assert made.errors["network"]["gain_error_p95"] < made.errors["linear"]["gain_error_median"]
    assert made.errors["network"]["stft_distance"] < made.errors["linear"]["stft_distance"]

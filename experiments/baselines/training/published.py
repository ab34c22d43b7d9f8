"""Trains the published forms of 2.0's networks of sound and touch for a short while."""

from pathlib import Path
from tempfile import TemporaryDirectory

import torch

from experiments.baselines.sound.bench import SEED, StrikeBench
from experiments.baselines.touch.bench import TouchBench
from harness.authoring.audio.mlp import AudioTraining
from harness.authoring.audio.profiles import PerceptronSpec
from harness.authoring.touch.mlp import TouchTraining, learned_from
from harness.authoring.touch.profiles import TouchPerceptronSpec
from harness.authoring.training import Report, Resumable, train
from harness.objectfile.audio.graph import audio_graph


def train_audionet(bench: StrikeBench, spec: PerceptronSpec, report: Report) -> bytes:
    """The graph of 2.0's AudioNet, trained at the nodes that strikes are not at."""
    training = AudioTraining(spec, bench.modes, bench.split.trained, SEED)
    _trained(training, spec.epochs, report)
    found = training.finish()
    return audio_graph(found.branches, found.normaliser, found.scales, found.encoding).SerializeToString()


def train_touchnet(bench: TouchBench, spec: TouchPerceptronSpec, report: Report) -> bytes:
    """The graph of 2.0's TouchNet, trained on presses at other places than the bench's."""
    training = TouchTraining(spec, learned_from(bench.places, spec.presses, SEED), SEED)
    _trained(training, spec.epochs, report)
    return training.finish().graph.SerializeToString()


def _trained(training: Resumable, epochs: int, report: Report) -> None:
    torch.set_num_threads(1)
    with TemporaryDirectory() as folder:
        train(training, epochs, Path(folder) / "training.npz", report)

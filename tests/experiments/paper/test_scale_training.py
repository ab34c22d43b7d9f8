"""The paper's networks in torch: the published layers, graphs that answer alike, a training that ends."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from experiments.paper.scale_networks import SIZE_INPUTS, STEPS, paper_networks
from experiments.paper.train import main

torch = pytest.importorskip("torch", reason="the extra 'author' is not installed")

from experiments.paper.scale_training import (  # noqa: E402
    MODULES,
    USUAL,
    fitted_paper,
    paper_graph,
)
from experiments.scale_estimation.unseen.training.samples import SizeSamples  # noqa: E402
from harness.authoring.resnet import ResNet18  # noqa: E402

PUBLISHED = 11_689_512
"""Parameters of ResNet-18 with a thousand classes."""


@pytest.fixture(autouse=True)
def one_thread() -> None:
    torch.set_num_threads(1)


def drawn(sense: str, count: int) -> list[Any]:
    """Inputs of a network; of imprints, sequences of other lengths."""
    torch.manual_seed(4)
    given = [torch.randn((count, *shape)) for _, shape in SIZE_INPUTS[sense]]
    if sense == "imprints":
        given[1] = torch.eye(STEPS)[torch.arange(count) * 5 % STEPS]
    return given


def test_resnet_18_has_the_published_layers() -> None:
    module = ResNet18(3, 1)
    count = sum(value.numel() for value in module.parameters())
    assert count == PUBLISHED - 1000 * 513 + 513
    with torch.no_grad():
        found = module.pool(torch.relu(module.first(torch.zeros(1, 3, 224, 224))))
        assert found.shape == (1, 64, 56, 56)
        for block in module.blocks:
            found = block(found)
        assert found.shape == (1, 512, 7, 7)


@pytest.mark.parametrize("sense", list(SIZE_INPUTS))
def test_a_graph_answers_as_torch_does(sense: str, tmp_path: Path) -> None:
    given, module = drawn(sense, 3), MODULES[sense]()
    with torch.no_grad():
        for _ in range(5):  # so that the normalisation is of something
            module.train()(*given)
        wanted = module.eval()(*given).numpy()
    (tmp_path / f"{sense}.onnx").write_bytes(paper_graph(sense, module))
    (tmp_path / f"{sense}.json").write_text("{}")
    names = [name for name, _ in SIZE_INPUTS[sense]]
    values = [value.numpy() for value in given]
    found = paper_networks(tmp_path)[sense].network(dict(zip(names, values, strict=True)))["log_size"]
    assert found == pytest.approx(wanted, abs=2e-2 * max(1.0, float(np.ptp(wanted))))  # half precision
    assert np.ptp(wanted) > 1e-3


def test_what_follows_the_last_imprint_changes_nothing() -> None:
    imprints, last = drawn("imprints", 2)
    module = MODULES["imprints"]().eval()
    other = imprints.clone()
    for row, length in enumerate(last.argmax(dim=1)):
        other[row, int(length) + 1 :] = 9.0
    with torch.no_grad():
        assert torch.equal(module(imprints, last), module(other, last))


def test_a_fit_finds_a_size_that_the_inputs_hold() -> None:
    random = np.random.default_rng(1)
    logs = random.uniform(np.log(0.05), np.log(0.6), 256)
    imprints = random.standard_normal((256, STEPS, 4)).astype(np.float32)
    imprints[:, :3, 0] = (logs - USUAL)[:, None]
    last = np.zeros((256, STEPS), np.float32)
    last[:, 2] = 1.0
    samples = SizeSamples({"imprints": imprints, "last": last}, np.exp(logs), np.arange(256))
    module = fitted_paper("imprints", samples, 20, seed=1)
    with torch.no_grad():
        found = module(torch.from_numpy(imprints), torch.from_numpy(last)).numpy()[:, 0]
    assert np.abs(found - logs).mean() < 0.3 * np.abs(logs - USUAL).mean()


def test_a_smoke_training_ends_in_a_network_and_its_card(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TOUCHSTONE_CACHE", str(tmp_path / "cache"))
    asked = [
        "scale",
        "--profile",
        "paper-smoke",
        "--only",
        "picture",
        "--to",
        str(tmp_path),
        "--processes",
        "1",
    ]
    assert main(asked) == 0
    card = json.loads((tmp_path / "picture.json").read_text())
    assert card["held_out"]["samples"] > 0
    assert card["profile"] == "paper-smoke"
    network = paper_networks(tmp_path)["picture"]
    size = network.size([{"crop": np.zeros(SIZE_INPUTS["picture"][0][1])}])
    assert 0.0 < size < np.inf

"""The literal table of what can be run at a bench: one row for each experiment and each calibration.

Nothing is imported here. A row names the experiment's value and the model of its table of a scene file as
import strings; ``harness.experiment.lookup`` loads the one, ``harness.bench.scene`` the other, on use.
"""

import importlib
from dataclasses import dataclass
from typing import Any

from harness.basics.errors import WrongUse
from harness.basics.files.named_file import nearest


@dataclass(frozen=True)
class ExperimentRow:
    """One experiment or calibration."""

    about: str  #: its question, in one line.
    value: str | None = None  #: import string of its ``Experiment``; None for a calibration.
    section: str | None = None  #: name of its table in a scene file; None where it has none.
    model: str | None = None  #: import string of that table's model.
    tables: str | None = None
    """import string of the ``Measurement`` of its table, with the paper's baselines among its methods; None
    for the experiment's own."""
    command: str = "replay"  #: the words after ``touchstone`` that read a run of it again.


EXPERIMENTS: dict[str, ExperimentRow] = {
    "contact-localization": ExperimentRow(
        about="Which point of the object's surface was touched?",
        value="experiments.contact_localization.experiment:EXPERIMENT",
        section="localization",
        model="experiments.contact_localization.section:Localization",
    ),
    "scale-estimation": ExperimentRow(
        about="How big is an object of known shape?",
        value="experiments.scale_estimation.experiment:EXPERIMENT",
        section="scale",
        model="experiments.scale_estimation.section:Scale",
        tables="experiments.paper.scale_table:ScaleTable",
    ),
    "shape-reconstruction": ExperimentRow(
        about="What does an object never seen look like?",
        value="experiments.shape_reconstruction.experiment:EXPERIMENT",
        section="shape",
        model="experiments.shape_reconstruction.section:ShapeRun",
        tables="experiments.paper.shape_table:ShapeTable",
    ),
    "calibrate-taxim": ExperimentRow(
        about="How does a tactile camera's gel turn slope into colour?", command="calibrate taxim"
    ),
}
"""By the name that a run's folder carries."""

DEFAULT_EXPERIMENT = "contact-localization"
"""Experiment of a run for which none is named."""


def experiment_names() -> tuple[str, ...]:
    """Return the name of every experiment, in the order of the table."""
    return tuple(name for name, row in EXPERIMENTS.items() if row.value is not None)


def require_experiment(name: str) -> str:
    """Return the import string of an experiment.

    Raises:
        WrongUse: there is no experiment of this name.
    """
    row = EXPERIMENTS.get(name)
    if row is None or row.value is None:
        raise WrongUse(f"there is no experiment {name!r}; {nearest(name, experiment_names())}")
    return row.value


def loaded(reference: str) -> Any:
    """What an import string names: ``"package.module:name"``."""
    module, _, name = reference.partition(":")
    return vars(importlib.import_module(module))[name]

"""Running a graph: onnxruntime on the processor, one thread unless told otherwise.

One thread, because a bench has other work for its cores and small networks gain nothing from a
second. Subnormal numbers are kept out at the source, where weights are written
(``graph.Nodes.weight``), and not by onnxruntime's ``session.set_denormal_as_zero``: that flag is
set for the whole thread that makes the first session, and makes numpy lose subnormal float64 from
then on.
"""

from collections.abc import Mapping, Sequence

import numpy as np
import onnxruntime

from harness.basics.arrays import AnyArray
from harness.basics.errors import DataRefused, WrongUse
from harness.objectfile.entries import Input, Tensor
from harness.objectfile.graph_check import checked_graph, require_declared, with_outputs
from harness.objectfile.graph_cost import query_cost

_FATAL = 4
"""onnxruntime's severity; what goes wrong is raised, and said once."""


class Network:
    """A checked graph, ready to run.

    Args:
        data: bytes of the file.
        name: name of the file, for messages.
        inputs: inputs that the graph must have.
        outputs: outputs that the graph must have.
        threads: number of threads of one run.
        only: names of the outputs that are computed; empty for all.

    Raises:
        DataRefused: the graph must not be run, or does not fit the description.
    """

    def __init__(
        self,
        data: bytes,
        name: str,
        inputs: Sequence[Input],
        outputs: Sequence[Tensor],
        threads: int = 1,
        only: Sequence[str] = (),
    ) -> None:
        if threads < 1:
            raise WrongUse(f"{threads} threads compute nothing; say 1 or more")
        model = checked_graph(data, name)
        require_declared(model, (*inputs, *outputs), name)
        if only:
            outputs = [tensor for tensor in outputs if tensor.name in only]
            data = with_outputs(model, only)
        self._cost = query_cost(model, name)
        self.name, self.inputs, self.outputs = name, tuple(inputs), tuple(outputs)
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = threads
        options.inter_op_num_threads = 1
        options.execution_mode = onnxruntime.ExecutionMode.ORT_SEQUENTIAL
        options.log_severity_level = _FATAL
        # A thread that waits by spinning takes a core from the bench.
        options.add_session_config_entry("session.intra_op.allow_spinning", "0")
        try:
            self._session = onnxruntime.InferenceSession(data, options, providers=["CPUExecutionProvider"])
        except Exception as error:
            raise _failed(name, error) from error

    def __call__(self, inputs: Mapping[str, AnyArray]) -> dict[str, AnyArray]:
        """The outputs by name; of no queries, outputs of none.

        Raises:
            DataRefused: onnxruntime cannot compute them, or so many at once take too much memory or work.
        """
        names = [tensor.name for tensor in self.outputs]
        nothing = {tensor.name: _of_none(tensor) for tensor in self.inputs}
        if {name: array.shape for name, array in inputs.items()} == nothing:
            # onnxruntime's products cannot broadcast over none.
            return {tensor.name: np.empty(_of_none(tensor), tensor.dtype) for tensor in self.outputs}
        # Inputs of other shapes are refused by onnxruntime.
        rows = max((len(array) for array in inputs.values() if np.ndim(array)), default=0)
        self._cost.require_call(rows, self.name)
        try:
            return dict(zip(names, self._session.run(names, dict(inputs)), strict=True))
        except Exception as error:
            raise _failed(self.name, error) from error


def _of_none(tensor: Tensor) -> tuple[int, ...]:
    """The shape for no queries: only the first size of a tensor is theirs."""
    return (0, *(size for size in tensor.shape[1:] if size != "n"))


def _failed(name: str, error: Exception) -> DataRefused:
    """Its exceptions are classes of its own for each kind of failure, with no common base."""
    reason = " ".join(str(error).split())[:200]
    return DataRefused(f"{name} cannot be run by onnxruntime ({reason}); build the object again")

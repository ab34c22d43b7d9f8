"""Run a mocked UR controller on a loopback address until told to stop.

Ports: 29999 dashboard, 30001 to 30003 programs, 30004 real-time data exchange. ``serve`` blocks;
give it a process of its own. ::

    serve(
        ControllerConfig(host="127.0.0.2"),
        contact=model,                        # .wrench(base_from_flange, time) once a cycle
        on_cycle=publish,                     # (time, joints, base_from_flange) once a cycle
        should_stop=line.should_stop,         # asked every 50 ms
        step=lambda: shared.mark.step,        # keys the force noise; asked when a motion starts
        cues=line.fault,                      # the next fault, or None; asked every 10 ms
        on_ready=line.ready,                  # once, when all ports listen
    )
"""

from collections.abc import Callable

from mocks.ur.hooks import ContactModel, ControllerConfig, Cue, OnCycle


def serve(
    config: ControllerConfig,
    contact: ContactModel | None,
    on_cycle: OnCycle | None,
    should_stop: Callable[[], bool],
    *,
    step: Callable[[], int] = lambda: 0,
    cues: Callable[[], Cue | None] = lambda: None,
    on_ready: Callable[[], None] = lambda: None,
) -> None:
    """Serve until ``should_stop``; every port is closed on return.

    Raises:
        OSError: an address or port that cannot be bound.
        harness.errors.WrongUse: a model that is not known.
    """
    raise NotImplementedError("mocks.ur.serve.serve")

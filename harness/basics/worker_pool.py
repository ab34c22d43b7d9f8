"""Child processes: a pool that ends with whoever started it, and one process ended by its input."""

import contextlib
import os
import subprocess
import threading
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

PERIOD = 0.5
"""S between two looks at the parent: a killed program's workers compute no longer than this."""


def worker_pool(workers: int) -> ProcessPoolExecutor:
    """A pool of fresh processes that each end themselves when their parent is gone."""
    spawn = get_context("spawn")  # threads of compiled kernels do not survive a fork
    return ProcessPoolExecutor(
        workers, mp_context=spawn, initializer=end_without_parent, initargs=(os.getpid(),)
    )


def end_without_parent(parent: int) -> None:
    """End this process within ``PERIOD`` once its parent is gone.

    Args:
        parent: process number of whoever started it.
    """
    threading.Thread(target=_end_without, args=(parent,), daemon=True).start()


def _end_without(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(PERIOD)
    os._exit(1)  # nobody is left to take a result


def end_process(process: subprocess.Popen[bytes], seconds: float) -> None:
    """Close a process's standard input, so that it ends; kill it after ``seconds``."""
    if process.stdin is not None:
        with contextlib.suppress(OSError):  # what was not yet sent no longer matters
            process.stdin.close()
    try:
        process.wait(seconds)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()

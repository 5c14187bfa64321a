"""One panorama that is divided among programs."""

import hashlib
from collections.abc import Callable, Iterable
from typing import TypeAlias

from trueup import _trueup

Workers: TypeAlias = Callable[[bytes, list[bytes]], Iterable[tuple[int, bytes]]]
"""Has tasks done by other programs: called with what the tasks have in common and the tasks, it yields the number and the result of each,
in any order, which :func:`do_task` gives in whatever program. A task may be done as often as need be: it does nothing but return bytes."""


def do_task(common: bytes, task: bytes, *, threads: int = 1) -> bytes:
    """What a task of a panorama that another program stitches comes to, on so many threads (0: one per core).

    The photographs are looked for under the absolute paths that they have there. Of tasks with the same ``common`` that follow each other
    in one program, the first gets it ready for all.

    Raises :class:`trueup.InputError` if another version of trueup has handed it out, or a photograph cannot be read.
    """
    key = hashlib.sha256(common).digest(), threads
    worker = _ready.get(key)
    if worker is None:
        worker = _trueup.Worker(common, threads)
        _ready.clear()
        _ready[key] = worker
    return worker.run(task)


_ready: dict[tuple[bytes, int], _trueup.Worker] = {}
"""Who did the latest task, by what it had in common with others, and the threads."""

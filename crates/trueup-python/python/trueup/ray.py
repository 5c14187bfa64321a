"""One panorama on the nodes of a Ray cluster.

>>> import ray, trueup, trueup.ray
>>> ray.init("auto")
>>> panorama = trueup.stitch("/shared/holiday", workers=trueup.ray.workers())
"""

import importlib.util
from collections.abc import Iterator
from typing import Any

from trueup._workers import Workers, do_task

if importlib.util.find_spec("ray") is None:
    raise ImportError("trueup.ray needs Ray: install trueup[ray]")

import ray

_AT_WORK_PER_CPU = 3
"""Tasks handed to the cluster for each of its cores: one at work, and others that are on their way meanwhile."""

_PATIENCE_S = 1.0
"""Seconds without a result after which it is looked how many nodes there are."""


def workers(*, num_cpus: int = 1) -> Workers:
    """Who does the tasks of one panorama: every node of the Ray cluster that this program is connected to.

    Give it to :func:`trueup.stitch`, :func:`trueup.align` or :meth:`trueup.Alignment.compose`. The nodes find the photographs under the
    same absolute paths, and have the same version of trueup. A task takes ``num_cpus`` cores. Whoever is killed costs the tasks that were
    at work there, which are done again; nodes that come while it works are used. The panorama is the one that one machine makes, to the
    last bit.
    """

    # Work that was lost with its node is done again by whichever is left, however often that happens.
    @ray.remote(num_cpus=num_cpus, max_retries=-1)
    def task(common: bytes, task: bytes) -> bytes:
        return do_task(common, task, threads=num_cpus)

    def run(common: bytes, tasks: list[bytes]) -> Iterator[tuple[int, bytes]]:
        # Handed over once for each node, not for each task.
        common_at: Any = ray.put(common)
        left = list(enumerate(tasks))[::-1]
        at_work: dict[Any, int] = {}
        # Ray has no types for it.
        resources: Any = ray.cluster_resources
        try:
            while left or at_work:
                cores = int(resources().get("CPU", 1))
                while left and len(at_work) < max(1, cores // num_cpus) * _AT_WORK_PER_CPU:
                    number, one = left.pop()
                    at_work[task.remote(common_at, one)] = number
                done, _ = ray.wait(list(at_work), timeout=_PATIENCE_S)
                for reference in done:
                    yield at_work.pop(reference), ray.get(reference)
        finally:
            for reference in at_work:
                ray.cancel(reference, force=True)

    return run

"""One panorama that is divided: among processes, and on a cluster whose node is killed."""

from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import trueup


class Processes:
    """Does tasks in processes; the last are done first."""

    def __init__(self) -> None:
        self.tasks = 0

    def __call__(self, common: bytes, tasks: list[bytes]) -> Iterator[tuple[int, bytes]]:
        self.tasks += len(tasks)
        with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
            futures = {pool.submit(trueup.do_task, common, task): number for number, task in enumerate(tasks)}
            for future in reversed(list(as_completed(futures))):
                yield futures[future], future.result()


@pytest.fixture
def alone(folder: Path) -> bytes:
    """The room's panorama, made by one program."""
    trueup.stitch("room").save("alone.png")
    return Path("alone.png").read_bytes()


def test_processes_make_the_same_panorama(alone: bytes) -> None:
    processes = Processes()
    trueup.stitch("room", workers=processes).save("divided.png")
    assert Path("divided.png").read_bytes() == alone
    assert processes.tasks >= 4, "photographs, pairs, small photographs, regions"


def test_an_alignment_is_composed_by_others(alone: bytes) -> None:
    alignment = trueup.align("room", workers=Processes())
    alignment.compose(workers=Processes()).save("divided.png")
    assert Path("divided.png").read_bytes() == alone


def test_what_workers_raise_is_raised(folder: Path) -> None:
    def broken(common: bytes, tasks: list[bytes]) -> Iterator[tuple[int, bytes]]:
        raise ZeroDivisionError("no workers")
        yield

    with pytest.raises(ZeroDivisionError, match="no workers"):
        trueup.stitch("room", workers=broken)
    with pytest.raises(TypeError):
        trueup.stitch("room", workers=lambda common, tasks: 7)  # type: ignore[arg-type, return-value]
    with pytest.raises(RuntimeError, match="number and its bytes"):
        trueup.stitch("room", workers=lambda common, tasks: ["one"])  # type: ignore[list-item]
    with pytest.raises(trueup.InputError, match="tasks that were not done"):
        trueup.stitch("room", workers=lambda common, tasks: [])


def test_tasks_of_nobody_are_refused() -> None:
    with pytest.raises(trueup.InputError, match="cannot be read"):
        trueup.do_task(b"common", b"task")


def test_pictures_in_memory_stay_here(pictures: list[Any], panorama: trueup.Panorama) -> None:
    processes = Processes()
    divided = trueup.stitch(pictures, workers=processes)
    assert np.array_equal(divided.image, panorama.image)
    assert processes.tasks == 1, "their features alone are handed over"


def test_a_cluster_makes_the_same_panorama_though_a_node_is_killed(alone: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    ray: Any = pytest.importorskip("ray", reason="there is no Ray for this Python")
    from ray.cluster_utils import Cluster

    import trueup.ray

    monkeypatch.setenv("RAY_worker_niceness", "0")
    # Ray has no types for some of it.
    cluster: Any = Cluster(initialize_head=True, head_node_args={"num_cpus": 0, "include_dashboard": False})
    try:
        nodes = [cluster.add_node(num_cpus=1) for _ in range(3)]
        ray.init(cluster.address, log_to_driver=False)
        results = 0

        def watched(common: bytes, tasks: list[bytes]) -> Iterator[tuple[int, bytes]]:
            nonlocal results
            for result in trueup.ray.workers()(common, tasks):
                yield result
                results += 1
                if results == 1:
                    cluster.remove_node(nodes.pop(), allow_graceful=False)

        trueup.stitch("room", workers=watched).save("divided.png")
    finally:
        ray.shutdown()
        cluster.shutdown()
    assert Path("divided.png").read_bytes() == alone
    assert results >= 4 and len(nodes) == 2

"""Several threads of one program."""

import subprocess
import sys
import sysconfig
from concurrent.futures import ThreadPoolExecutor
from threading import Barrier

import numpy as np
import pytest
from conftest import Array

import trueup

THREADS = 4


def test_threads_stitch_at_once(pictures: list[Array], panorama: trueup.Panorama) -> None:
    together = Barrier(THREADS)

    def stitched(number: int) -> Array:
        together.wait()
        heard: list[tuple[str, int, int]] = []
        made = trueup.stitch(pictures, threads=1 + number % 2, progress=lambda *told: heard.append(told))
        assert heard and made.photographs[0].used
        return made.image

    with ThreadPoolExecutor(THREADS) as pool:
        for image in pool.map(stitched, range(THREADS)):
            assert np.array_equal(image, panorama.image)


def test_threads_share_what_was_made(panorama: trueup.Panorama, pictures: list[Array]) -> None:
    alignment = trueup.align(pictures)

    def looked_at(number: int) -> Array:
        fresh = alignment.compose()
        assert fresh.report.measures == panorama.report.measures and fresh.mask.shape == panorama.mask.shape
        return fresh.image

    with ThreadPoolExecutor(THREADS) as pool:
        for image in pool.map(looked_at, range(THREADS)):
            assert np.array_equal(image, panorama.image)


@pytest.mark.skipif(not sysconfig.get_config_var("Py_GIL_DISABLED"), reason="this Python has the lock built in")
def test_importing_does_not_switch_the_lock_on() -> None:
    program = "import sys, trueup; print(sys._is_gil_enabled())"
    told = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, text=True)
    assert told.stdout.strip() == "False"

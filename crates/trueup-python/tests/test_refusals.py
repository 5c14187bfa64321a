"""What is refused, and how that is told."""

import os
import pickle
import signal
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from conftest import Array

import trueup


def test_errors_have_the_names_of_the_library_and_a_hint(pictures: list[Array], tmp_path: Path) -> None:
    with pytest.raises(trueup.InputError) as missing:
        trueup.stitch(tmp_path / "none.jpg")
    assert "none.jpg" in missing.value.subject and missing.value.reason and missing.value.hint.endswith(".")
    assert isinstance(missing.value, ValueError) and isinstance(missing.value, trueup.Error)
    random = np.random.default_rng(7)
    noise = [random.integers(0, 256, (300, 400, 3), np.uint8) for _ in range(2)]
    with pytest.raises(trueup.UnsolvableError) as unrelated:
        trueup.stitch(noise)
    assert unrelated.value.stage and unrelated.value.hint
    with pytest.raises(trueup.OptionsError) as invalid:
        trueup.stitch(pictures, scale=-1)
    assert invalid.value.invalid[0][:2] == ("canvas.scale", "-1")
    with pytest.raises(trueup.LimitsError) as limits:
        trueup.stitch(pictures, memory="10MB")
    assert limits.value.needed and isinstance(limits.value, MemoryError)


@pytest.mark.parametrize(
    ("keywords", "words"),
    [
        ({"set": {"mesh.cell": 3}}, 'no option "mesh.cell"'),
        ({"method": "magic"}, "magic"),
        ({"seed": 1.5}, "whole number"),
        ({"projection": "mesh", "yaw": 30}, "has no view"),
        ({"method": "gsp-2d", "yaw": 30}, "has no view"),
        ({"reference": "q.jpg"}, "no photograph of this name"),
    ],
)
def test_wishes_that_cannot_be(pictures: list[Array], keywords: dict[str, object], words: str) -> None:
    with pytest.raises(trueup.InputError, match=words):
        trueup.stitch(pictures, **keywords)  # type: ignore[arg-type]


def test_unknown_keywords_name_the_known_ones(pictures: list[Array]) -> None:
    with pytest.raises(TypeError, match="unexpected keyword argument 'metod'.*method"):
        trueup.stitch(pictures, metod="vpg")  # type: ignore[call-arg]


def test_pixels_that_cannot_be(pictures: list[Array]) -> None:
    for wrong, words in [
        (pictures[0].astype(np.int32), "no array of uint8"),
        (pictures[0][..., :2], "its shape is 300 x 400 x 2"),
        (pictures[0][0, 0], "its shape is"),
        (pictures[0].astype(np.float32), "0 to 1"),
    ]:
        with pytest.raises(trueup.InputError, match=words) as refused:
            trueup.stitch([wrong, *pictures])
        assert refused.value.subject == "photographs[0]" and refused.value.hint
    with pytest.raises(trueup.InputError, match="one picture"):
        trueup.stitch(pictures[0])
    with pytest.raises(TypeError, match="photographs\\[1\\] is neither"):
        trueup.stitch([pictures[0], 3])  # type: ignore[list-item]
    with pytest.raises(TypeError):
        trueup.stitch(3)  # type: ignore[arg-type]
    with pytest.raises(trueup.InputError, match="no photographs were given"):
        trueup.stitch([])


def test_errors_survive_pickling(tmp_path: Path) -> None:
    with pytest.raises(trueup.InputError) as missing:
        trueup.stitch(tmp_path / "none.jpg")
    again = pickle.loads(pickle.dumps(missing.value))
    assert str(again) == str(missing.value) and again.hint == missing.value.hint


def test_progress_is_told_in_the_calling_thread(pictures: list[Array]) -> None:
    told: list[tuple[str, int, int]] = []
    threads = set()

    def progress(stage: str, done: int, total: int) -> None:
        told.append((stage, done, total))
        threads.add(threading.get_ident())

    trueup.stitch(pictures, progress=progress)
    assert threads == {threading.get_ident()}
    assert ("measuring", 0, 5) in told and ("measuring", 5, 5) in told
    assert all(0 <= done <= total for _, done, total in told)


def test_bars_come_and_go(pictures: list[Array], capsys: pytest.CaptureFixture[str]) -> None:
    trueup.stitch(pictures, progress=True)
    assert "measuring" in capsys.readouterr().err


def test_an_exception_in_the_callback_stops_the_work(pictures: list[Array]) -> None:
    stages = []

    def progress(stage: str, done: int, total: int) -> None:
        stages.append(stage)
        if stage == "measuring":
            raise LookupError("enough")

    with pytest.raises(LookupError, match="enough"):
        trueup.stitch(pictures, progress=progress)
    assert stages[-1] == "measuring", "nothing is told afterwards"


def test_ctrl_c_interrupts(room: Path) -> None:
    # What a shell starts in the background ignores the signal.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    started = threading.Event()

    def interrupt() -> None:
        started.wait()
        os.kill(os.getpid(), signal.SIGINT)

    interrupting = threading.Thread(target=interrupt)
    interrupting.start()
    with pytest.raises(KeyboardInterrupt):
        trueup.stitch(room, scale=3, progress=lambda *_: started.set())
    interrupting.join()


def test_other_threads_go_on_meanwhile(pictures: list[Array]) -> None:
    steps, over = 0, False

    def count() -> None:
        nonlocal steps
        while not over:
            steps += 1
            time.sleep(0.001)

    counting = threading.Thread(target=count)
    counting.start()
    before = steps
    trueup.stitch(pictures)
    during = steps - before
    over = True
    counting.join()
    assert during > 10


def test_panoramas_are_made_side_by_side(pictures: list[Array], panorama: trueup.Panorama) -> None:
    made: list[Array] = []
    threads = [threading.Thread(target=lambda: made.append(trueup.stitch(pictures).image)) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(made) == 3 and all(np.array_equal(image, panorama.image) for image in made)

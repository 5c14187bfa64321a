"""Trees of folders, stitched as the command does."""

import json
import math
import subprocess
import sysconfig
from pathlib import Path

import numpy as np
import pytest
from conftest import Array
from PIL import Image

import trueup

COMMAND = Path(sysconfig.get_path("scripts")) / "trueup"


@pytest.fixture
def houses(tmp_path: Path, pictures: list[Array], monkeypatch: pytest.MonkeyPatch) -> Path:
    """A desk with a tree of folders: two that make a panorama, one of noise, one of a single photograph."""
    for name, count in [("a", 3), ("b", 2), ("single", 1)]:
        (tmp_path / "houses" / name).mkdir(parents=True)
        for number, picture in enumerate(pictures[:count]):
            Image.fromarray(picture).save(tmp_path / "houses" / name / f"{number}.jpg", quality=95)
    (tmp_path / "houses" / "noise").mkdir()
    for number in range(2):
        noise = np.random.default_rng(number).integers(0, 256, pictures[0].shape, np.uint8)
        Image.fromarray(noise).save(tmp_path / "houses" / "noise" / f"{number}.jpg")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def without_seconds(line: dict[str, object]) -> dict[str, object]:
    """A line without what differs from run to run."""
    return {name: value for name, value in line.items() if name != "seconds"}


def test_a_batch_is_that_of_the_command(houses: Path) -> None:
    heard: list[trueup.BatchLine] = []
    lines = trueup.batch("houses", "python", scale=0.5, told=heard.append)
    statuses = {line["set"]: line["status"] for line in lines}
    assert statuses == {"a": "made", "b": "made", "noise": "failed", "single": "alone"}
    assert {line["set"] for line in heard} == set(statuses)
    ended = subprocess.run([COMMAND, "batch", "houses", "-o", "command", "--scale", "0.5", "--quiet"])
    assert ended.returncode == 3, "a set made none"
    told = [json.loads(line) for line in Path("command/batch.jsonl").read_text().splitlines()]
    assert [without_seconds(line) for line in lines] == [without_seconds(line) for line in told]
    written = [json.loads(line) for line in Path("python/batch.jsonl").read_text().splitlines()]
    assert written == lines
    for name in ["a/panorama.jpg", "b/panorama.jpg", "a/thumbnail.jpg"]:
        assert Path("python", name).read_bytes() == Path("command", name).read_bytes()
    assert Path("python/index.html").exists() and Path("python/batch.csv").exists()

    # All is done: nothing is made again, and a folder that is new is.
    heard.clear()
    assert trueup.batch("houses", "python", scale=0.5, told=heard.append) == lines
    assert heard == []


def test_the_plan_is_that_of_the_command(houses: Path) -> None:
    plan = trueup.batch_plan("houses", "panoramas", gap=math.inf)
    printed = subprocess.run([COMMAND, "batch", "houses", "-o", "panoramas", "--gap", "inf", "--dry-run", "--json"], check=True, capture_output=True, text=True)
    assert plan == [json.loads(line) for line in printed.stdout.splitlines()]
    assert [line["set"] for line in plan] == ["a", "b", "noise", "single"]
    parts = [trueup.batch_plan("houses", "panoramas", shard=(number, 3)) for number in (1, 2, 3)]
    assert sorted(line["set"] for part in parts for line in part) == ["a", "b", "noise", "single"]
    assert not Path("panoramas").exists()


def test_an_exception_stops_it_and_what_is_made_stays(houses: Path) -> None:
    def stop(line: trueup.BatchLine) -> None:
        raise RuntimeError(line["set"])

    with pytest.raises(RuntimeError, match="a"):
        trueup.batch("houses", "panoramas", scale=0.5, told=stop)
    assert Path("panoramas/a/panorama.jpg").exists() and not Path("panoramas/b/record.json").exists()
    stages = set()
    lines = trueup.batch("houses", "panoramas", scale=0.5, format="png", progress=lambda stage, done, total: stages.add(stage))
    assert "sets" in stages
    assert [line["panorama"] for line in lines if line["status"] == "made"] == ["a/panorama.png", "b/panorama.png"]


def test_what_cannot_be_is_refused_before_anything_is_done(houses: Path) -> None:
    with pytest.raises(trueup.InputError, match="folder of the photographs"):
        trueup.batch("houses", "houses")
    with pytest.raises(trueup.Error):
        trueup.batch("none", "panoramas")
    with pytest.raises(trueup.OptionsError):
        trueup.batch("houses", "panoramas", scale=-1)
    with pytest.raises(trueup.UnsupportedError):
        trueup.batch("houses", "panoramas", format="gif")
    with pytest.raises(TypeError, match="masks"):
        trueup.batch("houses", "panoramas", masks={})  # type: ignore[call-arg]
    wrong: list[dict[str, object]] = [{"shard": (0, 2)}, {"shard": (3, 2)}, {"gap": -1.0}, {"gap": math.nan}, {"jobs": 0}]
    for one in wrong:
        with pytest.raises(trueup.InputError):
            trueup.batch("houses", "panoramas", **one)  # type: ignore[arg-type]
    assert not Path("panoramas").exists()

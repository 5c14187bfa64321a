"""Saved projects opened again, and masks."""

import subprocess
import sysconfig
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import Array
from PIL import Image

import trueup

COMMAND = Path(sysconfig.get_path("scripts")) / "trueup"


def test_a_saved_project_is_composed_as_the_command_composes_it(folder: Path) -> None:
    trueup.stitch("room", crop="none").save("pano.png", project="pano.json")
    alignment = trueup.open_project("pano.json")
    assert [photograph.used for photograph in alignment.photographs] == [True] * 5
    alignment.compose().save("again.png")
    assert Path("again.png").read_bytes() == Path("pano.png").read_bytes()
    alignment.compose(projection="cylindrical", scale=0.5).save("python.png")
    subprocess.run([COMMAND, "compose", "pano.json", "-o", "command.png", "--projection", "cylindrical", "--scale", "0.5"], check=True, capture_output=True)
    assert Path("python.png").read_bytes() == Path("command.png").read_bytes()
    view = trueup.open_project(Path("pano.json"), projection="cylindrical", scale=0.5, threads=1)
    view.compose().save("view.png")
    assert Path("view.png").read_bytes() == Path("command.png").read_bytes()


def test_a_project_finds_its_photographs_elsewhere(folder: Path) -> None:
    trueup.stitch("room").save("pano.png", project="pano.json")
    Path("room").rename("moved")
    with pytest.raises(trueup.InputError, match="not found"):
        trueup.open_project("pano.json")
    trueup.open_project("pano.json", photographs="moved").compose().save("again.png")
    assert Path("again.png").read_bytes() == Path("pano.png").read_bytes()


def test_what_is_no_project_is_refused(folder: Path) -> None:
    with pytest.raises(trueup.IoError):
        trueup.open_project("none.json")
    Path("other.json").write_text("{}")
    with pytest.raises(trueup.InputError, match=r"other\.json"):
        trueup.open_project("other.json")
    trueup.stitch("room").save("pano.png", project="pano.json")
    with pytest.raises(trueup.UnsupportedError):
        trueup.open_project("pano.json", set={"mesh.cell_px": 30})


def test_masks_may_be_arrays(folder: Path, pictures: list[Array]) -> None:
    height, width = pictures[0].shape[:2]
    left = np.zeros((height, width), bool)
    left[:, : width // 2] = True
    Image.fromarray(left).save("left.png")
    eight = left.astype(np.uint8) * 255
    kinds: list[Any] = [left, eight, left.astype(float), Image.fromarray(left), np.dstack([eight] * 3)]
    masks = dict(zip(["1.png", "2.png", "3.png"], kinds, strict=False))
    keep = dict(zip(["0.png", "4.png"], kinds[3:], strict=True))
    from_files = trueup.stitch("room", scale=0.3, masks=dict.fromkeys(masks, "left.png"), keep=dict.fromkeys(keep, "left.png"))
    assert not np.array_equal(from_files.image, trueup.stitch("room", scale=0.3).image)
    from_arrays = trueup.stitch("room", scale=0.3, masks=masks, keep=keep)
    assert np.array_equal(from_arrays.image, from_files.image)
    alignment = trueup.align("room", scale=0.3, masks=masks, keep=keep)
    assert np.array_equal(alignment.compose().image, from_files.image)
    assert alignment.project["images"][1]["masks"] == [{"path": "masks['1.png']", "kind": "use"}]


def test_masks_that_do_not_fit_are_refused(folder: Path) -> None:
    small = np.ones((10, 10), bool)
    with pytest.raises(trueup.InputError, match="the mask has 10 x 10 px"):
        trueup.stitch("room", masks={"1.png": small})
    with pytest.raises(trueup.InputError, match="no photograph of this name"):
        trueup.stitch("room", masks={"none.png": small})
    with pytest.raises(trueup.InputError, match="shape"):
        trueup.stitch("room", masks={"1.png": np.ones(10, np.uint8)})
    with pytest.raises(TypeError, match="masks"):
        trueup.stitch("room", masks={"1.png": 7})  # type: ignore[dict-item]

"""A panorama's files."""

import io
import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import trueup


def test_every_format_is_written(panorama: trueup.Panorama, tmp_path: Path) -> None:
    canvas = panorama.project["canvas"]
    for name in ["a.jpg", "a.png", "a.tif", "a.webp"]:
        length = panorama.save(tmp_path / name)
        assert (tmp_path / name).stat().st_size == length
        assert Image.open(tmp_path / name).size == (canvas["width"], canvas["height"])
    panorama.save(tmp_path / "a.dzi")
    assert (tmp_path / "a_files").is_dir()


def test_options_of_the_file_are_heeded(panorama: trueup.Panorama, tmp_path: Path) -> None:
    small = panorama.save(tmp_path / "small.jpg", quality=30)
    assert small < panorama.save(tmp_path / "large.jpg", set={"output.jpeg_quality": 95})
    panorama.save(tmp_path / "red.png", background="#ff0000")
    assert Image.open(tmp_path / "red.png").mode == "RGB"
    with pytest.raises(trueup.InputError, match="only options of its file"):
        panorama.save(tmp_path / "a.jpg", set={"canvas.scale": 2})
    with pytest.raises(trueup.OptionsError) as refused:
        panorama.save(tmp_path / "a.jpg", set={"output.jpeg_quality": 0})
    assert refused.value.invalid == [("output.jpeg_quality", "0", "1 to 100")]


def test_what_is_wanted_beside_it(panorama: trueup.Panorama, tmp_path: Path) -> None:
    record, layers, seams, cameras = (tmp_path / name for name in ["a.json", "a-layers.tif", "a-seams.png", "a.pto"])
    panorama.save(tmp_path / "a.png", project=record, layers=layers, seams=seams, pto=cameras)
    assert json.loads(record.read_text())["images"] == panorama.project["images"]
    assert all(file.stat().st_size > 0 for file in [layers, seams, cameras])


def test_nothing_is_left_behind_where_it_cannot_be_written(panorama: trueup.Panorama, tmp_path: Path) -> None:
    with pytest.raises(trueup.UnsupportedError) as unsupported:
        panorama.save(tmp_path / "a.gif")
    assert ".png" in unsupported.value.hint
    with pytest.raises(trueup.InputError):
        panorama.save(tmp_path / "none" / "a.png")
    assert list(tmp_path.iterdir()) == []


def test_notebooks_show_it(panorama: trueup.Panorama, tmp_path: Path) -> None:
    (tmp_path / "shown.png").write_bytes(panorama._repr_png_())
    shown = Image.open(tmp_path / "shown.png")
    assert max(shown.size) <= 1000 and shown.mode == "RGB"
    height, width = panorama.image.shape[:2]
    assert abs(shown.width / shown.height - width / height) < 0.02
    text = panorama._repr_html_()
    assert text.startswith("<img alt=") and "5 of 5 used" in text
    assert repr(panorama).endswith("5 of 5 photographs>")


def test_notebooks_show_a_strip(monkeypatch: pytest.MonkeyPatch, panorama: trueup.Panorama) -> None:
    """Lower than what is put together to a pixel."""
    strip = np.full((3, 5000, 3), 200, np.uint8)
    monkeypatch.setattr(trueup.Panorama, "image", strip)
    shown = Image.open(io.BytesIO(panorama._repr_png_()))
    assert shown.size == (1000, 1) and shown.getpixel((0, 0)) == (200, 200, 200)

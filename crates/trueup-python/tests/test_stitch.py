"""Photographs in, a panorama out."""

import subprocess
import sysconfig
from pathlib import Path

import numpy as np
import pytest
from conftest import Array
from PIL import Image

import trueup

COMMAND = Path(sysconfig.get_path("scripts")) / "trueup"


def test_three_lines_make_the_file_that_the_command_makes(room: Path, tmp_path: Path) -> None:
    panorama = trueup.stitch(room)
    panorama.save(tmp_path / "python.jpg")
    subprocess.run([COMMAND, "stitch", room, "-o", tmp_path / "command.jpg"], check=True, capture_output=True)
    assert (tmp_path / "python.jpg").read_bytes() == (tmp_path / "command.jpg").read_bytes()


def test_keywords_are_the_flags_of_the_command(folder: Path) -> None:
    panorama = trueup.stitch("room", projection="cylindrical", yaw=5, crop="rectangle", seed=3, set={"mesh.cell_px": 50})
    panorama.save("python.tif", project="python.json")
    flags = "--projection cylindrical --yaw 5 --crop rectangle --seed 3 --set mesh.cell_px=50".split()
    subprocess.run([COMMAND, "stitch", "room", "-o", "command.tif", *flags], check=True, capture_output=True)
    assert Path("python.tif").read_bytes() == Path("command.tif").read_bytes()
    assert panorama.project["options"]["mesh"]["cell_px"] == 50
    Path("mine.toml").write_text("[mesh]\ncell_px = 50\n[projection]\nkind = 'cylindrical'\nyaw = 1.0\n")
    again = trueup.stitch("room", config="mine.toml", set={"projection.yaw": 5.0}, crop="rectangle", seed=3)
    assert np.array_equal(again.image, panorama.image)


def test_arrays_are_stitched_as_their_files_are(folder: Path, pictures: list[Array]) -> None:
    from_files = trueup.stitch("room")
    # Chance depends on the names of files.
    from_arrays = trueup.stitch({f"{number}.png": picture for number, picture in enumerate(pictures)})
    assert np.array_equal(from_files.image, from_arrays.image)
    assert np.array_equal(from_files.mask, from_arrays.mask)
    assert [photograph.name for photograph in from_arrays.photographs] == [f"{number}.png" for number in range(5)]
    from_files.save("files.png")
    from_arrays.save("arrays.png")
    assert np.array_equal(np.asarray(Image.open("files.png")), np.asarray(Image.open("arrays.png")))
    saved = np.asarray(Image.open("files.png").convert("RGBA"))
    assert np.array_equal(saved[..., :3], from_files.image) and np.array_equal(saved[..., 3], from_files.mask)


def test_image_and_mask_are_whole_arrays(panorama: trueup.Panorama) -> None:
    canvas = panorama.project["canvas"]
    assert panorama.image.shape == (canvas["height"], canvas["width"], 3)
    assert panorama.mask.shape == (canvas["height"], canvas["width"])
    assert panorama.image.dtype == np.uint8 and panorama.mask.dtype == np.uint8
    assert panorama.image.flags.c_contiguous and panorama.image.flags.writeable
    assert panorama.image is panorama.image, "made once"
    assert np.asarray(panorama) is panorama.image
    assert (panorama.mask == 255).all(), "nothing empty is left"


def test_masks_tell_what_no_photograph_shows(pictures: list[Array]) -> None:
    panorama = trueup.stitch(pictures, crop="none")
    assert set(np.unique(panorama.mask)) >= {0, 255}
    assert not panorama.image[panorama.mask == 0].any()


def test_every_kind_of_pixels(pictures: list[Array], panorama: trueup.Panorama) -> None:
    eight = panorama.image.astype(float)
    sixteen = trueup.stitch([picture.astype(np.uint16) * 257 for picture in pictures])
    assert sixteen.image.dtype == np.uint16
    fractions = trueup.stitch([picture.astype(np.float64) / 255 for picture in pictures])
    assert fractions.image.dtype == np.uint16 and np.array_equal(fractions.image, sixteen.image)
    assert np.abs(sixteen.image / 257 - eight).max() < 1
    linear = trueup.stitch(pictures, depth="float")
    assert linear.image.dtype == np.float32
    encoded = np.where(linear.image > 0.0031308, 1.055 * np.maximum(linear.image, 0) ** (1 / 2.4) - 0.055, 12.92 * linear.image)
    assert np.abs(encoded.clip(0, 1) * 255 - eight).max() < 1
    gray = trueup.stitch([np.asarray(Image.fromarray(picture).convert("L")) for picture in pictures])
    assert gray.image.shape[2] == 3 and np.array_equal(gray.image[..., 0], gray.image[..., 2])
    opaque = [np.dstack([picture, np.full(picture.shape[:2], 255, np.uint8)]) for picture in pictures]
    # What lies across a photograph's border is weighed by opacity: a level, here and there.
    assert np.abs(trueup.stitch(opaque).image.astype(float) - eight).max() <= 1


def test_rows_may_lie_anywhere_in_memory(pictures: list[Array], panorama: trueup.Panorama) -> None:
    # As OpenCV has them: blue first. The view of a view is no copy.
    reversed_colors = [np.ascontiguousarray(picture[..., ::-1]) for picture in pictures]
    assert np.array_equal(trueup.stitch([picture[..., ::-1] for picture in reversed_colors]).image, panorama.image)
    assert np.array_equal(trueup.stitch(np.stack(pictures)).image, panorama.image), "a stack is as good as a list"
    big_endian = [(picture.astype(np.uint16) * 257).astype(">u2") for picture in pictures]
    assert trueup.stitch(big_endian).image.dtype == np.uint16


def test_pillow_images_are_upright(pictures: list[Array], panorama: trueup.Panorama, tmp_path: Path) -> None:
    images = [Image.fromarray(picture) for picture in pictures]
    turned = images[1].transpose(Image.Transpose.ROTATE_90)
    exif = Image.Exif()
    exif[0x0112] = 6
    turned.save(tmp_path / "turned.png", exif=exif)
    images[1] = Image.open(tmp_path / "turned.png")
    assert np.array_equal(trueup.stitch(images).image, panorama.image)
    palette = [image.quantize(256) for image in images]
    assert all(photograph.used for photograph in trueup.stitch(palette).photographs)


def test_files_and_arrays_go_together(folder: Path, pictures: list[Array]) -> None:
    panorama = trueup.stitch([Path("room/0.png"), pictures[1], "room/2.png", Image.fromarray(pictures[3])])
    names = [photograph.name for photograph in panorama.photographs]
    assert names == ["0.png", "photographs[1]", "2.png", "photographs[3]"]
    assert all(photograph.used for photograph in panorama.photographs)


def test_what_does_not_fit_is_left_out_with_its_reason(pictures: list[Array]) -> None:
    noise = np.random.default_rng(1).integers(0, 256, pictures[0].shape, np.uint8)
    panorama = trueup.stitch([*pictures, noise, pictures[0]])
    left_out = panorama.photographs[5:]
    assert [photograph.used for photograph in panorama.photographs] == [True] * 5 + [False] * 2
    assert "no overlap" in left_out[0].reason and left_out[0].hint.endswith(".")
    assert "same pixels" in left_out[1].reason
    assert panorama.photographs[0].focal_px is not None and left_out[0].focal_px is None
    assert {finding.code for finding in panorama.report.findings} >= {"no-overlap", "duplicate"}
    assert "5 of 7 used" in str(panorama.report) and "left out" in str(panorama.report)
    assert len(panorama.report.details) > len(str(panorama.report))
    with pytest.raises(trueup.InputError, match="photographs\\[5\\]"):
        trueup.stitch([*pictures, noise], require_all=True)


def test_every_group_makes_a_panorama(pictures: list[Array]) -> None:
    noise = np.random.default_rng(1).integers(0, 256, (600, 800, 3), np.uint8)
    one, other = noise[:, :500], noise[:, 300:]
    panoramas = trueup.stitch_all([one, *pictures, other])
    used = [sum(photograph.used for photograph in panorama.photographs) for panorama in panoramas]
    assert used == [5, 2]


def test_an_alignment_is_composed_later(pictures: list[Array], panorama: trueup.Panorama) -> None:
    alignment = trueup.align(pictures)
    composed = alignment.compose()
    assert composed.project["canvas"] == panorama.project["canvas"]
    assert np.array_equal(composed.image, panorama.image)
    assert np.array_equal(alignment.compose().image, panorama.image), "as often as one likes"


def test_an_alignment_serves_other_photographs(folder: Path, pictures: list[Array]) -> None:
    noise = np.random.default_rng(1).integers(0, 256, pictures[0].shape, np.uint8)
    # What is cut off depends on what the photographs show.
    alignment = trueup.align([*pictures[:2], noise, *pictures[2:]], crop="none")
    own = alignment.compose()
    darker = [picture // 2 for picture in pictures]
    panorama = alignment.compose(darker)
    assert panorama.image.shape == own.image.shape
    assert np.abs(panorama.image[own.mask == 255] * 2.0 - own.image[own.mask == 255]).mean() < 3
    with_the_unused = alignment.compose([*darker[:2], noise, *darker[2:]])
    assert np.array_equal(with_the_unused.image, panorama.image)
    files = [Path("room") / f"{number}.png" for number in range(5)]
    assert np.array_equal(alignment.compose(files).image, own.image)
    with pytest.raises(trueup.InputError, match="4 were given for 5"):
        alignment.compose(darker[:4])
    with pytest.raises(trueup.InputError, match="333 x 300|300 px"):
        alignment.compose([picture[:, :333] for picture in darker])


def test_photographs_stand_in_the_places_that_were_given(folder: Path, pictures: list[Array]) -> None:
    """The record has what cannot be read last."""
    unreadable = folder / "unreadable.png"
    unreadable.write_bytes(b"no picture")
    files = [folder / "room" / f"{number}.png" for number in range(5)]
    alignment = trueup.align([unreadable, *files], crop="none")
    assert [photograph.used for photograph in alignment.photographs] == [True] * 5 + [False]
    own = alignment.compose()
    again = alignment.compose([np.zeros_like(pictures[0]), *pictures])
    assert np.array_equal(again.image, own.image)
    assert np.array_equal(alignment.compose(pictures).image, own.image)


def test_an_alignment_is_drawn_in_other_views(pictures: list[Array]) -> None:
    alignment = trueup.align(pictures)
    sphere = alignment.compose(projection="equirectangular", scale=0.5)
    assert sphere.project["projection"]["kind"] == "equirectangular"
    again = trueup.stitch(pictures, projection="equirectangular", scale=0.5)
    assert np.array_equal(sphere.image, again.image)
    with pytest.raises(trueup.UnsupportedError, match="mesh.cell_px"):
        alignment.compose(set={"mesh.cell_px": 50})
    with pytest.raises(TypeError, match="unexpected keyword argument 'method'"):
        alignment.compose(method="apap")  # type: ignore[call-arg]


def test_threads_change_nothing(pictures: list[Array], panorama: trueup.Panorama) -> None:
    assert np.array_equal(trueup.stitch(pictures, threads=1).image, panorama.image)


def test_masks_ignore_parts(folder: Path, pictures: list[Array]) -> None:
    mask = np.full(pictures[2].shape[:2], 255, np.uint8)
    mask[:, 200:] = 0
    Image.fromarray(mask).save("mask.png")
    masked = trueup.stitch("room", masks={"2.png": "mask.png"})
    assert masked.project["images"][2]["masks"][0]["kind"] == "use"

"""The recipes of docs/python.md do what they say."""

import re
import time
from pathlib import Path

import numpy as np
import pytest
from conftest import Array
from PIL import Image

import trueup

PAGE = (Path(__file__).parents[3] / "docs" / "python.md").read_text()
RECIPES = re.findall(r"^### (.*?)\n.*?```python\n(.*?)```", PAGE, re.MULTILINE | re.DOTALL)


def desk(folder: Path, pictures: list[Array]) -> None:
    """The folders that the recipes speak of."""
    for name, count in [("holiday", 5), ("frames/000", 3), ("frames/001", 3), ("frames/002", 3), ("houses/1", 4), ("houses/2", 3)]:
        (folder / name).mkdir(parents=True)
        for number, picture in enumerate(pictures[:count]):
            Image.fromarray(picture).save(folder / name / f"{number}.jpg", quality=95)
    noise = np.random.default_rng(1).integers(0, 256, pictures[0].shape, np.uint8)
    Image.fromarray(noise).save(folder / "houses" / "2" / "noise.jpg")


def test_there_are_recipes() -> None:
    assert len(RECIPES) >= 10
    assert len(RECIPES) == PAGE.count("\n### ")


@pytest.mark.parametrize(("title", "recipe"), RECIPES, ids=[title for title, _ in RECIPES])
def test_recipe(title: str, recipe: str, tmp_path: Path, pictures: list[Array], monkeypatch: pytest.MonkeyPatch) -> None:
    desk(tmp_path, pictures)
    monkeypatch.chdir(tmp_path)
    blue_first = [np.ascontiguousarray(picture[..., ::-1]) for picture in pictures]
    before = set(tmp_path.rglob("*"))
    names = {"trueup": trueup, "np": np, "Path": Path, "Image": Image, "time": time, "images": blue_first}
    exec(compile(recipe, title, "exec"), names)
    written = {file.name for file in set(tmp_path.rglob("*")) - before}
    # Every file that the recipe names was written.
    for name in re.findall(r'save\("([^"]+)"', recipe):
        assert name in written
    if "picture =" in recipe:
        assert isinstance(names["picture"], np.ndarray) and names["picture"].shape[2] == 3


def test_the_first_lines_are_those_of_the_readme() -> None:
    lines = re.search(r"```python\n(.*?)```", PAGE, re.DOTALL)
    assert lines is not None
    for readme in [Path(__file__).parents[3] / "README.md", Path(__file__).parents[1] / "README.md"]:
        assert lines[1] in readme.read_text()

"""Photographs for the tests."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image

import trueup

ROOM = Path(__file__).parents[3] / "examples" / "room"
"""Five photographs, 1200 x 900."""

REDUCTION = 3
"""The tests that need no full photographs take them smaller by this factor."""

Array = npt.NDArray[Any]
ArrayMaker = Callable[[], list[Array]]


@pytest.fixture(scope="session")
def room() -> Path:
    """The folder of photographs."""
    return ROOM


@pytest.fixture(scope="session")
def pictures() -> list[Array]:
    """The photographs of the room, small, as arrays."""
    return [np.asarray(Image.open(file).reduce(REDUCTION)) for file in sorted(ROOM.glob("*.jpg"))]


@pytest.fixture(scope="session")
def panorama(pictures: list[Array]) -> trueup.Panorama:
    """The room, small."""
    return trueup.stitch(pictures)


@pytest.fixture
def folder(tmp_path: Path, pictures: list[Array], monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty desk with the small photographs in the folder room, without loss."""
    (tmp_path / "room").mkdir()
    for number, picture in enumerate(pictures):
        Image.fromarray(picture).save(tmp_path / "room" / f"{number}.png")
    monkeypatch.chdir(tmp_path)
    return tmp_path

"""Photographs as people have them: files, arrays, Pillow images."""

import os
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias, runtime_checkable

from trueup._errors import InputError

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt


@runtime_checkable
class SupportsArray(Protocol):
    """What makes an array of itself: arrays, tensors."""

    def __array__(self) -> Any:
        """The array."""


@runtime_checkable
class SupportsArrayInterface(Protocol):
    """What shows its memory to NumPy: arrays, Pillow images."""

    @property
    def __array_interface__(self) -> Any:
        """Where the memory is."""


Picture: TypeAlias = str | os.PathLike[str] | SupportsArray | SupportsArrayInterface
"""A file, folder or pattern; or pixels: height x width (gray), x 3 (RGB) or x 4 (RGBA), uint8, uint16, or floating point
numbers from 0 to 1, encoded as in sRGB."""

Photographs: TypeAlias = Picture | Iterable[Picture] | Mapping[str, Picture]
"""One or several; a mapping gives arrays their names, which are else ``photographs[0]`` and so on."""


def native(photographs: Photographs) -> list[str | tuple[str, Any]]:
    """Photographs as the native part takes them: names of files, and named arrays."""
    if isinstance(photographs, Mapping):
        return [_named(str(name), picture) for name, picture in photographs.items()]
    if isinstance(photographs, (str, os.PathLike)):
        return [os.fspath(photographs)]
    if isinstance(photographs, (SupportsArray, SupportsArrayInterface)) and not _is_stack(photographs):
        raise InputError(
            "photographs: it is one picture. Give a list of overlapping ones.",
            subject="photographs",
            reason="it is one picture",
            hint="Give a list of overlapping ones.",
        )
    if not isinstance(photographs, Iterable):
        raise TypeError(f"photographs are paths or arrays, not {type(photographs).__name__}")
    return [_named(f"photographs[{number}]", picture) for number, picture in enumerate(photographs)]


def native_masks(masks: Mapping[str, Picture], argument: str) -> dict[str, str | tuple[str, Any]]:
    """Masks as the native part takes them, by the photographs' names."""
    return {name: _named(f"{argument}[{name!r}]", mask) for name, mask in masks.items()}


def _is_stack(pictures: object) -> bool:
    """Whether an array is one of pictures: photographs x height x width x colors."""
    return getattr(pictures, "ndim", 0) == 4


def _named(name: str, picture: Picture) -> str | tuple[str, Any]:
    if isinstance(picture, (str, os.PathLike)):
        return os.fspath(picture)
    if not isinstance(picture, (SupportsArray, SupportsArrayInterface)):
        raise TypeError(f"{name} is neither a path nor an array, but {type(picture).__name__}")
    return name, _array(_upright(picture))


def _upright(picture: Any) -> Any:
    """A Pillow image as it is meant to be shown, in gray, RGB or RGBA; anything else as it is."""
    if not (hasattr(picture, "getexif") and hasattr(picture, "convert")):
        return picture
    from PIL import ImageOps

    picture = ImageOps.exif_transpose(picture)
    if picture.mode.startswith("I;16"):
        return picture
    if picture.mode in ("L", "RGB", "RGBA"):
        return picture
    has_opacity = picture.mode in ("LA", "PA", "La", "RGBa") or "transparency" in picture.info
    return picture.convert("RGBA" if has_opacity else "L" if picture.mode == "1" else "RGB")


def _array(picture: Any) -> "npt.NDArray[np.uint8 | np.uint16 | np.float32]":
    """Samples in a type that is taken, rows from top to bottom, colors interleaved."""
    import numpy as np

    array = np.asarray(picture)
    if array.dtype.kind == "b":
        # A mask.
        array = array.astype(np.uint8) * 255
    elif array.dtype.kind == "f":
        array = array.astype(np.float32, copy=False)
    elif array.dtype.kind == "u" and array.dtype.itemsize == 2:
        # Whatever the order of its bytes.
        array = array.astype(np.uint16, copy=False)
    if array.ndim == 2:
        array = array[:, :, np.newaxis]
    return np.ascontiguousarray(array)

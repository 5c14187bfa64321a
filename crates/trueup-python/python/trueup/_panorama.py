"""A panorama: pixels, record, files, and how notebooks show it."""

import base64
import html
import os
from functools import cached_property
from typing import TYPE_CHECKING, Any, Unpack

from trueup import _trueup
from trueup._keywords import SaveKeywords
from trueup._progress import Heard, Progress
from trueup._record import Recorded

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

_SHOWN_SIDE_PX = 1000
"""Longer side of the pictures that notebooks show: as wide as their columns are."""


class Panorama(Recorded[_trueup.Panorama]):
    """A panorama. Made by :func:`trueup.stitch` or :meth:`trueup.Alignment.compose`."""

    @cached_property
    def _pixels(self) -> "tuple[npt.NDArray[Any], npt.NDArray[np.uint8]]":
        return self._native.pixels()

    @property
    def image(self) -> "npt.NDArray[Any]":
        """Colors, height x width x 3 (RGB), 0 where no photograph is: ``uint8``, or ``uint16`` where photographs have more than
        8 bits, encoded in the color space that ``project["color_space"]`` names; with ``depth="float"``, ``float32`` of linear
        light, 1 for white.

        Made when it is first asked for, and the same array from then on; nothing is copied on the way to NumPy.
        """
        return self._pixels[0]

    @property
    def mask(self) -> "npt.NDArray[np.uint8]":
        """Opacity, height x width: 255 where photographs are, 0 where none is."""
        return self._pixels[1]

    def save(
        self,
        path: str | os.PathLike[str],
        *,
        project: str | os.PathLike[str] | None = None,
        pto: str | os.PathLike[str] | None = None,
        layers: str | os.PathLike[str] | None = None,
        seams: str | os.PathLike[str] | None = None,
        thumbnail: str | os.PathLike[str] | None = None,
        progress: Progress = None,
        **keywords: Unpack[SaveKeywords],
    ) -> int:
        """Writes the panorama in the format that the extension names (JPEG, PNG, TIFF, WebP, OpenEXR, Radiance, Deep Zoom) and returns the
        file's length in bytes. With the photographs' files at hand, the file is the very one that the command writes.

        ``project`` is a file for the record (JSON), ``pto`` one for the Hugin stitcher, ``layers`` for the aligned photographs
        (TIFF), ``seams`` for which photograph is shown where (PNG), ``thumbnail`` for a small copy. Keywords set options of the file, such as ``quality``.

        Raises :class:`trueup.InputError`, :class:`trueup.UnsupportedError`, :class:`trueup.LimitsError`,
        :class:`trueup.OptionsError` or :class:`trueup.IoError`; a file appears whole or not at all.
        """
        wanted = {"project": project, "pto": pto, "layers": layers, "seams": seams, "thumbnail": thumbnail}
        beside = {flag: os.fspath(file) for flag, file in wanted.items() if file is not None}
        with Heard(progress) as heard:
            return self._native.save(os.fspath(path), beside, dict(keywords), heard)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> "npt.NDArray[Any]":
        """:attr:`image`, for what takes arrays: ``PIL.Image.fromarray(np.asarray(panorama))``."""
        import numpy as np

        image = self.image
        if dtype is not None and np.dtype(dtype) != image.dtype:
            if copy is False:
                raise ValueError(f"{image.dtype} cannot become {np.dtype(dtype)} without a copy")
            return image.astype(dtype)
        return image.copy() if copy else image

    def __repr__(self) -> str:
        canvas = self.project["canvas"]
        photographs = self.photographs
        used = sum(photograph.used for photograph in photographs)
        return f"<trueup.Panorama {canvas['width']} x {canvas['height']} px, {used} of {len(photographs)} photographs>"

    def _repr_png_(self) -> bytes:
        """A small copy, as notebooks show it."""
        import numpy as np

        image = self.image
        if image.dtype == np.uint16:
            image = image >> 8
        elif image.dtype == np.float32:
            # The curve of sRGB, near enough for a look.
            image = np.clip(image, 0, 1) ** (1 / 2.2) * 255
        step = -(-max(image.shape) // _SHOWN_SIDE_PX)
        # Of a strip that is lower than a step, all of its height is one row.
        down, across = (min(step, side) for side in image.shape[:2])
        height, width = image.shape[0] // down, image.shape[1] // across
        block = image[: height * down, : width * across]
        if step > 1:
            block = block.reshape(height, down, width, across, 3).mean(axis=(1, 3))
        return _trueup.png(np.ascontiguousarray(np.rint(block), dtype=np.uint8))

    def _repr_html_(self) -> str:
        """A small copy with the summary, and the photographs that were left out."""
        source = base64.b64encode(self._repr_png_()).decode()
        text = html.escape(str(self.report))
        shown = html.escape(repr(self))
        return f'<img alt="{shown}" style="max-width: 100%" src="data:image/png;base64,{source}"><pre>{text}</pre>'

"""From photographs to panoramas."""

import os
from typing import Any, Unpack

from trueup import _trueup
from trueup._keywords import ComposeKeywords, StitchKeywords
from trueup._panorama import Panorama
from trueup._photographs import Photographs, native, native_masks
from trueup._progress import Heard, Progress
from trueup._record import Recorded
from trueup._workers import Workers


class Alignment(Recorded[_trueup.Alignment]):
    """The geometry of a panorama: cameras, vanishing points, deformed grids, canvas. Made by :func:`trueup.align`."""

    def __init__(self, native: _trueup.Alignment, given: list[str] | None = None) -> None:
        super().__init__(native)
        self._given = given
        """What the photographs were given as, in that order; ``None`` where a project tells of them."""

    def compose(
        self,
        photographs: Photographs | None = None,
        *,
        progress: Progress = None,
        workers: Workers | None = None,
        **keywords: Unpack[ComposeKeywords],
    ) -> Panorama:
        """The panorama of the photographs that were aligned, or of others in their places: one alignment serves every moment of
        a rig or a video.

        ``photographs`` are of the same sizes. They are as many as were used, in the order of :attr:`photographs`; or as many as were given to
        :func:`trueup.align`, in that order; or, of a folder or a project file, as many as :attr:`photographs`, in their order. What stands for
        photographs that were left out, and for the other exposures of brackets, is passed over. Keywords set options
        of the view, the canvas, the light and the file: ``projection``, ``crop``, ``scale`` and so on; those of the geometry are
        refused. With ``workers``, other programs make the photographs small and finish the canvas, region by region.

        Raises :class:`trueup.InputError` for photographs that do not fit, :class:`trueup.UnsupportedError` for options of the
        geometry, :class:`trueup.LimitsError` if the panorama is too large for the memory or the disk,
        :class:`trueup.OptionsError`, :class:`trueup.IoError`.
        """
        shown = None if photographs is None else self._of_those_used(native(photographs))
        with Heard(progress) as heard:
            return Panorama(self._native.compose(shown, dict(keywords), heard, workers))

    def _of_those_used(self, shown: list[str | tuple[str, Any]]) -> list[str | tuple[str, Any]]:
        """Of as many photographs as were given, those in the places of the used ones."""
        recorded = [photograph.path for photograph in self.photographs]
        used = [photograph.path for photograph in self.photographs if photograph.used]
        # Photographs that cannot be read stand behind all others in the record, wherever they were given.
        for places in (self._given, recorded):
            if places is not None and len(shown) == len(places) != len(used) and set(used) <= set(places):
                return [shown[places.index(path)] for path in used]
        return shown

    def __repr__(self) -> str:
        canvas = self.project["canvas"]
        used = sum(photograph.used for photograph in self.photographs)
        return f"<trueup.Alignment of {used} photographs on {canvas['width']} x {canvas['height']} px>"


def stitch(
    photographs: Photographs,
    *,
    progress: Progress = None,
    workers: Workers | None = None,
    **keywords: Unpack[StitchKeywords],
) -> Panorama:
    """The panorama of the largest group of photographs that overlap.

    ``photographs`` is a folder, a file pattern, or a list of files, arrays (height x width x 3, RGB; ``uint8``, ``uint16``, or
    floating point from 0 to 1) and Pillow images, or a mapping of names to these. Files tell more than arrays: focal length, color
    profile, time and place.

    Keywords are the command's flags: ``method``, ``projection``, ``crop``, ``scale`` and so on; ``set={"table.option": value}`` sets
    any option that :func:`trueup.options` lists; ``masks`` and ``keep`` are files or arrays by the names of photographs. ``progress`` is ``True`` for bars, or a callback that is called with a stage's
    name, the steps done and how many there are. Ctrl-C stops the work. ``workers`` do most of it in other programs or on other machines:
    :func:`trueup.ray.workers`.

    Photographs that do not fit are left out, with a reason in :attr:`Panorama.photographs`. Raises :class:`trueup.InputError` if none
    can be used, :class:`trueup.UnsolvableError` if no two overlap, :class:`trueup.OptionsError`,
    :class:`trueup.NotApplicableError`, :class:`trueup.LimitsError`.
    """
    with Heard(progress) as heard:
        [alignment] = _trueup.align(native(photographs), _native_keywords(keywords), False, heard, workers)
        return Panorama(alignment.compose(None, {}, heard, workers))


def stitch_all(
    photographs: Photographs,
    *,
    progress: Progress = None,
    workers: Workers | None = None,
    **keywords: Unpack[StitchKeywords],
) -> list[Panorama]:
    """A panorama of every group of photographs that overlap, the largest group first. Otherwise as :func:`stitch`."""
    with Heard(progress) as heard:
        alignments = _trueup.align(native(photographs), _native_keywords(keywords), True, heard, workers)
        return [Panorama(alignment.compose(None, {}, heard, workers)) for alignment in alignments]


def align(
    photographs: Photographs,
    *,
    progress: Progress = None,
    workers: Workers | None = None,
    **keywords: Unpack[StitchKeywords],
) -> Alignment:
    """The geometry of the panorama that :func:`stitch` makes with the same arguments, ready to be composed.

    Raises what :func:`stitch` raises.
    """
    given = native(photographs)
    with Heard(progress) as heard:
        [alignment] = _trueup.align(given, _native_keywords(keywords), False, heard, workers)
        return Alignment(alignment, _names(given))


def align_all(
    photographs: Photographs,
    *,
    progress: Progress = None,
    workers: Workers | None = None,
    **keywords: Unpack[StitchKeywords],
) -> list[Alignment]:
    """The geometry of every group of photographs that overlap, the largest group first. Otherwise as :func:`align`."""
    given = native(photographs)
    with Heard(progress) as heard:
        alignments = _trueup.align(given, _native_keywords(keywords), True, heard, workers)
        return [Alignment(one, _names(given)) for one in alignments]


def open_project(
    path: str | os.PathLike[str],
    *,
    photographs: str | os.PathLike[str] | None = None,
    relight: bool = False,
    progress: Progress = None,
    **keywords: Unpack[ComposeKeywords],
) -> Alignment:
    """The geometry that a project file records, ready to be composed: nothing is measured, matched or aligned again.

    Composed without keywords, it is the very panorama that was stitched. Photographs and masks are looked for where the project says,
    from its folder and from the current one, and beside it by their names; ``photographs`` is a folder of others of the same names and
    sizes to be shown instead; with ``relight`` their light is evened out anew, as another shot of a rig wants it. A project of Hugin's
    (``.pto``) is drawn by its cameras. Keywords are those of :meth:`Alignment.compose`, for all that is composed of it.

    Raises :class:`trueup.InputError` if it is no project, or photographs or masks are missing or have other sizes;
    :class:`trueup.UnsupportedError` for options of the geometry; :class:`trueup.OptionsError`, :class:`trueup.IoError`.
    """
    folder = None if photographs is None else os.fspath(photographs)
    with Heard(progress) as heard:
        return Alignment(_trueup.open_project(os.fspath(path), folder, relight, dict(keywords), heard))


def _names(given: list[str | tuple[str, Any]]) -> list[str]:
    """What a record calls photographs by that were given so."""
    return [one if isinstance(one, str) else one[0] for one in given]


def _native_keywords(keywords: StitchKeywords) -> dict[str, Any]:
    """Keywords as the native part takes them: masks that are arrays have names."""
    taken: dict[str, Any] = dict(keywords)
    for argument in ("masks", "keep"):
        if taken.get(argument) is not None:
            taken[argument] = native_masks(taken[argument], argument)
    return taken

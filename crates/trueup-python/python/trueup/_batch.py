"""Trees of folders."""

import json
import os
from collections.abc import Callable
from typing import Any, TypeAlias, Unpack

from trueup import _trueup
from trueup._keywords import BatchKeywords
from trueup._progress import Heard, Progress

BatchLine: TypeAlias = dict[str, Any]
"""What became of a panorama, or why a set made none: a line of ``batch.jsonl``, as docs/batch.md describes it."""


def batch(
    folder: str | os.PathLike[str],
    output: str | os.PathLike[str],
    *,
    format: str | None = None,
    gap: float | None = None,
    shard: tuple[int, int] | None = None,
    retry: bool = False,
    jobs: int = 1,
    told: Callable[[BatchLine], object] | None = None,
    progress: Progress = None,
    **keywords: Unpack[BatchKeywords],
) -> list[BatchLine]:
    """Stitches the photographs of every folder in a tree as ``trueup batch`` does, and writes what that writes into ``output``.

    Called again, it goes on where it was stopped or killed; several may run at once, here and on other machines. ``format`` is the
    extension of the panoramas, ``gap`` the seconds without a photograph at which a folder is parted (``math.inf`` parts nothing), ``shard`` the
    part of how many that is stitched here (``(2, 4)``), ``retry`` tries sets again that made none, ``jobs`` is how many are worked at at
    once. ``told`` is called in the calling thread with the lines of each set when it is done; an exception in it stops the batch, and
    so does Ctrl-C: what is made stays. Keywords are those of :func:`trueup.stitch` that set options, and ``threads``.

    Returns the lines of all sets of this part, those that were done before included. A set that makes no panorama is a line with the
    status ``failed``, and stops nothing.

    Raises :class:`trueup.InputError` if ``folder`` holds no photographs or is ``output``, :class:`trueup.OptionsError`,
    :class:`trueup.UnsupportedError`, :class:`trueup.IoError`.
    """
    wishes = _wishes(folder, output, format, gap, shard, retry, jobs)
    heard_lines = None if told is None else _teller(told)
    with Heard(progress) as heard:
        return _lines(_trueup.batch(wishes, dict(keywords), heard_lines, heard))


def batch_plan(
    folder: str | os.PathLike[str],
    output: str | os.PathLike[str],
    *,
    gap: float | None = None,
    shard: tuple[int, int] | None = None,
) -> list[BatchLine]:
    """The sets that :func:`batch` would stitch with the same arguments: ``set``, its name, and ``photographs``, their paths.

    Raises what :func:`batch` raises for ``folder`` and ``output``.
    """
    return _lines(_trueup.plan(_wishes(folder, output, None, gap, shard, False, 1)))


def _wishes(
    folder: str | os.PathLike[str],
    output: str | os.PathLike[str],
    format: str | None,
    gap: float | None,
    shard: tuple[int, int] | None,
    retry: bool,
    jobs: int,
) -> dict[str, Any]:
    """What is wished, as the native part takes it."""
    return {
        "folder": os.fspath(folder),
        "output": os.fspath(output),
        "format": format,
        "gap": gap,
        "shard": shard,
        "retry": retry,
        "jobs": jobs,
    }


def _lines(text: str) -> list[BatchLine]:
    return [json.loads(line) for line in text.splitlines()]


def _teller(told: Callable[[BatchLine], object]) -> Callable[[str], None]:
    def tell(text: str) -> None:
        for line in _lines(text):
            told(line)

    return tell

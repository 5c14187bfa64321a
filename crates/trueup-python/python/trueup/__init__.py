"""Photographs in, an upright panorama out, with numbers and reasons for what was done.

>>> panorama = trueup.stitch("holiday/")
>>> panorama.save("holiday.jpg")
"""

from trueup._alignment import Alignment, align, align_all, open_project, stitch, stitch_all
from trueup._batch import BatchLine, batch, batch_plan
from trueup._errors import (
    Error,
    InputError,
    IoError,
    LimitsError,
    NotApplicableError,
    OptionsError,
    UnsolvableError,
    UnsupportedError,
)
from trueup._options import Option, options
from trueup._panorama import Panorama
from trueup._record import Finding, Photograph, Report
from trueup._trueup import version as _version
from trueup._workers import Workers, do_task

__version__ = _version()

__all__ = [
    "Alignment",
    "BatchLine",
    "Error",
    "Finding",
    "InputError",
    "IoError",
    "LimitsError",
    "NotApplicableError",
    "Option",
    "OptionsError",
    "Panorama",
    "Photograph",
    "Report",
    "UnsolvableError",
    "UnsupportedError",
    "Workers",
    "align",
    "align_all",
    "batch",
    "batch_plan",
    "do_task",
    "open_project",
    "options",
    "stitch",
    "stitch_all",
]

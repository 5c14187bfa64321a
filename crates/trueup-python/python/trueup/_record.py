"""What a project records, in classes for what people ask most."""

import json
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Generic, TypeVar

from trueup import _trueup

Native = TypeVar("Native", _trueup.Alignment, _trueup.Panorama)


@dataclass(frozen=True)
class Photograph:
    """What became of a photograph."""

    name: str
    """As messages call it: the file's name, with as much of its folder as tells it from the others."""
    path: str
    """The file as it was given, or the name of an array."""
    used: bool
    """Whether it is in the panorama."""
    reason: str
    """Why it was left out; empty if it is used."""
    hint: str
    """What to do about it; empty if it is used."""
    width: int
    """In pixels, as it is shown; 0 if it could not be read."""
    height: int
    """In pixels, as it is shown; 0 if it could not be read."""
    focal_px: float | None
    """Focal length in pixels of the photograph; ``None`` if it was left out."""
    rotation: list[list[float]] | None
    """Rows of the rotation from the levelled world (y down) to the camera; ``None`` if it was left out."""

    def __str__(self) -> str:
        return f"{self.name}: used" if self.used else f"{self.name}: left out: {self.reason}. {self.hint}"


@dataclass(frozen=True)
class Finding:
    """Something that was found on the way."""

    code: str
    """A stable name of its kind, as in docs/project-file.md."""
    severity: str
    """``note``, or ``warning`` where the panorama is worse for it."""
    subject: dict[str, Any]
    """What it is about: ``photograph`` or ``pair`` with positions among the photographs, ``stage`` or ``file`` with its name."""
    message: str
    """What was found, with numbers."""
    hint: str
    """What to do about it; empty where there is nothing to do."""


class Report:
    """How a panorama was made, and how good it is. Printed, it is the summary that the command prints."""

    def __init__(self, project: dict[str, Any], summary: str, details: str) -> None:
        self._summary = summary
        self.details = details
        """The summary with every pair, photograph, note and stage."""
        self.findings = [
            Finding(one["code"], one["severity"], one["subject"], one["message"], one["hint"])
            for one in project["diagnostics"]
        ]
        """Notes and warnings."""
        self.measures: dict[str, Any] | None = project.get("measures")
        """How upright, straight and well aligned it is by its own lines and matches, as in docs/project-file.md; ``None`` for a
        single photograph."""
        self.seconds: dict[str, float] = project["seconds"]
        """Wall seconds by stage."""

    def __str__(self) -> str:
        return self._summary

    def __repr__(self) -> str:
        return f"<trueup.Report\n{self._summary}>"


class Recorded(Generic[Native]):
    """What has a record of how it was made."""

    def __init__(self, native: Native) -> None:
        self._native: Native = native

    @cached_property
    def project(self) -> dict[str, Any]:
        """The record of everything that was decided so far, as docs/project-file.md describes it."""
        project: dict[str, Any] = json.loads(self._native.project_json())
        return project

    @property
    def photographs(self) -> list[Photograph]:
        """What became of every photograph: those that can be read, in the order given, then those that cannot. Exposures of one bracket are
        one photograph."""
        return [
            Photograph(
                name=name,
                path=image["path"],
                used=image["status"] == "used",
                reason=image["reason"],
                hint=image["hint"],
                width=image["width"],
                height=image["height"],
                focal_px=image["focal_px"],
                rotation=image["rotation"],
            )
            for name, image in zip(self._native.photograph_names(), self.project["images"], strict=True)
        ]

    @property
    def report(self) -> Report:
        """How it was made, and how good it is; printed, it is a summary."""
        return Report(self.project, self._native.summary(False), self._native.summary(True))

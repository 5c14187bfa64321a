"""The native part."""

from collections.abc import Callable, Iterable
from typing import Any, final

import numpy as np
import numpy.typing as npt

__all__ = [
    "Alignment",
    "Panorama",
    "Worker",
    "align",
    "batch",
    "command",
    "open_project",
    "option_flags",
    "options",
    "plan",
    "png",
    "version",
]

def align(
    photographs: list[str | tuple[str, Any]],
    keywords: dict[str, Any],
    all: bool,
    progress: Callable[[str, int, int], object] | None,
    workers: Callable[[bytes, list[bytes]], Iterable[tuple[int, bytes]]] | None,
) -> list[Alignment]: ...
def batch(
    wishes: dict[str, Any],
    keywords: dict[str, Any],
    told: Callable[[str], object] | None,
    progress: Callable[[str, int, int], object] | None,
) -> str: ...
def command(arguments: list[str]) -> int: ...
def open_project(
    path: str,
    photographs: str | None,
    relight: bool,
    keywords: dict[str, Any],
    progress: Callable[[str, int, int], object] | None,
) -> Alignment: ...
def option_flags() -> list[tuple[str, str, list[str]]]: ...
def options() -> tuple[str, str]: ...
def plan(wishes: dict[str, Any]) -> str: ...
def png(picture: npt.NDArray[np.uint8]) -> bytes: ...
def version() -> str: ...
@final
class Alignment:
    def compose(
        self,
        photographs: list[str | tuple[str, Any]] | None,
        keywords: dict[str, Any],
        progress: Callable[[str, int, int], object] | None,
        workers: Callable[[bytes, list[bytes]], Iterable[tuple[int, bytes]]] | None,
    ) -> Panorama: ...
    def photograph_names(self) -> list[str]: ...
    def project_json(self) -> str: ...
    def summary(self, verbose: bool) -> str: ...

@final
class Panorama:
    def photograph_names(self) -> list[str]: ...
    def pixels(self) -> tuple[npt.NDArray[Any], npt.NDArray[np.uint8]]: ...
    def project_json(self) -> str: ...
    def save(
        self,
        path: str,
        beside: dict[str, str],
        keywords: dict[str, Any],
        progress: Callable[[str, int, int], object] | None,
    ) -> int: ...
    def summary(self, verbose: bool) -> str: ...

@final
class Worker:
    def __new__(cls, common: bytes, threads: int) -> Worker: ...
    def run(self, task: bytes) -> bytes: ...

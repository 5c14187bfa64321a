"""Who hears of progress."""

from collections.abc import Callable
from typing import Any, TypeAlias

ProgressCallback: TypeAlias = Callable[[str, int, int], object]
"""Called in the calling thread with a stage's name, the steps done, and how many there are. An exception stops the work."""

Progress: TypeAlias = ProgressCallback | bool | None
"""A callback; ``True`` for bars by tqdm; ``None`` or ``False`` for silence."""


class Heard:
    """The callback for the time of the work; closes what it opened."""

    def __init__(self, progress: Progress) -> None:
        self._bars = Bars() if progress is True else None
        self._callback = self._bars or (progress if callable(progress) else None)

    def __enter__(self) -> ProgressCallback | None:
        return self._callback

    def __exit__(self, *_: object) -> None:
        if self._bars is not None:
            self._bars.close()


class Bars:
    """A tqdm bar for every stage."""

    def __init__(self) -> None:
        try:
            from tqdm.auto import tqdm
        except ModuleNotFoundError as error:
            raise ModuleNotFoundError("progress=True draws bars by tqdm: pip install tqdm, or give a callback") from error
        self._tqdm = tqdm
        self._bars: dict[str, Any] = {}

    def __call__(self, stage: str, done: int, total: int) -> None:
        bar = self._bars.get(stage)
        if bar is None:
            bar = self._bars[stage] = self._tqdm(total=total, desc=stage, leave=False)
        bar.total = total
        bar.update(done - bar.n)

    def close(self) -> None:
        """Takes the bars away."""
        for bar in self._bars.values():
            bar.close()

"""The reference of the options."""

import json
from dataclasses import dataclass
from typing import Any

from trueup import _trueup


@dataclass(frozen=True)
class Option:
    """An option, as it is declared."""

    name: str
    """``table.option``, as in ``set={"table.option": value}``."""
    keyword: str | None
    """The keyword argument that sets it, if it has one."""
    default: Any
    """The value without a wish."""
    allowed: str
    """The allowed values, in words."""
    unit: str
    """Empty for pure numbers and choices."""
    meaning: str
    """What it means and when to change it."""
    tier: str
    """``basic`` for everyone who makes panoramas, or ``expert``."""
    choices: dict[str, str]
    """The alternatives of a choice with their meanings; empty for other options."""


def options() -> list[Option]:
    """Every option, in the order of the work."""
    described, defaults = map(json.loads, _trueup.options())
    keywords = {option: keyword for keyword, option, _ in _trueup.option_flags()}

    def option(row: dict[str, Any]) -> Option:
        table, field = row["name"].split(".")
        return Option(
            name=row["name"],
            keyword=keywords.get(row["name"]),
            default=defaults[table][field],
            allowed=row["allowed"],
            unit=row["unit"],
            meaning=row["meaning"],
            tier=row["tier"],
            choices={choice["name"]: choice["meaning"] for choice in row["choices"]},
        )

    return [option(row) for row in described]

"""Prints python/trueup/_keywords.py: the keyword arguments, from the declarations of the options.

    python generate_keywords.py > python/trueup/_keywords.py

A test compares the file with what this prints.
"""

import textwrap

import trueup
from trueup import _trueup

HEAD = '''"""Keyword arguments, typed. Made by generate_keywords.py from the declarations of the options: change those."""

import os
from collections.abc import Mapping
from typing import Literal, TypeAlias, TypedDict

from trueup._photographs import Picture

Path: TypeAlias = str | os.PathLike[str]
Value: TypeAlias = bool | int | float | str | os.PathLike[str]
'''

SHARED = [
    ("set", "Mapping[str, Value]", "Any options by their names, table.option."),
    ("config", "Path", "A TOML file with options, which set and keywords overrule."),
]
COMPOSING = [
    ("threads", "int", "Number of threads; 0 for one per core. The panorama is the same for any number."),
]
STITCHING = [
    ("masks", "Mapping[str, Picture]", "Files or arrays by the names of photographs: what is black or transparent in them is ignored."),
    ("keep", "Mapping[str, Picture]", "Files or arrays by the names of photographs: what is white in them is shown."),
    ("reference", "str", "The photograph that sets the pixel scale and stays in place; auto takes the one in the middle."),
    ("graph", "Path", "A text file with the pairs to be matched, NAME -- NAME a line."),
    ("lens_from", "Path", "The project of other photographs through the same lens, which is taken from there."),
    ("require_all", "bool", "Fails unless every photograph is used."),
    ("cache", "Path", "A folder for what is found in the photographs, for later runs."),
]


def annotation(option: trueup.Option) -> str:
    """The type of an option's values."""
    # Some choices stand for many, as #rgb does.
    if option.choices and not any(choice.startswith("#") for choice in option.choices):
        return f"Literal[{', '.join(repr(choice).replace(chr(39), chr(34)) for choice in option.choices)}]"
    match option.default:
        case bool():
            return "bool"
        case int():
            return "int"
        case float():
            return "float"
        case _:
            return "str"


def field(name: str, kind: str, meaning: str) -> str:
    """A key of a dictionary with its meaning."""
    meaning = meaning.replace("\\", "\\\\")
    text = textwrap.fill(f'"""{meaning}"""', 120, initial_indent="    ", subsequent_indent="    ")
    line = f"    {name}: {kind}"
    if len(line) > 120:
        values = kind.removeprefix("Literal[").removesuffix("]").split(", ")
        line = f"    {name}: Literal[\n" + "".join(f"        {value},\n" for value in values) + "    ]"
    return f"{line}\n{text}\n"


def options_of(subcommand: str) -> list[tuple[str, str, str]]:
    """The keywords that set options, of the functions of a subcommand."""
    known = {option.name: option for option in trueup.options()}
    rows = []
    for keyword, name, subcommands in _trueup.option_flags():
        if subcommand in subcommands:
            option = known[name]
            default = f" (default {option.default})" if option.default not in ("", None) else ""
            rows.append((keyword, annotation(option), f"{option.meaning.rstrip('.')}{default}."))
    return rows


def dictionary(name: str, base: str, meaning: str, fields: list[tuple[str, str, str]]) -> str:
    """A class of keywords, none of which must be given."""
    return f'\n\nclass {name}({base}, total=False):\n    """{meaning}"""\n\n' + "".join(field(*row) for row in fields)


def module() -> str:
    """The text of the file."""
    compose, stitch = options_of("compose"), options_of("stitch")
    tables = {keyword: name.split(".")[0] for keyword, name, _ in _trueup.option_flags()}
    save = [row for row in compose if tables[row[0]] == "output"]
    composing = [row for row in compose if row not in save]
    stitching = [row for row in stitch if row not in compose]
    batch = [row for row in options_of("batch") if row not in save]
    return (
        HEAD
        + dictionary("SaveKeywords", "TypedDict", "Keywords of a panorama's file.", save + SHARED)
        + dictionary("ComposeKeywords", "SaveKeywords", "Keywords of composing.", composing + COMPOSING)
        + dictionary("StitchKeywords", "ComposeKeywords", "Keywords of stitching.", stitching + STITCHING)
        + dictionary("BatchKeywords", "SaveKeywords", "Keywords of a batch.", batch + COMPOSING)
    )


if __name__ == "__main__":
    print(module(), end="")

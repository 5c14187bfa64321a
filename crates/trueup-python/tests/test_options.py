"""The reference of the options, and the command that comes with the package."""

import importlib.util
import subprocess
import sys
import sysconfig
from pathlib import Path

import trueup
from trueup import _keywords

PACKAGE = Path(__file__).parents[1]


def test_every_option_is_described() -> None:
    options = {option.name: option for option in trueup.options()}
    method = options["stitch.method"]
    assert (method.keyword, method.default, method.tier) == ("method", "vpg", "basic")
    assert "apap" in method.choices and all(method.choices.values())
    assert options["output.jpeg_quality"].default == 90 or isinstance(options["output.jpeg_quality"].default, int)
    assert options["mesh.cell_px"].keyword is None
    assert all(option.meaning for option in options.values())


def test_the_typed_keywords_are_those_of_the_declarations() -> None:
    specification = importlib.util.spec_from_file_location("generate", PACKAGE / "generate_keywords.py")
    assert specification is not None and specification.loader is not None
    generator = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(generator)
    found = Path(_keywords.__file__).read_text()
    assert found == generator.module(), "run generate_keywords.py"


def test_the_command_comes_with_the_package() -> None:
    command = Path(sysconfig.get_path("scripts")) / "trueup"
    told = subprocess.run([command, "--version"], check=True, capture_output=True, text=True)
    assert told.stdout == f"trueup {trueup.__version__}\n"
    as_module = subprocess.run([sys.executable, "-m", "trueup", "options", "mesh", "--expert"], capture_output=True, text=True)
    assert as_module.returncode == 0 and "mesh.cell_px" in as_module.stdout
    wrong = subprocess.run([command, "stitch", "none.jpg", "-o", "none.gif"], capture_output=True, text=True)
    assert wrong.returncode == 2 and wrong.stderr.startswith("trueup: error: ")
    assert subprocess.run([command, "stitch"], capture_output=True).returncode == 2

"""The ``trueup`` command: ``python -m trueup`` does what ``trueup`` does."""

import sys

from trueup._trueup import command


def main() -> None:
    """Runs the command with the arguments of this program, and ends with its status."""
    sys.exit(command(["trueup", *sys.argv[1:]]))


if __name__ == "__main__":
    main()

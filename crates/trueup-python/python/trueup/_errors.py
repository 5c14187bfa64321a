"""What can go wrong, by whose fault it is. The names are those of the Rust library's errors. Every one of them can be pickled."""

from collections.abc import Sequence


class Error(Exception):
    """Anything that trueup refuses. The message names what is at fault, why, and what to do."""

    hint: str
    """What to do about it, a whole sentence; empty where nothing is known."""

    def __init__(self, message: str, *, hint: str = "") -> None:
        super().__init__(message)
        self.hint = hint


class InputError(Error, ValueError):
    """A photograph, a file or an argument cannot be used."""

    def __init__(self, message: str, *, subject: str = "", reason: str = "", hint: str = "") -> None:
        super().__init__(message, hint=hint)
        self.subject = subject
        """The file, photograph or argument at fault."""
        self.reason = reason
        """Why it cannot be used."""


class OptionsError(Error, ValueError):
    """Options are outside their ranges; all of them are listed."""

    def __init__(self, message: str, *, invalid: Sequence[tuple[str, str, str]] = ()) -> None:
        super().__init__(message, hint="List the options with their ranges with trueup.options().")
        self.invalid = list(invalid)
        """Name, value and allowed values of each."""


class LimitsError(Error, MemoryError):
    """The work would need more than a declared limit allows; refused before anything is taken."""

    def __init__(self, message: str, *, subject: str = "", needed: str = "", allowed: str = "", hint: str = "") -> None:
        super().__init__(message, hint=hint)
        self.subject = subject
        """What is too large."""
        self.needed = needed
        """What it would take, with its unit."""
        self.allowed = allowed
        """What the limit allows, with its unit."""


class UnsupportedError(Error, NotImplementedError):
    """The request is understood, but not something that trueup does."""

    def __init__(self, message: str, *, what: str = "", hint: str = "") -> None:
        super().__init__(message, hint=hint)
        self.what = what
        """The format, feature or combination asked for."""


class UnsolvableError(Error):
    """The photographs do not determine an answer: most often, they do not overlap."""

    def __init__(self, message: str, *, stage: str = "", subject: str = "", reason: str = "", hint: str = "") -> None:
        super().__init__(message, hint=hint)
        self.stage = stage
        """The stage that gave up."""
        self.subject = subject
        """The photograph, pair or system it gave up on."""
        self.reason = reason
        """Why there is no answer."""


class NotApplicableError(Error):
    """The method that was chosen cannot make a panorama of these photographs; another one can."""

    def __init__(self, message: str, *, method: str = "", reason: str = "", hint: str = "") -> None:
        super().__init__(message, hint=hint)
        self.method = method
        """The method, as in the options."""
        self.reason = reason
        """Which photograph it cannot place, and why."""


class IoError(Error, OSError):
    """The operating system refused a file operation; ``errno``, ``strerror`` and ``filename`` are its own."""

    def __init__(self, message: str, *, action: str = "", filename: str = "", errno: int | None = None, strerror: str = "") -> None:
        super().__init__(message)
        self.action = action
        """What was being done, as in "reading"."""
        self.errno = errno
        self.strerror = strerror
        self.filename = filename

    def __str__(self) -> str:
        # OSError would write its numbers in place of the message.
        return str(self.args[0])

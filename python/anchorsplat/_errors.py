"""Exceptions. Messages are those of the command line: one sentence with the file, the byte or line, the property and what was
expected. Settings have the names of its options ("--pixel-size" is ``pixel_size=``)."""


class Error(Exception):
    """Base class of all errors of this package."""


class BadArgumentError(Error, ValueError):
    """An invalid argument."""


class NotFoundError(Error, FileNotFoundError):
    """A file or folder was not found."""


class BadFileError(Error, ValueError):
    """A malformed, truncated or unsupported file."""


class ExistsError(Error, FileExistsError):
    """The file exists, and ``overwrite=True`` was not given."""


class IoError(Error, OSError):
    """Reading, writing or memory allocation failed."""


class StoppedError(Error):
    """The call was stopped. Ctrl-C raises KeyboardInterrupt instead."""


class SplatWarning(UserWarning):
    """A warning of the engine: what it assumed, dropped or could not keep."""

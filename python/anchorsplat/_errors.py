"""What goes wrong, as exceptions of one family. Every message is the command line's: one sentence with the file, the byte or
line, the property and what was expected. Settings are called as the command line calls them ("--pixel-size" is
``pixel_size=``)."""


class Error(Exception):
    """All that this package raises by itself."""


class BadArgumentError(Error, ValueError):
    """Asked for something impossible."""


class NotFoundError(Error, FileNotFoundError):
    """A file or folder is not there."""


class BadFileError(Error, ValueError):
    """Bytes that are malformed, truncated, hostile or of an unsupported kind."""


class ExistsError(Error, FileExistsError):
    """Would overwrite a file and was not told to (``overwrite=True``)."""


class IoError(Error, OSError):
    """The system refused to read, to write or to give memory."""


class StoppedError(Error):
    """The call was asked to end. Ctrl-C itself is Python's KeyboardInterrupt."""


class SplatWarning(UserWarning):
    """What a call assumed, left out or could not keep. Filter it as any warning of Python's."""

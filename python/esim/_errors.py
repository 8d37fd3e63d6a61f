"""The exceptions of esim; the C++ module uses these classes."""


class Error(ValueError):
    """An error that the caller can repair. The message is one line: what is wrong, where, what to do."""


class OutputError(Error, OSError):
    """An output could not be written, for example because the disk is full."""


class LossWarning(UserWarning):
    """Events were dropped or delayed, or samples were limited by a maximum rate or missed the tolerance. The message names
    the options that control this."""


class InternalError(RuntimeError):
    """A bug in esim."""

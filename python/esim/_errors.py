"""What esim raises; the module in C++ finds the classes here."""


class Error(ValueError):
    """Something that the caller can repair. The message is one line: what is wrong, where, what to do."""


class OutputError(Error, OSError):
    """An output could not be written, for example because the disk is full."""


class LossWarning(UserWarning):
    """Something was dropped, delayed, held to a maximum rate or off its tolerance. The message names the options that govern it."""


class InternalError(RuntimeError):
    """A defect of esim."""

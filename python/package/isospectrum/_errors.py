"""The exceptions and warnings of isospectrum, with the messages of the command line."""

from __future__ import annotations


class Error(Exception):
    """Base class of all exceptions of isospectrum, except the ``KeyboardInterrupt`` of Ctrl-C."""


class InputError(Error, ValueError):
    """A volume or a file is damaged, unsupported, or contradicts its own header."""


class UsageError(Error, ValueError):
    """Arguments are invalid or contradict each other."""


class RangeError(Error, ValueError):
    """An isovalue is outside the range of a spectrum."""


class FileError(Error, OSError):
    """A file cannot be opened, read or written."""


class GpuError(Error, RuntimeError):
    """There is no GPU adapter, or the device was lost."""


class VerificationError(Error, RuntimeError):
    """A spectrum fails verification (:meth:`Report.check`)."""


class InternalError(Error, RuntimeError):
    """A fault of isospectrum, not of its input. Please report it."""


class PromiseWarning(UserWarning):
    """A spectrum does not keep all promises of ``verify``; the message says which, and what helps."""


for _class in (Error, InputError, UsageError, RangeError, FileError, GpuError, VerificationError, InternalError, PromiseWarning):
    _class.__module__ = "isospectrum"
del _class

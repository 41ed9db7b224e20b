"""The exceptions of isospectrum: one family, with the messages of the command line."""

from __future__ import annotations


class Error(Exception):
    """Whatever isospectrum raises, but ``KeyboardInterrupt`` where Ctrl-C stopped it."""


class InputError(Error, ValueError):
    """A volume or a file is damaged, unsupported, or does not hold what it says."""


class UsageError(Error, ValueError):
    """Arguments contradict each other or make no sense."""


class RangeError(Error, ValueError):
    """An isovalue lies outside the range of a spectrum."""


class FileError(Error, OSError):
    """A file cannot be opened, read or written."""


class GpuError(Error, RuntimeError):
    """There is no adapter, or the device was lost."""


class VerificationError(Error, RuntimeError):
    """A spectrum does not pass verification (:meth:`Report.check`)."""


class InternalError(Error, RuntimeError):
    """A fault of isospectrum, not of its input: please report it."""


for _class in (Error, InputError, UsageError, RangeError, FileError, GpuError, VerificationError, InternalError):
    _class.__module__ = "isospectrum"
del _class

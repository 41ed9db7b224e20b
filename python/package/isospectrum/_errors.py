"""The exceptions and warnings of isospectrum."""

from __future__ import annotations


class Error(Exception):
    """Base class of all exceptions of isospectrum, except the ``KeyboardInterrupt`` of Ctrl-C. Messages are one line: what was found, what
    is expected, and where possible what helps."""


class InputError(Error, ValueError):
    """A volume or a file is damaged, unsupported, or contradicts its own header."""


class UsageError(Error, ValueError):
    """Arguments are invalid or contradict each other."""


class ArgumentError(UsageError, TypeError):
    """An argument has an unknown name; the message has the nearest known one."""


class RangeError(Error, ValueError):
    """An isovalue is outside the range of a spectrum."""


class FileError(Error, OSError):
    """A file cannot be opened, read or written."""


class GpuError(Error, RuntimeError):
    """There is no GPU adapter, or the device was lost."""


class ForkError(Error, RuntimeError):
    """The process was forked after isospectrum had been used, and lacks the threads for its work."""


class VerificationError(Error, RuntimeError):
    """A spectrum fails verification (:meth:`Report.check`)."""


class InternalError(Error, RuntimeError):
    """A fault of isospectrum, not of its input. Please report it."""


class Warning(UserWarning):  # noqa: A001 (read by its full name, isospectrum.Warning)
    """Something that was asked for is done differently, or may not be what was meant."""


class PromiseWarning(Warning):
    """A spectrum does not keep all promises of ``verify``, or may not at other isovalues; the message says which, and what helps."""


for _class in (
    Error, InputError, UsageError, ArgumentError, RangeError, FileError, GpuError, ForkError, VerificationError, InternalError, Warning,
    PromiseWarning,
):  # fmt: skip
    _class.__module__ = "isospectrum"
del _class

"""The exceptions of this package. Their text is the line that the command prints, without its ``error:``."""

from __future__ import annotations


class MicromotorError(Exception):
    """An error of this package.

    Attributes:
        hint: What to try instead, where there is something to say.
    """

    hint: str | None

    def __init__(self, message: str, *, hint: str | None = None) -> None:
        super().__init__(message)
        self.hint = hint


class SceneError(MicromotorError, ValueError):
    """A scene, or a setting of it, was refused.

    Attributes:
        key: The key or table, where the refusal is of one.
        value: The value as given.
        bounds: The values that the key takes, with their unit.
    """

    key: str | None
    value: str | None
    bounds: str | None

    def __init__(
        self,
        message: str,
        *,
        key: str | None = None,
        value: str | None = None,
        bounds: str | None = None,
        hint: str | None = None,
    ) -> None:
        super().__init__(message, hint=hint)
        self.key = key
        self.value = value
        self.bounds = bounds


class RunError(MicromotorError, RuntimeError):
    """A run did not start, or did not end."""


class LogError(MicromotorError, RuntimeError):
    """A log was not written or not read."""


class IdentificationError(MicromotorError, ValueError):
    """Nothing was identified."""

"""Errors that are sentences: what was expected, what was given, what to do.

One small family. Code that talks to people (the command line, an adapter's panel) catches
`ContactError` and shows its text; everything else is a bug and keeps its traceback.
"""


def quoted(value: object, most: int = 60) -> str:
    """What came, as Python spells it, cut to what fits a sentence: a file may hold a text of a million letters."""
    try:
        text = repr(value)
    except ValueError:  # a whole number of thousands of digits, written in base 16
        return "a number without end"
    return text if len(text) <= most else text[: most - 3] + "..."


def shortened(text: str, most: int = 500) -> str:
    """A sentence that is not longer than people read: its beginning and its end say what is wrong with the rest."""
    half = most // 2 - 2
    return text if len(text) <= most else f"{text[:half]}...{text[-half:]}"


class ContactError(Exception):
    """Base of every error that this project raises on purpose. Its text is meant for people."""


class InvalidInput(ContactError, ValueError):
    """A value that cannot be used: wrong shape, out of range, not finite, unknown name."""


class NotManifold(InvalidInput):
    """The surface is not manifold where an operation needs it; names the face or vertex."""


class Unreached(InvalidInput):
    """A point that no path on the surface leads to; names it."""


class FileRefused(ContactError):
    """A file that cannot be read or written: unknown format, damage, a newer schema, no room."""


class EditedFile(FileRefused):
    """A document whose digest does not fit its content: damaged, or edited by hand; says how to accept it."""


class CommandRejected(ContactError):
    """An edit that does not apply to this document; the document is unchanged."""


class MissingExtra(ContactError, ImportError):
    """An optional library is absent; the text holds the pip line that brings it."""

    def __init__(self, what: str, extra: str) -> None:
        super().__init__(f'{what} needs an optional library. Install it with: pip install "contact-core[{extra}]"')
        self.extra = extra


class Cancelled(ContactError):
    """The user cancelled; nothing was changed."""

"""JSON that says its own digest, so that a file in which a bit has flipped is never read as another one."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Any

from contact_core.errors import FileRefused, shortened

DIGEST = "digest"


def sealed(data: Mapping[str, Any]) -> dict[str, Any]:
    """Plain data with the SHA-256 of all its other entries as "digest"."""
    return {**data, DIGEST: _digest(data)}


def unsealed(data: Mapping[str, Any], source: str) -> dict[str, Any]:
    """The data without its digest. Raises FileRefused where that does not fit.

    The layout of the text does not matter. A digest of null, or none, says that nothing is known, as in files of
    earlier releases and of hand: those are believed.
    """
    plain = {key: value for key, value in data.items() if key != DIGEST}
    stated = data.get(DIGEST)
    if stated is not None and stated != _digest(plain):
        raise FileRefused(
            f"{source} is damaged, or was edited: its digest does not fit its content. Take a copy from before; if"
            f' you edited it yourself, set its "{DIGEST}" to null.'
        )
    return plain


def json_mistake(error: Exception) -> str:
    """What is wrong with JSON, in words: of the error that decoding bytes or parsing them raised."""
    if isinstance(error, RecursionError):
        return "it is nested too deeply"
    if isinstance(error, UnicodeError):
        return f"it is not UTF-8 text (byte {error.start})" if isinstance(error, UnicodeDecodeError) else "no text"
    if isinstance(error, json.JSONDecodeError):
        return f"{error.msg} in line {error.lineno}, column {error.colno}"
    said = str(error)
    return "it holds a number of more digits than any that is meant" if "digits" in said else shortened(said)


def _digest(data: Mapping[str, Any]) -> str:
    try:
        text = json.dumps(data, sort_keys=True, separators=(",", ":"))
    except (RecursionError, UnicodeError, TypeError, ValueError) as error:
        raise FileRefused("what is to be read or written here is no plain data.") from error
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()

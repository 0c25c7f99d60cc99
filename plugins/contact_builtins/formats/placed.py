"""What readers of scenes hand over: parts where they stand, the file's unit and up axis; and XML without traps."""

from __future__ import annotations

from typing import Literal
from xml.etree import ElementTree

from contact_core.arrays import FloatArray, IntArray
from contact_core.errors import InvalidInput

Placed = tuple[FloatArray, IntArray, IntArray]  # points (n, 3), corners per face (f,), point of each corner
Parsed = tuple[list[Placed], float, Literal["X", "Y", "Z"], list[str]]  # with metres per unit, up axis, notes


def parsed_xml(text: bytes) -> ElementTree.Element:
    """The root. Raises InvalidInput on what is no XML, or declares entities, which may grow without bound."""
    if b"<!DOCTYPE" in text or b"<!ENTITY" in text:
        raise InvalidInput("it declares a document type, which is not read")
    try:
        return ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise InvalidInput(f"its XML cannot be parsed: {error}") from error

"""The contact document on a prim of our layer: /Contacts, with ContactDocumentAPI."""

from __future__ import annotations

import base64
from typing import Any

from pxr import Sdf, Usd

from contact_core.errors import FileRefused
from contact_core.scene.host import StoredDocument

ROOT = Sdf.Path("/Contacts")
SCHEMA = "ContactDocumentAPI"
_CONTROL = bytes([*range(9), *range(11, 32), 127])  # what a text layer might not give back
_UNIFORM = Sdf.VariabilityUniform
_ATTRIBUTES = {
    "contact:document": Sdf.ValueTypeNames.String,
    "contact:encoding": Sdf.ValueTypeNames.Token,
    "contact:revision": Sdf.ValueTypeNames.Int64,
    "contact:schema": Sdf.ValueTypeNames.Int,
}


def read(stage: Usd.Stage) -> StoredDocument | None:
    """What the stage holds, in whichever layer. Raises FileRefused when it is damaged."""
    prim = stage.GetPrimAtPath(ROOT)
    if not prim or not prim.GetAttribute("contact:document").HasAuthoredValue():
        return None
    text, encoding, revision, schema = (_value(prim, name) for name in _ATTRIBUTES)
    try:
        data = base64.b64decode(text, validate=True) if encoding == "base64" else text.encode()
        return StoredDocument(data, revision, schema)
    except ValueError as error:
        raise FileRefused(f"the contact document on {ROOT} is damaged: {error}") from error


def read_schema(stage: Usd.Stage) -> int | None:
    """The schema number of what the stage holds, without reading it. Raises FileRefused when it is damaged."""
    attribute = stage.GetAttributeAtPath(ROOT.AppendProperty("contact:schema"))
    there = attribute and attribute.HasAuthoredValue()
    return int(_value(attribute.GetPrim(), "contact:schema")) if there else None


def _value(prim: Usd.Prim, name: str) -> Any:
    """One attribute of the document, of the type that we write it in. Raises FileRefused."""
    value, wanted = prim.GetAttribute(name).Get(), _ATTRIBUTES[name]
    if not isinstance(value, type(wanted.defaultValue)):
        raise FileRefused(
            f"the contact document on {ROOT} is damaged: its {name} is no {wanted}, but {value!r:.40}."
        )
    return value


def write(layer: Sdf.Layer, document: StoredDocument) -> None:
    """Replace it, by Sdf: one change for all values."""
    text, encoding = _as_text(document.data)
    values = (text, encoding, document.revision, document.schema)
    with Sdf.ChangeBlock():
        prim = contacts_prim(layer)
        applied = Sdf.TokenListOp()
        applied.prependedItems = [SCHEMA]
        prim.SetInfo("apiSchemas", applied)
        for (name, kind), value in zip(_ATTRIBUTES.items(), values, strict=True):
            attribute = prim.attributes.get(name) or Sdf.AttributeSpec(prim, name, kind, _UNIFORM)
            attribute.default = value


def contacts_prim(layer: Sdf.Layer) -> Sdf.PrimSpec:
    """/Contacts in our layer: a Scope, defined there if need be."""
    prim = Sdf.CreatePrimInLayer(layer, ROOT)
    prim.specifier = Sdf.SpecifierDef
    prim.typeName = "Scope"
    return prim


def _as_text(data: bytes) -> tuple[str, str]:
    """Text as it is where a text layer gives it back, else base64."""
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError:
        text = ""
    if not text or len(data.translate(None, _CONTROL)) < len(data):
        return base64.b64encode(data).decode("ascii"), "base64"
    return text, "utf-8"

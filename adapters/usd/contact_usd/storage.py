"""The contact document on a prim of our layer: /Contacts, with ContactDocumentAPI, each of its parts an attribute.

The stamp is read as the stage composes it, and the parts out of the one layer that the stamp comes from: a document
of a layer further below never mixes with ours.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from pxr import Sdf, Usd

from contact_core.document.frozen_map import FrozenMap
from contact_core.errors import FileRefused
from contact_core.scene.host import DocumentStamp, StoredDocument

ROOT = Sdf.Path("/Contacts")
SCHEMA = "ContactDocumentAPI"
PART = "contact:part:"  # and the key of the part
_UNIFORM = Sdf.VariabilityUniform
_STAMP = {
    "contact:revision": Sdf.ValueTypeNames.Int64,
    "contact:digest": Sdf.ValueTypeNames.String,
    "contact:schema": Sdf.ValueTypeNames.Int,
}
_IN_ONE_PIECE = "contact:document"  # of releases before parts


def read_stamp(stage: Usd.Stage) -> DocumentStamp | None:
    """The stamp of what the stage holds, in whichever layer. Raises FileRefused when it is damaged."""
    prim = stage.GetPrimAtPath(ROOT)
    if not prim:
        return None
    if not any(prim.GetAttribute(name).HasAuthoredValue() for name in _STAMP):
        _refuse_one_piece(prim)
        return None
    return DocumentStamp(*(_checked(name, kind, prim.GetAttribute(name).Get()) for name, kind in _STAMP.items()))


def read(stage: Usd.Stage) -> StoredDocument | None:
    """What the stage holds, in whichever layer. Raises FileRefused when it is damaged."""
    stamp = read_stamp(stage)
    if stamp is None:
        return None
    holder = stage.GetPrimAtPath(ROOT).GetAttribute("contact:digest").GetPropertyStack()[0].owner
    parts = {
        spec.name.removeprefix(PART): _checked(spec.name, Sdf.ValueTypeNames.String, spec.default)
        for spec in holder.attributes
        if spec.name.startswith(PART)
    }
    return StoredDocument(stamp, FrozenMap(parts))


def is_in(layer: Sdf.Layer) -> bool:
    """Whether the document is in this layer, be there one in a layer further below or not."""
    return layer.GetAttributeAtPath(ROOT.AppendProperty("contact:digest")) is not None


def take_over(stage: Usd.Stage, layer: Sdf.Layer) -> None:
    """Begin the document in our layer, with all that a layer further below holds of one."""
    below = read(stage)
    prim = contacts_prim(layer)
    applied = Sdf.TokenListOp()
    applied.prependedItems = [SCHEMA]
    prim.SetInfo("apiSchemas", applied)
    if below is not None:
        write(layer, below.stamp, below.parts, ())


def attributes(put: Iterable[str], remove: Iterable[str]) -> list[Sdf.Path]:
    """Where `write` writes."""
    return [ROOT.AppendProperty(name) for name in (*_STAMP, *(PART + key for key in (*put, *remove)))]


def write(layer: Sdf.Layer, stamp: DocumentStamp, put: Mapping[str, str], remove: Iterable[str]) -> None:
    """Change the document in our layer, by Sdf: one change of attributes."""
    prim = layer.GetPrimAtPath(ROOT)
    with Sdf.ChangeBlock():
        for key in remove:
            spec = prim.attributes.get(PART + key)
            if spec is not None:
                prim.RemoveProperty(spec)
        for key, text in put.items():
            _set(prim, PART + key, Sdf.ValueTypeNames.String, text)
        for (name, kind), value in zip(_STAMP.items(), (stamp.revision, stamp.digest, stamp.schema), strict=True):
            _set(prim, name, kind, value)


def contacts_prim(layer: Sdf.Layer) -> Sdf.PrimSpec:
    """/Contacts in our layer: a Scope, defined there if need be."""
    prim = layer.GetPrimAtPath(ROOT) or Sdf.CreatePrimInLayer(layer, ROOT)
    if prim.specifier != Sdf.SpecifierDef or prim.typeName != "Scope":
        prim.specifier = Sdf.SpecifierDef
        prim.typeName = "Scope"
    return prim


def _set(prim: Sdf.PrimSpec, name: str, kind: Sdf.ValueTypeName, value: Any) -> None:
    attribute = prim.attributes.get(name) or Sdf.AttributeSpec(prim, name, kind, _UNIFORM)
    attribute.default = value


def _checked(name: str, kind: Sdf.ValueTypeName, value: Any) -> Any:
    """A value of the document, of the type that we write it in. Raises FileRefused."""
    if not isinstance(value, type(kind.defaultValue)):
        raise FileRefused(f"the contact document on {ROOT} is damaged: its {name} is no {kind}, but {value!r:.40}.")
    return value


def _refuse_one_piece(prim: Usd.Prim) -> None:
    if prim.GetAttribute(_IN_ONE_PIECE).HasAuthoredValue():
        raise FileRefused(
            f"the contact document on {ROOT} was stored in one piece, as early versions of contact-core did; this"
            f" release stores it in parts and reads no other. Remove {ROOT} to begin anew. It is left untouched."
        )

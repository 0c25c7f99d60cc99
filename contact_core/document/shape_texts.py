"""Texts of shapes as they stand in a document file: cut out of a file that is read, made once, kept with the shape.

Shapes are nine tenths of a document, and an edit changes one of them. So a document that was read is written again
without encoding the shapes that nobody has changed.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any
from weakref import WeakKeyDictionary

from contact_core.arrays import FloatArray
from contact_core.contact.shape import PatchCoordinates, PatchShape
from contact_core.document.codec import Fragment, pretty, to_json

CUT = "the shapes were cut out here"  # a text that stands in their place
_START, _BETWEEN, _END = '\n "shapes": {\n', "\n  },\n", "\n }"  # as `pretty` lays a document out

_read = json.JSONDecoder().raw_decode
_shape_texts: WeakKeyDictionary[PatchShape, Fragment] = WeakKeyDictionary()
_kept_texts: WeakKeyDictionary[PatchCoordinates, tuple[FloatArray, Fragment, Fragment]] = WeakKeyDictionary()


def shape_to_json(shape: PatchShape) -> dict[str, Any]:
    """JSON-able data of a shape as it stands in a document, the bulk of it as text that is made once for files and
    hosts."""
    coordinates, weights = _points_texts(shape)
    own = {"axis": to_json(shape.axis), "meters_per_unit": float(shape.meters_per_unit)}
    return {**own, "coordinates": coordinates, "weights": weights}


def shape_text(shape: PatchShape) -> Fragment:
    """The text of a shape as it stands in a file, two levels deep, kept from one save to the next."""
    if shape not in _shape_texts:
        _shape_texts[shape] = Fragment(pretty(shape_to_json(shape), 2))
    return _shape_texts[shape]


def keep_texts(shapes: Mapping[str, PatchShape], texts: Mapping[str, Fragment]) -> None:
    """Keep the texts that shapes were read from; texts: by key, canonical."""
    for key, text in texts.items():
        _shape_texts[shapes[key]] = text


def cut_out(text: str) -> tuple[str, dict[str, Fragment]] | None:
    """A document's JSON with `CUT` for its shapes, and the text of each shape by key; None where it does not lie as
    `pretty` lays it out. Raises ValueError where a key is none.

    The texts may be no JSON where the layout only seems right: each is to be parsed by itself.
    """
    start = text.find(_START)
    end = text.find(_END, start + len(_START))
    if start < 0 or end < 0 or text.find(_START, end) >= 0 or CUT in text:
        return None
    texts: dict[str, Fragment] = {}
    pieces = (text[start + len(_START) : end] + ",\n").split(_BETWEEN)
    for piece in pieces[:-1]:
        if not piece.startswith('  "'):
            return None
        key, after = _read(piece, 2)
        if piece[after : after + 2] != ": " or key in texts:
            return None
        texts[key] = Fragment(piece[after + 2 :] + "\n  }")
    if pieces[-1]:
        return None
    return f'{text[:start]}\n "shapes": {json.dumps(CUT)}{text[end + len(_END) :]}', texts


def _points_texts(shape: PatchShape) -> tuple[Fragment, Fragment]:
    """The texts of the coordinates and weights of a shape as they stand in a document, three levels deep.

    They are kept with the coordinates, which a new axis shares: bending a patch encodes its axis alone.
    """
    kept = _kept_texts.get(shape.coordinates)
    if kept is None or kept[0] is not shape.weights:
        coordinates, weights = (Fragment(pretty(to_json(x), 3)) for x in (shape.coordinates, shape.weights))
        kept = _kept_texts[shape.coordinates] = (shape.weights, coordinates, weights)
    return kept[1:]

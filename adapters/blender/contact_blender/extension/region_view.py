"""A 3D region of Blender as a view of the interaction: a value, made of its matrices at an event.

Pixels are the region's, counted from its top left corner as the interaction does; Blender counts from the bottom.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from contact_core.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class RegionView:
    """See the module.

    clip_from_world: (4, 4) Blender's perspective_matrix. eye: (3,) world, None where the view has no vanishing
    point. viewport: width and height, pixels. pixel_ratio: of Blender's own scale of the interface.
    """

    clip_from_world: FloatArray
    eye: FloatArray | None
    viewport: tuple[int, int]
    pixel_ratio: float = 1.0

    @classmethod
    def of(cls, region: Any, region_3d: Any, pixel_ratio: float = 1.0) -> RegionView:
        """The view of a region; nothing of Blender's is kept."""
        eye = np.array(region_3d.view_matrix.inverted().translation, float) if region_3d.is_perspective else None
        size = max(int(region.width), 1), max(int(region.height), 1)
        return cls(np.array(region_3d.perspective_matrix, float), eye, size, float(pixel_ratio))

    @property
    def _world_from_clip(self) -> FloatArray:
        return np.asarray(np.linalg.inv(self.clip_from_world))

    def rays(self, pixels: Any) -> tuple[FloatArray, FloatArray]:
        """See `contact_core.interaction.view.View`."""
        at = np.asarray(pixels, float).reshape(-1, 2) / np.array(self.viewport, float)
        ends = []
        for depth in (-1.0, 1.0):  # of the near and the far plane
            clip = np.stack(
                [2.0 * at[:, 0] - 1.0, 1.0 - 2.0 * at[:, 1], np.full(len(at), depth), np.ones(len(at))], 1
            )
            world = clip @ self._world_from_clip.T
            ends.append(world[:, :3] / world[:, 3:])
        along = ends[1] - ends[0]
        directions = along / np.linalg.norm(along, axis=1, keepdims=True)
        origins = ends[0] if self.eye is None else np.broadcast_to(self.eye, ends[0].shape).copy()
        return origins, directions

    def project(self, points: Any) -> FloatArray:
        """See `contact_core.interaction.view.View`."""
        at = np.asarray(points, float).reshape(-1, 3)
        clip = at @ self.clip_from_world[:, :3].T + self.clip_from_world[:, 3]  # (k, 4)
        w = np.where(np.abs(clip[:, 3]) > 1e-12, clip[:, 3], 1e-12)
        x, y = clip[:, 0] / w, clip[:, 1] / w
        depth = clip[:, 3] if self.eye is not None else self._from_near(at)
        wide, high = self.viewport
        return np.stack([0.5 * (x + 1.0) * wide, 0.5 * (1.0 - y) * high, depth], axis=1)

    def _from_near(self, points: FloatArray) -> FloatArray:
        """(k,) how far beyond the near plane points (k, 3) lie, for a view without a vanishing point."""
        origins, directions = self.rays([[0.0, 0.0]])
        return np.asarray((points - origins[0]) @ directions[0])


def view_of(context: Any) -> RegionView | None:
    """The view of the 3D region that an event belongs to, None elsewhere."""
    region, data = context.region, context.region_data
    if region is None or data is None or region.type != "WINDOW":
        return None
    return RegionView.of(region, data, context.preferences.system.ui_scale)

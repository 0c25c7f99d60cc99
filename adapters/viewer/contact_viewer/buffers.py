"""Arrays that VTK draws from and that are overwritten in place: a posed hand is uploaded, never built again."""

from __future__ import annotations

from typing import Any

import numpy as np

from contact_core.arrays import FloatArray, IntArray


class Polygons:
    """A vtkPolyData over arrays of its own. `data` is what a mapper draws."""

    def __init__(self) -> None:
        from vtkmodules.vtkCommonCore import vtkPoints
        from vtkmodules.vtkCommonDataModel import vtkPolyData

        self.data: Any = vtkPolyData()
        self._points = vtkPoints()
        self.data.SetPoints(self._points)
        self._held: dict[str, Any] = {}  # the numpy side of what VTK reads, by what it is
        self._sizes: IntArray | None = None  # of the lines that it holds

    def set_points(self, points: FloatArray) -> None:
        """Positions (n, 3): into the memory that VTK reads, where their number is the same."""
        if self._overwrite("points", points, (len(points), 3), np.float32):
            self._points.SetData(self._as_vtk("points"))
        self._points.GetData().Modified()
        self._points.Modified()
        self.data.Modified()  # pulls the bounds along

    def set_normals(self, normals: FloatArray) -> None:
        """Unit normals (n, 3)."""
        if self._overwrite("normals", normals, (len(normals), 3), np.float32):
            self.data.GetPointData().SetNormals(self._as_vtk("normals"))
        self.data.GetPointData().GetNormals().Modified()

    def set_values(self, values: FloatArray) -> None:
        """One number per point (n,), which a lookup table of the mapper colours."""
        self._overwrite("values", values, (len(values),), np.float32)
        self.data.GetPointData().SetScalars(self._as_vtk("values"))  # colours may have been in their place
        self.data.GetPointData().GetScalars().Modified()

    def set_colors(self, colors: FloatArray, *, of: str) -> None:
        """RGBA 0..1 (k, 4) of its points, or of its cells."""
        where = self.data.GetPointData() if of == "points" else self.data.GetCellData()
        self._overwrite("colors", np.round(np.asarray(colors) * 255), (len(colors), 4), np.uint8)
        where.SetScalars(self._as_vtk("colors"))
        where.GetScalars().Modified()

    def set_faces(self, triangles: IntArray) -> None:
        """Corners (m, 3) of triangles."""
        self.data.SetPolys(_cells(np.arange(0, triangles.size + 1, 3), np.asarray(triangles).ravel()))

    def set_lines(self, sizes: IntArray) -> None:
        """Polylines over consecutive points, so many each; the same sizes as before cost nothing."""
        if self._sizes is not None and np.array_equal(self._sizes, sizes):
            return
        self._sizes = np.array(sizes)
        offsets = np.concatenate([[0], np.cumsum(sizes)])
        self.data.SetLines(_cells(offsets, np.arange(offsets[-1])))

    def set_dots(self, count: int) -> None:
        """Each of the points as a dot."""
        self.data.SetVerts(_cells(np.arange(count + 1), np.arange(count)))

    def _overwrite(self, name: str, values: Any, shape: tuple[int, ...], dtype: Any) -> bool:
        """Write into the memory that VTK reads; whether new memory had to be taken."""
        held = self._held.get(name)
        new = held is None or held.shape != shape
        if new:
            self._held[name] = np.empty(shape, dtype)
        self._held[name][...] = values
        return new

    def _as_vtk(self, name: str) -> Any:
        from vtkmodules.util.numpy_support import numpy_to_vtk

        return numpy_to_vtk(self._held[name], deep=False)


def _cells(offsets: IntArray, corners: IntArray) -> Any:
    """A vtkCellArray that copies its two arrays."""
    from vtkmodules.util.numpy_support import numpy_to_vtkIdTypeArray
    from vtkmodules.vtkCommonDataModel import vtkCellArray

    made = vtkCellArray()
    made.SetData(
        numpy_to_vtkIdTypeArray(np.ascontiguousarray(offsets, np.int64), deep=True),
        numpy_to_vtkIdTypeArray(np.ascontiguousarray(corners, np.int64), deep=True),
    )
    return made


class Normals:
    """Normals of points whose triangles (m, 3) stay: each the sum of its faces', which count by their area."""

    def __init__(self, triangles: IntArray, count: int) -> None:
        from scipy.sparse import csr_matrix

        self._corners = np.ascontiguousarray(np.asarray(triangles, np.int64).T)  # (3, m)
        m = self._corners.shape[1]
        entries = (np.ones(3 * m, np.float32), (self._corners.ravel(), np.tile(np.arange(m), 3)))
        self._point_from_face = csr_matrix(entries, shape=(count, m))

    def at(self, points: FloatArray) -> FloatArray:
        """(n, 3) unit normals for points (n, 3); zero where no face is."""
        a, b, c = (points[corner] for corner in self._corners)
        (ux, uy, uz), (vx, vy, vz) = (b - a).T, (c - a).T
        faces = np.stack(
            [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx], axis=1
        )  # (m, 3), twice the area
        sums = self._point_from_face @ faces
        length = np.sqrt(np.einsum("ni,ni->n", sums, sums))[:, None]
        return np.asarray(np.divide(sums, length, out=np.zeros_like(sums), where=length > 0))

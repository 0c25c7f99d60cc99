"""What stands still is drawn once: its colours and depths lie under what moves, for as long as the eye stands, too.

For windows that the processor draws, where a large mesh costs more than all the rest. The kept image is a rectangle
over the whole view whose depth is that of what was drawn there, so what moves comes before and behind it as ever.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np

from contact_viewer.actors import SurfaceActor

_STILL = 2  # frames that a surface has to stand before it counts as still
_ROOM = 0.1  # of the range of depths: more at both ends, for what comes nearer or goes away
_PLACE = "gl_Position = vec4(vertexMC.xyz, 1.0);\n"
_FETCH = """ivec2 at = ivec2(gl_FragCoord.xy);
  gl_FragData[0] = vec4(texelFetch(keptColors, at, 0).rgb, 1.0);
  gl_FragDepth = texelFetch(keptDepths, at, 0).r;
"""


class Standing:
    """Of one renderer: the image of the surfaces that stand, while they and the camera do.

    images: how many were made; tests count them.
    """

    def __init__(self, window: Any, renderer: Any) -> None:
        self._window, self._renderer = window, renderer
        self._states: dict[str, tuple[object, int]] = {}  # how each surface looks, and for how many frames so
        self._view: tuple[object, ...] = ()
        self._held: dict[str, object] = {}  # the surfaces in the image, as they looked
        self._range = (0.0, 0.0)
        self._colors, self._depths = _texture(), _texture()
        self._sheet = _sheet(self._colors, self._depths)
        self._sheet.SetVisibility(False)
        renderer.AddActor(self._sheet)
        self.images = 0

    @property
    def is_used(self) -> bool:
        """Whether some surfaces are in the image, and not drawn again."""
        return bool(self._sheet.GetVisibility())

    def use(self, surfaces: Mapping[str, SurfaceActor]) -> None:
        """Prepare the next frame: with an image in place of what stands, made anew where it is another."""
        still = self._still(surfaces)
        holds = all(name in still and still[name] == state for name, state in self._held.items())
        if not still:
            self._held = {}
            self.leave(surfaces)
        elif not holds or len(still) > len(self._held) or not self._fits(surfaces):
            self._make(still, surfaces)

    def leave(self, surfaces: Mapping[str, SurfaceActor]) -> None:
        """Prepare the next frame: with everything drawn itself. The image stays for later."""
        self._show(surfaces, sheet=False)
        self._renderer.ResetCameraClippingRange()

    def _still(self, surfaces: Mapping[str, SurfaceActor]) -> dict[str, object]:
        """The opaque surfaces that have looked the same for some frames, from where the eye is."""
        view = self._view_now()
        before, self._view = self._states if view == self._view else {}, view
        self._states = {}
        for name, surface in surfaces.items():
            state, (known, frames) = surface.state, before.get(name, (None, 0))
            self._states[name] = state, frames + 1 if state == known else 0
        return {n: s for n, (s, frames) in self._states.items() if frames >= _STILL and surfaces[n].is_solid}

    def _view_now(self) -> tuple[object, ...]:
        camera, renderer = self._renderer.GetActiveCamera(), self._renderer
        back = renderer.GetBackground(), renderer.GetBackground2()
        shape = renderer.GetViewport(), self._window.GetSize()
        return (camera.GetPosition(), camera.GetFocalPoint(), camera.GetViewUp(), *back, *shape)

    def _make(self, still: Mapping[str, object], surfaces: Mapping[str, SurfaceActor]) -> None:
        """Draw what stands alone, and keep it."""
        self._show(surfaces, sheet=False)
        self._range = self._reach(_ROOM)
        with _Alone(self._window, self._renderer, {surfaces[name] for name in still}):
            self._renderer.GetActiveCamera().SetClippingRange(*self._range)
            self._window.Render()
        self._read()
        self._held = dict(still)
        self._fits(surfaces)
        self.images += 1

    def _show(self, surfaces: Mapping[str, SurfaceActor], *, sheet: bool) -> None:
        for name, surface in surfaces.items():
            surface.veil(sheet and name in self._held)
        self._sheet.SetVisibility(sheet)
        self._renderer.SetGradientBackground(not sheet)

    def _fits(self, surfaces: Mapping[str, SurfaceActor]) -> bool:
        """Put the image up; whether what moves lies in the range of depths that it was made with."""
        self._show(surfaces, sheet=True)
        near, far = self._reach(0.0)
        self._renderer.GetActiveCamera().SetClippingRange(*self._range)
        return self._range[0] <= near and far <= self._range[1]

    def _reach(self, room: float) -> tuple[float, float]:
        """The range of depths of what is shown, with some room at both ends."""
        self._renderer.ResetCameraClippingRange()
        near, far = self._renderer.GetActiveCamera().GetClippingRange()
        return near * (1.0 - room), far * (1.0 + room)

    def _read(self) -> None:
        from vtkmodules.vtkCommonCore import vtkFloatArray, vtkUnsignedCharArray

        (width, height), colors, depths = self._window.GetSize(), vtkUnsignedCharArray(), vtkFloatArray()
        self._window.GetPixelData(0, 0, width - 1, height - 1, 0, colors, 0)
        self._window.GetZbufferData(0, 0, width - 1, height - 1, depths)
        for texture, values in ((self._colors, colors), (self._depths, depths)):
            image = texture.GetInput()
            image.SetDimensions(width, height, 1)
            image.GetPointData().SetScalars(values)
            image.Modified()


class _Alone:
    """While it lasts a renderer draws some surfaces and nothing else, in nobody's sight."""

    def __init__(self, window: Any, renderer: Any, surfaces: Collection[SurfaceActor]) -> None:
        self._window, self._renderer = window, renderer
        kept = {surface.prop for surface in surfaces}
        self._others = [p for p in renderer.GetViewProps() if p.GetVisibility() and p not in kept]
        self._layers = [each for each in window.GetRenderers() if each is not renderer and each.GetDraw()]

    def __enter__(self) -> None:
        self._set(shown=False)

    def __exit__(self, *_: object) -> None:
        self._set(shown=True)

    def _set(self, *, shown: bool) -> None:
        self._window.SetSwapBuffers(shown)
        for prop in self._others:
            prop.SetVisibility(shown)
        for layer in self._layers:
            layer.SetDraw(shown)


def _texture() -> Any:
    """A texture whose values are taken as they are."""
    from vtkmodules.vtkCommonDataModel import vtkImageData
    from vtkmodules.vtkRenderingCore import vtkTexture

    texture = vtkTexture()
    texture.SetInputData(vtkImageData())
    texture.SetColorModeToDirectScalars()
    texture.InterpolateOff()
    texture.MipmapOff()
    return texture


def _sheet(colors: Any, depths: Any) -> Any:
    """An actor that covers the view with the colours and depths of two textures, wherever the camera is."""
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

    from contact_viewer.buffers import Polygons

    corners = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    polygons, mapper, actor = Polygons(), vtkPolyDataMapper(), vtkActor()
    polygons.set_points(corners)
    polygons.set_faces(np.array([[0, 1, 2], [0, 2, 3]]))
    polygons.data.GetPointData().SetTCoords(numpy_to_vtk(0.5 + 0.5 * corners[:, :2].astype(np.float32), deep=True))
    mapper.SetInputData(polygons.data)
    actor.SetMapper(mapper)
    actor.UseBoundsOff()  # it is nowhere in the scene
    actor.ForceOpaqueOn()
    actor.GetProperty().LightingOff()
    actor.GetProperty().SetTexture("keptColors", colors)
    actor.GetProperty().SetTexture("keptDepths", depths)
    shader = actor.GetShaderProperty()
    shader.AddVertexShaderReplacement("//VTK::PositionVC::Impl", True, _PLACE, False)
    shader.AddFragmentShaderReplacement("//VTK::TCoord::Impl", True, _FETCH, False)
    return actor

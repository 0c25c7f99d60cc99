"""The PyVista viewer: pictures off-screen. Importing this package imports neither pyvista nor vtk."""

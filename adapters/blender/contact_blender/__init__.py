"""Blender as a host of contact-core: meshes, rigs, poses, the document in the .blend, and Blender's own undo.

Importing this package imports no bpy; `contact_blender.plugin` is what the core's manager loads.
"""

"""Readers and writers: mesh files, glTF with skins, URDF hands, the rig.toml sidecar, and what `inspect` tells."""

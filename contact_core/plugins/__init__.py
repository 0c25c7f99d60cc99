"""Plugins: the hooks, the registry of slots, and the manager that belongs to a session."""

import pluggy

hookimpl = pluggy.HookimplMarker("contact")

__all__ = ["hookimpl"]

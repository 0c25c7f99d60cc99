"""Contact-area editing and contact-driven posing for animation, for every host.

Importing this package loads nothing heavy: each sub-package is imported where it is used.
"""

from contact_core._version import __version__

__all__ = ["__version__"]

"""Acts in a Blender that has a window; each test starts one. Without such a Blender they skip, saying why.

A test module here is loaded in Blender as well, so it imports at its top what both have: `blender_driver`.
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

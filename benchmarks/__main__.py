"""Run every benchmark: `python -m benchmarks [arguments for all]`."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

for script in sorted(Path(__file__).parent.glob("bench_*.py")):
    sys.stdout.write(f"== {script.stem}\n")
    sys.stdout.flush()
    subprocess.run([sys.executable, str(script), *sys.argv[1:]], check=True)

"""Run the benchmarks: `python -m benchmarks [name ...] [--quick]`; names as in bench_NAME.py, all without one.

One that fails is named at the end and does not keep the others from running.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from pathlib import Path

SCRIPTS = {
    script.stem.removeprefix("bench_"): script for script in sorted(Path(__file__).parent.glob("bench_*.py"))
}

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("names", nargs="*", metavar="name", help=", ".join(SCRIPTS))
parser.add_argument("--quick", action="store_true", help="handed to those that have a quick run")
arguments = parser.parse_args()
unknown = sorted(set(arguments.names) - set(SCRIPTS))
if unknown:
    parser.error(f"no benchmark is called {', '.join(unknown)}; there are {', '.join(SCRIPTS)}.")

failed = []
for name in arguments.names or SCRIPTS:
    sys.stdout.write(f"== {name}\n")
    sys.stdout.flush()
    quick = ["--quick"] if arguments.quick and "--quick" in SCRIPTS[name].read_text() else []
    if subprocess.run([sys.executable, str(SCRIPTS[name]), *quick]).returncode:
        failed.append(name)
if failed:
    sys.exit(f"These benchmarks failed: {', '.join(failed)}.")

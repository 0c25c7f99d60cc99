"""Model the built-in samples anew and keep them in this package.

    python -m contact_builtins.samples [NAME ...]

For whoever changes how a sample is modelled. A sample whose sources are those of its model is left alone, unless it
is named.
"""

from __future__ import annotations

import argparse
import io
import sys
from pathlib import Path
from typing import Any

import numpy as np

from contact_builtins.samples.catalogue import ALL, MODELS
from contact_builtins.samples.packing import pack
from contact_core.atomic_file import write_atomic

FOLDER = Path(__file__).parent / MODELS
VERSIONS = FOLDER / "versions.txt"


def versions() -> dict[str, str]:
    """The digest of the sources that each kept model was made with, by sample."""
    if not VERSIONS.exists():
        return {}
    return dict(line.split() for line in VERSIONS.read_text().splitlines())


def main(names: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME")
    wanted, kept = parser.parse_args(names).names, versions()
    if unknown := set(wanted) - {sample.name for sample in ALL}:
        known = ", ".join(sample.name for sample in ALL)
        parser.error(f"there is no sample {', '.join(sorted(unknown))}; there are {known}.")
    FOLDER.mkdir(exist_ok=True)
    for sample in ALL:
        if sample.name in wanted or (not wanted and kept.get(sample.name) != sample.version()):
            sys.stdout.write(f"modelling {sample.name}\n")
            arrays: dict[str, Any] = pack(sample.generate())
            archive = io.BytesIO()
            np.savez_compressed(archive, **arrays)
            write_atomic(FOLDER / f"{sample.name}.npz", archive.getvalue())
            kept[sample.name] = sample.version()
    write_atomic(VERSIONS, "".join(f"{name} {version}\n" for name, version in sorted(kept.items())).encode())
    return 0


if __name__ == "__main__":
    sys.exit(main())

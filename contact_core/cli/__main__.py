"""`python -m contact_core.cli`, for places where scripts are not on the path."""

import sys

from contact_core.cli import main

sys.exit(main())

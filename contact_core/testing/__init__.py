"""The contract kit: suites that prove an adapter or a plugin keeps its promise. Needs the extra `testing`.

A third party subclasses one suite and gives one fixture:

    class TestMyGenerator(AxisGeneratorContract):
        @pytest.fixture
        def generator(self): return MyGenerator()

Nothing else of contact_core imports pytest or hypothesis.
"""

from contact_core.errors import MissingExtra

try:
    import pytest
except ImportError as error:
    raise MissingExtra("The contract kit", "testing") from error

SUITES = (
    "host", "solver", "term", "axis_generator", "brush", "engine", "command", "format",
    "grasp_sampler", "grasp_score", "tool", "job_kind", "proxy_maker",
)  # fmt: skip

# Without this, an inherited test that fails prints a bare AssertionError instead of its values.
pytest.register_assert_rewrite(f"{__name__}.host_clauses", *(f"{__name__}.{suite}_contract" for suite in SUITES))

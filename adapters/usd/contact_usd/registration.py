"""Making the codeless schema known to USD, and noticing when that came too late.

USD reads its schema plugins once, when anything first asks for a schema (opening a stage does). A plugin that
registers afterwards is accepted and silently has no effect in that process.
"""

from __future__ import annotations

from functools import lru_cache

from pxr import Plug, Usd

from contact_usd.schema_dir import ENVIRONMENT_VARIABLE, schema_dir

SCHEMAS = ("ContactDocumentAPI", "ContactPatchAPI", "ContactPairAPI")


def register() -> None:
    """Tell USD where the schema is: at import, for a stage that is opened in between would make it too late."""
    Plug.Registry().RegisterPlugins(str(schema_dir()))


@lru_cache(maxsize=1)
def problem() -> str | None:
    """None when USD knows the schema, else a sentence with the reason and the cure."""
    registry = Usd.SchemaRegistry()
    if all(registry.FindAppliedAPIPrimDefinition(name) for name in SCHEMAS):
        return None
    return (
        "USD was in use before contact_usd was imported, so its schemas stay unknown in this process. All data is"
        " written and read in full all the same; only fallbacks and checks by schema are missing. To have them,"
        f" import contact_usd.host before the first stage is opened, or start the host with {ENVIRONMENT_VARIABLE}"
        f" containing {schema_dir()}."
    )

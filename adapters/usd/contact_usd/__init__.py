"""contact-core on OpenUSD stages. Importing this package imports no pxr; `contact_usd.host` does."""

from contact_usd.schema_dir import schema_dir

__all__ = ["schema_dir"]

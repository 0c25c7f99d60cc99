"""A page that is closed while something is sent to it is nothing that went wrong: the log says nothing of it."""

from __future__ import annotations

import logging

_LOGGERS = ("wslink.protocol", "aiohttp.server", "asyncio")


class ClosedPages(logging.Filter):
    """Leaves out what the libraries of the server log about connections that were closed meanwhile."""

    def filter(self, record: logging.LogRecord) -> bool:
        """Whether a record is logged. wslink logs an error as three: a title, the error, its traceback."""
        error, text = (record.exc_info or (None, None))[1], record.getMessage()
        return not (isinstance(error, ConnectionError) or "closing transport" in text or text == "Exception raised")


def install() -> None:
    """Filter from now on."""
    for name in _LOGGERS:
        logger = logging.getLogger(name)
        if not any(isinstance(each, ClosedPages) for each in logger.filters):
            logger.addFilter(ClosedPages())

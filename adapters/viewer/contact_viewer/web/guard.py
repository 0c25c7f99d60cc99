"""Who may talk to the server: only pages that it served itself, to whoever was given the key of this start.

A default trame server has the secret "wslink-secret" and takes every Origin: any page in the artist's browser could
read and edit the scene (tested). So requests need a key that is random for each start, in the address that is
opened or in the cookie that it leaves; the Host has to be this machine, or a foreign name that resolves to it would
pass as the same origin (DNS rebinding); and an Origin, where there is one, has to be ours.
"""

from __future__ import annotations

import hmac
import secrets
from collections.abc import Mapping
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import urlsplit

LOCAL = ("127.0.0.1", "localhost")
HOST = LOCAL[0]  # what the server binds
_PAGES = ("/", "/index.html")
_HEADERS = {
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
}


class Guard:
    """The key of one start, and what it lets through."""

    def __init__(self) -> None:
        self.key = secrets.token_urlsafe(24)
        self._cookie = f"contact-{secrets.token_hex(4)}"  # cookies know no ports: two servers must not share one

    def address(self, port: int) -> str:
        """What an artist opens."""
        return f"http://{HOST}:{port}/?secret={self.key}"

    def refusal(self, headers: Mapping[str, str], query: Mapping[str, str]) -> str | None:
        """Why a request is refused, in a sentence; None where it is not."""
        host = headers.get("Host", "")
        if (urlsplit(f"//{host}").hostname or "") not in LOCAL:
            return f"This server answers to {' and '.join(LOCAL)} alone."
        origin = headers.get("Origin")
        if origin is not None and (urlsplit(origin).netloc != host or urlsplit(origin).scheme != "http"):
            return "Pages of other origins may not talk to this server."
        if not self._knows_key(headers, query):
            return "The key is missing or from an earlier start: open the address that `contact view` printed."
        return None

    def _knows_key(self, headers: Mapping[str, str], query: Mapping[str, str]) -> bool:
        given = [query.get("secret", "")]
        try:
            cookie = SimpleCookie(headers.get("Cookie", "")).get(self._cookie)
        except CookieError:
            cookie = None
        if cookie is not None:
            given.append(cookie.value)
        return any(hmac.compare_digest(each.encode(), self.key.encode()) for each in given)

    def protect(self, web_app: Any) -> None:
        """Ask before every request of an aiohttp application, the opening of web sockets among them."""
        from aiohttp import web

        async def ask(request: Any, handler: Any) -> Any:
            refusal = self.refusal(request.headers, request.query)
            if refusal is not None:
                return web.Response(status=403, text=refusal + "\n", headers=_HEADERS)
            if request.path in _PAGES and "secret" not in request.query:  # a page that is loaded again has lost it
                raise web.HTTPFound(f"/index.html?secret={self.key}")
            response = await handler(request)
            if not response.prepared:  # a web socket is
                response.headers.update(_HEADERS)
                response.set_cookie(self._cookie, self.key, httponly=True, samesite="Strict")
            return response

        web_app.middlewares.append(web.middleware(ask))

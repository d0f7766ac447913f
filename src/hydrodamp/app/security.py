"""Access to a local server: loopback host, token, origin, and headers of all responses.

A page of another site can send requests to a local port. It knows no token, its Origin differs,
and a name that it rebinds to 127.0.0.1 is in the Host header: each of the three is checked.
"""

from __future__ import annotations

import hmac
from collections.abc import Mapping
from urllib.parse import parse_qs, quote

from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import cookie_parser
from starlette.responses import PlainTextResponse, RedirectResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from hydrodamp.app.web import MESSAGE_HEADERS

#: Names of the loopback interface.
LOOPBACK = ("127.0.0.1", "localhost")

#: Headers of all pages; no inline script or event handler runs.
HEADERS: Mapping[str, str] = {
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' "
        "data:; connect-src 'self'; frame-src 'self'; form-action 'self'; base-uri 'none'; "
        "frame-ancestors 'self'"
    ),
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "same-origin",
    "Cache-Control": "no-store",
    "Cross-Origin-Resource-Policy": "same-origin",
}


class LocalAccess:
    """Middleware that refuses requests without the token, or from another host or origin."""

    def __init__(self, app: ASGIApp, token: str, port: int) -> None:
        self.app, self.token = app, token
        self.cookie = f"hydrodamp-{port}"
        self.hosts = {f"{name}:{port}" for name in LOOPBACK}
        self.hosts |= set(LOOPBACK) if port == 80 else set()
        self.origins = {f"http://{host}" for host in self.hosts}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, or refuse it with status 403."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in HEADERS.items():
                    headers.setdefault(name, value)
            await send(message)

        headers = Headers(scope=scope)
        query = parse_qs(scope["query_string"].decode("latin-1"))
        if fault := self._fault(headers, query, scope["method"]):
            response = PlainTextResponse(f"{fault}\n", status_code=403, headers=MESSAGE_HEADERS)
            await response(scope, receive, send_with_headers)
        elif "token" in query:
            path = "/" + quote(scope["path"].lstrip("/"))
            redirect = RedirectResponse(path, status_code=303)
            redirect.set_cookie(self.cookie, self.token, httponly=True, samesite="strict")
            await redirect(scope, receive, send_with_headers)
        else:
            await self.app(scope, receive, send_with_headers)

    def _fault(self, headers: Headers, query: Mapping[str, list[str]], method: str) -> str:
        """Return why a request is refused, empty if it is not."""
        if headers.get("host") not in self.hosts:
            return "This server answers on the loopback interface only."
        origin = headers.get("origin")
        if origin is not None and origin not in self.origins:
            return "The request comes from another site."
        cookies = cookie_parser(headers.get("cookie", ""))
        token = query.get("token", [""])[0] or cookies.get(self.cookie, "")
        if not hmac.compare_digest(token.encode(), self.token.encode()):
            return "Open the address that `hydrodamp app` printed: it holds the token."
        if method not in ("GET", "HEAD") and origin is None:
            return "A request that changes files needs its origin."
        return ""

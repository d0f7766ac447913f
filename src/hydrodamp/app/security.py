"""Access to a local server: loopback host, session, origin, and headers of all responses.

A page of another site can send requests to a local port. It has no session, its Origin differs,
and a name that it rebinds to 127.0.0.1 is in the Host header: each of the three is checked.

All users of a machine can read the command line of a browser: an address that opens a session
holds a code that works once. A code that comes again was read by another user, who may have been
the first to use it: the session ends, and another begins with the next address.

A browser sends cookies to all ports of a host: the pages, and the cookie of the session, are below
a random path, which no other server is asked for.
"""

from __future__ import annotations

import hmac
import logging
import math
import secrets
import time
from collections.abc import Callable, Mapping
from urllib.parse import parse_qs, quote

from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import cookie_parser
from starlette.responses import PlainTextResponse, RedirectResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from hydrodamp.app.web import MAX_FORM, MESSAGE_HEADERS

#: Names of the loopback interface.
LOOPBACK = ("127.0.0.1", "localhost")

#: Name of the cookie of a session.
COOKIE = "hydrodamp"

NEEDS_ADDRESS = (
    "This browser has no session. Open the latest address in the terminal of `hydrodamp app`: each "
    "works once, and ends the session if it is opened again."
)

#: The warning when a used address is opened.
ENDS = (
    "an address was opened twice, and the session has ended: if you opened it once, another user "
    "of this machine had opened it before you, could read and change the files of this folder, and "
    "start commands."
)

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

_logger = logging.getLogger("hydrodamp.app")

CLOSE: Mapping[str, str] = {"Connection": "close"}  # the rest of the body is not read


class Session:
    """The session of a server: the path of its pages, the value of its cookie, and the codes."""

    def __init__(self, port: int, announce: Callable[[str], None], start: str = "/") -> None:
        self.port, self.start, self._announce = port, start, announce
        self.path = f"/{secrets.token_urlsafe(16)}"
        self._begin()

    def _begin(self) -> None:
        """Invalidate the cookie and all codes."""
        self.cookie = secrets.token_urlsafe(24)
        self._codes: dict[str, float] = {}  # unused, with the end of their validity
        self._used: set[str] = set()  # of this session
        self._announced = ""

    def new_address(self, life: float = math.inf) -> str:
        """Return an address that opens the session once, within a time [s]."""
        code = secrets.token_urlsafe(24)
        self._codes[code] = time.monotonic() + life
        return f"http://{LOOPBACK[0]}:{self.port}{self.start}?code={code}"

    def announce(self) -> None:
        """Announce an address for a browser of the user's choice."""
        self._announced = self.new_address()
        self._announce(self._announced)

    def use_code(self, code: str) -> bool:
        """Return whether a code opens the session; a used one that comes again ends it.

        An announced address that is used is replaced by another.
        """
        if code in self._used:
            self._begin()
            _logger.warning(ENDS)
            self.announce()
        is_valid = time.monotonic() <= self._codes.pop(code, -math.inf)
        if is_valid:
            self._used.add(code)
            if self._announced.endswith(code):
                self.announce()
        return is_valid


class LocalAccess:
    """Middleware that refuses requests without the session, or from another host or origin."""

    def __init__(self, app: ASGIApp, session: Session) -> None:
        self.app, self.session, port = app, session, session.port
        self.hosts = {f"{name}:{port}" for name in LOOPBACK}
        self.hosts |= set(LOOPBACK) if port == 80 else set()
        self.origins = {f"http://{host}" for host in self.hosts}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, or refuse it with status 403."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return

        is_read, n_read = scope["method"] in ("GET", "HEAD"), 0
        headers = Headers(scope=scope)
        fault = self._fault(headers, scope)

        async def receive_body() -> Message:
            nonlocal is_read, n_read
            message = await receive()
            n_read += len(message.get("body", b""))
            is_read = not message.get("more_body", False)
            return message

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                # A browser reads an answer after it has sent all of a body.
                while not is_read and (not fault or n_read <= MAX_FORM):
                    await receive_body()
                added = MutableHeaders(scope=message)
                for name, value in (HEADERS if is_read else {**HEADERS, **CLOSE}).items():
                    added.setdefault(name, value)
            await send(message)

        path = self.session.path
        if fault:
            response = PlainTextResponse(f"{fault}\n", status_code=403, headers=MESSAGE_HEADERS)
            await response(scope, receive_body, send_with_headers)
        elif scope["path"].startswith(f"{path}/"):
            await self.app(scope, receive_body, send_with_headers)
        else:
            redirect = RedirectResponse(f"{path}/{quote(scope['path'].lstrip('/'))}", 303)
            redirect.set_cookie(
                COOKIE, self.session.cookie, path=path, httponly=True, samesite="strict"
            )
            await redirect(scope, receive_body, send_with_headers)

    def _fault(self, headers: Headers, scope: Scope) -> str:
        """Return why a request is refused, empty if it is not."""
        if headers.get("host") not in self.hosts:
            return "This server answers on the loopback interface only."
        origin = headers.get("origin")
        if origin is not None and origin not in self.origins:
            return "The request comes from another site."
        is_page = scope["path"].startswith(f"{self.session.path}/")
        if not (self._has_session(headers) if is_page else self._opens_session(headers, scope)):
            return NEEDS_ADDRESS
        if scope["method"] not in ("GET", "HEAD") and origin is None:
            return "A request that changes files needs its origin."
        return ""

    def _has_session(self, headers: Headers) -> bool:
        """Return whether a request has the cookie of the session."""
        cookie = cookie_parser(headers.get("cookie", "")).get(COOKIE, "")
        return hmac.compare_digest(cookie.encode(), self.session.cookie.encode())

    def _opens_session(self, headers: Headers, scope: Scope) -> bool:
        """Return whether a request uses a code; one ahead of the user's visit does not."""
        code = parse_qs(scope["query_string"].decode("latin-1")).get("code", [""])[0]
        is_visit = scope["method"] == "GET" and "sec-purpose" not in headers
        return is_visit and self.session.use_code(code)

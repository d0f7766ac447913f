"""``hydrodamp app``: serve local pages that open, map, identify and export."""

from __future__ import annotations

from pathlib import Path

from hydrodamp.cli.output import note
from hydrodamp.errors import MethodError

NEEDS = 'the local pages need starlette and uvicorn: pip install "hydrodamp[app]"'


def app(logs: list[str] | None = None, port: int = 0, browser: bool = True) -> None:
    """Serve a local page that opens, maps, identifies and exports logs, and open the browser."""
    try:
        from hydrodamp.app.server import serve
    except ModuleNotFoundError as error:
        if error.name not in ("starlette", "uvicorn", "jinja2"):
            raise
        raise MethodError(NEEDS) from error

    def announce(url: str) -> None:
        note(f"open {url} (it works once; Ctrl-C stops the server)")

    serve(Path.cwd(), logs or [], port, announce, browser)

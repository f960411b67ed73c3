"""Serves the studio on this machine, and nothing beyond it."""

from __future__ import annotations

import http.server
from functools import partial
from pathlib import Path
from typing import Any

from reluctance.base.errors import ParameterError
from reluctance.base.resources import resources


def page() -> Path:
    """The folder of the page.

    Raises
    ------
    ParameterError
        If the core was not compiled for the browser.
    """
    folder = resources("web")
    for needed in ("index.html", "reluctance.wasm", "data/drives.json"):
        if not (folder / needed).is_file():
            raise ParameterError(f"{folder / needed} is missing; `make studio` in the source tree")
    return folder


class Quiet(http.server.SimpleHTTPRequestHandler):
    """Files as they are, and no line for each."""

    extensions_map = {  # noqa: RUF012  # as the library has it
        **http.server.SimpleHTTPRequestHandler.extensions_map,
        ".js": "text/javascript",
        ".wasm": "application/wasm",
        ".srm": "application/octet-stream",
    }

    def log_message(self, *_: Any) -> None:
        pass


def serve(port: int) -> http.server.ThreadingHTTPServer:
    """A server of the page on 127.0.0.1, ready for `serve_forever`; port 0 takes a free one."""
    handler = partial(Quiet, directory=str(page()))
    try:
        return http.server.ThreadingHTTPServer(("127.0.0.1", port), handler)
    except OSError as fault:
        raise ParameterError(f"--port {port}: {fault.strerror}; take another") from None

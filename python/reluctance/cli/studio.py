"""`reluctance studio`: the core in the browser, served on this machine."""

import webbrowser
from pathlib import Path
from typing import Annotated

import typer


def studio(
    port: Annotated[int, typer.Option(min=0, max=65535, help="0 takes a free one.")] = 8000,
    browser: Annotated[bool, typer.Option(help="Open the page in the browser.")] = True,
    data: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Write the drives of the page and their limits into a folder, and do not serve.",
        ),
    ] = None,
) -> None:
    """Drives in the browser: change values, see waveforms at once."""
    from reluctance.targets.studio import serve, write_data  # the limit takes long to import

    if data is not None:
        for path in write_data(data):
            print(path)
        return
    server = serve(port)
    address = f"http://127.0.0.1:{server.server_port}/"
    print(f"{address} (Ctrl-C ends)", flush=True)
    if browser:
        webbrowser.open(address)
    try:
        server.serve_forever()
    finally:
        server.server_close()

"""Question: what does the studio look like?

    python studies/studio_picture.py [--out FILE]

Draws docs/studio.png, the picture of the README: the page of `reluctance studio` as it opens. Needs
`make studio`, Chromium and Playwright (`pip install '.[test]'`).
"""

from __future__ import annotations

import argparse
import io
import shutil
import threading
from pathlib import Path

from PIL import Image
from playwright.sync_api import sync_playwright

from reluctance.targets.studio.serve import serve

ROOT = Path(__file__).parents[1]
WIDTH, HEIGHT, STATUS = 1400, 1024, 34  # [px]; the bar with the time that the run took is left out
COLOURS = 128


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "studio.png")
    out = parser.parse_args().out
    server = serve(0)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    with sync_playwright() as playwright:
        found = shutil.which("chromium")
        browser = playwright.chromium.launch(executable_path=found, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT})
        page.goto(f"http://127.0.0.1:{server.server_port}/index.html")
        page.wait_for_selector("body[data-ran]", timeout=60000)
        shot = page.screenshot(
            clip={"x": 0, "y": 0, "width": WIDTH, "height": HEIGHT - STATUS}, animations="disabled"
        )
        browser.close()
    server.shutdown()
    Image.open(io.BytesIO(shot)).convert("RGB").quantize(COLOURS).save(out, optimize=True)


if __name__ == "__main__":
    main()

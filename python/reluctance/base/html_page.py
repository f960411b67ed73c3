"""The frame of a self-contained page: title, style and body, in one file."""

import html

STYLE = (
    "body{font-family:system-ui,sans-serif;line-height:1.4;max-width:72em;margin:1.5em auto;"
    "padding:0 1em;color:#1a1a1a}"
    "td{padding:.1em 1em .1em 0;font-variant-numeric:tabular-nums}img{max-width:100%}"
)


def html_page(title: str, body: str, *, style: str = "", head: str = "") -> str:
    """A page with its title as the heading.

    Parameters
    ----------
    title : str
        Plain text: it is escaped here.
    body : str
        What follows the heading, as HTML.
    style : str
        Rules that go before those of every page.
    head : str
        Scripts.
    """
    name = html.escape(title)
    return (
        f'<!doctype html><html lang="en"><head><meta charset="utf-8"><title>{name}</title>'
        '<meta name="viewport" content="width=device-width,initial-scale=1">'
        f"<style>{STYLE}{style}</style>{head}</head><body><h1>{name}</h1>{body}</body></html>\n"
    )

"""The code blocks of the pages, and their commands as a reader types them."""

import re
import shlex

from firmware_tools import ROOT

SHELL = ("", "console", "sh")  # languages of a block of commands


def blocks(page: str, *languages: str) -> list[str]:
    """The code blocks of a page of docs/ in these languages."""
    text = (ROOT / "docs" / page).read_text()
    found = re.findall(r"^```(\w*)\n(.*?)^```$", text, re.S | re.M)
    return [block for language, block in found if language in languages]


def commands(page: str) -> list[list[str]]:
    """The words of each `reluctance ...` of a page, in their order, without the first."""
    lines = "".join(blocks(page, *SHELL)).replace("\\\n", " ").splitlines()
    lines = [line.removeprefix("$ ") for line in lines]
    found = [line for line in lines if line.startswith("reluctance ")]
    return [shlex.split(line, comments=True)[1:] for line in found]

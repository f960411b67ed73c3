"""What people write instead of TOML, line by line, and what they mean."""

import re
import tomllib

LONGEST = 200  # of a line that a person wrote
VALUE = r"^(\s*[\w.-]+\s*=\s*)"  # a key and what follows it, up to its value
END = r"\s*(#.*)?$"
REPAIRS = (
    (r"^(\s*[\w.-]+)\s*(?:==|:=?)\s*(?==?)", r"\1 = "),  # key: value, key == value
    (r"^(\s*[\w.-]+)\s+(?=[-+\d.\"'\[{])", r"\1 = "),  # key value
    (r"^(\s*\[[\w.]+)" + END, r"\1]"),
    (r"^\s*\(([\w.]+)\)" + END, r"[\1]"),
    (VALUE + "[“”„«»‘’](.*?)[“”„«»‘’]" + END, r'\1"\2"'),
    (VALUE + r"\"([^\"#']*?)'?" + END, r'\1"\2"'),  # a quote too few, or another
    (VALUE + r"'([^\"#']*?)\"?" + END, r'\1"\2"'),
    (VALUE + r"(?:True|TRUE|yes|Yes)" + END, r"\1true"),
    (VALUE + r"(?:False|FALSE|no|No)" + END, r"\1false"),
    (VALUE + r"([A-Za-z][\w./-]*)[\"']?" + END, r'\1"\2"'),
    (VALUE + r"([-+]?)\.(\d+)" + END, r"\1\g<2>0.\3"),
    (VALUE + r"([-+]?\d+)\." + END, r"\1\2.0"),
    (VALUE + r"([-+]?)0+(\d[\d.]*)" + END, r"\1\2\3"),
    (VALUE + r"([-+]?\d{1,3})((?:[ '’]\d{3})+(?:\.\d+)?)" + END, None),  # 12 000
    (VALUE + r"(.+?)\s*(?:;\s*(?:#.*)?|//.*)$", r"\1\2"),
)
WITH_UNIT = re.compile(r"^\s*(\w+_(\w+))\s*=\s*([-+]?[\d.]+(?:[eE][-+]?\d+)?)\s*([^\W\d]+)" + END)


def meant(line: str) -> str:
    """A line that is no TOML as it was meant; empty where it is TOML, or nobody knows."""
    if len(line) > LONGEST or _parses(line):
        return ""
    for pattern, instead in REPAIRS:
        if found := re.match(pattern, line):
            if instead is None:
                new = found[1] + found[2] + re.sub(r"[ '’]", "", found[3])
            else:
                new = re.sub(pattern, instead, line)
            if _parses(new):
                return new.strip()
    if (found := WITH_UNIT.match(line)) and found[2].lower() == found[4].lower():
        return f"{found[1]} = {found[3]}"
    return ""


def _parses(line: str) -> bool:
    try:
        tomllib.loads(line)
    except tomllib.TOMLDecodeError:
        return False
    return True

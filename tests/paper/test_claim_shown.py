"""A claim of the source paper as it is written: for a terminal, and as JSON."""

import pytest

from reluctance.paper.claim import HEADING, Claim, line, text, verdict


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (None, "–"),
        ("no", "no"),
        (12.3456789, "12.346"),
        (0.00123456789, "0.0012346"),
        (99999.0, "99999"),
        (123456.7, "123457"),  # no exponent
        (1e5, "100000"),
        (-250000.4, "-250000"),
    ],
)
def test_a_value_has_five_digits_and_no_exponent(value, shown):
    assert text(value) == shown


def test_a_claim_stands_below_its_heading_and_its_numbers_have_six_digits():
    claim = Claim("torque", 41.339, 123456.789, "N m", None, verdict(0.0), "why")
    shown = line(claim)
    for words, value in (("paper", "41.339"), ("model", "123457"), ("limit", "–")):
        assert HEADING.index(words) + len(words) == shown.index(value) + len(value)
    assert shown.startswith("not confirmed") and shown.endswith("N m        torque")
    assert verdict(1.0) == "confirmed" and "why" not in shown
    written = Claim("a", 1.23456789, 1e-7, "", -1e-7, "confirmed", "").as_json()
    assert (written["paper_says"], written["model_gives"], written["physical_limit"]) == (
        *(1.23457, 0.0),
        0.0,
    )
    assert Claim("a", 2e-6, 3, "", "x", "confirmed", "").as_json()["paper_says"] == 2e-6

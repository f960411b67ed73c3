"""Numbers of pages are written anew where they differ from their files, and only there."""

import refresh_pages
from test_docs import PAGES, wrong


def test_a_page_that_agrees_with_its_files_stays_as_it_is() -> None:
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        assert refresh_pages.refreshed(text) == text, page


def test_a_wrong_number_becomes_that_of_its_file() -> None:
    cited = "<!-- docs/results.csv example=paper_rated i_rms_A -->"
    assert refresh_pages.refreshed(f"47.11 A{cited}\n") == f"48.95 A{cited}\n"
    table = "<!-- from docs/results.csv by example: torque_error_rms*100 -->\n\n"
    table += "| a | b |\n|---|---|\n| `paper_rated` | 0.48 % |\n"
    assert wrong(table)
    assert wrong(refresh_pages.refreshed(table)) == []

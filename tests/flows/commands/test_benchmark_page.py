"""Tables that benchmarks write into a page of the docs."""

from flows.benchmarks.page import check_marks, write_between


def test_only_what_stands_between_the_marks_is_replaced(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("before\n<!-- b -->\nold\n<!-- e -->\nafter\n")
    write_between(str(page), "<!-- b -->", "<!-- e -->", ["| x |", "|---|"])
    assert page.read_text() == "before\n<!-- b -->\n| x |\n|---|\n<!-- e -->\nafter\n"


def test_what_stood_below_another_table_with_the_same_end_was_lost(tmp_path):
    """The end of the table was the first of the page, and the rest went up to the second."""
    page = tmp_path / "page.md"
    other = "<!-- a -->\nkept\n<!-- e -->\n"
    page.write_text(f"{other}<!-- b -->\nold\n<!-- e -->\n{other}after\n")
    check_marks(str(page), "<!-- b -->", "<!-- e -->")
    write_between(str(page), "<!-- b -->", "<!-- e -->", ["new"])
    assert page.read_text() == f"{other}<!-- b -->\nnew\n<!-- e -->\n{other}after\n"

"""Tables that benchmarks write into a page of the docs."""

from flows.benchmarks.page import write_between


def test_only_what_stands_between_the_marks_is_replaced(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("before\n<!-- b -->\nold\n<!-- e -->\nafter\n")
    write_between(str(page), "<!-- b -->", "<!-- e -->", ["| x |", "|---|"])
    assert page.read_text() == "before\n<!-- b -->\n| x |\n|---|\n<!-- e -->\nafter\n"

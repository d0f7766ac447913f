"""The report in a browser: sorted, zoomed and turned dark by mouse and by key."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, field, replace

import pytest

from chromium import AXE, needs_chromium, open_chromium
from hydrodamp.data.log import Segment
from hydrodamp.report.files import ReportContent
from hydrodamp.report.page import write_report

from .conftest import make_band, make_comparison, make_log

pytestmark = needs_chromium

HOSTILE = "<script>window.stolen = 1</script>"


@dataclass
class Open:
    """A report that is open, and what the browser had to say of it."""

    page: object
    complaints: list[str] = field(default_factory=list)
    requests: list[str] = field(default_factory=list)


@pytest.fixture(scope="module")
def browser():
    with open_chromium() as started:
        yield started


@pytest.fixture
def report(browser, tmp_path):
    """An hour at 10 Hz with a band, three models by two methods, and hostile names."""
    log = make_log(3600.0, 10.0)
    first, second = log.segments
    hostile = Segment(HOSTILE, first.start, first.stop)
    log = replace(log, segments=(hostile, second), source=f"{HOSTILE}.csv")
    comparison = make_comparison(log, ("linear", "prestero", "fossen"), ("weak", "recommended"))
    findings = ReportContent(band=make_band(comparison))
    path = write_report(comparison, tmp_path / "report.html", findings)
    assert path.stat().st_size < 5_000_000
    context = browser.new_context(viewport={"width": 1280, "height": 900}, color_scheme="light")
    found = Open(context.new_page())
    found.page.on("console", lambda said: found.complaints.append(said.text))
    found.page.on("pageerror", lambda error: found.complaints.append(str(error)))
    found.page.on("request", lambda sent: found.requests.append(sent.url))
    found.page.goto(path.as_uri())
    yield found
    outside = [url for url in found.requests if not url.startswith(("file:", "data:"))]
    assert not found.complaints
    assert not outside
    context.close()


def unfold(page):
    """Open all that is folded."""
    page.evaluate("document.querySelectorAll('details').forEach((each) => { each.open = true; })")


def column(page, place):
    """Return the words of a column of the table of scores, top to bottom."""
    cells = page.locator(f"#score-table tbody tr > :nth-child({place})")
    return [text.strip() for text in cells.all_inner_texts()]


def test_a_head_sorts_by_its_column_and_back(report):
    report.page.get_by_role("link", name="Scores").click()  # opens the table
    head = report.page.locator("#score-table thead button", has_text="n").first
    head.click()
    up = [int(text) for text in column(report.page, 3)]
    assert up == sorted(up)
    assert len(set(up)) > 1
    head.press("Enter")
    assert [int(text) for text in column(report.page, 3)] == up[::-1]


def test_dragging_zooms_all_plots_and_the_button_goes_back(report):
    page = report.page
    view, plots = page.locator("#view"), page.locator("#plots .u-over")
    whole = view.inner_text()
    first = plots.first
    first.scroll_into_view_if_needed()
    box = first.bounding_box()
    page.mouse.move(box["x"] + 0.3 * box["width"], box["y"] + 20)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 25, steps=5)
    page.mouse.up()
    assert view.inner_text() != whole
    page.get_by_role("button", name="Whole log").click()
    assert view.inner_text() == whole


def test_a_wide_table_scrolls_in_its_box_with_a_hint_and_its_first_column(report):
    page = report.page
    for width in (390, 768, 1280):
        page.set_viewport_size({"width": width, "height": 900})
        unfold(page)
        page.wait_for_timeout(200)
        assert page.evaluate("document.documentElement.scrollWidth") == width
        box = page.locator("#score-table .wide")
        is_wide = box.evaluate("box => box.scrollWidth > box.clientWidth")
        assert page.locator("#score-table .hint").is_visible() == is_wide
        name = page.locator("#score-table tbody th").first
        before = name.bounding_box()["x"]
        box.evaluate("box => { box.scrollLeft = 200; }")
        assert name.bounding_box()["x"] == before
    assert page.locator("#score-table tbody th").count() == 6


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [390, 768, 1280])
def test_the_page_is_accessible_and_fits_the_screen(report, width, scheme):
    """axe-core finds nothing."""
    page = report.page
    page.set_viewport_size({"width": width, "height": 900})
    page.emulate_media(color_scheme=scheme)
    root = "document.documentElement"
    page.wait_for_function(f"{root}.scrollWidth === {root}.clientWidth")  # after the resize
    page.evaluate(AXE)
    violations = page.evaluate("axe.run()")["violations"]
    assert [(each["id"], each["impact"]) for each in violations] == []


def test_names_from_a_file_stay_text(report):
    page = report.page
    assert page.evaluate("window.stolen === undefined")
    assert HOSTILE in page.locator("body").inner_text()


def drawn(page):
    """Return the first plot as a picture, without the cursor over anything."""
    page.mouse.move(0, 0)
    return page.evaluate("document.querySelector('#plots canvas').toDataURL()")


def test_the_band_goes_and_comes_by_its_box(report):
    page = report.page
    unfold(page)
    box = page.get_by_role("checkbox", name="95 % band of linear by weak")
    assert box.is_checked()
    box.uncheck()
    bare = drawn(page)
    box.check()
    shaded = drawn(page)
    assert bare != shaded
    legends = page.locator("#plots .u-series", has_text="95 % band").locator("visible=true")
    assert legends.count() == 6
    page.locator("#plots .u-over").first.hover(position={"x": 300, "y": 40})
    low, high = legends.first.locator("td").inner_text().split(" to ")
    assert float(high) - float(low) == pytest.approx(0.4, abs=0.3)


def test_plots_say_in_words_what_they_show(report):
    page = report.page
    unfold(page)
    plot = page.locator("#plots canvas").first
    band = "95 % band of linear by weak"
    name = re.search(r"linear by weak, \d+ %", plot.get_attribute("aria-label")).group()
    whole = f"u [m/s] over time: measured, {name}, {band}"
    assert plot.get_attribute("aria-label") == whole
    page.get_by_role("checkbox", name=band).uncheck()
    assert plot.get_attribute("aria-label") == whole.removesuffix(f", {band}")
    page.get_by_role("checkbox", name="residuals").check()
    assert plot.get_attribute("aria-label") == f"residual of u [m/s] over time: {name}"
    page.get_by_role("checkbox", name="residuals").uncheck()
    page.get_by_role("checkbox", name="measured", exact=True).uncheck()
    page.get_by_role("checkbox", name=re.compile(r"^linear by weak, \d+ %$")).uncheck()
    assert page.locator("#plots canvas").nth(5).get_attribute("aria-label").endswith(": nothing")


def test_a_filter_hides_coefficients_of_other_axes(report):
    page = report.page
    rows = page.locator("#coefficients [data-filter]").first.locator(".forest:not([hidden])")
    assert rows.count() > 1
    page.locator("#coefficients select[data-kind=axis]").first.select_option("X")
    assert {rows.nth(k).get_attribute("data-axis") for k in range(rows.count())} == {"X"}
    assert page.locator("#sorted").inner_text().endswith(" coefficients.")


def test_tables_and_results_are_downloaded_and_copied(report):
    page = report.page
    unfold(page)
    with page.expect_download() as event:
        page.get_by_role("button", name="Download CSV: scores.csv").click()
    rows = event.value.path().read_text("utf-8").splitlines()
    assert rows[0].startswith("model,method,n,")
    assert len(rows) == 1 + page.locator("#score-table tbody tr").count()
    with page.expect_download() as event:
        page.get_by_role("button", name="Download JSON: comparison.json").click()
    assert json.loads(event.value.path().read_text("utf-8"))["format"] == "hydrodamp-comparison"
    page.get_by_role("button", name="Copy CSV: scores.csv").click()
    page.wait_for_function("document.body.innerText.match(/Copied|Clipboard refused: downloaded/)")


def test_the_wheel_zooms_after_a_click(report):
    page, view = report.page, report.page.locator("#view")
    page.locator("#plots .u-over").first.click()
    whole = view.inner_text()
    page.mouse.wheel(0, -100)
    page.wait_for_function(
        "whole => document.querySelector('#view').innerText !== whole", arg=whole
    )

"""Pictures in the page: as images with words, whatever their files hold, and never too large."""

import base64

from hydrodamp.report.files import Picture, ReportContent
from hydrodamp.report.page import comparison_page

from .conftest import take_apart

SVG = b'<svg width="252pt" height="180pt" onload="alert(1)"><script>alert(1)</script></svg>'
PLAIN = Picture("power", "Takes power.", 336, 240, SVG)


def test_a_picture_is_an_image_with_words_and_a_size(comparison):
    found = take_apart(comparison_page(comparison, ReportContent(pictures=(PLAIN,))))
    image = found.one("img")
    assert image.attributes["alt"].startswith("Figure: Power.")
    assert (image.attributes["width"], image.attributes["height"]) == ("336", "240")
    kind, _, content = image.attributes["src"].partition(",")
    assert kind == "data:image/svg+xml;base64"
    assert base64.b64decode(content) == SVG
    assert "figure" in image.inside
    (caption,) = [e for e in found.all("figcaption") if "Takes power." in e.text]
    assert caption.text.startswith("Power.")
    assert found.one("section", id="pictures")
    assert found.all("a", href="#pictures")
    assert len(found.all("script")) == len(take_apart(comparison_page(comparison)).all("script"))
    assert not found.all("svg", onload="alert(1)")
    (policy,) = (m.attributes["content"] for m in found.all("meta") if "http-equiv" in m.attributes)
    assert "default-src 'none'; img-src data:" in policy

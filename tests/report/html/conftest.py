"""A page taken apart, and comparisons of a size and a temper to test it with."""

from __future__ import annotations

from dataclasses import dataclass, field
from html.parser import HTMLParser

import numpy as np

import hydrodamp as hd
from hydrodamp.data.log import Segment
from hydrodamp.identification.predicted_error import PredictionBand
from hydrodamp.validation.compare import replayed_row

VOID = {"meta", "link", "br", "input", "img", "hr"}


@dataclass
class Element:
    """A tag with its attributes and all the text in it."""

    name: str
    attributes: dict[str, str]
    inside: tuple[str, ...]
    text: str = ""


@dataclass
class Page(HTMLParser):
    """All elements of a document in order; a tag that is not closed is a fault."""

    elements: list[Element] = field(default_factory=list)
    open: list[Element] = field(default_factory=list)

    def __post_init__(self):
        super().__init__(convert_charrefs=True)

    def handle_starttag(self, tag, attrs):
        inside = tuple(each.name for each in self.open)
        element = Element(tag, {name: value or "" for name, value in attrs}, inside)
        self.elements.append(element)
        if tag not in VOID and not self.get_starttag_text().endswith("/>"):
            self.open.append(element)

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)

    def handle_endtag(self, tag):
        assert self.open.pop().name == tag

    def handle_data(self, data):
        for element in self.open:
            element.text += data

    def all(self, name, **attributes):
        """Return the elements of a name with these attributes."""
        return [
            each
            for each in self.elements
            if each.name == name
            and all(each.attributes.get(key.rstrip("_")) == v for key, v in attributes.items())
        ]

    def one(self, name, **attributes):
        """Return the only such element."""
        (found,) = self.all(name, **attributes)
        return found


def take_apart(text):
    """Return a document taken apart."""
    page = Page()
    page.feed(text)
    page.close()
    assert not page.open
    return page


def make_log(seconds, rate, names=("dive", "turn")):
    """Return a log of several segments of equal length, each with a clock of its own."""
    n = int(seconds * rate / len(names))
    time = np.tile(np.arange(n) / rate, len(names))
    phase = np.arange(1.0, 7.0) * time[:, None] / 40.0
    rng = np.random.default_rng(5)
    velocity = np.sin(phase) + 0.05 * rng.standard_normal((len(time), 6))
    segments = tuple(Segment(name, k * n, (k + 1) * n) for k, name in enumerate(names))
    return hd.Log(time, velocity, segments=segments, source="long.csv")


def make_comparison(log, models, methods):
    """Return replays that err by noise, the later the more."""
    rng = np.random.default_rng(6)
    rows = []
    for k, (method, model) in enumerate((a, b) for a in methods for b in models):
        n = hd.catalog[model].n_coefficients
        covariance = np.diag(np.geomspace(1e-4, 1e4, n))
        damping = hd.Damping(hd.catalog[model], -np.linspace(0.5, 20.0, n), covariance)
        fit = hd.Fit(
            damping, method, hd.Status.OK, n, n_samples=log.n, provenance={"settings": method}
        )
        error = 0.1 * (k + 1) * rng.standard_normal(log.velocity.shape)
        trajectory = hd.Trajectory(log, log.velocity + error, (), "measured")
        rows.append(replayed_row(fit, hd.score(trajectory), trajectory))
    return hd.Comparison(tuple(rows), provenance={"vehicle": "vt690", "test": log.source})


def make_band(comparison, half=0.2):
    """Return a band about the chosen replay, ten times as wide at one sample in each segment."""
    run = comparison.best().trajectory
    assert run is not None
    width = np.full_like(run.velocity, half)
    width[[segment.start + len(segment) // 3 for segment in run.log.segments]] *= 10.0
    ends = run.velocity - width, run.velocity + width
    return PredictionBand(run.log, run.velocity, *ends, 0.95)

"""The whole way in a browser: from a log to a damping file and an export, without any YAML.

``HYDRODAMP_PICTURES=FOLDER`` writes the pictures of the documentation.
"""

import os
import re
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread

import pytest

import hydrodamp as hd
from chromium import AXE, needs_chromium, open_chromium

pytestmark = needs_chromium
PICTURES = os.environ.get("HYDRODAMP_PICTURES")

#: Milliseconds that a run of the smallest models may take.
RUN = 300_000

#: Milliseconds that anything else may take.
TIMEOUT = 10_000


@dataclass
class Visit:
    """An open page with what the browser reports."""

    page: object
    server: object
    complaints: list = field(default_factory=list)

    def click(self, name):
        self.page.get_by_role("button", name=name, exact=True).first.click()

    def go(self, screen):
        self.page.wait_for_load_state()  # with its styles
        if self.page.locator(".rail-menu").is_visible():
            self.page.locator(".rail-menu").click()
        steps = self.page.get_by_role("navigation", name="Steps")
        steps.get_by_role("link", name=screen, exact=True).click()
        self.page.get_by_role("heading", level=1, name=screen).wait_for()
        self.page.wait_for_load_state("networkidle")

    def wait_for_plots(self):
        """Scroll to the plots, which are drawn when they come into view."""
        self.page.locator("#series").wait_for(state="attached")
        self.page.locator("#series").scroll_into_view_if_needed()
        self.page.locator("#series[data-drawn]").wait_for()
        self.page.evaluate("window.scrollTo(0, 0)")

    def open_file(self, path):
        """Copy a file of another folder by the page, and open it."""
        self.page.locator("#chooser").set_input_files(path)
        self.page.get_by_text("1 copied").wait_for()
        self.click("Open")
        self.wait_for_plots()

    def open_listed(self, name):
        """Open a log that the page lists."""
        self.page.reload()
        self.page.get_by_label(name).check()
        self.click("Open")
        self.wait_for_plots()

    def use_vehicle(self, name):
        """Choose a vehicle of the fleet."""
        self.page.locator("select[name=name]").select_option(name)
        self.click("Use this vehicle")
        self.page.get_by_role("heading", name=name).wait_for()

    def wait_for_checks(self):
        self.page.locator("#checks .headline").wait_for()

    def check(self, name):
        """Check that nothing overflows, that axe-core has no finding, and take a picture."""
        page, root = self.page, "document.documentElement"
        page.wait_for_function(f"{root}.scrollWidth <= {root}.clientWidth")
        page.evaluate(AXE)
        found = page.evaluate("axe.run({iframes: false})")["violations"]
        assert [(each["id"], each["nodes"][0]["html"][:80]) for each in found] == [], name
        if PICTURES:
            page.evaluate("window.scrollTo(0, 0)")
            page.screenshot(path=Path(PICTURES, f"app-{name}.png"))


@pytest.fixture(scope="module")
def browser():
    with open_chromium() as started:
        yield started


WIDE = pytest.mark.parametrize("visit", [(1280, "light")], indirect=True, ids=["wide-light"])
"""For tests of what the server does, at one width."""


@pytest.fixture(params=[(1280, "light"), (768, "dark")], ids=["wide-light", "narrow-dark"])
def visit(request, browser, server):
    width, scheme = request.param
    context = browser.new_context(
        viewport={"width": width, "height": 900}, color_scheme=scheme, accept_downloads=True
    )
    context.set_default_timeout(TIMEOUT)
    opened = Visit(context.new_page(), server)
    opened.page.on("pageerror", lambda error: opened.complaints.append(str(error)))
    opened.page.on(
        "console", lambda said: said.type == "error" and opened.complaints.append(said.text)
    )
    opened.page.goto(server.address)
    yield opened
    context.close()
    assert not opened.complaints


def choose_models(visit, *names):
    """Select models on the screen of the run."""
    for box in visit.page.locator("input[name=model]").all():
        wanted = box.get_attribute("value") in names
        if box.is_checked() != wanted:
            with visit.page.expect_response(lambda answer: "/run/choice" in answer.url):
                box.click()
            idle = "() => !document.querySelector('.htmx-request')"
            visit.page.wait_for_function(idle)  # the page shows the choice


def start_run(visit):
    """Press the button of the run, whose text counts the fits."""
    visit.page.get_by_role("button", name=re.compile(r"^Run \d+ fits?$")).click()


def wait_for_text(page, line):
    """Wait until the text of the mapping on the page has a line."""
    page.wait_for_function("line => document.querySelector('#text').value.includes(line)", arg=line)


def run_and_export(visit, target="python"):
    """Run, read the verdict, and export; return the folder of the project."""
    page = visit.page
    start_run(visit)
    page.locator("#verdict .headline").wait_for(timeout=RUN)  # the page goes to the verdict
    page.locator("#plots .uplot").first.wait_for()
    visit.check("verdict")
    visit.go("Run")
    assert page.get_by_role("table", name="Finished fits").get_by_text("recommended").count()
    visit.check("run")
    page.get_by_role("link", name="Read the verdict").click()
    page.get_by_role("link", name="Continue to Take away").click()
    visit.click(f"Export {target}")
    page.get_by_role("link", name=f"Fidelity of {target}").wait_for(timeout=RUN)
    visit.check("files")
    with page.expect_download() as download:
        page.get_by_role("link", name="Download all files and commands (zip)").click()
    assert download.value.suggested_filename.endswith(".zip")
    return next(visit.server.root.glob("*.hydrodamp"))


def test_from_a_canonical_log_to_an_export(visit, campaign):
    root, page = visit.server.root, visit.page
    visit.check("open")
    hd.write_log(campaign.train, root / "elsewhere.csv")
    visit.open_file(root / "elsewhere.csv")
    visit.wait_for_checks()
    visit.check("channels")
    visit.go("Vehicle")
    visit.use_vehicle("vt690")
    visit.check("vehicle")
    visit.go("Split")
    visit.wait_for_plots()
    page.get_by_label("nothing: it zooms").check()
    visit.check("split")
    visit.go("Run")
    choose_models(visit, "fossen")
    folder = run_and_export(visit)
    damping = hd.read_damping(folder / "results/damping.json")
    assert damping.model.key == "fossen"
    assert (folder / "exported/python/fidelity.json").is_file()
    page.get_by_label("Duration [s]").fill("long")
    visit.click("Design the next dive")
    page.locator("#error-duration").get_by_text("must be a number [s]").wait_for()
    assert "422" in visit.complaints.pop()
    page.get_by_label("Duration [s]").fill("120")
    visit.click("Design the next dive")
    page.get_by_label("Next dive").get_by_text("plan.csv").wait_for(timeout=RUN)
    # The commands that the page shows repeat what it did.
    script = page.locator("#script").text_content()
    assert "hydrodamp compare logs/elsewhere.csv --vehicle vt690" in script
    assert "hydrodamp export python" in script


def test_roles_in_the_table_and_an_interval_dragged_onto_the_split(visit, campaign):
    root, page = visit.server.root, visit.page
    log, time = campaign.train, campaign.train.time
    table = [time, *log.velocity.T[[0, 1, 5]], log.commands[:, 0]]
    lines = ["t_s,fwd,sidewise,turn,rpm", *(",".join(map(repr, row)) for row in zip(*(
        each.tolist() for each in table), strict=True))]  # fmt: skip
    (root / "boat.csv").write_text("\n".join(lines), "utf-8")
    visit.open_listed("boat.csv")
    for column, role in (("fwd", "velocity.u"), ("sidewise", "velocity.v")):
        page.get_by_label(f"Role of {column}").select_option(role)
        wait_for_text(page, f"{role[-1]}: {column}")
    visit.wait_for_checks()
    page.get_by_label("Role of turn").select_option("velocity.r")
    wait_for_text(page, "r: turn")
    mapping = hd.read_mapping(root / "boat.hydrodamp/mapping.yaml")
    roles = {entry.channel: entry.column for entry in mapping.entries}
    assert roles["velocity.u"] == "fwd"
    assert roles["velocity.v"] == "sidewise"
    assert roles["velocity.r"] == "turn"
    assert page.locator("#text").input_value() == (root / "boat.hydrodamp/mapping.yaml").read_text()
    visit.check("mapped")
    visit.go("Split")
    visit.wait_for_plots()
    page.get_by_label("Training data").fill("")
    page.locator("#series .u-over").first.scroll_into_view_if_needed()
    box = page.locator("#series .u-over").first.bounding_box()
    with page.expect_response(lambda answer: answer.url.endswith("/split")):
        page.mouse.move(box["x"] + 0.1 * box["width"], box["y"] + 30)
        page.mouse.down()
        page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 30, steps=4)
        page.mouse.up()
    project = hd.files.load_yaml(root / "boat.hydrodamp/project.yaml")
    assert len(project["train"]) == 1
    start, end = map(float, project["train"][0].split(":"))
    assert start == pytest.approx(0.1 * time[-1], rel=0.1)
    assert end == pytest.approx(0.5 * time[-1], rel=0.1)


@WIDE
def test_channels_go_into_any_panel(visit, campaign):
    page = visit.page
    hd.write_log(campaign.train, visit.server.root / "dive.csv")
    visit.open_listed("dive.csv")
    first = page.get_by_role("region", name="Panel 1")
    first.get_by_label("Kind of plot").focus()  # by keys alone
    page.get_by_role("button", name="rpm", exact=True).press("Enter")
    first.get_by_role("button", name="Remove rpm").wait_for()
    first.locator(".u-axis").nth(2).wait_for(state="attached")  # rev/min beside m/s
    assert first.locator(".u-axis").count() == 3
    page.get_by_role("button", name="Add a panel").press("Enter")
    panel = page.locator(".panel").last
    for name in ("u", "r"):
        panel.get_by_label("Add a channel").select_option(name)
        panel.get_by_role("button", name=f"Remove {name} ").wait_for()
    panel.get_by_label("Kind of plot").select_option("xy")
    panel.get_by_label("r against u").wait_for()
    first.locator(".u-over").hover()
    panel.locator(".xy-values", has_text="r ").wait_for()  # the shared cursor with values
    panel.get_by_label("Kind of plot").select_option("track")
    panel.get_by_text("no position").or_(panel.get_by_label("Track, north")).first.wait_for()
    visit.check("panels")


@WIDE
def test_from_a_run_of_a_bluerov2_to_a_simulator(visit, measured_logs):
    """The measured run needs a mapping and gains; nobody writes a line of YAML."""
    folder, page = measured_logs("bluerov2_kth"), visit.page
    visit.open_file(folder / "run_11_10_52.csv")
    visit.click("Before and after")
    page.locator("#preview .uplot").first.wait_for()
    with page.expect_response(lambda answer: "/channels/step" in answer.url):
        page.get_by_role("button", name="Apply").first.click()
    page.get_by_role("button", name="Apply").wait_for(state="detached")
    visit.wait_for_checks()
    visit.check("bluerov2")
    visit.go("Vehicle")
    visit.use_vehicle("bluerov2")
    assert page.get_by_label("gain of ch_forward on X").is_checked()
    visit.check("gains")
    visit.go("Split")
    visit.wait_for_plots()
    visit.go("Run")
    choose_models(visit, "fossen")
    project = run_and_export(visit, "gz-sim")
    damping = hd.read_damping(project / "results/damping.json")
    assert damping.model.key == "fossen-gains"
    assert (project / "exported/gz-sim").is_dir()


@WIDE
def test_from_a_run_of_a_ship_to_an_export(visit, measured_logs):
    """A planar log proposes the axes X Y N and gains by the names of rudder and propeller."""
    page, folder = visit.page, measured_logs("esso_osaka")
    visit.open_file(folder / "random_06-Aug-2020_16_24_25_1.csv")
    visit.wait_for_checks()
    visit.go("Vehicle")
    page.get_by_role("radio", name="ship").check()
    for label, value in (("Length", "3"), ("Beam", "0.49"), ("Draft", "0.2"), ("Mass", "243")):
        page.get_by_label(re.compile(f"^{label}.* \\[")).fill(value)
    page.locator(".sketch.of-ship").get_by_text("243").wait_for()
    visit.check("ship")
    visit.click("Estimate")
    page.get_by_role("heading", name="my-vehicle").wait_for()
    assert page.get_by_label("Length [m]").input_value() == "3"
    ticked = page.locator("[name=gain]:checked").evaluate_all("each => each.map((e) => e.value)")
    assert ticked == ["propeller|X", "rudder|Y", "rudder|N"]
    visit.go("Split")
    visit.wait_for_plots()
    visit.go("Run")
    choose_models(visit, "fossen")
    project = run_and_export(visit)
    damping = hd.read_damping(project / "results/damping.json")
    assert {"Y_u|u|*rudder", "X_propeller*|propeller|"} <= {*damping.model.labels}


@WIDE
def test_names_of_columns_that_objects_have_are_drawn(visit):
    names = ["t_s", *(f"c{number}" for number in range(30)), "__proto__", "constructor"]
    rows = [",".join(f"{index + k}.5" for k in range(len(names))) for index in range(50)]
    (visit.server.root / "odd.csv").write_text("\n".join([",".join(names), *rows]), "utf-8")
    visit.open_listed("odd.csv")
    for name in names[-2:]:
        visit.page.get_by_role("button", name=name, exact=True).click()
        visit.page.locator(".u-legend", has_text=name).first.wait_for(state="attached")


@pytest.fixture
def stranger():
    """Another server of the machine, and the headers of the requests that reach it."""
    received = []

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self):
            received.append((self.path, self.headers["Cookie"], self.headers["Referer"]))
            self.send_response(200)
            self.end_headers()

        def log_message(self, *arguments):
            """Print nothing."""

    other = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    Thread(target=other.serve_forever).start()
    yield f"http://127.0.0.1:{other.server_port}", received
    other.shutdown()
    other.server_close()


@WIDE
def test_another_local_server_gets_no_secret(visit, stranger):
    page, (address, received) = visit.page, stranger
    start = page.url
    for path in ("/", "/p/dive/channels"):
        page.goto(address + path)
        page.goto(start)
        page.evaluate("address => { location.href = address }", address + path)
        page.wait_for_url(address + path)
        page.goto(start)
    assert [path for path, *_ in received].count("/") == 2
    for secret in (visit.server.session.path, visit.server.session.cookie):
        assert secret not in str(received)
    page.goto(start)
    page.get_by_role("heading", name="Open a log").wait_for()  # the session goes on


@WIDE
def test_a_run_is_cancelled_and_resumed(visit, campaign):
    root, page = visit.server.root, visit.page
    hd.write_log(campaign.train, root / "dive.csv")
    visit.open_listed("dive.csv")
    visit.go("Vehicle")
    visit.use_vehicle("vt690")
    visit.go("Split")
    visit.wait_for_plots()
    visit.go("Run")
    choose_models(visit, "fossen", "mcfarland-whitcomb")
    start_run(visit)
    page.get_by_role("cell", name="recommended").first.wait_for(timeout=RUN)  # a finished fit
    if page.get_by_role("button", name="Cancel").is_visible():
        visit.click("Cancel")
    page.reload()  # a page that is closed and opened again shows the same
    choose_models(visit, "fossen")
    start_run(visit)  # also while the cancelled run ends
    page.locator("#verdict .headline").wait_for(timeout=RUN)
    assert (root / "dive.hydrodamp/results/report.html").is_file()

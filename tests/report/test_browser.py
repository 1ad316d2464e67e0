"""The report in headless Chromium: no console message, every section rendered, viewer and zoom alive."""

import json
import re
import shutil
import subprocess

import pytest

from sea_ident.report import write_report

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on the PATH: the page is not shown in a browser")

PROBE = """
<script>
window.addEventListener("load", () => setTimeout(() => {
  const box = (e) => e.getBoundingClientRect();
  const canvas = document.querySelector(".viewer canvas"), paper = canvas.getContext("2d");
  const colours = () => {
    const seen = new Set();
    const pixels = paper.getImageData(0, 0, canvas.width, canvas.height).data;
    for (let i = 0; i < pixels.length; i += 4)
      if (pixels[i + 3] > 250) seen.add(pixels.slice(i, i + 3).join());
    return seen.size;
  };
  const picture = () => canvas.toDataURL();
  const slider = document.querySelector(".viewer input"), first = picture();
  slider.value = 400; slider.dispatchEvent(new Event("input"));
  const moved = picture() !== first;
  const before = picture();
  const press = (type, clientX, clientY, target) =>
    target.dispatchEvent(new PointerEvent(type, { clientX, clientY, pointerId: 1, bubbles: true }));
  canvas.setPointerCapture = () => {};
  press("pointerdown", 100, 100, canvas);
  press("pointermove", 180, 130, canvas);
  press("pointerup", 180, 130, canvas);
  const turned = picture() !== before;
  const charts = [...document.querySelectorAll('svg.chart[data-link="time"]')];
  const frame = charts[0].querySelector(".frame");
  frame.setPointerCapture = () => {};
  const view = () => charts.map((c) => c.querySelector("svg.plot").getAttribute("viewBox"));
  const ticks = () => charts[0].querySelector(".ticks").textContent;
  const unzoomed = view(), ticksBefore = ticks(), area = box(frame);
  press("pointerdown", area.left + area.width * 0.25, area.top + 5, frame);
  press("pointermove", area.left + area.width * 0.5, area.top + 5, frame);
  const tip = document.querySelector(".tip").textContent;
  press("pointerup", area.left + area.width * 0.5, area.top + 5, frame);
  const zoomed = view(), ticksAfter = ticks();
  frame.dispatchEvent(new MouseEvent("dblclick", { bubbles: true }));
  document.body.dataset.probe = JSON.stringify({
    heights: Object.fromEntries([...document.querySelectorAll("section")].map((s) => [s.id, box(s).height])),
    charts: [...document.querySelectorAll("svg.chart")].filter((c) => box(c).width > 100 && box(c).height > 50).length,
    colours: colours(), moved, turned, tip, unzoomed, zoomed, ticksBefore, ticksAfter, restored: view(),
    overflow: document.documentElement.scrollWidth - document.documentElement.clientWidth,
  });
}, 300));
</script>
"""


def browse(path, *flags: str, folder) -> tuple[str, list[str]]:
    """The page after its scripts, and what it wrote to the console."""
    command = [
        CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking",
        "--disable-component-update", "--disable-sync", "--disable-quic", f"--user-data-dir={folder}",
        "--enable-logging=stderr", "--virtual-time-budget=4000", *flags, path.as_uri(),
    ]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    return done.stdout, [line for line in done.stderr.splitlines() if "CONSOLE" in line]


@pytest.fixture(scope="module")
def probed(leg_model, tmp_path_factory):
    folder = tmp_path_factory.mktemp("browser")
    write_report(leg_model, folder / "report.html")
    text = (folder / "report.html").read_text()
    path = folder / "probed.html"
    path.write_text(text.replace("</body>", PROBE + "</body>"))
    dom, console = browse(path, "--dump-dom", "--window-size=1200,900", folder=folder / "profile")
    found = re.search(r'data-probe="([^"]*)"', dom)
    assert found, f"the page did not come to its end: {console}"
    return json.loads(found[1].replace("&quot;", '"').replace("&amp;", "&")), console, text


@pytest.mark.scenario
def test_nothing_is_written_to_the_console(probed):
    assert probed[1] == []


@pytest.mark.scenario
def test_every_section_and_chart_is_laid_out(probed):
    probe, _, text = probed
    assert len(probe["heights"]) == text.count("<section")
    assert min(probe["heights"].values()) > 80
    assert probe["charts"] == text.count('<svg class="chart"')
    assert probe["overflow"] <= 0


@pytest.mark.scenario
def test_the_viewer_draws_moves_and_turns(probed):
    probe = probed[0]
    assert probe["colours"] > 20
    assert probe["moved"]
    assert probe["turned"]


@pytest.mark.scenario
def test_dragging_zooms_all_linked_charts_and_a_double_click_undoes_it(probed):
    probe = probed[0]
    assert all(a != b for a, b in zip(probe["unzoomed"], probe["zoomed"], strict=True))
    for view in probe["zoomed"]:
        left, _, width, _ = map(float, view.split())
        assert left == pytest.approx(2500, abs=60)
        assert width == pytest.approx(2500, abs=60)
    assert probe["ticksBefore"] != probe["ticksAfter"]
    for view in probe["restored"]:
        assert [float(v) for v in view.split()] == pytest.approx([0, 0, 10_000, 10_000], abs=1e-6)


@pytest.mark.scenario
def test_the_tip_names_each_line(probed):
    assert "measured" in probed[0]["tip"]
    assert "model" in probed[0]["tip"]


@pytest.mark.scenario
def test_dark_and_print_have_colours_of_their_own(leg_model, tmp_path):
    write_report(leg_model, tmp_path / "report.html")
    script = "<script>document.body.dataset.paper = getComputedStyle(document.body).backgroundColor;</script></body>"
    text = (tmp_path / "report.html").read_text().replace("</body>", script)
    (tmp_path / "probed.html").write_text(text)
    papers = []
    for flags in ((), ("--blink-settings=preferredColorScheme=0",)):
        dom, _ = browse(tmp_path / "probed.html", "--dump-dom", *flags, folder=tmp_path / f"profile{len(papers)}")
        papers.append([int(v) for v in re.search(r'data-paper="rgb\(([^)]*)\)"', dom)[1].split(",")])
    light, dark = papers
    assert min(light) > 230
    assert max(dark) < 60
    pdf = tmp_path / "report.pdf"
    browse(tmp_path / "report.html", f"--print-to-pdf={pdf}", folder=tmp_path / "profile-print")
    assert pdf.read_bytes().startswith(b"%PDF")

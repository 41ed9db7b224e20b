"""The widget: its traits, its script with a model of the test, and the whole in JupyterLab.

The last two need Chromium (apt-get install chromium, or $CHROMIUM) and fail without it.
"""

from __future__ import annotations

import base64
import importlib
import json
import os
import pathlib
import secrets
import signal
import socket
import subprocess
import sys
import textwrap
import time
import urllib.request

import isospectrum
import nbformat
import numpy as np
import pytest

from .conftest import blobs, chromium

importlib.import_module("anywidget")

#: WebGL2 on SwiftShader, which needs no graphics card; no background requests.
FLAGS = [
    "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
]  # fmt: skip

#: Time limit on a busy machine, milliseconds.
TIMEOUT = 90_000


@pytest.fixture(scope="module")
def small() -> isospectrum.Spectrum:
    return isospectrum.compute(blobs((9, 10, 12)), error=0.4, backend="cpu", name="blobs", progress=False)


@pytest.fixture(scope="module")
def browser():
    from playwright.sync_api import sync_playwright

    path = chromium()
    assert path, "no chromium: apt-get install chromium, or set $CHROMIUM to its path"
    with sync_playwright() as playwright:
        launched = playwright.chromium.launch(executable_path=path, args=FLAGS)
        yield launched
        launched.close()


# Its traits.


def test_the_isovalue_is_a_trait(small):
    w = small.widget("50%")
    assert w.isovalue == small.isovalue("50%") and w.range == small.range and w.height == 480
    seen = []
    w.observe(lambda change: seen.append(change.new), names="isovalue")
    w.isovalue = 0.3
    assert seen == [0.3]
    with pytest.raises(isospectrum.RangeError, match="outside the range"):
        w.isovalue = 7
    assert w.isovalue == 0.3
    part = small.widget(range=(0.2, "60%"), height=300, title="Part")
    assert part.range == (0.2, small.isovalue("60%")) and 0.2 <= part.isovalue <= part.range[1]
    assert "<h1>Part</h1>" in part._page
    # The browser sets the state in the same way as other front ends.
    w.set_state({"isovalue": 0.4})
    assert w.isovalue == 0.4 and seen == [0.3, 0.4]


def test_its_picture_is_shown_where_no_widget_can_be(small, monkeypatch):
    w = small.widget(0.3, height=120, color="quality", clip="x:50%", title="Part")
    data, _ = w._repr_mimebundle_()
    assert data["application/vnd.jupyter.widget-view+json"]["model_id"] == w.model_id
    same = {"size": (160, 120), "color": "quality", "clip": "x:50%"}
    assert base64.b64decode(data["image/png"]) == small.render(0.3, **same)._repr_png_()
    w.isovalue = 0.5
    moved, _ = w._repr_mimebundle_()
    assert base64.b64decode(moved["image/png"]) == small.render(0.5, **same)._repr_png_()

    def without_adapter(*args, **options):
        raise isospectrum.GpuError("no adapter")

    monkeypatch.setattr(isospectrum.Spectrum, "render", without_adapter)
    data, _ = w._repr_mimebundle_()
    assert "image/png" not in data and "blobs" in data["text/html"]


# Its script.

HARNESS = """<!DOCTYPE html><meta charset="utf-8"><link rel="icon" href="data:,"><body><script type="module">
const source = document.getElementById("source").textContent;
const { default: widget } = await import(URL.createObjectURL(new Blob([source], { type: "text/javascript" })));
window.modelOf = (state) => {
    const listeners = new Map();
    return {
        saved: 0,
        get: (name) => state[name],
        set(name, value) {
            if (state[name] === value) return;
            state[name] = value;
            for (const listener of listeners.get(`change:${name}`) ?? []) listener();
        },
        save_changes() { this.saved += 1; },
        on: (event, listener) => listeners.set(event, [...(listeners.get(event) ?? []), listener]),
        off: (event, listener) => listeners.set(event, (listeners.get(event) ?? []).filter((other) => other !== listener)),
        listeners: () => [...listeners.values()].flat().length,
    };
};
window.show = (model) => {
    const el = document.createElement("div");
    document.body.append(el);
    const clean = widget.render({ model, el });
    return { el, frame: el.firstChild, clean };
};
window.page = JSON.parse(document.getElementById("page").textContent);
window.isLoaded = true;
</script><script type="text/plain" id="source">%s</script><script type="application/json" id="page">%s</script>"""


@pytest.fixture(scope="module")
def harness(browser, small, tmp_path_factory):
    script = (pathlib.Path(isospectrum.__file__).parent / "widget.js").read_text()
    page = json.dumps(small.widget(0.3)._page).replace("<", "\\u003c")
    path = tmp_path_factory.mktemp("harness") / "harness.html"
    path.write_text(HARNESS % (script, page))
    tab = browser.new_page(viewport={"width": 900, "height": 700})
    tab.set_default_timeout(TIMEOUT)
    tab.complaints = []
    # Without WebGPU the browser logs a message, and the page uses WebGL2.
    expected = ("No available adapters.",)
    is_bad = lambda m: m.type in ("error", "warning") and m.text not in expected  # noqa: E731
    tab.on("console", lambda m: tab.complaints.append(m.text) if is_bad(m) else None)
    tab.on("pageerror", lambda error: tab.complaints.append(str(error)))
    tab.goto(path.as_uri())
    tab.wait_for_function("window.isLoaded")
    yield tab
    tab.close()


def until(tab, holds) -> None:
    """Waits until a condition holds; the elements that it uses may not exist yet."""
    from playwright.sync_api import Error

    ends = time.monotonic() + TIMEOUT / 1000
    while time.monotonic() < ends:
        try:
            if holds():
                return
        except Error:
            pass
        tab.wait_for_timeout(50)
    assert holds()


def frames(tab) -> list:
    """The frames of a tab that show a page of ours."""
    return [frame for frame in tab.frames if frame.parent_frame]


def ready(tab, n: int) -> list:
    """The frames of a tab once there are n, all showing their surface."""
    until(tab, lambda: len(frames(tab)) == n)
    for frame in frames(tab):
        # Not by wait_for_function, which the page's content security policy forbids.
        until(tab, lambda frame=frame: frame.evaluate("document.documentElement.dataset.ready"))
    return frames(tab)


def shown(frame) -> float:
    return frame.evaluate("window.isospectrum.getState().isovalue")


def test_the_script_synchronizes_model_and_pages(harness, small):
    low, high = small.range
    harness.evaluate("""() => {
        window.model = modelOf({ _page: page, isovalue: 0.3, height: 400 });
        window.views = [show(model), show(model)];
    }""")
    one, two = ready(harness, 2)
    assert [shown(one), shown(two)] == [0.3, 0.3]
    # From the model to both pages.
    harness.evaluate("model.set('isovalue', 0.5)")
    until(harness, lambda: shown(one) == shown(two) == 0.5)
    assert harness.evaluate("model.saved") <= 1, "changes from the model are not sent back"
    # From one page to the model, and from there to the other.
    one.evaluate("window.isospectrum.setIsovalue(0.2)")
    harness.wait_for_function("model.get('isovalue') === 0.2")
    until(harness, lambda: shown(two) == 0.2)
    # Messages of other senders are ignored.
    harness.evaluate("window.postMessage({ isospectrum: 'isovalueChanged', isovalue: 0.7 }, '*')")
    harness.wait_for_timeout(300)
    assert harness.evaluate("model.get('isovalue')") == 0.2 and low < 0.2 < high
    harness.evaluate("model.set('height', 333)")
    assert [view.bounding_box()["height"] for view in harness.query_selector_all("iframe")] == [333, 333]
    # Listeners and frames are removed.
    harness.evaluate("views.forEach(({ clean, el }) => { clean(); el.remove(); })")
    assert harness.evaluate("model.listeners()") == 0
    until(harness, lambda: frames(harness) == [])
    assert harness.complaints == []


def test_a_closed_widget_releases_its_context(harness):
    """Browsers have 16 contexts of WebGL per page; beyond that they drop the oldest with a warning."""
    for _ in range(20):
        harness.evaluate("window.view = show(modelOf({ _page: page, isovalue: 0.3, height: 300 }))")
        (frame,) = ready(harness, 1)
        assert frame.evaluate("window.isospectrum.getState().isovalue") == 0.3
        harness.evaluate("view.clean(); view.el.remove()")
        until(harness, lambda: frames(harness) == [])
    assert harness.complaints == []


# In JupyterLab.

CELLS = [
    """
    import numpy as np, isospectrum
    z, y, x = np.indices((9, 10, 12))
    a = np.exp(-((x - 5.3) ** 2 + (y - 5.1) ** 2 + (z - 4.4) ** 2) / 9)
    s = isospectrum.compute(a, error=0.4, backend="cpu", progress=False)
    v, w = s.widget(0.3, height=360, title="One"), s.widget(0.6, height=360, title="Two")
    """,
    "v",
    "w",
    "v.isovalue = 0.45",
    """
    import pathlib
    pathlib.Path("isovalues").write_text(f"{v.isovalue!r} {w.isovalue!r}")
    """,
]


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    """A JupyterLab with one notebook: its address."""
    folder = tmp_path_factory.mktemp("lab")
    cells = [nbformat.v4.new_code_cell(textwrap.dedent(cell).strip()) for cell in CELLS]
    spec = {"name": "python3", "display_name": "Python 3", "language": "python"}
    nbformat.write(nbformat.v4.new_notebook(cells=cells, metadata={"kernelspec": spec}), folder / "two.ipynb")
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        port = s.getsockname()[1]
    token = secrets.token_hex(16)
    own = {f"JUPYTER_{name}_DIR": str(folder / name.lower()) for name in ("CONFIG", "RUNTIME")}
    server = subprocess.Popen(
        [sys.executable, "-m", "jupyterlab", "--no-browser", "--allow-root", "--ip=127.0.0.1", f"--port={port}",
         f"--IdentityProvider.token={token}", f"--ServerApp.root_dir={folder}",
         "--LabApp.news_url=", "--LabApp.check_for_updates_class=jupyterlab.NeverCheckForUpdate"],
        env={**os.environ, **own}, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    address = f"http://127.0.0.1:{port}"
    for _ in range(240):
        assert server.poll() is None, server.stderr.read()
        try:
            urllib.request.urlopen(f"{address}/api?token={token}", timeout=1)
            break
        except OSError:
            time.sleep(0.25)
    yield folder, f"{address}/lab/tree/two.ipynb?token={token}"
    server.send_signal(signal.SIGINT)
    server.terminate()
    server.wait(30)
    server.stderr.close()


def test_two_widgets_in_jupyterlab(lab, browser):
    folder, address = lab
    tab = browser.new_page(viewport={"width": 1100, "height": 1400})
    tab.set_default_timeout(TIMEOUT)
    tab.goto(address)
    tab.wait_for_selector(".jp-Notebook .jp-CodeCell")
    tab.wait_for_selector(".jp-NotebookPanel .jp-Toolbar-kernelName:has-text('Python 3')")
    # A cell that is run before the kernel is ready may never be numbered.
    tab.wait_for_selector(".jp-Notebook-ExecutionIndicator[data-status='idle']")

    def run(number: int) -> None:
        """Runs a cell and waits until it has finished."""
        cell = tab.locator(".jp-CodeCell").nth(number)
        cell.locator(".jp-InputArea-editor").click()
        cell.locator(".cm-editor.cm-focused").wait_for()
        tab.keyboard.press("Shift+Enter")
        until(tab, lambda: cell.locator(".jp-InputPrompt").inner_text().strip("[]: ").isdigit())

    for number in range(3):
        run(number)
    found = {frame.title(): frame for frame in ready(tab, 2)}
    one, two = found["One"], found["Two"]
    assert (shown(one), shown(two)) == (0.3, 0.6)
    # The second output may change the width of the first.
    sizes = [0, 0]

    def are_settled() -> bool:
        last, sizes[:] = list(sizes), [len(pixels(frame)) for frame in (one, two)]
        return sizes == last

    until(tab, are_settled)
    before = {frame: pixels(frame) for frame in (one, two)}
    # From Python: one changes, the other does not.
    run(3)
    until(tab, lambda: shown(one) == 0.45)
    assert shown(two) == 0.6
    assert (pixels(one) != before[one]).any() and (pixels(two) == before[two]).all()
    # By mouse: a quarter from the left of the second one's slider.
    slider = two.locator("#slider")
    slider.scroll_into_view_if_needed()
    box = slider.bounding_box()
    tab.mouse.click(box["x"] + 0.25 * box["width"], box["y"] + 0.5 * box["height"])
    until(tab, lambda: abs(shown(two) - 0.6) > 0.1)
    tab.wait_for_timeout(500)
    moved = shown(two)
    assert 0.1 < moved < 0.4
    run(4)
    isovalues = [float(number) for number in (folder / "isovalues").read_text().split()]
    assert isovalues == [0.45, moved]
    assert (pixels(two) != before[two]).any()
    # A screenshot on request.
    if keep := os.environ.get("ISOSPECTRUM_PICTURES"):
        tab.screenshot(path=pathlib.Path(keep) / "lab.png", full_page=True)
    tab.close()


def pixels(frame) -> np.ndarray:
    """The picture that a page shows, checked not to be empty."""
    found = frame.evaluate("""async () => {
        const { width, height, pixels } = await window.isospectrum.pixels();
        return [width, height, Array.from(pixels)];
    }""")
    picture: np.ndarray = np.array(found[2], dtype=np.uint8)
    assert len(np.unique(picture)) > 20
    return picture

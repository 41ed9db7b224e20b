// A spectrum file of the reader, dropped on a page or chosen.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { decodedPage } from "./decoded.mjs";
import { expected, folder, launch, open, pixels, ready, settled, show, state, watched } from "./browser.mjs";
import { assertClosedManifold, assertSameMesh, parsePly } from "./meshes.mjs";
import { assertSimilar } from "./pixels.mjs";

/** Positions in a page are rounded to steps along the surface, so its areas and volumes differ a little. */
const ROUNDING = 0.003;

let browser;
before(async () => { browser = await launch(); });
after(() => browser.close());

/** Chooses a file by the button. */
async function choose(page, name, buffer = readFileSync(join(folder, name))) {
    await page.locator("#file").setInputFiles({ name, mimeType: "application/octet-stream", buffer });
}

/** Drops a file on the page. */
async function drop(page, name) {
    const data = await page.evaluateHandle(([text, fileName]) => {
        const transfer = new DataTransfer();
        transfer.items.add(new File([Uint8Array.from(atob(text), (c) => c.charCodeAt(0))], fileName));
        return transfer;
    }, [readFileSync(join(folder, name)).toString("base64"), name]);
    await page.locator("#stage").dispatchEvent("dragover", { dataTransfer: data });
    await page.locator("#stage").dispatchEvent("drop", { dataTransfer: data });
}

/** Sets the isovalue and waits until it is loaded and drawn. */
async function showLoaded(page, isovalue) {
    await show(page, isovalue);
    await page.waitForFunction(() => window.isospectrum.getState().isWhole, null, { timeout: 60_000 });
    await settled(page);
}

/** Waits until a file is shown and its curves are drawn. */
async function shown(page, title) {
    await page.waitForFunction((text) => document.title === text, title);
    await ready(page);
    await page.waitForFunction(() => document.querySelector("#plot path.euler"), null, { timeout: 60_000 });
    await settled(page);
}

test("a dropped file takes the place of the page's own spectrum, with its meshes, events and curves", async () => {
    const { page, close } = await watched(browser, { acceptDownloads: true });
    await open(page, { renderer: "webgl2", isovalue: String(expected.isovalues[1]) });
    await drop(page, "large.isp");
    await shown(page, "large");
    const { low, high, isovalue } = await state(page);
    const { about } = decodedPage("unlinked.html");
    const [from, to] = [about.curves.area, about.curves.events].map((list) => list.length);
    assert.equal(isovalue, (low + high) / 2);
    assert.equal(await page.locator("h1").textContent(), "large");
    assert.equal(await page.locator(".caption, .credit, #still img").count(), 0);
    assert.match(await page.locator("#events").textContent(), new RegExp(`^${to.toLocaleString("en")} events`));
    // Every second isovalue of the curves of a page. The curves are those that the program draws.
    for (const share of [0.25, 0.5, 0.75]) {
        await showLoaded(page, low * (1 - share) + high * share);
        const at = share * (from - 1);
        const texts = await page.locator("#strips dd").allTextContents();
        const [area, volume, components, euler] = texts.map((text) => Number(text.replaceAll(",", "")));
        assert.ok(Math.abs(area / about.curves.area[at] - 1) < ROUNDING && Math.abs(volume / about.curves.volume[at] - 1) < ROUNDING, `${texts}`);
        assert.deepEqual([components, euler], [about.curves.components[at], about.curves.euler[at]]);
    }
    for (const [i, c] of expected.linked.isovalues.entries()) {
        await showLoaded(page, c);
        const started = page.waitForEvent("download");
        await page.locator("[data-format=ply]").click();
        const download = await started;
        assert.match(download.suggestedFilename(), /^large-/);
        const mesh = parsePly(readFileSync(await download.path()));
        assertClosedManifold(mesh);
        assertSameMesh(mesh, parsePly(readFileSync(join(folder, `linked-${i}.ply`))));
    }
    // An address would not lead to the file.
    assert.ok(await page.locator("#copy-link").isHidden());
    assert.ok(page.url().endsWith("#renderer=webgl2"), page.url());
    await close();
});

test("a file of bricks has closed meshes, those of extract, and as many components as the whole", async () => {
    const { page, close } = await watched(browser, { acceptDownloads: true });
    await open(page, { renderer: "webgl2" });
    await choose(page, "bricks.isp");
    await shown(page, "bricks");
    const { low, high } = await state(page);
    const { curves } = decodedPage("noise.html").about;
    for (const share of [0.25, 0.5, 0.75]) {
        await showLoaded(page, low * (1 - share) + high * share);
        const at = share * (curves.area.length - 1);
        const texts = await page.locator("#strips dd").allTextContents();
        const [, , components, euler] = texts.map((text) => Number(text.replaceAll(",", "")));
        assert.deepEqual([components, euler], [curves.components[at], curves.euler[at]]);
    }
    for (const [i, c] of expected.bricks.isovalues.entries()) {
        await showLoaded(page, c);
        const started = page.waitForEvent("download");
        await page.locator("[data-format=ply]").click();
        const mesh = parsePly(readFileSync(await (await started).path()));
        assertClosedManifold(mesh);
        assertSameMesh(mesh, parsePly(readFileSync(join(folder, `bricks-${i}.ply`))));
    }
    await close();
});

test("a second file takes the place of the first, keys and buttons act once, and it looks as its page does", async () => {
    const { page, close } = await watched(browser);
    await open(page, { renderer: "webgl2" });
    await choose(page, "large.isp");
    await shown(page, "large");
    await choose(page, "noise.isp");
    await shown(page, "noise");
    await page.keyboard.press("h");
    assert.ok(await page.locator("#help").isVisible());
    await page.keyboard.press("h");
    const { low, high } = await state(page);
    await page.keyboard.press("]");
    await settled(page);
    const after = (await state(page)).isovalue;
    assert.ok(Math.abs(after - (low + high) / 2 - (high - low) / 200) < 1e-9, `${after}`);
    const other = await watched(browser);
    await open(other.page, { renderer: "webgl2", isovalue: String(after), view: "35,22,1" }, "noise.html");
    await page.locator("#fit-all").click();
    await settled(page);
    const { view } = await state(page);
    await other.page.evaluate((same) => { location.hash = `view=${[same.azimuth, same.elevation, same.distance, ...same.target]}`; }, view);
    await other.page.waitForFunction((distance) => window.isospectrum.getState().view.distance === distance, view.distance);
    await settled(other.page);
    assertSimilar(await pixels(page), await pixels(other.page), { mean: 0.8, share: 0.01 }, "noise of a file");
    await other.close();
    await close();
});

test("a file that cannot be shown is reported in one line, and the picture stays", async () => {
    const { page, close } = await watched(browser);
    await open(page, { renderer: "webgl2" });
    const before = await state(page);
    const bytes = readFileSync(join(folder, "noise.isp"));
    const flipped = (at) => bytes.map((byte, i) => (i === at ? byte ^ 1 : byte));
    for (const [name, buffer, reason] of [
        ["a.isp", readFileSync(join(folder, "noise_9x9x9_uint8.raw")), "a.isp: not a spectrum file that this page can read"],
        ["b.isp", Buffer.alloc(0), "b.isp: not a spectrum file that this page can read"],
        ["c.isp", bytes.subarray(0, 500), "c.isp: its end is missing"],
        ["d.isp", flipped(100), "d.isp: chunk 0 is damaged, or of another file: its checksum is wrong"],
        ["e.isp", flipped(bytes.length - 60), "e.isp: section INDX is damaged: its checksum is wrong"],
        ["f.isp", flipped(bytes.length - 14), "f.isp: section INFO is missing"],
    ]) {
        await choose(page, name, buffer);
        await page.waitForFunction((text) => document.getElementById("message").textContent === text, reason, { timeout: 10_000 })
            .catch(async () => assert.equal(await page.locator("#message").textContent(), reason));
    }
    assert.deepEqual((await state(page)).isovalue, before.isovalue);
    await close();
});

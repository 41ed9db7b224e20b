// The page in a frame of another page, which sends it messages.

import assert from "node:assert/strict";
import { writeFileSync } from "node:fs";
import { join } from "node:path";
import { after, before, describe, test } from "node:test";
import { address, expected, folder, launch, watched } from "./browser.mjs";

const PARENT = `<!DOCTYPE html><meta charset="utf-8"><link rel="icon" href="data:,"><title>Parent</title>
<iframe src="page.html#renderer=webgl2" width="700" height="600"></iframe>
<script>
const waiting = new Map();
let next = 0;
window.changes = [];
window.ready = new Promise((resolve) => {
    addEventListener("message", ({ data }) => {
        if (data?.isospectrum === "ready") resolve(data.state);
        if (data?.isospectrum === "isovalueChanged") window.changes.push(data.isovalue);
        if (data?.isospectrum === "reply") waiting.get(data.id)(data);
    });
});
window.call = (name, rest) => new Promise((resolve) => {
    waiting.set(++next, resolve);
    document.querySelector("iframe").contentWindow.postMessage({ isospectrum: name, id: next, ...rest }, "*");
});
</script>`;

const ARTICLE = `<!DOCTYPE html><meta charset="utf-8"><link rel="icon" href="data:,"><title>Article</title>
<p style="height: 300px">Text.</p><iframe src="page.html#renderer=webgl2" width="560" height="360"></iframe>
<p style="height: 3000px">Text.</p>`;

describe("embedding", () => {
    let browser;
    before(async () => { browser = await launch(); });
    after(() => browser.close());

    test("messages set isovalue, view and look, get the state and a picture", async () => {
        writeFileSync(join(folder, "parent.html"), PARENT);
        const { page, close } = await watched(browser);
        await page.goto(address({}, "parent.html"));
        const ready = await page.evaluate(() => window.ready);
        assert.deepEqual([ready.low, ready.high], expected.range);
        const [, isovalue] = expected.isovalues;
        const set = await page.evaluate((c) => window.call("setIsovalue", { isovalue: c }), isovalue);
        assert.equal(set.result.isovalue, isovalue);
        const got = await page.evaluate(() => window.call("getState"));
        assert.equal(got.result.isovalue, isovalue);
        const bytes = await page.evaluate(async () => {
            const { result } = await window.call("screenshot");
            return [result.type, ...new Uint8Array(await result.arrayBuffer()).slice(1, 4)];
        });
        assert.deepEqual(bytes, ["image/png", 0x50, 0x4e, 0x47]);
        const wrong = await page.evaluate(() => window.call("setIsovalue", { isovalue: 1e9 }));
        assert.match(wrong.error, /outside/);
        const view = await page.evaluate(() => window.call("setView", { view: { azimuth: 90, distance: 2 } }));
        assert.deepEqual([view.result.view.azimuth, view.result.view.distance], [90, 2]);
        const look = await page.evaluate(() => window.call("setLook", { look: { wireframe: true, largest: 1 } }));
        assert.equal(look.result.wireframe, true);
        for (const [name, rest, reason] of [
            ["setView", { view: { elevation: 200 } }, /elevation, expected a number from -90 to 90/],
            ["setView", { view: { target: [1, 2] } }, /target, expected three numbers/],
            ["setLook", { look: { wireframe: "yes" } }, /wireframe, expected true or false/],
            ["setLook", { look: { largest: 0 } }, /largest, expected null or a number/],
        ]) {
            const refused = await page.evaluate(([n, r]) => window.call(n, r), [name, rest]);
            assert.match(refused.error, reason);
        }
        assert.ok((await page.evaluate(() => window.changes)).includes(isovalue), "changes are sent");
        await page.evaluate(() => window.call("play", { playing: true }));
        await page.waitForFunction((n) => window.changes.length > n + 2, await page.evaluate(() => window.changes.length));
        const stopped = await page.evaluate(() => window.call("play", { playing: false }));
        assert.equal(stopped.result.playing, false);
        await page.evaluate((c) => window.call("setIsovalue", { isovalue: c }), isovalue);
        // Other types are not converted: null would be 0, true 1, and [5] 5.
        const refused = await page.evaluate(async (c) => {
            const errors = [];
            for (const isovalue of ["x", String(c), null, true, [c], [], {}, NaN, undefined]) {
                errors.push((await window.call("setIsovalue", { isovalue })).error ?? `took ${isovalue}`);
            }
            return errors;
        }, isovalue);
        for (const error of refused) assert.match(error, /^isovalue .*, expected a number$/);
        assert.equal((await page.evaluate(() => window.call("getState"))).result.isovalue, isovalue);
        await close();
    });

    test("a small frame shows picture and slider, and the page around it scrolls", async () => {
        writeFileSync(join(folder, "article.html"), ARTICLE);
        const { page, close } = await watched(browser, { viewport: { width: 800, height: 700 } });
        await page.goto(address({}, "article.html"));
        const frame = page.frames()[1];
        await frame.waitForFunction(() => document.documentElement.dataset.ready);
        const boxes = await frame.evaluate(() => ["#canvas", "#slider", "#isovalue"].map((id) => {
            const { top, bottom, height } = document.querySelector(id).getBoundingClientRect();
            return { id, top, bottom, height };
        }));
        for (const { id, top, bottom } of boxes) assert.ok(top >= 0 && bottom <= 360, `${id} ${top} to ${bottom}`);
        assert.ok(boxes[0].height >= 200, `the canvas is ${boxes[0].height} high`);
        const before = await frame.evaluate(() => window.isospectrum.getState());
        await page.mouse.move(300, 420);
        await page.mouse.wheel(0, 150);
        await page.waitForFunction(() => scrollY > 100);
        const after = await frame.evaluate(() => window.isospectrum.getState());
        assert.deepEqual([after.isovalue, after.view], [before.isovalue, before.view], "the page around scrolls, the surface does not change");
        await page.mouse.move(300, 300);
        await page.keyboard.down("Control");
        await page.mouse.wheel(0, 100);
        await page.keyboard.up("Control");
        await frame.waitForFunction((d) => window.isospectrum.getState().view.distance > d, before.view.distance);
        assert.equal(await frame.evaluate(() => getComputedStyle(document.getElementById("canvas")).touchAction), "pan-y");
        await close();
    });
});

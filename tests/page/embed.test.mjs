// The page in a frame of another page, which talks to it by messages.

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
window.ready = new Promise((resolve) => {
    addEventListener("message", ({ data }) => {
        if (data?.isospectrum === "ready") resolve(data.state);
        if (data?.isospectrum === "reply") waiting.get(data.id)(data);
    });
});
window.call = (name, rest) => new Promise((resolve) => {
    waiting.set(++next, resolve);
    document.querySelector("iframe").contentWindow.postMessage({ isospectrum: name, id: next, ...rest }, "*");
});
</script>`;

describe("embedding", () => {
    let browser;
    before(async () => { browser = await launch(); });
    after(() => browser.close());

    test("messages set the isovalue, tell the state and take a picture", async () => {
        writeFileSync(join(folder, "parent.html"), PARENT);
        const { page, close } = await watched(browser);
        await page.goto(address({}, "parent.html"));
        const ready = await page.evaluate(() => window.ready);
        assert.deepEqual([ready.low, ready.high], expected.range);
        const [, isovalue] = expected.isovalues;
        const set = await page.evaluate((c) => window.call("setIsovalue", { isovalue: c }), isovalue);
        assert.equal(set.result.isovalue, isovalue);
        const told = await page.evaluate(() => window.call("getState"));
        assert.equal(told.result.isovalue, isovalue);
        const bytes = await page.evaluate(async () => {
            const { result } = await window.call("screenshot");
            return [result.type, ...new Uint8Array(await result.arrayBuffer()).slice(1, 4)];
        });
        assert.deepEqual(bytes, ["image/png", 0x50, 0x4e, 0x47]);
        const wrong = await page.evaluate(() => window.call("setIsovalue", { isovalue: 1e9 }));
        assert.match(wrong.error, /outside/);
        // Nothing is made a number: null would be 0, true 1, and [5] 5.
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
});

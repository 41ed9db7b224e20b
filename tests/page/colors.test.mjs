// Colours, compared with pictures of `isospectrum render`, and their controls.

import assert from "node:assert/strict";
import { join } from "node:path";
import { after, before, describe, test } from "node:test";
import { expected, folder, launch, open, openLook, pixels, reopen, settled, setNativeSize, state, watched } from "./browser.mjs";
import { assertSimilar, decodePng, difference, readPng } from "./pixels.mjs";

/**
 * The page compared with native pictures. Positions are rounded by half a step of 1/40 voxel across the surface and four times
 * that along it, after those of the file (1/128 and 4/128), which changes the quality and curvature of small triangles; a field has
 * 254 steps.
 */
const BOUNDS = {
    quality: { mean: 1, share: 0.012 }, lifetime: { mean: 0.2, share: 0.005 },
    curvature: { mean: 0.65, share: 0.006 }, field: { mean: 0.4, share: 0.005 },
};

describe("colours", () => {
    let browser;
    before(async () => { browser = await launch(); });
    after(() => browser.close());

    for (const renderer of ["webgpu", "webgl2"]) {
        test(`pictures are those of render: ${renderer}`, async () => {
            const { page, close } = await watched(browser);
            await open(page, { renderer, view: expected.view, isovalue: String(expected.colors) }, "field.html");
            assert.equal((await state(page)).color, "field", "the author's choice");
            await setNativeSize(page);
            for (const [color, bound] of Object.entries(BOUNDS)) {
                await page.locator("#color").evaluate((select, value) => {
                    select.value = value;
                    select.dispatchEvent(new Event("change"));
                }, color);
                await settled(page);
                const native = readPng(join(folder, `color-${color}.png`));
                assertSimilar(await pixels(page), native, bound, `${renderer}, ${color}`);
                const legend = await page.locator("#legend").innerText();
                const { ends } = await state(page);
                for (const end of ends) assert.ok(legend.includes(String(Number(end.toPrecision(3)))), `${legend}: ${end}`);
            }
            await close();
        });
    }

    test("map, scale, surface and background can be chosen, and the address restores them", async () => {
        const { page, close } = await watched(browser);
        await open(page, { renderer: "webgl2" });
        const plain = await pixels(page);
        assert.ok(await page.locator("#legend").isHidden());
        assert.equal(await page.locator("#color option[value=field]").count(), 0, "there is no field");
        await openLook(page);
        await page.locator("#front").fill("#c8503c");
        await settled(page);
        assert.ok(difference(plain, await pixels(page)).share > 0.05, "the surface has another colour");
        await page.selectOption("#color", "quality");
        await page.selectOption("#map", "magma");
        await page.locator("#scale").fill("0.5:0.9");
        await page.locator("#scale").press("Enter");
        await settled(page);
        assert.deepEqual((await state(page)).ends, [0.5, 0.9]);
        await page.locator("#scale").fill("p10:p90");
        await page.locator("#scale").press("Enter");
        await settled(page);
        const [low, high] = (await state(page)).ends;
        assert.ok(low > 0.2 && low < high && high < 1, `${low} to ${high}`);
        await page.waitForFunction(() => /scale=p10(:|%3A)p90/.test(location.hash));
        await reopen(page);
        assert.deepEqual((await state(page)).ends, [low, high]);
        await openLook(page);
        await page.locator("#scale").fill("0.5:0.9");
        await page.locator("#scale").press("Enter");
        await settled(page);
        for (const wrong of ["0.9:0.5", "p101:1", "1:2:3"]) {
            await page.locator("#scale").fill(wrong);
            await page.locator("#scale").press("Enter");
            assert.equal(await page.locator("#scale").getAttribute("aria-invalid"), "true", wrong);
            assert.deepEqual((await state(page)).ends, [0.5, 0.9], wrong);
        }
        await page.locator("#scale").fill("much");
        await page.locator("#scale").press("Enter");
        assert.equal(await page.locator("#scale").getAttribute("aria-invalid"), "true");
        await page.waitForFunction(() => location.hash.includes("map=magma") && location.hash.includes("scale=0.5"));
        await reopen(page);
        assert.deepEqual((await state(page)).ends, [0.5, 0.9]);
        assert.equal(await page.locator("#map").inputValue(), "magma");
        await openLook(page);
        await page.selectOption("#background", "dark");
        await settled(page);
        assert.ok((await pixels(page)).pixels[0] < 60, "the background is dark");
        await close();
    });

    test("a saved picture has the legend", async () => {
        const { page, close } = await watched(browser);
        await open(page, { renderer: "webgl2", color: "quality" });
        const saved = await page.evaluate(async () => {
            const bytes = new Uint8Array(await (await window.isospectrum.screenshot()).arrayBuffer());
            return btoa(String.fromCharCode(...bytes));
        });
        const { width, height, pixels: bytes } = decodePng(Buffer.from(saved, "base64"));
        // The bar begins with the first colour of viridis.
        const letters = Math.max(0.026 * height, 12);
        const at = 4 * (Math.round(2.5 * letters) * width + Math.round(letters) + 2);
        assert.ok(bytes[at] < 90 && bytes[at + 1] < 30 && bytes[at + 2] > 60, [...bytes.subarray(at, at + 3)].join(" "));
        await close();
    });
});

// Clip plane, opacity, and further isosurfaces.

import assert from "node:assert/strict";
import { after, before, describe, test } from "node:test";
import { expected, launch, open, openLook, pixels, reopen, settled, state, watched } from "./browser.mjs";
import { assertSimilar, difference } from "./pixels.mjs";

describe("layers", () => {
    let browser;
    before(async () => { browser = await launch(); });
    after(() => browser.close());

    test("a clip plane cuts, a cap covers the cut, and WebGPU and WebGL2 agree", async () => {
        const pictures = {};
        for (const renderer of ["webgpu", "webgl2"]) {
            const { page, close } = await watched(browser);
            const [low, high] = expected.range;
            const also = `${high * 0.4 + low * 0.6},d9a46c,0.4`;
            await open(page, { renderer, isovalue: String(0.8 * high + 0.2 * low), view: expected.view, clip: "y,0.5", also });
            await settled(page);
            const { clip, extras } = await state(page);
            assert.deepEqual(clip, { axis: 1, share: 0.5, turned: false });
            assert.equal(extras.length, 1);
            pictures[renderer] = await pixels(page);
            // Without caps the inside is visible.
            await openLook(page);
            await page.getByLabel("Close at border").uncheck();
            await settled(page);
            const withoutCap = await pixels(page);
            assert.ok(difference(pictures[renderer], withoutCap).share > 0.005, `${renderer}: the cap is visible`);
            await page.getByLabel("Close at border").check();
            await openLook(page);
            await page.selectOption("#clip", "");
            await settled(page);
            assert.ok(difference(pictures[renderer], await pixels(page)).share > 0.005, `${renderer}: the cut is visible`);
            await close();
        }
        // The plane adds outlines to those of the surfaces: twice the bounds of pictures without it.
        assertSimilar(pictures.webgpu, pictures.webgl2, { mean: 0.4, share: 0.01 }, "WebGPU to WebGL2, clipped");
    });

    test("a transparent surface shows what is behind it, its own far side as well", async () => {
        for (const renderer of ["webgpu", "webgl2"]) {
            const { page, close } = await watched(browser);
            await open(page, { renderer, opacity: "0.5" });
            await settled(page);
            const half = await pixels(page);
            await openLook(page);
            await page.locator("#opacity").fill("1");
            await settled(page);
            const full = await pixels(page);
            assert.ok(difference(half, full).share > 0.01);
            const linear = (byte) => (byte / 255 <= 0.04045 ? byte / 255 / 12.92 : ((byte / 255 + 0.055) / 1.055) ** 2.4);
            let [nSurface, nLighter] = [0, 0];
            for (let i = 0; i < full.pixels.length; i += 4) {
                if (full.pixels[i] === 255) continue;
                nSurface++;
                // The near side alone is half-way from white to the opaque pixel; the far side takes light.
                if (linear(half.pixels[i]) > 0.5 + 0.5 * linear(full.pixels[i]) - 0.02) nLighter++;
            }
            // Only pixels on the outline have no far side.
            assert.ok(nSurface > 1000 && nLighter < 0.1 * nSurface, `${renderer}: ${nLighter} of ${nSurface} pixels`);
            await close();
        }
    });

    test("further isosurfaces can be added, moved and removed, and the address restores them", async () => {
        const { page, close } = await watched(browser);
        await open(page, { renderer: "webgl2" });
        const alone = await pixels(page);
        await openLook(page);
        await page.getByRole("button", { name: "Keep this isovalue" }).click();
        const value = page.locator("#also input[type=text]");
        await value.fill("30%");
        await value.press("Enter");
        await settled(page);
        const [low, high] = expected.range;
        const [extra] = (await state(page)).extras;
        assert.ok(Math.abs(extra.isovalue - (0.7 * low + 0.3 * high)) < 1e-6 * (high - low), `${extra.isovalue}`);
        assert.ok(difference(alone, await pixels(page)).share > 0.005, "another surface is visible");
        await value.fill("much");
        await value.press("Enter");
        assert.equal(await value.getAttribute("aria-invalid"), "true");
        await page.waitForFunction(() => location.hash.includes("also="));
        await reopen(page);
        assert.equal((await state(page)).extras.length, 1);
        await openLook(page);
        await page.locator("#also button").click();
        await settled(page);
        assert.deepEqual((await state(page)).extras, []);
        await close();
    });
});

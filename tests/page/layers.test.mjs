// A plane that cuts, opacity, and several isovalues at once.

import assert from "node:assert/strict";
import { after, before, describe, test } from "node:test";
import { expected, launch, open, pixels, reopen, settled, state, watched } from "./browser.mjs";
import { FAR, difference } from "./pixels.mjs";

describe("layers", () => {
    let browser;
    before(async () => { browser = await launch(); });
    after(() => browser.close());

    test("a plane cuts, its cap covers the cut, and WebGPU and WebGL2 agree", async () => {
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
            // Without caps one looks into what is cut.
            await page.getByLabel("Close at border").uncheck();
            await settled(page);
            const open_ = await pixels(page);
            assert.ok(difference(pictures[renderer], open_, FAR).share > 0.005, `${renderer}: the cap is seen`);
            await page.getByLabel("Close at border").check();
            await page.locator("summary").click();
            await page.selectOption("#clip", "");
            await settled(page);
            assert.ok(difference(pictures[renderer], await pixels(page), FAR).share > 0.005, `${renderer}: the cut is seen`);
            await close();
        }
        const found = difference(pictures.webgpu, pictures.webgl2, FAR);
        const said = `mean ${found.mean.toFixed(3)}, share ${found.share.toFixed(5)}`;
        console.log(said);
        // Outlines of the plane come to those of the surfaces: twice what plain pictures may differ by.
        assert.ok(found.mean < 0.4 && found.share < 0.01, said);
    });

    test("what one looks through hides less, whatever order its triangles are in", async () => {
        for (const renderer of ["webgpu", "webgl2"]) {
            const { page, close } = await watched(browser);
            await open(page, { renderer, opacity: "0.5" });
            await settled(page);
            // One layer alone over white: no pixel is darker than half of the way from white to what is opaque.
            const half = await pixels(page);
            await page.locator("summary").click();
            await page.locator("#opacity").fill("1");
            await settled(page);
            const full = await pixels(page);
            assert.ok(difference(half, full, FAR).share > 0.01);
            const linear = (byte) => (byte / 255 <= 0.04045 ? byte / 255 / 12.92 : ((byte / 255 + 0.055) / 1.055) ** 2.4);
            let nFar = 0;
            for (let i = 0; i < full.pixels.length; i += 4) {
                const wanted = 0.5 + 0.5 * linear(full.pixels[i]);
                // Bytes of sRGB, and samples of a pixel that are rounded by themselves.
                if (Math.abs(linear(half.pixels[i]) - wanted) > 0.02) nFar++;
            }
            // Where two triangles meet at a sample, the one that is drawn first may be the other one: 1 pixel of 230,400 was.
            assert.ok(nFar < full.pixels.length / 4 / 20_000, `${renderer}: ${nFar} pixels`);
            await close();
        }
    });

    test("isovalues are kept, moved, and taken away, and the address leads back to them", async () => {
        const { page, close } = await watched(browser);
        await open(page, { renderer: "webgl2" });
        const alone = await pixels(page);
        await page.locator("summary").click();
        await page.getByRole("button", { name: "Keep this isovalue" }).click();
        const value = page.locator("#also input[type=text]");
        await value.fill("30%");
        await value.press("Enter");
        await settled(page);
        const [low, high] = expected.range;
        const [extra] = (await state(page)).extras;
        assert.ok(Math.abs(extra.isovalue - (0.7 * low + 0.3 * high)) < 1e-6 * (high - low), `${extra.isovalue}`);
        assert.ok(difference(alone, await pixels(page), FAR).share > 0.005, "another surface is seen");
        await value.fill("much");
        await value.press("Enter");
        assert.equal(await value.getAttribute("aria-invalid"), "true");
        await page.waitForFunction(() => location.hash.includes("also="));
        await reopen(page);
        assert.equal((await state(page)).extras.length, 1);
        await page.locator("summary").click();
        await page.locator("#also button").click();
        await settled(page);
        assert.deepEqual((await state(page)).extras, []);
        await close();
    });
});

// Components: selection, colours, and tracking of picked ones.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { after, before, describe, test } from "node:test";
import { expected, folder, launch, open, reopen, settled, show, state, watched } from "./browser.mjs";
import { countComponents, parsePly } from "./meshes.mjs";

const { isovalue, keep, min_volume: minVolume, volumes } = expected.components;
const hash = { isovalue: String(isovalue) };

/** A number that the page shows. */
async function shown(page, id) {
    await page.waitForFunction((name) => !document.getElementById(name).textContent.includes("…"), id);
    return page.locator(`#${id}`).textContent();
}

describe("components", () => {
    let browser;
    before(async () => { browser = await launch(); });
    after(() => browser.close());

    test("the largest can be shown alone, as extract keeps them, and the address restores the selection", async () => {
        const { page, close } = await watched(browser);
        await open(page, hash, "noise.html");
        const all = await state(page);
        await page.selectOption("#largest", "3");
        await settled(page);
        assert.deepEqual((await state(page)).components, { n: volumes.length, nKept: keep });
        const kept = parsePly(readFileSync(join(folder, "kept.ply")));
        const { nTriangles } = await state(page);
        assert.equal(nTriangles, kept.triangles.length / 3);
        assert.ok(nTriangles < all.nTriangles);
        assert.equal(await shown(page, "components-value"), `${keep} of ${volumes.length}`);
        const volume = Number((await shown(page, "volume-value")).replaceAll(",", ""));
        const wanted = Math.abs(volumes.slice(0, keep).reduce((sum, v) => sum + v, 0));
        // Vertices are rounded by at most 1/80 voxel across the surface, over an area of at most 1 voxel^2 per triangle.
        assert.ok(Math.abs(volume - wanted) < nTriangles / 80, `${volume}, expected ${wanted}`);
        await page.waitForFunction(() => location.hash.includes("keep=3"));
        await reopen(page);
        assert.equal((await state(page)).nTriangles, nTriangles);
        assert.equal(await page.locator("#largest").inputValue(), "3");
        await page.locator("#show-all").click();
        await settled(page);
        assert.equal((await state(page)).nTriangles, all.nTriangles);
        assert.ok(await page.locator("#show-all").isDisabled());
        await close();
    });

    test("small ones can be hidden, and a text that is no volume is refused", async () => {
        const { page, close } = await watched(browser);
        await open(page, { ...hash, renderer: "webgl2" }, "noise.html");
        const field = page.locator("#min-volume");
        await field.fill(String(minVolume));
        await field.press("Enter");
        await settled(page);
        const nKept = volumes.filter((v) => Math.abs(v) >= minVolume).length;
        assert.ok(nKept > 1 && nKept < volumes.length);
        assert.deepEqual((await state(page)).components, { n: volumes.length, nKept });
        await field.fill("many");
        await field.press("Enter");
        assert.match(await page.locator("#message").textContent(), /expected a volume/);
        assert.equal((await state(page)).components.nKept, nKept);
        // A saved mesh has the same components.
        const [download] = await Promise.all([
            page.waitForEvent("download"), page.locator("[data-format=ply]").click(),
        ]);
        assert.equal(countComponents(parsePly(readFileSync(await download.path())).triangles), nKept);
        await close();
    });

    test("a picked one is kept or hidden, and tracked through the isovalue", async () => {
        const { page, close } = await watched(browser);
        await open(page, { ...hash, view: "35,22,1" }, "noise.html");
        const canvas = page.locator("#canvas");
        // A pixel well inside the surface.
        const middle = await page.evaluate(async () => {
            const { width, height, pixels } = await window.isospectrum.pixels();
            const isSurface = (x, y) => pixels[4 * (y * width + x)] < 200;
            const all = [];
            for (let y = 2; y < height - 2; y++) {
                for (let x = 2; x < width - 2; x++) {
                    if ([[0, 0], [2, 0], [-2, 0], [0, 2], [0, -2]].every(([u, v]) => isSurface(x + u, y + v))) all.push({ x, y });
                }
            }
            return all[all.length >> 1];
        });
        await canvas.hover({ position: middle });
        await page.keyboard.press("x");
        await settled(page);
        assert.deepEqual((await state(page)).components, { n: volumes.length, nKept: volumes.length - 1 });
        await page.keyboard.press("a");
        await settled(page);
        assert.equal((await state(page)).components, null, "all, not distinguished");
        // By the button and a click.
        await page.locator("#pick-keep").click();
        await canvas.click({ position: middle });
        await settled(page);
        assert.equal((await state(page)).components.nKept, 1);
        assert.equal(await page.locator("#pick-keep").getAttribute("aria-pressed"), "false");
        const { nTriangles } = await state(page);
        await show(page, isovalue * 1.02);
        assert.equal((await state(page)).components.nKept, 1);
        // Jumps far away and back: a lost component is tracked through intermediate isovalues.
        await show(page, expected.components.far);
        assert.ok((await state(page)).components.nKept <= 1);
        await show(page, isovalue);
        assert.deepEqual([(await state(page)).components.nKept, (await state(page)).nTriangles], [1, nTriangles]);
        await close();
    });
});

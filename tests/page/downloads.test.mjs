// Meshes saved by the page, compared with those of `isospectrum extract`. The files stay in the folder, where
// tests/page/browser.rs checks them as the program's own meshes.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { after, before, describe, test } from "node:test";
import { expected, folder, launch, open, openLook, show, watched } from "./browser.mjs";
import { areaOf, assertClosedManifold, parseGlb, parsePly, parseStl, welded } from "./meshes.mjs";

/** The rounding of a knot: half of four steps along the surface, and up to four steps back into the tangent plane; voxels. */
const MAX_ROUNDING = 4.5 * expected.step * 1.001;

async function downloaded(page, format, name) {
    const started = page.waitForEvent("download");
    await page.locator(`[data-format=${format}]`).click();
    const download = await started;
    assert.ok(download.suggestedFilename().endsWith(`.${format}`));
    assert.equal(await page.locator("#message").textContent(), `Saved ${download.suggestedFilename()}`);
    const path = join(folder, name);
    await download.saveAs(path);
    return readFileSync(path);
}

describe("downloads", () => {
    let browser;
    before(async () => { browser = await launch(); });
    after(() => browser.close());

    test("PLY, STL and GLB are the mesh that extract writes", async () => {
        let opened;
        for (const [i, isovalue] of expected.isovalues.entries()) {
            // Two isovalues per page: Chromium silently drops downloads beyond ten in a second.
            if (i % 2 === 0) {
                await opened?.close();
                opened = await watched(browser, { acceptDownloads: true });
                await open(opened.page, { renderer: "webgl2" });
            }
            const { page } = opened;
            await show(page, isovalue);
            const wanted = parsePly(readFileSync(join(folder, `extracted-${i}.ply`)));
            const ply = parsePly(await downloaded(page, "ply", `downloaded-${i}.ply`));
            assertClosedManifold(ply);
            assert.deepEqual(ply.triangles, wanted.triangles);
            assert.equal(ply.positions.length, wanted.positions.length);
            ply.positions.forEach((x, at) => {
                const error = Math.abs(x - wanted.positions[at]);
                assert.ok(error <= MAX_ROUNDING * expected.unit, `coordinate ${at} is off by ${error}`);
            });
            const glb = parseGlb(await downloaded(page, "glb", `downloaded-${i}.glb`));
            assert.deepEqual(glb.triangles, ply.triangles);
            assert.deepEqual(glb.positions, ply.positions);
            assert.deepEqual(glb.normals, ply.normals);
            const stl = parseStl(await downloaded(page, "stl", `downloaded-${i}.stl`));
            assert.equal(stl.length, 3 * ply.triangles.length);
            ply.triangles.forEach((v, corner) => {
                for (let axis = 0; axis < 3; axis++) {
                    assert.equal(stl[3 * corner + axis], ply.positions[3 * v + axis]);
                }
            });
        }
        await opened.close();
    });

    test("30 saved meshes are watertight, also where vertices coincide", async () => {
        const { page, close } = await watched(browser);
        // What is given to the browser as a file; it drops downloads that follow each other in short time.
        await page.addInitScript(() => {
            window.saved = [];
            const create = URL.createObjectURL;
            URL.createObjectURL = (blob) => {
                if (!/script/.test(blob.type)) window.saved.push(blob);
                return create(blob);
            };
            HTMLAnchorElement.prototype.click = () => {};
        });
        await open(page, { renderer: "webgl2" }, "noise.html");
        const read = async (format) => Buffer.from(await page.evaluate(async (name) => {
            document.querySelector(`[data-format=${name}]`).click();
            const bytes = new Uint8Array(await window.saved.pop().arrayBuffer());
            return btoa(bytes.reduce((text, byte) => text + String.fromCharCode(byte), ""));
        }, format), "base64");
        let nWelded = 0;
        for (let i = 0; i < 30; i++) {
            // Whole numbers are values of samples, where vertices coincide.
            await show(page, i < 15 ? 12 + 16 * i : 3.7 + 8.1 * i);
            const ply = parsePly(await read("ply"));
            const corners = parseStl(await read("stl"));
            const stl = welded(corners);
            for (const mesh of [ply, parseGlb(await read("glb")), stl]) assertClosedManifold(mesh);
            assert.ok(corners.every((_, at) => at % 9 > 0 || areaOf(corners.slice(at, at + 9)) > 0), "triangles have an area");
            if (stl.triangles.length < ply.triangles.length) nWelded++;
        }
        assert.ok(nWelded > 0, "vertices coincide at some isovalues");
        await close();
    });

    test("without caps the mesh is open", async () => {
        const { page, close } = await watched(browser, { acceptDownloads: true });
        await open(page, { renderer: "webgl2", isovalue: String(expected.isovalues[0]) });
        await openLook(page);
        await page.getByLabel("Close at border").uncheck();
        const ply = parsePly(await downloaded(page, "ply", "open.ply"));
        const whole = parsePly(readFileSync(join(folder, "extracted-0.ply")));
        assert.ok(ply.triangles.length > 0 && ply.triangles.length < whole.triangles.length);
        assert.throws(() => assertClosedManifold(ply));
        await close();
    });
});

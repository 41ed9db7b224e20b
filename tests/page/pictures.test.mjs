// What the page draws, against what `isospectrum render` draws and from one way to another.

import assert from "node:assert/strict";
import { join } from "node:path";
import { after, before, describe, test } from "node:test";
import { address, expected, folder, launch, open, pixels, settled, show, sizeAsNative, state, watched } from "./browser.mjs";
import { FAR, coverage, decodePng, difference, readPng } from "./pixels.mjs";

/**
 * The page against native pictures. Positions in the page are rounded by half a step of 1/40 voxel
 * at most, a tenth of a pixel here, so an outline may cross one more of the four samples of a pixel;
 * elsewhere drivers round alike to a step or two. Outlines of the torus and its caps pass through
 * some 1,500 of the 307,200 pixels: no more than those may be far off.
 */
const TO_NATIVE = { mean: 0.2, share: 0.005 };

/**
 * WebGPU against WebGL2: the same numbers by two shaders, but WebGL draws upside down, so the four
 * samples of a pixel lie mirrored, which outlines show.
 */
const TO_EACH_OTHER = { mean: 0.2, share: 0.005 };

/** The canvas on the screen against what was read back. */
const TO_SCREEN = { mean: 0, share: 0 };

function assertAlike(a, b, bound, what) {
    const found = difference(a, b, FAR);
    const said = `${what}: mean ${found.mean.toFixed(4)}, share ${found.share.toFixed(5)}`;
    console.log(said);
    assert.ok(found.mean <= bound.mean && found.share <= bound.share, said);
}

describe("pictures", () => {
    let browser;
    before(async () => { browser = await launch(); });
    after(() => browser.close());

    test("WebGPU, WebGL2 and native pictures agree at every isovalue", async () => {
        const drawn = {};
        for (const renderer of ["webgpu", "webgl2"]) {
            const { page, close } = await watched(browser);
            await open(page, { renderer, view: expected.view });
            assert.equal((await state(page)).renderer.toLowerCase(), renderer);
            await sizeAsNative(page);
            drawn[renderer] = [];
            for (const [i, isovalue] of expected.isovalues.entries()) {
                await show(page, isovalue);
                const picture = await pixels(page);
                const covered = coverage(picture);
                assert.ok(covered > 0.01 && covered < 0.9, `${renderer}, ${isovalue}: covers ${covered}`);
                const native = readPng(join(folder, `native-${i}.png`));
                assertAlike(picture, native, TO_NATIVE, `${renderer} to native, ${isovalue}`);
                const screen = decodePng(await page.locator("canvas").screenshot());
                assertAlike(picture, screen, TO_SCREEN, `${renderer} to screen, ${isovalue}`);
                drawn[renderer].push(picture);
            }
            await close();
        }
        for (const [i, isovalue] of expected.isovalues.entries()) {
            const what = `WebGPU to WebGL2, ${isovalue}`;
            assertAlike(drawn.webgpu[i], drawn.webgl2[i], TO_EACH_OTHER, what);
        }
    });

    test("the axis that the author chose points up, as in native pictures", async () => {
        const native = readPng(join(folder, "up.png"));
        for (const renderer of ["webgpu", "webgl2"]) {
            const { page, close } = await watched(browser);
            await open(page, { renderer, view: expected.view }, "up.html");
            await sizeAsNative(page);
            await show(page, expected.isovalues[1]);
            const picture = await pixels(page);
            assertAlike(picture, native, TO_NATIVE, `${renderer} to native`);
            const other = readPng(join(folder, "native-1.png"));
            assert.ok(difference(picture, other, FAR).share > 0.05, "with z upwards it looks different");
            // Angles are told as ever; what they count from is the page's own.
            await page.keyboard.press("r");
            await settled(page);
            const { view } = await state(page);
            assert.deepEqual([view.azimuth, view.elevation], [35, 22]);
            await close();
        }
    });

    test("caps, triangles and darkness show", async () => {
        for (const renderer of ["webgpu", "webgl2"]) {
            const { page, close } = await watched(browser);
            await open(page, { renderer, isovalue: String(expected.isovalues[0]) });
            const closed = await pixels(page);
            const { nTriangles } = await state(page);
            await page.getByLabel("Close at border").uncheck();
            await settled(page);
            assert.ok((await state(page)).nTriangles < nTriangles, "caps are gone");
            assert.ok(difference(closed, await pixels(page), FAR).share > 0.001);
            await page.getByLabel("Close at border").check();
            await page.keyboard.press("w");
            await settled(page);
            const wired = await pixels(page);
            assert.ok(difference(closed, wired, FAR).share > 0.01, "edges are seen");
            await page.keyboard.press("w");
            await page.emulateMedia({ colorScheme: "dark" });
            await settled(page);
            const dark = await pixels(page);
            assert.ok(coverage(dark) === 1 && dark.pixels[0] < 60, "the background is dark");
            await close();
        }
    });

    test("the first picture fits the surface, and the view stays while the isovalue moves", async () => {
        const { page, close } = await watched(browser);
        await open(page, { renderer: "webgl2" }, "ball.html");
        await settled(page);
        const { view, isovalue, low } = await state(page);
        const { width, height, pixels: shown } = await pixels(page);
        const isSeen = (x, y) => shown[4 * (y * width + x)] < 250;
        const rows = Array.from({ length: height }, (_, y) => Array.from({ length: width }, (__, x) => isSeen(x, y)).includes(true));
        // A ball in a box of which a corner is seen: its outline is 0.65 of the box's.
        const filled = rows.filter(Boolean).length / height;
        assert.ok(filled > 0.55 && !rows[0] && !rows[height - 1], `the ball fills ${filled} of the height`);
        await show(page, 0.5 * (low + isovalue));
        assert.deepEqual((await state(page)).view, view, "the view stays");
        await page.keyboard.press("r");
        await settled(page);
        const again = (await state(page)).view;
        assert.ok(again.distance > 1.1 * view.distance, "a larger ball from further away");
        // Distances count from where the volume's box fits, as before.
        await page.goto("about:blank");
        await open(page, { renderer: "webgl2", view: "35,22,1" }, "ball.html");
        await settled(page);
        assert.deepEqual((await state(page)).view, { azimuth: 35, elevation: 22, distance: 1, target: [0, 0, 0] });
        const small = coverage(await pixels(page));
        assert.ok(small < 0.05, `the ball covers ${small} where the volume fits`);
        await close();
    });

    test("without scripts there is a still picture with its isovalue, and nothing is loading", async () => {
        const { page, close } = await watched(browser, { javaScriptEnabled: false });
        await page.goto(address({}));
        assert.ok(await page.locator("#still img").isVisible());
        await page.getByText(`At isovalue ${expected.first}`).waitFor();
        await page.getByText("No scripts run here").waitFor();
        assert.ok(!(await page.locator("main").innerText()).includes("Loading"));
        await close();
    });

    test("on paper the isovalue is told", async () => {
        const { page, close } = await watched(browser);
        await open(page, { renderer: "webgl2" });
        await show(page, expected.isovalues[2]);
        assert.ok(await page.locator("#printed").isHidden());
        const typed = await page.locator("#isovalue").inputValue();
        await page.emulateMedia({ media: "print" });
        await page.waitForFunction(() => document.getElementById("euler-value").textContent !== "…");
        const told = await page.locator("#printed").innerText();
        assert.ok(told.startsWith(`Isovalue ${typed}, area without caps `), told);
        assert.match(told, /volume [\d,.]+, components 1, Euler characteristic 0$/);
        await close();
    });

    test("a way to draw that is not there, or is none, is not insisted on", async () => {
        for (const renderer of ["webgpu", "constructor", "__proto__", "nonsense"]) {
            const { page, close } = await watched(browser);
            await page.addInitScript(() => Object.defineProperty(navigator, "gpu", { value: undefined }));
            await open(page, { renderer });
            assert.equal((await state(page)).renderer, "WebGL2", renderer);
            await close();
        }
    });

    test("without WebGPU and WebGL2 there is a still picture with a sentence", async () => {
        const { page, close } = await watched(browser);
        await page.addInitScript(() => {
            Object.defineProperty(navigator, "gpu", { value: undefined });
            HTMLCanvasElement.prototype.getContext = () => null;
        });
        await page.goto(address({}));
        await page.getByText("neither WebGPU nor WebGL2").waitFor();
        assert.ok(await page.locator("#still img").evaluate((img) => img.naturalWidth > 0));
        assert.ok(await page.locator("canvas").isHidden());
        await close();
    });

    test("title, caption and credit stand in the page", async () => {
        const { page, close } = await watched(browser);
        await open(page, { renderer: "webgl2" });
        assert.equal(await page.title(), "A torus & more");
        await page.getByRole("heading", { name: "A torus & more" }).waitFor();
        await page.getByText("What is to be seen.").waitFor();
        await page.getByText("Nobody.").waitFor();
        await close();
    });

    test("without WebGPU it is WebGL2", async () => {
        const { page, close } = await watched(browser);
        await page.addInitScript(() => Object.defineProperty(navigator, "gpu", { value: undefined }));
        await open(page);
        assert.equal((await state(page)).renderer, "WebGL2");
        await close();
    });

    test("a lost WebGL2 context comes back", async () => {
        const { page, close } = await watched(browser);
        await open(page, { renderer: "webgl2" });
        await page.evaluate(() => {
            document.querySelector("canvas").getContext("webgl2").getExtension("WEBGL_lose_context").loseContext();
        });
        await page.waitForFunction(() => !document.querySelector("canvas").getContext("webgl2")?.isContextLost());
        await settled(page);
        await show(page, expected.isovalues[1]);
        assert.ok(coverage(await pixels(page)) > 0.01);
        await close();
    });
});

// Pictures of the page, compared with those of `isospectrum render` and between WebGPU and WebGL2.

import assert from "node:assert/strict";
import { join } from "node:path";
import { after, before, describe, test } from "node:test";
import { address, expected, folder, launch, open, openLook, pixels, settled, show, setNativeSize, state, watched } from "./browser.mjs";
import { TO_NATIVE, TO_SCREEN, assertSimilar, coverage, decodePng, difference, readPng } from "./pixels.mjs";

/** WebGPU compared with WebGL2, which draws upside down: the four samples of a pixel are mirrored, which changes outlines. */
const TO_EACH_OTHER = { mean: 0.2, share: 0.005 };

describe("pictures", () => {
    let browser;
    before(async () => { browser = await launch(); });
    after(() => browser.close());

    test("WebGPU, WebGL2 and native pictures agree at every isovalue", async (t) => {
        const screen = await launch({ hasGpuCompositing: true });
        t.after(() => screen.close());
        const drawn = {};
        for (const renderer of ["webgpu", "webgl2"]) {
            const { page, close } = await watched(renderer === "webgpu" ? screen : browser);
            await open(page, { renderer, view: expected.view });
            assert.equal((await state(page)).renderer.toLowerCase(), renderer);
            await setNativeSize(page);
            drawn[renderer] = [];
            for (const [i, isovalue] of expected.isovalues.entries()) {
                await show(page, isovalue);
                const picture = await pixels(page);
                const covered = coverage(picture);
                assert.ok(covered > 0.01 && covered < 0.9, `${renderer}, ${isovalue}: covers ${covered}`);
                const native = readPng(join(folder, `native-${i}.png`));
                assertSimilar(picture, native, TO_NATIVE, `${renderer} to native, ${isovalue}`);
                const shown = decodePng(await page.locator("#canvas").screenshot());
                assertSimilar(picture, shown, TO_SCREEN, `${renderer} to screen, ${isovalue}`);
                drawn[renderer].push(picture);
            }
            await close();
        }
        for (const [i, isovalue] of expected.isovalues.entries()) {
            const name = `WebGPU to WebGL2, ${isovalue}`;
            assertSimilar(drawn.webgpu[i], drawn.webgl2[i], TO_EACH_OTHER, name);
        }
    });

    test("the axis that the author chose points up, as in native pictures", async () => {
        const native = readPng(join(folder, "up.png"));
        for (const renderer of ["webgpu", "webgl2"]) {
            const { page, close } = await watched(browser);
            await open(page, { renderer, view: expected.view }, "up.html");
            await setNativeSize(page);
            await show(page, expected.isovalues[1]);
            const picture = await pixels(page);
            assertSimilar(picture, native, TO_NATIVE, `${renderer} to native`);
            const other = readPng(join(folder, "native-1.png"));
            assert.ok(difference(picture, other).share > 0.05, "with z upwards it looks different");
            // Angles have their usual values; they refer to the basis of the page.
            await page.keyboard.press("r");
            await settled(page);
            const { view } = await state(page);
            assert.deepEqual([view.azimuth, view.elevation], [35, 22]);
            await close();
        }
    });

    test("caps, edges of triangles and a dark background are drawn", async () => {
        for (const renderer of ["webgpu", "webgl2"]) {
            const { page, close } = await watched(browser);
            await open(page, { renderer, isovalue: String(expected.isovalues[0]) });
            const closed = await pixels(page);
            const { nTriangles } = await state(page);
            await openLook(page);
            await page.getByLabel("Close at border").uncheck();
            await settled(page);
            assert.ok((await state(page)).nTriangles < nTriangles, "caps are gone");
            assert.ok(difference(closed, await pixels(page)).share > 0.001);
            await page.getByLabel("Close at border").check();
            await page.keyboard.press("w");
            await settled(page);
            const wired = await pixels(page);
            assert.ok(difference(closed, wired).share > 0.01, "edges are visible");
            await page.keyboard.press("w");
            await page.emulateMedia({ colorScheme: "dark" });
            await settled(page);
            const dark = await pixels(page);
            assert.ok(coverage(dark) === 1 && dark.pixels[0] < 60, "the background is dark");
            await close();
        }
    });

    test("the first picture fits the surfaces of all isovalues, and the view stays while the isovalue moves", async () => {
        const { page, close } = await watched(browser);
        await open(page, { renderer: "webgl2" }, "ball.html");
        await settled(page);
        const { view, isovalue, low } = await state(page);
        const { width, height, pixels: bytes } = await pixels(page);
        const isSurface = (x, y) => bytes[4 * (y * width + x)] < 250;
        const rows = Array.from({ length: height }, (_, y) => Array.from({ length: width }, (__, x) => isSurface(x, y)).includes(true));
        // The largest ball fills the picture.
        const filled = rows.filter(Boolean).length / height;
        assert.ok(filled > 0.4 && !rows[0] && !rows[height - 1], `the ball fills ${filled} of the height`);
        await show(page, 0.5 * (low + isovalue));
        assert.deepEqual((await state(page)).view, view, "the view stays");
        await page.keyboard.press("r");
        await settled(page);
        const again = (await state(page)).view;
        assert.ok(Math.abs(again.distance - view.distance) < 1e-9, "the same for all isovalues");
        // A distance of 1 in the address is the one at which the volume fits.
        await page.goto("about:blank");
        await open(page, { renderer: "webgl2", view: "35,22,1" }, "ball.html");
        await settled(page);
        assert.deepEqual((await state(page)).view, { azimuth: 35, elevation: 22, distance: 1, target: [0, 0, 0] });
        const small = coverage(await pixels(page));
        assert.ok(small < 0.05, `the ball covers ${small} where the volume fits`);
        await close();
    });

    test("without scripts there is a still picture with its isovalue", async () => {
        const { page, close } = await watched(browser, { javaScriptEnabled: false });
        await page.goto(address({}));
        assert.ok(await page.locator("#still img").isVisible());
        await page.getByText(`At isovalue ${expected.first}`).waitFor();
        await page.getByText("Scripts are disabled").waitFor();
        assert.ok(!(await page.locator("main").innerText()).includes("Loading"));
        await close();
    });

    test("a page has its texts, and printed the isovalue and its measures", async () => {
        const { page, close } = await watched(browser);
        await open(page, { renderer: "webgl2" });
        assert.equal(await page.title(), "A torus & more");
        await page.getByRole("heading", { name: "A torus & more" }).waitFor();
        await page.getByText("A caption.").waitFor();
        await page.getByText("A credit.").waitFor();
        await show(page, expected.isovalues[2]);
        assert.ok(await page.locator("#printed").isHidden());
        const typed = await page.locator("#isovalue").inputValue();
        await page.emulateMedia({ media: "print" });
        await page.waitForFunction(() => document.getElementById("euler-value").textContent !== "…");
        const text = await page.locator("#printed").innerText();
        assert.ok(text.startsWith(`Isovalue ${typed}, area without caps `), text);
        assert.match(text, /volume [\d,.]+, components 1, Euler characteristic 0$/);
        await close();
    });

    test("a PDF has the surface in its proportions, on white, from WebGPU and WebGL2", async (t) => {
        const screen = await launch({ hasGpuCompositing: true });
        t.after(() => screen.close());
        for (const renderer of ["webgpu", "webgl2"]) {
            const { page, close } = await watched(renderer === "webgpu" ? screen : browser);
            await open(page, { renderer });
            const drawn = coverage(await pixels(page));
            await page.emulateMedia({ colorScheme: "dark" });
            await settled(page);
            const pdf = (await page.pdf()).toString("latin1");
            const [width, height, printed, box] = await page.evaluate(() => {
                const canvas = document.querySelector("#print-picture canvas");
                const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
                let n = 0;
                for (let i = 0; i < data.length; i += 4) if (data[i] < 245) n++;
                const { clientWidth, clientHeight } = document.getElementById("canvas");
                return [canvas.width, canvas.height, n / (data.length / 4), clientWidth / clientHeight];
            });
            assert.ok(printed > 0.05 && Math.abs(printed - drawn) < 0.05, `${renderer}: ${printed}, on the screen ${drawn}`);
            assert.ok(Math.abs(width / height - box) < 0.02, `${renderer}: ${width}x${height}`);
            assert.match(pdf, new RegExp(`/Subtype /Image\\s+/Width ${width}\\s+/Height ${height}`), renderer);
            await close();
        }
    });

    test("without WebGPU the page draws with WebGL2, whatever renderer is in the address", async () => {
        const { page, close } = await watched(browser);
        await page.addInitScript(() => Object.defineProperty(navigator, "gpu", { value: undefined }));
        for (const hash of [{}, ...["webgpu", "constructor", "__proto__", "nonsense"].map((renderer) => ({ renderer }))]) {
            await page.goto("about:blank");
            await open(page, hash);
            assert.equal((await state(page)).renderer, "WebGL2", hash.renderer);
        }
        await close();
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
        assert.ok(await page.locator("#canvas").isHidden());
        await close();
    });

    test("a lost WebGL2 context is replaced", async () => {
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

// Parallel projection, ambient occlusion, the orientation cube, saved pictures and films, the state in the address.

import assert from "node:assert/strict";
import { join } from "node:path";
import { readFileSync } from "node:fs";
import { after, before, describe, test } from "node:test";
import { expected, folder, launch, open, openLook, pixels, reopen, setAddress, setNativeSize, settled, show, state, watched } from "./browser.mjs";
import { TO_NATIVE, TO_SCREEN, assertSimilar, coverage, decodePng, difference, readPng } from "./pixels.mjs";

/**
 * The page compared with native pictures, with ambient occlusion. Occlusion has eight bits and is smoothed over 49 pixels. It is
 * found from depths, which differ at outlines and change pixels within the radius, 34 pixels here. WebGL2 has one depth per
 * pixel, not one per sample.
 */
const TO_NATIVE_OCCLUDED = { mean: 0.6, share: 0.01 };

/** The same with lines of silhouettes along the outlines, or with outlines of several surfaces: twice the bounds of one. */
const TO_NATIVE_LINED = { mean: 0.4, share: 0.01 };

const native = (name) => readPng(join(folder, `look-${name}.png`));

describe("views", () => {
    let browser;
    before(async () => { browser = await launch(); });
    after(() => browser.close());

    test("parallel projection, ambient occlusion, silhouettes and transparent surfaces are those of native pictures", async (t) => {
        const screen = await launch({ hasGpuCompositing: true });
        t.after(() => screen.close());
        for (const renderer of ["webgpu", "webgl2"]) {
            const { page, close } = await watched(renderer === "webgpu" ? screen : browser);
            const first = { renderer, view: expected.view, isovalue: String(expected.isovalues[2]) };
            const plainLook = { orthographic: "0", occlusion: "0", silhouette: "0", clip: "no" };
            const shells = { opacity: "0.4", also: `${expected.isovalues[1]},5fae84,0.5` };
            await open(page, { ...first, orthographic: "1" });
            await setNativeSize(page);
            for (const [name, hash, bound] of [
                ["parallel", { orthographic: "1", occlusion: "0" }, TO_NATIVE],
                ["hollows", { orthographic: "0", occlusion: "1" }, TO_NATIVE_OCCLUDED],
                ["both", { orthographic: "1", occlusion: "1", clip: "y,0.5" }, TO_NATIVE_OCCLUDED],
                ["silhouette", { silhouette: "1" }, TO_NATIVE_LINED],
                ["shells", shells, TO_NATIVE_LINED],
                ["section", { ...shells, clip: "y,0.5" }, TO_NATIVE_LINED],
                ["behind", { ...shells, clip: "-y,0.5" }, TO_NATIVE_LINED],
            ]) {
                await setAddress(page, { ...plainLook, ...first, ...hash });
                await show(page, expected.isovalues[2]);
                const picture = await pixels(page);
                assertSimilar(picture, native(name), bound, `${renderer}, ${name}`);
                const plain = readPng(join(folder, "native-2.png"));
                // Occlusion changes many pixels by little: the mean must be nearer to the native picture than to the plain one.
                const [own, other] = [native(name), plain].map((p) => difference(picture, p).mean);
                assert.ok(other > 2 * own, `${name}: ${other} from the plain picture, ${own} from its own`);
                const shown = decodePng(await page.locator("#canvas").screenshot());
                assertSimilar(picture, shown, TO_SCREEN, `${renderer}, ${name} on the screen`);
            }
            await close();
        }
    });

    test("the page opens as its author chose, and the address restores what the reader changed", async () => {
        const { page, close } = await watched(browser);
        await open(page, {}, "occluded.html");
        const { orthographic, occlusion } = await state(page);
        assert.deepEqual([orthographic, occlusion], [true, true]);
        await page.keyboard.press("o");
        await settled(page);
        assert.equal(await page.getByLabel("Parallel").isChecked(), false);
        await openLook(page);
        await page.getByLabel("Dark hollows").uncheck();
        await page.waitForFunction(() => location.hash.includes("occlusion=0") && location.hash.includes("orthographic=0"));
        await reopen(page);
        const again = await state(page);
        assert.deepEqual([again.orthographic, again.occlusion], [false, false]);
        await close();
    });

    test("clip plane, wireframe, colour, opacity and further isosurfaces of the author can be changed", async () => {
        const { page, close } = await watched(browser);
        await open(page, {}, "look.html");
        const [low, high] = expected.range;
        const { clip, wireframe, background, opacity, extras, isovalue } = await state(page);
        assert.deepEqual({ clip, wireframe, background, opacity }, { clip: { axis: 1, share: 0.25, turned: true }, wireframe: true, background: "dark", opacity: 0.9 });
        const at = (t) => low * (1 - t) + high * t;
        assert.ok(Math.abs(isovalue - at(0.6)) < 1e-9 && Math.abs(extras[0].isovalue - at(0.2)) < 1e-9);
        assert.deepEqual(extras.map(({ opacity: o }) => o), [0.3]);
        await openLook(page);
        assert.equal(await page.locator("#front").inputValue(), "#c8503c");
        await page.locator("#clip").selectOption("");
        await page.locator("#opacity").fill("1");
        await page.locator("#also button").click();
        await page.waitForFunction(() => ["clip=no", "opacity=1", "also=&"].every((text) => `${location.hash}&`.includes(text)));
        await reopen(page);
        const again = await state(page);
        assert.deepEqual([again.clip, again.opacity, again.extras], [null, 1, []]);
        await close();
    });

    test("the address restores every switch, colour and component that the reader chose", async () => {
        const { page, close } = await watched(browser, { viewport: { width: 1000, height: 800 } });
        await open(page, { renderer: "webgl2", view: "35,22,1" });
        const before = await state(page);
        for (const key of ["g", "w", "b", "o", "d"]) await page.keyboard.press(key);
        await openLook(page);
        await page.selectOption("#background", "dark");
        await page.selectOption("#light", "left");
        await page.locator("#front").fill("#c8503c");
        const box = await page.locator("#canvas").boundingBox();
        await page.locator("#pick-hide").click();
        // A point on the torus, in the middle row.
        const { width, height, pixels: picture } = await pixels(page);
        const row = Math.round(height / 2);
        const isRing = (x) => picture[4 * (row * width + x)] > picture[4 * (row * width + 2)] + 40;
        const columns = Array.from({ length: width }, (_, x) => x).filter(isRing);
        const column = columns[columns.length >> 2];
        await page.mouse.click(box.x + ((column + 0.5) * box.width) / width, box.y + box.height / 2);
        await settled(page);
        const chosen = await state(page);
        assert.deepEqual(chosen.components, { n: 1, nKept: 0 }, "the one component is hidden");
        await page.waitForFunction(() => location.hash.includes("without="));
        await reopen(page);
        const again = await state(page);
        for (const name of ["axes", "wireframe", "open", "orthographic", "occlusion", "background", "light"]) {
            assert.deepEqual(again[name], chosen[name], name);
            assert.notDeepEqual(again[name], before[name], name);
        }
        assert.deepEqual(again.components, chosen.components);
        assert.equal(await page.locator("#front").inputValue(), "#c8503c");
        await close();
    });

    test("a style sets background, light, colour and occlusion, and the address restores it with what was changed after it", async () => {
        const { page, close } = await watched(browser);
        await open(page, { renderer: "webgl2", view: "35,22,1" });
        await openLook(page);
        const look = async () => {
            const { background, light, occlusion } = await state(page);
            const [style, front] = await Promise.all(["#style", "#front"].map((id) => page.locator(id).inputValue()));
            return { style, background, light, occlusion, front };
        };
        const usual = await look();
        assert.deepEqual(usual, { style: "default", background: "auto", light: "upper-left", occlusion: false, front: "#73b9b6" });
        const plain = await pixels(page);
        const shown = {};
        for (const [style, background, light, occlusion] of [
            ["paper", "white", "upper-left", true], ["studio", "dark", "upper-left", true], ["flat", "white", "eye", false],
        ]) {
            await page.selectOption("#style", style);
            await settled(page);
            shown[style] = await look();
            assert.deepEqual({ ...shown[style], front: "" }, { style, background, light, occlusion, front: "" });
            assert.ok(difference(await pixels(page), plain).share > 0.05, `${style} looks different`);
        }
        assert.deepEqual(new Set(Object.values(shown).map(({ front }) => front)).size, 3, "each has its colour");
        await page.selectOption("#style", "studio");
        await page.waitForFunction(() => location.hash.includes("style=studio"));
        assert.doesNotMatch(new URL(page.url()).hash, /background|light|front|occlusion/);
        await reopen(page);
        assert.deepEqual(await look(), shown.studio);
        await page.selectOption("#light", "left");
        await page.waitForFunction(() => location.hash.includes("light=left"));
        await reopen(page);
        assert.deepEqual(await look(), { ...shown.studio, style: "", light: "left" });
        await page.selectOption("#style", "default");
        await settled(page);
        assert.deepEqual(await look(), usual);
        await close();
        // The author's style, but for the flag that wins.
        const { page: other, close: closeOther } = await watched(browser);
        await open(other, { renderer: "webgl2" }, "studio.html");
        const { background, light, occlusion } = await state(other);
        assert.deepEqual([background, light, occlusion], ["dark", "right", true]);
        assert.equal(await other.locator("#front").inputValue(), shown.studio.front);
        await closeOther();
    });

    test("occlusion is on by default on WebGPU with a graphics card only", async () => {
        const occlusionOf = async (hash, isCard, name) => {
            const { page, close } = await watched(browser);
            if (isCard) {
                // The adapter of the tests is software.
                await page.addInitScript(() => {
                    const info = { description: "a card", isFallbackAdapter: false };
                    Object.defineProperty(GPUAdapter.prototype, "info", { get: () => info });
                });
            }
            await open(page, hash, name);
            await settled(page);
            const { occlusion, renderer } = await state(page);
            assert.equal(await page.locator("#occlusion").isChecked(), occlusion);
            await close();
            return [renderer, occlusion];
        };
        assert.deepEqual(await occlusionOf({ renderer: "webgpu" }, false), ["WebGPU", false]);
        assert.deepEqual(await occlusionOf({ renderer: "webgpu" }, true), ["WebGPU", true]);
        assert.deepEqual(await occlusionOf({ renderer: "webgl2" }, true), ["WebGL2", false]);
        assert.deepEqual(await occlusionOf({ renderer: "webgpu", occlusion: "0" }, true), ["WebGPU", false]);
        assert.deepEqual(await occlusionOf({ renderer: "webgpu", style: "flat" }, true), ["WebGPU", false]);
        assert.deepEqual(await occlusionOf({ renderer: "webgpu" }, true, "bright.html"), ["WebGPU", false]);
    });

    test("on a large screen the controls are next to the picture", async () => {
        const { page, close } = await watched(browser, { viewport: { width: 1280, height: 800 } });
        await open(page, { renderer: "webgl2" });
        await openLook(page);
        const [stage, side, slider] = await Promise.all(["#stage", "#side", "#slider"].map((id) => page.locator(id).boundingBox()));
        assert.ok(stage.height > 0.5 * 800, `${stage.height} of 800`);
        assert.ok(side.x >= stage.x + stage.width && slider.y + slider.height <= 800);
        assert.ok(await page.evaluate(() => document.documentElement.scrollHeight <= innerHeight), "nothing scrolls");
        await page.setViewportSize({ width: 900, height: 800 });
        const below = await page.locator("#side").boundingBox();
        assert.ok(below.y > (await page.locator("#slider").boundingBox()).y);
        await close();
    });

    test("the target keeps its size in parallel projection, and the nearest point is picked", async () => {
        for (const renderer of ["webgpu", "webgl2"]) {
            const { page, close } = await watched(browser);
            await open(page, { renderer, isovalue: String(expected.isovalues[2]) });
            const before = coverage(await pixels(page));
            await page.keyboard.press("o");
            await settled(page);
            const after = coverage(await pixels(page));
            assert.ok(Math.abs(after / before - 1) < 0.15 && after !== before, `${before} to ${after}`);
            // The line of sight crosses the surface at least twice; the nearer point is picked and becomes the target.
            const box = await page.locator("#canvas").boundingBox();
            const [x, y] = [box.x + 0.62 * box.width, box.y + 0.5 * box.height];
            await page.mouse.dblclick(x, y);
            await settled(page);
            const { view } = await state(page);
            const towards = ([a, e]) => [Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e)];
            const back = towards([view.azimuth, view.elevation].map((degrees) => (degrees * Math.PI) / 180));
            const along = view.target.reduce((sum, t, i) => sum + t * back[i], 0);
            assert.ok(view.target.some((t) => t !== 0) && along > 0, `a point in front of the middle: ${view.target}`);
            await close();
        }
    });

    test("the cube and its keys look from the sides of the world", async () => {
        const { page, close } = await watched(browser);
        await open(page);
        const names = () => page.locator("#cube text").allTextContents();
        assert.deepEqual((await names()).sort(), ["x", "y", "z"]);
        await page.locator("#cube g", { hasText: "z" }).click();
        await settled(page);
        let { view } = await state(page);
        assert.deepEqual([view.azimuth, view.elevation], [270, 90]);
        assert.deepEqual(await names(), ["z"]);
        for (const [key, azimuth, elevation, name] of [["1", 0, 0, "x"], ["2", 180, 0, "-x"], ["3", 90, 0, "y"], ["4", 270, 0, "-y"], ["6", 90, -90, "-z"]]) {
            await page.keyboard.press(key);
            await settled(page);
            ({ view } = await state(page));
            assert.deepEqual([view.azimuth, view.elevation], [azimuth, elevation], key);
            assert.deepEqual(await names(), [name], key);
        }
        await close();
        // With -x upwards, key 2 looks from above.
        const up = await watched(browser);
        await open(up.page, {}, "up.html");
        await up.page.keyboard.press("2");
        await settled(up.page);
        assert.equal((await state(up.page)).view.elevation, 90);
        await up.close();
    });

    test("pictures are saved in any size, with a transparent background and with axes", async () => {
        for (const renderer of ["webgpu", "webgl2"]) {
            const { page, close } = await watched(browser);
            const saved = async () => {
                const [download] = await Promise.all([page.waitForEvent("download"), page.locator("#screenshot").click()]);
                return decodePng(readFileSync(await download.path()));
            };
            await open(page, { renderer, view: expected.view, isovalue: String(expected.isovalues[2]) });
            await openLook(page);
            const field = page.getByLabel("Saved pictures");
            await field.fill("640x480");
            await field.press("Tab");
            await page.getByLabel("transparent").check();
            const picture = await saved();
            assert.deepEqual([picture.width, picture.height], [640, 480]);
            assert.deepEqual([...picture.pixels.slice(0, 4)], [0, 0, 0, 0]);
            const wanted = native("nothing");
            // Compared over white, so that colours of transparent pixels do not count.
            const onWhite = ({ pixels: p, ...size }) => ({
                ...size, pixels: p.map((x, i) => (i % 4 === 3 ? 255 : (x * p[i - (i % 4) + 3] + 255 * (255 - p[i - (i % 4) + 3])) / 255)),
            });
            assertSimilar(onWhite(picture), onWhite(wanted), TO_NATIVE, `${renderer}, transparent`);
            await page.getByLabel("transparent").uncheck();
            await page.getByLabel("Axes").check();
            const withAxes = await saved();
            const plain = readPng(join(folder, "native-2.png"));
            const share = difference(withAxes, plain).share;
            assert.ok(share > 0.003 && share < 0.05, `axes and scale bar are on the picture: ${share}`);
            // A text that is no size changes nothing.
            await field.fill("12");
            await field.press("Tab");
            assert.match(await page.locator("#message").textContent(), /expected a size/);
            assert.deepEqual([(await saved()).width], [640]);
            await close();
        }
    });

    test("a film of the sweep is a WebM with every picture", async () => {
        const { page, context, close } = await watched(browser);
        await open(page, { isovalue: String(expected.isovalues[2]) });
        await page.locator("#speed").selectOption("4");
        await openLook(page);
        await page.getByLabel("Saved pictures").fill("321x240");
        await page.getByLabel("Saved pictures").press("Tab");
        const [download] = await Promise.all([page.waitForEvent("download", { timeout: 120_000 }), page.locator("#film").click()]);
        assert.equal(download.suggestedFilename(), "A-torus-more-sweep.webm");
        const bytes = readFileSync(await download.path());
        const found = elementsOf(bytes);
        assert.equal(found.get(0x4282)[0].toString(), "webm");
        const [width, height] = [0xb0, 0xba].map((id) => Number(found.get(id)[0].readBigUInt64BE()));
        assert.deepEqual([width, height], [320, 240]);
        // Twelve seconds at four times the speed, 25 pictures each.
        assert.equal(found.get(0x4489)[0].readDoubleBE(), 3000);
        assert.equal(found.get(0xa3).length, 75);
        // The cues point to the clusters.
        const segment = bytes.indexOf(Buffer.from([0x18, 0x53, 0x80, 0x67])) + 12;
        for (const position of found.get(0xf1)) {
            assert.equal(bytes.readUInt32BE(segment + Number(position.readBigUInt64BE())), 0x1f43b675);
        }
        // The browser plays it, and its pictures differ.
        const other = await context.newPage();
        const shares = await other.evaluate(async (base64) => {
            const video = document.createElement("video");
            const blob = new Blob([Uint8Array.from(atob(base64), (c) => c.charCodeAt(0))], { type: "video/webm" });
            const canvas = new OffscreenCanvas(320, 240);
            const context = canvas.getContext("2d", { willReadFrequently: true });
            const decoded = [];
            video.muted = true;
            video.src = URL.createObjectURL(blob);
            await new Promise((resolve, reject) => { video.onloadeddata = resolve; video.onerror = () => reject(new Error(video.error.message)); });
            for (const time of [0.02, 1.5, 2.2]) {
                video.currentTime = time;
                await new Promise((resolve) => { video.onseeked = resolve; });
                context.drawImage(video, 0, 0);
                const { data } = context.getImageData(0, 0, 320, 240);
                let n = 0;
                for (let i = 0; i < data.length; i += 4) n += data[i] < 200;
                decoded.push(n / (320 * 240));
            }
            return [video.duration, ...decoded];
        }, bytes.toString("base64"));
        assert.ok(Math.abs(shares[0] - 3) < 0.1, `duration ${shares[0]}`);
        assert.ok(new Set(shares.slice(1).map((x) => x.toFixed(2))).size > 1 && shares[2] > 0.01, `covers ${shares.slice(1)}`);
        assert.equal((await state(page)).isovalue.toFixed(6), expected.isovalues[2].toFixed(6), "the isovalue is as before");
        // The button stops a film in progress.
        await page.locator("#film").click();
        await page.waitForFunction(() => document.getElementById("message").textContent.startsWith("Film "));
        await page.locator("#film").click();
        await page.waitForFunction(() => document.getElementById("message").textContent === "Film stopped");
        await close();
    });
});

/** Reads the elements of a WebM whose lengths have eight bytes: lists of contents by id. */
function elementsOf(bytes, found = new Map()) {
    const nested = new Set([0x1a45dfa3, 0x18538067, 0x1549a966, 0x1654ae6b, 0xae, 0xe0, 0x1f43b675, 0x1c53bb6b, 0xbb, 0xb7]);
    for (let at = 0; at < bytes.length; ) {
        const n = Math.clz32(bytes[at]) - 24 + 1;
        const id = bytes.readUIntBE(at, n);
        const length = Number(bytes.readBigUInt64BE(at + n) & 0xffffffffffffffn);
        const content = bytes.subarray(at + n + 8, at + n + 8 + length);
        assert.equal(content.length, length, `element ${id.toString(16)} has its length`);
        if (!found.has(id)) found.set(id, []);
        found.get(id).push(content);
        if (nested.has(id)) elementsOf(content, found);
        at += n + 8 + length;
    }
    return found;
}

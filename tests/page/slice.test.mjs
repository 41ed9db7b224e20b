// Slices of the volume.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { expected, folder, launch, open, openLook, reopen, settled, show, state, watched } from "./browser.mjs";
import { decodedPage } from "./decoded.mjs";

const text = ["unpack", "samples", "slice"].map((name) => readFileSync(new URL(`../../page/${name}.js`, import.meta.url), "utf8")).join("\n");
const { sliceSamplesOf, contour } = new Function(`${text}\nreturn { sliceSamplesOf, contour };`)();

/** The samples of the torus along an axis. */
const SIDE = 24;
/** Rounding of single precision. */
const ROUNDING = 1e-6;

const bytes = readFileSync(join(folder, "torus_24x24x24_float32.raw"));
const samples = new Float32Array(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length));
const page = readFileSync(join(folder, "slice.html"), "utf8");
const codes = await sliceSamplesOf(/id="slice-samples">([^<]*)</.exec(page)[1]);
const { low, unit } = decodedPage("slice.html").about.slice;

let browser;
before(async () => { browser = await launch(); });
after(() => browser.close());

test("a page with slices has all samples, to half a step", () => {
    assert.equal(codes.length, SIDE ** 3);
    samples.forEach((sample, i) => assert.ok(Math.abs(low + unit * codes[i] - sample) <= 0.5 * unit + ROUNDING * Math.abs(sample), `sample ${i}`));
    const without = readFileSync(join(folder, "page.html"));
    assert.ok(page.length - without.length < 4 / 3 * SIDE ** 3);
    assert.ok(!without.includes('"slice":{'), "a page without --slice has no samples");
});

test("lines are closed or end at the border, and the bilinear interpolation has the isovalue on them", () => {
    // With a cell of four ends, both ways.
    const saddles = [0, 9, 0, 0, 9, 0, 9, 0, 0, 4, 0, 9, 0, 9, 0, 0];
    const slice = codes.subarray(11 * SIDE * SIDE, 12 * SIDE * SIDE);
    const [from, to] = [Math.min(...slice), Math.max(...slice)];
    const values = [0.1, 0.4, 0.7, 0.9].map((share) => Math.floor(from + share * (to - from)) + 0.5);
    for (const [list, n, isovalues] of [[slice, SIDE, values], [saddles, 4, [1, 3.5, 4.5, 6]]]) {
        for (const value of isovalues) {
            const ends = new Map();
            let nLines = 0;
            contour(list, n, value, (...line) => {
                nLines++;
                for (const [x, y] of line) {
                    const [i, j] = [Math.min(Math.floor(x), n - 2), Math.min(Math.floor(y), n - 2)];
                    const at = (dx, dy) => list[i + dx + n * (j + dy)] * (dx ? x - i : 1 - x + i) * (dy ? y - j : 1 - y + j);
                    assert.ok(Math.abs(at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1) - value) < 1e-9 * 255, `${x}, ${y}`);
                    ends.set(`${x},${y}`, (ends.get(`${x},${y}`) ?? 0) + 1);
                }
            });
            assert.ok(nLines > 0, `${value}`);
            for (const [place, count] of ends) {
                const isBorder = place.split(",").some((x) => Number(x) === 0 || Number(x) === n - 1);
                assert.ok(count === 2 || (count === 1 && isBorder), `${value}: ${count} at ${place}`);
            }
        }
    }
    // Between corners of 9 0 / 0 9 the saddle has 4.5: below, the corners of 9 are joined and lines are around those of 0, above the other way round.
    for (const [value, corners] of [[4, "0,1 1,0"], [5, "0,0 1,1"]]) {
        const around = [];
        contour([9, 0, 0, 9], 2, value, (a, b) => around.push([0, 1].map((axis) => Math.round((a[axis] + b[axis]) / 2)).join()));
        assert.equal(around.sort().join(" "), corners);
    }
});

/** The number of pixels of the slice that have the colour of the line, and whether there are black and white ones. */
function colorsOfSlice(tab) {
    return tab.evaluate(() => {
        const canvas = document.getElementById("slice-image");
        const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
        let [nLine, darkest, brightest] = [0, 255, 0];
        for (let i = 0; i < data.length; i += 4) {
            if (data[i] > data[i + 2] + 100) nLine++;
            if (data[i] === data[i + 1] && data[i] === data[i + 2]) [darkest, brightest] = [Math.min(darkest, data[i]), Math.max(brightest, data[i])];
        }
        return { nLine, darkest, brightest, width: canvas.width, height: canvas.height };
    });
}

for (const renderer of ["webgl2", "webgpu"]) {
    test(`a slice shows samples and line, follows the isovalue, and keys move it: ${renderer}`, async () => {
        const { page: tab, close } = await watched(browser);
        await open(tab, { renderer, isovalue: String(expected.isovalues[2]) }, "slice.html");
        const drawn = async () => {
            await tab.waitForFunction(() => document.getElementById("slice-image").ariaLabel !== "Slice");
            await settled(tab);
            return colorsOfSlice(tab);
        };
        const first = await drawn();
        assert.ok(first.nLine > 50 && first.brightest - first.darkest > 100, JSON.stringify(first));
        assert.match(await tab.locator("#slice-image").getAttribute("aria-label"), /^Slice across z at sample 12 of 0 to 23; the line is the isosurface of /);
        // Its outline is in the picture.
        assert.equal(await tab.locator("#overlay path.slice").count(), 1);
        await show(tab, expected.isovalues[3]);
        assert.notEqual((await drawn()).nLine, first.nLine);
        await tab.locator("#slice-place").focus();
        await tab.keyboard.press("ArrowRight");
        await settled(tab);
        assert.equal(await tab.locator("#slice-text").textContent(), "13");
        assert.equal((await state(tab)).isovalue, expected.isovalues[3]);
        await tab.locator("#slice-axis").selectOption("0");
        await settled(tab);
        assert.match(await tab.locator("#slice-image").getAttribute("aria-label"), /^Slice across x at sample 12 /);
        // Its place is in the address, once the page is at rest.
        await tab.waitForFunction(() => location.hash.includes("slice=x,12"));
        await reopen(tab);
        assert.equal(await tab.locator("#slice-axis").inputValue(), "0");
        await close();
    });
}

test("a slice has the shape of the volume in the world, with spacings that differ by more than the voxel frame has", async () => {
    const { page: tab, close } = await watched(browser);
    await open(tab, { renderer: "webgl2", slice: "x,3" }, "tall.html");
    await tab.waitForFunction(() => document.getElementById("slice-text").textContent === "3");
    await settled(tab);
    const { width, height } = await colorsOfSlice(tab);
    // 8 by 8 by 8 samples, 3 times as far apart along z.
    assert.ok(Math.abs(height / width - 3) < 0.03, `${width}x${height}`);
    await close();
});

test("a click shows the isosurface through a sample; the slice cuts the surface and follows the pointer", async () => {
    const { page: tab, close } = await watched(browser, { viewport: { width: 1200, height: 800 } });
    await open(tab, { renderer: "webgl2", slice: "z,5", view: "35,22,1" }, "slice.html");
    await tab.waitForFunction(() => document.getElementById("slice-text").textContent === "5");
    await settled(tab);
    const { width, height } = await tab.locator("#slice-image").boundingBox();
    const [i, j] = [8, 17];
    const position = { x: (width * i) / (SIDE - 1), y: height * (1 - j / (SIDE - 1)) };
    const value = low + unit * codes[i + SIDE * (j + SIDE * 5)];
    await tab.locator("#slice-image").hover({ position });
    assert.match(await tab.locator("#events").textContent(), /^x, y, z: 8, 17, 5; sample /);
    await tab.locator("#slice-image").click({ position });
    await settled(tab);
    assert.ok(Math.abs((await state(tab)).isovalue - value) < 1e-9);
    await tab.mouse.wheel(0, -100);
    await tab.waitForFunction(() => document.getElementById("slice-text").textContent === "6");
    await tab.locator("#slice-cuts").check();
    await settled(tab);
    assert.deepEqual((await state(tab)).clip, { axis: 2, share: 6 / (SIDE - 1), turned: false });
    await openLook(tab);
    assert.equal(await tab.locator("#clip").inputValue(), "z");
    await tab.locator("#slice-cuts").uncheck();
    await settled(tab);
    assert.equal((await state(tab)).clip, null);
    await tab.locator("#slice-follows").check();
    await tab.locator("#slice-axis").selectOption("1");
    await show(tab, expected.isovalues[2]);
    const box = await tab.locator("#canvas").boundingBox();
    // Along the picture there is a point of the surface, where the slice goes.
    let found;
    for (let share = 0.3; share < 0.7 && !found; share += 0.05) {
        await tab.mouse.move(box.x + box.width * share, box.y + box.height * 0.5);
        await tab.waitForTimeout(500);
        found = /^x, y, z: ([^;]+);/.exec(await tab.locator("#events").textContent())?.[1].split(",").map((x) => parseFloat(x));
    }
    await settled(tab);
    assert.equal(await tab.locator("#slice-text").textContent(), String(Math.round(found[1])));
    await close();
});

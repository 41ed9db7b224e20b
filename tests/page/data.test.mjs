// The spectrum in the page, decoded by the page's own scripts, against the same spectrum as
// `isospectrum convert` wrote it.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { inflateRawSync } from "node:zlib";
import { expected, folder } from "./browser.mjs";

/** A shading normal is wrong where it is further than this from the mesh's, degrees. */
const WRONG = 30;

/** The share of the area that may have a wrong one. */
const MOST_WRONG = 0.001;

/** Isovalues that are tried of each spectrum; a fixed sequence of random ones. */
const N_ISOVALUES = 200;

/** How far two normals of one mesh are apart, radians: codes of 16 bits, at most 6.5e-5, and single precision. */
const CODE_TURN = 1e-4;

/** What sums of doubles around 100 are off by, in voxels: half a step is no power of two. */
const ROUNDING = 1e-12;

/** The page's way from bytes to a spectrum. */
function decoder() {
    const scripts = ["letters", "file", "coder", "connectivity", "samples", "trajectories", "active", "normals", "surface", "mesh"];
    const text = scripts.map((name) => readFileSync(new URL(`../../page/${name}.js`, import.meta.url), "utf8"));
    return new Function(`${text.join("\n")}\nreturn { bytesOfLetters, spectrumOf, ActiveSet, Query };`)();
}

function embedded(name = "page.html") {
    const page = readFileSync(join(folder, name), "utf8");
    const content = (id) => new RegExp(`id="${id}">([^<]*)</script>`).exec(page)[1];
    const about = JSON.parse(content("about"));
    const spectrum = (id) => {
        const { bytesOfLetters, spectrumOf } = decoder();
        const bytes = new Uint8Array(inflateRawSync(bytesOfLetters(content(id))));
        return spectrumOf(bytes, about);
    };
    return { about, spectrum: spectrum("data"), first: content("first") ? spectrum("first") : null };
}

/** The layout of the thesis: FORMAT.md. */
function thesis() {
    const bytes = readFileSync(join(folder, "s.thesis"));
    let at = 0;
    const u32 = () => bytes.readUInt32LE((at += 4) - 4);
    const f32 = () => bytes.readFloatLE((at += 4) - 4);
    const knots = [];
    const counts = Array.from({ length: u32() }, () => {
        const count = u32();
        for (let i = 0; i < count; i++) knots.push(Array.from({ length: 7 }, f32));
        return count;
    });
    const triangles = Array.from({ length: u32() }, () => [f32(), f32(), u32(), u32(), u32()]);
    return { counts, knots, triangles };
}

test("the page holds every knot and every triangle, rounded to its step", () => {
    const { about, spectrum } = embedded();
    const { counts, knots, triangles } = thesis();
    assert.equal(about.step, expected.step);
    const { firstKnot, ranks, isovalues, positions } = spectrum;
    const aside = [];
    assert.deepEqual(Array.from(firstKnot).slice(1).map((end, v) => end - firstKnot[v]), counts);
    const f32 = Math.fround;
    knots.forEach(([x, y, z, nx, ny, nz, isovalue], knot) => {
        assert.equal(f32(isovalues[ranks[knot]]), isovalue);
        const off = [x, y, z].map((place, axis) => about.step * positions[3 * knot + axis] - place);
        // Along two axes to whole multiples of several steps, along the third back into the tangent plane.
        const most = (about.along + 0.5) * about.step + ROUNDING;
        assert.ok(off.every((miss) => Math.abs(miss) <= most), `knot ${knot} is off by ${off}`);
        const miss = off.map(Math.abs).sort();
        assert.ok(miss[1] <= (about.along / 2) * about.step + ROUNDING, `knot ${knot} is off by ${off}`);
        aside.push(Math.abs(off[0] * nx + off[1] * ny + off[2] * nz));
    });
    // Half a step, but more where the normal has turned away from the axis that the vertex faces.
    aside.sort((a, b) => a - b);
    assert.ok(aside.at(-1) <= 3 * about.step, `a knot is ${aside.at(-1)} off the surface`);
    assert.ok(aside[Math.floor(0.99 * aside.length)] <= 0.51 * about.step);
    assert.equal(spectrum.births.length, triangles.length);
    triangles.forEach(([birth, death, ...vertices], t) => {
        assert.deepEqual(Array.from(spectrum.vertices.subarray(3 * t, 3 * t + 3)), vertices);
        assert.equal(f32(isovalues[spectrum.births[t]]), birth);
        assert.equal(f32(isovalues[spectrum.deaths[t]]), death);
    });
});

/** The unit vector of an octahedral code. */
function decoded(code) {
    const [u, v] = [(code << 16) >> 16, code >> 16].map((s) => s / 32767);
    const z = 1 - Math.abs(u) - Math.abs(v);
    const folded = Math.max(-z, 0);
    const n = [u - Math.sign(u) * folded, v - Math.sign(v) * folded, z];
    return n.map((x) => x / Math.hypot(...n));
}

const minus = (a, b) => a.map((x, i) => x - b[i]);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

/** Twice the area of each triangle as a vector, and their sums around vertices without those of caps. */
function areasOf({ positions, triangles, caps }) {
    const at = (v) => Array.from(positions.subarray(3 * v, 3 * v + 3));
    const sums = Array.from({ length: positions.length / 3 }, () => [[0, 0, 0], [0, 0, 0]]);
    const areas = Array.from(caps, (cap, t) => {
        const corners = Array.from(triangles.subarray(3 * t, 3 * t + 3));
        const [p, q, r] = corners.map(at);
        const area = cross(minus(q, p), minus(r, p));
        for (const v of corners) area.forEach((x, i) => { sums[v][cap][i] += x; });
        return area;
    });
    return { areas, sums: sums.map(([own, ofCaps]) => (Math.hypot(...own) > 0 ? own : ofCaps)) };
}

/** The share of the area at whose corners `normal` of the vertex is wrong. */
function wrongShare({ triangles }, { areas, sums }, normal) {
    const least = Math.cos((WRONG * Math.PI) / 180);
    const isWrong = sums.map((sum, v) => !(dot(normal(v), sum) >= least * Math.hypot(...sum)));
    let [wrong, all] = [0, 0];
    triangles.forEach((v, corner) => {
        const area = Math.hypot(...areas[Math.floor(corner / 3)]);
        all += area;
        if (isWrong[v]) wrong += area;
    });
    return all > 0 ? wrong / all : 0;
}

for (const [name, isovalues] of Object.entries(expected.shaded)) {
    test(`shading normals are those of the mesh at every isovalue: ${name}`, () => {
        const { about, spectrum } = embedded(name);
        const query = new (decoder().Query)(spectrum, about.step);
        const [low, high] = spectrum.info.range;
        let state = 1;
        const random = () => (state = (Math.imul(state, 1664525) + 1013904223) >>> 0) / 2 ** 32;
        const tried = [...isovalues, ...Array.from({ length: N_ISOVALUES }, () => low + random() * (high - low))];
        let nSeen = 0;
        for (const isovalue of tried) {
            query.moveTo(isovalue, false);
            const mesh = query.mesh(true);
            const areas = areasOf(mesh);
            const saved = (v) => Array.from(mesh.normals.subarray(3 * v, 3 * v + 3));
            const share = wrongShare(mesh, areas, saved);
            assert.ok(share <= MOST_WRONG, `saved at ${isovalue}: ${share} of the area`);
            // What is drawn is what is saved.
            const { surface } = query;
            const order = Array.from(surface.vertices.subarray(0, surface.nVertices)).sort((a, b) => a - b);
            order.forEach((v, i) => {
                const turn = Math.hypot(...minus(decoded(surface.normals[surface.numberOf[v]]), saved(i)));
                assert.ok(turn <= CODE_TURN, `vertex ${v} at ${isovalue} is drawn ${turn} off`);
            });
            if (mesh.triangles.length > 0) nSeen++;
        }
        assert.ok(nSeen > N_ISOVALUES / 2, `${nSeen} isovalues with a surface`);
    });
}

test("what is seen first is that of the whole at the isovalues that it covers", () => {
    const { about } = embedded();
    const [low, high] = about.first;
    assert.ok(low < about.isovalue && about.isovalue < high, `${low} to ${high}`);
    // Not at the ends, where a triangle that is born or dies there counts for one and not for the other.
    const shares = [0.02, 0.3, 0.71, 0.98];
    for (const c of [about.isovalue, ...shares.map((t) => low * (1 - t) + high * t)]) compareFirst(c);
});

function compareFirst(isovalue) {
    const { about, spectrum, first } = embedded();
    const { Query } = decoder();
    const [whole, alone] = [spectrum, first].map((s) => {
        const query = new Query(s, about.step);
        query.moveTo(isovalue, false);
        return query.mesh(true);
    });
    assert.equal(alone.triangles.length, whole.triangles.length);
    assert.equal(alone.positions.length, whole.positions.length);
    // Vertices are numbered anew, so axis by axis; both are rounded.
    const along = ({ positions }, axis) => positions.filter((_, i) => i % 3 === axis).sort();
    for (let axis = 0; axis < 3; axis++) {
        const wanted = along(whole, axis);
        along(alone, axis).forEach((x, i) => {
            assert.ok(Math.abs(x - wanted[i]) <= (about.along + 1) * about.step, `${x}, expected ${wanted[i]}`);
        });
    }
}

test("active triangles are those whose lifetime contains the rank, after moves of any size", () => {
    const { spectrum } = embedded();
    const { births, deaths, isovalues } = spectrum;
    const active = new (decoder().ActiveSet)(spectrum);
    const n = isovalues.length;
    // Small steps up and down, jumps, and both ends.
    let rank = Math.floor(n / 2);
    const steps = [1, 2, -1, -3, 5, 0, 40, -25];
    const visited = [0, n - 1, Math.floor(n / 3)];
    for (let i = 0; i < 200; i++) {
        rank = Math.min(Math.max(rank + steps[i % steps.length], 0), n - 1);
        visited.push(i % 50 === 49 ? (i * 7919) % n : rank);
    }
    for (const at of visited) {
        active.moveTo(at);
        const listed = Array.from(active.list.subarray(0, active.length)).sort((a, b) => a - b);
        const wanted = [];
        births.forEach((birth, t) => { if (birth <= at && at < deaths[t]) wanted.push(t); });
        assert.deepEqual(listed, wanted, `rank ${at}`);
    }
});

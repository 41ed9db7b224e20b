// Shading normals, as the page saves and draws them, compared with normals computed from the mesh.

import assert from "node:assert/strict";
import { test } from "node:test";
import { expected } from "./browser.mjs";
import { Query, decodedPage } from "./decoded.mjs";

/** A shading normal is wrong if it deviates from that of the mesh by more than this, degrees. */
const MAX_DEVIATION = 30;

/** The greatest share of the area that may have wrong normals. */
const MAX_WRONG_SHARE = 0.001;

/** The number of random isovalues of each spectrum. */
const N_ISOVALUES = 200;

/** The rounding error of coded normals, radians: 6.5e-5 for 16 bits, and single precision. */
const MAX_CODE_ERROR = 1e-4;

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

/** Each triangle's normal, of a length of twice its area, and their sums around vertices, of caps only if there is nothing else. */
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

/** The share of the area at whose corners the `normal` of the vertex is wrong. */
function wrongShare({ triangles }, { areas, sums }, normal) {
    const minCosine = Math.cos((MAX_DEVIATION * Math.PI) / 180);
    const isWrong = sums.map((sum, v) => !(dot(normal(v), sum) >= minCosine * Math.hypot(...sum)));
    let [wrong, total] = [0, 0];
    triangles.forEach((v, corner) => {
        const area = Math.hypot(...areas[Math.floor(corner / 3)]);
        total += area;
        if (isWrong[v]) wrong += area;
    });
    return total > 0 ? wrong / total : 0;
}

for (const [name, isovalues] of Object.entries(expected.shaded)) {
    test(`shading normals are those of the mesh at every isovalue: ${name}`, () => {
        const { about, spectrum } = decodedPage(name);
        const query = new Query(spectrum, about.step);
        const [low, high] = spectrum.info.range;
        let state = 1;
        const random = () => (state = (Math.imul(state, 1664525) + 1013904223) >>> 0) / 2 ** 32;
        const isovaluesToTry = [...isovalues, ...Array.from({ length: N_ISOVALUES }, () => low + random() * (high - low))];
        let nSurfaces = 0;
        for (const isovalue of isovaluesToTry) {
            query.moveTo(isovalue, false);
            const mesh = query.mesh(true);
            const areas = areasOf(mesh);
            const saved = (v) => Array.from(mesh.normals.subarray(3 * v, 3 * v + 3));
            const share = wrongShare(mesh, areas, saved);
            assert.ok(share <= MAX_WRONG_SHARE, `saved at ${isovalue}: ${share} of the area`);
            // The drawn normals are the saved ones.
            const { surface } = query;
            const order = Array.from(surface.vertices.subarray(0, surface.nVertices)).sort((a, b) => a - b);
            order.forEach((v, i) => {
                const error = Math.hypot(...minus(decoded(surface.normals[surface.numberOf[v]]), saved(i)));
                assert.ok(error <= MAX_CODE_ERROR, `vertex ${v} at ${isovalue} is drawn ${error} off`);
            });
            if (mesh.triangles.length > 0) nSurfaces++;
        }
        assert.ok(nSurfaces > N_ISOVALUES / 2, `${nSurfaces} isovalues with a surface`);
    });
}

for (const { name, isovalue, center } of expected.enclosed ?? []) {
    test(`triangles and normals face away from the enclosed side: ${name}`, () => {
        const { about, spectrum } = decodedPage(name);
        const query = new Query(spectrum, about.step);
        query.moveTo(isovalue, false);
        const { positions, triangles, normals } = query.mesh(true);
        const fromCenter = (v) => minus(Array.from(positions.subarray(3 * v, 3 * v + 3)), center);
        let volume = 0;
        for (let t = 0; t < triangles.length; t += 3) {
            const [p, q, r] = Array.from(triangles.subarray(t, t + 3), fromCenter);
            volume += dot(p, cross(q, r)) / 6;
        }
        assert.ok(volume > 0, `a volume of ${volume}`);
        for (let v = 0; v < positions.length / 3; v++) {
            const outwards = fromCenter(v);
            const cosine = dot(Array.from(normals.subarray(3 * v, 3 * v + 3)), outwards) / Math.hypot(...outwards);
            assert.ok(cosine > 0.5, `the normal of vertex ${v} at ${outwards} from the centre: ${cosine}`);
        }
    });
}

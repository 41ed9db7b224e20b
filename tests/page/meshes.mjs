// Reads and checks mesh files.

import assert from "node:assert/strict";

const viewOf = (bytes) => new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);

/** Reads positions, normals and triangles of a binary PLY as the program and the page write it. */
export function parsePly(bytes) {
    const end = "end_header\n";
    const head = bytes.toString("latin1", 0, bytes.indexOf(end));
    const count = (name) => Number(new RegExp(`element ${name} (\\d+)`).exec(head)[1]);
    const [n, m] = [count("vertex"), count("face")];
    const view = viewOf(bytes);
    const start = bytes.indexOf(end) + end.length;
    assert.equal(bytes.length, start + 24 * n + 13 * m);
    const [positions, normals, triangles] = [[], [], []];
    for (let v = 0; v < n; v++) {
        for (let i = 0; i < 6; i++) {
            (i < 3 ? positions : normals).push(view.getFloat32(start + 24 * v + 4 * i, true));
        }
    }
    for (let t = 0; t < m; t++) {
        const at = start + 24 * n + 13 * t;
        assert.equal(view.getUint8(at), 3);
        for (let k = 0; k < 3; k++) triangles.push(view.getInt32(at + 1 + 4 * k, true));
    }
    return { positions, normals, triangles };
}

/** Reads the corners of a binary STL, nine numbers per triangle. */
export function parseStl(bytes) {
    const view = viewOf(bytes);
    const n = view.getUint32(80, true);
    assert.equal(bytes.length, 84 + 50 * n);
    const corners = [];
    for (let t = 0; t < n; t++) {
        for (let i = 0; i < 9; i++) corners.push(view.getFloat32(96 + 50 * t + 4 * i, true));
    }
    return corners;
}

/** Reads the only mesh of a GLB. */
export function parseGlb(bytes) {
    const view = viewOf(bytes);
    assert.equal(bytes.toString("latin1", 0, 4), "glTF");
    assert.equal(view.getUint32(8, true), bytes.length);
    const length = view.getUint32(12, true);
    assert.equal(length % 4, 0);
    const json = JSON.parse(bytes.toString("utf8", 20, 20 + length));
    const binary = 20 + length + 8;
    assert.equal(bytes.toString("latin1", binary - 4, binary), "BIN\0");
    assert.equal(view.getUint32(binary - 8, true), bytes.length - binary);
    const numbers = (index, width, read) => {
        const { bufferView, count } = json.accessors[index];
        const { byteOffset } = json.bufferViews[bufferView];
        return Array.from({ length: width * count }, (_, i) => read(binary + byteOffset + 4 * i));
    };
    const { attributes, indices } = json.meshes[0].primitives[0];
    const float = (at) => view.getFloat32(at, true);
    return {
        positions: numbers(attributes.POSITION, 3, float),
        normals: numbers(attributes.NORMAL, 3, float),
        triangles: numbers(indices, 1, (at) => view.getUint32(at, true)),
    };
}

/**
 * Asserts that every directed edge occurs once and its opposite too, and that the triangles at each
 * vertex are one fan.
 */
export function assertClosedManifold({ positions, triangles }) {
    const n = positions.length / 3;
    const next = new Map();
    const degree = new Map();
    for (let i = 0; i < triangles.length; i += 3) {
        for (let k = 0; k < 3; k++) {
            const [a, b, c] = [0, 1, 2].map((j) => triangles[i + ((j + k) % 3)]);
            assert.ok(a !== b && a >= 0 && a < n, `triangle ${i / 3}`);
            const key = a * n + b;
            assert.ok(!next.has(key), `edge ${a} ${b} occurs twice`);
            next.set(key, c);
            degree.set(a, (degree.get(a) ?? 0) + 1);
        }
    }
    for (const key of next.keys()) {
        const [a, b] = [Math.floor(key / n), key % n];
        assert.ok(next.has(b * n + a), `edge ${a} ${b} has no opposite`);
    }
    const seen = new Set();
    for (const key of next.keys()) {
        const a = Math.floor(key / n);
        if (seen.has(a)) continue;
        seen.add(a);
        const first = key % n;
        let [b, count] = [first, 0];
        do {
            b = next.get(a * n + b);
            count++;
        } while (b !== first && count <= degree.get(a));
        assert.equal(count, degree.get(a), `the triangles at ${a} are not one fan`);
    }
    assert.equal(seen.size, n, "every vertex is used");
}

/** The mesh of the corners of triangles, nine numbers each: equal positions are one vertex, as programs read STL. */
export function welded(corners) {
    const numbers = new Map();
    const positions = [];
    const triangles = [];
    for (let at = 0; at < corners.length; at += 3) {
        const point = corners.slice(at, at + 3);
        const key = point.map((x) => x + 0).join();
        if (!numbers.has(key)) {
            numbers.set(key, numbers.size);
            positions.push(...point);
        }
        triangles.push(numbers.get(key));
    }
    return { positions, triangles };
}

/** Twice the area of the triangle of nine numbers. */
export function areaOf(p) {
    const [u, v] = [3, 6].map((at) => [0, 1, 2].map((i) => p[at + i] - p[i]));
    return Math.hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]);
}

/** The number of connected components of a mesh. */
export function countComponents(triangles) {
    const parent = new Map(triangles.map((v) => [v, v]));
    const root = (v) => {
        while (parent.get(v) !== v) v = parent.get(v);
        return v;
    };
    for (let i = 0; i < triangles.length; i += 3) {
        for (const v of [triangles[i + 1], triangles[i + 2]]) parent.set(root(v), root(triangles[i]));
    }
    return [...parent].filter(([v, up]) => v === up).length;
}

/** Coordinates are sums of two products of single precision below 64. */
const ROUNDING = 2e-5;

/** Asserts that two meshes are the same but for the order of vertices and triangles. */
export function assertSameMesh(found, wanted) {
    assert.deepEqual([found.positions.length, found.triangles.length], [wanted.positions.length, wanted.triangles.length]);
    // Three numbers per vertex, then the sums of those of the corners of each triangle.
    const numbers = ({ positions, triangles }, axis) => {
        const along = positions.filter((_, i) => i % 3 === axis);
        const sums = Array.from({ length: triangles.length / 3 }, (_, t) => [0, 1, 2].reduce((sum, k) => sum + along[triangles[3 * t + k]], 0));
        return [along, sums].map((list) => list.sort((a, b) => a - b));
    };
    for (let axis = 0; axis < 3; axis++) {
        const all = numbers(wanted, axis);
        numbers(found, axis).forEach((list, i) => list.forEach((x, j) => assert.ok(Math.abs(x - all[i][j]) <= 3 * ROUNDING, `${x}, expected ${all[i][j]}`)));
    }
}

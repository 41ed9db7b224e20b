// The mesh at one isovalue as numbers: for downloads, measures, and what the pointer points at.
// The twin of src/spectrum/query.rs.

/** The unit vector of an octahedral code with components from -radius to radius. */
function decodedNormal(u, v, radius) {
    let [x, y] = [u / radius, v / radius];
    const z = 1 - Math.abs(x) - Math.abs(y);
    if (z < 0) [x, y] = [withSign(1 - Math.abs(y), x), withSign(1 - Math.abs(x), y)];
    const length = Math.hypot(x, y, z);
    return [x / length, y / length, z / length];
}

/** Answers what the mesh at an isovalue is. Positions are in voxels. */
class Query {
    constructor(spectrum, step) {
        this.spectrum = spectrum;
        this.step = step;
        this.active = new ActiveSet(spectrum);
        const { isovalues } = spectrum;
        [this.first, this.last] = [isovalues[0] ?? 0, isovalues.at(-1) ?? 1];
    }

    /** Moves the active set; whether it changed. */
    moveTo(isovalue) {
        this.isovalue = isovalue;
        const rank = rankAt(this.spectrum.isovalues, isovalue);
        return this.active.moveTo(this.spectrum.isovalues.length > 0 ? rank : -1);
    }

    /**
     * Position and, where wanted, normal of a vertex at the present isovalue, written to `position`
     * and `normal`.
     */
    vertex(v, position, normal) {
        const { firstKnot, ranks, isovalues, positions, normals, radius } = this.spectrum;
        const a = knotAt(firstKnot, ranks, v, this.active.rank);
        const b = Math.min(a + 1, firstKnot[v + 1] - 1);
        const [low, high] = [isovalues[ranks[a]], isovalues[ranks[b]]];
        let t = (0.5 * this.isovalue - 0.5 * low) / (0.5 * high - 0.5 * low);
        t = Math.min(Math.max(Number.isFinite(t) ? t : 0, 0), 1);
        for (let i = 0; i < 3; i++) {
            position[i] = this.step * ((1 - t) * positions[3 * a + i] + t * positions[3 * b + i]);
        }
        if (!normal) return;
        const [p, q] = [a, b].map((k) => decodedNormal(normals[2 * k], normals[2 * k + 1], radius));
        const n = p.map((x, i) => (1 - t) * x + t * q[i]);
        const length = Math.hypot(...n);
        for (let i = 0; i < 3; i++) normal[i] = length > 1e-6 ? n[i] / length : p[i];
    }

    /**
     * The whole mesh: positions and normals (3 per vertex, Float32Array), triangles (3 vertices
     * each, Uint32Array) in the order of the file, caps (Uint8Array). With `open`, without caps.
     */
    mesh(open, withNormals) {
        const { vertices, caps } = this.spectrum;
        const kept = this.active.list.slice(0, this.active.length)
            .filter((t) => !(open && caps[t]))
            .sort();
        const number = new Map();
        const [positions, normals] = [[], []];
        const triangles = new Uint32Array(3 * kept.length);
        const [position, normal] = [[0, 0, 0], withNormals ? [0, 0, 0] : null];
        for (let i = 0; i < triangles.length; i++) {
            const v = vertices[3 * kept[Math.floor(i / 3)] + (i % 3)];
            let index = number.get(v);
            if (index === undefined) {
                index = number.size;
                number.set(v, index);
                this.vertex(v, position, normal);
                positions.push(...position);
                if (normal) normals.push(...normal);
            }
            triangles[i] = index;
        }
        return {
            positions: Float32Array.from(positions),
            normals: Float32Array.from(normals),
            triangles,
            caps: Uint8Array.from(kept, (t) => caps[t]),
        };
    }
}

/** Moves a mesh from voxels to the world of its volume; the twin of place_in_world in src/export.rs. */
function placeInWorld(mesh, { origin, spacing, direction }) {
    const unit = Math.min(...spacing);
    const turned = (list, at, i, scale) =>
        scale * (direction[0][i] * list[at] + direction[1][i] * list[at + 1] + direction[2][i] * list[at + 2]);
    for (let at = 0; at < mesh.positions.length; at += 3) {
        const p = [0, 1, 2].map((i) => origin[i] + turned(mesh.positions, at, i, unit));
        mesh.positions.set(p, at);
    }
    for (let at = 0; at < mesh.normals.length; at += 3) {
        const n = [0, 1, 2].map((i) => turned(mesh.normals, at, i, 1));
        const length = Math.hypot(...n);
        if (length > 0) mesh.normals.set(n.map((x) => x / length), at);
    }
    if (determinant(direction) < 0) {
        for (let at = 0; at < mesh.triangles.length; at += 3) {
            const [b, c] = [mesh.triangles[at + 1], mesh.triangles[at + 2]];
            mesh.triangles.set([c, b], at + 1);
        }
    }
    return mesh;
}

/** The determinant of three rows. */
function determinant([a, b, c]) {
    return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2])
        + a[2] * (b[0] * c[1] - b[1] * c[0]);
}

/**
 * Components, Euler characteristic and area of a mesh of the world; caps count for the first two,
 * which close it, and not for the area.
 */
function measured({ positions, triangles, caps }) {
    const n = positions.length / 3;
    const parent = Uint32Array.from({ length: n }, (_, v) => v);
    const root = (v) => {
        while (parent[v] !== v) v = parent[v] = parent[parent[v]];
        return v;
    };
    let components = n;
    let area = 0;
    for (let t = 0; t < caps.length; t++) {
        const [a, b, c] = triangles.subarray(3 * t, 3 * t + 3);
        for (const [p, q] of [[root(a), b], [root(b), c]]) {
            const r = root(q);
            if (p === r) continue;
            parent[p] = r;
            components--;
        }
        if (!caps[t]) area += triangleArea(positions, a, b, c);
    }
    return { components, euler: n - caps.length / 2, area };
}

function triangleArea(p, a, b, c) {
    const [ax, ay, az] = [p[3 * a], p[3 * a + 1], p[3 * a + 2]];
    const [ux, uy, uz] = [p[3 * b] - ax, p[3 * b + 1] - ay, p[3 * b + 2] - az];
    const [vx, vy, vz] = [p[3 * c] - ax, p[3 * c + 1] - ay, p[3 * c + 2] - az];
    return 0.5 * Math.hypot(uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx);
}

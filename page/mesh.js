// The mesh at one isovalue, for downloads, measures and picking. The twin of src/spectrum/query.rs.

/** Finds the mesh at an isovalue. Positions are in voxels. */
class Query {
    constructor(spectrum, step) {
        this.spectrum = spectrum;
        this.active = new ActiveSet(spectrum);
        this.surface = new Surface(spectrum, step);
        this.version = null;
    }

    /** Moves the surface to an isovalue, without caps if `open`, with the selected components or all; true if anything changed. */
    moveTo(isovalue, open, selection) {
        const { isovalues } = this.spectrum;
        const version = !selection || selection.isPlain ? null : selection.version;
        const rank = isovalues.length > 0 ? rankAt(isovalues, isovalue) : -1;
        const isSame = !this.active.moveTo(rank) && this.open === open && this.version === version;
        if (isSame && this.isovalue === isovalue) return false;
        if (version !== null) this.select(isovalue, rank, open, selection);
        else if (!isSame) {
            this.components = null;
            this.surface.collect(this.active, open, null);
        }
        this.surface.moveTo(isovalue, rank);
        Object.assign(this, { isovalue, open, version });
        return true;
    }

    /** Lists the selected components only. */
    select(isovalue, rank, open, selection) {
        const before = this.isovalue;
        let components = this.closed(isovalue, rank);
        if (selection.isLost(this.surface, components)) {
            const { isovalues } = this.spectrum;
            for (let i = 1; i < TRACKING_STEPS; i++) {
                const intermediate = before + ((isovalue - before) * i) / TRACKING_STEPS;
                const intermediateRank = rankAt(isovalues, intermediate);
                this.active.moveTo(intermediateRank);
                selection.track(this.surface, this.closed(intermediate, intermediateRank));
            }
            this.active.moveTo(rank);
            components = this.closed(isovalue, rank);
        }
        selection.track(this.surface, components);
        const kept = selection.kept(components);
        this.components = { n: components.list.length, nKept: kept.filter(Boolean).length };
        const { of } = components;
        this.surface.collect(this.active, open, (i) => (kept[of[i]] ? of[i] : -1));
    }

    /** The components of the closed surface at an isovalue. */
    closed(isovalue, rank) {
        this.surface.collect(this.active, false, null);
        this.surface.placeAll(isovalue, rank);
        return componentsOf(this.surface, this.spectrum.caps);
    }

    /**
     * The mesh at the current isovalue: positions and, if requested, normals (3 per vertex, Float32Array), triangles (3 vertices
     * each, Uint32Array) and caps (Uint8Array), with vertices and triangles in the order of the file.
     */
    mesh(withNormals) {
        const { vertices, caps } = this.spectrum;
        const { surface } = this;
        const kept = surface.triangles.slice(0, surface.nTriangles).sort();
        const used = surface.vertices.slice(0, surface.nVertices).sort();
        const positions = new Float32Array(3 * used.length);
        const normals = new Float32Array(withNormals ? 3 * used.length : 0);
        const units = new Float32Array(normals.length);
        if (withNormals) unitsOf(used.length, surface.directions, units);
        // For each vertex of the surface, its number in the order of the file.
        const index = new Uint32Array(used.length);
        used.forEach((v, i) => {
            const from = 3 * surface.numberOf[v];
            index[surface.numberOf[v]] = i;
            for (let axis = 0; axis < 3; axis++) {
                positions[3 * i + axis] = surface.positions[from + axis];
                if (withNormals) normals[3 * i + axis] = units[from + axis];
            }
        });
        const triangles = new Uint32Array(3 * kept.length);
        kept.forEach((t, i) => {
            for (let k = 0; k < 3; k++) {
                triangles[3 * i + k] = index[surface.numberOf[vertices[3 * t + k]]];
            }
        });
        return { positions, normals, triangles, caps: Uint8Array.from(kept, (t) => caps[t]) };
    }
}

/** Transforms a mesh from the voxel frame to the world of its volume; the twin of place_in_world in src/export.rs. */
function placeInWorld(mesh, placement) {
    const axes = voxelAxesOf(placement);
    transform(mesh.positions, axes, Math.min(...placement.spacing), placement.origin);
    // The inverse transpose keeps normals perpendicular to the surface if the axes are sheared or stretched.
    const [a, b, c] = axes;
    const side = Math.sign(determinant(axes));
    transform(mesh.normals, [cross(b, c), cross(c, a), cross(a, b)], side, [0, 0, 0]);
    for (let at = 0; at < mesh.normals.length; at += 3) {
        const n = mesh.normals.subarray(at, at + 3);
        const length = Math.hypot(n[0], n[1], n[2]);
        if (length > 0) n.forEach((x, i) => { n[i] = x / length; });
    }
    if (side < 0) {
        for (let at = 0; at < mesh.triangles.length; at += 3) {
            const b = mesh.triangles[at + 1];
            mesh.triangles[at + 1] = mesh.triangles[at + 2];
            mesh.triangles[at + 2] = b;
        }
    }
    return mesh;
}

/** The symbol of the unit of a volume's world, with a space before and a power after it; empty if the unit is unknown. */
function unitOf({ placement: { unit = "unknown" } }, power = "") {
    const symbol = { unknown: "", um: "µm", angstrom: "Å" }[unit] ?? unit;
    return symbol && ` ${symbol}${power}`;
}

/** A distance with its unit; that of a volume without a world is the voxel. */
function distanceText(distance, volume) {
    const { unit = "unknown", spacing } = volume.placement;
    const isVoxel = unit === "unknown" && spacing.every((s) => s === 1);
    return shownNumber(distance) + (isVoxel ? " voxels" : unitOf(volume));
}

/** Comments for mesh files about the world of the mesh: its space, as 3D Slicer reads it, and its unit. */
function worldComments({ placement: { unit = "unknown", space = "UNKNOWN" } }) {
    return [...(space === "UNKNOWN" ? [] : [`SPACE=${space}`]), ...(unit === "unknown" ? [] : [`unit ${unit}`])];
}

/** Transforms vectors in place: origin + axes * (scale * vector). */
function transform(vectors, [a, b, c], scale, origin) {
    for (let at = 0; at < vectors.length; at += 3) {
        const x = scale * vectors[at];
        const y = scale * vectors[at + 1];
        const z = scale * vectors[at + 2];
        for (let i = 0; i < 3; i++) {
            vectors[at + i] = origin[i] + (a[i] * x + b[i] * y + c[i] * z);
        }
    }
}

/** The determinant of three rows. */
function determinant([a, b, c]) {
    return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2])
        + a[2] * (b[0] * c[1] - b[1] * c[0]);
}

/** A union-find of the numbers below n: `root` finds the representative of a number, `join` unites two sets, false if they were one. */
function disjointSets(n) {
    const parent = new Uint32Array(n);
    for (let v = 0; v < n; v++) parent[v] = v;
    const root = (v) => {
        while (parent[v] !== v) {
            parent[v] = parent[parent[v]];
            v = parent[v];
        }
        return v;
    };
    const join = (a, b) => {
        const p = root(a);
        const q = root(b);
        parent[p] = q;
        return p !== q;
    };
    return { root, join };
}

/** Components, Euler characteristic, area without caps and enclosed volume of a closed mesh, in units of the world. */
function measuresOf({ positions, triangles, caps }) {
    const n = positions.length / 3;
    const { join } = disjointSets(n);
    let components = n;
    let area = 0;
    let volume = 0;
    for (let t = 0; t < caps.length; t++) {
        const a = triangles[3 * t];
        const b = triangles[3 * t + 1];
        const c = triangles[3 * t + 2];
        if (join(a, b)) components--;
        if (join(b, c)) components--;
        volume += tetrahedronVolume(positions, 0, 3 * a, 3 * b, 3 * c);
        if (!caps[t]) area += triangleArea(positions, 3 * a, 3 * b, 3 * c);
    }
    return { components, euler: n - caps.length / 2, area, volume: Math.abs(volume) };
}

/** The area of a triangle whose corners are at three offsets in a list of positions. */
function triangleArea(p, a, b, c) {
    const ux = p[b] - p[a];
    const uy = p[b + 1] - p[a + 1];
    const uz = p[b + 2] - p[a + 2];
    const vx = p[c] - p[a];
    const vy = p[c + 1] - p[a + 1];
    const vz = p[c + 2] - p[a + 2];
    return 0.5 * Math.hypot(uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx);
}

/** The signed volume of the tetrahedron of an apex and a triangle, given by offsets in a list of positions. */
function tetrahedronVolume(p, apex, a, b, c) {
    const ax = p[a] - p[apex];
    const ay = p[a + 1] - p[apex + 1];
    const az = p[a + 2] - p[apex + 2];
    const bx = p[b] - p[apex];
    const by = p[b + 1] - p[apex + 1];
    const bz = p[b + 2] - p[apex + 2];
    const cx = p[c] - p[apex];
    const cy = p[c + 1] - p[apex + 1];
    const cz = p[c + 2] - p[apex + 2];
    return (ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)) / 6;
}

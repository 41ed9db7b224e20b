// Prepares a mesh for STL, which identifies vertices by their positions. The twin of src/export/weld.rs, with the same steps: edges of
// zero length are collapsed where a manifold stays a manifold, components of one point are dropped, the vertices that still coincide
// and those of triangles without area are moved apart by units in the last place.

/** The largest displacement of a vertex along an axis, units in the last place. */
const MAX_DISPLACEMENT = 3;
/** The most passes over triangles without area. */
const MAX_PASSES = 4;

/** `true` if the arcs are one closed cycle of at least three, `false` if they are one path, else undefined. */
function isClosedChain(arcs) {
    const next = new Map(arcs);
    const ends = new Set(arcs.map(([, to]) => to));
    if (arcs.length === 0 || next.size < arcs.length || ends.size < arcs.length) return undefined;
    const starts = [...next.keys()].filter((from) => !ends.has(from));
    const first = starts[0] ?? arcs[0][0];
    let [at, n] = [first, 0];
    do [at, n] = [next.get(at), n + 1]; while (next.has(at) && at !== first);
    if (n < arcs.length || starts.length > 1) return undefined;
    return starts.length === 1 ? false : n >= 3 ? true : undefined;
}

class Welder {
    constructor({ positions, triangles }) {
        // 0 and -0 are the same position.
        this.positions = positions.map((x) => x + 0);
        this.around = Array.from({ length: positions.length / 3 }, () => []);
        this.triangles = Array.from({ length: triangles.length / 3 }, (_, t) => [...triangles.subarray(3 * t, 3 * t + 3)]);
        this.triangles.forEach((corners, t) => corners.forEach((v) => this.around[v].push(t)));
    }

    at(v) {
        return this.positions.subarray(3 * v, 3 * v + 3);
    }

    key(v) {
        return this.at(v).join();
    }

    /** The vertices that have triangles. */
    vertices() {
        return [...this.around.keys()].filter((v) => this.around[v].length > 0);
    }

    /** Whether the area of a triangle is zero, in double or in single precision. */
    isFlat(corners) {
        const [a, b, c] = corners.map((v) => this.at(v));
        return [(x) => x, Math.fround].some((f) => {
            const [u, v] = [b, c].map((p) => [0, 1, 2].map((i) => f(p[i] - a[i])));
            return [[1, 2], [2, 0], [0, 1]].every(([i, j]) => f(f(u[i] * v[j]) - f(u[j] * v[i])) === 0);
        });
    }

    flat() {
        return this.triangles.filter((corners) => corners && this.isFlat(corners));
    }

    /** The edges opposite to a vertex in its triangles, without those that have `except`. */
    link(v, except) {
        return this.around[v].map((t) => this.triangles[t]).filter((corners) => !corners.includes(except)).map((corners) => {
            const i = corners.indexOf(v);
            return [corners[(i + 1) % 3], corners[(i + 2) % 3]];
        });
    }

    canMerge(a, b) {
        const isOpen = [a, b].some((v) => isClosedChain(this.link(v)) !== true);
        return isClosedChain([...this.link(a, b), ...this.link(b, a)]) === !isOpen;
    }

    /** Replaces vertex b by a, and removes the triangles that have both. */
    merge(a, b) {
        for (const t of this.around[b].slice()) {
            if (this.triangles[t].includes(a)) this.remove(t);
            else {
                this.triangles[t] = this.triangles[t].map((v) => (v === b ? a : v));
                this.around[a].push(t);
            }
        }
        this.around[b] = [];
    }

    remove(t) {
        for (const v of this.triangles[t]) this.around[v] = this.around[v].filter((other) => other !== t);
        this.triangles[t] = null;
    }

    collapseEdges() {
        for (let before = Infinity, left = [...this.triangles.keys()]; left.length < before;) {
            before = left.length;
            for (const t of left) {
                const corners = this.triangles[t];
                const edge = corners && [0, 1, 2].map((i) => [corners[i], corners[(i + 1) % 3]])
                    .find(([a, b]) => this.key(a) === this.key(b) && this.canMerge(a, b));
                if (edge) this.merge(Math.min(...edge), Math.max(...edge));
            }
            left = left.filter((t) => this.triangles[t] && new Set(this.triangles[t].map((v) => this.key(v))).size < 3);
        }
    }

    dropPoints() {
        const seen = new Set();
        for (const first of this.vertices()) {
            if (seen.has(first)) continue;
            const component = new Set([first]);
            for (const v of component) for (const w of this.link(v).flat()) component.add(w);
            const isPoint = [...component].every((v) => this.key(v) === this.key(first));
            for (const v of component) {
                seen.add(v);
                if (isPoint) for (const t of this.around[v].slice()) this.remove(t);
            }
        }
    }

    /** Moves a vertex to the nearest free position where its triangles have an area, or, if not `strictly`, to a free one. */
    displace(v, taken, strictly) {
        const old = [...this.at(v)];
        const step = Math.max(...old.map(Math.abs), 2 ** -103) * 2 ** -23;
        let free = null;
        for (let shell = 1; shell <= MAX_DISPLACEMENT; shell++) {
            const side = 2 * shell + 1;
            for (let i = 0; i < side ** 3; i++) {
                const offset = [Math.floor(i / side / side), Math.floor(i / side) % side, i % side].map((x) => x - shell);
                if (!offset.some((x) => Math.abs(x) === shell)) continue;
                this.at(v).set(old.map((x, axis) => x + step * offset[axis] + 0));
                if (taken.has(this.key(v))) continue;
                if (!this.around[v].some((t) => this.isFlat(this.triangles[t]))) {
                    taken.add(this.key(v));
                    return true;
                }
                free ??= [...this.at(v)];
            }
        }
        const isMoved = free && !strictly;
        this.at(v).set(isMoved ? free : old);
        if (isMoved) taken.add(this.key(v));
        return isMoved;
    }

    separateVertices() {
        const taken = new Set();
        const coincident = this.vertices().filter((v) => taken.size === taken.add(this.key(v)).size);
        for (const v of coincident) this.displace(v, taken, false);
    }

    openTriangles() {
        const taken = new Set(this.vertices().map((v) => this.key(v)));
        for (let pass = 0; pass < MAX_PASSES; pass++) {
            for (const corners of this.flat()) {
                if (!this.isFlat(corners)) continue;
                const opposite = (i) => Math.hypot(...this.at(corners[(i + 1) % 3]).map((x, axis) => x - this.at(corners[(i + 2) % 3])[axis]));
                // The corner opposite the longest side first.
                [0, 1, 2].sort((i, j) => opposite(j) - opposite(i)).some((i) => this.displace(corners[i], taken, true));
            }
        }
    }
}

/** A mesh whose vertices have different positions and whose triangles have an area, so that welding changes nothing. */
function welded(mesh) {
    const welder = new Welder(mesh);
    const vertices = welder.vertices();
    if (new Set(vertices.map((v) => welder.key(v))).size < vertices.length || welder.flat().length > 0) {
        welder.collapseEdges();
        welder.dropPoints();
        welder.separateVertices();
        welder.openTriangles();
    }
    return { ...mesh, positions: welder.positions, triangles: Uint32Array.from(welder.triangles.filter(Boolean).flat()) };
}

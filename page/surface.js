// The mesh at one isovalue for drawing: vertices, positions and normals. Arrays are reused for the next isovalue, so that a sweep
// makes no garbage; they are longer than `nVertices` and `nTriangles` require.

/** The capacity of a new array for n numbers: a quarter more, because a mesh often grows during a sweep. */
function capacityFor(n) {
    return Math.ceil(1.25 * n);
}

/** The array if it has room for n numbers, else a new and larger one, of zeros. */
function withCapacity(array, n) {
    return array.length >= n ? array : new array.constructor(capacityFor(n));
}

class Surface {
    constructor(spectrum, step) {
        Object.assign(this, { spectrum, step });
        const n = spectrum.firstKnot.length - 1;
        // For each vertex of the spectrum, the last list that used it and its number in that list.
        this.mark = new Uint32Array(n);
        this.numberOf = new Uint32Array(n);
        this.nLists = 0;
        this.nTriangles = 0;
        this.nVertices = 0;
        /** The triangles, and the numbers of their vertices among those of the mesh. */
        this.triangles = new Uint32Array(0);
        /** The number of each triangle's component, if components were requested. */
        this.components = new Uint32Array(0);
        this.corners = new Uint32Array(0);
        /** The vertices by their numbers in the spectrum; their positions, voxels. */
        this.vertices = new Uint32Array(0);
        this.positions = new Float32Array(0);
        /** Normals of any length, towards the outer side; and their codes. */
        this.directions = new Float64Array(0);
        this.capDirections = new Float64Array(0);
        this.normals = new Uint32Array(0);
    }

    /**
     * Collects the active triangles, without caps if `open`. `componentOf` gives the component of the triangle at a place in the list,
     * negative if it is hidden; null if all are shown.
     */
    collect(active, open, componentOf) {
        const { mark, numberOf } = this;
        const { vertices, caps } = this.spectrum;
        this.triangles = withCapacity(this.triangles, active.length);
        this.components = withCapacity(this.components, active.length);
        this.corners = withCapacity(this.corners, 3 * active.length);
        // There are at most three vertices per triangle.
        this.vertices = withCapacity(this.vertices, Math.min(3 * active.length, mark.length));
        this.nLists++;
        let n = 0;
        let nVertices = 0;
        for (let i = 0; i < active.length; i++) {
            const t = active.list[i];
            const component = componentOf === null ? 0 : componentOf(i);
            if ((open && caps[t]) || component < 0) continue;
            this.components[n] = component;
            for (let k = 0; k < 3; k++) {
                const v = vertices[3 * t + k];
                if (mark[v] !== this.nLists) {
                    mark[v] = this.nLists;
                    numberOf[v] = nVertices;
                    this.vertices[nVertices++] = v;
                }
                this.corners[3 * n + k] = numberOf[v];
            }
            this.triangles[n++] = t;
        }
        this.nTriangles = n;
        this.nVertices = nVertices;
    }

    /** Moves the vertices to an isovalue, whose rank is `rank`, and computes the normals. */
    moveTo(isovalue, rank) {
        this.placeAll(isovalue, rank);
        this.directions = withCapacity(this.directions, 3 * this.nVertices);
        this.capDirections = withCapacity(this.capDirections, 3 * this.nVertices);
        this.directions.fill(0, 0, 3 * this.nVertices);
        this.capDirections.fill(0, 0, 3 * this.nVertices);
        const hasCaps = addAreas(this, this.spectrum.caps, this.directions, this.capDirections);
        fillDirections(this.nVertices, this.directions, hasCaps ? this.capDirections : null);
        this.normals = withCapacity(this.normals, this.nVertices);
        codesOf(this.nVertices, this.directions, this.normals);
    }

    /** The knots before and after vertex i, and the share of the way between them. */
    knotsAround(i) {
        const { firstKnot, ranks, isovalues } = this.spectrum;
        const v = this.vertices[i];
        const a = knotAt(firstKnot, ranks, v, this.rank);
        const b = Math.min(a + 1, firstKnot[v + 1] - 1);
        const low = 0.5 * isovalues[ranks[a]];
        const t = (0.5 * this.isovalue - low) / (0.5 * isovalues[ranks[b]] - low);
        return [a, b, t > 0 && t < Infinity ? Math.min(t, 1) : 0];
    }

    /** Moves the vertices to an isovalue. */
    placeAll(isovalue, rank) {
        Object.assign(this, { isovalue, rank });
        this.positions = withCapacity(this.positions, 3 * this.nVertices);
        for (let i = 0; i < this.nVertices; i++) this.place(i, isovalue, rank);
    }

    /** Computes the position of vertex i. */
    place(i, isovalue, rank) {
        const { positions, step } = this;
        const { firstKnot, ranks, isovalues, positions: from } = this.spectrum;
        const v = this.vertices[i];
        const a = knotAt(firstKnot, ranks, v, rank);
        const b = Math.min(a + 1, firstKnot[v + 1] - 1);
        const low = 0.5 * isovalues[ranks[a]];
        let t = (0.5 * isovalue - low) / (0.5 * isovalues[ranks[b]] - low);
        t = t > 0 && t < Infinity ? Math.min(t, 1) : 0;
        positions[3 * i] = step * ((1 - t) * from[3 * a] + t * from[3 * b]);
        positions[3 * i + 1] = step * ((1 - t) * from[3 * a + 1] + t * from[3 * b + 1]);
        positions[3 * i + 2] = step * ((1 - t) * from[3 * a + 2] + t * from[3 * b + 2]);
    }

    /** The positions of the vertices. */
    points() {
        return Array.from({ length: this.nVertices }, (_, i) => [...this.positions.subarray(3 * i, 3 * i + 3)]);
    }
}

// The mesh at one isovalue as it is drawn: which vertices it has, where they are, and the normals there. Arrays
// are used again for the next isovalue, so that a sweep makes no garbage; they hold more than `nVertices`
// or `nTriangles` say.

/** How much room is made where there is too little for n numbers: a quarter more, as a sweep goes on. */
function roomOf(n) {
    return Math.ceil(1.25 * n);
}

/** An array with room for n numbers: the same where it has it, else a larger one, empty. */
function roomFor(array, n) {
    return array.length >= n ? array : new array.constructor(roomOf(n));
}

class Surface {
    constructor(spectrum, step) {
        Object.assign(this, { spectrum, step });
        const n = spectrum.firstKnot.length - 1;
        // Of each vertex of the spectrum: the list that used it last, and its number there.
        this.mark = new Uint32Array(n);
        this.numberOf = new Uint32Array(n);
        this.nLists = 0;
        this.nTriangles = 0;
        this.nVertices = 0;
        /** The triangles, and the numbers of their vertices among those of the mesh. */
        this.triangles = new Uint32Array(0);
        /** Of each triangle the number of its component, where these were asked for. */
        this.names = new Uint32Array(0);
        this.corners = new Uint32Array(0);
        /** The vertices, as the spectrum numbers them; their positions, voxels. */
        this.vertices = new Uint32Array(0);
        this.positions = new Float32Array(0);
        /** Directions of the normals, towards lower values, of any length; and their codes. */
        this.directions = new Float64Array(0);
        this.capDirections = new Float64Array(0);
        this.normals = new Uint32Array(0);
    }

    /**
     * Takes over the triangles that are alive, without caps where `open`; where components are `named`, those whose
     * name by their place in the list is not negative.
     */
    list(active, open, named) {
        const { mark, numberOf } = this;
        const { vertices, caps } = this.spectrum;
        this.triangles = roomFor(this.triangles, active.length);
        this.names = roomFor(this.names, active.length);
        this.corners = roomFor(this.corners, 3 * active.length);
        // A triangle has three vertices of its own at most.
        this.vertices = roomFor(this.vertices, Math.min(3 * active.length, mark.length));
        this.nLists++;
        let n = 0;
        let nVertices = 0;
        for (let i = 0; i < active.length; i++) {
            const t = active.list[i];
            const name = named === null ? 0 : named(i);
            if ((open && caps[t]) || name < 0) continue;
            this.names[n] = name;
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

    /** Moves the vertices to an isovalue, whose rank is `rank`, and finds the normals there. */
    moveTo(isovalue, rank) {
        this.placeAll(isovalue, rank);
        this.directions = roomFor(this.directions, 3 * this.nVertices);
        this.capDirections = roomFor(this.capDirections, 3 * this.nVertices);
        this.directions.fill(0, 0, 3 * this.nVertices);
        this.capDirections.fill(0, 0, 3 * this.nVertices);
        const hasCaps = addAreas(this, this.spectrum.caps, this.directions, this.capDirections);
        giveDirections(this.nVertices, this.directions, hasCaps ? this.capDirections : null);
        this.normals = roomFor(this.normals, this.nVertices);
        codesOf(this.nVertices, this.directions, this.normals);
    }

    /** Of a vertex the knots on either side, and how far it is from the first to the second. */
    wayOf(i) {
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
        this.positions = roomFor(this.positions, 3 * this.nVertices);
        for (let i = 0; i < this.nVertices; i++) this.place(i, isovalue, rank);
    }

    /** Writes where a vertex is. */
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

    /** The two corners of the box around the mesh, voxels; none around nothing. */
    box() {
        if (this.nVertices === 0) return null;
        const [least, most] = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]];
        for (let at = 0; at < 3 * this.nVertices; at++) {
            const axis = at % 3;
            least[axis] = Math.min(least[axis], this.positions[at]);
            most[axis] = Math.max(most[axis], this.positions[at]);
        }
        return [least, most];
    }
}

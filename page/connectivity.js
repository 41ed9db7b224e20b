// Decodes the triangles: at each rank, dying triangles leave holes, and new triangles fill them along a walk around their edges.
// FORMAT.md, section TRIA; the twin of src/file/connectivity.rs and src/file/holes.rs.

const NONE = -1;
/** The most gates at a vertex that are searched for the other side of an edge. */
const MAX_SEARCH = 64;
/** Codes of the third vertex of a triangle at a gate. */
const [NEW, SKIP, JUMP, LEAP, DEPTH, ALONG] = [0, 1, 2, 3, 4, 5];

/**
 * A gate is an edge of a hole. Its numbers: first and second vertex, whether it is open, the next older gate with the same first
 * vertex, the gates before and after it in its loop, the half-edge of the living triangle behind it.
 */
const GATE = 7;
const [FROM, TO, OPEN, OLDER, PREVIOUS, NEXT, BEHIND] = [0, 1, 2, 3, 4, 5, 6];

/** Values of `flagRank` that are no rank. */
const [DEAD, NEVER] = [-2, -1];

/** The next and the previous half-edge of the same triangle. */
const nextOf = (h) => (h % 3 === 2 ? h - 2 : h + 1);
const previousOf = (h) => (h % 3 === 0 ? h + 2 : h - 1);

/** The living triangles, and the gates of the holes that dying triangles leave. */
class Holes {
    /**
     * No gates and no triangles, of the columns of section TRIA. There is room for n triangles; the vertices below `nUsed` are known.
     */
    constructor(columns, { firstKnot, isLattice }, nUsed = 0, n = columns.n) {
        const nVertices = firstKnot.length - 1;
        Object.assign(this, columns, { isLattice, nUsed, last: 0 });
        // A stack.
        this.gates = new Int32Array(GATE * 1024);
        this.nGates = 0;
        // The newest gate that starts at each vertex.
        this.newestGate = new Int32Array(nVertices).fill(NONE);
        // Three for each triangle.
        this.vertices = new Uint32Array(3 * n);
        // By half-edge, its twin; for those of dying triangles at a gate, -2 minus the gate's number.
        this.twins = new Int32Array(3 * n).fill(NONE);
        // By vertex, a half-edge of a living triangle that starts there.
        this.outgoing = new Int32Array(nVertices).fill(NONE);
        // By triangle, the last rank at which it had a flag; DEAD or NEVER.
        this.flagRank = new Int32Array(n).fill(NEVER);
        // The gate that was popped last.
        this.popped = new Int32Array(GATE);
    }

    /**
     * The triangles that die at a rank: those around `ended` vertices, those of `explicit`, and neighbours of these whose flags say so.
     */
    dying(rank, ended, explicit) {
        const dying = [];
        for (const v of ended) this.killAround(v, dying);
        const nAtEnds = dying.length;
        this.killKnown?.(rank, dying);
        let nVisited = 0;
        const visitNeighbours = () => {
            for (; nVisited < dying.length; nVisited++) {
                const first = 3 * dying[nVisited];
                for (let h = first; h < first + 3; h++) {
                    const twin = this.twins[h];
                    if (twin < 0) continue;
                    const t = Math.floor(twin / 3);
                    if (this.flagRank[t] === DEAD || this.flagRank[t] === rank) continue;
                    this.flagRank[t] = rank;
                    if (this.dies(t, nVisited < nAtEnds)) this.kill(t, dying);
                }
            }
        };
        visitNeighbours();
        for (const t of explicit) if (this.kill(t, dying)) visitNeighbours();
        return dying;
    }

    /** The death flag of triangle t. */
    dies(t, isNearEnd) {
        const { isLattice, vertices } = this;
        const isOnLattice = isLattice[vertices[3 * t]] && isLattice[vertices[3 * t + 1]] && isLattice[vertices[3 * t + 2]];
        return this.flags[(isOnLattice ? 2 : 0) + (isNearEnd ? 1 : 0)]() === 1;
    }

    /** Marks a triangle as dying; false if it is dead already. */
    kill(t, dying) {
        if (this.flagRank[t] === DEAD) return false;
        this.flagRank[t] = DEAD;
        dying.push(t);
        return true;
    }

    killAround(v, dying) {
        const { twins } = this;
        const first = this.outgoing[v];
        if (first === NONE) return;
        let h = first;
        do {
            this.kill(Math.floor(h / 3), dying);
            h = twins[previousOf(h)];
            if (h === first) return;
        } while (h !== NONE);
        // At a boundary: the other way round from the first half-edge.
        for (h = twins[first]; h !== NONE; h = twins[nextOf(h)]) this.kill(Math.floor(h / 3), dying);
    }

    clearGates() {
        for (let i = 0; i < this.nGates; i++) this.newestGate[this.gates[GATE * i + FROM]] = NONE;
        this.nGates = 0;
    }

    /** Removes the old gates and opens gates around dying triangles. */
    openGates(dying) {
        const { twins, vertices, flagRank } = this;
        this.clearGates();
        const sides = [];
        for (const t of dying) {
            for (let h = 3 * t; h < 3 * t + 3; h++) {
                const twin = twins[h];
                const from = vertices[h];
                const to = vertices[nextOf(h)];
                if (this.outgoing[from] === h) this.outgoing[from] = NONE;
                if (twin >= 0 && flagRank[Math.floor(twin / 3)] === DEAD) continue;
                if (twin >= 0) {
                    twins[twin] = NONE;
                    this.outgoing[to] = twin;
                    this.outgoing[from] = nextOf(twin);
                }
                sides.push(h);
                twins[h] = -2 - this.push(from, to, twin);
            }
        }
        for (let gate = 0; gate < sides.length; gate++) {
            let h = nextOf(sides[gate]);
            while (twins[h] >= 0) h = nextOf(twins[h]);
            this.link(gate, -2 - twins[h]);
        }
    }

    /** Pops gates down to the first open one; false if there is none. */
    pop() {
        const { gates } = this;
        while (this.nGates > 0) {
            const at = GATE * --this.nGates;
            this.newestGate[gates[at + FROM]] = gates[at + OLDER];
            if (gates[at + OPEN] === 1) {
                this.popped.set(gates.subarray(at, at + GATE));
                return true;
            }
        }
        return false;
    }

    /** Skips the gate that was popped: it gets no triangle. */
    skip() {
        if (this.popped[NEXT] !== this.nGates) this.link(this.popped[PREVIOUS], this.popped[NEXT]);
    }

    /** The third vertex at the gate that was popped, for a code of ALONG or more. */
    third(code) {
        const isAfter = (code - ALONG) % 2;
        const side = isAfter ? NEXT : PREVIOUS;
        let gate = this.popped[side];
        for (let k = (code - ALONG - isAfter) / 2; k > 0; k--) gate = this.gates[GATE * gate + side];
        return this.gates[GATE * gate + (isAfter ? TO : FROM)];
    }

    /** The first vertex of the gate at a depth of the stack. */
    atDepth(depth) {
        return this.gates[GATE * (this.nGates - 1 - depth) + FROM];
    }

    /** Reads and adds triangles from number t up to `end`. */
    read(t, end) {
        const { vertices, code, jump, depth, seed } = this;
        let { nUsed, last } = this;
        while (t < end) {
            const isAtGate = this.pop();
            let [a, b] = this.popped;
            let c = nUsed;
            if (isAtGate) {
                const kind = code();
                if (kind === SKIP) {
                    this.skip();
                    continue;
                }
                if (kind === JUMP || kind === LEAP) last = c = (kind === LEAP ? last : a) + jump();
                else if (kind === DEPTH) c = this.atDepth(depth());
                else if (kind !== NEW) c = this.third(kind);
            } else {
                // New vertices are numbered in the order of use.
                a = nUsed - seed();
                const most = Math.max(nUsed, a + 1);
                b = most - seed();
                c = Math.max(most, b + 1) - seed();
            }
            nUsed = Math.max(nUsed, a + 1, b + 1, c + 1);
            vertices[3 * t] = a;
            vertices[3 * t + 1] = b;
            vertices[3 * t + 2] = c;
            if (isAtGate) this.fill(t);
            else this.addSeed(t);
            t++;
        }
        Object.assign(this, { nUsed, last });
    }
    /** Adds triangle t, whose vertices are known, at the gate that was popped. */
    fill(t) {
        const [from, to, , , before, after, behind] = this.popped;
        const third = this.vertices[3 * t + 2];
        const removed = this.nGates;
        this.add(t);
        this.setTwins(3 * t, behind);
        const second = this.push(third, to, 3 * t + 1);
        const first = this.push(from, third, 3 * t + 2);
        this.link(first, second);
        this.link(before === removed ? second : before, first);
        this.link(second, after === removed ? first : after);
        this.glueIfPossible(second);
        this.glueIfPossible(first);
    }

    /** Adds triangle t, whose vertices are known, without a gate. */
    addSeed(t) {
        const h = 3 * t;
        const [a, b, c] = this.vertices.subarray(h, h + 3);
        this.add(t);
        const gates = [this.push(b, a, h), this.push(a, c, h + 2), this.push(c, b, h + 1)];
        for (let i = 0; i < 3; i++) this.link(gates[i], gates[(i + 1) % 3]);
        for (const gate of gates) this.glueIfPossible(gate);
    }

    add(t) {
        for (let h = 3 * t; h < 3 * t + 3; h++) this.outgoing[this.vertices[h]] = h;
    }

    setTwins(a, b) {
        if (a !== NONE) this.twins[a] = b;
        if (b !== NONE) this.twins[b] = a;
    }

    link(before, after) {
        this.gates[GATE * before + NEXT] = after;
        this.gates[GATE * after + PREVIOUS] = before;
    }

    push(from, to, behind) {
        const index = this.nGates++;
        if (GATE * this.nGates > this.gates.length) {
            const gates = new Int32Array(2 * this.gates.length);
            gates.set(this.gates);
            this.gates = gates;
        }
        const { gates } = this;
        const at = GATE * index;
        gates[at + FROM] = from;
        gates[at + TO] = to;
        gates[at + OPEN] = 1;
        gates[at + OLDER] = this.newestGate[from];
        gates[at + PREVIOUS] = index;
        gates[at + NEXT] = index;
        gates[at + BEHIND] = behind;
        this.newestGate[from] = index;
        return index;
    }

    /** Glues a gate to an open gate with the opposite edge, if one is found: a neighbour in its loop, else the newest. */
    glueIfPossible(gate) {
        const { gates } = this;
        const at = GATE * gate;
        if (gates[at + OPEN] === 0) return;
        const from = gates[at + FROM];
        const to = gates[at + TO];
        const isOpposite = (i) => {
            const other = GATE * i;
            return i !== gate && gates[other + OPEN] === 1 && gates[other + FROM] === to && gates[other + TO] === from;
        };
        if (isOpposite(gates[at + PREVIOUS])) return this.glue(gate, gates[at + PREVIOUS]);
        if (isOpposite(gates[at + NEXT])) return this.glue(gate, gates[at + NEXT]);
        let i = this.newestGate[to];
        for (let n = 0; i !== NONE && n < MAX_SEARCH; n++) {
            if (isOpposite(i)) return this.glue(gate, i);
            i = gates[GATE * i + OLDER];
        }
    }

    /** Glues two gates with opposite edges: joins their triangles and links their loops. */
    glue(x, y) {
        const { gates } = this;
        const [a, b] = [GATE * x, GATE * y];
        this.setTwins(gates[a + BEHIND], gates[b + BEHIND]);
        const [beforeX, afterX] = [gates[a + PREVIOUS], gates[a + NEXT]];
        const [beforeY, afterY] = [gates[b + PREVIOUS], gates[b + NEXT]];
        // A gate that is alone in its loop has no neighbours to link.
        if (afterX === x || afterY === y) {
            if (afterX !== x) this.link(beforeX, afterX);
            if (afterY !== y) this.link(beforeY, afterY);
        } else {
            if (afterX !== y) this.link(beforeY, afterX);
            if (afterY !== x) this.link(beforeX, afterY);
        }
        gates[a + OPEN] = 0;
        gates[b + OPEN] = 0;
    }
}

/** Lists of numbers by rank, the newest first. */
class ByRank {
    constructor(nRanks, nNumbers) {
        this.newest = new Int32Array(nRanks).fill(NONE);
        this.older = new Int32Array(nNumbers);
    }

    push(rank, number) {
        this.older[number] = this.newest[rank];
        this.newest[rank] = number;
    }

    *at(rank) {
        for (let i = this.newest[rank]; i !== NONE; i = this.older[i]) yield i;
    }
}

/**
 * The columns of section TRIA: births and caps as arrays; functions that return the next number of the others, `nKinds` of them of death
 * flags; and for each of `nDirections` one that lists triangle t by its explicit end, if it has one, after the rank `from`.
 */
function triangleColumnsOf(section, nKinds, nDirections) {
    const columns = new CodedColumns(section);
    const counted = () => columns.column(columns.count());
    const births = counted();
    const code = reader(counted());
    const jump = reader(signed(counted()));
    const [depth, seed, ...flags] = Array.from({ length: 2 + nKinds }, () => reader(counted()));
    const n = births.reduce((sum, count) => sum + count, 0);
    let caps;
    const listEnd = Array.from({ length: nDirections }, () => {
        const kinds = columns.column(n);
        caps ??= kinds.map((kind) => (kind >= 3 ? 1 : 0));
        const next = intervalReader(columns, kinds.filter((kind) => kind % 3 === 2).length);
        let last = 0;
        return (t, from, explicit) => {
            const kind = kinds[t] % 3;
            if (kind === 2) last = next(from);
            if (kind > 0) explicit.push(last, t);
        };
    });
    return { births, code, jump, depth, seed, flags, n, listEnd, caps };
}

/** The vertices by the rank of their first (`end` 0) or last (1) knot. */
function verticesByEnd({ firstKnot, ranks }, nIsovalues, end) {
    const ends = new ByRank(nIsovalues, firstKnot.length);
    for (let v = firstKnot.length - 2; v >= 0; v--) {
        if (firstKnot[v] < firstKnot[v + 1]) ends.push(ranks[firstKnot[v + end] - end], v);
    }
    return ends;
}

/** Decodes section TRIA: the triangles in the order of birth. */
function trianglesOf(section, trajectories, nIsovalues) {
    const columns = triangleColumnsOf(section, 4, 1);
    const { n, caps, listEnd: [listEnd] } = columns;
    const births = new Uint32Array(n);
    const deaths = new Uint32Array(n);
    const holes = new Holes(columns, trajectories);
    const ended = verticesByEnd(trajectories, nIsovalues, 1);
    const explicit = new ByRank(nIsovalues, n);
    for (let rank = 0, t = 0; rank < nIsovalues; rank++) {
        const dying = holes.dying(rank, ended.at(rank), explicit.at(rank));
        for (const d of dying) deaths[d] = rank;
        holes.openGates(dying);
        const end = t + columns.births[rank];
        holes.read(t, end);
        for (; t < end; t++) {
            births[t] = rank;
            listEnd(t, rank, explicit);
        }
    }
    return { vertices: holes.vertices, births, deaths, caps };
}

// Which vertices the triangles join: the walk around the holes that dying triangles leave.
// FORMAT.md, section TRIA; the twin of src/file/connectivity.rs and src/file/front.rs.

const NO_GATE = -1;
const MOST_GATES = 64;

/** Numbers of a gate: where from and to, whether open, the next older gate at either end. */
const GATE = 5;
const [FROM, TO, OPEN, OLDER_STARTING, OLDER_ENDING] = [0, 1, 2, 3, 4];

/** The gates that are open, and the triangles that will open the next ones when they die. */
class Front {
    constructor(nVertices, nIsovalues, vertices) {
        // A stack.
        this.gates = new Int32Array(GATE * 1024);
        this.nGates = 0;
        // The newest gate that starts and that ends at each vertex.
        this.starting = new Int32Array(nVertices).fill(NO_GATE);
        this.ending = new Int32Array(nVertices).fill(NO_GATE);
        // Triangles by the rank at which they die, the last one first.
        this.dying = new Int32Array(nIsovalues).fill(-1);
        this.nextDying = new Int32Array(vertices.length / 3);
        this.vertices = vertices;
        // The gate taken last.
        this.gateFrom = 0;
        this.gateTo = 0;
    }

    /** Closes what is left and opens the gates around the triangles that die at a rank. */
    open(rank) {
        const { gates, vertices } = this;
        for (let i = 0; i < this.nGates; i++) {
            this.starting[gates[GATE * i + FROM]] = NO_GATE;
            this.ending[gates[GATE * i + TO]] = NO_GATE;
        }
        this.nGates = 0;
        for (let t = this.dying[rank]; t >= 0; t = this.nextDying[t]) {
            const a = vertices[3 * t];
            const b = vertices[3 * t + 1];
            const c = vertices[3 * t + 2];
            this.closeOrOpen(b, a, a, b);
            this.closeOrOpen(c, b, b, c);
            this.closeOrOpen(a, c, c, a);
        }
    }

    /** Takes gates off the stack down to the first open one; whether there was one. */
    pop() {
        const { gates } = this;
        while (this.nGates > 0) {
            const at = GATE * --this.nGates;
            this.gateFrom = gates[at + FROM];
            this.gateTo = gates[at + TO];
            this.starting[this.gateFrom] = gates[at + OLDER_STARTING];
            this.ending[this.gateTo] = gates[at + OLDER_ENDING];
            if (gates[at + OPEN] === 1) return true;
        }
        return false;
    }

    /** Adds a triangle; at a gate, its first side is the gate. */
    add(t, a, b, c, death, atGate) {
        if (!atGate) this.closeOrOpen(a, b, b, a);
        this.closeOrOpen(b, c, c, b);
        this.closeOrOpen(c, a, a, c);
        this.nextDying[t] = this.dying[death];
        this.dying[death] = t;
    }

    closeOrOpen(closeFrom, closeTo, openFrom, openTo) {
        const { gates } = this;
        let i = this.starting[closeFrom];
        for (let n = 0; i !== NO_GATE && n < MOST_GATES; n++) {
            const at = GATE * i;
            if (gates[at + OPEN] === 1 && gates[at + TO] === closeTo) {
                gates[at + OPEN] = 0;
                return;
            }
            i = gates[at + OLDER_STARTING];
        }
        this.push(openFrom, openTo);
    }

    push(from, to) {
        const index = this.nGates++;
        if (GATE * this.nGates > this.gates.length) {
            const gates = new Int32Array(2 * this.gates.length);
            gates.set(this.gates);
            this.gates = gates;
        }
        const at = GATE * index;
        this.gates[at + FROM] = from;
        this.gates[at + TO] = to;
        this.gates[at + OPEN] = 1;
        this.gates[at + OLDER_STARTING] = this.starting[from];
        this.gates[at + OLDER_ENDING] = this.ending[to];
        this.starting[from] = index;
        this.ending[to] = index;
    }

    /** Where the newest open gate at a vertex leads. */
    after(v) {
        return this.other(this.starting[v], OLDER_STARTING, TO);
    }

    /** Where the newest open gate to a vertex comes from. */
    before(v) {
        return this.other(this.ending[v], OLDER_ENDING, FROM);
    }

    /** One end of the first open gate of a list. */
    other(gate, older, end) {
        const { gates } = this;
        for (let n = 0, i = gate; i !== NO_GATE && n < MOST_GATES; n++, i = gates[GATE * i + older]) {
            if (gates[GATE * i + OPEN] === 1) return gates[GATE * i + end];
        }
        throw new Error("a triangle has a vertex that does not exist");
    }
}

/** Triangles, by birth, from section TRIA. */
function trianglesOf(section, { firstKnot, ranks }, nIsovalues) {
    const columns = new Columns(section);
    const counted = (signed) => {
        const n = columns.count();
        return signed ? columns.signedColumn(n) : columns.column(n);
    };
    const born = counted();
    const codes = counted();
    const jumps = counted(true);
    const starts = counted();
    const n = born.reduce((sum, count) => sum + count, 0);
    const deathCodes = columns.column(n);
    const wayFrom = waysOf(columns, deathCodes.reduce((sum, code) => sum + (code === 2), 0));
    const caps = Uint8Array.from(columns.column(n));

    const vertices = new Uint32Array(3 * n);
    const births = new Uint32Array(n);
    const deaths = new Uint32Array(n);
    const front = new Front(firstKnot.length - 1, nIsovalues, vertices);
    const lastRank = (v) => ranks[firstKnot[v + 1] - 1];
    let nUsed = 0;
    let code = 0;
    let jump = 0;
    let start = 0;
    let t = 0;
    for (let rank = 0; rank < nIsovalues; rank++) {
        const end = t + born[rank];
        if (t < end) front.open(rank);
        while (t < end) {
            const atGate = front.pop();
            let a = front.gateFrom;
            let b = front.gateTo;
            let c = nUsed;
            if (atGate) {
                const kind = codes[code++];
                if (kind === 1) continue;
                if (kind === 2) c = a + jumps[jump++];
                else if (kind === 3) c = front.before(a);
                else if (kind >= 4) {
                    c = front.after(b);
                    for (let k = kind; k > 4; k--) c = front.after(c);
                }
            } else {
                // A new vertex is the next in number.
                a = nUsed - starts[start++];
                const n = Math.max(nUsed, a + 1);
                b = n - starts[start++];
                c = Math.max(n, b + 1) - starts[start++];
            }
            nUsed = Math.max(nUsed, a + 1, b + 1, c + 1);
            vertices[3 * t] = a;
            vertices[3 * t + 1] = b;
            vertices[3 * t + 2] = c;
            births[t] = rank;
            const last = Math.min(lastRank(a), lastRank(b), lastRank(c));
            // With a vertex, with the triangle before, or by a way.
            const kind = deathCodes[t];
            deaths[t] = kind === 0 ? last : kind === 1 ? deaths[t - 1] : wayFrom(rank);
            front.add(t, a, b, c, deaths[t], atGate);
            t++;
        }
    }
    return { vertices, births, deaths, caps };
}

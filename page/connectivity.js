// Which vertices the triangles join: the walk around the holes that dying triangles leave.
// FORMAT.md, section TRIA; the twin of src/file/connectivity.rs and src/file/front.rs.

const NO_GATE = -1;
const MOST_GATES = 64;

/** The gates that are open, and the triangles that will open the next ones when they die. */
class Front {
    constructor(nVertices, nIsovalues, vertices) {
        // Gates, a stack: where from and to, whether open, the next older one at either end.
        this.from = [];
        this.to = [];
        this.isOpen = [];
        this.olderStarting = [];
        this.olderEnding = [];
        // The newest gate that starts and that ends at each vertex.
        this.starting = new Int32Array(nVertices).fill(NO_GATE);
        this.ending = new Int32Array(nVertices).fill(NO_GATE);
        // Triangles by the rank at which they die, the last one first.
        this.dying = new Int32Array(nIsovalues).fill(-1);
        this.nextDying = new Int32Array(vertices.length / 3);
        this.vertices = vertices;
    }

    /** Closes what is left and opens the gates around the triangles that die at a rank. */
    open(rank) {
        for (let i = this.from.length - 1; i >= 0; i--) {
            this.starting[this.from[i]] = NO_GATE;
            this.ending[this.to[i]] = NO_GATE;
        }
        for (const list of [this.from, this.to, this.isOpen, this.olderStarting, this.olderEnding]) {
            list.length = 0;
        }
        for (let t = this.dying[rank]; t >= 0; t = this.nextDying[t]) {
            const [a, b, c] = this.vertices.subarray(3 * t, 3 * t + 3);
            this.closeOrOpen(b, a, a, b);
            this.closeOrOpen(c, b, b, c);
            this.closeOrOpen(a, c, c, a);
        }
    }

    /** Takes gates off the stack down to the first open one; whether there was one. */
    pop() {
        while (this.from.length > 0) {
            this.gateFrom = this.from.pop();
            this.gateTo = this.to.pop();
            this.starting[this.gateFrom] = this.olderStarting.pop();
            this.ending[this.gateTo] = this.olderEnding.pop();
            if (this.isOpen.pop()) return true;
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
        let i = this.starting[closeFrom];
        for (let n = 0; i !== NO_GATE && n < MOST_GATES; n++, i = this.olderStarting[i]) {
            if (this.isOpen[i] && this.to[i] === closeTo) {
                this.isOpen[i] = false;
                return;
            }
        }
        const index = this.from.length;
        this.from.push(openFrom);
        this.to.push(openTo);
        this.isOpen.push(true);
        this.olderStarting.push(this.starting[openFrom]);
        this.olderEnding.push(this.ending[openTo]);
        this.starting[openFrom] = index;
        this.ending[openTo] = index;
    }

    /** Where the newest open gate at a vertex leads. */
    after(v) {
        let i = this.starting[v];
        for (let n = 0; i !== NO_GATE && n < MOST_GATES; n++, i = this.olderStarting[i]) {
            if (this.isOpen[i]) return this.to[i];
        }
        throw new Error("a triangle has a vertex that does not exist");
    }

    /** Where the newest open gate to a vertex comes from. */
    before(v) {
        let i = this.ending[v];
        for (let n = 0; i !== NO_GATE && n < MOST_GATES; n++, i = this.olderEnding[i]) {
            if (this.isOpen[i]) return this.from[i];
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
    const early = columns.column(n);
    const caps = Uint8Array.from(columns.column(n));

    const vertices = new Uint32Array(3 * n);
    const births = new Uint32Array(n);
    const deaths = new Uint32Array(n);
    const front = new Front(firstKnot.length - 1, nIsovalues, vertices);
    const lastRank = (v) => ranks[firstKnot[v + 1] - 1];
    let [nUsed, code, jump, start, t] = [0, 0, 0, 0, 0];
    for (let rank = 0; rank < nIsovalues; rank++) {
        const end = t + born[rank];
        if (t < end) front.open(rank);
        while (t < end) {
            const atGate = front.pop();
            let [a, b, c] = [front.gateFrom, front.gateTo, nUsed];
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
                let n = nUsed;
                const next = () => {
                    const back = starts[start++];
                    return back === 0 ? n++ : n - back;
                };
                [a, b, c] = [next(), next(), next()];
            }
            nUsed = Math.max(nUsed, a + 1, b + 1, c + 1);
            vertices[3 * t] = a;
            vertices[3 * t + 1] = b;
            vertices[3 * t + 2] = c;
            births[t] = rank;
            deaths[t] = Math.min(lastRank(a), lastRank(b), lastRank(c)) - early[t];
            front.add(t, a, b, c, deaths[t], atGate);
            t++;
        }
    }
    return { vertices, births, deaths, caps };
}

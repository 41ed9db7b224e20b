// Numbers told by decisions, each of which costs what it surprises. FORMAT.md, "Coded columns"; the twin of src/file/coder.rs.

const [FAST, SLOW] = [4, 7];
const EXPECTATION = 15;
const LEAST_RANGE = 2 ** 24;
const LEARNT = 7;
const LEARNT_OF_LONG = 3;
const KINDS_BEFORE = 8;
/** Contexts of a number, and where models lie: of lengths, of the bits of short numbers, of long ones. */
const CONTEXTS = 16 * KINDS_BEFORE;
const SHORT = 65 * CONTEXTS;
const LONG = SHORT + (LEARNT + 1) * 64 * CONTEXTS;
const MODELS = LONG + 65 * 8;

/** Reads decisions. */
class Decoder {
    constructor(bytes) {
        this.bytes = bytes;
        this.next = 0;
        this.range = 0xffffffff;
        this.code = 0;
        for (let i = 0; i < 5; i++) this.shift();
        /** Two estimates of each model, of 2^16. */
        this.models = new Uint16Array(2 * MODELS);
    }

    shift() {
        this.code = ((this.code << 8) | this.bytes[this.next++]) >>> 0;
    }

    /** The next decision, 0 or 1, by a model. */
    decide(model) {
        const { models } = this;
        const at = 2 * model;
        const fast = models[at];
        const slow = models[at + 1];
        const bound = (this.range >>> EXPECTATION) * ((fast + slow) >>> 2);
        const decision = this.code >= bound ? 1 : 0;
        if (decision) {
            this.code -= bound;
            this.range -= bound;
            models[at] = fast - (fast >>> FAST);
            models[at + 1] = slow - (slow >>> SLOW);
        } else {
            this.range = bound;
            models[at] = fast + ((65536 - fast) >>> FAST);
            models[at + 1] = slow + ((65536 - slow) >>> SLOW);
        }
        while (this.range < LEAST_RANGE) {
            this.range *= 256;
            this.shift();
        }
        return decision;
    }

    /** So many bits about which nothing is expected. */
    bits(n) {
        let value = 0;
        for (let i = 0; i < n; i++) {
            this.range >>>= 1;
            const bit = this.code >= this.range ? 1 : 0;
            if (bit) this.code -= this.range;
            value = 2 * value + bit;
            while (this.range < LEAST_RANGE) {
                this.range *= 256;
                this.shift();
            }
        }
        return value;
    }

    /** The next numbers, as many as there is room for. */
    row(numbers) {
        this.models.fill(32768);
        let [last, before] = [0, 0];
        for (let i = 0; i < numbers.length; i++) {
            const context = last * KINDS_BEFORE + Math.min(before, KINDS_BEFORE - 1);
            let n = 0;
            while (n < 64 && this.decide(65 * context + n)) n++;
            const value = n < 2 ? n : this.known(context, n);
            numbers[i] = value;
            before = last;
            last = value < 8 ? value : 8 + Math.min(n - 4, 7);
        }
        return numbers;
    }

    /** A number of n bits, of which the first is 1. */
    known(context, n) {
        const isLong = n > LEARNT;
        const first = isLong ? LONG + 8 * n : SHORT + 64 * ((LEARNT + 1) * context + n);
        const nLearnt = isLong ? LEARNT_OF_LONG : n - 1;
        let known = 1;
        for (let i = 0; i < nLearnt; i++) known = 2 * known + this.decide(first + known);
        const nLeft = n - 1 - nLearnt;
        return nLeft > 0 ? known * 2 ** nLeft + this.bits(nLeft) : known;
    }
}

// An adaptive binary range decoder. FORMAT.md, "Coded columns"; the twin of src/file/coder.rs.

/** The rates of the two probability estimates of a model in the end, as shifts. */
const [FAST, SLOW] = [4, 7];
/** A model counts up to so many decisions; until then its rates are higher. */
const MAX_COUNT = 2 ** SLOW - 3;
/** Bits of a probability. */
const PROBABILITY_BITS = 15;
/** The range is multiplied by 256 while it is below this. */
const MIN_RANGE = 2 ** 24;
/** Numbers of at most this many bits have all bits modelled. */
const MODELLED_BITS = 7;
/** The leading bits of longer numbers that are modelled. */
const MODELLED_BITS_OF_LONG = 3;
/** Kinds of the number before the last one. */
const KINDS_BEFORE = 8;
/** The number of contexts, and the first models of lengths (0), of the bits of short numbers and of long numbers. */
const CONTEXTS = 16 * KINDS_BEFORE;
const SHORT = 65 * CONTEXTS;
const LONG = SHORT + (MODELLED_BITS + 1) * 64 * CONTEXTS;
const MODELS = LONG + 65 * 8;

/** Decodes binary decisions. */
class Decoder {
    constructor(bytes) {
        this.bytes = bytes;
        this.next = 0;
        this.range = 0xffffffff;
        this.code = 0;
        for (let i = 0; i < 5; i++) this.shift();
        /** For each model, two estimates of the probability of 0, times 2^16. */
        this.models = new Uint16Array(2 * MODELS);
        this.counts = new Uint8Array(MODELS);
    }

    shift() {
        this.code = ((this.code << 8) | this.bytes[this.next++]) >>> 0;
    }

    /** Decodes a decision, 0 or 1, with a model. */
    decide(model) {
        const { models, counts } = this;
        const at = 2 * model;
        const count = counts[model];
        const early = 31 - Math.clz32(count + 4);
        if (count < MAX_COUNT) counts[model] = count + 1;
        const fastRate = early < FAST ? early : FAST;
        const slowRate = early < SLOW ? early : SLOW;
        const fast = models[at];
        const slow = models[at + 1];
        const bound = (this.range >>> PROBABILITY_BITS) * ((fast + slow) >>> 2);
        const decision = this.code >= bound ? 1 : 0;
        if (decision) {
            this.code -= bound;
            this.range -= bound;
            models[at] = fast - (fast >>> fastRate);
            models[at + 1] = slow - (slow >>> slowRate);
        } else {
            this.range = bound;
            models[at] = fast + ((65536 - fast) >>> fastRate);
            models[at + 1] = slow + ((65536 - slow) >>> slowRate);
        }
        while (this.range < MIN_RANGE) {
            this.range *= 256;
            this.shift();
        }
        return decision;
    }

    /** Decodes n bits of equal probability. */
    bits(n) {
        let value = 0;
        for (let i = 0; i < n; i++) {
            this.range >>>= 1;
            const bit = this.code >= this.range ? 1 : 0;
            if (bit) this.code -= this.range;
            value = 2 * value + bit;
            while (this.range < MIN_RANGE) {
                this.range *= 256;
                this.shift();
            }
        }
        return value;
    }

    /** Fills an array with the next numbers. */
    row(numbers) {
        this.models.fill(32768);
        this.counts.fill(0);
        let [last, before] = [0, 0];
        for (let i = 0; i < numbers.length; i++) {
            const context = last * KINDS_BEFORE + Math.min(before, KINDS_BEFORE - 1);
            let n = 0;
            while (n < 64 && this.decide(65 * context + n)) n++;
            const value = n < 2 ? n : this.number(context, n);
            numbers[i] = value;
            before = last;
            last = value < 8 ? value : 8 + Math.min(n - 4, 7);
        }
        return numbers;
    }

    /** Decodes a number of n bits, of which the first is 1. */
    number(context, n) {
        const isLong = n > MODELLED_BITS;
        const first = isLong ? LONG + 8 * n : SHORT + 64 * ((MODELLED_BITS + 1) * context + n);
        const nModelled = isLong ? MODELLED_BITS_OF_LONG : n - 1;
        let value = 1;
        for (let i = 0; i < nModelled; i++) value = 2 * value + this.decide(first + value);
        const nLeft = n - 1 - nModelled;
        return nLeft > 0 ? value * 2 ** nLeft + this.bits(nLeft) : value;
    }
}

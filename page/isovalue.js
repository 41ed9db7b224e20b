// Isovalues as people write them; the twin of src/volume/isovalue.rs.

/**
 * The isovalue a text means in a range: `37.2`, `50%` of the way from one end to the other, and, where the samples are
 * known, `p99`, which 99 % of them do not exceed, `top:1%`, the same, and `2.5sigma` above their mean.
 */
function isovalueOfText(text, low, high, samples) {
    const match = /^\s*(p|top:)?\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?)\s*(%|sigma|σ)?\s*$/i.exec(text);
    const [prefix, suffix] = [match?.[1] ?? "", match?.[3] ?? ""].map((part) => part.toLowerCase());
    if (!match || !["", "%", "sigma", "σ", "p", "top:%"].includes(prefix + suffix)) {
        return { problem: "expected a number, 50% of the range, p99 of the samples, 2.5sigma or top:1%" };
    }
    const number = Number(match[2]);
    let isovalue = suffix === "%" ? low * (1 - number / 100) + high * (number / 100) : number;
    if (prefix || suffix.startsWith("s") || suffix === "σ") {
        if (!samples) return { problem: "the page does not know the samples" };
        if (prefix && !(number >= 0 && number <= 100)) {
            return { problem: prefix === "p" ? "expected p0 to p100" : "expected top:0% to top:100%" };
        }
        isovalue = prefix ? percentileOf(samples.percentiles, prefix === "p" ? number : 100 - number)
            : samples.mean + number * samples.deviation;
    }
    if (!(low <= isovalue && isovalue <= high)) {
        const [least, most] = [low, high].map((c) => Number(c.toPrecision(7)));
        return { problem: `outside the range ${least} to ${most}` };
    }
    return { isovalue };
}

/** A percentile, straight between known ones. */
function percentileOf(percentiles, percent) {
    const next = Math.max(percentiles.findIndex(([p]) => p >= percent), 0);
    const [[p, before], [q, after]] = [percentiles[Math.max(next - 1, 0)], percentiles[next]];
    const t = q > p ? (percent - p) / (q - p) : 1;
    return before * (1 - t) + after * t;
}

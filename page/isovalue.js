// Parses isovalues; the twin of src/volume/isovalue.rs.

/**
 * Parses an isovalue in a range: `37.2`, `50%` of the range and, if statistics of the samples are known, the percentile `p99`,
 * `top:1%` (the same) and `2.5sigma` above the mean. Returns `isovalue` or a `problem`.
 */
function parseIsovalue(text, low, high, samples) {
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
        const [from, to] = [low, high].map((c) => Number(c.toPrecision(7)));
        return { problem: `outside the range ${from} to ${to}` };
    }
    return { isovalue };
}

/** A percentile, interpolated between tabulated ones. */
function percentileOf(percentiles, percent) {
    const next = Math.max(percentiles.findIndex(([p]) => p >= percent), 0);
    const [[p, before], [q, after]] = [percentiles[Math.max(next - 1, 0)], percentiles[next]];
    const t = q > p ? (percent - p) / (q - p) : 1;
    return before * (1 - t) + after * t;
}

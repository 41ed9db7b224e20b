// Colours of the surface: quantities, scales, maps and the legend; the twin of src/color/*.rs.

/** Palettes of the shaders: one colour, a colour map, a colour per component. */
const [PLAIN, MAP, COMPONENTS] = [0, 1, 2];
/** The number of colours of a map. */
const N_STOPS = 33;
/** The quantities that colours can show, and their names. */
const COLORS = {
    none: "plain", component: "component", field: "", quality: "radius ratio",
    lifetime: "lifetime, share of the range", curvature: "mean curvature, 1/voxel",
};
/** The share of curvatures that the default scale covers. */
const CURVATURE_SHARE = 0.95;

/** Linear red, green and blue, 0 to 1, of six hexadecimal digits in sRGB. */
function linearOf(code) {
    return [0, 2, 4].map((at) => {
        const s = parseInt(code.slice(at, at + 2), 16) / 255;
        return s <= 0.04045 ? s / 12.92 : ((s + 0.055) / 1.055) ** 2.4;
    });
}

/** The linear colours of a map, four numbers each. */
function stopsOf(map) {
    return Float32Array.from(map.flatMap((code) => [...linearOf(code), 1]));
}

/** A quantity on a surface: its name, a value per triangle or (perVertex) per vertex, and the default ends of its scale. */
function quantityOf(color, surface, { field }, [low, high]) {
    const { nTriangles, nVertices, spectrum } = surface;
    const values = new Float32Array(color === "field" ? nVertices : nTriangles);
    if (color === "field") {
        const length = field.high - field.low;
        for (let i = 0; i < nVertices; i++) {
            const [a, b, t] = surface.knotsAround(i);
            // 0 is the code of no value.
            const [p, q] = [spectrum.values[a], spectrum.values[b]];
            values[i] = p && q ? field.low + ((1 - t) * (p - 1) + t * (q - 1)) * (length / 254) : NaN;
        }
        return { name: field.name, perVertex: true, values, low: field.low, high: field.high };
    }
    if (color === "lifetime") {
        const { births, deaths, isovalues } = spectrum;
        const at = (rank) => clamped(isovalues[rank], [low, high]);
        for (let i = 0; i < nTriangles; i++) {
            const t = surface.triangles[i];
            const share = (at(deaths[t]) - at(births[t])) / (high - low);
            values[i] = Number.isFinite(share) ? share : 1;
        }
    } else {
        const of = color === "quality" ? radiusRatio : meanCurvature;
        for (let i = 0; i < nTriangles; i++) values[i] = of(surface, i);
    }
    if (color !== "curvature") return { name: COLORS[color], values, low: 0, high: 1 };
    const inner = values.filter((_, i) => !spectrum.caps[surface.triangles[i]]).map(Math.abs).sort();
    const most = inner[Math.round(CURVATURE_SHARE * (inner.length - 1))] || 1;
    return { name: COLORS.curvature, values, low: -most, high: most };
}

/** The offsets of the corners of a triangle, and the vectors from the first corner to the others. */
function cornersOf({ corners, positions: p }, t) {
    const [a, b, c] = [3 * corners[3 * t], 3 * corners[3 * t + 1], 3 * corners[3 * t + 2]];
    const from = (at) => [p[at] - p[a], p[at + 1] - p[a + 1], p[at + 2] - p[a + 2]];
    return [a, b, c, from(b), from(c)];
}

/** Twice the inradius over the circumradius. */
function radiusRatio(surface, t) {
    const [, , , u, v] = cornersOf(surface, t);
    const [x, y, z] = [Math.hypot(...u), Math.hypot(...v), Math.hypot(u[0] - v[0], u[1] - v[1], u[2] - v[2])];
    const product = x * y * z;
    return product > 0 ? Math.max((y + z - x) * (z + x - y) * (x + y - z), 0) / product : 0;
}

/** The mean curvature of a triangle, 1/voxel: half the divergence of its normals. */
function meanCurvature(surface, t) {
    const [a, b, c, u, v] = cornersOf(surface, t);
    const across = cross(u, v);
    const squared = dot(across, across);
    if (!(squared > 0)) return 0;
    const opposite = [[v[0] - u[0], v[1] - u[1], v[2] - u[2]], v.map((x) => -x), u];
    return [a, b, c].reduce((sum, at, i) => {
        const n = surface.directions.subarray(at, at + 3);
        return sum + (0.5 * dot(cross(across, opposite[i]), n)) / (Math.hypot(n[0], n[1], n[2]) * squared);
    }, 0);
}

/**
 * Parses the ends of a scale: `0:5`, `p5:p95` (percentiles), or an omitted end, which is null and follows from the values;
 * undefined if the text is not valid.
 */
function parseEnds(text) {
    const parts = text.trim() === "" ? ["", ""] : text.split(/\s*(?:to|:)\s*/);
    const [low, high] = parts.map((end) => (end.trim() === "" ? null
        : /^\s*p\d/.test(end) && end.trim().slice(1) <= 100 ? end.trim() : Number(end)));
    const isEnd = (end) => typeof end !== "number" || Number.isFinite(end);
    const isUpsideDown = typeof low === "number" && typeof high === "number" && low >= high;
    return parts.length === 2 && isEnd(low) && isEnd(high) && !isUpsideDown ? { low, high } : undefined;
}

/** The text of the ends of a scale; null if both follow from the values. */
function textOfEnds(low, high) {
    return (low ?? high ?? null) === null ? null : `${low ?? ""}:${high ?? ""}`;
}

/** The ends of the scale of a quantity, from its values and from the ends that the reader has set. */
function scaleOf({ low, high, values, perVertex }, chosen, { triangles, spectrum }) {
    const at = (end, usual) => {
        if (typeof end !== "string") return end ?? usual;
        const inner = values.filter((x, i) => x === x && (perVertex || !spectrum.caps[triangles[i]])).sort();
        return inner[Math.round(((inner.length - 1) * end.slice(1)) / 100)] ?? usual;
    };
    let ends = [at(chosen.low, low), at(chosen.high, high)];
    const center = chosen.center ?? null;
    if (center !== null) {
        const halfRange = Math.max(...ends.map((end) => Math.abs(end - center)));
        ends = [center - halfRange, center + halfRange];
    }
    return ends[0] < ends[1] ? ends : [low, high];
}

/** The values as the shaders read them: for each triangle, ten bits per corner, 1 to 1023 along the scale and 0 for no value. */
function colorCodesOf({ perVertex, values }, [low, high], { nTriangles, corners }) {
    const codes = new Uint32Array(nTriangles);
    const code = (x) => (x === x ? 1 + Math.round(1022 * clamped((x - low) / (high - low), [0, 1])) : 0);
    for (let t = 0; t < nTriangles; t++) {
        if (perVertex) {
            for (let k = 0; k < 3; k++) codes[t] |= code(values[corners[3 * t + k]]) << (10 * k);
        } else codes[t] = code(values[t]) * 0x100401;
    }
    return codes;
}

/** The numbers at the first, the middle and the last colour of a scale. */
function scaleTexts([low, high]) {
    return [low, (low + high) / 2, high].map((x) => String(Number(x.toPrecision(3))));
}

/** The colours of a map in CSS; undefined without a map. */
function cssColorsOf(map) {
    return map?.map((code) => `#${code}`);
}

/** The legend over the picture. */
class Legend {
    constructor(element) {
        this.element = element;
        [this.name, this.bar, ...this.ends] = element.querySelectorAll("[data-part]");
    }

    /** Shows a scale with a map, or the colours of the first components. */
    show(content, isDark) {
        this.element.hidden = !content;
        this.element.className = isDark ? "on-dark" : "on-light";
        if (!content) return;
        setText(this.name, content.name);
        const { ends, map } = content;
        const texts = ends ? scaleTexts(ends) : ["1", "", "8"];
        this.ends.forEach((end, i) => setText(end, texts[i]));
        const colors = cssColorsOf(map) ?? COMPONENT_COLORS.flatMap((color, i) =>
            [0, 1].map((end) => `${color} ${(100 * (i + end)) / COMPONENT_COLORS.length}%`));
        const background = `linear-gradient(90deg, ${colors.join(", ")})`;
        if (this.background !== background) this.bar.style.background = background;
        this.background = background;
    }
}

/** The colours of the first components; those of component_color in shaders/surface.wgsl. */
const COMPONENT_COLORS = [
    [0.58, 245], [0.74, 60], [0.66, 165], [0.64, 350], [0.87, 95], [0.8, 220], [0.58, 35], [0.48, 310],
].map(([lightness, hue]) => `oklch(${lightness} 0.125 ${hue})`);

/** Draws the legend on a saved picture, at the place where the page has it. */
function drawLegend(context, { name, ends, map }, isDark) {
    const { height, width } = context.canvas;
    const letters = Math.max(0.026 * height, 12);
    const [x, y, length, thick] = [letters, 2.2 * letters, 0.32 * width, 0.6 * letters];
    const colors = cssColorsOf(map) ?? COMPONENT_COLORS;
    const gradient = context.createLinearGradient(x, 0, x + length, 0);
    colors.forEach((color, i) => {
        if (map) gradient.addColorStop(i / (colors.length - 1), color);
        else for (const end of [0, 1]) gradient.addColorStop((i + end) / colors.length, color);
    });
    context.fillStyle = gradient;
    context.fillRect(x, y, length, thick);
    context.fillStyle = isDark ? "#e6e8ec" : "#181c22";
    Object.assign(context, { font: `${letters}px system-ui, sans-serif`, textAlign: "left" });
    context.fillText(name, x, y - 0.4 * letters);
    const texts = ends ? scaleTexts(ends) : ["1", "", "8"];
    texts.forEach((text, i) => {
        context.textAlign = ["left", "center", "right"][i];
        context.fillText(text, x + (i * length) / 2, y + thick + letters);
    });
}

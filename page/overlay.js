// The overlay of the picture: the box of the volume, the outline of the slice, the directions of the world's axes, a scale bar, and the line of a measured
// distance. It is SVG, drawn with the matrices of the picture.

/** The length of the axes, CSS pixels. */
const AXIS_LENGTH = 32;
/** The greatest length of the scale bar, CSS pixels. */
const MAX_BAR_LENGTH = 140;
/** The distance of the axes' origin from the left and the lower border, CSS pixels. */
const AXES_MARGIN = 52;

class Overlay {
    constructor(svg) {
        this.svg = svg;
    }

    /** Draws over a picture of a size in CSS pixels; hidden if there is nothing to draw. */
    draw(viewer, projection, size = [viewer.canvas.clientWidth, viewer.canvas.clientHeight]) {
        const { look, measuredPoints, spectrum } = viewer;
        const events = viewer.events();
        const slice = viewer.panel?.slice.isShown && viewer.slice;
        const isEmpty = !look.axes && measuredPoints.length === 0 && events.length === 0 && !slice;
        this.svg.toggleAttribute("hidden", isEmpty);
        if (isEmpty) {
            this.svg.replaceChildren();
            return;
        }
        this.svg.setAttribute("viewBox", `0 0 ${size.join(" ")}`);
        const toScreen = (p) => placeOnScreen(projection.clipFromVoxel, p, size);
        const { volume } = spectrum.info;
        const parts = look.axes ? [
            ...boxLines(volume, toScreen), ...axisLines(projection.axes, size), ...scaleBar(volume, projection, size),
        ] : [];
        if (slice) {
            const corners = viewer.panel.slice.corners().map(toScreen);
            if (corners.every(({ depth }) => depth >= 0)) parts.push(svgElement("path", { class: "slice", d: `M${corners.map(({ x, y }) => `${x},${y}`).join("L")}Z` }));
        }
        if (measuredPoints.length > 0) {
            const [a, b = a] = measuredPoints.map(toScreen);
            parts.push(svgElement("path", { class: "measured", d: `M${a.x},${a.y}L${b.x},${b.y}` }));
            for (const { x, y } of [a, b]) parts.push(svgElement("circle", { class: "measured", cx: x, cy: y, r: 3 }));
            if (a !== b) parts.push(textAt(distanceText(viewer.distance(), volume), (a.x + b.x) / 2, (a.y + b.y) / 2 - 12, "measured"));
        }
        for (const { kind, place } of events) {
            const { x, y } = toScreen(place);
            parts.push(svgElement("circle", { class: "event", cx: x, cy: y, r: 9 }), svgElement("circle", { class: "measured", cx: x, cy: y, r: 1.5 }));
            if (events.length === 1) parts.push(textAt(viewer.words[kind], x, y - 18, "measured"));
        }
        this.svg.replaceChildren(...parts);
    }
}

/** A text with its middle at a point. */
function textAt(text, x, y, name) {
    const label = svgElement("text", { class: name, x: x.toFixed(1), y: y.toFixed(1) });
    label.textContent = text;
    return label;
}

/** The place of a point of the voxel frame on the screen, CSS pixels, and its depth, negative behind the eye. */
function placeOnScreen(m, [px, py, pz], [width, height]) {
    const at = (row) => m[row] * px + m[4 + row] * py + m[8 + row] * pz + m[12 + row];
    return {
        x: Number((width * (0.5 + (0.5 * at(0)) / at(3))).toFixed(1)),
        y: Number((height * (0.5 - (0.5 * at(1)) / at(3))).toFixed(1)),
        depth: at(2),
    };
}

/** The edges of the volume's box without those at its nearest corner, which would hide the surface. */
function boxLines({ dims, placement }, toScreen) {
    const cellSize = cellSizeOf(placement);
    const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((i) => toScreen([0, 1, 2].map((axis) =>
        ((i >> axis) & 1) * (dims[axis] - 1) * cellSize[axis])));
    if (corners.some(({ depth }) => depth < 0)) return [];
    const nearest = corners.reduce((best, corner, i) => (corner.depth < corners[best].depth ? i : best), 0);
    const edges = [];
    for (let i = 0; i < 8; i++) {
        for (const axis of [1, 2, 4]) {
            if (!(i & axis) && i !== nearest && (i | axis) !== nearest) edges.push([corners[i], corners[i | axis]]);
        }
    }
    return [svgElement("path", { class: "box", d: edges.map(([a, b]) => `M${a.x},${a.y}L${b.x},${b.y}`).join("") })];
}

/** The axes of the world, the farthest first. */
function axisLines([right, up, back], [, height]) {
    const middle = [AXES_MARGIN, height - AXES_MARGIN];
    return [0, 1, 2].sort((i, j) => back[i] - back[j]).flatMap((i) => {
        const at = (length) => [middle[0] + length * right[i], middle[1] - length * up[i]];
        const label = textAt("xyz"[i], ...at(AXIS_LENGTH + 10), `axis-${"xyz"[i]}`);
        return [svgElement("path", { class: `axis-${"xyz"[i]}`, d: `M${middle.join(",")}L${at(AXIS_LENGTH).map((x) => x.toFixed(1)).join(",")}` }), label];
    });
}

/** A bar of a round length at the distance of the target, in the unit of the spacing. */
function scaleBar(volume, { distance }, [width, height]) {
    const { spacing } = volume.placement;
    const unitsPerPixel = (2 * Math.tan(0.5 * FIELD_OF_VIEW) * distance * Math.min(...spacing)) / height;
    const longest = MAX_BAR_LENGTH * unitsPerPixel;
    const decade = 10 ** Math.floor(Math.log10(longest));
    const length = [5, 2, 1].map((n) => n * decade).find((n) => n <= longest) ?? decade;
    const [end, y] = [width - 20, height - 22];
    const start = (end - length / unitsPerPixel).toFixed(1);
    const label = textAt(`${Number(length.toPrecision(1))}${unitOf(volume)}`, (Number(start) + end) / 2, y - 7, "scale");
    return [svgElement("path", { class: "scale", d: `M${start},${y - 4}v8M${start},${y}H${end}M${end},${y - 4}v8` }), label];
}

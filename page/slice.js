// A slice of the volume beside the surface: grey levels of the samples, and the isosurfaces that are shown as lines.

/** The greatest height of a slice, CSS pixels. */
const SLICE_HEIGHT = 250;
/** The colour of the line of the slider's isosurface; it is seen on black and on white. */
const LINE_COLOR = "d9660a";
/** Grey levels reach from one to the other of these percentiles of the samples. */
const GREYS = [0.1, 99.9];

/** Unpacks samples: differences of codes, x fastest. */
async function sliceSamplesOf(packed) {
    const codes = await inflated(bytesOfBase64(packed));
    for (let i = 1; i < codes.length; i++) codes[i] += codes[i - 1];
    return codes;
}

/**
 * Calls `line` with the ends of each piece of the curve at which rows of n codes have a value, in steps between codes. Where a cell has
 * four ends, they are joined as the bilinear interpolation of its corners joins them.
 */
function contour(codes, n, value, line) {
    const share = (a, b) => (value - a) / (b - a);
    for (let at = 0; at + n + 1 < codes.length; at++) {
        const [x, y] = [at % n, Math.floor(at / n)];
        if (x === n - 1) continue;
        const [a, b, c, d] = [codes[at], codes[at + 1], codes[at + n], codes[at + n + 1]];
        const [p, q, r, s] = [a > value, b > value, c > value, d > value];
        if (p === q && q === r && r === s) continue;
        const ends = [];
        if (p !== q) ends.push([x + share(a, b), y]);
        if (q !== s) ends.push([x + 1, y + share(b, d)]);
        if (r !== s) ends.push([x + share(c, d), y + 1]);
        if (p !== r) ends.push([x, y + share(a, c)]);
        if (ends.length === 2) line(...ends);
        else {
            // The first end is between a and b, the next between b and d.
            const isJoined = ((a * d - b * c) / (a + d - b - c) > value) === p;
            line(ends[0], ends[isJoined ? 1 : 3]);
            line(ends[2], ends[isJoined ? 3 : 1]);
        }
    }
}

/** The controls under "Slice". */
class Slice {
    constructor(viewer) {
        this.viewer = viewer;
        const { slice } = viewer.about;
        this.group = byId("slice");
        this.group.hidden = !slice;
        if (!slice) return;
        this.canvas = byId("slice-image");
        this.place = byId("slice-place");
        const { dims, placement } = viewer.spectrum.info.volume;
        Object.assign(this, { dims, spacing: placement.spacing, cell: cellSizeOf(placement), first: { axis: 2, index: Math.round((dims[2] - 1) / 2) } });
        // The address has a slice.
        if (viewer.slice) this.group.open = true;
        on(this.group, "toggle", () => viewer.request());
        on("slice-axis", "change", () => this.move(Number(byId("slice-axis").value), null));
        on(this.place, "input", () => this.move(viewer.slice.axis, Number(this.place.value)));
        on("slice-cuts", "change", () => (byId("slice-cuts").checked ? this.cut() : viewer.setLook({ clip: null })));
        on(this.canvas, "wheel", (event) => {
            event.preventDefault();
            this.move(viewer.slice.axis, viewer.slice.index - Math.sign(notchesOf(event)));
        }, { passive: false });
        on(this.canvas, "pointermove", (event) => viewer.panel.showText(this.textAt(event)));
        on(this.canvas, "pointerleave", () => viewer.panel.showText(null));
        on(this.canvas, "click", (event) => viewer.setIsovalue(this.sampleAt(event).value));
    }

    get isShown() {
        return !this.group.hidden && this.group.open;
    }

    /** Moves to a sample along an axis; to the middle if it is null. */
    move(axis, index) {
        const last = this.dims[axis] - 1;
        this.viewer.slice = { axis, index: clamped(Math.round(index ?? last / 2), [0, last]) };
        if (byId("slice-cuts").checked) this.cut();
        this.viewer.request();
    }

    /** Moves to a point of the surface, voxel frame, if the slice follows the pointer. */
    follow(point) {
        const { axis } = this.viewer.slice ?? {};
        if (this.isShown && byId("slice-follows").checked) this.move(axis, point[axis] / this.cell[axis]);
    }

    /** Cuts the surface off in front of the slice. */
    cut() {
        const { axis, index } = this.viewer.slice;
        this.viewer.setLook({ clip: { turned: false, ...this.viewer.look.clip, axis, share: index / (this.dims[axis] - 1) } });
    }

    /** The axes of the picture, to the right and up. */
    axes() {
        return [0, 1, 2].filter((axis) => axis !== this.viewer.slice.axis);
    }

    /** The corners of the slice, voxel frame. */
    corners() {
        const { axis, index } = this.viewer.slice;
        const [u, v] = this.axes();
        return [[0, 0], [1, 0], [1, 1], [0, 1]].map(([s, t]) => {
            const point = [0, 0, 0];
            [point[axis], point[u], point[v]] = [index, s * (this.dims[u] - 1), t * (this.dims[v] - 1)];
            return point.map((x, i) => x * this.cell[i]);
        });
    }

    /** The sample at a pointer and its value. */
    sampleAt({ clientX, clientY }) {
        const { left, top, width, height } = this.canvas.getBoundingClientRect();
        const sample = [0, 0, 0];
        const [u, v] = this.axes();
        sample[this.viewer.slice.axis] = this.viewer.slice.index;
        sample[u] = clamped(Math.round(((clientX - left) / width) * (this.dims[u] - 1)), [0, this.dims[u] - 1]);
        sample[v] = clamped(Math.round((1 - (clientY - top) / height) * (this.dims[v] - 1)), [0, this.dims[v] - 1]);
        const { low, unit } = this.viewer.about.slice;
        return { sample, value: low + unit * (this.samples?.[this.offset(sample)] ?? 0) };
    }

    offset([x, y, z]) {
        return x + this.dims[0] * (y + this.dims[1] * z);
    }

    textAt(event) {
        const { sample, value } = this.sampleAt(event);
        return `x, y, z: ${this.viewer.placeText(sample.map((x, i) => x * this.cell[i]))}; sample ${shownNumber(value)}`;
    }

    /** Shows the state of the viewer. */
    show() {
        if (!this.isShown) return;
        const { viewer } = this;
        viewer.slice ??= this.first;
        if (!this.samples) {
            this.load();
            return;
        }
        const { axis, index } = viewer.slice;
        const lines = [[viewer.isovalue, LINE_COLOR], ...viewer.shownExtras().map(({ isovalue, front }) => [isovalue, front])];
        const key = JSON.stringify([axis, index, lines, viewer.pixelRatio]);
        if (key === this.key) return;
        this.key = key;
        byId("slice-axis").value = axis;
        const last = this.dims[axis] - 1;
        this.place.max = last;
        this.place.value = index;
        const text = `${"xyz"[axis]} at sample ${index} of 0 to ${last}`;
        this.place.ariaValueText = text;
        setText(byId("slice-text"), String(index));
        this.canvas.ariaLabel = `Slice across ${text}; the line is the isosurface of ${viewer.shownIsovalue()}`;
        this.draw(lines);
    }

    async load() {
        this.loading ??= sliceSamplesOf(byId("slice-samples").textContent);
        this.samples = await this.loading;
        this.viewer.request();
    }

    /** The codes of the slice, in rows from below, and its size in the world. */
    codes() {
        const [u, v] = this.axes();
        const [n, m] = [this.dims[u], this.dims[v]];
        const steps = [1, this.dims[0], this.dims[0] * this.dims[1]];
        const start = steps[this.viewer.slice.axis] * this.viewer.slice.index;
        const codes = new Uint8Array(n * m);
        for (let i = 0; i < codes.length; i++) codes[i] = this.samples[start + steps[u] * (i % n) + steps[v] * Math.floor(i / n)];
        return { codes, n, m, size: [(n - 1) * this.spacing[u], (m - 1) * this.spacing[v]] };
    }

    draw(lines) {
        const { canvas, viewer } = this;
        const { codes, n, m, size } = this.codes();
        const { low, unit } = viewer.about.slice;
        const scale = Math.min(canvas.parentElement.clientWidth / size[0], SLICE_HEIGHT / size[1]);
        const [width, height] = size.map((x) => x * scale);
        canvas.style.width = `${width}px`;
        [canvas.width, canvas.height] = [width, height].map((x) => Math.max(Math.round(x * viewer.pixelRatio), 1));
        const context = canvas.getContext("2d");
        const [stepX, stepY] = [canvas.width / (n - 1), canvas.height / (m - 1)];
        context.imageSmoothingQuality = "high";
        // The middle of a pixel of the image is a sample; half a pixel is outside.
        context.drawImage(this.image(codes, n, m), -0.5 * stepX, -0.5 * stepY, n * stepX, m * stepY);
        context.lineWidth = 1.5 * viewer.pixelRatio;
        for (const [isovalue, color] of lines) {
            context.beginPath();
            contour(codes, n, (isovalue - low) / unit, (...ends) => ends.forEach(([x, y], i) =>
                context[i ? "lineTo" : "moveTo"](x * stepX, canvas.height - y * stepY)));
            context.strokeStyle = `#${color}`;
            context.stroke();
        }
    }

    /** The grey levels of codes, one pixel per sample. */
    image(codes, n, m) {
        const image = element("canvas", { width: n, height: m });
        const context = image.getContext("2d");
        const pixels = context.createImageData(n, m);
        const { slice: { low, unit }, samples: statistics } = this.viewer.about;
        let [from, to] = GREYS.map((percent) => (statistics ? (percentileOf(statistics.percentiles, percent) - low) / unit : 255 * (percent > 50)));
        if (from === to) [from, to] = [0, 255];
        codes.forEach((code, i) => {
            const at = 4 * ((m - 1 - Math.floor(i / n)) * n + (i % n));
            pixels.data.fill(clamped((255 * (code - from)) / (to - from), [0, 255]), at, at + 3);
            pixels.data[at + 3] = 255;
        });
        context.putImageData(pixels, 0, 0);
        return image;
    }
}

// The curves above the slider: area, enclosed volume, components and Euler characteristic over the isovalue, behind
// them the histogram of the volume, events as marks, and the present isovalue as a line.

const SVG = "http://www.w3.org/2000/svg";
const WIDTH = 1000;
const HEIGHT = 100;
/** Below the curves, for the events. */
const MARKS = 14;
const KINDS = ["emerge", "merge", "handle opens", "split", "handle closes", "vanish"];
/** How near to an event, CSS pixels, a click means it. */
const NEAR = 5;

function svgElement(name, attributes) {
    const element = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    return element;
}

class Plot {
    /** Draws the curves into an svg element; `choose` is called with isovalues that are pointed at. */
    constructor(svg, { curves, samples }, [low, high], choose) {
        Object.assign(this, { svg, curves, low, high });
        svg.setAttribute("viewBox", `0 0 ${WIDTH} ${HEIGHT + MARKS}`);
        svg.setAttribute("preserveAspectRatio", "none");
        if (samples) this.bars(samples.histogram);
        this.curve("area", curves.area, false);
        this.curve("volume", curves.volume, false);
        this.curve("euler", curves.euler, true);
        this.curve("components", curves.components, true);
        for (const [isovalue, kind] of curves.events) {
            const x = this.x(isovalue);
            const mark = svgElement("line", {
                class: `event kind${kind}`, x1: x, x2: x, y1: HEIGHT + 4, y2: HEIGHT + MARKS,
            });
            const title = svgElement("title", {});
            title.textContent = `${KINDS[kind]} at ${shownIsovalue(isovalue, high - low)}`;
            mark.append(title);
            svg.append(mark);
        }
        this.cursor = svgElement("line", { class: "cursor", y1: 0, y2: HEIGHT + MARKS });
        svg.append(this.cursor);
        const point = (event) => choose(this.isovalueAt(event));
        svg.addEventListener("pointerdown", (event) => {
            if (event.button !== 0) return;
            svg.setPointerCapture(event.pointerId);
            point(event);
        });
        svg.addEventListener("pointermove", (event) => {
            if (svg.hasPointerCapture(event.pointerId)) point(event);
        });
    }

    x(isovalue) {
        const t = (isovalue - this.low) / (this.high - this.low);
        return WIDTH * (Number.isFinite(t) ? t : 0.5);
    }

    /** The histogram; by logarithms, as most samples are often of one value. */
    bars(counts) {
        const most = Math.log1p(Math.max(...counts, 1));
        const y = (count) => (HEIGHT * (1 - Math.log1p(count) / most)).toFixed(1);
        const x = (i) => ((WIDTH * i) / counts.length).toFixed(1);
        const steps = counts.map((count, i) => `V${y(count)}H${x(i + 1)}`);
        this.svg.append(svgElement("path", {
            class: "histogram", d: `M0,${HEIGHT}${steps.join("")}V${HEIGHT}Z`,
        }));
        document.getElementById("histogram-name").hidden = false;
    }

    curve(name, exact, isStepped) {
        // Counts that go into the thousands beside ones and twos: their logarithms.
        const values = exact.map((x) => (isStepped ? Math.sign(x) * Math.log1p(Math.abs(x)) : x));
        const least = Math.min(0, ...values);
        const most = Math.max(...values, least + 1e-30);
        const y = (value) => 2 + (HEIGHT - 4) * (1 - (value - least) / (most - least));
        const x = (i) => (WIDTH * i) / (values.length - 1);
        let path = `M0,${y(values[0]).toFixed(1)}`;
        for (let i = 1; i < values.length; i++) {
            // A count changes somewhere between two isovalues; the step is drawn in the middle.
            if (isStepped) path += `H${((x(i - 1) + x(i)) / 2).toFixed(1)}V${y(values[i]).toFixed(1)}`;
            else path += `L${x(i).toFixed(1)},${y(values[i]).toFixed(1)}`;
        }
        if (isStepped) path += `H${WIDTH}`;
        if (name === "area") {
            this.svg.append(svgElement("path", {
                class: "area filled", d: `${path}V${HEIGHT}H0Z`,
            }));
        }
        this.svg.append(svgElement("path", { class: name, d: path }));
    }

    /** The isovalue under the pointer; that of an event if one is near. */
    isovalueAt(event) {
        const { left, width } = this.svg.getBoundingClientRect();
        const at = (pixels) => this.low + ((this.high - this.low) * pixels) / width;
        const isovalue = Math.min(Math.max(at(event.clientX - left), this.low), this.high);
        const reach = at(NEAR) - this.low;
        const distance = ([c]) => Math.abs(c - isovalue);
        const nearest = this.curves.events.reduce(
            (best, e) => (distance(e) < distance(best) ? e : best), [Infinity]);
        return distance(nearest) <= reach ? nearest[0] : isovalue;
    }

    /** Moves the line. */
    show(isovalue) {
        const x = this.x(isovalue);
        this.cursor.setAttribute("x1", x);
        this.cursor.setAttribute("x2", x);
    }
}

/** An isovalue with as many digits as tell ten thousand of them apart in a range. */
function shownIsovalue(isovalue, range) {
    const digits = 4 - Math.floor(Math.log10(range > 0 ? range : 1));
    if (digits > 9 || digits < -3) return String(Number(isovalue.toPrecision(6)));
    return isovalue.toFixed(Math.max(digits, 0));
}

/** A count, or a measure with four digits. */
function shownNumber(x) {
    if (Number.isInteger(x)) return x.toLocaleString("en");
    const rounded = Number(x.toPrecision(4));
    return Math.abs(rounded) < 1e7 ? rounded.toLocaleString("en") : String(rounded);
}

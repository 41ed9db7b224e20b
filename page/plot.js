// The plot above the slider: area, enclosed volume, components and Euler characteristic over the isovalue, the histogram of the
// volume behind them, ticks at events, and a line at the current isovalue.

const SVG = "http://www.w3.org/2000/svg";
const WIDTH = 1000;
const HEIGHT = 100;
/** The height of the ticks below the curves. */
const TICKS_HEIGHT = 14;
/** The kinds of events, in the order of src/page/curves.rs. */
const KINDS = ["emerge", "merge", "handle opens", "split", "handle closes", "vanish"];
/** The changes of the number of components and of the Euler characteristic by kind of event. */
const COMPONENT_CHANGES = [1, -1, 0, 1, 0, -1];
const EULER_CHANGES = [2, -2, -2, 2, 2, -2];
/** A click at most this far from a tick, CSS pixels, goes to its event. */
const SNAP_DISTANCE = 5;

function svgElement(name, attributes) {
    const element = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    return element;
}

class Plot {
    /** Draws the curves into an svg element; `choose` is called with isovalues that are clicked or dragged to. */
    constructor(svg, { curves, histogram }, [low, high], choose) {
        Object.assign(this, { svg, curves, low, high });
        svg.setAttribute("viewBox", `0 0 ${WIDTH} ${HEIGHT + TICKS_HEIGHT}`);
        svg.setAttribute("preserveAspectRatio", "none");
        if (histogram) this.drawHistogram(histogram);
        this.ticks = ticksOf(curves.events);
        this.drawCurve("area", curves.area, null);
        this.drawCurve("volume", curves.volume, null);
        this.drawCurve("euler", curves.euler, EULER_CHANGES);
        this.drawCurve("components", curves.components, COMPONENT_CHANGES);
        this.drawTicks();
        // Outside the svg, so that it moves without drawing the curves again.
        this.cursor = byId("cursor");
        const point = (event) => choose(this.isovalueAt(event));
        svg.addEventListener("pointerdown", (event) => {
            if (event.button !== 0) return;
            svg.setPointerCapture(event.pointerId);
            point(event);
        });
        svg.addEventListener("pointermove", (event) => {
            if (svg.hasPointerCapture(event.pointerId)) point(event);
            this.showEvents(event);
        });
    }

    /** Draws ticks at the isovalues with events, one for all events in a column of the plot. */
    drawTicks() {
        const columns = new Set(this.ticks.map(([isovalue]) => this.x(isovalue).toFixed(1)));
        const d = [...columns].map((x) => `M${x},${HEIGHT + 4}V${HEIGHT + TICKS_HEIGHT}`).join("");
        this.svg.append(svgElement("path", { class: "event", d }));
        this.title = svgElement("title", {});
        this.svg.append(this.title);
    }

    /** Draws lines at isovalues that have a name. */
    drawNamedLines(marks) {
        const d = marks.map(([isovalue]) => `M${this.x(isovalue).toFixed(1)},0V${HEIGHT + TICKS_HEIGHT}`).join("");
        this.svg.append(svgElement("path", { class: "named", d }));
    }

    /** Lists the events under the pointer in the title of the plot. */
    showEvents(event) {
        const { left, width } = this.svg.getBoundingClientRect();
        const column = Math.floor(event.clientX - left);
        const near = this.ticks.filter(([c]) => Math.abs((this.x(c) * width) / WIDTH - 0.5 - column) <= 1);
        if (near.length === 0) {
            this.title.textContent = "";
            return;
        }
        const kinds = near.flatMap(([, k]) => k);
        const names = KINDS.flatMap((name, kind) => {
            const n = kinds.filter((k) => k === kind).length;
            return n === 0 ? [] : [n === 1 ? name : `${name} (${n} times)`];
        });
        const [first, last] = [near[0], near.at(-1)].map(([c]) => shownIsovalue(c, this.high - this.low));
        this.title.textContent = `${names.join(", ")} at ${first === last ? first : `${first} to ${last}`}`;
    }

    /** The values of the curves under the pointer, as text. */
    valuesAt({ clientX }) {
        const { left, width } = this.svg.getBoundingClientRect();
        const t = Math.min(Math.max((clientX - left) / width, 0), 1);
        const { curves } = this;
        const at = Math.round(t * (curves.area.length - 1));
        const isovalue = this.low + (this.high - this.low) * (at / (curves.area.length - 1));
        const values = [
            `area ${shownNumber(curves.area[at])}`, `volume ${shownNumber(curves.volume[at])}`,
            `components ${shownNumber(curves.components[at])}`, `Euler ${shownNumber(curves.euler[at])}`,
        ];
        return `${shownIsovalue(isovalue, this.high - this.low)}: ${values.join(", ")}`;
    }

    /** The next isovalue with events above or below one. */
    nextEvent(isovalue, direction) {
        const isovalues = this.ticks.map(([c]) => c);
        return direction > 0 ? isovalues.find((c) => c > isovalue) : isovalues.findLast((c) => c < isovalue);
    }

    x(isovalue) {
        const t = (isovalue - this.low) / (this.high - this.low);
        return WIDTH * (Number.isFinite(t) ? t : 0.5);
    }

    /** Draws the histogram on a logarithmic scale, because often most samples have one value. */
    drawHistogram(counts) {
        const highest = Math.log1p(Math.max(...counts, 1));
        const y = (count) => (HEIGHT * (1 - Math.log1p(count) / highest)).toFixed(1);
        const x = (i) => ((WIDTH * i) / counts.length).toFixed(1);
        const steps = counts.map((count, i) => `V${y(count)}H${x(i + 1)}`);
        this.svg.append(svgElement("path", {
            class: "histogram", d: `M0,${HEIGHT}${steps.join("")}V${HEIGHT}Z`,
        }));
        byId("histogram-name").hidden = false;
    }

    /** Draws a curve through evenly spaced isovalues; in steps if it is a count, of which `changes` has the change by kind of event. */
    drawCurve(name, sampled, changes) {
        const x = (i) => (WIDTH * i) / (sampled.length - 1);
        const points = [[0, sampled[0]]];
        for (let i = 1; i < sampled.length; i++) {
            if (!changes) points.push([x(i), sampled[i]]);
            else points.push(...this.steps([x(i - 1), x(i)], [sampled[i - 1], sampled[i]], changes));
        }
        // Counts range from one to thousands, so they are drawn on a logarithmic scale.
        const values = points.map(([, v]) => (changes ? Math.sign(v) * Math.log1p(Math.abs(v)) : v));
        const lowest = values.reduce((a, b) => Math.min(a, b), 0);
        const highest = values.reduce((a, b) => Math.max(a, b), lowest + 1e-30);
        const y = (i) => (2 + (HEIGHT - 4) * (1 - (values[i] - lowest) / (highest - lowest))).toFixed(1);
        let path = `M0,${y(0)}`;
        points.forEach(([at], i) => {
            // Of several steps in one column only the last is drawn.
            const isHidden = changes && i + 1 < points.length && points[i + 1][0].toFixed(1) === at.toFixed(1);
            if (i > 0 && !isHidden) path += changes ? `H${at.toFixed(1)}V${y(i)}` : `L${at.toFixed(1)},${y(i)}`;
        });
        if (changes) path += `H${WIDTH}`;
        if (name === "area") {
            this.svg.append(svgElement("path", {
                class: "area filled", d: `${path}V${HEIGHT}H0Z`,
            }));
        }
        this.svg.append(svgElement("path", { class: name, d: path }));
    }

    /**
     * The steps of a count between two columns: x and the value from there on. Counts change at events: at each event if the kinds
     * of the events explain the change, else at the last one.
     */
    steps([left, right], [before, after], changes) {
        const isBefore = (x) => ([c]) => this.x(c) <= x;
        const between = this.ticks.slice(
            countBefore(this.ticks, isBefore(left)), countBefore(this.ticks, isBefore(right)));
        let value = before;
        const steps = between.map(([c, kinds]) => {
            for (const kind of kinds) value += changes[kind];
            return [this.x(c), value];
        });
        if (value === after) return steps;
        if (before === after) return [];
        return [[between.length > 0 ? this.x(between.at(-1)[0]) : (left + right) / 2, after]];
    }

    /** The isovalue under the pointer, or that of the nearest event within SNAP_DISTANCE. */
    isovalueAt(event) {
        const { left, width } = this.svg.getBoundingClientRect();
        const at = (pixels) => this.low + ((this.high - this.low) * pixels) / width;
        const isovalue = Math.min(Math.max(at(event.clientX - left), this.low), this.high);
        const maxDistance = at(SNAP_DISTANCE) - this.low;
        const distance = ([c]) => Math.abs(c - isovalue);
        const nearest = this.ticks.reduce(
            (best, tick) => (distance(tick) < distance(best) ? tick : best), [Infinity]);
        return distance(nearest) <= maxDistance ? nearest[0] : isovalue;
    }

    /** Moves the line of the current isovalue. */
    show(isovalue) {
        this.cursor.style.transform = `translateX(${(100 * this.x(isovalue)) / WIDTH}%)`;
    }
}

/** The number of items at the beginning of a list that have a property; no later item has it. */
function countBefore(list, has) {
    let [low, high] = [0, list.length];
    while (low < high) {
        const middle = (low + high) >>> 1;
        if (has(list[middle])) low = middle + 1;
        else high = middle;
    }
    return low;
}

/** The isovalues with events, ascending, each with the kinds of its events. */
function ticksOf(events) {
    const ticks = [];
    for (const [isovalue, kind] of [...events].sort(([a], [b]) => a - b)) {
        if (ticks.at(-1)?.[0] === isovalue) ticks.at(-1)[1].push(kind);
        else ticks.push([isovalue, [kind]]);
    }
    return ticks;
}

/** The number of events and of their isovalues, as text. */
function shownEvents(nEvents, nIsovalues) {
    const count = (n, word) => `${n.toLocaleString("en")} ${word}${n === 1 ? "" : "s"}`;
    return nEvents === 0 ? "no events" : `${count(nEvents, "event")} at ${count(nIsovalues, "isovalue")}`;
}

/** An isovalue as text, with digits enough for ten thousand different ones in a range. */
function shownIsovalue(isovalue, range) {
    const digits = 4 - Math.floor(Math.log10(range > 0 ? range : 1));
    if (digits > 9 || digits < -3) return String(Number(isovalue.toPrecision(6)));
    return isovalue.toFixed(Math.max(digits, 0));
}

/** A number as text; four digits if it is not an integer. */
function shownNumber(x) {
    if (Number.isInteger(x)) return x.toLocaleString("en");
    const rounded = Number(x.toPrecision(4));
    return Math.abs(rounded) < 1e7 ? rounded.toLocaleString("en") : String(rounded);
}

// The curves above the slider, each in a strip with its own scale, over the isovalue: the histogram of the volume, area, enclosed
// volume, components and Euler characteristic; ticks at events below them, a line at the current isovalue, values at the pointer.

const SVG = "http://www.w3.org/2000/svg";
const WIDTH = 1000;
/** The heights of a strip with the space below it, and of the ticks. */
const STRIP = 40;
const SPACE = 6;
const TICKS_HEIGHT = 20;
/** The changes of the number of components and of the Euler characteristic by kind of event, in the order of src/page/curves.rs. */
const CHANGES = { components: [1, -1, 0, 1, 0, -1], euler: [2, -2, -2, 2, 2, -2] };
/** The curves from top to bottom. */
const CURVES = ["area", "volume", "components", "euler"];
/** A click at most this far from a tick, CSS pixels, goes to its event. */
const SNAP_DISTANCE = 5;
/** If more isovalues have events, those of the largest persistence are marked. */
const MAX_MARKS = 60;
/** A count with a wider range has a logarithmic scale. */
const MAX_LINEAR = 24;
/** The least distance between numbers of the axis, shares of its length. */
const MIN_STEP = 0.12;

function svgElement(name, attributes) {
    const element = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    return element;
}

class Plot {
    /** Draws the curves into an svg element, and sets the isovalue of the viewer to one that is clicked or dragged to. */
    constructor(svg, { curves, histogram }, [low, high], viewer) {
        Object.assign(this, { svg, curves, low, high, viewer });
        const choose = (event) => viewer.setIsovalue(this.isovalueAt(event));
        this.names = histogram ? ["histogram", ...CURVES] : CURVES;
        this.height = this.names.length * STRIP;
        byId("strips").style.setProperty("--n", this.names.length);
        svg.setAttribute("viewBox", `0 0 ${WIDTH} ${this.height + TICKS_HEIGHT}`);
        svg.setAttribute("preserveAspectRatio", "none");
        this.ticks = ticksOf(curves.events);
        this.findMarks();
        this.draw("baseline", this.names.map((_, i) => `M0,${(i + 1) * STRIP - SPACE}H${WIDTH}`).join(""));
        if (histogram) this.drawHistogram(histogram);
        if (curves.area) this.drawCurves();
        this.drawTicks();
        this.showAxis();
        // Outside the svg, so that it moves without drawing the curves again.
        this.cursor = byId("cursor");
        this.guide = byId("guide");
        this.guide.append(...this.names.map(() => element("span")));
        on(svg, "pointerdown", (event) => {
            if (event.button !== 0) return;
            svg.setPointerCapture(event.pointerId);
            choose(event);
        });
        on(svg, "pointermove", (event) => {
            if (svg.hasPointerCapture(event.pointerId)) choose(event);
        });
    }

    /** Draws the curves; those of a file of the reader are known later. */
    drawCurves() {
        const { curves } = this;
        this.scales = CURVES.map((name) => this.drawCurve(name, curves[name], CHANGES[name]));
        this.showScales();
    }

    draw(name, d) {
        this.svg.append(svgElement("path", { class: name, d }));
    }

    /** The isovalues that are marked, and the events of which more than the kind is known. */
    findMarks() {
        const { events, named } = this.curves;
        this.named = named.map(([i, persistence, place]) => ({ isovalue: events[i][0], kind: events[i][1], persistence, place }));
        const isovalues = this.ticks.map(([c]) => c);
        const largest = [...this.named].sort((a, b) => b.persistence - a.persistence).slice(0, MAX_MARKS);
        const marked = new Set(largest.map(({ isovalue }) => isovalue));
        this.marks = isovalues.length > MAX_MARKS ? isovalues.filter((c) => marked.has(c)) : isovalues;
    }

    /** Draws ticks at the isovalues with events, one for all events in a column of the plot; those that are marked are longer. */
    drawTicks() {
        const line = (isovalues, length) => [...new Set(isovalues.map((c) => this.x(c).toFixed(1)))]
            .map((x) => `M${x},${this.height}v${length}`).join("");
        this.draw("event faint", line(this.ticks.map(([c]) => c), TICKS_HEIGHT / 3));
        this.draw("event", line(this.marks, TICKS_HEIGHT));
    }

    /** Draws lines at isovalues that have a name. */
    drawNamedLines(marks) {
        this.draw("named", marks.map(([isovalue]) => `M${this.x(isovalue).toFixed(1)},0V${this.height}`).join(""));
    }

    /** What happens at an isovalue, as text; null without an event. */
    eventText(isovalue) {
        const kinds = this.ticks.find(([c]) => c === isovalue)?.[1];
        if (!kinds) return null;
        const named = this.named.filter((event) => event.isovalue === isovalue).sort((a, b) => b.persistence - a.persistence);
        const place = named[0] ? ` at ${this.viewer.placeText(named[0].place)}` : "";
        const more = kinds.length > 1 ? `; ${shownNumber(kinds.length - 1)} more` : "";
        return `${shortIsovalue(isovalue)}: ${this.viewer.words[named[0]?.kind ?? kinds[0]]}${place}${more}`;
    }

    /** Shows the isovalue and the values of the curves at the pointer; hides them without an event. */
    showGuide(event) {
        this.guide.hidden = !event;
        if (!event) return null;
        const isovalue = this.isovalueAt(event);
        const t = this.x(isovalue) / WIDTH;
        const measures = this.measuresAt(isovalue);
        this.guide.style.left = `${100 * t}%`;
        this.guide.className = t > 0.8 ? "left" : "";
        this.names.forEach((name, i) => {
            setText(this.guide.children[i], name === "histogram" ? this.shown(isovalue) : measures && shownNumber(measures[name]));
        });
        return this.eventText(isovalue) ?? `isovalue ${this.shown(isovalue)}`;
    }

    /** The measures at an isovalue: area and volume between those of the curves, counts by the events; null without curves. */
    measuresAt(isovalue) {
        const { curves } = this;
        if (!curves.area) return null;
        const last = curves.area.length - 1;
        const at = clamped((this.x(isovalue) / WIDTH) * last, [0, last]);
        const [i, j] = [Math.floor(at), Math.ceil(at)];
        const measures = {};
        for (const name of CURVES) {
            const list = curves[name];
            if (!CHANGES[name]) {
                measures[name] = list[i] + (at - i) * (list[j] - list[i]);
                continue;
            }
            const steps = i < j ? this.steps([i, j].map((k) => (WIDTH * k) / last), [list[i], list[j]], CHANGES[name]) : [];
            measures[name] = steps.findLast(([x]) => x <= this.x(isovalue))?.[1] ?? list[i];
        }
        return measures;
    }

    /** The next marked isovalue above or below one. */
    nextEvent(isovalue, direction) {
        return direction > 0 ? this.marks.find((c) => c > isovalue) : this.marks.findLast((c) => c < isovalue);
    }

    shown(isovalue) {
        return shownIsovalue(isovalue, this.high - this.low);
    }

    x(isovalue) {
        const t = (isovalue - this.low) / (this.high - this.low);
        return WIDTH * (Number.isFinite(t) ? t : 0.5);
    }

    /** Draws the histogram on a logarithmic scale, because often most samples have one value. */
    drawHistogram(counts) {
        const highest = Math.log1p(Math.max(...counts, 1));
        const y = (count) => ((STRIP - SPACE) * (1 - Math.log1p(count) / highest)).toFixed(1);
        const x = (i) => ((WIDTH * i) / counts.length).toFixed(1);
        const steps = counts.map((count, i) => `V${y(count)}H${x(i + 1)}`);
        this.draw("histogram", `M0,${STRIP - SPACE}${steps.join("")}V${STRIP - SPACE}Z`);
        byId("histogram-name").hidden = false;
    }

    /**
     * Draws a curve through evenly spaced isovalues; in steps if it is a count, of which `changes` has the change by kind of event.
     * Returns the ends of its scale: those of its values if they differ little, else 0 is one of them.
     */
    drawCurve(name, sampled, changes) {
        const x = (i) => (WIDTH * i) / (sampled.length - 1);
        const points = [[0, sampled[0]]];
        for (let i = 1; i < sampled.length; i++) {
            if (!changes) points.push([x(i), sampled[i]]);
            else points.push(...this.steps([x(i - 1), x(i)], [sampled[i - 1], sampled[i]], changes));
        }
        let [lowest, highest] = points.reduce(([a, b], [, v]) => [Math.min(a, v), Math.max(b, v)], [Infinity, -Infinity]);
        if (lowest > 0 && lowest < 0.5 * highest) lowest = 0;
        if (highest < 0 && highest > 0.5 * lowest) highest = 0;
        // Counts range from one to thousands.
        const isLog = changes && highest - lowest > MAX_LINEAR;
        const scaled = (v) => (isLog ? Math.sign(v) * Math.log1p(Math.abs(v)) : v);
        const length = scaled(highest) - scaled(lowest) || 1;
        const top = this.names.indexOf(name) * STRIP + 2;
        const y = (i) => (top + (STRIP - SPACE - 2) * (1 - (scaled(points[i][1]) - scaled(lowest)) / length)).toFixed(1);
        let path = `M0,${y(0)}`;
        points.forEach(([at], i) => {
            // Of several steps in one column only the last is drawn.
            const isHidden = changes && i + 1 < points.length && points[i + 1][0].toFixed(1) === at.toFixed(1);
            if (i > 0 && !isHidden) path += changes ? `H${at.toFixed(1)}V${y(i)}` : `L${at.toFixed(1)},${y(i)}`;
        });
        if (changes) path += `H${WIDTH}`;
        this.draw(name, path);
        return [highest, lowest];
    }

    /** Shows the ends of the scales next to the strips. */
    showScales() {
        const rows = this.names.length > CURVES.length ? [[], ...this.scales] : this.scales;
        byId("scales").append(...rows.map((ends) => {
            const row = element("div");
            for (const end of new Set(ends)) row.append(element("span", { textContent: shownNumber(Number(end.toPrecision(3))) }));
            return row;
        }));
    }

    /** Shows round isovalues below the slider, and the ends of the range. */
    showAxis() {
        const { low, high } = this;
        const least = MIN_STEP * (high - low);
        const decade = 10 ** Math.floor(Math.log10(least));
        const step = [1, 2, 5, 10].map((n) => n * decade).find((n) => n >= least);
        setText(byId("low"), shortIsovalue(low));
        setText(byId("high"), shortIsovalue(high));
        for (let i = Math.ceil(low / step); step > 0 && i * step <= high; i++) {
            const t = this.x(i * step) / WIDTH;
            if (t < MIN_STEP || t > 1 - MIN_STEP) continue;
            const tick = element("span", { textContent: shortIsovalue(i * step) });
            tick.style.left = `${100 * t}%`;
            byId("axis").append(tick);
        }
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

    /** The isovalue under the pointer, or that of the nearest marked event within SNAP_DISTANCE. */
    isovalueAt(event) {
        const { left, width } = this.svg.getBoundingClientRect();
        const at = (pixels) => this.low + ((this.high - this.low) * pixels) / width;
        const isovalue = clamped(at(event.clientX - left), [this.low, this.high]);
        const maxDistance = at(SNAP_DISTANCE) - this.low;
        const distance = (c) => Math.abs(c - isovalue);
        const nearest = this.marks.reduce((best, c) => (distance(c) < distance(best) ? c : best), Infinity);
        return distance(nearest) <= maxDistance ? nearest : isovalue;
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

/** An isovalue as text without zeros at its end. */
function shortIsovalue(isovalue) {
    return String(Number(isovalue.toPrecision(6)));
}

/** A number as text; four digits if it is not an integer. */
function shownNumber(x) {
    if (Number.isInteger(x)) return x.toLocaleString("en");
    const rounded = Number(x.toPrecision(4));
    return Math.abs(rounded) < 1e7 ? rounded.toLocaleString("en") : String(rounded);
}

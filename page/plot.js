// The curves above the slider: area, enclosed volume, components and Euler characteristic over the isovalue, behind
// them the histogram of the volume, events as marks, and the present isovalue as a line.

const SVG = "http://www.w3.org/2000/svg";
const WIDTH = 1000;
const HEIGHT = 100;
/** Below the curves, for the events. */
const MARKS = 14;
const KINDS = ["emerge", "merge", "handle opens", "split", "handle closes", "vanish"];
/** What an event of each kind adds to the components and to the Euler characteristic. */
const COMPONENT_CHANGES = [1, -1, 0, 1, 0, -1];
const EULER_CHANGES = [2, -2, -2, 2, 2, -2];
/** How near to an event, CSS pixels, a click means it. */
const NEAR = 5;

function svgElement(name, attributes) {
    const element = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    return element;
}

class Plot {
    /** Draws the curves into an svg element; `choose` is called with isovalues that are pointed at. */
    constructor(svg, { curves, histogram }, [low, high], choose) {
        Object.assign(this, { svg, curves, low, high });
        svg.setAttribute("viewBox", `0 0 ${WIDTH} ${HEIGHT + MARKS}`);
        svg.setAttribute("preserveAspectRatio", "none");
        if (histogram) this.bars(histogram);
        this.marks = marksOf(curves.events);
        this.curve("area", curves.area, null);
        this.curve("volume", curves.volume, null);
        this.curve("euler", curves.euler, EULER_CHANGES);
        this.curve("components", curves.components, COMPONENT_CHANGES);
        this.drawMarks();
        // Beside the drawing, so that it moves without all else being drawn again.
        this.cursor = byId("cursor");
        const point = (event) => choose(this.isovalueAt(event));
        svg.addEventListener("pointerdown", (event) => {
            if (event.button !== 0) return;
            svg.setPointerCapture(event.pointerId);
            point(event);
        });
        svg.addEventListener("pointermove", (event) => {
            if (svg.hasPointerCapture(event.pointerId)) point(event);
            this.tell(event);
        });
    }

    /** Ticks at the isovalues with events: one path, and one tick for all that share a column of the plot. */
    drawMarks() {
        const columns = new Set(this.marks.map(([isovalue]) => this.x(isovalue).toFixed(1)));
        const d = [...columns].map((x) => `M${x},${HEIGHT + 4}V${HEIGHT + MARKS}`).join("");
        this.svg.append(svgElement("path", { class: "event", d }));
        this.told = svgElement("title", {});
        this.svg.append(this.told);
    }

    /** Draws isovalues that have a name. */
    name(marks) {
        const d = marks.map(([isovalue]) => `M${this.x(isovalue).toFixed(1)},0V${HEIGHT + MARKS}`).join("");
        this.svg.append(svgElement("path", { class: "named", d }));
    }

    /** Says what happens at the events under the pointer, in the plot's title. */
    tell(event) {
        const { left, width } = this.svg.getBoundingClientRect();
        const column = Math.floor(event.clientX - left);
        const near = this.marks.filter(([c]) => Math.abs((this.x(c) * width) / WIDTH - 0.5 - column) <= 1);
        if (near.length === 0) {
            this.told.textContent = "";
            return;
        }
        const kinds = near.flatMap(([, k]) => k);
        const told = KINDS.flatMap((name, kind) => {
            const n = kinds.filter((k) => k === kind).length;
            return n === 0 ? [] : [n === 1 ? name : `${name} (${n} times)`];
        });
        const [first, last] = [near[0], near.at(-1)].map(([c]) => shownIsovalue(c, this.high - this.low));
        this.told.textContent = `${told.join(", ")} at ${first === last ? first : `${first} to ${last}`}`;
    }

    /** What the curves say under the pointer. */
    readOut({ clientX }) {
        const { left, width } = this.svg.getBoundingClientRect();
        const t = Math.min(Math.max((clientX - left) / width, 0), 1);
        const { curves } = this;
        const at = Math.round(t * (curves.area.length - 1));
        const isovalue = this.low + (this.high - this.low) * (at / (curves.area.length - 1));
        const told = [
            `area ${shownNumber(curves.area[at])}`, `volume ${shownNumber(curves.volume[at])}`,
            `components ${shownNumber(curves.components[at])}`, `Euler ${shownNumber(curves.euler[at])}`,
        ];
        return `${shownIsovalue(isovalue, this.high - this.low)}: ${told.join(", ")}`;
    }

    /** The next isovalue with events above or below one. */
    nextMark(isovalue, direction) {
        const isovalues = this.marks.map(([c]) => c);
        return direction > 0 ? isovalues.find((c) => c > isovalue) : isovalues.findLast((c) => c < isovalue);
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
        byId("histogram-name").hidden = false;
    }

    /** A curve through evenly spaced isovalues; steps of counts, which `changes` tells of by kind of event. */
    curve(name, sampled, changes) {
        const x = (i) => (WIDTH * i) / (sampled.length - 1);
        const points = [[0, sampled[0]]];
        for (let i = 1; i < sampled.length; i++) {
            if (!changes) points.push([x(i), sampled[i]]);
            else points.push(...this.steps([x(i - 1), x(i)], [sampled[i - 1], sampled[i]], changes));
        }
        // Counts that go into the thousands beside ones and twos: their logarithms.
        const values = points.map(([, v]) => (changes ? Math.sign(v) * Math.log1p(Math.abs(v)) : v));
        const least = values.reduce((a, b) => Math.min(a, b), 0);
        const most = values.reduce((a, b) => Math.max(a, b), least + 1e-30);
        const y = (i) => (2 + (HEIGHT - 4) * (1 - (values[i] - least) / (most - least))).toFixed(1);
        let path = `M0,${y(0)}`;
        points.forEach(([at], i) => {
            // Of steps in one column the last is what is left.
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
     * Where a count steps from one value to another between two places, and what it is then. It changes at events
     * only: at each where their kinds explain it, else at the last one.
     */
    steps([left, right], [before, after], changes) {
        const isBefore = (x) => (mark) => this.x(mark[0]) <= x;
        const between = this.marks.slice(
            countBefore(this.marks, isBefore(left)), countBefore(this.marks, isBefore(right)));
        let value = before;
        const steps = between.map(([c, kinds]) => {
            for (const kind of kinds) value += changes[kind];
            return [this.x(c), value];
        });
        if (value === after) return steps;
        if (before === after) return [];
        return [[between.length > 0 ? this.x(between.at(-1)[0]) : (left + right) / 2, after]];
    }

    /** The isovalue under the pointer; that of an event if one is near. */
    isovalueAt(event) {
        const { left, width } = this.svg.getBoundingClientRect();
        const at = (pixels) => this.low + ((this.high - this.low) * pixels) / width;
        const isovalue = Math.min(Math.max(at(event.clientX - left), this.low), this.high);
        const reach = at(NEAR) - this.low;
        const distance = ([c]) => Math.abs(c - isovalue);
        const nearest = this.marks.reduce(
            (best, mark) => (distance(mark) < distance(best) ? mark : best), [Infinity]);
        return distance(nearest) <= reach ? nearest[0] : isovalue;
    }

    /** Moves the line. */
    show(isovalue) {
        this.cursor.style.transform = `translateX(${(100 * this.x(isovalue)) / WIDTH}%)`;
    }
}

/** How many items at the beginning of a list have a property; all that have it are there. */
function countBefore(list, has) {
    let [low, high] = [0, list.length];
    while (low < high) {
        const middle = (low + high) >>> 1;
        if (has(list[middle])) low = middle + 1;
        else high = middle;
    }
    return low;
}

/** The isovalues with events, ascending, each once, and the kinds of the events there. */
function marksOf(events) {
    const marks = [];
    for (const [isovalue, kind] of [...events].sort(([a], [b]) => a - b)) {
        if (marks.at(-1)?.[0] === isovalue) marks.at(-1)[1].push(kind);
        else marks.push([isovalue, [kind]]);
    }
    return marks;
}

/** How many events there are, at how many isovalues. */
function shownEvents(nEvents, nMarks) {
    const count = (n, word) => `${n.toLocaleString("en")} ${word}${n === 1 ? "" : "s"}`;
    return nEvents === 0 ? "no events" : `${count(nEvents, "event")} at ${count(nMarks, "isovalue")}`;
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

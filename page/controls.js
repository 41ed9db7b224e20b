// What the reader does: pointer, wheel, keys, slider and typed isovalues. Every input only says
// what is wanted; the next picture shows the latest of it.

/** Steps of the slider; fine steps of the keys. */
const SLIDER_STEPS = 10000;
const STEP = 1 / 200;
const FINE_STEP = 1 / 4000;
const DEGREES_PER_PIXEL = 0.4;
/** Bounds of the distance; the nearest shows one voxel of a thousand along an axis, and a part of it. */
const [NEAREST, FARTHEST] = [0.0002, 20];

/** Pointers on the canvas: one rotates, or moves with the middle or right button; two move and zoom. */
function followPointers(canvas, viewer) {
    const pointers = new Map();
    const spread = () => {
        const [a, b] = [...pointers.values()];
        return { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, size: Math.hypot(a.x - b.x, a.y - b.y) };
    };
    canvas.addEventListener("pointerdown", (event) => {
        canvas.setPointerCapture(event.pointerId);
        const { clientX: x, clientY: y, button } = event;
        pointers.set(event.pointerId, { x, y, moves: button === 1 || button === 2 });
        event.preventDefault();
        canvas.focus({ preventScroll: true });
    });
    canvas.addEventListener("pointermove", (event) => {
        const pointer = pointers.get(event.pointerId);
        if (!pointer) return;
        const before = pointers.size === 2 ? spread() : null;
        const [dx, dy] = [event.clientX - pointer.x, event.clientY - pointer.y];
        [pointer.x, pointer.y] = [event.clientX, event.clientY];
        if (before) {
            const after = spread();
            viewer.move(after.x - before.x, after.y - before.y);
            if (before.size > 0 && after.size > 0) viewer.zoom(before.size / after.size);
        } else if (pointer.moves) viewer.move(dx, dy);
        else viewer.rotate(-DEGREES_PER_PIXEL * dx, DEGREES_PER_PIXEL * dy);
    });
    for (const end of ["pointerup", "pointercancel"]) {
        canvas.addEventListener(end, (event) => pointers.delete(event.pointerId));
    }
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("dblclick", (event) => {
        const { left, top, width, height } = canvas.getBoundingClientRect();
        viewer.recentre([
            (2 * (event.clientX - left)) / width - 1,
            1 - (2 * (event.clientY - top)) / height,
        ]);
    });
    canvas.addEventListener("wheel", (event) => {
        event.preventDefault();
        const lines = event.deltaMode === 0 ? event.deltaY / 100 : event.deltaY / 3;
        // A pinch on a touchpad arrives as a wheel with Ctrl.
        if (event.ctrlKey) viewer.zoom(Math.exp(0.25 * lines));
        else viewer.stepIsovalue(-lines * (event.shiftKey ? FINE_STEP : STEP));
    }, { passive: false });
}

/** Keys anywhere in the page, except where text is typed. */
function followKeys(viewer) {
    const keys = {
        ArrowRight: (fine) => viewer.stepIsovalue(fine ? FINE_STEP : STEP),
        ArrowUp: (fine) => viewer.stepIsovalue(fine ? FINE_STEP : STEP),
        ArrowLeft: (fine) => viewer.stepIsovalue(fine ? -FINE_STEP : -STEP),
        ArrowDown: (fine) => viewer.stepIsovalue(fine ? -FINE_STEP : -STEP),
        PageUp: () => viewer.stepIsovalue(10 * STEP),
        PageDown: () => viewer.stepIsovalue(-10 * STEP),
        Home: () => viewer.setIsovalue(viewer.low),
        End: () => viewer.setIsovalue(viewer.high),
        " ": () => viewer.play(!viewer.playing),
        r: () => viewer.reset(),
        s: () => viewer.saveScreenshot(),
        w: () => viewer.setLook({ wireframe: !viewer.look.wireframe }),
        b: () => viewer.setLook({ open: !viewer.look.open }),
        h: () => toggleHelp(),
    };
    document.addEventListener("keydown", (event) => {
        const { target, key } = event;
        if (event.ctrlKey || event.metaKey || event.altKey) return;
        if (target.matches("input[type=text]")) return;
        if (target.matches("button, a, input[type=checkbox]") && (key === " " || key === "Enter")) return;
        if (document.getElementById("help").open && key !== "h") return;
        const action = keys[key.length === 1 ? key.toLowerCase() : key];
        if (!action) return;
        event.preventDefault();
        action(event.shiftKey);
    });
}

function toggleHelp() {
    const help = document.getElementById("help");
    if (help.open) help.close();
    else help.showModal();
}

/**
 * The isovalue a text means in a range: `37.2`, `50%` of the way from one end to the other, or `p99`,
 * which 99 % of the samples do not exceed, where percentiles are known.
 */
function isovalueOfText(text, low, high, percentiles) {
    const match = /^\s*(p?)\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?)\s*(%?)\s*$/i.exec(text);
    if (!match || (match[1] && match[3])) {
        const samples = percentiles ? ", or p99 of the samples" : "";
        return { problem: `expected a number${samples ? "," : " or"} a percentage such as 50%${samples}` };
    }
    const number = Number(match[2]);
    if (match[1]) {
        if (!percentiles) return { problem: "the page does not know the samples" };
        if (!(number >= 0 && number <= 100)) return { problem: "expected p0 to p100" };
        return { isovalue: Math.min(Math.max(percentileOf(percentiles, number), low), high) };
    }
    const isovalue = match[3] ? low * (1 - number / 100) + high * (number / 100) : number;
    if (!(low <= isovalue && isovalue <= high)) {
        const [least, most] = [low, high].map((c) => Number(c.toPrecision(7)));
        return { problem: `outside the range ${least} to ${most}` };
    }
    return { isovalue };
}

/** A percentile among evenly spaced ones, straight between two of them. */
function percentileOf(percentiles, percent) {
    const at = ((percentiles.length - 1) * percent) / 100;
    const i = Math.min(Math.floor(at), percentiles.length - 2);
    return percentiles[i] * (1 - (at - i)) + percentiles[i + 1] * (at - i);
}

/** Slider, typed isovalue and buttons. */
class Panel {
    constructor(viewer, about) {
        this.viewer = viewer;
        this.percentiles = about.samples?.percentiles;
        const element = (id) => document.getElementById(id);
        const { low, high } = viewer;
        this.slider = element("slider");
        this.slider.max = SLIDER_STEPS;
        this.slider.addEventListener("input", () => {
            const t = this.slider.value / SLIDER_STEPS;
            viewer.setIsovalue(low * (1 - t) + high * t);
        });
        this.typed = element("isovalue");
        this.printed = element("printed-isovalue");
        const type = () => this.type();
        this.typed.addEventListener("change", type);
        this.typed.addEventListener("keydown", (event) => {
            if (event.key === "Enter") type();
            if (event.key === "Escape") this.show();
        });
        this.plot = new Plot(element("plot"), about, [low, high], (c) => viewer.setIsovalue(c));
        element("events").textContent = shownEvents(about.curves.events.length, this.plot.marks.length);
        this.message = element("message");
        this.loading = element("loading");
        element("low").textContent = shownIsovalue(low, high - low);
        element("high").textContent = shownIsovalue(high, high - low);
        this.playButton = element("play");
        this.playButton.addEventListener("click", () => viewer.play(!viewer.playing));
        element("reset").addEventListener("click", () => viewer.reset());
        this.wireframe = element("wireframe");
        this.wireframe.addEventListener("change", () => viewer.setLook({ wireframe: this.wireframe.checked }));
        this.border = element("border");
        this.border.addEventListener("change", () => viewer.setLook({ open: !this.border.checked }));
        element("screenshot").addEventListener("click", () => viewer.saveScreenshot());
        for (const button of document.querySelectorAll("[data-format]")) {
            button.addEventListener("click", () => viewer.saveMesh(button.dataset.format));
        }
        element("show-help").addEventListener("click", toggleHelp);
        element("close-help").addEventListener("click", toggleHelp);
    }

    type() {
        const { low, high } = this.viewer;
        const { isovalue, problem } = isovalueOfText(this.typed.value, low, high, this.percentiles);
        this.typed.setAttribute("aria-invalid", Boolean(problem));
        this.message.textContent = problem ?? "";
        if (!problem) this.viewer.setIsovalue(isovalue);
    }

    /** Shows what the viewer does. */
    show() {
        const { isovalue, low, high, look, playing } = this.viewer;
        const text = shownIsovalue(isovalue, high - low);
        const t = (isovalue - low) / (high - low);
        this.slider.value = Math.round(SLIDER_STEPS * (Number.isFinite(t) ? t : 0.5));
        const percent = `${Math.round(100 * (Number.isFinite(t) ? t : 0.5))} %`;
        this.slider.setAttribute("aria-valuetext", `isovalue ${text}, ${percent} of the range`);
        if (this.shown !== isovalue) {
            this.typed.value = text;
            this.printed.textContent = text;
            this.typed.setAttribute("aria-invalid", false);
            this.message.textContent = "";
            this.shown = isovalue;
        }
        this.showProgress();
        this.plot.show(isovalue);
        this.wireframe.checked = look.wireframe;
        this.border.checked = !look.open;
        this.playButton.textContent = playing ? "Pause" : "Play";
        this.playButton.setAttribute("aria-pressed", playing);
    }

    /** Says while only the first mesh is there; what needs the others waits. */
    showProgress() {
        const { isWhole } = this.viewer;
        if (isWhole === this.isWhole) return;
        this.isWhole = isWhole;
        this.loading.hidden = isWhole;
        for (const button of document.querySelectorAll("[data-format]")) button.disabled = !isWhole;
    }

    /** Shows the measures of the mesh; null while they are not known. */
    showMeasures(measures) {
        for (const [name, value] of Object.entries(measures)) {
            document.getElementById(`${name}-value`).textContent = value === null ? "…" : shownNumber(value);
        }
    }
}

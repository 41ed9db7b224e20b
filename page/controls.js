// What the reader does: pointer, wheel, keys, slider and typed isovalues. Every input only says
// what is wanted; the next picture shows the latest of it.

/** Steps of the slider; fine steps of the keys. */
const SLIDER_STEPS = 10000;
const STEP = 1 / 200;
const FINE_STEP = 1 / 4000;
const DEGREES_PER_PIXEL = 0.4;
/** What a key turns, degrees, moves, CSS pixels, and zooms by. */
const KEY_DEGREES = 5;
const KEY_PIXELS = 24;
const KEY_ZOOM = 1.15;
/** Bounds of the distance; the nearest shows one voxel of a thousand along an axis, and a part of it. */
const [NEAREST, FARTHEST] = [0.0002, 20];

/** Other isosurfaces that can be shown at once, and the colours that they have at first. */
const MOST_EXTRAS = 6;
const EXTRA_COLORS = ["d9a46c", "5fae84", "d184b4", "e0c95a", "c8503c", "8c7ac2"];

/** What of the look is on or off, and has a box to be checked. */
const SWITCHES = ["wireframe", "axes", "orthographic", "occlusion"];

/** How far a pointer may move, CSS pixels, and still have clicked. */
const CLICK = 4;

function byId(id) {
    return document.getElementById(id);
}

/** Does something at an event of an element, or of the one that has a name. */
function on(target, event, action) {
    (target.addEventListener ? target : byId(target)).addEventListener(event, action);
}

/** A place on the canvas as a point of the picture: -1 to 1, right and up. */
function pointOf(canvas, { clientX, clientY }) {
    const { left, top, width, height } = canvas.getBoundingClientRect();
    return [(2 * (clientX - left)) / width - 1, 1 - (2 * (clientY - top)) / height];
}

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
        pointers.set(event.pointerId, { x, y, moves: button === 1 || button === 2, button, from: [x, y] });
        event.preventDefault();
        canvas.focus({ preventScroll: true });
    });
    canvas.addEventListener("pointermove", (event) => {
        viewer.pointed = pointOf(canvas, event);
        viewer.tellPlace();
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
    canvas.addEventListener("pointerup", (event) => {
        const { from, button } = pointers.get(event.pointerId) ?? {};
        const isClick = button === 0 && Math.hypot(event.clientX - from[0], event.clientY - from[1]) <= CLICK;
        if (isClick) viewer.panel?.click(pointOf(canvas, event));
    });
    canvas.addEventListener("pointerleave", () => {
        viewer.pointed = null;
        viewer.tellPlace();
    });
    for (const end of ["pointerup", "pointercancel"]) {
        canvas.addEventListener(end, (event) => pointers.delete(event.pointerId));
    }
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("dblclick", (event) => {
        if (!viewer.panel?.picking) viewer.recentre(pointOf(canvas, event));
    });
    canvas.addEventListener("wheel", (event) => {
        // In a frame the wheel alone scrolls the page around it. A pinch on a touchpad arrives with Ctrl.
        if (IS_FRAMED && !event.ctrlKey && !event.shiftKey) return;
        event.preventDefault();
        if (event.shiftKey) viewer.stepIsovalue(-linesOf(event) * STEP);
        else viewer.zoom(Math.exp(0.25 * linesOf(event)));
    }, { passive: false });
}

/** Whether another page shows this one in a frame. */
const IS_FRAMED = typeof window !== "undefined" && window.parent !== window;

/** How far a wheel was turned, in notches; with Shift some browsers turn it sideways. */
function linesOf({ deltaMode, deltaX, deltaY }) {
    return (deltaY || deltaX) / (deltaMode === 0 ? 100 : 3);
}

/** Keys anywhere in the page, except where text is typed. */
function followKeys(viewer) {
    const onCanvas = {
        ArrowRight: () => viewer.rotate(KEY_DEGREES, 0),
        ArrowLeft: () => viewer.rotate(-KEY_DEGREES, 0),
        ArrowUp: () => viewer.rotate(0, KEY_DEGREES),
        ArrowDown: () => viewer.rotate(0, -KEY_DEGREES),
    };
    const onCanvasWithShift = {
        ArrowRight: () => viewer.move(KEY_PIXELS, 0),
        ArrowLeft: () => viewer.move(-KEY_PIXELS, 0),
        ArrowUp: () => viewer.move(0, -KEY_PIXELS),
        ArrowDown: () => viewer.move(0, KEY_PIXELS),
    };
    const pointed = () => viewer.pointed ?? [0, 0];
    const keys = {
        "+": () => viewer.zoom(1 / KEY_ZOOM),
        "=": () => viewer.zoom(1 / KEY_ZOOM),
        "-": () => viewer.zoom(KEY_ZOOM),
        _: () => viewer.zoom(KEY_ZOOM),
        n: () => viewer.panel.nextEvent(1),
        p: () => viewer.panel.nextEvent(-1),
        g: () => viewer.setLook({ axes: !viewer.look.axes }),
        o: () => viewer.setLook({ orthographic: !viewer.look.orthographic }),
        d: () => viewer.setLook({ occlusion: !viewer.look.occlusion }),
        f: () => toggleFullscreen(),
        k: () => viewer.pick(pointed(), false),
        x: () => viewer.pick(pointed(), true),
        a: () => viewer.showAll(),
        c: () => viewer.setColoring({ color: viewer.coloring.color === "none" ? "component" : "none" }),
        "]": (fine) => viewer.stepIsovalue(fine ? FINE_STEP : STEP),
        "[": (fine) => viewer.stepIsovalue(fine ? -FINE_STEP : -STEP),
        "}": () => viewer.stepIsovalue(FINE_STEP),
        "{": () => viewer.stepIsovalue(-FINE_STEP),
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
    for (let side = 0; side < 6; side++) keys[side + 1] = () => viewer.lookFrom(side);
    document.addEventListener("keydown", (event) => {
        const { target, key } = event;
        if (event.ctrlKey || event.metaKey || event.altKey) return;
        if (target.matches("input[type=text], select")) return;
        if (target.matches("button, a, input[type=checkbox]") && (key === " " || key === "Enter")) return;
        if (byId("copied").open) return;
        if (byId("help").open && key !== "h") return;
        const onTarget = target.matches("canvas") ? (event.shiftKey ? onCanvasWithShift : onCanvas) : {};
        const action = onTarget[key] ?? keys[key.length === 1 ? key.toLowerCase() : key];
        if (!action) return;
        event.preventDefault();
        action(event.shiftKey);
    });
}

function toggleFullscreen() {
    // A frame may not be allowed to.
    if (document.fullscreenElement) document.exitFullscreen();
    else document.documentElement.requestFullscreen?.().catch((error) => console.info(error.message));
}

function toggleHelp() {
    const help = byId("help");
    if (help.open) help.close();
    else help.showModal();
}

/**
 * The isovalue a text means in a range: `37.2`, `50%` of the way from one end to the other, and, where the samples are
 * known, `p99`, which 99 % of them do not exceed, `top:1%`, the same, and `2.5sigma` above their mean. The twin of
 * src/volume/isovalue.rs.
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

/** The address that leads back to what is seen. */
function linkTo(viewer) {
    writeAddress(viewer);
    return `${location.href.split("#")[0]}${viewer.address}`;
}

/** The frame that shows it in another page. */
function embedOf(viewer) {
    const quoted = (text) => text.replace(/&/g, "&amp;").replace(/"/g, "&quot;");
    return `<iframe src="${quoted(linkTo(viewer))}" title="${quoted(document.title)}" width="720" height="480" `
        + 'style="border: 0" loading="lazy" allow="clipboard-write; fullscreen"></iframe>';
}

/** A percentile, straight between known ones. */
function percentileOf(percentiles, percent) {
    const next = Math.max(percentiles.findIndex(([p]) => p >= percent), 0);
    const [[p, before], [q, after]] = [percentiles[Math.max(next - 1, 0)], percentiles[next]];
    const t = q > p ? (percent - p) / (q - p) : 1;
    return before * (1 - t) + after * t;
}

/** Changes a text; the same one again would be laid out again. */
function setText(element, text) {
    if (element.textContent !== text) element.textContent = text;
}

/** Slider, typed isovalue and buttons. */
class Panel {
    constructor(viewer, about) {
        this.viewer = viewer;
        this.samples = about.samples;
        const { low, high } = viewer;
        this.slider = byId("slider");
        this.slider.max = SLIDER_STEPS;
        on(this.slider, "input", () => {
            const t = this.slider.value / SLIDER_STEPS;
            viewer.setIsovalue(low * (1 - t) + high * t);
        });
        this.typed = byId("isovalue");
        this.printed = byId("printed-isovalue");
        const type = () => this.type();
        on(this.typed, "change", type);
        on(this.typed, "keydown", (event) => {
            if (event.key === "Enter") type();
            if (event.key === "Escape") this.show();
        });
        this.plot = new Plot(byId("plot"), about, [low, high], (c) => viewer.setIsovalue(c));
        byId("events").textContent = shownEvents(about.curves.events.length, this.plot.marks.length);
        this.offer(about, byId("offered"));
        this.message = byId("message");
        this.loading = byId("loading");
        byId("low").textContent = shownIsovalue(low, high - low);
        byId("high").textContent = shownIsovalue(high, high - low);
        this.playButton = byId("play");
        on(this.playButton, "click", () => viewer.play(!viewer.playing));
        on("reset", "click", () => viewer.reset());
        for (const name of SWITCHES) {
            on(name, "change", () => viewer.setLook({ [name]: byId(name).checked }));
        }
        this.usePictures();
        on("speed", "change", () => { viewer.speed = Number(byId("speed").value); });
        byId("fullscreen").hidden = !document.fullscreenEnabled;
        on("fullscreen", "click", toggleFullscreen);
        this.events = byId("events");
        this.eventsText = shownEvents(about.curves.events.length, this.plot.marks.length);
        on("plot", "pointermove", (event) => this.readOut(this.plot.readOut(event)));
        on("plot", "pointerleave", () => this.readOut(null));
        this.border = byId("border");
        on(this.border, "change", () => viewer.setLook({ open: !this.border.checked }));
        this.useComponents();
        this.useColors();
        this.useLayers();
        for (const id of ["slider", "plot"]) {
            on(id, "wheel", (event) => {
                if (IS_FRAMED && !event.ctrlKey && !event.shiftKey) return;
                event.preventDefault();
                viewer.stepIsovalue(-linesOf(event) * (event.shiftKey ? FINE_STEP : STEP));
            }, { passive: false });
        }
        on("previous", "click", () => this.nextEvent(-1));
        on("next", "click", () => this.nextEvent(1));
        on("screenshot", "click", () => viewer.saveScreenshot());
        for (const button of document.querySelectorAll("[data-format]")) {
            on(button, "click", () => viewer.saveMesh(button.dataset.format));
        }
        on("copy-link", "click", () => this.copy(linkTo(viewer)));
        on("copy-embed", "click", () => this.copy(embedOf(viewer)));
        on("close-copied", "click", () => byId("copied").close());
        on("more", "click", () => {
            const isMore = document.documentElement.classList.toggle("more");
            byId("more").setAttribute("aria-expanded", isMore);
            byId("more").textContent = isMore ? "Less" : "More";
        });
        on("show-help", "click", toggleHelp);
        on("close-help", "click", toggleHelp);
    }

    /** Pictures and films that are saved. */
    usePictures() {
        const { viewer } = this;
        const field = byId("picture-size");
        on(field, "change", () => {
            const size = sizeOfText(field.value, viewer.renderer.largest);
            field.setAttribute("aria-invalid", size === undefined);
            setText(this.message, size === undefined ? `expected a size such as 1920x1080, at most ${viewer.renderer.largest} each way` : "");
            if (size !== undefined) viewer.pictureSize = size ?? undefined;
        });
        on("transparent", "change", () => { viewer.isTransparent = byId("transparent").checked; });
        on("film", "click", () => viewer.saveFilm());
        // Not every browser packs films, and none does for pages that came over an open line.
        byId("film").hidden = !window.VideoEncoder;
    }

    /** Copies a text, or shows it to be copied where that may not be. */
    async copy(text) {
        try {
            await navigator.clipboard.writeText(text);
            this.message.textContent = "Copied.";
        } catch {
            const field = byId("copied-text");
            field.value = text;
            byId("copied").showModal();
            field.select();
        }
    }

    /** Buttons of the isovalues that the author marked, else of some that may be worth a look. */
    offer({ marks, suggested }, list) {
        const { viewer, plot } = this;
        const offered = marks.length > 0 ? marks : suggested;
        list.hidden = offered.length === 0;
        list.append(marks.length > 0 ? "Isovalues" : "Suggested");
        for (const [isovalue, name] of offered) {
            const button = document.createElement("button");
            button.type = "button";
            const text = shownIsovalue(isovalue, viewer.high - viewer.low);
            button.textContent = name === String(isovalue) ? text : `${name} (${text})`;
            on(button, "click", () => viewer.setIsovalue(isovalue));
            list.append(button);
        }
        plot.name(marks);
    }

    /** Says what is pointed at, in place of how many events there are. */
    readOut(text) {
        setText(this.events, text ?? this.eventsText);
    }

    /** What colours, and how. */
    useColors() {
        const { viewer } = this;
        const { maps, field } = viewer.about;
        this.color = byId("color");
        for (const [name, shown] of Object.entries(COLORS)) {
            if (viewer.canShow(name)) this.color.append(new Option(name === "field" ? field.name : shown.split(",")[0], name));
        }
        on(this.color, "change", () => viewer.setColoring({ color: this.color.value, low: null, high: null }));
        this.map = byId("map");
        for (const name of Object.keys(maps)) this.map.append(new Option(name, name));
        on(this.map, "change", () => viewer.setColoring({ map: this.map.value || null }));
        this.scale = byId("scale");
        on(this.scale, "change", () => {
            const ends = this.scale.value.trim() === "" ? [null, null] : this.scale.value.split(/\s*(?:to|:)\s*/).map(Number);
            const isScale = ends.length === 2 && (ends[0] === null || ends[0] < ends[1]);
            this.scale.setAttribute("aria-invalid", !isScale);
            this.message.textContent = isScale ? "" : "expected a scale, such as 0:1";
            if (isScale) viewer.setColoring({ low: ends[0], high: ends[1] });
        });
        this.front = byId("front");
        on(this.front, "input", () => viewer.setColoring({ front: this.front.value.slice(1) }));
        this.background = byId("background");
        on(this.background, "change", () => viewer.setLook({ background: this.background.value }));
    }

    showColors() {
        const { coloring, look } = this.viewer;
        const { color, map, low, high } = coloring;
        this.color.value = color;
        this.map.value = map ?? "";
        const hasScale = color !== "none" && color !== "component";
        for (const control of [this.map, this.scale]) control.parentElement.hidden = !hasScale;
        this.front.parentElement.hidden = color !== "none";
        if (document.activeElement !== this.scale) this.scale.value = low === null ? "" : `${low}:${high}`;
        this.background.value = look.background;
    }

    /** A plane that cuts, opacity, and other isosurfaces. */
    useLayers() {
        const { viewer } = this;
        this.clip = byId("clip");
        this.clipShare = byId("clip-share");
        this.clipTurned = byId("clip-turned");
        const clip = () => {
            const axis = "xyz".indexOf(this.clip.value);
            const share = Number(this.clipShare.value);
            viewer.setLook({ clip: this.clip.value ? { axis, share, turned: this.clipTurned.checked } : null });
        };
        for (const control of [this.clip, this.clipShare, this.clipTurned]) on(control, "input", clip);
        this.opacity = byId("opacity");
        on(this.opacity, "input", () => {
            viewer.opacity = Number(this.opacity.value);
            viewer.request();
        });
        this.also = byId("also");
        on("add-isovalue", "click", () => {
            const front = EXTRA_COLORS[viewer.extras.length % EXTRA_COLORS.length];
            if (viewer.extras.length < MOST_EXTRAS) {
                viewer.setExtras([...viewer.extras, { isovalue: viewer.isovalue, front, opacity: 0.4 }]);
            }
        });
    }

    showLayers() {
        const { clip } = this.viewer.look;
        this.clip.value = clip ? "xyz"[clip.axis] : "";
        for (const control of [this.clipShare, this.clipTurned]) control.parentElement.hidden = !clip;
        if (clip) [this.clipShare.value, this.clipTurned.checked] = [clip.share, clip.turned];
        this.opacity.value = this.viewer.opacity;
        const { extras } = this.viewer;
        if (extras === this.shownExtras) return;
        this.shownExtras = extras;
        this.also.replaceChildren(...extras.map((extra) => this.extraRow(extra)));
    }

    /** The controls of another isosurface. */
    extraRow(extra) {
        const { viewer } = this;
        const { low, high } = viewer;
        const name = shownIsovalue(extra.isovalue, high - low);
        const control = (type, label, value, change, rest) => {
            const input = Object.assign(document.createElement("input"), { type, ariaLabel: `${label} of isovalue ${name}`, ...rest, value });
            on(input, type === "text" ? "change" : "input", () => {
                change(input.value, input);
                viewer.request();
            });
            return input;
        };
        const remove = Object.assign(document.createElement("button"), { type: "button", textContent: "×", ariaLabel: `Remove isovalue ${name}` });
        on(remove, "click", () => viewer.setExtras(viewer.extras.filter((other) => other !== extra)));
        const row = Object.assign(document.createElement("span"), { className: "group" });
        row.append(
            control("text", "Value", name, (text, input) => {
                const { isovalue, problem } = isovalueOfText(text, low, high, this.samples);
                input.setAttribute("aria-invalid", Boolean(problem));
                this.message.textContent = problem ?? "";
                if (!problem) extra.isovalue = isovalue;
            }),
            control("color", "Colour", `#${extra.front}`, (value) => { extra.front = value.slice(1); }),
            control("range", "Opacity", extra.opacity, (value) => { extra.opacity = Number(value); }, { min: 0.05, max: 1, step: 0.05 }),
            remove,
        );
        return row;
    }

    /** What shows and hides components. */
    useComponents() {
        const { viewer } = this;
        this.largest = byId("largest");
        on(this.largest, "change", () => viewer.select({ largest: Number(this.largest.value) || null }));
        this.minVolume = byId("min-volume");
        on(this.minVolume, "change", () => {
            const volume = Number(this.minVolume.value);
            const isNumber = Number.isFinite(volume) && volume >= 0;
            this.minVolume.setAttribute("aria-invalid", !isNumber);
            this.message.textContent = isNumber ? "" : "expected a volume, 0 or above";
            if (isNumber) viewer.select({ minVolume: volume / this.voxelVolume() });
        });
        this.pickers = { keep: byId("pick-keep"), hide: byId("pick-hide"), measure: byId("pick-measure") };
        for (const [name, button] of Object.entries(this.pickers)) {
            on(button, "click", () => this.pickNext(this.picking === name ? null : name));
        }
        this.showAll = byId("show-all");
        on(this.showAll, "click", () => viewer.showAll());
    }

    /** The volume of a voxel in the world; the twin of voxel_volume in src/volume/placement.rs. */
    voxelVolume() {
        const { spacing, direction } = this.viewer.spectrum.info.volume.placement;
        return Math.min(...spacing) ** 3 * Math.abs(determinant(direction));
    }

    /** What the next click on the surface does: keeps or hides a component, or nothing. */
    pickNext(picking) {
        this.picking = picking;
        for (const [name, button] of Object.entries(this.pickers)) {
            button.setAttribute("aria-pressed", name === picking);
        }
        this.viewer.canvas.classList.toggle("picks", Boolean(picking));
        if (picking === "measure") this.viewer.measure(null);
    }

    click(point) {
        if (!this.picking) return;
        if (this.picking === "measure") {
            const distance = this.viewer.measure(point);
            if (distance !== null) this.message.textContent = `Distance ${shownNumber(distance)}${unitOf(this.viewer.spectrum.info.volume)}`;
            return;
        }
        const isHiding = this.picking === "hide";
        if (this.viewer.pick(point, isHiding) && !isHiding) this.pickNext(null);
    }

    /** Goes to the next isovalue with events in a direction. */
    nextEvent(direction) {
        const { viewer, plot } = this;
        const isovalue = plot.nextMark(viewer.isovalue, direction);
        if (isovalue !== undefined) viewer.setIsovalue(isovalue);
    }

    type() {
        const { low, high } = this.viewer;
        const { isovalue, problem } = isovalueOfText(this.typed.value, low, high, this.samples);
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
        for (const name of SWITCHES) byId(name).checked = look[name];
        this.border.checked = !look.open;
        this.showSelection();
        this.showColors();
        this.showLayers();
        setText(this.playButton, playing ? "Pause" : "Play");
        if (this.playButton.getAttribute("aria-pressed") !== String(playing)) {
            this.playButton.setAttribute("aria-pressed", playing);
        }
    }

    showSelection() {
        const { selection } = this.viewer;
        const { largest, minVolume } = selection;
        const wanted = largest === null ? "" : String(largest);
        if (this.largest.value !== wanted) {
            if (![...this.largest.options].some((option) => option.value === wanted)) {
                this.largest.append(new Option(`${wanted} largest`, wanted));
            }
            this.largest.value = wanted;
        }
        if (this.shownMinVolume !== minVolume) {
            this.shownMinVolume = minVolume;
            this.minVolume.value = String(Number((minVolume * this.voxelVolume()).toPrecision(6)));
        }
        this.showAll.disabled = selection.isAll;
    }

    /** Says while only the first mesh is there; what needs the others waits. */
    showProgress() {
        const { isWhole } = this.viewer;
        if (isWhole === this.isWhole) return;
        this.isWhole = isWhole;
        const [low, high] = (this.viewer.about.first ?? []).map((c) => shownIsovalue(c, this.viewer.high - this.viewer.low));
        this.loading.textContent = low === high ? "Loading the other isovalues…" : `Isovalues ${low} to ${high} are there; loading the others…`;
        this.loading.hidden = isWhole;
        for (const button of document.querySelectorAll("[data-format], #film")) button.disabled = !isWhole;
    }

    /** A measure with its unit. */
    shownMeasure(name, value) {
        const power = { area: "²", volume: "³" }[name];
        return shownNumber(value) + (power ? unitOf(this.viewer.spectrum.info.volume, power) : "");
    }

    /** Shows the measures of the mesh; null while they are not known. */
    showMeasures(measures, components) {
        for (const [name, value] of Object.entries(measures)) {
            setText(byId(`${name}-value`), value === null ? "…" : this.shownMeasure(name, value));
        }
        const names = { area: "area without caps", volume: "volume", components: "components", euler: "Euler characteristic" };
        const told = Object.entries(names).filter(([name]) => measures[name] !== null)
            .map(([name, text]) => `, ${text} ${this.shownMeasure(name, measures[name])}`);
        // What is printed is measured before: the picture of another size comes without.
        const { isovalue } = this.viewer;
        if (told.length > 0 || this.printedIsovalue !== isovalue) {
            byId("printed-measures").textContent = told.join("");
            this.printedIsovalue = isovalue;
        }
        // Of the components that there are.
        if (components && components.nKept < components.n) {
            const text = `${shownNumber(measures.components)} of ${shownNumber(components.n)}`;
            setText(byId("components-value"), text);
        }
    }
}

// The controls below the picture: slider, typed isovalue, buttons and measures.

/** The number of steps of the slider. */
const SLIDER_STEPS = 10000;

/** Options of the look that are on or off, with the ids of their check boxes. */
const SWITCHES = ["wireframe", "silhouette", "axes", "orthographic", "occlusion"];

/** The controls below the picture. */
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
        const type = () => this.setTypedIsovalue();
        on(this.typed, "change", type);
        on(this.typed, "keydown", (event) => {
            if (event.key === "Enter") type();
            if (event.key === "Escape") this.show();
        });
        this.plot = new Plot(byId("plot"), about, [low, high], viewer);
        this.addIsovalueButtons(about, byId("isovalue-buttons"));
        this.message = byId("message");
        this.message.textContent = viewer.problem ?? "";
        this.loading = byId("loading");
        this.playButton = byId("play");
        on(this.playButton, "click", () => viewer.play(!viewer.playing));
        on("reset", "click", () => viewer.reset());
        on("fit-now", "click", () => viewer.fit(false));
        on("fit-all", "click", () => viewer.fit(true));
        for (const name of SWITCHES) {
            on(name, "change", () => viewer.setLook({ [name]: byId(name).checked }));
        }
        this.connectPictures();
        on("speed", "change", () => { viewer.speed = Number(byId("speed").value); });
        byId("fullscreen").hidden = !document.fullscreenEnabled;
        on("fullscreen", "click", toggleFullscreen);
        this.events = byId("events");
        this.eventsText = shownEvents(about.curves.events.length, this.plot.ticks.length);
        this.showText(null);
        on("plot", "pointermove", (event) => this.showText(this.plot.showGuide(event)));
        on("plot", "pointerleave", () => this.showText(this.plot.showGuide(null)));
        this.listEvents();
        rememberGroups();
        for (const id of ["side", "help"]) showScrolling(byId(id));
        this.border = byId("border");
        on(this.border, "change", () => viewer.setLook({ open: !this.border.checked }));
        this.connectComponents();
        this.lookPanel = new LookPanel(viewer, this);
        this.slice = new Slice(viewer);
        for (const id of ["slider", "plot"]) {
            on(id, "wheel", (event) => {
                if (IS_FRAMED && !event.ctrlKey && !event.shiftKey) return;
                event.preventDefault();
                viewer.stepIsovalue(-notchesOf(event) * (event.shiftKey ? FINE_STEP : STEP));
            }, { passive: false });
        }
        on("previous", "click", () => this.nextEvent(-1));
        on("next", "click", () => this.nextEvent(1));
        on("screenshot", "click", () => viewer.saves.picture());
        for (const button of document.querySelectorAll("[data-format]")) {
            on(button, "click", () => viewer.saves.mesh(button.dataset.format));
        }
        byId("copy-link").parentElement.hidden = Boolean(about.name);
        on("copy-link", "click", () => this.copy(linkTo(viewer)));
        on("copy-embed", "click", async () => {
            await this.copy(embedOf(viewer));
            if (location.protocol === "file:") setText(this.message, "Copied, but the address is that of a file on this computer: put the page on a server first.");
        });
        on("close-copied", "click", () => byId("copied").close());
        on("more", "click", () => {
            const isMore = document.documentElement.classList.toggle("more");
            byId("more").ariaExpanded = isMore;
            byId("more").textContent = isMore ? "Less" : "More";
        });
        on("show-help", "click", toggleHelp);
        on("close-help", "click", toggleHelp);
    }

    /** Connects the controls of saved pictures and films. */
    connectPictures() {
        const { viewer } = this;
        const field = byId("picture-size");
        on(field, "change", () => {
            const size = parseSize(field.value, viewer.renderer.largest);
            field.ariaInvalid = size === undefined;
            setText(this.message, size === undefined ? `expected a size such as 1920x1080, at most ${viewer.renderer.largest} each way` : "");
            if (size !== undefined) viewer.saves.size = size ?? undefined;
        });
        on("transparent", "change", () => { viewer.saves.isTransparent = byId("transparent").checked; });
        on("film", "click", () => viewer.saves.film());
        // Some browsers have no video encoder, and none has one on pages over plain HTTP.
        byId("film").hidden = !window.VideoEncoder;
    }

    /** Copies a text, or shows it if the browser does not allow copying. */
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

    /** Adds buttons for the isovalues that the author marked, or for suggested ones. */
    addIsovalueButtons({ marks, suggested }, list) {
        const { viewer, plot } = this;
        const shown = marks.length > 0 ? marks : suggested;
        list.hidden = shown.length === 0;
        list.append(marks.length > 0 ? "Isovalues" : "Suggested");
        if (marks.length === 0) list.title = "Isovalues that a share of the samples exceeds; the middle of the longest range without events";
        for (const [isovalue, name] of shown) {
            const button = element("button");
            button.type = "button";
            const text = shortIsovalue(isovalue);
            button.textContent = name === String(isovalue) ? text : `${name} (${text})`;
            on(button, "click", () => viewer.setIsovalue(isovalue));
            list.append(button);
        }
        plot.drawNamedLines(marks);
    }

    /** Lists the marked events, which a choice goes to. */
    listEvents() {
        const { viewer, plot } = this;
        this.eventList = byId("event-list");
        this.eventList.parentElement.hidden = plot.marks.length === 0;
        const { length } = plot.marks;
        setText(byId("event-count"), length < plot.ticks.length ? `(${length} of ${plot.ticks.length.toLocaleString("en")} isovalues)` : `(${length} isovalues)`);
        this.eventList.append(...plot.marks.map((c, i) => Object.assign(new Option(plot.eventText(c), i), { title: plot.eventText(c) })));
        on(this.eventList, "change", () => viewer.setIsovalue(plot.marks[this.eventList.value]));
    }

    /** Shows a text about the point under the pointer, else the event at the isovalue, else the number of events. */
    showText(text) {
        this.pointText = text;
        setText(this.events, text ?? this.plot.eventText(this.viewer.isovalue) ?? this.eventsText);
    }

    /** Connects the controls of components. */
    connectComponents() {
        const { viewer } = this;
        this.largest = byId("largest");
        on(this.largest, "change", () => viewer.select({ largest: Number(this.largest.value) || null }));
        this.minVolume = byId("min-volume");
        on(this.minVolume, "change", () => {
            const volume = Number(this.minVolume.value);
            const isNumber = Number.isFinite(volume) && volume >= 0;
            this.minVolume.ariaInvalid = !isNumber;
            this.message.textContent = isNumber ? "" : "expected a volume, 0 or above";
            if (isNumber) viewer.select({ minVolume: volume / this.voxelVolume() });
        });
        this.clickButtons = { keep: byId("pick-keep"), hide: byId("pick-hide"), measure: byId("pick-measure") };
        for (const [name, button] of Object.entries(this.clickButtons)) {
            on(button, "click", () => this.setClickAction(this.clickAction === name ? null : name));
        }
        this.showAll = byId("show-all");
        on(this.showAll, "click", () => viewer.showAll());
    }

    /** The volume of a cube of the voxel frame in the world; the twin of voxel_volume in src/volume/placement.rs. */
    voxelVolume() {
        const { placement } = this.viewer.spectrum.info.volume;
        return Math.min(...placement.spacing) ** 3 * Math.abs(determinant(voxelAxesOf(placement)));
    }

    /** Sets the action of the next click on the surface: "keep", "hide", "measure" or null. */
    setClickAction(action) {
        this.clickAction = action;
        for (const [name, button] of Object.entries(this.clickButtons)) {
            button.ariaPressed = name === action;
        }
        this.viewer.canvas.classList.toggle("picks", Boolean(action));
        if (action === "measure") this.viewer.measure(null);
    }

    click(point) {
        if (!this.clickAction) return;
        if (this.clickAction === "measure") {
            const distance = this.viewer.measure(point);
            if (distance !== null) this.message.textContent = `Distance ${distanceText(distance, this.viewer.spectrum.info.volume)}`;
            return;
        }
        const isHiding = this.clickAction === "hide";
        if (this.viewer.pick(point, isHiding) && !isHiding) this.setClickAction(null);
    }

    /** Goes to the next isovalue with events in a direction. */
    nextEvent(direction) {
        const { viewer, plot } = this;
        const isovalue = plot.nextEvent(viewer.isovalue, direction);
        if (isovalue !== undefined) viewer.setIsovalue(isovalue);
    }

    setTypedIsovalue() {
        const { low, high } = this.viewer;
        const { isovalue, problem } = parseIsovalue(this.typed.value, low, high, this.samples);
        this.typed.ariaInvalid = Boolean(problem);
        this.message.textContent = problem ?? "";
        if (!problem) this.viewer.setIsovalue(isovalue);
    }

    /** The position of an isovalue in the range, percent. */
    percent(isovalue) {
        const { low, high } = this.viewer;
        return low < high ? (100 * (isovalue - low)) / (high - low) : 50;
    }

    /** Shows the state of the viewer. */
    show() {
        const { isovalue, low, high, look, playing } = this.viewer;
        const text = shownIsovalue(isovalue, high - low);
        const percent = this.percent(isovalue);
        this.slider.value = Math.round((SLIDER_STEPS / 100) * percent);
        this.slider.ariaValueText = `isovalue ${text}, ${Math.round(percent)} % of the range`;
        if (this.lastIsovalue !== isovalue) {
            this.typed.value = text;
            this.printed.textContent = text;
            this.typed.ariaInvalid = false;
            if (this.lastIsovalue !== undefined) this.message.textContent = "";
            this.lastIsovalue = isovalue;
            this.eventList.selectedIndex = this.plot.marks.indexOf(isovalue);
            this.showText(this.pointText);
        }
        this.showEmpty();
        this.showProgress();
        this.plot.show(isovalue);
        for (const name of SWITCHES) byId(name).checked = look[name];
        byId("occlusion").checked = this.viewer.isOccluded();
        this.border.checked = !look.open;
        this.showSelection();
        this.lookPanel.show();
        this.slice.show();
        setText(this.playButton, playing ? "Pause" : "Play");
        if (this.playButton.ariaPressed !== String(playing)) {
            this.playButton.ariaPressed = playing;
        }
    }

    /** Says why nothing is shown, if so. */
    showEmpty() {
        const { renderer, selection, look } = this.viewer;
        const isEmpty = renderer.nTriangles === 0;
        byId("empty").hidden = !isEmpty;
        if (!isEmpty) return;
        setText(byId("empty"), !selection.isAll ? "No component is shown: see Components, Show all."
            : look.open ? "No surface without caps at this isovalue." : "No surface at this isovalue.");
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

    /** Shows which isovalues are loaded; controls that need all of them are disabled until then. */
    showProgress() {
        const { isWhole } = this.viewer;
        if (isWhole === this.isWhole) return;
        this.isWhole = isWhole;
        const [low, high] = this.viewer.loaded.map((c) => shownIsovalue(c, this.viewer.high - this.viewer.low));
        this.loading.textContent = low === high ? "Loading the other isovalues…" : `Isovalues ${low} to ${high} are loaded; loading the others…`;
        this.loading.hidden = isWhole;
        this.slider.style.cssText = isWhole ? "" : ["--from", "--to"].map((end, i) => `${end}:${this.percent(this.viewer.loaded[i])}%`).join(";");
        for (const button of document.querySelectorAll("[data-format], #film")) button.disabled = !isWhole;
    }

    /** A measure with its unit. */
    shownMeasure(name, value) {
        const power = { area: "²", volume: "³" }[name];
        return shownNumber(value) + (power ? unitOf(this.viewer.spectrum.info.volume, power) : "");
    }

    /** Shows the measures of the mesh; null for those that are not known yet. */
    showMeasures(measures, components) {
        for (const [name, value] of Object.entries(measures)) {
            setText(byId(`${name}-value`), value === null ? "…" : this.shownMeasure(name, value));
        }
        const names = { area: "area without caps", volume: "volume", components: "components", euler: "Euler characteristic" };
        const texts = Object.entries(names).filter(([name]) => measures[name] !== null)
            .map(([name, text]) => `, ${text} ${this.shownMeasure(name, measures[name])}`);
        // Printing draws a picture of another size without measures; the last ones are kept for it.
        const { isovalue } = this.viewer;
        if (texts.length > 0 || this.printedIsovalue !== isovalue) {
            byId("printed-measures").textContent = texts.join("");
            this.printedIsovalue = isovalue;
        }
        if (components && components.nKept < components.n) {
            const text = `${shownNumber(measures.components)} of ${shownNumber(components.n)}`;
            setText(byId("components-value"), text);
        }
    }
}

/** Shows at the edges of an element whether there is more of it, for scroll bars may be hidden. */
function showScrolling(target) {
    const show = () => {
        const { scrollTop, clientHeight, scrollHeight } = target;
        target.classList.toggle("above", scrollTop > 1);
        target.classList.toggle("below", scrollTop + clientHeight < scrollHeight - 1);
    };
    on(target, "scroll", show);
    const observer = new ResizeObserver(show);
    for (const each of [target, ...target.children]) observer.observe(each);
}

/** Opens and closes the groups of controls as the reader left them. */
function rememberGroups() {
    const groups = [...document.querySelectorAll("#side > details")];
    const attempt = (action) => {
        try {
            action();
        } catch (error) {
            // A frame may have no storage.
            console.info(error.message);
        }
    };
    attempt(() => Object.entries(JSON.parse(localStorage.getItem(GENERATOR) ?? "{}")).forEach(([id, isOpen]) => { byId(id).open = isOpen; }));
    const store = () => localStorage.setItem(GENERATOR, JSON.stringify(Object.fromEntries(groups.map(({ id, open }) => [id, open]))));
    for (const group of groups) on(group, "toggle", () => attempt(store));
}

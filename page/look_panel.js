// The controls of colours, clip plane, opacity and further isosurfaces.

/** The most further isosurfaces. */
const MAX_EXTRAS = 6;
/** The first colours of further isosurfaces. */
const EXTRA_COLORS = ["d9a46c", "5fae84", "d184b4", "e0c95a", "c8503c", "8c7ac2"];

/** Options of the look that are lists of choices. */
const CHOICES = ["background", "light"];

/** The controls under "Look". */
class LookPanel {
    /** Errors of typed values go to the `message` of the panel. */
    constructor(viewer, { message, samples }) {
        Object.assign(this, { viewer, message, samples });
        this.connectColors();
        this.connectLayers();
    }

    /** Shows the state of the viewer. */
    show() {
        this.showColors();
        this.showLayers();
    }

    /** Connects the controls of colours. */
    connectColors() {
        const { viewer } = this;
        const { maps, field } = viewer.about;
        this.style = byId("style");
        for (const name of Object.keys(viewer.about.styles)) this.style.append(new Option(name, name));
        on(this.style, "change", () => viewer.setStyle(this.style.value));
        this.color = byId("color");
        for (const [name, shown] of Object.entries(COLORS)) {
            if (viewer.canShow(name)) this.color.append(new Option(name === "field" ? field.name : shown.split(",")[0], name));
        }
        on(this.color, "change", () => viewer.setColoring({ color: this.color.value, low: null, high: null, center: null }));
        this.map = byId("map");
        for (const name of Object.keys(maps)) this.map.append(new Option(name, name));
        on(this.map, "change", () => viewer.setColoring({ map: this.map.value || null }));
        this.scale = byId("scale");
        on(this.scale, "change", () => {
            const ends = parseEnds(this.scale.value);
            this.scale.ariaInvalid = !ends;
            this.message.textContent = ends ? "" : "expected a scale, such as 0:1 or p5:p95";
            if (ends) viewer.setColoring(ends);
        });
        this.front = byId("front");
        on(this.front, "input", () => viewer.setColoring({ front: this.front.value.slice(1) }));
        for (const name of CHOICES) on(name, "change", () => viewer.setLook({ [name]: byId(name).value }));
    }

    showColors() {
        const { coloring, look } = this.viewer;
        const { color, map, low, high, front } = coloring;
        this.color.value = color;
        this.map.value = map ?? "";
        const hasScale = color !== "none" && color !== "component";
        for (const control of [this.map, this.scale]) control.parentElement.hidden = !hasScale;
        this.front.parentElement.hidden = color !== "none";
        this.front.value = `#${front ?? "73b9b6"}`;
        const now = { ...look, front };
        const isShown = ([, style]) => Object.keys(style).every((name) => style[name] === now[name]);
        this.style.value = Object.entries(this.viewer.about.styles).find(isShown)?.[0] ?? "";
        if (document.activeElement !== this.scale) this.scale.value = textOfEnds(low, high) ?? "";
        for (const name of CHOICES) byId(name).value = look[name];
    }

    /** Connects the controls of the clip plane, of opacity and of further isosurfaces. */
    connectLayers() {
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
            if (viewer.extras.length < MAX_EXTRAS) {
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

    /** The controls of a further isosurface. */
    extraRow(extra) {
        const { viewer } = this;
        const { low, high } = viewer;
        const name = shownIsovalue(extra.isovalue, high - low);
        const control = (type, label, value, change, rest) => {
            const input = element("input", { type, ariaLabel: `${label} of isovalue ${name}`, ...rest, value });
            on(input, type === "text" ? "change" : "input", () => {
                change(input.value, input);
                viewer.request();
            });
            return input;
        };
        const remove = element("button", { type: "button", textContent: "×", ariaLabel: `Remove isovalue ${name}` });
        on(remove, "click", () => viewer.setExtras(viewer.extras.filter((other) => other !== extra)));
        const row = element("span", { className: "group" });
        row.append(
            control("text", "Value", name, (text, input) => {
                const { isovalue, problem } = parseIsovalue(text, low, high, this.samples);
                input.ariaInvalid = Boolean(problem);
                this.message.textContent = problem ?? "";
                if (!problem) extra.isovalue = isovalue;
            }),
            control("color", "Colour", `#${extra.front}`, (value) => { extra.front = value.slice(1); }),
            control("range", "Opacity", extra.opacity, (value) => { extra.opacity = Number(value); }, { min: 0.05, max: 1, step: 0.05 }),
            remove,
        );
        return row;
    }
}

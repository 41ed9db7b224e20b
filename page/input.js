// Input by pointers, wheel and keys. Inputs only change the state of the viewer; the next picture shows the latest state.

/** Steps of the isovalue as shares of the range. */
const STEP = 1 / 200;
const FINE_STEP = 1 / 4000;
const DEGREES_PER_PIXEL = 0.4;
/** Steps of keys: rotation in degrees, translation in CSS pixels, factor of zoom. */
const KEY_DEGREES = 5;
const KEY_PIXELS = 24;
const KEY_ZOOM = 1.15;
/** Bounds of the view's distance; at the nearest, one voxel of a thousand along an axis fills the picture. */
const [NEAREST, FARTHEST] = [0.0002, 20];

/** The greatest movement of a pointer during a click, CSS pixels. */
const MAX_CLICK_MOVEMENT = 4;

/** The point of the picture (-1 to 1, right and up) at an event on the canvas. */
function pointOf(canvas, { clientX, clientY }) {
    const { left, top, width, height } = canvas.getBoundingClientRect();
    return [(2 * (clientX - left)) / width - 1, 1 - (2 * (clientY - top)) / height];
}

/** Listens to pointers on the canvas: one rotates, or moves with the middle or right button; two move and zoom. */
function listenToPointers(canvas, viewer) {
    const pointers = new Map();
    const spread = () => {
        const [a, b] = [...pointers.values()];
        return { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, size: Math.hypot(a.x - b.x, a.y - b.y) };
    };
    on(canvas, "pointerdown", (event) => {
        canvas.setPointerCapture(event.pointerId);
        const { clientX: x, clientY: y, button } = event;
        pointers.set(event.pointerId, { x, y, moves: button === 1 || button === 2, button, from: [x, y] });
        event.preventDefault();
        canvas.focus({ preventScroll: true });
    });
    on(canvas, "pointermove", (event) => {
        viewer.pointed = pointOf(canvas, event);
        viewer.showPlace();
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
    on(canvas, "pointerup", (event) => {
        const { from, button } = pointers.get(event.pointerId) ?? {};
        const isClick = button === 0 && Math.hypot(event.clientX - from[0], event.clientY - from[1]) <= MAX_CLICK_MOVEMENT;
        if (isClick) viewer.panel?.click(pointOf(canvas, event));
    });
    on(canvas, "pointerleave", () => {
        viewer.pointed = null;
        viewer.showPlace();
    });
    for (const end of ["pointerup", "pointercancel"]) {
        on(canvas, end, (event) => pointers.delete(event.pointerId));
    }
    on(canvas, "contextmenu", (event) => event.preventDefault());
    on(canvas, "dblclick", (event) => {
        if (!viewer.panel?.clickAction) viewer.recentre(pointOf(canvas, event));
    });
    on(canvas, "wheel", (event) => {
        // In a frame the wheel without a key scrolls the page around it. A pinch on a touchpad is a wheel event with Ctrl.
        if (IS_FRAMED && !event.ctrlKey && !event.shiftKey) return;
        event.preventDefault();
        if (event.shiftKey) viewer.stepIsovalue(-notchesOf(event) * STEP);
        else viewer.zoom(Math.exp(0.25 * notchesOf(event)));
    }, { passive: false });
}

/** Whether the page is in a frame of another page. */
const IS_FRAMED = typeof window !== "undefined" && window.parent !== window;

/** The notches by which a wheel was turned; with Shift some browsers report them as horizontal. */
function notchesOf({ deltaMode, deltaX, deltaY }) {
    return (deltaY || deltaX) / (deltaMode === 0 ? 100 : 3);
}

/** Listens to keys anywhere in the page, except where text is typed. */
function listenToKeys(viewer) {
    const turning = {
        ArrowRight: () => viewer.rotate(KEY_DEGREES, 0),
        ArrowLeft: () => viewer.rotate(-KEY_DEGREES, 0),
        ArrowUp: () => viewer.rotate(0, KEY_DEGREES),
        ArrowDown: () => viewer.rotate(0, -KEY_DEGREES),
    };
    const moving = {
        ArrowRight: () => viewer.move(KEY_PIXELS, 0),
        ArrowLeft: () => viewer.move(-KEY_PIXELS, 0),
        ArrowUp: () => viewer.move(0, -KEY_PIXELS),
        ArrowDown: () => viewer.move(0, KEY_PIXELS),
    };
    const step = (direction) => (isFine) => viewer.stepIsovalue(direction * (isFine ? FINE_STEP : STEP));
    const stepping = { ArrowRight: step(1), ArrowUp: step(1), ArrowLeft: step(-1), ArrowDown: step(-1) };
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
        d: () => viewer.setLook({ occlusion: !viewer.isOccluded() }),
        f: () => toggleFullscreen(),
        k: () => viewer.pick(pointed(), false),
        x: () => viewer.pick(pointed(), true),
        a: () => viewer.showAll(),
        m: () => byId("pick-measure").click(),
        c: () => viewer.setColoring({ color: viewer.coloring.color === "none" ? "component" : "none" }),
        "]": step(1),
        "[": step(-1),
        ".": step(1),
        ",": step(-1),
        z: () => viewer.fit(false),
        v: () => viewer.fit(true),
        PageUp: () => viewer.stepIsovalue(10 * STEP),
        PageDown: () => viewer.stepIsovalue(-10 * STEP),
        Home: () => viewer.setIsovalue(viewer.low),
        End: () => viewer.setIsovalue(viewer.high),
        " ": () => viewer.play(!viewer.playing),
        r: () => viewer.reset(),
        s: () => viewer.saves.picture(),
        w: () => viewer.setLook({ wireframe: !viewer.look.wireframe }),
        b: () => viewer.setLook({ open: !viewer.look.open }),
        m: () => viewer.panel.setClickAction(viewer.panel.clickAction === "measure" ? null : "measure"),
        h: () => toggleHelp(),
        "?": () => toggleHelp(),
    };
    for (const key of "}>") keys[key] = () => step(1)(true);
    for (const key of "{<") keys[key] = () => step(-1)(true);
    for (let side = 0; side < 6; side++) keys[side + 1] = () => viewer.lookFrom(side);
    on(document, "keydown", (event) => {
        const { target, key } = event;
        if (event.ctrlKey || event.metaKey || event.altKey) return;
        if (target.matches("input[type=text], select")) return;
        if (target.matches("button, a, summary, input[type=checkbox], input[type=color]") && (key === " " || key === "Enter")) return;
        // Keys of other sliders.
        if (target.matches("input[type=range]:not(#slider)") && /^(Arrow|Page|Home|End)/.test(key)) return;
        if (byId("copied").open) return;
        if (byId("help").open && key !== "h") return;
        const arrows = target.matches("#slider") ? stepping : event.shiftKey ? moving : turning;
        const action = arrows[key] ?? keys[key.length === 1 ? key.toLowerCase() : key];
        if (!action) return;
        event.preventDefault();
        // Switches do not flicker while a key is held down.
        if (event.repeat && /^[ ?\da-moq-z]$/i.test(key)) return;
        action(event.shiftKey);
    });
}

function toggleFullscreen() {
    // A frame may lack the permission.
    if (document.fullscreenElement) document.exitFullscreen();
    else document.documentElement.requestFullscreen?.().catch((error) => console.info(error.message));
}

function toggleHelp() {
    const help = byId("help");
    if (help.open) help.close();
    else {
        help.showModal();
        // The focus is on the button at its end.
        help.scrollTop = 0;
    }
}

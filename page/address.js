// The state of the page in its address, after the hash:
// #isovalue=37.2&view=azimuth,elevation,distance[,x,y,z]&renderer=webgl2&style=paper&orthographic=1&occlusion=1&light=left&background=dark&front=c8503c&keep=3&min_volume=10&without=x,y,z;x,y,z&color=quality&map=magma&scale=0:1&slice=z,20
// keep: the number of components; min_volume: cubic voxels; only, without: points on picked components, voxel frame.

/** The parameters in the address. */
function readAddress() {
    return new URLSearchParams(location.hash.slice(1));
}

/** Sets the state that the address describes; values that are not valid are ignored, an isovalue with a message. */
function applyAddress(viewer) {
    const params = readAddress();
    const get = (name) => params.get(name);
    const text = get("isovalue") ?? "";
    const { isovalue, problem } = parseIsovalue(text, viewer.low, viewer.high, viewer.about.samples);
    viewer.problem = text && problem && `isovalue=${text.slice(0, 20)} in the address: ${problem}`;
    if (viewer.panel) setText(viewer.panel.message, viewer.problem);
    if (isovalue !== undefined) viewer.setIsovalue(isovalue);
    const largest = Number(get("keep"));
    const minVolume = Number(get("min_volume"));
    if (params.has("keep")) viewer.select({ largest: largest >= 1 ? Math.floor(largest) : null });
    if (minVolume >= 0 && params.has("min_volume")) viewer.select({ minVolume });
    if (viewer.canShow(get("color"))) viewer.setColoring({ color: get("color") });
    if (Object.hasOwn(viewer.about.maps, get("map"))) viewer.setColoring({ map: get("map") });
    const clip = /^(-?)([xyz]),([\d.]+)$/.exec(get("clip") ?? "");
    if (clip) viewer.setLook({ clip: { axis: "xyz".indexOf(clip[2]), share: Math.min(Number(clip[3]), 1), turned: clip[1] === "-" } });
    else if (params.has("clip")) viewer.setLook({ clip: null });
    const opacity = Number(get("opacity"));
    if (params.has("opacity") && opacity >= 0 && opacity <= 1) viewer.opacity = opacity;
    if (Object.hasOwn(viewer.about.styles, get("style"))) viewer.setStyle(get("style"));
    if (LIGHTS.includes(get("light"))) viewer.setLook({ light: get("light") });
    const background = get("background");
    if (background === "auto" || Object.hasOwn(BACKGROUNDS, background)) viewer.setLook({ background });
    if (/^[0-9a-f]{6}$/.test(get("front"))) viewer.setColoring({ front: get("front") });
    for (const name of ["only", "without"]) {
        for (const text of get(name)?.split(";") ?? []) {
            const point = text.split(",").map(Number);
            if (point.length === 3 && point.every(Number.isFinite)) viewer.selection.pick(point, name === "without");
        }
    }
    for (const name of [...SWITCHES, "open"]) {
        if (params.has(name)) viewer.setLook({ [name]: get(name) !== "0" });
    }
    if (params.has("also")) viewer.setExtras(parseExtras(get("also"), viewer));
    if (params.has("scale")) viewer.setColoring(parseEnds(get("scale")) ?? {});
    const slice = /^([xyz]),(\d+)$/.exec(get("slice") ?? "");
    if (slice && viewer.about.slice) {
        const axis = "xyz".indexOf(slice[1]);
        viewer.slice = { axis, index: Math.min(Number(slice[2]), viewer.spectrum.info.volume.dims[axis] - 1) };
        viewer.request();
    }
    const numbers = (get("view") ?? "").split(",").map(Number);
    if ([3, 6].includes(numbers.length) && numbers.every(Number.isFinite) && numbers[2] > 0) {
        const [azimuth, elevation, distance, x = 0, y = 0, z = 0] = numbers;
        viewer.isFitWanted = false;
        viewer.setView({
            azimuth,
            elevation: clamped(elevation, [-90, 90]),
            distance: clamped(distance, [NEAREST, FARTHEST]),
            target: [x, y, z],
        });
    }
}

/** Parses further isosurfaces: isovalue,color,opacity;... */
function parseExtras(text, { low, high }) {
    return text.split(";").slice(0, MAX_EXTRAS).flatMap((item) => {
        const [isovalue, front = "d9a46c", opacity = "1"] = item.split(",");
        const c = Number(isovalue);
        const isFine = isovalue !== "" && low <= c && c <= high && /^[0-9a-f]{6}$/.test(front) && opacity >= 0 && opacity <= 1;
        return isFine ? [{ isovalue: c, front, opacity: Number(opacity) }] : [];
    });
}

/** Writes the state into the address; values equal to those of the author are left out. */
function writeAddress(viewer) {
    // The address of the page does not lead to a file of the reader.
    if (viewer.about.name) return;
    const { azimuth, elevation, distance, target } = viewer.view;
    const rounded = [azimuth, elevation, distance, ...target].map((x) => Number(x.toPrecision(6)));
    const view = (target.some((x) => x !== 0) ? rounded : rounded.slice(0, 3)).join(",");
    const params = readAddress();
    params.set("isovalue", Number(viewer.isovalue.toPrecision(9)));
    params.set("view", view);
    const { largest, minVolume } = viewer.selection;
    const { color, map, low, high, front } = viewer.coloring;
    const { about, look, slice } = viewer;
    const { clip } = look;
    // Values of the author or of a style are not written.
    const base = { ...about, ...about.look, ...about.styles[viewer.style] };
    const changed = (name, value) => [name, value === base[name] ? null : typeof value === "boolean" ? Number(value) : value];
    const values = [["keep", largest], ["min_volume", minVolume || null], ["map", map],
        ["clip", !clip ? base.clip && "no" : `${clip.turned ? "-" : ""}${"xyz"[clip.axis]},${Number(clip.share.toPrecision(4))}`],
        ["style", viewer.style ?? null], ...[...SWITCHES, "open", ...CHOICES].map((name) => changed(name, look[name])),
        changed("front", front), changed("opacity", viewer.opacity),
        ...["only", "without"].map((name, i) => [name, viewer.selection.isHiding === Boolean(i) && viewer.selection.pickedPoints() || null]),
        ["also", viewer.extras.map(({ isovalue, front, opacity }) =>
            [Number(isovalue.toPrecision(9)), front, opacity].join(",")).join(";") || (base.also.length > 0 ? "" : null)],
        ["slice", slice && slice !== viewer.panel?.slice.first ? `${"xyz"[slice.axis]},${slice.index}` : null],
        ["color", color === about.color.color ? null : color],
        ["scale", textOfEnds(low, high)]];
    for (const [name, value] of values) {
        if (value === null) params.delete(name);
        else params.set(name, value);
    }
    viewer.address = `#${params.toString().replaceAll("%2C", ",").replaceAll("%3B", ";")}`;
    setAddress(viewer.address);
}

function setAddress(address) {
    try {
        history.replaceState(null, "", address);
    } catch {
        // A frame without its own address.
    }
}

/** The full address of the current state. */
function linkTo(viewer) {
    writeAddress(viewer);
    return `${location.href.split("#")[0]}${viewer.address}`;
}

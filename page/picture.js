// Saved pictures: of any size, also with a transparent background, with legend and overlay.

/** Converts premultiplied to straight alpha, in linear light, in which the samples of a pixel were averaged. */
function withStraightAlpha({ pixels }) {
    const linear = (byte) => (byte <= 10 ? byte / 255 / 12.92 : ((byte / 255 + 0.055) / 1.055) ** 2.4);
    const shown = (x) => 255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055);
    for (let i = 0; i < pixels.length; i += 4) {
        const alpha = pixels[i + 3] / 255;
        if (alpha === 0 || alpha === 1) continue;
        for (let k = i; k < i + 3; k++) pixels[k] = shown(Math.min(linear(pixels[k]) / alpha, 1));
    }
}

/** Draws the shapes of an SVG with their styles of the page. */
function drawShapes(context, svg, scale) {
    context.save();
    context.scale(scale, scale);
    for (const shape of svg.children) {
        const style = getComputedStyle(shape);
        Object.assign(context, { globalAlpha: style.opacity, strokeStyle: style.stroke, fillStyle: style.fill, lineCap: "round" });
        context.lineWidth = parseFloat(style.strokeWidth);
        const at = (name) => Number(shape.getAttribute(name));
        if (shape.tagName === "text") {
            Object.assign(context, { font: `${style.fontWeight} ${style.fontSize} ${style.fontFamily}`, textAlign: "center", textBaseline: "middle" });
            context.fillText(shape.textContent, at("x"), at("y"));
            continue;
        }
        const path = new Path2D(shape.getAttribute("d") ?? "");
        if (shape.tagName === "circle") path.arc(at("cx"), at("cy"), at("r"), 0, 2 * Math.PI);
        if (style.fill !== "none") context.fill(path);
        if (style.stroke !== "none") context.stroke(path);
    }
    context.restore();
}

/** Draws a picture (rows from the top) with legend and overlay into a canvas, and returns it. */
function drawPicture(canvas, { width, height, pixels }, viewer) {
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    const context = canvas.getContext("2d", { willReadFrequently: true });
    context.putImageData(new ImageData(pixels, width, height), 0, 0);
    annotate(context, viewer);
    return canvas;
}

/** Draws the picture on paper: white, if the background is that of the page. Nothing is read back, which would take until later. */
function drawPrint(viewer) {
    viewer.prepare();
    const look = viewer.drawnLook();
    if (viewer.look.background === "auto") look.background = BACKGROUNDS.white;
    viewer.renderer.draw(viewer.layers(), look, viewer.projection());
    const canvas = element("canvas");
    [canvas.width, canvas.height] = [viewer.canvas.width, viewer.canvas.height];
    const context = canvas.getContext("2d");
    context.drawImage(viewer.canvas, 0, 0);
    annotate(context, viewer, false);
    return canvas;
}

/** Draws legend and overlay on a picture. */
function annotate(context, viewer, isDark = viewer.isDark()) {
    const { width, height } = context.canvas;
    if (viewer.overlay) {
        // The overlay keeps its size relative to the height of the picture.
        const scale = height / viewer.canvas.clientHeight;
        viewer.overlay.draw(viewer, viewer.projection([width, height]), [width / scale, height / scale]);
        drawShapes(context, viewer.overlay.svg, scale);
        viewer.overlay.draw(viewer, viewer.projection());
    }
    if (viewer.legendContent) drawLegend(context, viewer.legendContent, isDark);
}

function pngOf(canvas) {
    return new Promise((resolve, reject) => {
        canvas.toBlob((blob) => (blob ? resolve(blob) : reject(new Error("no picture"))), "image/png");
    });
}

/** Parses a size such as 1920x1080; null if the text is empty, undefined if it is not valid. */
function parseSize(text, largest) {
    if (text.trim() === "") return null;
    const size = /^\s*(\d+)\s*[x×]\s*(\d+)\s*$/.exec(text)?.slice(1).map(Number);
    return size?.every((n) => n >= 1 && n <= largest) ? size : undefined;
}

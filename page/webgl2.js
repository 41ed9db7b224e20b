// Draws on WebGL2 with page/surface.*.glsl: the same tables in textures, the same picture as on WebGPU. The picture is drawn in
// linear light into a multisampled sRGB target and copied to the canvas, which has no sRGB format.

/** Texels per row of a table. */
const ROW = 2048;

class WebGl2Renderer {
    /** Opens a renderer without a spectrum; throws if there is no WebGL2, or the spectrum described by `about` is too large. */
    static async open(canvas, about) {
        const gl = canvas.getContext("webgl2", { antialias: false, depth: false, alpha: false });
        if (!gl) throw new Error("no WebGL2");
        if (Math.ceil(about.knots / ROW) > gl.getParameter(gl.MAX_TEXTURE_SIZE)) {
            throw new Error("the spectrum is too large for this device");
        }
        return new WebGl2Renderer(gl, canvas);
    }

    constructor(gl, canvas) {
        this.name = "WebGL2";
        Object.assign(this, { gl, canvas });
        const text = (id) => byId(id).textContent.trimStart();
        const variant = (name) => text("fragment-glsl").replace("\n", `\n#define ${name}\n`);
        this.uncut = this.linked(text("vertex-glsl"), text("fragment-glsl"));
        // The others are compiled on demand.
        this.compileCutPrograms = () => {
            this.cut ??= this.linked(text("vertex-glsl"), variant("CUT"));
            this.cap ??= this.linked(text("cap-vertex"), variant("CAP"));
        };
        this.copy = this.linked(text("copy-vertex"), text("copy-fragment"));
        this.uniforms = new Map();
        this.layers = [];
        this.nSamples = Math.min(4, gl.getParameter(gl.MAX_SAMPLES));
    }

    /** Uploads a spectrum. */
    async load(spectrum, step) {
        this.spectrum = spectrum;
        for (const [, texture] of this.tables ?? []) this.gl.deleteTexture(texture);
        this.uploadTables(spectrum.tables ?? tablesOf(spectrum, step));
    }

    linked(vertex, fragment) {
        const { gl } = this;
        const program = gl.createProgram();
        for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
            const shader = gl.createShader(kind);
            gl.shaderSource(shader, source);
            gl.compileShader(shader);
            gl.attachShader(program, shader);
        }
        gl.linkProgram(program);
        if (!gl.getProgramParameter(program, gl.LINK_STATUS)) {
            const logs = gl.getAttachedShaders(program).map((s) => gl.getShaderInfoLog(s));
            throw new Error([gl.getProgramInfoLog(program), ...logs].join(" "));
        }
        return program;
    }

    uploadTables({ isovalues, firstKnot, knots }) {
        const { gl } = this;
        const integer = gl.RED_INTEGER;
        const tables = [
            ["isovalues", isovalues, 2, gl.RG32F, gl.RG, gl.FLOAT],
            ["first_knot", firstKnot, 1, gl.R32UI, integer, gl.UNSIGNED_INT],
            ["knots", knots, 4, gl.RGBA32UI, gl.RGBA_INTEGER, gl.UNSIGNED_INT],
        ];
        this.tables = tables.map(([name, table, width, internal, format, type]) => {
            const texture = gl.createTexture();
            gl.bindTexture(gl.TEXTURE_2D, texture);
            for (const key of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) {
                gl.texParameteri(gl.TEXTURE_2D, key, gl.NEAREST);
            }
            const nRows = Math.max(Math.ceil(table.length / width / ROW), 1);
            gl.texStorage2D(gl.TEXTURE_2D, 1, internal, ROW, nRows);
            // Whole rows, then the rest of the last row.
            const nWhole = Math.floor(table.length / width / ROW);
            const rest = table.length / width - nWhole * ROW;
            if (nWhole > 0) {
                gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, ROW, nWhole, format, type, table, 0);
            }
            if (rest > 0) {
                const from = nWhole * ROW * width;
                gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, nWhole, rest, 1, format, type, table, from);
            }
            return [name, texture];
        });
    }

    uniform(program, name) {
        if (!this.uniforms.has(program)) this.uniforms.set(program, new Map());
        const known = this.uniforms.get(program);
        if (!known.has(name)) known.set(name, this.gl.getUniformLocation(program, name));
        return known.get(name);
    }

    /** The buffers of a layer. */
    layer(i) {
        const { gl } = this;
        while (this.layers.length <= i) {
            const layer = { corners: gl.createBuffer(), vertexArray: gl.createVertexArray(), words: new Uint32Array(4096), nTriangles: 0 };
            gl.bindVertexArray(layer.vertexArray);
            gl.bindBuffer(gl.ARRAY_BUFFER, layer.corners);
            // Each corner: its vertex, the code of its normal, the colour code of its triangle.
            for (const place of [0, 1, 2]) {
                gl.enableVertexAttribArray(place);
                gl.vertexAttribIPointer(place, 1, gl.UNSIGNED_INT, 12, 4 * place);
            }
            this.layers.push(layer);
        }
        return this.layers[i];
    }

    /** The number of triangles of the first layer. */
    get nTriangles() {
        return this.layers[0]?.nTriangles ?? 0;
    }

    /** Compiles what plain pictures do not need. */
    prepare(layers, { plane, occlusion }) {
        if (plane || layers.some(({ opacity }) => opacity < 1)) this.compileCutPrograms();
        if (occlusion) this.occlusion ??= new WebGl2Occlusion(this);
        return null;
    }

    /** The greatest width and height of a picture, pixels. */
    get largest() {
        const { gl } = this;
        return Math.min(gl.getParameter(gl.MAX_RENDERBUFFER_SIZE), gl.getParameter(gl.MAX_TEXTURE_SIZE));
    }

    /** Uploads the triangles of layer i and the normals at their corners. */
    upload({ nTriangles, corners, vertices, normals, components, codes = components }, i = 0) {
        const { gl } = this;
        const layer = this.layer(i);
        const words = withCapacity(layer.words, 9 * nTriangles);
        for (let at = 0; at < 3 * nTriangles; at++) {
            words[3 * at] = vertices[corners[at]];
            words[3 * at + 1] = normals[corners[at]];
            words[3 * at + 2] = codes[(at / 3) | 0];
        }
        Object.assign(layer, { nTriangles, words });
        gl.bindBuffer(gl.ARRAY_BUFFER, layer.corners);
        gl.bufferData(gl.ARRAY_BUFFER, words.subarray(0, 9 * nTriangles), gl.DYNAMIC_DRAW);
    }

    /** Draws a picture of a size into `resolved`. */
    render(layers, look, projection, [width, height]) {
        const { gl } = this;
        this.resize(width, height);
        gl.bindFramebuffer(gl.FRAMEBUFFER, this.samples);
        gl.viewport(0, 0, width, height);
        gl.clearBufferfv(gl.COLOR, 0, [...look.background, look.isTransparent ? 0 : 1]);
        gl.clearBufferfi(gl.DEPTH_STENCIL, 0, 1, 0);
        gl.enable(gl.DEPTH_TEST);
        gl.depthFunc(gl.LESS);
        let nOpaque = layers.filter(({ opacity }) => opacity === 1).length;
        for (const i of drawingOrder(layers)) {
            this.drawLayer(this.layer(i), layers[i], look, projection);
            // Transparent layers are drawn over the occlusion of the opaque ones.
            if (--nOpaque === 0 && look.occlusion) this.occlusion?.draw(projection, [width, height]);
        }
        gl.bindFramebuffer(gl.READ_FRAMEBUFFER, this.samples);
        gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, this.resolved);
        gl.blitFramebuffer(0, 0, width, height, 0, 0, width, height, gl.COLOR_BUFFER_BIT, gl.NEAREST);
    }

    /** Draws into the canvas. */
    draw(layers, look, projection) {
        const { gl } = this;
        const { width, height } = this.canvas;
        this.render(layers, look, projection, [width, height]);
        gl.bindFramebuffer(gl.FRAMEBUFFER, null);
        gl.viewport(0, 0, width, height);
        gl.disable(gl.DEPTH_TEST);
        gl.useProgram(this.copy);
        gl.activeTexture(gl.TEXTURE0);
        gl.bindTexture(gl.TEXTURE_2D, this.picture);
        gl.uniform1i(gl.getUniformLocation(this.copy, "picture"), 0);
        gl.bindVertexArray(null);
        gl.drawArrays(gl.TRIANGLES, 0, 3);
    }

    drawLayer({ vertexArray, nTriangles }, layer, look, projection) {
        const { gl } = this;
        const isCut = Boolean(look.plane) || layer.opacity < 1;
        const program = isCut ? this.cut : this.uncut;
        const triangles = () => gl.drawArrays(gl.TRIANGLES, 0, 3 * nTriangles);
        gl.bindVertexArray(vertexArray);
        gl.useProgram(program);
        this.setUniforms(program, layer, look, projection);
        if (look.plane && !look.open) this.drawCap(layer, look, projection, triangles, program, vertexArray);
        if (layer.opacity < 1) {
            // First depth, then colour: only the nearest triangles are visible, in any order of the triangles.
            gl.colorMask(false, false, false, false);
            triangles();
            gl.colorMask(true, true, true, true);
            gl.enable(gl.BLEND);
            gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
            gl.depthFunc(gl.LEQUAL);
            gl.depthMask(false);
        }
        triangles();
        gl.disable(gl.BLEND);
        gl.depthMask(true);
        gl.depthFunc(gl.LESS);
    }

    /** Counts front and back faces behind the clip plane, and draws a cap where the plane is inside the surface. */
    drawCap(layer, look, projection, triangles, program, vertexArray) {
        const { gl } = this;
        gl.enable(gl.STENCIL_TEST);
        gl.colorMask(false, false, false, false);
        gl.depthMask(false);
        gl.depthFunc(gl.ALWAYS);
        gl.stencilFunc(gl.ALWAYS, 0, 255);
        gl.stencilOpSeparate(gl.FRONT, gl.KEEP, gl.KEEP, gl.DECR_WRAP);
        gl.stencilOpSeparate(gl.BACK, gl.KEEP, gl.KEEP, gl.INCR_WRAP);
        triangles();
        gl.colorMask(true, true, true, true);
        gl.depthMask(true);
        gl.depthFunc(gl.LESS);
        gl.stencilFunc(gl.NOTEQUAL, 0, 255);
        gl.stencilOp(gl.KEEP, gl.ZERO, gl.ZERO);
        gl.enable(gl.BLEND);
        gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
        gl.useProgram(this.cap);
        gl.bindVertexArray(null);
        this.setCut(this.cap, layer, look);
        gl.uniform3fv(this.uniform(this.cap, "front"), layer.front.slice(0, 3));
        gl.uniform2fv(this.uniform(this.cap, "depth"), projection.depth);
        gl.uniform2fv(this.uniform(this.cap, "half_extent"), projection.halfExtent);
        gl.uniform1i(this.uniform(this.cap, "parallel"), projection.isParallel ? 1 : 0);
        gl.uniform1i(this.uniform(this.cap, "lamp"), look.lamp);
        gl.drawArrays(gl.TRIANGLES, 0, 3);
        gl.disable(gl.BLEND);
        gl.disable(gl.STENCIL_TEST);
        gl.useProgram(program);
        gl.bindVertexArray(vertexArray);
    }

    setCut(program, { opacity }, { plane }) {
        this.gl.uniform4fv(this.uniform(program, "plane"), plane ?? [0, 0, 0, 1]);
        this.gl.uniform1f(this.uniform(program, "opacity"), opacity);
    }

    setUniforms(program, layer, look, projection) {
        const { gl } = this;
        const { query, front, backside, palette, stops } = layer;
        const at = (name) => this.uniform(program, name);
        gl.uniformMatrix4fv(at("clip_from_voxel"), false, projection.clipFromVoxel);
        gl.uniformMatrix4fv(at("eye_from_voxel"), false, projection.eyeFromVoxel);
        gl.uniformMatrix4fv(at("eye_from_normal"), false, projection.eyeFromNormal);
        gl.uniform2fv(at("isovalue"), scaledIsovalue(this.spectrum, query.isovalue));
        gl.uniform1ui(at("rank"), Math.max(query.active.rank, 0));
        gl.uniform3fv(at("front"), front.slice(0, 3));
        gl.uniform4fv(at("back"), insideOf(backside, look));
        gl.uniform4fv(at("wire"), palette ? COLOURED_WIRE : PLAIN_WIRE);
        gl.uniform1i(at("palette"), palette);
        if (stops) gl.uniform4fv(at("map"), stops);
        gl.uniform1f(at("wire_width"), look.wireframe ? look.pixelRatio : 0);
        gl.uniform1i(at("mirrored"), projection.mirrored ? 1 : 0);
        gl.uniform1i(at("parallel"), projection.isParallel ? 1 : 0);
        gl.uniform1i(at("lamp"), look.lamp);
        if (program === this.cut) this.setCut(program, layer, look);
        this.tables.forEach(([name, texture], unit) => {
            gl.activeTexture(gl.TEXTURE0 + unit);
            gl.bindTexture(gl.TEXTURE_2D, texture);
            gl.uniform1i(at(name), unit);
        });
    }

    /** Makes a texture of the picture's size that is read without filtering. */
    texture(format, [width, height]) {
        const { gl } = this;
        const texture = gl.createTexture();
        gl.activeTexture(gl.TEXTURE0);
        gl.bindTexture(gl.TEXTURE_2D, texture);
        gl.texStorage2D(gl.TEXTURE_2D, 1, format, width, height);
        gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
        gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
        return texture;
    }

    /** Makes targets of the picture's size. */
    resize(width, height) {
        if (this.size?.[0] === width && this.size?.[1] === height) return;
        const { gl } = this;
        for (const buffer of this.buffers ?? []) gl.deleteRenderbuffer(buffer);
        for (const target of [this.samples, this.resolved]) gl.deleteFramebuffer(target ?? null);
        for (const texture of [this.picture, this.depth]) gl.deleteTexture(texture ?? null);
        this.samples = gl.createFramebuffer();
        gl.bindFramebuffer(gl.FRAMEBUFFER, this.samples);
        this.buffers = [
            [gl.SRGB8_ALPHA8, gl.COLOR_ATTACHMENT0],
            [gl.DEPTH24_STENCIL8, gl.DEPTH_STENCIL_ATTACHMENT],
        ].map(([format, attachment]) => {
            const buffer = gl.createRenderbuffer();
            gl.bindRenderbuffer(gl.RENDERBUFFER, buffer);
            gl.renderbufferStorageMultisample(gl.RENDERBUFFER, this.nSamples, format, width, height);
            gl.framebufferRenderbuffer(gl.FRAMEBUFFER, attachment, gl.RENDERBUFFER, buffer);
            return buffer;
        });
        this.picture = this.texture(gl.SRGB8_ALPHA8, [width, height]);
        this.depth = this.texture(gl.DEPTH24_STENCIL8, [width, height]);
        this.resolved = gl.createFramebuffer();
        gl.bindFramebuffer(gl.FRAMEBUFFER, this.resolved);
        for (const [attachment, texture] of [[gl.COLOR_ATTACHMENT0, this.picture], [gl.DEPTH_STENCIL_ATTACHMENT, this.depth]]) {
            gl.framebufferTexture2D(gl.FRAMEBUFFER, attachment, gl.TEXTURE_2D, texture, 0);
        }
        this.size = [width, height];
    }

    /** Resolves when the device has finished drawing. */
    done() {
        const { gl } = this;
        const sync = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
        gl.flush();
        return new Promise((resolve) => {
            const look = () => {
                const state = gl.clientWaitSync(sync, 0, 0);
                if (state === gl.TIMEOUT_EXPIRED) {
                    setTimeout(look, 1);
                    return;
                }
                gl.deleteSync(sync);
                resolve();
            };
            look();
        });
    }

    /** Draws a picture and reads it back: rows from the top, four bytes per pixel, premultiplied alpha. */
    async read(layers, look, projection, [width, height]) {
        this.prepare(layers, look);
        this.render(layers, look, projection, [width, height]);
        const { gl } = this;
        gl.bindFramebuffer(gl.FRAMEBUFFER, this.resolved);
        const rows = new Uint8Array(4 * width * height);
        gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, rows);
        const pixels = new Uint8ClampedArray(rows.length);
        for (let y = 0; y < height; y++) {
            const from = 4 * (height - 1 - y) * width;
            pixels.set(rows.subarray(from, from + 4 * width), 4 * y * width);
        }
        return { width, height, pixels };
    }

    /** Calls back when the context is lost. */
    onLost(callback) {
        on(this.canvas, "webglcontextlost", callback);
    }
}

// Mesh files: the mesh at the current isovalue as STL, PLY or GLB, all little endian. The twin of src/export/*.rs.

const GENERATOR = "isospectrum";

/** Binary STL. */
function stlOf(mesh) {
    const { positions, triangles, comments } = welded(mesh);
    const n = triangles.length / 3;
    const bytes = new ArrayBuffer(84 + 50 * n);
    const view = new DataView(bytes);
    const head = [`binary STL by ${GENERATOR}`, ...comments].join(". ").padEnd(80);
    for (let i = 0; i < 80; i++) view.setUint8(i, head.charCodeAt(i));
    view.setUint32(80, n, true);
    for (let t = 0; t < n; t++) {
        const corners = [0, 1, 2].map((k) => {
            const at = 3 * triangles[3 * t + k];
            return [positions[at], positions[at + 1], positions[at + 2]];
        });
        const [u, v] = [1, 2].map((k) => corners[k].map((x, i) => x - corners[0][i]));
        const normal = cross(u, v);
        const length = Math.hypot(...normal);
        const numbers = [...normal.map((x) => (length > 0 ? x / length : 0)), ...corners.flat()];
        numbers.forEach((x, i) => view.setFloat32(84 + 50 * t + 4 * i, x, true));
    }
    return bytes;
}

/** Binary PLY with normals. */
function plyOf({ positions, normals, triangles, comments }) {
    const [n, m] = [positions.length / 3, triangles.length / 3];
    const head = new TextEncoder().encode(
        `ply\nformat binary_little_endian 1.0\n${[GENERATOR, ...comments].map((text) => `comment ${text}\n`).join("")}element vertex ${n}\n`
        + "property float x\nproperty float y\nproperty float z\n"
        + "property float nx\nproperty float ny\nproperty float nz\n"
        + `element face ${m}\nproperty list uchar int vertex_indices\nend_header\n`);
    const bytes = new Uint8Array(head.length + 24 * n + 13 * m);
    bytes.set(head);
    const view = new DataView(bytes.buffer);
    let at = head.length;
    for (let v = 0; v < n; v++) {
        for (const list of [positions, normals]) {
            for (let i = 0; i < 3; i++, at += 4) view.setFloat32(at, list[3 * v + i], true);
        }
    }
    for (let t = 0; t < m; t++) {
        view.setUint8(at++, 3);
        for (let k = 0; k < 3; k++, at += 4) view.setInt32(at, triangles[3 * t + k], true);
    }
    return bytes;
}

/** Binary glTF 2.0 with one mesh; an empty mesh gives an empty scene, because glTF has no empty buffers. */
function glbOf({ positions, normals, triangles, placement: { unit = "unknown", space = "UNKNOWN" } }) {
    const [n, m] = [positions.length / 3, triangles.length / 3];
    const asset = { version: "2.0", generator: GENERATOR };
    let json = { asset, scene: 0, scenes: [{}] };
    const extras = { ...(unit !== "unknown" && { unit }), ...(space !== "UNKNOWN" && { space }) };
    if (m > 0) {
        const bound = (pick) => [0, 1, 2].map((i) => {
            let best = positions[i];
            for (let at = i; at < positions.length; at += 3) best = pick(best, positions[at]);
            return best;
        });
        const vector = { bufferView: 0, componentType: 5126, count: n, type: "VEC3" };
        const view = (byteOffset, byteLength, rest) => ({ buffer: 0, byteOffset, byteLength, ...rest });
        json = {
            asset,
            scene: 0,
            scenes: [{ nodes: [0] }],
            nodes: [{ mesh: 0, ...(Object.keys(extras).length > 0 && { extras }) }],
            meshes: [{ primitives: [{ attributes: { POSITION: 0, NORMAL: 1 }, indices: 2 }] }],
            accessors: [
                { ...vector, min: bound(Math.min), max: bound(Math.max) },
                { ...vector, bufferView: 1 },
                { bufferView: 2, componentType: 5125, count: 3 * m, type: "SCALAR" },
            ],
            bufferViews: [
                view(0, 12 * n, { byteStride: 12, target: 34962 }),
                view(12 * n, 12 * n, { byteStride: 12, target: 34962 }),
                view(24 * n, 12 * m, { target: 34963 }),
            ],
            buffers: [{ byteLength: 24 * n + 12 * m }],
        };
    }
    let text = JSON.stringify(json);
    text = text.padEnd(Math.ceil(text.length / 4) * 4);
    const binary = m > 0 ? 8 + 24 * n + 12 * m : 0;
    const bytes = new Uint8Array(20 + text.length + binary);
    const view = new DataView(bytes.buffer);
    [0x46546c67, 2, bytes.length, text.length, 0x4e4f534a]
        .forEach((x, i) => view.setUint32(4 * i, x, true));
    bytes.set(new TextEncoder().encode(text), 20);
    if (m > 0) {
        let at = 20 + text.length;
        view.setUint32(at, binary - 8, true);
        view.setUint32(at + 4, 0x004e4942, true);
        at += 8;
        for (const list of [positions, normals, triangles]) {
            bytes.set(new Uint8Array(list.buffer, list.byteOffset, list.byteLength), at);
            at += list.byteLength;
        }
    }
    return bytes;
}

const FORMATS = {
    stl: [stlOf, "model/stl"],
    ply: [plyOf, "application/octet-stream"],
    glb: [glbOf, "model/gltf-binary"],
};

/** Downloads a file. */
function save(blob, name) {
    const link = element("a");
    link.href = URL.createObjectURL(blob);
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

/** A file name of ASCII letters, digits and hyphens. */
function fileName(title, isovalue, ending) {
    const name = title.normalize("NFKD").replace(/[^A-Za-z0-9]+/g, "-").replace(/^-+|-+$/g, "");
    return `${name.slice(0, 60) || "isosurface"}-${isovalue}.${ending}`;
}

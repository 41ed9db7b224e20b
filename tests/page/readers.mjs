// Reads GLB files with the validator of glTF and the importer of three.js. Arguments are files; the output is a line of JSON for each.

import { readFileSync } from "node:fs";
import validator from "gltf-validator";
import { AnimationMixer, Box3, Vector3 } from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";

/** Times of an animation that are examined, as shares of its length. */
const SHARES = [0, 0.26, 0.5, 0.999];

// The importer expects the global object of a browser.
globalThis.self ??= globalThis;

function imported(bytes) {
    const { buffer, byteOffset, byteLength } = bytes;
    const file = buffer.slice(byteOffset, byteOffset + byteLength);
    return new Promise((done, fail) => new GLTFLoader().parse(file, "", done, fail));
}

/** The number of visible triangles, and the box around their vertices after transforms and morphing. */
function visible(scene) {
    scene.updateMatrixWorld(true);
    const box = new Box3();
    const point = new Vector3();
    let nTriangles = 0;
    scene.traverse((mesh) => {
        // A mesh with a scale of 0 is hidden.
        if (!mesh.isMesh || mesh.matrixWorld.elements.slice(0, 12).every((x) => x === 0)) return;
        nTriangles += mesh.geometry.index.count / 3;
        const { count } = mesh.geometry.attributes.position;
        for (let i = 0; i < count; i++) box.expandByPoint(mesh.getVertexPosition(i, point).applyMatrix4(mesh.matrixWorld));
    });
    return { nTriangles, low: box.min.toArray(), high: box.max.toArray() };
}

for (const path of process.argv.slice(2)) {
    const bytes = new Uint8Array(readFileSync(path));
    const { issues } = await validator.validateBytes(bytes);
    const { scene, animations } = await imported(bytes);
    const frames = [];
    if (animations.length > 0) {
        const mixer = new AnimationMixer(scene);
        mixer.clipAction(animations[0]).play();
        for (const share of SHARES) {
            mixer.setTime(share * animations[0].duration);
            frames.push(visible(scene));
        }
    } else frames.push(visible(scene));
    const messages = issues.messages.filter(({ severity }) => severity < 2);
    console.log(JSON.stringify({ path, messages, frames }));
}

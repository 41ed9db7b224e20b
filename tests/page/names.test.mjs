// The script of a page compared with its sources by a parser: only names of variables differ, one for one, and none of the browser's.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { parse } from "acorn";
import { folder } from "./browser.mjs";

const OPTIONS = { ecmaVersion: "latest" };

/** The sources of a script in the order of src/page/script.rs, between a first and a last line. */
function sources(isLinked) {
    const read = (path) => readFileSync(new URL(`../../${path}`, import.meta.url), "utf8");
    const names = [...read("src/page/script.rs").matchAll(/include_str!\("..\/..\/(page\/\w+\.js)"\)/g)].map((match) => match[1]);
    const start = names.indexOf("page/start.js");
    assert.ok(start > 30 && names.length > start + 1, `${names}`);
    const wanted = isLinked ? names.filter((_, i) => i !== start) : names.slice(0, start + 1);
    return `(() => {\n"use strict";\n${wanted.map(read).join("\n")}\n})();`;
}

function scriptOf(name) {
    return /<script>\n(\(\(\)=>\{[^]*?)<\/script>/.exec(readFileSync(join(folder, name), "utf8"))[1];
}

/** Whether a part of a node is the name of a property. */
function isPropertyName(node, part) {
    return !node.computed && ((node.type === "MemberExpression" && part === "property")
        || (["Property", "MethodDefinition", "PropertyDefinition"].includes(node.type) && part === "key"));
}

/** A node without its place and its spelling: src/page/compact.rs writes const, true, false and undefined shorter. */
function simplified({ start, end, shorthand, raw, ...node }) {
    const { type, operator, argument, kind } = node;
    if (kind === "const") return { ...node, kind: "let" };
    if (operator === "!" && [0, 1].includes(argument.value)) return { type: "Literal", value: argument.value === 0 };
    if (type === "UnaryExpression" && operator === "void") return { type: "Identifier", name: "undefined" };
    return node;
}

/** Compares two trees, and notes the pairs of their names in two maps; `path` is where they are. */
function compare(a, b, names, path = "") {
    if (Array.isArray(a)) {
        assert.equal(b.length, a.length, path);
        a.forEach((item, i) => compare(item, b[i], names, `${path}[${i}]`));
    } else if (a && typeof a === "object" && !(a instanceof RegExp)) {
        const [node, other] = [a, b].map(simplified);
        assert.deepEqual(Object.keys(other), Object.keys(node), path);
        if (node.type === "Identifier") {
            const pairs = [[node.name, other.name], [other.name, node.name]];
            pairs.forEach(([from, to], i) => {
                assert.equal(names[i].get(from) ?? to, to, path);
                names[i].set(from, to);
            });
        } else for (const [part, value] of Object.entries(node)) {
            if (isPropertyName(node, part)) assert.equal(other[part].name, value.name, path);
            else compare(value, other[part], names, `${path}.${part}`);
        }
    } else assert.deepEqual(b, a, path);
}

/** The names in a pattern. */
function namesIn(pattern) {
    if (!pattern) return [];
    const { type, name, elements, properties, left, argument, value } = pattern;
    if (type === "Identifier") return [name];
    return [...elements ?? properties ?? [], left, argument, type === "Property" && value].filter(Boolean).flatMap(namesIn);
}

/** The names that the statements of a block declare. */
function declaredBy(statements) {
    return statements.flatMap(({ declarations, id }) => (declarations ?? []).map((one) => one.id).concat(id ?? [])).flatMap(namesIn);
}

/** Adds the names in a tree that nothing around them declares: those of the browser. */
function findFree(node, scope, free) {
    if (Array.isArray(node)) node.forEach((item) => findFree(item, scope, free));
    if (!node?.type) return;
    if (node.type === "Identifier" && !scope.has(node.name)) free.add(node.name);
    const { body, params, param, init, left, id } = node;
    const isFunction = Boolean(params);
    const own = [...Array.isArray(body) ? declaredBy(body.filter((one) => one.type !== "MethodDefinition")) : [],
        ...isFunction ? [...params, id].flatMap(namesIn) : [], ...namesIn(param),
        ...[init, left].flatMap((part) => (part?.declarations ? declaredBy([part]) : []))];
    const inner = new Set([...scope, ...own]);
    for (const [part, value] of Object.entries(node)) {
        if (!isPropertyName(node, part)) findFree(value, inner, free);
    }
}

for (const [name, isLinked] of [["page.html", false], ["linked.html", true]]) {
    test(`the script of ${name} is that of its sources with other names of variables`, () => {
        const wanted = parse(sources(isLinked), OPTIONS);
        const names = [new Map(), new Map()];
        compare(wanted.body, parse(scriptOf(name), OPTIONS).body, names);
        const changed = [...names[0]].filter(([long, short]) => long !== short);
        assert.ok(changed.length > 500, `${changed.length} names`);
        const free = new Set();
        findFree(wanted, new Set(), free);
        assert.ok(["document", "window", "Math", "Uint32Array"].every((own) => free.has(own)), `${[...free]}`);
        assert.deepEqual(changed.filter(([long]) => free.has(long)), []);
    });
}

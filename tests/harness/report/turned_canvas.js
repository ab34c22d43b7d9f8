// A page with one canvas for turned.js, run by node: what it draws first, and after a drag and a key, as JSON.
"use strict";
const fs = require("node:fs");
const [script, page] = process.argv.slice(2).map((name) => fs.readFileSync(name, "utf8"));
const data = (name) => page.match(new RegExp(`data-${name}="([^"]*)"`))[1];
const figure = { hidden: true };
const heard = {};
let drawn = [];
let path = [];
const pen = {
  beginPath: () => (path = []),
  moveTo: (x, y) => path.push([x, y]),
  lineTo: (x, y) => path.push([x, y]),
  arc: (x, y) => path.push([x, y]),
  closePath: () => {},
  clearRect: () => (drawn = []),
  stroke: () => {},
  fill: () => drawn.push({ path, colour: pen.fillStyle }),
};
const canvas = {
  clientWidth: 600,
  clientHeight: 400,
  dataset: Object.fromEntries(["places", "faces", "colours", "marks"].map((name) => [name, data(name)])),
  getContext: () => pen,
  closest: () => figure,
  setPointerCapture: () => {},
  addEventListener: (name, call) => (heard[name] = call),
};
globalThis.document = { querySelectorAll: () => [canvas] };
globalThis.window = { devicePixelRatio: 1, requestAnimationFrame: (call) => call(), addEventListener: () => {} };
eval(script);
const shown = { hidden: figure.hidden, first: drawn };
heard.pointermove({ clientX: 50, clientY: 0 });
shown.untouched = drawn;
heard.pointerdown({ clientX: 0, clientY: 0, pointerId: 1 });
heard.pointermove({ clientX: 60, clientY: 20 });
heard.pointerup({});
shown.dragged = drawn;
heard.dblclick({});
shown.back = drawn;
heard.keydown({ key: "ArrowLeft", preventDefault: () => {} });
shown.key = drawn;
process.stdout.write(JSON.stringify(shown));

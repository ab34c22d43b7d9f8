// A painted surface on each canvas, turned by dragging or by the arrow keys. Without a script its figure stays
// hidden, and the still picture above it is all there is.
"use strict";
(() => {
  const LAMP = [-0.4, 0.5, 0.8].map((one) => one / Math.hypot(0.4, 0.5, 0.8));
  const AMBIENT = 0.45;
  const FRONT = { turn: -55, height: 35 };
  const DEGREES_PER_PIXEL = 0.5;
  const DEGREES_PER_KEY = 10;
  const KEYS = { ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const bytes = (text) => Uint8Array.from(atob(text), (one) => one.charCodeAt(0)).buffer;
  const triples = (flat) => Array.from({ length: flat.length / 3 }, (_, k) => [...flat.subarray(3 * k, 3 * k + 3)]);

  // Right, up and towards the viewer, who stands at these degrees about z and above.
  function view(turn, height) {
    const [a, h] = [turn, height].map((degrees) => (degrees * Math.PI) / 180);
    const towards = [Math.cos(a) * Math.cos(h), Math.sin(a) * Math.cos(h), Math.sin(h)];
    const right = [-Math.sin(a), Math.cos(a), 0];
    return [right, cross(towards, right), towards];
  }

  function bodyOf(data) {
    const places = triples(new Int16Array(bytes(data.places)));
    const colours = triples(new Uint8Array(bytes(data.colours)));
    const faces = triples(new Uint16Array(bytes(data.faces))).map((corners) => {
      const [a, b, c] = corners.map((one) => places[one]);
      const across = cross(b.map((one, k) => one - a[k]), c.map((one, k) => one - a[k]));
      const area = Math.hypot(...across) || 1;
      const colour = [0, 1, 2].map((k) => corners.reduce((sum, one) => sum + colours[one][k] / 3, 0));
      return { corners, colour, normal: across.map((one) => one / area) };
    });
    return { places, faces, marks: triples(new Int16Array(bytes(data.marks))) };
  }

  // What is seen, the farthest first: faces that look here, and the marks, a little in front of where they are.
  function seen(body, axes) {
    const flat = body.places.map((place) => axes.map((axis) => dot(axis, place)));
    const drawn = [];
    for (const face of body.faces) {
      if (dot(face.normal, axes[2]) <= 0) continue;
      const corners = face.corners.map((one) => flat[one]);
      drawn.push({ face, corners, depth: (corners[0][2] + corners[1][2] + corners[2][2]) / 3 });
    }
    for (const mark of body.marks) {
      const at = axes.map((axis) => dot(axis, mark));
      drawn.push({ at, depth: at[2] + 0.02 * body.reach });
    }
    return drawn.sort((one, other) => one.depth - other.depth);
  }

  function draw(canvas, body, turn, height) {
    const ratio = window.devicePixelRatio || 1;
    canvas.width = canvas.clientWidth * ratio;
    canvas.height = canvas.clientHeight * ratio;
    const pen = canvas.getContext("2d");
    const scale = (0.47 * Math.min(canvas.width, canvas.height)) / body.reach;
    const [x, y] = [canvas.width / 2, canvas.height / 2];
    const axes = view(turn, height);
    const lamp = axes[0].map((_, k) => axes.reduce((sum, axis, i) => sum + LAMP[i] * axis[k], 0));
    pen.clearRect(0, 0, canvas.width, canvas.height);
    pen.lineWidth = 0.7 * ratio;
    for (const one of seen(body, axes)) {
      pen.beginPath();
      if (one.face) {
        const light = AMBIENT + (1 - AMBIENT) * Math.abs(dot(one.face.normal, lamp));
        pen.fillStyle = `rgb(${one.face.colour.map((part) => Math.round(part * light)).join(",")})`;
        pen.strokeStyle = pen.fillStyle;
        one.corners.forEach((at, k) => pen[k ? "lineTo" : "moveTo"](x + scale * at[0], y - scale * at[1]));
        pen.closePath();
      } else {
        pen.fillStyle = "#fff";
        pen.strokeStyle = "#22252b";
        pen.arc(x + scale * one.at[0], y - scale * one.at[1], 3.5 * ratio, 0, 2 * Math.PI);
      }
      pen.fill();
      pen.stroke();
    }
  }

  for (const canvas of document.querySelectorAll("canvas.turned")) {
    const body = bodyOf(canvas.dataset);
    body.reach = Math.max(...body.places.map((place) => Math.hypot(...place)), 1);
    let { turn, height } = FRONT;
    let held = null;
    const redraw = () => window.requestAnimationFrame(() => draw(canvas, body, turn, height));
    const moved = (aside, up) => {
      turn += aside;
      height = Math.max(-90, Math.min(90, height + up));
      redraw();
    };
    canvas.closest("figure").hidden = false;
    canvas.addEventListener("pointerdown", (event) => {
      held = [event.clientX, event.clientY];
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (!held) return;
      moved(-(event.clientX - held[0]) * DEGREES_PER_PIXEL, (event.clientY - held[1]) * DEGREES_PER_PIXEL);
      held = [event.clientX, event.clientY];
    });
    for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, () => (held = null));
    canvas.addEventListener("dblclick", () => moved(FRONT.turn - turn, FRONT.height - height));
    canvas.addEventListener("keydown", (event) => {
      if (!(event.key in KEYS)) return;
      event.preventDefault();
      moved(...KEYS[event.key].map((one) => one * DEGREES_PER_KEY));
    });
    window.addEventListener("resize", redraw);
    redraw();
  }
})();

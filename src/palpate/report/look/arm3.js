/* A serial arm in space before a flat surface, from its joint positions; dragged, it is seen from elsewhere. */
"use strict";
palpate.arm3 = (canvas, scene, rest, changed) => {
  const { token, faded } = palpate;
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const plus = (a, s, b) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
  const times = (R, v) => R.map((row) => dot(row, v));
  const column = (R, j) => [R[0][j], R[1][j], R[2][j]];
  const product = (A, B) => A.map((row) => [0, 1, 2].map((j) => dot(row, column(B, j))));
  /* Origins of the joints' frames, and the tip: each joint's axis is the z of its own frame. */
  const bones = (q) => {
    let p = [0, 0, 0], R = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
    const places = [p];
    scene.at.forEach((at, i) => {
      p = plus(p, 1, times(R, at)); R = product(R, scene.turn[i]);
      if (scene.slide[i]) p = plus(p, q[i], column(R, 2));
      else { const c = Math.cos(q[i]), s = Math.sin(q[i]); R = product(R, [[c, -s, 0], [s, c, 0], [0, 0, 1]]); }
      places.push(p);
    });
    return [...places, plus(p, 1, times(R, scene.tip))];
  };
  const start = bones(rest), everything = [...start, ...scene.patch, ...start.map(([x, y]) => [x, y, 0])];
  const middle = [0, 1, 2].map((i) => (Math.min(...everything.map((p) => p[i])) + Math.max(...everything.map((p) => p[i]))) / 2);
  const round = Math.max(...everything.map((p) => Math.hypot(...plus(p, -1, middle))));
  const place = dot(scene.normal, scene.patch[0]);
  const view = { around: Math.atan2(middle[1], middle[0]) - 1.05, above: 0.31 };

  let held = null;
  canvas.style.cursor = "grab"; canvas.style.touchAction = "pan-y";
  canvas.addEventListener("pointerdown", (event) => { held = [event.clientX, event.clientY]; canvas.setPointerCapture(event.pointerId); });
  canvas.addEventListener("pointerup", () => { held = null; });
  canvas.addEventListener("pointercancel", () => { held = null; });
  canvas.addEventListener("pointermove", (event) => {
    if (!held) return;
    view.around -= 0.008 * (event.clientX - held[0]);
    view.above = Math.max(-0.2, Math.min(1.45, view.above + 0.008 * (event.clientY - held[1])));
    held = [event.clientX, event.clientY]; changed();
  });

  /* seen: q [rad, m], wall (of the surface along the normal) [m], depth [m], force [N]. */
  return (seen) => {
    const picture = palpate.picture(canvas);
    if (!picture) return;
    const { draw, wide, tall } = picture;
    const towards = [Math.cos(view.around) * Math.cos(view.above), Math.sin(view.around) * Math.cos(view.above), Math.sin(view.above)];
    const right = [-Math.sin(view.around), Math.cos(view.around), 0], up = cross(towards, right);
    const scale = 0.46 * Math.min(0.7 * wide, tall) / round; /* the lens has the left */
    const flat = (p) => { const d = plus(p, -1, middle); return [0.64 * wide + scale * dot(d, right), 0.5 * tall - scale * dot(d, up)]; };
    const path = (points, closed) => {
      draw.beginPath();
      points.map(flat).forEach(([x, y], i) => (i ? draw.lineTo(x, y) : draw.moveTo(x, y)));
      if (closed) draw.closePath();
    };
    const places = bones(seen.q), tip = places[places.length - 1];
    const surface = () => {
      path(scene.patch.map((p) => plus(p, seen.wall - place, scene.normal)), true);
      draw.fillStyle = faded("measured", 0.3); draw.fill();
      draw.strokeStyle = token("measured"); draw.lineWidth = 1.5; draw.stroke();
    };
    /* The floor: where the arm stands, and its shadow. */
    path([[0.12, 0.12, 0], [0.12, -0.12, 0], [-0.12, -0.12, 0], [-0.12, 0.12, 0]], true);
    draw.fillStyle = faded("quiet", 0.25); draw.fill();
    draw.lineCap = draw.lineJoin = "round";
    path(places.map(([x, y]) => [x, y, 0])); draw.strokeStyle = faded("quiet", 0.22); draw.lineWidth = 7; draw.stroke();
    const hidden = dot(towards, scene.normal) < 0;
    if (hidden) surface();
    path(places); draw.strokeStyle = token("ink"); draw.lineWidth = 9; draw.stroke();
    for (const [x, y] of places.slice(1, -1).map(flat)) {
      draw.beginPath(); draw.arc(x, y, 6, 0, 7); draw.fillStyle = token("card"); draw.fill();
      draw.lineWidth = 2.5; draw.strokeStyle = token("ink"); draw.stroke();
    }
    const [x, y] = flat(tip), [nx, ny] = flat(plus(tip, 0.1, scene.normal)), long = Math.hypot(nx - x, ny - y) || 1;
    draw.beginPath(); draw.arc(x, y, 6, 0, 7); draw.fillStyle = token("F"); draw.fill();
    if (!hidden) surface();
    /* Beside the arm, so that it is not drawn upon it. */
    const ux = (nx - x) / long, uy = (ny - y) / long;
    picture.arrow(x + 26 * Math.abs(uy), y - 26 * Math.abs(ux), ux, uy, seen.force);
    picture.lens(seen.depth);
  };
};

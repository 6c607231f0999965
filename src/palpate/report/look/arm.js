/* A planar arm before a surface, from its joint angles; a lens shows the last millimetres. */
"use strict";
/* What both pictures of an arm share: a cleared canvas, the force as an arrow, the lens. */
palpate.picture = (canvas) => {
  const { token, faded, figure } = palpate;
  const dense = devicePixelRatio || 1, wide = canvas.clientWidth, tall = canvas.clientHeight;
  if (!wide) return null;
  if (canvas.width !== Math.round(wide * dense)) canvas.width = Math.round(wide * dense);
  if (canvas.height !== Math.round(tall * dense)) canvas.height = Math.round(tall * dense);
  const draw = canvas.getContext("2d");
  draw.setTransform(dense, 0, 0, dense, 0, 0);
  draw.clearRect(0, 0, wide, tall);
  /* Ends at x, y, comes along (ux, uy), a unit vector; the number stands at its tail. */
  const arrow = (x, y, ux, uy, force) => {
    if (!(force > 0.3)) return;
    const long = Math.min(3 * force, 110), tail = Math.max(long, 16);
    draw.strokeStyle = draw.fillStyle = token("F"); draw.lineWidth = 3; draw.lineCap = "butt";
    draw.beginPath(); draw.moveTo(x - tail * ux, y - tail * uy); draw.lineTo(x - 8 * ux, y - 8 * uy); draw.stroke();
    draw.beginPath(); draw.moveTo(x, y);
    draw.lineTo(x - 10 * ux - 6 * uy, y - 10 * uy + 6 * ux); draw.lineTo(x - 10 * ux + 6 * uy, y - 10 * uy - 6 * ux); draw.fill();
    draw.font = "600 14px sans-serif"; draw.fillStyle = token("F-text");
    const flat = Math.abs(uy) < 0.5;
    draw.textAlign = flat ? "right" : "left"; draw.textBaseline = "alphabetic";
    draw.fillText(`${figure(force, 3)} N`, flat ? x - 2 : x - 0.5 * tail * ux + 10, flat ? y - 11 : y - 0.5 * tail * uy + 5);
  };
  const lens = (depth) => {
    const r = Math.min(62, 0.19 * tall), cx = r + 14, cy = tall - r - 12, mm = r / 4.6;
    const at = 1000 * depth, face = cx + 0.05 * r, into = mm * Math.max(0, Math.min(6, at));
    const tip = face + mm * Math.max(-5, Math.min(6, at));
    draw.save();
    draw.beginPath(); draw.arc(cx, cy, r, 0, 7); draw.fillStyle = token("paper"); draw.fill(); draw.clip();
    draw.beginPath(); draw.moveTo(face, cy - r); draw.lineTo(face, cy - 24);
    draw.bezierCurveTo(face, cy - 8, face + into, cy - 12, face + into, cy);
    draw.bezierCurveTo(face + into, cy + 12, face, cy + 8, face, cy + 24);
    draw.lineTo(face, cy + r); draw.lineTo(cx + r, cy + r); draw.lineTo(cx + r, cy - r);
    draw.fillStyle = faded("measured", 0.28); draw.fill();
    draw.setLineDash([4, 3]); draw.strokeStyle = token("quiet"); draw.lineWidth = 1;
    draw.beginPath(); draw.moveTo(face, cy - r); draw.lineTo(face, cy + r); draw.stroke(); draw.setLineDash([]);
    draw.strokeStyle = token("ink"); draw.lineWidth = 7; draw.lineCap = "butt";
    draw.beginPath(); draw.moveTo(tip - 12, cy); draw.lineTo(cx - r, cy); draw.stroke();
    draw.beginPath(); draw.arc(tip - 8, cy, 8, 0, 7); draw.fillStyle = token("F"); draw.fill();
    draw.restore();
    draw.strokeStyle = token("line"); draw.lineWidth = 1.5; draw.beginPath(); draw.arc(cx, cy, r, 0, 7); draw.stroke();
    draw.font = "12px sans-serif"; draw.textAlign = "left"; draw.fillStyle = token("quiet");
    draw.fillText(at < 0 ? `${(-at).toFixed(1)} mm away` : `${at.toFixed(2)} mm deep`, cx + r + 10, cy + 2);
    draw.fillText("the last millimetres", cx + r + 10, cy + 18);
  };
  return { draw, wide, tall, arrow, lens };
};
palpate.arm = (canvas, links) => {
  const { token, faded } = palpate;
  const joints = (q) => {
    let angle = 0, x = 0, y = 0;
    return [[0, 0], ...links.map((length, i) => {
      angle += q[i]; x += length * Math.cos(angle); y += length * Math.sin(angle);
      return [x, y];
    })];
  };
  /* Drawn once by light and once by dark. */
  const patterns = new Map();
  const hatch = (draw) => {
    const colour = faded("measured", 0.4);
    if (!patterns.has(colour)) {
      const tile = document.createElement("canvas"), pen = tile.getContext("2d");
      tile.width = tile.height = 11; pen.strokeStyle = colour; pen.lineWidth = 1;
      pen.beginPath(); for (const k of [-11, 0, 11]) { pen.moveTo(k - 1, 12); pen.lineTo(k + 12, -1); } pen.stroke();
      patterns.set(colour, draw.createPattern(tile, "repeat"));
    }
    return patterns.get(colour);
  };
  const reach = links.reduce((sum, length) => sum + length, 0);

  /* seen: q [rad], rest (q at the start, drawn pale), wall [m], depth [m], force [N], side (y of the tip [m]). */
  return (seen) => {
    const picture = palpate.picture(canvas);
    if (!picture) return;
    const { draw, wide, tall } = picture;
    const scale = Math.min(wide / (1.18 * reach), tall / (0.78 * reach));
    const left = (wide - 1.18 * scale * reach) / 2 + 0.11 * scale * reach, middle = 0.3 * tall;
    const px = (x) => left + scale * x, py = (y) => middle - scale * y;
    const wall = px(seen.wall), [tx, ty] = joints(seen.q)[links.length], depth = Math.max(0, seen.depth);
    const dent = Math.min(16, 4000 * depth);

    draw.beginPath();
    draw.moveTo(wall, 0);
    draw.lineTo(wall, py(ty) - 36);
    draw.bezierCurveTo(wall, py(ty) - 14, wall + dent, py(ty) - 12, wall + dent, py(ty));
    draw.bezierCurveTo(wall + dent, py(ty) + 12, wall, py(ty) + 14, wall, py(ty) + 36);
    draw.lineTo(wall, tall);
    draw.strokeStyle = token("measured"); draw.lineWidth = 1.5; draw.stroke();
    draw.lineTo(wide, tall); draw.lineTo(wide, 0); draw.closePath();
    draw.fillStyle = faded("measured", 0.16); draw.fill();
    draw.fillStyle = hatch(draw); draw.fill();

    const drawn = (q, colour, width, alpha) => {
      draw.globalAlpha = alpha; draw.strokeStyle = colour; draw.lineWidth = width;
      draw.lineCap = draw.lineJoin = "round";
      draw.beginPath();
      joints(q).forEach(([x, y], i) => (i ? draw.lineTo(px(x), py(y)) : draw.moveTo(px(x), py(y))));
      draw.stroke();
      draw.globalAlpha = 1;
    };
    if (seen.rest) drawn(seen.rest, token("quiet"), 2, 0.35);
    draw.fillStyle = token("quiet");
    draw.fillRect(px(0) - 20, py(0) + 14, 40, 4);
    draw.beginPath(); draw.moveTo(px(0) - 13, py(0) + 14); draw.lineTo(px(0) - 6, py(0)); draw.lineTo(px(0) + 6, py(0));
    draw.lineTo(px(0) + 13, py(0) + 14); draw.fill();
    drawn(seen.q, token("ink"), 9, 1);
    for (const [x, y] of joints(seen.q).slice(0, -1)) {
      draw.beginPath(); draw.arc(px(x), py(y), 8, 0, 7);
      draw.fillStyle = token("card"); draw.fill();
      draw.lineWidth = 2.5; draw.strokeStyle = token("ink"); draw.stroke();
    }
    draw.beginPath(); draw.arc(px(tx), py(ty), 6, 0, 7); draw.fillStyle = token("F"); draw.fill();
    picture.arrow(px(tx), py(ty) - 26, 1, 0, seen.force);
    picture.lens(seen.depth);
  };
};

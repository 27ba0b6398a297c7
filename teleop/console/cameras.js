// Camera previews with what was found in them: each image comes with its own detections, so that drawing
// and picture belong to the same instant.
const ACCEPTED = '#7fff7f';
const REFUSED = '#ff5c57';
const SEARCHED = '#5cb8ff';
const MISSED = '#8592a6';
const REPROJECTED = '#ffb454';
const AXES = ['#ff5c57', '#7fd17f', '#6f9cff'];

export function makeCameras(parent) {
  const views = new Map();
  const view = (id) => {
    if (!views.has(id)) {
      const figure = document.createElement('figure');
      const canvas = document.createElement('canvas');
      const caption = document.createElement('figcaption');
      figure.append(canvas, caption);
      parent.append(figure);
      views.set(id, { canvas, caption, busy: false });
    }
    return views.get(id);
  };
  return async (head, jpeg) => {
    const { canvas, caption } = view(head.camera);
    const it = views.get(head.camera);
    if (it.busy) return;
    it.busy = true;
    try {
      // Another machine's images stay there: only what was found in them comes.
      const bitmap = jpeg.size ? await createImageBitmap(jpeg) : null;
      // From here on without a pause: setting the size clears the picture.
      [canvas.width, canvas.height] = [head.width / 2, head.height / 2];
      const ctx = canvas.getContext('2d');
      if (bitmap) {
        ctx.drawImage(bitmap, 0, 0, canvas.width, canvas.height);
        bitmap.close();
      }
      overlay(ctx, head, canvas.width / head.width);
      const accepted = head.tags.filter((tag) => tag.accepted).length;
      const where = head.whole ? 'whole image searched' : head.regions.length ? `${head.regions.length} regions searched` : `${head.missed.length} covered`;
      caption.textContent = `${head.camera}${jpeg.size ? '' : ' (node)'} · ${accepted} of ${head.tags.length} tags · ${head.problem ?? where}`;
    } finally {
      it.busy = false;
    }
  };
}

function overlay(ctx, head, scale) {
  const at = ([x, y]) => [(x + 0.5) * scale, (y + 0.5) * scale];
  const outline = (corners, color) => {
    ctx.strokeStyle = color;
    ctx.beginPath();
    corners.forEach((corner, i) => (i ? ctx.lineTo(...at(corner)) : ctx.moveTo(...at(corner))));
    ctx.closePath();
    ctx.stroke();
  };
  ctx.lineWidth = 1;
  ctx.setLineDash([4, 3]);
  for (const [x, y, w, h] of head.regions) outline([[x, y], [x + w, y], [x + w, y + h], [x, y + h]], SEARCHED);
  // Expected and not read: a covered tag, mostly.
  for (const tag of head.missed) outline(tag.corners, MISSED);
  ctx.setLineDash([]);
  ctx.font = '11px system-ui, "DejaVu Sans", sans-serif';
  for (const tag of head.tags) {
    if (tag.reprojected) { ctx.lineWidth = 1; outline(tag.reprojected, REPROJECTED); }
    ctx.lineWidth = 1.5;
    outline(tag.corners, tag.accepted ? ACCEPTED : REFUSED);
    if (tag.accepted) continue;
    const off = tag.off_px === null ? '' : `, ${tag.off_px.toFixed(1)} px off`;
    label(ctx, `${tag.id}: ${tag.fate}${off}`, at(tag.corners[2]), REFUSED);
  }
  ctx.font = '12px system-ui, "DejaVu Sans", sans-serif';
  for (const shell of head.axes) {
    const origin = at(shell.origin);
    ctx.lineWidth = 2.5;
    shell.ends.forEach((end, i) => {
      if (!end) return;
      ctx.strokeStyle = AXES[i];
      ctx.beginPath();
      ctx.moveTo(...origin);
      ctx.lineTo(...at(end));
      ctx.stroke();
    });
    label(ctx, shell.name.replace('_', ' '), origin, '#fff');
  }
}

function label(ctx, text, [x, y], color) {
  ctx.lineWidth = 3;
  ctx.strokeStyle = '#000c';
  ctx.strokeText(text, x + 6, y - 6);
  ctx.fillStyle = color;
  ctx.fillText(text, x + 6, y - 6);
}

// Camera previews with what was found in them: each image comes with its own detections, so that drawing
// and picture belong to the same instant.
const ACCEPTED = '#7fff7f';
const REFUSED = '#ff5c57';
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
      const bitmap = await createImageBitmap(jpeg);
      canvas.width = bitmap.width;
      canvas.height = bitmap.height;
      const ctx = canvas.getContext('2d');
      ctx.drawImage(bitmap, 0, 0);
      bitmap.close();
      overlay(ctx, head, canvas.width / head.width);
      caption.textContent = `${head.camera} · ${head.tags.length} tags · ${head.dropped} dropped`;
    } finally {
      it.busy = false;
    }
  };
}

function overlay(ctx, head, scale) {
  const at = ([x, y]) => [(x + 0.5) * scale, (y + 0.5) * scale];
  ctx.lineWidth = 1.5;
  for (const tag of head.tags) {
    ctx.strokeStyle = tag.accepted ? ACCEPTED : REFUSED;
    ctx.beginPath();
    tag.corners.forEach((corner, i) => (i ? ctx.lineTo(...at(corner)) : ctx.moveTo(...at(corner))));
    ctx.closePath();
    ctx.stroke();
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
    const label = shell.name.replace('_', ' ');
    ctx.lineWidth = 3;
    ctx.strokeStyle = '#000c';
    ctx.strokeText(label, origin[0] + 6, origin[1] - 6);
    ctx.fillStyle = '#fff';
    ctx.fillText(label, origin[0] + 6, origin[1] - 6);
  }
}

// The WebSocket to the station: status as JSON, camera previews as binary, requests back. It reconnects.

/** Previews: 4 bytes length (little endian), that many bytes of JSON, then the JPEG. */
function unpack(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  return { head, jpeg: new Blob([new Uint8Array(buffer, 4 + length)], { type: 'image/jpeg' }) };
}

export function connect({ onStatus, onPreview, onOpen, onClose }) {
  let socket = null;
  const open = () => {
    socket = new WebSocket(`ws://${location.host}/ws`);
    socket.binaryType = 'arraybuffer';
    socket.onopen = onOpen;
    socket.onmessage = ({ data }) => {
      if (typeof data === 'string') onStatus(JSON.parse(data));
      else { const { head, jpeg } = unpack(data); onPreview(head, jpeg); }
    };
    socket.onclose = () => { onClose(); setTimeout(open, 500); };
  };
  open();
  return {
    send(message) {
      if (socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
    },
  };
}

// Fetches a file of the daemon in pieces, each after the answer to the one before, and gives it to
// the browser to keep.

// ask(request): a promise of the reply. progress(share): 0 to 1. part: {as, from_s, to_s}, to have
// that part as another kind of file. Resolves to {blob} or {error}.
export async function fetchRecording(ask, { name, bytes }, progress, part = {}) {
  const pieces = [];
  let offset = 0;
  for (;;) {
    const reply = await ask({ fetch_recording: { name, offset, ...part } });
    if (!reply.ok) return { error: reply.error };
    const size = reply.piece?.length ?? 0;
    if (size === 0) return { blob: new Blob(pieces) };
    pieces.push(reply.piece.slice()); // the message is larger, and is not kept for it
    offset += size;
    progress(bytes > 0 ? Math.min(1, offset / bytes) : 1);
  }
}

export function keepFile(blob, name) {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60000);
}

// posed-20261123T013005.png: of a file that is made now
export function nameByTime(ending) {
  const time = new Date(Date.now() - 60000 * new Date().getTimezoneOffset()).toISOString();
  return `posed-${time.slice(0, 19).replace(/[-:]/g, '')}.${ending}`;
}

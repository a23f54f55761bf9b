// Sends a model file in pieces, each after the answer to the one before.

export const PIECE_BYTES = 32 * 1024;
export const MOST_BYTES = 16 * 1024 * 1024;

const hex = (bytes) => Array.from(bytes, (byte) => byte.toString(16).padStart(2, '0')).join('');

const refused = (error) => ({ ok: false, error, stream: '', sequence: 0 });

// ask(request): a promise of the reply. progress(share): 0 to 1. Resolves to the reply to the last
// piece, or to the first refusal.
export async function sendModel(ask, stream, name, bytes, progress) {
  if (bytes.length === 0) return refused('the file is empty');
  if (bytes.length > MOST_BYTES) return refused('the file is larger than 16 MiB: it is no model');
  if (!globalThis.crypto?.subtle) {
    return refused('the browser has no SHA-256 here: open the page as http://127.0.0.1');
  }
  const sha256 = hex(new Uint8Array(await crypto.subtle.digest('SHA-256', bytes)));
  let reply;
  for (let offset = 0; offset < bytes.length; offset += PIECE_BYTES) {
    const piece = bytes.subarray(offset, offset + PIECE_BYTES);
    const part = { stream, sha256, total: bytes.length, offset, bytes: piece, name };
    reply = await ask({ model_part: part });
    if (!reply.ok) return reply;
    progress(Math.min(1, (offset + piece.length) / bytes.length));
  }
  return reply;
}
